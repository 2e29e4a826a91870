//! vt.headline: the paper's one number, frames a second of its headline scene, standing and moving.

use super::common::{Place, pixels_of};
use super::judge::{Bound, Ratio, judge, on_a_gpu, short, why_none};
use super::side_by_side::{Combination, PAPER_NATIVE, PLAIN, SideBySide, THE_PAPER, combinations};
use crate::figure::{
    Axis, Bench, Cell, Claim, Effort, Figure, Finding, Origin, Plot, Row, Table, Value, Verdict,
};
use crate::math::camera::Pose;
use crate::paper::virtual_texture::session::{Session, Settings, Target};
use crate::picture::write::Srgb8Picture;
use crate::stats::Summary;
use crate::vk::FRAMES_IN_FLIGHT;
use std::time::Instant;

pub const HEADLINE: Figure = Figure {
    id: "vt.headline",
    title: "The paper's headline",
    about: "The paper (introduction, figure 5): an Earth of about 150 000 polygons under a texture of 2^18 x 2^17 \
            texels in tiles of 512 x 512, seen from 300 km with 4x magnification, 1920 x 1080 pixels, GeForce GTX 285: \
            about 150 frames a second. Here the same scene, 1280 x 720 (quick) or 1920 x 1080 pixels: standing with \
            all tiles resident, and moving along the path `pan` with tiles streamed under the scene's budgets. Wall \
            time from frame to frame, the host's work included. Tiles are synthesised, at 13 ms of a core each; a \
            software device shares those cores.",
    scenes: &[SCENE],
    variants: || [names(), vec![PLAIN.to_string()]].concat(),
    sweep: None,
    measure,
    plots: &[
        Plot { quantity: STANDING, x: Axis::Variant, log_x: false, log_y: false, floor: None },
        Plot {
            quantity: ALONG,
            x: Axis::Series("frame along the path"),
            log_x: false,
            log_y: true,
            floor: None,
        },
    ],
    claims: &[
        Claim {
            id: "150-fps",
            text: "About 150 frames a second (on a GeForce GTX 285).",
            from: Origin::Paper("introduction"),
            check: fps_150,
        },
        Claim {
            id: "streaming",
            text: "Moving, with tiles streamed under the budgets, the median frame takes at most twice the standing \
                   one.",
            from: Origin::Ours,
            check: streaming,
        },
        Claim {
            id: "memory",
            text: "All that the paper's frame needs takes at most the 1 GiB of a GTX 285.",
            from: Origin::Ours,
            check: memory,
        },
    ],
};

const SCENE: &str = "earth/headline";
const PATH: &str = "pan";

/// Quantities: wall milliseconds from frame to frame; the same for each frame of the path; and what follows.
const STANDING: &str = "frame, standing";
const MOVING: &str = "frame, moving";
const ALONG: &str = "frame along the path";
const STANDING_FPS: &str = "frames/s, standing";
const MOVING_FPS: &str = "frames/s, moving";
const MEMORY: &str = "memory";
const PAPER_FPS: f64 = 150.0;

/// The paper's frame, and those of compute shaders, which list the same tiles on the device.
fn contenders() -> Vec<Combination> {
    combinations().into_iter().filter(|c| c.is_ours() && c.name != PAPER_NATIVE).collect()
}

fn names() -> Vec<String> {
    contenders().into_iter().map(|combination| combination.name.to_string()).collect()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let (rows_of_pixels, frames) = match bench.effort {
        Effort::Quick => (720.0, 40),
        Effort::Full => (1080.0, 240),
    };
    let size = pixels_of(rows_of_pixels);
    let place = Place::find(&cell.scene)?;
    let path = place.scene.path(PATH)?.clone();
    let streaming = Settings::of_scene(&place.scene, Target::Srgb8).streaming;
    let mut side = SideBySide::settled(bench, place, size, (&contenders(), &[PLAIN]), |settings| {
        settings.streaming = streaming.clone();
    })?;
    let mut rows = side.time(bench)?;
    rows.extend(side.lists());
    let (pose, kept) = (side.pose, side.source.clone());
    for (name, session) in &mut side.sessions {
        if name == THE_PAPER {
            session.settle(&pose)?;
            let rgba = session.picture_bytes()?;
            let picture = Srgb8Picture { width: size[0], height: size[1], rgba };
            bench.picture(&format!("{}-{}", HEADLINE.id, cell.scene.replace('/', "-")), &picture)?;
        }
        let standing = Walk::run(session, frames, |_| pose)?;
        // The path's tiles are to be made, whichever variant comes first.
        kept.forget();
        let moving = Walk::run(session, frames, |frame| path.pose(frame))?;
        rows.extend(told(name, &standing, &moving));
        let memory = session.memory();
        let on_device = memory.iter().filter(|(object, _)| !object.contains("host"));
        let bytes: u64 = on_device.map(|(_, bytes)| bytes).sum();
        rows.push(Row::new(&**name, MEMORY, "MiB", Value::Number(bytes as f64 / 1_048_576.0)));
    }
    Ok(rows)
}

/// Frames one after the other, as a viewer would see them.
struct Walk {
    /// Wall time of each.
    ms: Vec<f64>,
    /// Mean share of a frame's wanted tiles that it had to show coarser.
    missing: f64,
    /// Tiles uploaded, all frames together.
    uploads: usize,
}

