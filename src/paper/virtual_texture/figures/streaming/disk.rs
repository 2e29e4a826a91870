//! vt.disk: frames go on while the disk is slow or down, and recover.

use super::traces::{ROUNDS, Trace, repeated};
use super::{Remembered, numbers, picture, session};
use crate::figure::{
    Axis, Bench, Cell, Claim, Effort, Figure, Finding, Origin, Plot, Row, Table, Value, Verdict,
};
use crate::frame::Run;
use crate::math::camera::Pose;
use crate::paper::virtual_texture::VirtualTexture;
use crate::paper::virtual_texture::config::open_texture;
use crate::paper::virtual_texture::disk::{Disk, FaultyDisk};
use crate::picture::Picture;
use crate::picture::error::compare;
use crate::scene::Scene;
use crate::stats::Summary;
use crate::texture::source::TileSource;
use anyhow::Context;
use std::sync::Arc;
use std::time::{Duration, Instant};

const HEALTHY: &str = "healthy";
const SLOW: &str = "50 ms a tile";
const DOWN: &str = "down for 5 s";
const DOWN_S: f64 = 5.0;

const ERROR: &str = "error by time";
const FRAME: &str = "frame";
const DURING: &str = "frames while the disk is down";
const RECOVERY: &str = "recovery";
const RECOVERY_FRAMES: &str = "frames until recovered";

/// Ten times what the slowest of them takes on two cores.
const PATIENCE: Duration = Duration::from_secs(120);

/// The figure.
pub const DISK: Figure = Figure {
    id: "vt.disk",
    title: "A disk that is slow, or down",
    about: "The first seconds of a scene whose disk answers at once, in 50 ms a tile, or not at all for 5 s. A3 loads in \
            threads of its own (paper, section 3), so no frame waits for it: coarser levels stand in. What cannot be \
            read is asked for again after a second (cache.retry_after_ms), so the picture recovers by itself; the paper \
            leaves a failed load open. Recovery is the time, and the number of frames, from when the disk works until 95 % of the \
            first frame's error are gone for good. Each disk is measured 3 times, all in turn. 640 x 360 (quick) or 1920 x 1080 \
            pixels.",
    scenes: &["earth/oblique"],
    variants,
    sweep: None,
    measure,
    plots: &[
        Plot { quantity: ERROR, x: Axis::Series("time, ms"), log_x: true, log_y: true, floor: None },
        Plot { quantity: FRAME, x: Axis::Variant, log_x: false, log_y: false, floor: None },
        Plot { quantity: RECOVERY, x: Axis::Variant, log_x: false, log_y: false, floor: None },
    ],
    claims: &[
        Claim {
            id: "no-frame-waits-for-the-disk",
            text: "A3 runs in threads of its own: frames do not wait for the disk.",
            from: Origin::Paper("3"),
            check: no_frame_waits,
        },
        Claim {
            id: "the-picture-recovers",
            text: "After 5 s without a disk the picture is whole again within 3 s more than a healthy disk takes.",
            from: Origin::Ours,
            check: recovers,
        },
    ],
};

fn variants() -> Vec<String> {
    [HEALTHY, SLOW, DOWN].map(str::to_owned).to_vec()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let (scene, camera) = cell.scene.split_once('/').context("a scene and a camera")?;
    let scene = Scene::embedded(scene)?;
    let pose = scene.camera(camera)?.pose();
    let size = match bench.effort {
        Effort::Quick => [640, 360],
        Effort::Full => [1920, 1080],
    };
    let whole = Remembered::new(open_texture(&scene)?);
    let mut settled = session(bench, &scene, whole.clone(), size, |_| ())?;
    settled.settle(&pose)?;
    let truth = picture(&mut settled)?;
    drop(settled);
    let disks = [
        (HEALTHY, Disk::default()),
        (SLOW, Disk { delay_ms: 50.0, ..Disk::default() }),
        (DOWN, Disk { fails_for_s: DOWN_S, ..Disk::default() }),
    ];
    let mut runs: Vec<Vec<Watched>> = disks.iter().map(|_| Vec::new()).collect();
    for round in 0..ROUNDS {
        for turn in 0..disks.len() {
            let at = (turn + round) % disks.len();
            let disk = Arc::new(FaultyDisk::new(whole.clone() as Arc<dyn TileSource>, disks[at].1.clone()));
            let mut session = session(bench, &scene, disk.clone(), size, |_| ())?;
            runs[at].push(watch(&mut session, &disk, &pose, &truth)?);
        }
    }
    Ok(disks.iter().zip(&runs).flat_map(|((name, _), runs)| rows(name, runs)).collect())
}

/// A disk's first seconds.
struct Watched {
    errors: Trace,
    frames_ms: Vec<f64>,
    /// Frames while it was down, and when it was last so, in milliseconds.
    while_down: usize,
    works_ms: f64,
}

