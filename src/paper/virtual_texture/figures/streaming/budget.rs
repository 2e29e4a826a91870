//! vt.budget: how the picture recovers from a cut, for budgets of A2.

use super::{Remembered, numbers, picture, session};
use crate::figure::{
    Axis, Bench, Cell, Claim, Effort, Figure, Finding, Origin, Plot, Row, Table, Value, Verdict,
};
use crate::math::camera::Pose;
use crate::paper::virtual_texture::session::Session;
use crate::paper::virtual_texture::streaming::Order;
use crate::picture::{Picture, error::compare};
use crate::scene::Scene;
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
            good. The tiles lie in memory, so the disk binds nothing; times are of this device, each frame waited for.",
    scenes: &["earth/oblique"],
    variants,
    sweep: None,
    measure,
    plots: &[
        Plot { quantity: ERROR, x: Axis::Series("frame"), log_x: false, log_y: true, floor: None },
        Plot { quantity: ERROR_MS, x: Axis::Series("time, ms"), log_x: false, log_y: true, floor: None },
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
    let source = Remembered::new(scene.open_texture()?);
    let mut settled = session(bench, &scene, source.clone(), size, |_| ())?;
    settled.settle(&to)?;
    let truth = picture(&mut settled)?;
    drop(settled);
    let mut rows = Vec::new();
    for budget in &BUDGETS {
        let mut session = session(bench, &scene, source.clone(), size, |settings| {
            settings.streaming.upload_budget = Duration::from_secs_f64(budget.upload_ms / 1e3);
            settings.streaming.load_budget = Duration::from_secs(1);
            settings.streaming.upload_tiles_per_frame = 64;
            settings.streaming.order = budget.order;
        })?;
        session.settle(&from)?;
        rows.extend(of_cut(budget.name, &cut(&mut session, &to, &truth)?));
    }
    Ok(rows)
}

/// One frame after the cut: milliseconds since then, and the NMSE.
struct After {
    ms: f64,
    error: f64,
}

/// Frames from `pose` until nothing is missing.
fn cut(session: &mut Session, pose: &Pose, truth: &Picture) -> anyhow::Result<Vec<After>> {
    let mut frames = Vec::new();
    let mut spent = Duration::ZERO;
    while frames.len() < MOST_FRAMES && (frames.is_empty() || !session.settled()) {
        let begin = Instant::now();
        session.frame(pose)?;
        session.drain()?;
        spent += begin.elapsed();
        let error = compare(&picture(session)?, truth)?.nmse();
        frames.push(After { ms: 1e3 * spent.as_secs_f64(), error });
    }
    Ok(frames)
}

fn of_cut(name: &str, frames: &[After]) -> Vec<Row> {
    let series = |x: fn(usize, &After) -> f64| {
        Value::Series(frames.iter().enumerate().map(|(n, after)| [x(n, after), after.error]).collect())
    };
    // The first frame from which on the error stays below a share of the first one's.
    let reached = |share: f64| {
        let bound = share * frames[0].error;
        let last_above = frames.iter().rposition(|after| after.error > bound);
        let at = last_above.map_or(0, |last| last + 1);
        frames.get(at).map(|after| (at as f64 + 1.0, after.ms))
    };
    let never = || Value::Missing(format!("not within {MOST_FRAMES} frames"));
    let number = |value: Option<f64>| value.map_or_else(never, Value::Number);
    let (half, most) = (reached(0.5), reached(0.05));
    let sum = frames.iter().map(|after| after.error).sum();
    vec![
        Row::new(name, ERROR, "NMSE", series(|n, _| n as f64 + 1.0)),
        Row::new(name, ERROR_MS, "NMSE", series(|_, after| after.ms)),
        Row::new(name, FRAMES_50, "frames", number(half.map(|(frames, _)| frames))),
        Row::new(name, FRAMES_95, "frames", number(most.map(|(frames, _)| frames))),
        Row::new(name, SUM, "NMSE x frames", Value::Number(sum)),
        Row::new(name, MS_50, "ms", number(half.map(|(_, ms)| ms))),
        Row::new(name, MS_95, "ms", number(most.map(|(_, ms)| ms))),
    ]
}

/// The one scene's number.
fn of(table: &Table, variant: &str, quantity: &str) -> Option<f64> {
    numbers(table, variant, quantity).next().map(|(_, number)| number)
}

fn left_over_waits(table: &Table) -> Finding {
    let frames = |name| of(table, name, FRAMES_95);
    let (Some(short), Some(long)) = (frames("0.5 ms"), frames("4 ms")) else {
        return Finding::new(Verdict::NotMeasurable, "", "a budget's run is missing");
    };
    let ms = |name| of(table, name, MS_95).unwrap_or(f64::NAN);
    let numbers = format!(
        "95 % of the error gone after {short} frames ({:.0} ms) with 0.5 ms, after {long} ({:.0} ms) with 4 ms",
        ms("0.5 ms"),
        ms("4 ms")
    );
    let verdict = if short > long { Verdict::Reproduced } else { Verdict::NotReproduced };
    Finding::new(verdict, numbers, "a shorter budget takes more frames to the same picture")
}

fn coarsest_first(table: &Table) -> Finding {
    let pair = |finest, coarsest| Some((of(table, finest, SUM)?, of(table, coarsest, SUM)?));
    let (Some(short), Some(long)) =
        (pair("0.5 ms", "0.5 ms, coarsest first"), pair("4 ms", "4 ms, coarsest first"))
    else {
        return Finding::new(Verdict::NotMeasurable, "", "a budget's run is missing");
    };
    let numbers = format!(
        "summed error, finest and coarsest first: {:.2} and {:.2} with 0.5 ms, {:.2} and {:.2} with 4 ms",
        short.0, short.1, long.0, long.1
    );
    let better = [short, long].iter().filter(|(finest, coarsest)| coarsest < finest).count();
    let verdict = [Verdict::NotReproduced, Verdict::InPart, Verdict::Reproduced][better];
    Finding::new(verdict, numbers, format!("less with {better} of 2 budgets"))
}
