//! vt.headline: the paper's one number, frames a second of its headline scene, standing and moving.

use super::common::{Place, pixels_of};
use super::judge::{Bound, Ratio, best, judge, on_a_gpu, short, why_none};
use super::side_by_side::{Combination, PAPER_NATIVE, PLAIN, SideBySide, THE_PAPER, combinations};
use crate::figure::{
    Axis, Bench, Cell, Claim, Effort, Figure, Finding, Origin, Plot, Row, Table, Value, Verdict,
};
use crate::frame::Run;
use crate::math::camera::Pose;
use crate::paper::virtual_texture::{Settings, VirtualTexture};
use crate::picture::Target;
use crate::picture::write::Srgb8Picture;
use crate::scene::path::Path;
use crate::stats::Summary;
use crate::vk::FRAMES_IN_FLIGHT;
use std::time::Instant;

pub const HEADLINE: Figure = Figure {
    id: "vt.headline",
    title: "The paper's headline",
    about: "The paper (introduction, figure 5): an Earth of about 150 000 polygons under a texture of 2^18 x 2^17 \
            texels in tiles of 512 x 512, seen from 300 km with 4x magnification, 1920 x 1080 pixels, GeForce GTX 285: \
            about 150 frames a second. Here the same scene, 1280 x 720 (quick) or 1920 x 1080 pixels: standing with \
            all tiles resident, and moving along the path `pan` (its first 30 frames in quick runs, of 240), from caches that \
            hold the first picture's tiles alone, while all others are made, loaded and copied under the scene's own budgets. \
            Wall time from frame to frame, the host's work included. In each of 3 (quick) or 5 rounds every variant stands and \
            moves in its turn, in sessions of its own; frames a second are 1 over the times of frames. Tiles are synthesised, at 13 ms \
            of a core each; a software device shares those cores.",
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
            text: "Moving along `pan`, with tiles made, loaded and copied under the scene's budgets, the median frame takes at \
                   most twice the standing one of the same round.",
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
const SLOWER: &str = "moving over standing";
const MEMORY: &str = "memory";
const PAPER_FPS: f64 = 150.0;

/// The paper's frame, and those of compute shaders, which list the same tiles on the device.
fn contenders() -> Vec<Combination> {
    combinations().into_iter().filter(|c| c.is_ours() && c.name != PAPER_NATIVE).collect()
}

fn names() -> Vec<String> {
    contenders().into_iter().map(|combination| combination.name.to_string()).collect()
}

/// Rounds, and frames of a round that stand and that move.
struct Extent {
    rounds: usize,
    stands: u32,
    moves: u32,
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let (rows_of_pixels, extent) = match bench.effort {
        Effort::Quick => (720.0, Extent { rounds: 3, stands: 10, moves: 30 }),
        Effort::Full => (1080.0, Extent { rounds: 5, stands: 60, moves: 240 }),
    };
    let size = pixels_of(rows_of_pixels);
    let place = Place::find(&cell.scene)?;
    let path = place.scene.path(PATH)?.clone();
    let streaming = Settings::of_scene(&place.scene, Target::Srgb8)?.streaming;
    let mut side = SideBySide::settled(bench, place, size, (&contenders(), &[PLAIN]), |settings| {
        settings.streaming = streaming.clone();
    })?;
    let mut rows = side.time(bench)?;
    rows.extend(side.lists());
    if let Some((_, session)) = side.sessions.iter_mut().find(|(name, _)| name == THE_PAPER) {
        let rgba = session.picture_bytes()?;
        let picture = Srgb8Picture { width: size[0], height: size[1], rgba };
        bench.picture(&format!("{}-{}", HEADLINE.id, cell.scene.replace('/', "-")), &picture)?;
    }
    let walks = walks(&mut side, &path, &extent)?;
    for ((name, session), walks) in side.sessions.iter().zip(&walks) {
        rows.extend(told(name, walks));
        let memory = session.memory();
        let on_device = memory.iter().filter(|(object, _)| !object.contains("host"));
        let bytes: u64 = on_device.map(|(_, bytes)| bytes).sum();
        rows.push(Row::new(&**name, MEMORY, "MiB", Value::Number(bytes as f64 / 1_048_576.0)));
    }
    Ok(rows)
}

/// For each session what it did in each round, standing and moving: all take turns, and each round begins with another one.
fn walks(side: &mut SideBySide, path: &Path, extent: &Extent) -> anyhow::Result<Vec<Vec<[Walk; 2]>>> {
    let (count, pose) = (side.sessions.len(), side.pose);
    let mut walks: Vec<Vec<[Walk; 2]>> = (0..count).map(|_| Vec::new()).collect();
    for round in 0..extent.rounds {
        for turn in 0..count {
            let at = (turn + round) % count;
            let standing = Walk::run(&mut side.sessions[at].1, extent.stands, |_| pose)?;
            // Nothing that an earlier walk has seen is in its caches, and no tile is made yet.
            let mut afresh = side.afresh(at, &path.pose(0))?;
            side.source.forget();
            let moving = Walk::run(&mut afresh, extent.moves, |frame| path.pose(frame))?;
            walks[at].push([standing, moving]);
        }
    }
    Ok(walks)
}

/// Frames one after the other, as a viewer would see them.
struct Walk {
    /// Wall time of each.
    ms: Vec<f64>,
    /// Mean share of a frame's wanted tiles that it had to show coarser.
    missing: f64,
    /// Tiles loaded, and tiles uploaded, all frames together.
    loads: usize,
    uploads: usize,
}

impl Walk {
    fn run(
        session: &mut Run<VirtualTexture>,
        frames: u32,
        pose: impl Fn(u32) -> Pose,
    ) -> anyhow::Result<Walk> {
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
        let reports = || session.records[before..].iter().map(|record| &record.streaming);
        let shares = reports().filter(|r| r.wanted > 0).map(|r| r.pending as f64 / r.wanted as f64);
        Ok(Walk {
            missing: shares.sum::<f64>() / f64::from(frames),
            loads: reports().map(|r| r.loads).sum(),
            uploads: reports().map(|r| r.uploads).sum(),
            ms,
        })
    }
}

fn summary(samples: impl IntoIterator<Item = f64>) -> Summary {
    Summary::of(&samples.into_iter().collect::<Vec<_>>()).expect("frames were drawn in every round")
}

/// Rows of a variant's rounds.
fn told(name: &str, rounds: &[[Walk; 2]]) -> Vec<Row> {
    let row = |quantity, unit, samples: &dyn Fn() -> Vec<f64>| {
        Row::new(name, quantity, unit, Value::Summary(summary(samples())))
    };
    let ms = |at: usize| rounds.iter().flat_map(move |walks| walks[at].ms.iter().copied());
    let median = |walk: &Walk| summary(walk.ms.iter().copied()).median;
    let of_walks =
        |of: &dyn Fn(&Walk) -> f64| rounds.iter().map(|[_, moving]| of(moving)).collect::<Vec<f64>>();
    let frames = rounds.first().map_or(0, |[_, moving]| moving.ms.len());
    let frame =
        |n: usize| ((n + FRAMES_IN_FLIGHT) as f64, summary(rounds.iter().map(|[_, moving]| moving.ms[n])));
    vec![
        row(STANDING, "ms", &|| ms(0).collect()),
        row(MOVING, "ms", &|| ms(1).collect()),
        row(STANDING_FPS, "1/s", &|| ms(0).map(|ms| 1e3 / ms).collect()),
        row(MOVING_FPS, "1/s", &|| ms(1).map(|ms| 1e3 / ms).collect()),
        row(SLOWER, "", &|| {
            rounds.iter().map(|[standing, moving]| median(moving) / median(standing)).collect()
        }),
        Row::new(name, ALONG, "ms", Value::Spreads((0..frames).map(frame).collect())),
        row("tiles loaded, moving", "tiles", &|| of_walks(&|walk| walk.loads as f64)),
        row("tiles uploaded, moving", "tiles", &|| of_walks(&|walk| walk.uploads as f64)),
        row("share of tiles shown coarser, moving", "", &|| of_walks(&|walk| walk.missing)),
    ]
}

/// A variant's frames a second: `2.70 [2.60 .. 2.90]`.
fn rate(table: &Table, name: &str, quantity: &str) -> Option<(f64, String)> {
    match table.value(SCENE, None, name, quantity)? {
        Value::Summary(Summary { p5, median, p95, .. }) => {
            Some((*median, format!("{} [{} .. {}]", short(*median), short(*p5), short(*p95))))
        }
        _ => None,
    }
}

fn fps_150(table: &Table) -> Finding {
    let Some((papers, _)) = rate(table, THE_PAPER, STANDING_FPS) else {
        let why = why_none(table, STANDING_FPS, &[THE_PAPER.to_string()]);
        return Finding::new(Verdict::NotMeasurable, "", why);
    };
    let verdict = if papers >= PAPER_FPS { Verdict::Reproduced } else { Verdict::NotReproduced };
    let told = |name: String| {
        let standing = rate(table, &name, STANDING_FPS)?.1;
        let moving =
            rate(table, &name, MOVING_FPS).map_or(String::new(), |(_, words)| format!(", moving {words}"));
        Some(format!("{name} {standing} frames/s standing{moving}"))
    };
    let numbers = names().into_iter().filter_map(told).collect::<Vec<_>>().join("; ");
    on_a_gpu(
        table,
        Finding::new(
            verdict,
            numbers,
            "the median of the paper's own variant, standing, against 150 frames/s",
        ),
    )
}

fn streaming(table: &Table) -> Finding {
    let bound = Bound::AtMost(2.0);
    let each = names().into_iter().flat_map(|name| {
        let found = best(table, SLOWER, std::slice::from_ref(&name), bound);
        found.into_iter().map(move |ratio| Ratio { of: name.clone(), ..ratio }).collect::<Vec<_>>()
    });
    let found: Vec<Ratio> = each.collect();
    let mut finding = judge(table, bound, &found, || why_none(table, SLOWER, &names()));
    finding.why = finding.why.replace("places", "variants");
    finding
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
    fn a_moving_frame_may_take_twice_the_standing_one_in_every_variant() {
        let found = |paper, other: f64| {
            let rows =
                [(SCENE, None, THE_PAPER, SLOWER, paper), (SCENE, None, "fused, exact", SLOWER, other)];
            streaming(&table("cpu", &rows))
        };
        let verdicts = [found(1.9, 1.0), found(2.1, 1.0), found(2.1, 2.2)].map(|finding| finding.verdict);
        assert_eq!(verdicts, [Verdict::Reproduced, Verdict::InPart, Verdict::NotReproduced]);
        assert!(found(2.1, 1.0).why.starts_with("1 of 2 variants stay within"), "{:?}", found(2.1, 1.0));
        assert_eq!(streaming(&table("cpu", &[])).verdict, Verdict::NotMeasurable);
    }

    #[test]
    fn frames_a_second_are_the_inverse_of_frames_and_ratios_those_of_a_round() {
        let walk = |ms: [f64; 3]| Walk { ms: ms.to_vec(), missing: 0.5, loads: 2, uploads: 3 };
        let rounds =
            [[walk([10.0, 20.0, 30.0]), walk([30.0; 3])], [walk([40.0; 3]), walk([40.0, 60.0, 80.0])]];
        let rows = told("a", &rounds);
        let of = |quantity: &str| rows.iter().find(|row| row.quantity == quantity).unwrap().value.clone();
        assert_eq!(of(STANDING_FPS).number(), Some(1e3 * (1.0 / 30.0 + 1.0 / 40.0) / 2.0));
        assert_eq!(of(SLOWER).number(), Some(1.5));
        let Value::Spreads(along) = of(ALONG) else { panic!("a spread for each frame") };
        assert_eq!(
            along.iter().map(|(frame, ms)| (*frame, ms.min, ms.max)).collect::<Vec<_>>(),
            [(2.0, 30.0, 40.0), (3.0, 30.0, 60.0), (4.0, 30.0, 80.0)]
        );
    }

    #[test]
    fn memory_has_its_bound() {
        let verdict = |mib| memory(&table("cpu", &[(SCENE, None, THE_PAPER, MEMORY, mib)])).verdict;
        assert_eq!((verdict(1024.0), verdict(1025.0)), (Verdict::Reproduced, Verdict::NotReproduced));
    }
}
