//! CPU cache lines that a level change touches. The paper's optimizer has a weight for them.

use super::MOVED;
use crate::figure::Row;
use crate::paper::progressive_mesh::choices::BuildEffort;
use crate::paper::progressive_mesh::figures::orders::{moved_per_split, ordered, simplified_with};
use crate::paper::progressive_mesh::order::{OrderOptions, Weights};
use crate::paper::progressive_mesh::run::{Program, WriteObserver};
use std::ops::Range;

pub const LINES: &str = "64-byte lines touched for each split";
pub const GREEDY: &str = "the paper's greedy";
pub const NO_WEIGHT: &str = "the paper's greedy, no weight for lines";

/// Words in a 64-byte line of the index buffer. A line holds 5 1/3 faces.
const LINE_WORDS: usize = 16;

/// Counts the cache lines that each step writes in an index buffer. A line counts once per step.
struct Lines {
    /// The step in which a line was last written.
    written: Vec<u32>,
    step: u32,
    count: u64,
}

impl Lines {
    fn of(faces: usize) -> Lines {
        Lines { written: vec![u32::MAX; (3 * faces).div_ceil(LINE_WORDS)], step: 0, count: 0 }
    }
}

impl WriteObserver for Lines {
    fn word(&mut self, word: usize) {
        let written = &mut self.written[word / LINE_WORDS];
        self.count += u64::from(*written != self.step);
        *written = self.step;
    }

    fn faces(&mut self, slots: Range<usize>) {
        (3 * slots.start..3 * slots.end).for_each(|word| self.word(word));
    }
}

/// Cache lines touched per split on the way up, with one level per step. Counts the lines that splits and
/// tswaps write. Splits and tswaps read no other lines.
pub fn for_each_split(program: &Program) -> f64 {
    let (mut faces, mut kept) = (program.faces().to_vec(), Vec::new());
    let mut lines = Lines::of(faces.len());
    for level in 0..program.last_level() {
        lines.step = level;
        program.run(&mut faces, level, level + 1, &mut kept, &mut lines);
    }
    lines.count as f64 / f64::from(program.last_level().max(1))
}

/// The paper's greedy with and without its weight for lines that earlier operations touched.
pub fn weighed_rows(name: &str) -> anyhow::Result<Vec<Row>> {
    let (model, collapses) = simplified_with(name, BuildEffort::Fast)?;
    let without = Weights { line: 0.0, ..OrderOptions::PAPER.weights };
    let mut rows = Vec::new();
    for (variant, weights) in [(GREEDY, OrderOptions::PAPER.weights), (NO_WEIGHT, without)] {
        let options = OrderOptions { weights, ..OrderOptions::PAPER };
        let mesh = ordered(&model, &collapses, Some(&options));
        rows.push(Row::number(variant, LINES, "lines", for_each_split(&Program::new(&mesh)?)));
        rows.push(Row::number(variant, MOVED, "faces", moved_per_split(&mesh)));
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_counts_once_a_step() {
        let mut lines = Lines::of(20);
        // Words 15 to 17: the end of one line and the start of the next.
        lines.faces(5..6);
        lines.word(15);
        assert_eq!(lines.count, 2);
        lines.step = 1;
        lines.word(0);
        lines.word(59);
        assert_eq!(lines.count, 4);
    }
}
