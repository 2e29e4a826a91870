//! vt.disk: frames continue while the disk is slow or down, and the picture recovers.

use super::super::common::{MIB, ONE_SAMPLE, samples};
use super::traces::{ROUNDS, Trace, repeated};
use super::{SettledView, session};
use crate::figure::prelude::*;
use crate::frame::Run;
use crate::math::camera::Pose;
use crate::paper::virtual_texture::VirtualTexture;
use crate::paper::virtual_texture::disk::{Disk, FaultyDisk};
use crate::picture::Picture;
use crate::picture::error::compare;
use crate::stats::median;
use crate::texture::source::TileSource;
use std::sync::Arc;
use std::time::{Duration, Instant};

const HEALTHY: &str = "healthy";
const SLOW: &str = "50 ms a tile";
const DOWN: &str = "down for 5 s";
const SLOW_16: &str = "50 ms a tile, NA = 16";
const DOWN_S: f64 = 5.0;

const ERROR: &str = "error by time";
const FRAME: &str = "frame";
const DURING: &str = "frames while the disk is down";
const LONGEST: &str = "longest frame while the disk is down";
const RECOVERY: &str = "recovery";
const RECOVERY_FRAMES: &str = "frames until recovered";
const COMPLETE: &str = "time until the picture is complete";
const READ: &str = "read from disk until the picture is complete";

/// Time limit: ten times the longest measurement on two cores.
const PATIENCE: Duration = Duration::from_secs(120);

pub const DISK: Figure = Figure {
    id: "vt.disk",
    title: "A disk that is slow, or down",
    about: "The figure shows the first seconds of a scene whose disk answers at once, takes 50 ms per tile, or fails \
            for 5 s. The loader has its own threads (paper, section 3), so no frame waits for it and coarser levels \
            are shown. A tile that cannot be read is requested again after a second (cache.retry_after_ms), so the \
            picture recovers by itself; the paper does not treat failed loads. Recovery is the time, and the number of \
            frames, from when the disk works until 95 % of the first frame's error is gone permanently. Each disk is \
            measured 6 times, in turn. Pictures have 640 x 360 (quick) or 1920 x 1080 pixels, with one sample each (NA = \
            1). One variant has the paper's NA = 16 with a border of 16 texels: it reads more and larger tiles.",
    scenes: &["earth/oblique"],
    variants: || [HEALTHY, SLOW, DOWN, SLOW_16].map(str::to_owned).to_vec(),
    paper: &[HEALTHY, SLOW, DOWN],
    show: Show::scenes(ONE_SAMPLE).variants(settings),
    measure,
    plots: &[Plot::curves(ERROR, "time, ms").log_x().log_y(), Plot::bars(FRAME), Plot::bars(RECOVERY)],
    claims: &[
        Claim::paper_timed(
            "3",
            "no-frame-waits-for-the-disk",
            "The loader has its own threads, so frames do not wait for the disk. (A frame that waited would take 50 ms \
             more with the slow disk, and seconds while the disk is down.)",
            &[
                Test::difference_of(FRAME, [SLOW, HEALTHY], AtMost(50.0)),
                Test::value(one(LONGEST, DOWN), AtMost(1e3)),
            ],
        ),
        Claim::ours_timed(
            "the-picture-recovers",
            "After 5 s without a disk, recovery takes at most 3 s longer than with a healthy disk.",
            &[Test::difference_of(RECOVERY, [DOWN, HEALTHY], AtMost(3e3))],
        ),
    ],
    ..Figure::BASE
};

