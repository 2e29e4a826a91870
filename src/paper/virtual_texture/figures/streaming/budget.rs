//! vt.budget: recovery of the picture after a cut, for several upload budgets.

use super::super::common::{MIB, ONE_SAMPLE, samples};
use super::traces::{ROUNDS, Trace, repeated};
use super::{SettledView, session, show_beside};
use crate::figure::prelude::*;
use crate::frame::Run;
use crate::math::camera::Pose;
use crate::paper::virtual_texture::VirtualTexture;
use crate::paper::virtual_texture::streaming::Order;
use crate::picture::Picture;
use crate::picture::error::compare;
use std::time::{Duration, Instant};

struct Budget {
    name: &'static str,
    upload_ms: f64,
    order: Order,
    na: u32,
}

const BUDGETS: [Budget; 7] = [
    Budget { name: "0.5 ms", upload_ms: 0.5, order: Order::Finest, na: 1 },
    Budget { name: "0.5 ms, coarsest first", upload_ms: 0.5, order: Order::Coarsest, na: 1 },
    Budget { name: "1 ms", upload_ms: 1.0, order: Order::Finest, na: 1 },
    Budget { name: "2 ms", upload_ms: 2.0, order: Order::Finest, na: 1 },
    Budget { name: "4 ms", upload_ms: 4.0, order: Order::Finest, na: 1 },
    Budget { name: "4 ms, coarsest first", upload_ms: 4.0, order: Order::Coarsest, na: 1 },
    Budget { name: "4 ms, NA = 16", upload_ms: 4.0, order: Order::Finest, na: 16 },
];

const ERROR: &str = "error after the cut";
const ERROR_MS: &str = "error after the cut, by time";
const FRAMES_50: &str = "frames until 50 % of the error is gone";
const FRAMES_95: &str = "frames until 95 % of the error is gone";
const SUM: &str = "summed error";
const MS_50: &str = "time until 50 % of the error is gone";
const COPIED: &str = "copied until the picture is complete";
const MS_95: &str = "time until 95 % of the error is gone";

/// Frames after which a recovery is given up.
const MAX_FRAMES: usize = 400;

pub const BUDGET: Figure = Figure {
    id: "vt.budget",
    title: "The picture after a cut, by upload budget",
    about: "The camera jumps to another view, and the tiles of the new picture arrive within the upload budget. In the \
            paper (section 3), tiles beyond the budget wait for the next frame. No numbers are given. The error is the \
            NMSE in linear light against the settled picture. The figure counts the frames and the time until 50 % and \
            95 % of the first frame's error are gone permanently. The tiles are in main memory, so the disk has no \
            influence. The host waits for each frame, so the times are those of this device. Each budget is measured 6 \
            times, in turn, each time with new caches that hold the tiles of the first view. Pictures have 960 x 540 \
            (quick) or 1920 x 1080 pixels, with one sample each (NA = 1). One variant has the paper's NA = 16 \
            with a border of 16 texels: it needs tiles of finer levels, and its frames take longer.",
    scenes: &["earth/oblique"],
    variants: || BUDGETS.iter().map(|budget| budget.name.to_owned()).collect(),
    paper: &["0.5 ms", "1 ms", "2 ms", "4 ms"],
    show: Show::scenes(ONE_SAMPLE).variants(settings),
    measure,
    plots: &[Plot::curves(ERROR, "frame").log_y(), Plot::curves(ERROR_MS, "time, ms").log_x().log_y()],
    claims: &[
        Claim::paper_timed(
            "3",
            "left-over-waits",
            "Tiles beyond the upload budget wait for the next frame: a budget of 0.5 ms takes more frames than one of \
             4 ms until 95 % of the error is gone, and none is lost.",
            &[
                Test::ratio_of(FRAMES_95, ["0.5 ms", "4 ms"], Above(1.0)),
                // Infinite if a tile never arrives.
                Test::value(one(FRAMES_95, "0.5 ms"), AtMost(MAX_FRAMES as f64)),
            ],
        ),
        Claim::ours_timed(
            "coarsest-first-errs-less",
            "Requesting the coarsest tiles first gives a smaller error, summed over the frames after a cut.",
            &[
                Test::ratio(one(SUM, "0.5 ms"), one(SUM, "0.5 ms, coarsest first"), Above(1.0)),
                Test::ratio(one(SUM, "4 ms"), one(SUM, "4 ms, coarsest first"), Above(1.0)),
            ],
        ),
    ],
    ..Figure::BASE
};

