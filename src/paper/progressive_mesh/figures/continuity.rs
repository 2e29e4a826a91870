//! pm.continuity: how evenly the number of faces follows the wanted error.

use super::super::choices::BuildEffort;
use super::super::mesh::{Level, ProgressiveMesh};
use super::super::run::level_for_error;
use super::super::simplify::SimplifyOptions;
use super::orders::{collapses, number, ordered};
use super::surfaces::{Size, distances};
use super::{models, scans};
use crate::figure::prelude::*;
use crate::stats::geometric_mean;

pub const CONTINUITY: Figure = Figure {
    id: "pm.continuity",
    title: "Faces that follow the wanted error",
    about: "The level of detail is continuous (the paper's title) if a slightly larger wanted error gives slightly \
            fewer faces. Here the wanted error rises in steps of 1 %, from the level with 90 % of the faces to the \
            level with 1000. How much does the number of faces change at most, and in how many steps does it not \
            change at all? `best` uses two passes of the simplifier; the second delays collapses by their deviation. \
            `fast` uses only the first pass. To show the price, mean and Hausdorff distances are compared at equal \
            numbers of faces (geometric means over 50, 20, 10 and 5 % of the faces, with 50 000 points in quick runs \
            and 400 000 otherwise). The closed models are `bunny`, `sphere`, `torus`, `knot` and `solid`, the open \
            model is `grid`; `dragon_res4` and (with --full) `dragon` are measured if they have been fetched. They are \
            not included in the means over models. `solid` has flat parts, which vanish with an error of 0: its steps \
            begin at the first error above rounding. Its error then jumps wherever a flat part is used up; errors \
            before a jump are raised by up to 2.5 times.",
    scenes: &WITH_SCANS,
    variants: || BuildEffort::ALL.iter().map(|effort| effort.name().into()).collect(),
    ours: &["best"],
    full_only: &[scans::LARGE],
    show: Show::views(|| models(CONTINUITY.scenes)),
    measure,
    plots: &[Plot::curves(FACES, "wanted error, diagonals").log_x().log_y(), Plot::bars(NONE)],
    claims: &[
        Claim::ours(
            "largest-change",
            "If the wanted error rises by 1 %, the number of faces changes by at most 2.5 %.",
            &[Test::value(one(MAX, BEST), AtMost(2.5))],
        ),
        Claim::ours(
            "every-step",
            "At most 2 % of the steps change nothing.",
            &[Test::value(one(NONE, BEST), AtMost(2.0))],
        ),
        Claim::ours(
            "distance",
            "At equal numbers of faces, the mean distance of `best` is at most 1.02 times that of `fast`, and the \
             Hausdorff distance at most 0.85 times (mean over the models).",
            AS_NEAR,
        )
        .at(Places::mean(&MODELS)),
        Claim::ours(
            "distance-on-scans",
            "The same bounds hold on the scans.",
            AS_NEAR,
        )
        .at(Places::scenes(&scans::ALL)),
    ],
    ..Figure::BASE
};

const BEST: &str = BuildEffort::Best.name();
const FAST: &str = BuildEffort::Fast.name();
const MODELS: [&str; 6] = ["bunny", "sphere", "torus", "knot", "solid", "grid"];
const WITH_SCANS: [&str; 8] =
    ["bunny", "sphere", "torus", "knot", "solid", "grid", scans::SMALL, scans::LARGE];

const FACES: &str = "faces at a wanted error";
const MAX: &str = "largest change of the faces";
const NONE: &str = "steps that change nothing";
const MEAN: &str = "mean distance";
const HAUSDORFF: &str = "Hausdorff distance";

/// The bounds of the distances, on the models and on the scans.
const AS_NEAR: &[Test] = &[
    Test::ratio_of(MEAN, [BEST, FAST], AtMost(1.02)),
    Test::ratio_of(HAUSDORFF, [BEST, FAST], AtMost(0.85)),
];

