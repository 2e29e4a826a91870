//! vt.headline: the paper's only number, the frame rate of its headline scene, with the camera at rest and moving.

use super::common::{PAPERS, SceneView, pixels_of};
use super::side_by_side::{
    Combination, PAPER_NATIVE, PLAIN, SideBySide, THE_PAPER, combinations, device_mib, settings,
};
use crate::figure::prelude::*;
use crate::frame::Run;
use crate::math::camera::Pose;
use crate::paper::virtual_texture::{VirtualTexture, VirtualTextureSettings};
use crate::picture::PixelFormat;
use crate::picture::write::Srgb8Picture;
use crate::scene::path::CameraPath;
use crate::stats::Summary;
use crate::vk::FRAMES_IN_FLIGHT;
use std::time::Instant;

pub const HEADLINE: Figure = Figure {
    id: "vt.headline",
    title: "The paper's headline",
    about: "The paper (introduction, figure 5) reports about 150 frames a second on a GeForce GTX 285 at 1920 x 1080. \
            Its scene is an Earth of about 150 000 polygons with a texture of 2^18 x 2^17 texels in tiles of 512 x \
            512, seen from 300 km with 4x magnification. Here the same scene is drawn at 1280 x 720 (quick) or 1920 x \
            1080 pixels, with the paper's filter: up to 16 samples along the footprint, in tiles whose border of 16 \
            texels contains them. \"Standing\": the camera rests and all tiles are resident. \"Moving\": the camera \
            follows the path `pan` (240 frames, the first 30 in quick runs). The caches begin with the first picture's \
            tiles; all others are synthesised, loaded and copied within the scene's budgets. Times are wall times from \
            frame to frame and include the host's work. In each of 6 rounds every variant runs standing and moving in \
            turn, in its own sessions. The frame rate is 1 over the median frame time of a round. A tile is \
            synthesised in 13 ms on one core; a software device runs on the same cores.",
    scenes: &[SCENE],
    variants: || [names(), vec![PLAIN.to_string()]].concat(),
    paper: &["paper"],
    ours: &["fused, exact"],
    show: Show::scenes(PAPERS).variants(|| settings(&contenders())),
    measure,
    plots: &[Plot::bars(STANDING), Plot::curves(ALONG, "frame along the path").log_y()],
    claims: &[
        Claim::paper_timed(
            "introduction",
            "150-fps",
            "The paper's frame is drawn about 150 times a second (on a GeForce GTX 285).",
            &[Test::value(one(STANDING_FPS, THE_PAPER), AtLeast(150.0))],
        ),
        Claim::ours_timed(
            "streaming",
            "Moving along `pan`, with tiles synthesised, loaded and copied within the scene's budgets, the median \
             frame takes at most twice as long as with the camera at rest in the same round.",
            &[Test::value(each(SLOWER, names), AtMost(2.0))],
        ),
        Claim::ours(
            "memory",
            "The paper's frame needs at most the 1 GiB of device memory of a GTX 285.",
            &[Test::value(one(MEMORY, THE_PAPER), AtMost(1024.0))],
        ),
    ],
    ..Figure::BASE
};

const SCENE: &str = "earth/headline";
const PATH: &str = "pan";

/// Quantities. The first three are wall milliseconds from frame to frame; the frame rates and the ratio derive
/// from them.
const STANDING: &str = "frame, standing";
const MOVING: &str = "frame, moving";
const ALONG: &str = "frame along the path";
const STANDING_FPS: &str = "frames/s, standing";
const MOVING_FPS: &str = "frames/s, moving";
const SLOWER: &str = "frame, moving over standing";
const MEMORY: &str = "memory";

/// The paper's frame, and all variants that make the same exact list on the device.
fn contenders() -> Vec<Combination> {
    combinations().into_iter().filter(|c| c.is_ours() && c.name != PAPER_NATIVE).collect()
}

fn names() -> Vec<String> {
    contenders().into_iter().map(|combination| combination.name.to_string()).collect()
}

/// Number of rounds, and the numbers of frames in each round: with the camera at rest, and moving.
struct Extent {
    rounds: usize,
    at_rest: u32,
    moving: u32,
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let (rows_of_pixels, extent) = bench.effort_of(
        (720.0, Extent { rounds: 6, at_rest: 10, moving: 30 }),
        (1080.0, Extent { rounds: 6, at_rest: 60, moving: 240 }),
    );
    let size = pixels_of(rows_of_pixels);
    let place = SceneView::find(&cell.scene)?;
    let path = place.scene.path(PATH)?.clone();
    let streaming = VirtualTextureSettings::of_scene(&place.scene, PixelFormat::Srgb8)?.streaming;
    let mut side = SideBySide::settled(bench, place, size, (&contenders(), &[PLAIN]), |settings| {
        settings.streaming = streaming.clone();
    })?;
    let mut rows = side.rows(bench)?;
    if let Some((_, session)) = side.sessions.iter_mut().find(|(name, _)| name == THE_PAPER) {
        let rgba = session.picture_bytes()?;
        let picture = Srgb8Picture { width: size[0], height: size[1], rgba };
        bench.picture(&format!("{}-{}", HEADLINE.id, cell.scene.replace('/', "-")), &picture)?;
    }
    let walks = walks(&mut side, &path, &extent)?;
    for ((name, session), walks) in side.sessions.iter().zip(&walks) {
        rows.extend(rows_of(name, walks));
        rows.push(Row::number(&**name, MEMORY, "MiB", device_mib(session)));
    }
    Ok(rows)
}