/// The variants as settings of a scene.
fn settings() -> Vec<Setting> {
    let (slow, down) = ("disk.delay_ms=50.0".to_owned(), format!("disk.fails_for_s={DOWN_S:?}"));
    let slow_16 = [vec![slow.clone()], samples(16)].concat();
    let disks = [(HEALTHY, vec![]), (SLOW, vec![slow]), (DOWN, vec![down]), (SLOW_16, slow_16)];
    disks.map(|(name, changes)| Setting::new(name, changes)).into()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let size = bench.effort_of([640, 360], [1920, 1080]);
    let one = SettledView::of(bench, &cell.scene, 1, size)?;
    let sixteen = SettledView::of(bench, &cell.scene, 16, size)?;
    let slow = Disk { delay_ms: 50.0, ..Disk::default() };
    let disks = [
        (HEALTHY, &one, Disk::default()),
        (SLOW, &one, slow.clone()),
        (DOWN, &one, Disk { fails_for_s: DOWN_S, ..Disk::default() }),
        (SLOW_16, &sixteen, slow),
    ];
    let runs = Bench::in_turn(ROUNDS, disks.len(), |at| {
        let (_, view, disk) = &disks[at];
        let disk = Arc::new(FaultyDisk::new(view.source.clone() as Arc<dyn TileSource>, disk.clone()));
        let mut session = session(bench, &view.scene, disk.clone(), size, |_| ())?;
        watch(&mut session, &disk, &view.pose, &view.truth)
    })?;
    Ok(disks.iter().zip(&runs).flat_map(|((name, ..), runs)| rows(name, runs)).collect())
}

/// The first seconds with one disk.
struct Watched {
    errors: Trace,
    frames_ms: Vec<f64>,
    /// Number of frames while the disk was down.
    while_down: usize,
    /// The end of the last frame while the disk was down, in milliseconds.
    works_ms: f64,
    /// Bytes of the tiles that were read.
    read: usize,
}

impl Watched {
    /// Milliseconds and frames from the end of the outage until 95 % of the error is gone.
    fn recovery(&self) -> Option<(f64, f64)> {
        let (frame, ms) = self.errors.reached(0.05)?;
        Some((ms - self.works_ms, frame - self.while_down as f64))
    }
}

/// Draws frames from `pose` until the picture is complete.
fn watch(
    session: &mut Run<VirtualTexture>,
    disk: &FaultyDisk,
    pose: &Pose,
    truth: &Picture,
) -> anyhow::Result<Watched> {
    let mut watched =
        Watched { errors: Trace::default(), frames_ms: Vec::new(), while_down: 0, works_ms: 0.0, read: 0 };
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
        watched.errors.0.push([now_ms, compare(&session.linear_picture()?, truth)?.nmse()]);
        let failed = session.records.last().is_some_and(|record| record.streaming.failed_tiles > 0);
        if session.settled() && !failed && !disk.is_down() {
            break;
        }
    }
    let loads: usize = session.records.iter().map(|record| record.streaming.loads).sum();
    watched.read = loads * disk.format().tile_bytes(&disk.pyramid());
    Ok(watched)
}

fn rows(name: &str, runs: &[Watched]) -> Vec<Row> {
    let traces: Vec<Trace> = runs.iter().map(|run| run.errors.clone()).collect();
    let of = |quantity, unit, of: &dyn Fn(&Watched) -> Option<f64>| repeated(name, quantity, unit, runs, of);
    let mut rows = vec![
        Row::new(name, ERROR, "NMSE", Value::Spreads(Trace::by_time(&traces))),
        of(FRAME, "ms", &|run| median(&run.frames_ms)),
        of(DURING, "frames", &|run| Some(run.while_down as f64)),
        of(RECOVERY, "ms", &|run| Some(run.recovery()?.0)),
        of(RECOVERY_FRAMES, "frames", &|run| Some(run.recovery()?.1)),
        of(COMPLETE, "ms", &|run| run.errors.0.last().map(|[ms, _]| *ms)),
        of(READ, "MiB", &|run| Some(run.read as f64 / MIB)),
    ];
    if name == DOWN {
        let longest = |run: &Watched| run.frames_ms[..run.while_down].iter().copied().reduce(f64::max);
        rows.push(of(LONGEST, "ms", &longest));
    }
    rows
}
