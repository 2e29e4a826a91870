//! vt.budget: how the picture recovers from a cut, for budgets of A2.

use super::traces::{ROUNDS, Trace, repeated};
use super::{Remembered, picture, session, show_beside};
use crate::figure::{
    Axis, Bench, Cell, Claim, Effort, Figure, Finding, Origin, Plot, Row, Table, Value, Verdict,
};
use crate::frame::Run;
use crate::math::camera::Pose;
use crate::paper::virtual_texture::VirtualTexture;
use crate::paper::virtual_texture::config::open_texture;
use crate::paper::virtual_texture::streaming::Order;
use crate::picture::Picture;
use crate::picture::error::compare;
use crate::scene::Scene;
use crate::stats::Summary;
use anyhow::Context;
use std::time::{Duration, Instant};

struct Budget {
    name: &'static str,
    upload_ms: f64,
    order: Order,
}

const BUDGETS: [Budget; 6] = [
    Budget { name: "0.5 ms", upload_ms: 0.5, order: Order::Finest },
    Budget { name: "0.5 ms, coarsest first", upload_ms: 0.5, order: Order::Coarsest },
    Budget { name: "1 ms", upload_ms: 1.0, order: Order::Finest },
    Budget { name: "2 ms", upload_ms: 2.0, order: Order::Finest },
    Budget { name: "4 ms", upload_ms: 4.0, order: Order::Finest },
    Budget { name: "4 ms, coarsest first", upload_ms: 4.0, order: Order::Coarsest },
];

const ERROR: &str = "error after the cut";
const ERROR_MS: &str = "error after the cut, by time";
const FRAMES_50: &str = "frames to 50 %";
const FRAMES_95: &str = "frames to 95 %";
const SUM: &str = "summed error";
const MS_50: &str = "time to 50 %";
const MS_95: &str = "time to 95 %";

/// No path to a picture takes so long.
const MOST_FRAMES: usize = 400;

/// The figure.
pub const BUDGET: Figure = Figure {
    id: "vt.budget",
    title: "The picture after a cut, for budgets of copying",
    about: "The camera jumps to another place, and the tiles of the new picture come as the budget of A2 allows \
            (paper, section 3: what is left over waits for the next frame; no numbers). The error is the NMSE in linear \
            light against the settled picture; 50 and 95 % are the shares of the first frame's error that are gone for \
            good. The tiles lie in memory, so the disk binds nothing; times are of this device, each frame waited for. Each budget \
            recovers 3 times from empty caches, all in turn. 960 x 540 (quick) or 1920 x 1080 pixels.",
    scenes: &["earth/oblique"],
    variants,
    sweep: None,
    measure,
    plots: &[
        Plot { quantity: ERROR, x: Axis::Series("frame"), log_x: false, log_y: true, floor: None },
        Plot { quantity: ERROR_MS, x: Axis::Series("time, ms"), log_x: true, log_y: true, floor: None },
    ],
    claims: &[
        Claim {
            id: "left-over-waits",
            text: "What does not fit A2's budget waits for the next frame.",
            from: Origin::Paper("3"),
            check: left_over_waits,
        },
        Claim {
            id: "coarsest-first-errs-less",
            text: "Asking for the coarsest tiles first leaves less error, summed over the frames after a cut.",
            from: Origin::Ours,
            check: coarsest_first,
        },
    ],
};

fn variants() -> Vec<String> {
    BUDGETS.iter().map(|budget| budget.name.to_owned()).collect()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let (scene, camera) = cell.scene.split_once('/').context("a scene and a camera")?;
    let scene = Scene::embedded(scene)?;
    let (from, to) = (scene.camera(&scene.view.camera)?.pose(), scene.camera(camera)?.pose());
    let size = match bench.effort {
        Effort::Quick => [960, 540],
        Effort::Full => [1920, 1080],
    };
    let source = Remembered::new(open_texture(&scene)?);
    let mut settled = session(bench, &scene, source.clone(), size, |_| ())?;
    settled.settle(&to)?;
    let truth = picture(&mut settled)?;
    drop(settled);
    let mut traces: Vec<Vec<Trace>> = BUDGETS.iter().map(|_| Vec::new()).collect();
    for round in 0..ROUNDS {
        for turn in 0..BUDGETS.len() {
            let at = (turn + round) % BUDGETS.len();
            let budget = &BUDGETS[at];
            let mut session = session(bench, &scene, source.clone(), size, |settings| {
                settings.streaming.upload_budget_ms = budget.upload_ms;
                settings.streaming.load_budget_ms = 1e3;
                settings.streaming.upload_tiles_per_frame = 64;
                settings.streaming.order = budget.order;
            })?;
            session.settle(&from)?;
            let (trace, first) = cut(&mut session, &to, &truth)?;
            traces[at].push(trace);
            if (round, at) == (0, 0) {
                let name = format!("vt.budget-{}-first-frame", cell.scene.replace('/', "-"));
                show_beside(bench, &name, &first, &truth)?;
            }
        }
    }
    Ok(BUDGETS.iter().zip(&traces).flat_map(|(budget, traces)| of_cuts(budget.name, traces)).collect())
}

