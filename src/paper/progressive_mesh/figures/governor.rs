//! pm.governor: frame time and error along a path, without and with the governor.

use super::{scene, session, short};
use crate::figure::{
    Axis, Bench, Cell, Claim, Effort, Figure, Finding, Origin, Plot, Row, Table, Value, Verdict,
};
use crate::paper::progressive_mesh::session::{FrameRecord, Session};
use crate::scene::path::Path;
use crate::stats::{Summary, median};
use anyhow::Context;

const VARIANTS: [&str; 2] = ["no governor", "governor"];

const TIME: &str = "frame time";
const FACTOR: &str = "error over the scene's own";
const FRAMES: &str = "frames after the first 30";
const WITHIN: &str = "frames within 1.15 of the budget";
const TURNS: &str = "turns of the error";
const BUDGET: &str = "budget";

const SCENE: &str = "herd/walk";

/// Frames that the governor may take from the scene's own error to the one that holds the budget: octaves of 0.12 a
/// frame and two frames of delay.
const SETTLING: usize = 30;

/// The figure.
pub const GOVERNOR: Figure = Figure {
    id: "pm.governor",
    title: "Frame time and error along a path, without and with a governor",
    about: "The paper changes the wanted deviation according to the platform's performance (section 4), and does not say \
            how. Here 500 instances are walked through, asked for an eighth of a pixel, which makes nearly all of them \
            full meshes. The governor's budget is a third of the median frame without it. A frame's time is the host's \
            work on levels and all passes. After 30 frames, are frames within the budget, and does the error rest or \
            hunt? A turn is a change of the error against the direction of the last one.",
    scenes: &[SCENE],
    variants,
    sweep: None,
    measure,
    plots: &[
        Plot { quantity: TIME, x: Axis::Series("frame"), log_x: false, log_y: true, floor: None },
        Plot { quantity: FACTOR, x: Axis::Series("frame"), log_x: false, log_y: true, floor: None },
    ],
    claims: &[
        Claim {
            id: "budget-held",
            text: "After the first 30 frames nine of ten frames take at most 1.15 of the budget.",
            from: Origin::Paper("4"),
            check: budget_held,
        },
        Claim {
            id: "no-oscillation",
            text: "The error does not hunt: it turns in at most one frame of ten.",
            from: Origin::Ours,
            check: no_oscillation,
        },
    ],
};

fn variants() -> Vec<String> {
    VARIANTS.map(String::from).into()
}

/// Every n-th of the path's frames.
fn step(effort: Effort) -> usize {
    match effort {
        Effort::Quick => 2,
        Effort::Full => 1,
    }
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let (scene, path) = scene(&cell.scene, &["progressive_mesh.herd.error_pixels=0.125".into()])?;
    let path = scene.path(path)?;
    let step = step(bench.effort);
    let mut own = session(bench, &scene, |_| ())?;
    // What shaders and memory cost at their first use is not a frame's.
    own.frame(&path.pose(0))?;
    own.drain()?;
    own.records.clear();
    walk(&mut own, path, step)?;
    let Some(times) = times(&own.records) else {
        let why = "the device keeps no time";
        return Ok(VARIANTS.map(|v| Row::new(v, TIME, "ms", Value::Missing(why.into()))).into());
    };
    let budget_ms = median(&times).context("a path has frames")? / 3.0;
    let mut governed = session(bench, &scene, |settings| settings.frame_ms = Some(budget_ms))?;
    walk(&mut governed, path, step)?;
    let mut rows = vec![Row::new(VARIANTS[1], BUDGET, "ms", Value::Number(budget_ms))];
    for (variant, session) in VARIANTS.into_iter().zip([&own, &governed]) {
        rows.extend(told(variant, &session.records, budget_ms)?);
    }
    Ok(rows)
}

fn walk(session: &mut Session, path: &Path, step: usize) -> anyhow::Result<()> {
    for frame in (0..path.frames).step_by(step) {
        session.frame(&path.pose(frame))?;
    }
    Ok(session.drain()?)
}

fn times(records: &[FrameRecord]) -> Option<Vec<f64>> {
    records.iter().map(FrameRecord::milliseconds).collect()
}