/// Runs all sessions in turn, at rest and moving. Each round begins with a different session. Returns each session's
/// rounds.
fn walks(side: &mut SideBySide, path: &CameraPath, extent: &Extent) -> anyhow::Result<Vec<Vec<[Walk; 2]>>> {
    let (count, pose) = (side.sessions.len(), side.pose);
    Bench::in_turn(extent.rounds, count, |at| {
        let standing = Walk::run(&mut side.sessions[at].1, extent.at_rest, |_| pose)?;
        // A new session has only the first picture's tiles, and its source must synthesise each tile again.
        let mut afresh = side.afresh(at, &path.pose(0))?;
        side.source.forget();
        Ok([standing, Walk::run(&mut afresh, extent.moving, |frame| path.pose(frame))?])
    })
}

/// Successive frames, as in the window.
struct Walk {
    /// Wall time of each frame.
    ms: Vec<f64>,
    /// Mean share of a frame's wanted tiles that are not resident, and are replaced by coarser ones.
    missing: f64,
    /// Tiles loaded in all frames.
    loads: usize,
    /// Tiles uploaded in all frames.
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
        // The first frames wait for no earlier frame.
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
fn rows_of(name: &str, rounds: &[[Walk; 2]]) -> Vec<Row> {
    let row = |quantity, unit, samples: &dyn Fn() -> Vec<f64>| {
        Row::new(name, quantity, unit, Value::Summary(summary(samples())))
    };
    let ms = |at: usize| rounds.iter().flat_map(move |walks| walks[at].ms.iter().copied());
    let median = |walk: &Walk| summary(walk.ms.iter().copied()).median;
    let of_rounds = |quantity, unit, of: &dyn Fn(&[Walk; 2]) -> f64| {
        Row::of_rounds(name, quantity, unit, Some(rounds.iter().map(of).collect()))
    };
    let of_walks =
        |of: &dyn Fn(&Walk) -> f64| rounds.iter().map(|[_, moving]| of(moving)).collect::<Vec<f64>>();
    let frames = rounds.first().map_or(0, |[_, moving]| moving.ms.len());
    let frame =
        |n: usize| ((n + FRAMES_IN_FLIGHT) as f64, summary(rounds.iter().map(|[_, moving]| moving.ms[n])));
    vec![
        row(STANDING, "ms", &|| ms(0).collect()),
        row(MOVING, "ms", &|| ms(1).collect()),
        of_rounds(STANDING_FPS, "1/s", &|[standing, _]| 1e3 / median(standing)),
        of_rounds(MOVING_FPS, "1/s", &|[_, moving]| 1e3 / median(moving)),
        of_rounds(SLOWER, "", &|[standing, moving]| median(moving) / median(standing)),
        Row::new(name, ALONG, "ms", Value::Spreads((0..frames).map(frame).collect())),
        row("tiles loaded, moving", "tiles", &|| of_walks(&|walk| walk.loads as f64)),
        row("tiles uploaded, moving", "tiles", &|| of_walks(&|walk| walk.uploads as f64)),
        row("share of tiles shown coarser, moving", "", &|| of_walks(&|walk| walk.missing)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_rates_are_inverse_frame_times_and_ratios_are_taken_per_round() {
        let walk = |ms: [f64; 3]| Walk { ms: ms.to_vec(), missing: 0.5, loads: 2, uploads: 3 };
        let rounds =
            [[walk([10.0, 20.0, 30.0]), walk([30.0; 3])], [walk([40.0; 3]), walk([40.0, 60.0, 80.0])]];
        let rows = rows_of("a", &rounds);
        let of = |quantity: &str| rows.iter().find(|row| row.quantity == quantity).unwrap().value.clone();
        assert_eq!(of(STANDING_FPS).number(), Some(37.5));
        assert_eq!(of(SLOWER).number(), Some(1.5));
        let Value::Spreads(along) = of(ALONG) else { panic!("a spread for each frame") };
        assert_eq!(
            along.iter().map(|(frame, ms)| (*frame, ms.min, ms.max)).collect::<Vec<_>>(),
            [(2.0, 30.0, 40.0), (3.0, 30.0, 60.0), (4.0, 30.0, 80.0)]
        );
    }
}
