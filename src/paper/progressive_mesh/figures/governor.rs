//! pm.governor: frame time and error along two paths, without a governor and with each of two rules.

use super::scene;
use crate::figure::prelude::*;
use crate::frame::Run;
use crate::paper::progressive_mesh::governor::{Budget, Rule};
use crate::paper::progressive_mesh::{
    LoadedMesh, MeshFrameRecord, ProgressiveMeshSettings, ProgressiveMeshes, load,
};
use crate::picture::PixelFormat;
use crate::scene::Scene;
use crate::scene::path::CameraPath;
use crate::stats::{Summary, geometric_mean, median};
use crate::vk::Gpu;

const WITHOUT: &str = "no governor";
const INTEGRAL: &str = "integral";
const PLANNED: &str = "governor";
/// The simple controller with a reserve: it controls the time to nine tenths of the budget.
const RESERVED: &str = "integral, 0.9 of the budget";
const RESERVE: f64 = 0.9;
/// All instances at their coarsest level: about the most frames that a governor can keep within the budget.
const COARSEST: &str = "coarsest levels";
const VARIANTS: [&str; 5] = [WITHOUT, COARSEST, INTEGRAL, RESERVED, PLANNED];

const TIME: &str = "frame time";
const FACTOR: &str = "error over the scene's own";
const FACES: &str = "faces drawn";
const FRAMES: &str = "frame time after the first 30 frames";
const WITHIN: &str = "frames within the budget";
const NEARLY: &str = "frames within 1.1 times the budget";
const OVERSHOOT: &str = "95th percentile of the frame times, over the budget";
const TURNS: &str = "reversals of the error";
const PRICE: &str = "mean error over the scene's own";
const BUDGET: &str = "budget";

const WALK: &str = "herd/walk";
const CUTS: &str = "herd/cuts";

/// Maximum number of frames for a governor to settle from the scene's own error to one within the budget.
const SETTLING: usize = 30;

/// The wanted error in pixels, without a limit of its change: the figure's changes of the error are the governor's.
const ERROR: &str = "surface.herd.geometry.error_pixels=0.125";
const AT_ONCE: &str = "surface.herd.geometry.pixels_per_second=1e6";

/// The figure.
pub const GOVERNOR: Figure = Figure {
    id: "pm.governor",
    title: "Frame time and error along a path, without and with a governor",
    about: "The paper changes the wanted deviation according to the platform's performance (section 4), and does not \
            say how. Here a camera moves through 500 instances with a wanted error of an eighth of a pixel, at \
            which nearly all of them are full meshes. The budget is the geometric mean of two median frame times: without a \
            governor, and with all instances at their coarsest levels. A frame's time is the host's work on levels plus all passes. `governor` plans each frame from \
            its number of faces and an estimate of the time per face. `integral` is a simple integral controller that \
            uses only measured times. With a reserve it keeps more frames within the budget, at a larger error, so it \
            is also measured with nine tenths of the budget. `coarsest levels` shows about how many frames can be \
            within the budget at all. The variants alternate frame by frame, and the path is repeated. The first 30 \
            frames of each repetition are not judged. The figure shows each number's median and spread over the \
            repetitions. Are frames within the budget? By how much do the others exceed it? Is the error steady, or \
            does it oscillate (a reversal is a change of the error against the direction of the previous change)? And \
            what is the cost (the geometric mean of the error)? On the second path the view jumps every 20 frames.",
    scenes: &[WALK, CUTS],
    variants: || VARIANTS.map(String::from).into(),
    ours: &[PLANNED],
    // The figure's budget follows from the device's times; a window has a fixed budget.
    show: Show::scenes(&[ERROR, AT_ONCE]).variants(|| {
        let governed = [(WITHOUT, None), (PLANNED, Some("governor.frame_ms=20.0"))];
        governed.map(|(name, change)| Setting::new(name, change)).into()
    }),
    measure,
    plots: &[Plot::curves(TIME, "frame").log_y(), Plot::curves(FACTOR, "frame").log_y(), Plot::bars(WITHIN)],
    claims: &[
        Claim::ours_timed(
            "budget-held",
            "On a walk, nine of ten frames are within the budget after the first 30 frames.",
            &[Test::value(one(WITHIN, PLANNED), AtLeast(90.0))],
        )
        .at(Places::scenes(&[WALK])),
        Claim::ours_timed(
            "no-oscillation",
            "The error does not oscillate: it reverses its direction in at most one frame of ten.",
            &[Test::value(one(TURNS, PLANNED), AtMost(10.0))],
        ),
        Claim::ours_timed(
            "planning-pays",
            "If the view jumps, the governor keeps the budget in more frames than the integral controller does, also \
             if that controller keeps a reserve of a tenth.",
            &Test::ratios_of(WITHIN, [[PLANNED, INTEGRAL], [PLANNED, RESERVED]], Above(1.0)),
        )
        .at(Places::scenes(&[CUTS])),
        Claim::ours_timed(
            "planning-is-free",
            "On a walk, where nothing changes quickly, the governor keeps the budget in at least as many frames as the \
             integral controller with a reserve does, with at most 1.1 times its mean error.",
            &[
                Test::ratio_of(WITHIN, [PLANNED, RESERVED], AtLeast(1.0)),
                Test::ratio_of(PRICE, [PLANNED, RESERVED], AtMost(1.1)),
            ],
        )
        .at(Places::scenes(&[WALK])),
    ],
    ..Figure::BASE
};

