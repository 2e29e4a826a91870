//! Levels finer than the base. The ground is interpolated, gets one more octave of noise, and is coloured again. The
//! interpolation is bilinear between centres; repeated over octaves it converges to a surface with a continuous
//! slope.
//!
//! In the source `earth` the mean of four children is exactly their parent, because the parent is a photograph. Here
//! parent and children are the same function of the ground. If the mean of the children were forced to equal the
//! parent, the base's texels would be visible as squares of 100 m wherever snow meets rock.

use super::base::{BASE_LOG2, TerrainBase, noise_share};
use super::ground::{FIELDS, Fields, NOISE, second_parent};
use super::noise::octave;
use std::ops::Range;

/// The ground of a rectangle of one level, entirely inside the map.
pub struct TerrainRegion {
    columns: Range<usize>,
    rows: Range<usize>,
    ground: Vec<Fields>,
}

impl TerrainRegion {
    /// Row `y` from column `x`.
    pub fn row(&self, x: usize, y: usize) -> &[Fields] {
        let end = (y + 1 - self.rows.start) * self.columns.len();
        &self.ground[self.place(x, y)..end]
    }

    fn place(&self, x: usize, y: usize) -> usize {
        (y - self.rows.start) * self.columns.len() + (x - self.columns.start)
    }
}

fn parents_of(span: &Range<usize>) -> Range<usize> {
    span.start / 2..span.end.div_ceil(2)
}

fn with_neighbours(span: &Range<usize>, width_log2: u32) -> Range<usize> {
    span.start.saturating_sub(1)..(span.end + 1).min(1 << width_log2)
}

/// A rectangle of the level whose width is `2^width_log2` texels, and the region of the next coarser level from which
/// it was refined (`None` in the base). The rectangle may be one texel larger than requested on each side. The coarser
/// region also contains the neighbours that the interpolation reads.
pub fn region(
    base: &TerrainBase,
    width_log2: u32,
    columns: Range<usize>,
    rows: Range<usize>,
) -> (TerrainRegion, Option<TerrainRegion>) {
    if width_log2 == BASE_LOG2 {
        return (of_base(base, columns, rows), None);
    }
    let [across, down] = [parents_of(&columns), parents_of(&rows)];
    let neighbours = |span| with_neighbours(span, width_log2 - 1);
    let (coarser, _) = region(base, width_log2 - 1, neighbours(&across), neighbours(&down));
    (refine(width_log2, &coarser, across, down), Some(coarser))
}

fn of_base(base: &TerrainBase, columns: Range<usize>, rows: Range<usize>) -> TerrainRegion {
    let row = |y: usize| &base.ground[(y << BASE_LOG2) + columns.start..(y << BASE_LOG2) + columns.end];
    let ground = rows.clone().flat_map(row).copied().collect();
    TerrainRegion { columns, rows, ground }
}

/// 3/4 of the nearer plus 1/4 of the farther.
#[inline(always)]
fn between(near: &Fields, far: &Fields) -> Fields {
    std::array::from_fn(|n| 0.75 * near[n] + 0.25 * far[n])
}

/// All children of a rectangle of parents; `coarser` holds the parents and their neighbours.
fn refine(
    width_log2: u32,
    coarser: &TerrainRegion,
    across: Range<usize>,
    down: Range<usize>,
) -> TerrainRegion {
    let (width, last) = (2 * across.len(), (1 << (width_log2 - 1)) - 1);
    let (columns, rows) = (2 * across.start..2 * across.end, 2 * down.start..2 * down.end);
    let share = noise_share(width_log2);
    let mut ground = Vec::with_capacity(width * rows.len());
    let mut line = vec![[0.0; FIELDS]; coarser.columns.len()];
    for y in rows.clone() {
        let [near, far] = [y / 2, second_parent(y, last)].map(|row| coarser.row(coarser.columns.start, row));
        for (between_rows, (near, far)) in line.iter_mut().zip(near.iter().zip(far)) {
            *between_rows = between(near, far);
        }
        for x in columns.clone() {
            let [near, far] = [x / 2, second_parent(x, last)].map(|x| &line[x - coarser.columns.start]);
            let mut fields = between(near, far);
            let own = octave(width_log2, x as i32, y as i32);
            fields[NOISE] += share * own[0];
            fields[NOISE + 1] += share * own[1];
            ground.push(fields);
        }
    }
    TerrainRegion { columns, rows, ground }
}