fn told(variant: &str, records: &[FrameRecord], budget_ms: f64) -> anyhow::Result<Vec<Row>> {
    let times = times(records).context("timed before")?;
    let series = |values: &[f64]| {
        Value::Series(values.iter().enumerate().map(|(n, value)| [n as f64, *value]).collect())
    };
    let factors: Vec<f64> = records.iter().map(|record| record.error_factor).collect();
    let settled = &times[SETTLING.min(times.len() - 1)..];
    let within = settled.iter().filter(|ms| **ms <= 1.15 * budget_ms).count();
    let percent = |part: usize| Value::Number(100.0 * part as f64 / settled.len() as f64);
    Ok(vec![
        Row::new(variant, TIME, "ms", series(&times)),
        Row::new(variant, FACTOR, "", series(&factors)),
        Row::new(variant, FRAMES, "ms", Value::Summary(Summary::of(settled).context("a path has frames")?)),
        Row::new(variant, WITHIN, "%", percent(within)),
        Row::new(
            variant,
            TURNS,
            "% of the frames",
            percent(turns(&factors[SETTLING.min(factors.len() - 1)..])),
        ),
    ])
}

/// How often a sequence goes up after it went down, or down after up; rests between count for nothing.
fn turns(values: &[f64]) -> usize {
    let directions: Vec<bool> =
        values.windows(2).filter(|pair| pair[0] != pair[1]).map(|pair| pair[1] > pair[0]).collect();
    directions.windows(2).filter(|pair| pair[0] != pair[1]).count()
}

fn budget_held(table: &Table) -> Finding {
    let of = |variant, quantity| table.number(SCENE, None, variant, quantity);
    let numbers = (of(VARIANTS[0], WITHIN), of(VARIANTS[1], WITHIN), of(VARIANTS[1], BUDGET));
    let (Some(without), Some(with), Some(budget_ms)) = numbers else {
        return Finding::new(Verdict::NotMeasurable, "", "no frame was timed");
    };
    let frame = of(VARIANTS[1], FRAMES).map_or_else(String::new, |ms| format!(", median {} ms", short(ms)));
    let verdict = match with {
        with if with >= 90.0 => Verdict::Reproduced,
        with if with > without => Verdict::InPart,
        _ => Verdict::NotReproduced,
    };
    let numbers = format!(
        "{} % of the frames within {} ms{frame}; without a governor {} %",
        short(with),
        short(budget_ms),
        short(without)
    );
    Finding::new(
        verdict,
        numbers,
        "a loop on the measured time holds on any device; neighbours of a shared one are noise",
    )
}

fn no_oscillation(table: &Table) -> Finding {
    let Some(turns) = table.number(SCENE, None, VARIANTS[1], TURNS) else {
        return Finding::new(Verdict::NotMeasurable, "", "no frame was timed");
    };
    let verdict = if turns <= 10.0 { Verdict::Reproduced } else { Verdict::NotReproduced };
    let why = "an integral controller below its critical gain, with a dead band of 7 %, on a mean of the last frames";
    Finding::new(verdict, format!("{} % of the frames", short(turns)), why)
}

#[cfg(test)]
mod tests {
    use super::super::tests::table;
    use super::*;

    #[test]
    fn turns_are_counted_and_rests_are_not() {
        assert_eq!(turns(&[1.0, 2.0, 3.0, 3.0, 4.0]), 0);
        assert_eq!(turns(&[1.0, 2.0, 2.0, 1.0, 1.5]), 2);
        assert_eq!(turns(&[1.0]), 0);
    }

    #[test]
    fn nine_of_ten_frames_hold_the_budget_and_fewer_do_in_part() {
        let found = |with| {
            let rows = [(VARIANTS[0], WITHIN, 0.0), (VARIANTS[1], WITHIN, with), (VARIANTS[1], BUDGET, 5.0)];
            budget_held(&table("cpu", &rows.map(|(v, q, n)| (SCENE, v, q, n)))).verdict
        };
        assert_eq!((found(90.0), found(89.0)), (Verdict::Reproduced, Verdict::InPart));
        assert_eq!(found(0.0), Verdict::NotReproduced);
        assert_eq!(budget_held(&table("cpu", &[])).verdict, Verdict::NotMeasurable);
    }

    #[test]
    fn an_error_that_turns_in_every_other_frame_hunts() {
        let found = |turns| no_oscillation(&table("cpu", &[(SCENE, VARIANTS[1], TURNS, turns)])).verdict;
        assert_eq!((found(10.0), found(50.0)), (Verdict::Reproduced, Verdict::NotReproduced));
    }
}