/// Walks along the path: the smallest number with a 95 % confidence interval.
const WALKS: usize = 6;

/// The scene and path of the walk.
struct Walk<'a> {
    gpu: Gpu,
    models: Vec<LoadedMesh>,
    scene: Scene,
    path: &'a str,
    size: [u32; 2],
    step: usize,
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let (scene, path) = scene(&cell.scene, &[ERROR, AT_ONCE].map(String::from))?;
    let step = bench.effort_of(2, 1);
    let size = bench.effort_of([320, 180], [1280, 720]);
    let walk = Walk { gpu: bench.gpu(&[])?, models: load(&scene)?, scene, path, size, step };
    let coarsest = (Budget { frame_ms: None, frame_faces: Some(1) }, Rule::Planned);
    let ends = walk.records(&[None, Some(coarsest)])?;
    let median = |records: &Vec<_>| times(records).and_then(|times| median(&times));
    let [Some(free_ms), Some(coarsest_ms)] = [&ends[0], &ends[1]].map(median) else {
        let why = "the device has no timestamps";
        return Ok(VARIANTS.map(|v| Row::missing(v, TIME, why)).into());
    };
    let budget_ms = (free_ms * coarsest_ms).sqrt();
    let of_time = |ms| Budget { frame_ms: Some(ms), frame_faces: None };
    let held = [
        None,
        Some(coarsest),
        Some((of_time(budget_ms), Rule::Integral)),
        Some((of_time(RESERVE * budget_ms), Rule::Integral)),
        Some((of_time(budget_ms), Rule::Planned)),
    ];
    let runs = (0..WALKS).map(|_| walk.records(&held)).collect::<anyhow::Result<Vec<_>>>()?;
    let mut rows = vec![Row::number(PLANNED, BUDGET, "ms", budget_ms)];
    for (n, variant) in VARIANTS.into_iter().enumerate() {
        let runs: Vec<&[MeshFrameRecord]> = runs.iter().map(|run| &*run[n]).collect();
        rows.extend(rows_of_runs(variant, &runs, budget_ms)?);
    }
    Ok(rows)
}

impl Walk<'_> {
    /// The frames of one walk with each of `budgets`. The budgets alternate frame by frame.
    fn records(&self, budgets: &[Option<(Budget, Rule)>]) -> anyhow::Result<Vec<Vec<MeshFrameRecord>>> {
        let path: &CameraPath = self.scene.path(self.path)?;
        let own = ProgressiveMeshSettings::of_scene(&self.scene, PixelFormat::Srgb8)?;
        let session = |held: &Option<(Budget, Rule)>| {
            let (budget, rule) = held.unzip();
            let settings =
                ProgressiveMeshSettings { size: self.size, budget, rule: rule.unwrap_or_default(), ..own };
            ProgressiveMeshes::run(self.gpu.clone(), &self.models, settings)
        };
        let mut sessions = budgets.iter().map(session).collect::<Result<Vec<_>, _>>()?;
        // A first frame, which is not recorded, takes the first-use costs of shaders and memory.
        for session in &mut sessions {
            session.frame(&path.pose(0))?;
            session.drain()?;
            session.records.take();
        }
        for (turn, frame) in (0..path.frames).step_by(self.step).enumerate() {
            let count = sessions.len();
            for n in 0..count {
                sessions[(turn + n) % count].frame(&path.pose(frame))?;
            }
        }
        let records = |mut session: Run<ProgressiveMeshes>| {
            session.drain()?;
            Ok(session.records.take())
        };
        sessions.into_iter().map(records).collect()
    }
}