impl Watched {
    /// Milliseconds and frames from when the disk works until 95 % of the error are gone.
    fn recovery(&self) -> Option<(f64, f64)> {
        let (frame, ms) = self.errors.reached(0.05)?;
        Some((ms - self.works_ms, frame - self.while_down as f64))
    }
}

/// Frames from `pose` until the picture is whole.
fn watch(
    session: &mut Run<VirtualTexture>,
    disk: &FaultyDisk,
    pose: &Pose,
    truth: &Picture,
) -> anyhow::Result<Watched> {
    let mut watched =
        Watched { errors: Trace::default(), frames_ms: Vec::new(), while_down: 0, works_ms: 0.0 };
    let begin = Instant::now();
    while begin.elapsed() < PATIENCE {
        let frame = Instant::now();
        session.frame(pose)?;
        session.drain()?;
        watched.frames_ms.push(1e3 * frame.elapsed().as_secs_f64());
        let now_ms = 1e3 * begin.elapsed().as_secs_f64();
        if disk.is_down() {
            watched.while_down += 1;
            watched.works_ms = now_ms;
        }
        watched.errors.0.push([now_ms, compare(&picture(session)?, truth)?.nmse()]);
        let failed = session.records.last().is_some_and(|record| record.streaming.failed_tiles > 0);
        if session.settled() && !failed && !disk.is_down() {
            break;
        }
    }
    Ok(watched)
}

fn rows(name: &str, runs: &[Watched]) -> Vec<Row> {
    let traces: Vec<Trace> = runs.iter().map(|run| run.errors.clone()).collect();
    let summary = |samples: Vec<f64>| Value::Summary(Summary::of(&samples).expect("frames were drawn"));
    let never = || Value::Missing(format!("not within {} s", PATIENCE.as_secs()));
    let recovery = |of: fn((f64, f64)) -> f64| {
        let found: Option<Vec<f64>> = runs.iter().map(|run| run.recovery().map(of)).collect();
        found.map_or_else(never, summary)
    };
    let all = repeated(&traces, |trace| trace.0.last().map(|[ms, _]| *ms)).unwrap_or_else(never);
    vec![
        Row::new(name, ERROR, "NMSE", Value::Spreads(Trace::by_time(&traces))),
        Row::new(
            name,
            FRAME,
            "ms",
            summary(runs.iter().flat_map(|run| run.frames_ms.iter().copied()).collect()),
        ),
        Row::new(name, DURING, "frames", summary(runs.iter().map(|run| run.while_down as f64).collect())),
        Row::new(name, RECOVERY, "ms", recovery(|(ms, _)| ms)),
        Row::new(name, RECOVERY_FRAMES, "frames", recovery(|(_, frames)| frames)),
        Row::new(name, "time until whole", "ms", all),
    ]
}

/// The one scene's number.
fn of(table: &Table, variant: &str, quantity: &str) -> Option<f64> {
    numbers(table, variant, quantity).next().map(|(_, number)| number)
}

fn no_frame_waits(table: &Table) -> Finding {
    let frame = |name| of(table, name, FRAME);
    let (Some(healthy), Some(slow), Some(down), Some(drawn)) =
        (frame(HEALTHY), frame(SLOW), frame(DOWN), of(table, DOWN, DURING))
    else {
        return Finding::new(Verdict::NotMeasurable, "", "a run is missing");
    };
    let numbers = format!(
        "median frame {healthy:.0} ms with a healthy disk, {slow:.0} ms with a slow one, {down:.0} ms with one that is \
         down; {drawn} frames while it was down"
    );
    // A frame that waited would take the disk's 50 ms more at least, or stand still for 5 s.
    let verdict = match slow < healthy + 50.0 && drawn * healthy > 0.25 * 1e3 * DOWN_S {
        true => Verdict::Reproduced,
        false => Verdict::NotReproduced,
    };
    Finding::new(verdict, numbers, "a frame that waited would take 50 ms more, or stand still for 5 s")
}

fn recovers(table: &Table) -> Finding {
    let all = |name| Some((of(table, name, RECOVERY)?, of(table, name, RECOVERY_FRAMES)?));
    let (Some(healthy), Some(down)) = (all(HEALTHY), all(DOWN)) else {
        return Finding::new(Verdict::NotReproduced, "", "the picture did not recover");
    };
    let slow =
        all(SLOW).map_or("not at all".to_string(), |(ms, frames)| format!("{ms:.0} ms ({frames:.0} frames)"));
    let numbers = format!(
        "95 % after {:.0} ms ({:.0} frames) with a healthy disk, {slow} with a slow one, {:.0} ms ({:.0} frames) after a dead one's \
         return",
        healthy.0, healthy.1, down.0, down.1
    );
    let verdict = if down.0 <= healthy.0 + 3e3 { Verdict::Reproduced } else { Verdict::NotReproduced };
    Finding::new(verdict, numbers, "medians of 3; a second until the retry, then the loads as ever")
}