/// The variants as settings of a scene.
fn settings() -> Vec<Setting> {
    let changes = |budget: &Budget| {
        let order = budget.order.name();
        let own = [format!("cache.upload_budget_ms={:?}", budget.upload_ms), format!("cache.order={order}")];
        [own.into(), samples(budget.na)].concat()
    };
    BUDGETS.iter().map(|budget| Setting::new(budget.name, changes(budget))).collect()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let size = bench.effort_of([960, 540], [1920, 1080]);
    let one = SettledView::of(bench, &cell.scene, 1, size)?;
    let sixteen = SettledView::of(bench, &cell.scene, 16, size)?;
    let mut shown = false;
    let cuts = Bench::in_turn(ROUNDS, BUDGETS.len(), |at| {
        let budget = &BUDGETS[at];
        let view = if budget.na == 1 { &one } else { &sixteen };
        let mut session = session(bench, &view.scene, view.source.clone(), size, |settings| {
            settings.streaming.upload_budget_ms = budget.upload_ms;
            settings.streaming.load_budget_ms = 1e3;
            settings.streaming.upload_tiles_per_frame = 64;
            settings.streaming.order = budget.order;
        })?;
        session.settle(&view.scene.camera(&view.scene.view.camera)?.pose())?;
        let (cut, first) = cut(&mut session, &view.pose, &view.truth)?;
        if !std::mem::replace(&mut shown, true) {
            let name = format!("vt.budget-{}-first-frame", cell.scene.replace('/', "-"));
            show_beside(bench, &name, &first, &view.truth)?;
        }
        Ok(cut)
    })?;
    Ok(BUDGETS.iter().zip(&cuts).flat_map(|(budget, cuts)| of_cuts(budget.name, cuts)).collect())
}

/// The frames after a cut until the picture is complete.
struct Cut {
    trace: Trace,
    /// Bytes copied to the tile pool.
    copied: u64,
}

/// Draws frames from `pose` until no tile is missing; returns their errors and the first picture.
fn cut(session: &mut Run<VirtualTexture>, pose: &Pose, truth: &Picture) -> anyhow::Result<(Cut, Picture)> {
    let mut trace = Trace::default();
    let mut first = None;
    let mut spent = Duration::ZERO;
    let before = session.records.len();
    while trace.0.len() < MAX_FRAMES && (trace.0.is_empty() || !session.settled()) {
        let begin = Instant::now();
        session.frame(pose)?;
        session.drain()?;
        spent += begin.elapsed();
        let shown = session.linear_picture()?;
        trace.0.push([1e3 * spent.as_secs_f64(), compare(&shown, truth)?.nmse()]);
        first.get_or_insert(shown);
    }
    let copied = session.records[before..].iter().map(|record| record.streaming.upload_bytes).sum();
    Ok((Cut { trace, copied }, first.context("a cut shows a frame")?))
}

fn of_cuts(name: &str, cuts: &[Cut]) -> Vec<Row> {
    let over = |quantity, unit, of: &dyn Fn(&Cut) -> Option<f64>| repeated(name, quantity, unit, cuts, of);
    let (half, max) = (|cut: &Cut| cut.trace.reached(0.5), |cut: &Cut| cut.trace.reached(0.05));
    let traces: Vec<Trace> = cuts.iter().map(|cut| cut.trace.clone()).collect();
    vec![
        Row::new(name, ERROR, "NMSE", Value::Spreads(Trace::by_frame(&traces))),
        Row::new(name, ERROR_MS, "NMSE", Value::Spreads(Trace::by_time(&traces))),
        over(FRAMES_50, "frames", &|cut| Some(half(cut)?.0)),
        over(FRAMES_95, "frames", &|cut| Some(max(cut)?.0)),
        over(SUM, "NMSE x frames", &|cut| Some(cut.trace.0.iter().map(|[_, error]| error).sum())),
        over(MS_50, "ms", &|cut| Some(half(cut)?.1)),
        over(MS_95, "ms", &|cut| Some(max(cut)?.1)),
        over(COPIED, "MiB", &|cut| Some(cut.copied as f64 / MIB)),
    ]
}
