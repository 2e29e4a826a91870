//! Execution of levels on one core: the paper's pseudocode and the flat lists, with and without tswaps.

use super::MOVED;
use super::lines::{self, LINES};
use crate::figure::{Contender, Row, Timed};
use crate::frame::Run;
use crate::math::camera::Pose;
use crate::paper::progressive_mesh::ProgressiveMeshes;
use crate::paper::progressive_mesh::choices::BuildEffort;
use crate::paper::progressive_mesh::figures::orders::{Executable, ordered, simplified_with};
use crate::paper::progressive_mesh::order::OrderOptions;
use crate::paper::progressive_mesh::run::{IgnoreWrites, Instances, Program, State};
use crate::vk::PassTime;
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

pub const PRINTED: &str = "pseudocode, splits only";
pub const PRINTED_SWAPS: &str = "pseudocode, 23 moves";
pub const FLAT: &str = "flat lists, splits only";
pub const FLAT_FEW: &str = "flat lists, 10 moves";
pub const FLAT_SWAPS: &str = "flat lists, 23 moves";
pub const COPY: &str = "memory copy of the index buffer";
/// A whole frame of one instance without a level change.
pub const FRAME: &str = "a drawn frame";

pub const SPLITS_UP: &str = "splits per second";
pub const SPLITS_DOWN: &str = "collapses per second";
pub const STEP: &str = "a hundredth of the splits";
pub const LOADED: &str = "host's work for a frame with a hundredth of the splits";
pub const FRAME_HOST: &str = "host's work for a frame without a level change";
pub const FRAME_WHOLE: &str = "whole time of a frame without a level change";
pub const COMMANDS: &str = "bytes of commands for each split";
pub const WRITTEN: &str = "bytes written for each split";
pub const STATE: &str = "bytes of state for each of 500 instances";
pub const SLICES: &str = "bytes of index buffer for each live face";

const UP: &str = "all splits";
const DOWN: &str = "all collapses";
const STEPS: &str = "all splits in 100 steps";
const ALONE: &str = "host";
const DRAWN: &str = "until it is drawn";

/// One mesh in the orders of the comparison.
pub struct Orders {
    classical: Executable,
    few: Executable,
    pub best: Executable,
}

impl Orders {
    /// Builds the orders of a shipped or fetched model.
    pub fn of(name: &str) -> anyhow::Result<Orders> {
        let (model, collapses) = simplified_with(name, BuildEffort::Fast)?;
        let with = |options: Option<&OrderOptions>| Executable::new(ordered(&model, &collapses, options));
        let (best, few) =
            rayon::join(|| with(Some(&OrderOptions::TAIL_23)), || with(Some(&OrderOptions::TAIL_10)));
        Ok(Orders { classical: with(None)?, few: few?, best: best? })
    }

    /// Each variant: name, order, and true for the pseudocode.
    fn variants(&self) -> [(&'static str, &Executable, bool); 5] {
        [
            (PRINTED, &self.classical, true),
            (PRINTED_SWAPS, &self.best, true),
            (FLAT, &self.classical, false),
            (FLAT_FEW, &self.few, false),
            (FLAT_SWAPS, &self.best, false),
        ]
    }
}

/// Goes through all levels up, all levels down, and up again in a hundred steps.
fn ways<'a>(variant: &str, last: u32, mut go_to: impl FnMut(u32) + 'a) -> Contender<'a> {
    Contender::new(variant, move || {
        let (up, down) = (PassTime::of_host(UP, || go_to(last)), PassTime::of_host(DOWN, || go_to(0)));
        let steps = PassTime::of_host(STEPS, || (1..=100).for_each(|n| go_to(hundredth(last, n))));
        go_to(0);
        Ok(vec![up, down, steps])
    })
}

/// The level after `n` hundredths of all splits.
pub fn hundredth(last: u32, n: u32) -> u32 {
    (u64::from(last) * u64::from(n) / 100) as u32
}

/// The timed work on one core.
pub fn contenders<'a>(
    session: &'a mut (Run<ProgressiveMeshes>, Pose),
    orders: &'a Orders,
) -> Vec<Contender<'a>> {
    let last = orders.best.mesh.last_level();
    let mut contenders: Vec<Contender> = Vec::new();
    for (variant, Executable { mesh, program }, printed) in orders.variants() {
        contenders.push(if printed {
            let mut state = State::new(mesh);
            ways(variant, last, move |level| state.go_to(mesh, level))
        } else {
            let (mut faces, mut at, mut kept) = (program.faces().to_vec(), 0, Vec::new());
            ways(variant, last, move |level| {
                program.run(&mut faces, at, level, &mut kept, &mut IgnoreWrites);
                at = level;
            })
        });
    }
    let (from, mut to) = (&*orders.best.mesh.faces, orders.best.mesh.faces.clone());
    contenders.push(Contender::new(COPY, move || {
        Ok(vec![PassTime::of_host(ALONE, || {
            to.copy_from_slice(black_box(from));
            black_box(&mut to);
        })])
    }));
    contenders.push(Contender::new(FRAME, move || drawn(session)));
    contenders
}

