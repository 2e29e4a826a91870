//! vt.disk: frames go on while the disk is slow or down, and recover.

use super::{Remembered, numbers, picture, session};
use crate::figure::{
    Axis, Bench, Cell, Claim, Effort, Figure, Finding, Origin, Plot, Row, Table, Value, Verdict,
};
use crate::picture::error::compare;
use crate::scene::source::{TileSource, disk::BadDisk};
use crate::scene::{Disk, Scene};
use crate::stats::Summary;
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

/// Ten times what the slowest of them takes on two cores.
const PATIENCE: Duration = Duration::from_secs(120);

/// The figure.
pub const DISK: Figure = Figure {
    id: "vt.disk",
    title: "A disk that is slow, or down",
    about: "The first seconds of a scene whose disk answers at once, in 50 ms a tile, or not at all for 5 s. A3 loads in \
            threads of its own (paper, section 3), so no frame waits for it: coarser levels stand in. What cannot be \
            read is asked for again after a second (cache.retry_after_ms), so the picture recovers by itself; the paper \
            leaves a failed load open. Recovery is the time from when the disk works until 95 % of the first frame's \
            error are gone.",
    scenes: &["earth/oblique"],
    variants,
    sweep: None,
    measure,
    plots: &[
        Plot { quantity: ERROR, x: Axis::Series("time, s"), log_x: false, log_y: true, floor: None },
        Plot { quantity: FRAME, x: Axis::Variant, log_x: false, log_y: false, floor: None },
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
    let whole = Remembered::new(scene.open_texture()?);
    let mut settled = session(bench, &scene, whole.clone(), size, |_| ())?;
    settled.settle(&pose)?;
    let truth = picture(&mut settled)?;
    drop(settled);
    let troubles = [
        (HEALTHY, Disk::default()),
        (SLOW, Disk { delay_ms: 50.0, ..Disk::default() }),
        (DOWN, Disk { fails_for_s: DOWN_S, ..Disk::default() }),
    ];
    let mut rows = Vec::new();
    for (name, trouble) in troubles {
        let disk = Arc::new(BadDisk::new(whole.clone() as Arc<dyn TileSource>, trouble));
        let mut session = session(bench, &scene, disk.clone(), size, |_| ())?;
        let begin = Instant::now();
        let (mut errors, mut frames_ms, mut while_down, mut works_s) = (Vec::new(), Vec::new(), 0, 0.0);
        while begin.elapsed() < PATIENCE {
            let frame = Instant::now();
            session.frame(&pose)?;
            session.drain()?;
            frames_ms.push(1e3 * frame.elapsed().as_secs_f64());
            let now_s = begin.elapsed().as_secs_f64();
            if disk.is_down() {
                while_down += 1;
                works_s = now_s;
            }
            errors.push([now_s, compare(&picture(&mut session)?, &truth)?.nmse()]);
            let failed = session.records.last().is_some_and(|record| record.streaming.failed_tiles > 0);
            if session.settled() && !failed && !disk.is_down() {
                break;
            }
        }
        let bound = 0.05 * errors[0][1];
        let there =
            errors.iter().rposition(|[_, error]| *error > bound).and_then(|last| errors.get(last + 1));
        let never = || Value::Missing(format!("not within {} s", PATIENCE.as_secs()));
        let recovery = there.map_or_else(never, |[s, _]| Value::Number(s - works_s));
        let frame = Summary::of(&frames_ms).context("a frame was drawn")?;
        rows.extend([
            Row::new(name, ERROR, "NMSE", Value::Series(errors)),
            Row::new(name, FRAME, "ms", Value::Summary(frame)),
            Row::new(name, DURING, "frames", Value::Number(f64::from(while_down))),
            Row::new(name, RECOVERY, "s", recovery),
        ]);
    }
    Ok(rows)
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
    let (Some(healthy), Some(down)) = (of(table, HEALTHY, RECOVERY), of(table, DOWN, RECOVERY)) else {
        return Finding::new(Verdict::NotReproduced, "", "the picture did not recover");
    };
    let numbers =
        format!("95 % after {healthy:.2} s with a healthy disk, {down:.2} s after a dead one's return");
    let verdict = if down <= healthy + 3.0 { Verdict::Reproduced } else { Verdict::NotReproduced };
    Finding::new(verdict, numbers, "a second until the retry, then the loads as ever")
}