impl Walk {
    fn run(session: &mut Session, frames: u32, pose: impl Fn(u32) -> Pose) -> anyhow::Result<Walk> {
        session.drain()?;
        let before = session.records.len();
        let mut ms = Vec::new();
        for frame in 0..frames {
            let begin = Instant::now();
            session.frame(&pose(frame))?;
            ms.push(begin.elapsed().as_secs_f64() * 1e3);
        }
        session.drain()?;
        // The first frames wait for none before them.
        ms.drain(..FRAMES_IN_FLIGHT.min(ms.len()));
        let reports = session.records[before..].iter().map(|record| &record.streaming);
        let shares = reports.clone().filter(|r| r.wanted > 0).map(|r| r.pending as f64 / r.wanted as f64);
        let uploads = reports.map(|r| r.uploads).sum();
        Ok(Walk { missing: shares.sum::<f64>() / f64::from(frames), ms, uploads })
    }

    fn frames_a_second(&self) -> f64 {
        1e3 * self.ms.len() as f64 / self.ms.iter().sum::<f64>()
    }
}

fn told(name: &str, standing: &Walk, moving: &Walk) -> Vec<Row> {
    let row = |quantity, unit, value| Row::new(name, quantity, unit, value);
    let summary = |walk: &Walk| Value::Summary(Summary::of(&walk.ms).expect("frames were drawn"));
    let along = moving.ms.iter().enumerate().map(|(frame, ms)| [frame as f64, *ms]);
    vec![
        row(STANDING, "ms", summary(standing)),
        row(MOVING, "ms", summary(moving)),
        row(STANDING_FPS, "1/s", Value::Number(standing.frames_a_second())),
        row(MOVING_FPS, "1/s", Value::Number(moving.frames_a_second())),
        row(ALONG, "ms", Value::Series(along.collect())),
        row("tiles uploaded, moving", "tiles", Value::Number(moving.uploads as f64)),
        row("share of tiles shown coarser, moving", "", Value::Number(moving.missing)),
    ]
}

fn fps_150(table: &Table) -> Finding {
    let fps = |name: &String| Some((name.clone(), table.number(SCENE, None, name, STANDING_FPS)?));
    let all: Vec<(String, f64)> = names().iter().filter_map(fps).collect();
    let Some((_, papers)) = all.iter().find(|(name, _)| name == THE_PAPER) else {
        let why = why_none(table, STANDING_FPS, &[THE_PAPER.to_string()]);
        return Finding::new(Verdict::NotMeasurable, "", why);
    };
    let verdict = if *papers >= PAPER_FPS { Verdict::Reproduced } else { Verdict::NotReproduced };
    let numbers = all.iter().map(|(name, fps)| format!("{name} {} frames/s", short(*fps)));
    let numbers = numbers.collect::<Vec<_>>().join(", ");
    on_a_gpu(table, Finding::new(verdict, numbers, "the paper's own variant against 150 frames/s"))
}

fn streaming(table: &Table) -> Finding {
    let ratio = |name: &String| {
        let number = |quantity| table.number(SCENE, None, name, quantity);
        let value = number(MOVING)? / number(STANDING)?;
        Some(Ratio { at: (SCENE.to_string(), None), of: name.clone(), value, range: None, tie: false })
    };
    let found: Vec<Ratio> = names().iter().filter_map(ratio).collect();
    judge(table, Bound::AtMost(2.0), &found, || why_none(table, MOVING, &names()))
}

fn memory(table: &Table) -> Finding {
    let Some(mib) = table.number(SCENE, None, THE_PAPER, MEMORY) else {
        return Finding::new(Verdict::NotMeasurable, "", why_none(table, MEMORY, &[THE_PAPER.to_string()]));
    };
    let verdict = if mib <= 1024.0 { Verdict::Reproduced } else { Verdict::NotReproduced };
    Finding::new(verdict, format!("{} MiB", short(mib)), "bound: 1024 MiB")
}

#[cfg(test)]
mod tests {
    use super::super::judge::tests::table;
    use super::*;

    #[test]
    fn the_papers_variant_is_held_against_150_frames_on_a_gpu_alone() {
        let verdict =
            |kind, fps| fps_150(&table(kind, &[(SCENE, None, THE_PAPER, STANDING_FPS, fps)])).verdict;
        assert_eq!(verdict("discrete", 151.0), Verdict::Reproduced);
        assert_eq!(verdict("discrete", 149.0), Verdict::NotReproduced);
        assert_eq!(verdict("cpu", 151.0), Verdict::NotMeasurable);
        assert_eq!(fps_150(&table("discrete", &[])).verdict, Verdict::NotMeasurable);
    }

    #[test]
    fn a_moving_frame_may_take_twice_the_standing_one() {
        let verdict = |moving| {
            let rows = [(SCENE, None, THE_PAPER, STANDING, 10.0), (SCENE, None, THE_PAPER, MOVING, moving)];
            streaming(&table("cpu", &rows)).verdict
        };
        assert_eq!((verdict(19.0), verdict(21.0)), (Verdict::Reproduced, Verdict::NotReproduced));
        assert_eq!(streaming(&table("cpu", &[])).verdict, Verdict::NotMeasurable);
    }

    #[test]
    fn memory_has_its_bound() {
        let verdict = |mib| memory(&table("cpu", &[(SCENE, None, THE_PAPER, MEMORY, mib)])).verdict;
        assert_eq!((verdict(1024.0), verdict(1025.0)), (Verdict::Reproduced, Verdict::NotReproduced));
    }
}