/// Ratio of successive wanted errors.
const STEP: f64 = 1.01;
/// Fractions of the faces at which distances are compared.
const PARTS: [f64; 4] = [0.5, 0.2, 0.1, 0.05];
/// Errors below this, in diagonals, count as rounding errors.
const ROUNDING: f64 = 1e-9;

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let model = scans::open(&cell.scene)?;
    let samples = bench.effort_of(50_000, 400_000);
    let diagonal = Size::of(&model).diagonal;
    let wedges = model.wedge_points();
    let mut rows = Vec::new();
    for &effort in BuildEffort::ALL {
        let name = effort.name();
        let options = SimplifyOptions { effort, ..SimplifyOptions::default() };
        let collapses = collapses(&model, &options);
        let mesh = ordered(&model, &collapses, None);
        let curve = curve(&mesh, diagonal);
        let [max, none] = changes(&curve).context("errors between 90 % and 1000 faces")?;
        rows.push(Row::new(name, FACES, "faces", Value::Series(curve)));
        rows.push(number(name, MAX, "%", max));
        rows.push(number(name, NONE, "%", none));
        let of_part = |part: f64| {
            let steps = collapses.steps_to(&model, (model.faces.len() as f64 * part) as usize);
            let faces = collapses.faces_after(&model, steps);
            distances(&model, &wedges, &faces, samples).context("a face is left")
        };
        let found = PARTS.into_iter().map(of_part).collect::<anyhow::Result<Vec<_>>>()?;
        let mean = geometric_mean(found.iter().map(|found| found.mean));
        rows.push(number(name, MEAN, "diagonals", mean));
        let hausdorff = geometric_mean(found.iter().map(|found| found.hausdorff));
        rows.push(number(name, HAUSDORFF, "diagonals", hausdorff));
    }
    Ok(rows)
}

/// The number of faces for wanted errors that rise by [`STEP`]; errors are in diagonals.
fn curve(mesh: &ProgressiveMesh, diagonal: f64) -> Vec<[f64; 2]> {
    let whole = mesh.faces.len() as f64;
    let error = |is_there: &dyn Fn(&Level) -> bool| {
        mesh.levels.iter().rev().find(|level| is_there(level)).map_or(0.0, |level| f64::from(level.error))
    };
    let first =
        error(&|level| f64::from(level.faces) <= 0.9 * whole && f64::from(level.error) > ROUNDING * diagonal);
    let last = error(&|level| level.faces <= 1000);
    let wanted = std::iter::successors(Some(first), |wanted| Some(wanted * STEP));
    let wanted = wanted.take_while(|wanted| *wanted <= last);
    let faces = |wanted: f64| mesh.levels[level_for_error(&mesh.levels, wanted as f32) as usize].faces;
    wanted.map(|wanted| [wanted / diagonal, f64::from(faces(wanted))]).collect()
}

/// The largest change over the steps of a curve, and the share of steps without a change, both in percent.
/// `None` without steps.
fn changes(curve: &[[f64; 2]]) -> Option<[f64; 2]> {
    let changes: Vec<f64> = curve.windows(2).map(|pair| 100.0 * (1.0 - pair[1][1] / pair[0][1])).collect();
    let max = changes.iter().copied().reduce(f64::max)?;
    let none = changes.iter().filter(|change| **change == 0.0).count();
    Some([max, 100.0 * none as f64 / changes.len() as f64])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_change_and_the_steps_without_a_change_are_found() {
        let curve = |faces: &[f64]| faces.iter().map(|&faces| [1.0, faces]).collect::<Vec<_>>();
        assert_eq!(changes(&curve(&[400.0, 300.0, 300.0, 150.0, 75.0])), Some([50.0, 25.0]));
        assert_eq!(changes(&curve(&[400.0])), None);
    }

    #[test]
    fn an_error_gives_the_coarsest_level_within_it() {
        let level = |faces: u32, error: f32| Level { faces, error, ..Level::default() };
        let levels: Vec<Level> =
            (0..=200).map(|n| level(1000 + 10 * n, 1.05 * 0.99_f32.powi(n as i32))).collect();
        let mesh = ProgressiveMesh { faces: vec![[0; 3]; 3000], levels, ..ProgressiveMesh::default() };
        let curve = curve(&mesh, 2.0);
        assert!(curve[0][1] <= 2700.0 && curve.last().unwrap()[1] <= 1020.0, "{curve:?}");
        assert!(curve.windows(2).all(|pair| pair[0][1] - pair[1][1] <= 20.0), "{curve:?}");
    }
}