fn times(records: &[MeshFrameRecord]) -> Option<Vec<f64>> {
    records.iter().map(MeshFrameRecord::milliseconds).collect()
}

/// The results of one walk of a variant, without its first [`SETTLING`] frames.
struct Shown {
    times: Vec<f64>,
    factors: Vec<f64>,
}

impl Shown {
    fn of(records: &[MeshFrameRecord]) -> anyhow::Result<Shown> {
        let settled = &records[SETTLING.min(records.len().saturating_sub(1))..];
        let times = times(settled).context("timed before")?;
        Ok(Shown { times, factors: settled.iter().map(|record| record.error_factor).collect() })
    }

    fn percent(&self, part: usize) -> f64 {
        100.0 * part as f64 / self.times.len() as f64
    }

    fn within(&self, max_ms: f64) -> f64 {
        self.percent(self.times.iter().filter(|ms| **ms <= max_ms).count())
    }

    fn price(&self) -> f64 {
        geometric_mean(self.factors.iter().copied())
    }
}

fn rows_of_runs(variant: &str, runs: &[&[MeshFrameRecord]], budget_ms: f64) -> anyhow::Result<Vec<Row>> {
    let first = runs.first().context("walked at least once")?;
    let series = |values: Vec<f64>| {
        Value::Series(values.iter().enumerate().map(|(n, value)| [n as f64, *value]).collect())
    };
    let faces = first.iter().map(|record| record.change.faces as f64).collect();
    let shown = runs.iter().map(|run| Shown::of(run)).collect::<anyhow::Result<Vec<_>>>()?;
    let all: Vec<f64> = shown.iter().flat_map(|shown| shown.times.iter().copied()).collect();
    let over = |quantity, unit, of: &dyn Fn(&Shown) -> f64| {
        Row::of_rounds(variant, quantity, unit, Some(shown.iter().map(of).collect()))
    };
    let exceeded =
        |shown: &Shown| crate::stats::percentile(&shown.times, 0.95).map_or(0.0, |ms| ms / budget_ms);
    let mut rows = vec![
        Row::new(variant, TIME, "ms", series(times(first).context("timed before")?)),
        Row::new(variant, FACTOR, "", series(first.iter().map(|record| record.error_factor).collect())),
        Row::new(variant, FACES, "faces", series(faces)),
        Row::new(variant, FRAMES, "ms", Value::Summary(Summary::of(&all).context("a path has frames")?)),
    ];
    rows.extend([
        over(WITHIN, "%", &|shown| shown.within(budget_ms)),
        over(NEARLY, "%", &|shown| shown.within(1.1 * budget_ms)),
        over(OVERSHOOT, "times", &exceeded),
        over(TURNS, "% of the frames", &|shown| shown.percent(turns(&shown.factors))),
        over(PRICE, "times", &Shown::price),
    ]);
    Ok(rows)
}

/// Reversals of a sequence: rises after a fall, and falls after a rise. Constant parts are ignored.
fn turns(values: &[f64]) -> usize {
    let directions: Vec<bool> =
        values.windows(2).filter(|pair| pair[0] != pair[1]).map(|pair| pair[1] > pair[0]).collect();
    directions.windows(2).filter(|pair| pair[0] != pair[1]).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_counted_and_rests_are_not() {
        assert_eq!(turns(&[1.0, 2.0, 3.0, 3.0, 4.0]), 0);
        assert_eq!(turns(&[1.0, 2.0, 2.0, 1.0, 1.5]), 2);
        assert_eq!(turns(&[1.0]), 0);
    }
}