/// A frame as in scenes: the host's time, and the time until the device is done.
fn drawn((session, pose): &mut (Run<ProgressiveMeshes>, Pose)) -> anyhow::Result<Vec<PassTime>> {
    session.records.take();
    let start = Instant::now();
    session.frame(pose)?;
    let host = start.elapsed().as_nanos() as u64;
    session.drain()?;
    let whole = start.elapsed().as_nanos() as u64;
    Ok(vec![PassTime::new(ALONE, Some(host)), PassTime::new(DRAWN, Some(whole))])
}

/// Rows of times.
pub fn time_rows(splits: u32, timed: &[Timed]) -> Vec<Row> {
    let host = timed.iter().find(|one| one.variant == FRAME).and_then(|frame| frame.pass_of_rounds(ALONE));
    let mut rows = Vec::new();
    for one in timed {
        let of = |label| one.pass_of_rounds(label);
        let mut row = |quantity: &str, unit: &str, rounds: Option<Vec<f64>>| {
            rows.extend(rounds.map(|rounds| Row::of_rounds(&one.variant, quantity, unit, Some(rounds))));
        };
        if one.variant == FRAME {
            row(FRAME_HOST, "ms", of(ALONE));
            row(FRAME_WHOLE, "ms", of(DRAWN));
            continue;
        }
        let step = of(STEPS).map(|steps| steps.iter().map(|ms| 0.01 * ms).collect::<Vec<_>>());
        let both = host.as_ref().zip(step.as_ref());
        row(LOADED, "ms", both.map(|(host, step)| host.iter().zip(step).map(|(a, b)| a + b).collect()));
        row(UP, "ms", of(UP).or(of(ALONE)));
        row(DOWN, "ms", of(DOWN));
        row(STEP, "ms", step.or(of(ALONE)));
        for (quantity, label) in [(SPLITS_UP, UP), (SPLITS_DOWN, DOWN)] {
            let rate = |ms: f64| f64::from(splits) / ms / 1e3;
            row(quantity, "millions", of(label).map(|rounds| rounds.into_iter().map(rate).collect()));
        }
    }
    rows
}

/// Rows of counts.
pub fn count_rows(orders: &Orders) -> Vec<Row> {
    let mut rows = Vec::new();
    for (variant, Executable { mesh, program }, printed) in orders.variants() {
        let splits = f64::from(mesh.last_level());
        let mut row = |quantity: &str, unit: &str, number: f64| {
            rows.push(Row::number(variant, quantity, unit, number));
        };
        let moved = mesh.swaps.cycles.items().len() as f64;
        let corners = mesh.splits.slots.items().len() as f64;
        row(MOVED, "faces", moved / splits);
        row(WRITTEN, "bytes", (4.0 * corners + 12.0 * moved) / splits);
        if !printed {
            row(LINES, "lines", lines::for_each_split(program));
        }
        let as_stored = 4 * mesh.splits.split_vertices.len()
            + mesh.splits.slots.bytes()
            + mesh.swaps.cycles.bytes()
            + 4 * (mesh.swaps.levels.len() + mesh.swaps.cycle_ends.len());
        let bytes = if printed { as_stored } else { program.command_bytes() };
        row(COMMANDS, "bytes", bytes as f64 / splits);
    }
    rows
}

/// The memory per instance of 500 instances with about 1000 faces, at as many different levels as possible.
pub fn herd_rows(program: Program) -> anyhow::Result<Vec<Row>> {
    let last = program.levels().partition_point(|level| level.faces <= 2000) as u32 - 1;
    let mut herd = Instances::new(Arc::new(program), 500)?;
    (0..500).try_for_each(|n| herd.go_to(n, (n as u64 * u64::from(last) / 499) as u32))?;
    let live: usize = (0..500).map(|n| herd.faces(n).len()).sum();
    let number = |quantity: &str, number: f64| Row::number(FLAT_SWAPS, quantity, "bytes", number);
    Ok(vec![
        number(STATE, herd.state_bytes() as f64 / 500.0),
        number(SLICES, 12.0 * herd.buffer().len() as f64 / live as f64),
    ])
}