/// Frames from `pose` until nothing is missing, and the first one's picture.
fn cut(session: &mut Run<VirtualTexture>, pose: &Pose, truth: &Picture) -> anyhow::Result<(Trace, Picture)> {
    let mut trace = Trace::default();
    let mut first = None;
    let mut spent = Duration::ZERO;
    while trace.0.len() < MOST_FRAMES && (trace.0.is_empty() || !session.settled()) {
        let begin = Instant::now();
        session.frame(pose)?;
        session.drain()?;
        spent += begin.elapsed();
        let shown = picture(session)?;
        trace.0.push([1e3 * spent.as_secs_f64(), compare(&shown, truth)?.nmse()]);
        first.get_or_insert(shown);
    }
    Ok((trace, first.context("a cut shows a frame")?))
}

fn of_cuts(name: &str, traces: &[Trace]) -> Vec<Row> {
    let over = |of: &dyn Fn(&Trace) -> Option<f64>| {
        repeated(traces, of).unwrap_or_else(|| Value::Missing(format!("not within {MOST_FRAMES} frames")))
    };
    let (half, most) = (|trace: &Trace| trace.reached(0.5), |trace: &Trace| trace.reached(0.05));
    vec![
        Row::new(name, ERROR, "NMSE", Value::Spreads(Trace::by_frame(traces))),
        Row::new(name, ERROR_MS, "NMSE", Value::Spreads(Trace::by_time(traces))),
        Row::new(name, FRAMES_50, "frames", over(&|trace| Some(half(trace)?.0))),
        Row::new(name, FRAMES_95, "frames", over(&|trace| Some(most(trace)?.0))),
        Row::new(
            name,
            SUM,
            "NMSE x frames",
            over(&|trace| Some(trace.0.iter().map(|[_, error]| error).sum())),
        ),
        Row::new(name, MS_50, "ms", over(&|trace| Some(half(trace)?.1))),
        Row::new(name, MS_95, "ms", over(&|trace| Some(most(trace)?.1))),
    ]
}

/// The one scene's repeated measurement.
fn of(table: &Table, variant: &str, quantity: &str) -> Option<Summary> {
    table.of(quantity).filter(|record| record.row.variant == variant).find_map(|record| {
        match &record.row.value {
            Value::Summary(summary) => Some(*summary),
            _ => None,
        }
    })
}

/// "7 [7 .. 8]"
fn told(summary: &Summary, digits: usize) -> String {
    let Summary { p5, median, p95, .. } = summary;
    format!("{median:.digits$} [{p5:.digits$} .. {p95:.digits$}]")
}

/// Whether `less` is below `more`: surely, or in the median alone.
fn below(less: &Summary, more: &Summary) -> Verdict {
    match (less.p95 < more.p5, less.median < more.median) {
        (true, _) => Verdict::Reproduced,
        (_, true) => Verdict::InPart,
        _ => Verdict::NotReproduced,
    }
}

fn left_over_waits(table: &Table) -> Finding {
    let all = |name| Some((of(table, name, FRAMES_95)?, of(table, name, MS_95)?));
    let (Some(short), Some(long)) = (all("0.5 ms"), all("4 ms")) else {
        return Finding::new(Verdict::NotMeasurable, "", "a budget's run is missing");
    };
    let numbers = format!(
        "95 % of the error gone after {} frames ({} ms) with 0.5 ms, after {} ({} ms) with 4 ms",
        told(&short.0, 0),
        told(&short.1, 0),
        told(&long.0, 0),
        told(&long.1, 0)
    );
    let why =
        "a shorter budget takes more frames to the same picture; medians [p5 .. p95] of 3 cuts each, in turn";
    Finding::new(below(&long.0, &short.0), numbers, why)
}

fn coarsest_first(table: &Table) -> Finding {
    let pair = |finest, coarsest| Some((of(table, finest, SUM)?, of(table, coarsest, SUM)?));
    let (Some(short), Some(long)) =
        (pair("0.5 ms", "0.5 ms, coarsest first"), pair("4 ms", "4 ms, coarsest first"))
    else {
        return Finding::new(Verdict::NotMeasurable, "", "a budget's run is missing");
    };
    let [a, b, c, d] = [short.0, short.1, long.0, long.1].map(|sum| told(&sum, 2));
    let numbers =
        format!("summed error, finest and coarsest first: {a} and {b} with 0.5 ms, {c} and {d} with 4 ms");
    let better = [short, long]
        .iter()
        .filter(|(finest, coarsest)| below(coarsest, finest) == Verdict::Reproduced)
        .count();
    let verdict = [Verdict::NotReproduced, Verdict::InPart, Verdict::Reproduced][better];
    Finding::new(
        verdict,
        numbers,
        format!("less, beyond the spread of 3 cuts each, with {better} of 2 budgets"),
    )
}

#[cfg(test)]
mod tests {
    use super::super::super::judge::tests::table;
    use super::*;

    #[test]
    fn orders_that_differ_within_their_spread_are_no_better() {
        let found = |short, long| {
            let rows = [
                ("s", None, "0.5 ms", SUM, 2.0),
                ("s", None, "0.5 ms, coarsest first", SUM, short),
                ("s", None, "4 ms", SUM, 1.0),
                ("s", None, "4 ms, coarsest first", SUM, long),
            ];
            coarsest_first(&table("cpu", &rows)).verdict
        };
        // Spreads of a twentieth.
        assert_eq!([found(1.5, 0.8), found(1.5, 0.99)], [Verdict::Reproduced, Verdict::InPart]);
        assert_eq!(found(1.99, 0.99), Verdict::NotReproduced);
        assert_eq!(coarsest_first(&table("cpu", &[])).verdict, Verdict::NotMeasurable);
    }
}
