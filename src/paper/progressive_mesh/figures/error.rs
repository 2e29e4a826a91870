//! pm.error: the distance of the simplified mesh from the full one, for our simplifier and for meshoptimizer's.

use super::super::simplify::{SimplifyOptions, simplify};
use super::orders::CLOSED;
use super::surfaces::{Size, baseline, distances};
use super::{models, scans};
use crate::figure::prelude::*;
use crate::reference::distance::Triangles;

pub const ERROR: Figure = Figure {
    id: "pm.error",
    title: "Distance from the full mesh",
    about: "The paper accepts any simplifier. Ours is compared with `meshopt_simplify` (meshoptimizer), \
            whose collapses also leave vertices in place, at equal numbers of faces. The distances are the \
            mean, the root mean square and the largest (Hausdorff) distance in both directions, in diagonals \
            of the model's box. They are measured from points spread by area (50 000 in quick runs, else 400 \
            000) and from all vertices to the exact nearest point of the other surface. The figure also \
            shows the error that each simplifier states. Ours estimates the Hausdorff distance. It measures \
            77 points of each face, the points where edges of the two meshes cross, all vertices and points of \
            folds and long edges, and adds 3 %. The error of a component that vanishes is its extent, however far \
            away the next component is, so the stated error is compared with the distance of the remaining \
            components. meshoptimizer states its quadric error. Both get the same vertices, including seams. Of \
            the shipped models `bunny`, `sphere`, `torus`, `knot` and `solid` are closed, and `grid` is open. The \
            scans `dragon_res4` and (with --full) `dragon` are measured if they have been fetched. They are not \
            included in the means over models.",
    scenes: &["bunny", "sphere", "torus", "knot", "solid", "grid", scans::SMALL, scans::LARGE],
    variants: || [OURS, BASELINE].map(String::from).into(),
    paper: &[],
    ours: &["ours"],
    full_only: &[scans::LARGE],
    sweep: Some(Sweep {
        name: "faces left, %",
        quick: &[50.0, 25.0, 10.0, 5.0],
        full: &[50.0, 25.0, 10.0, 5.0, 2.0, 1.0],
    }),
    show: Show::views(|| models(ERROR.scenes)),
    measure,
    plots: &[
        Plot::sweep(MEAN).log_x().log_y(),
        Plot::sweep(HAUSDORFF).log_x().log_y(),
        Plot::sweep(STATED).log_x().log_y(),
    ],
    claims: &[
        Claim::ours(
            "mean",
            "On each closed model at 50 to 5 % of the faces, our mean distance is at most 0.95 times meshoptimizer's.",
            &[Test::ratio_of(MEAN, [OURS, BASELINE], AtMost(0.95))],
        )
        .at(Places::scenes(&CLOSED).x(5.0, 50.0)),
        Claim::ours(
            "hausdorff",
            "On each closed model at 50 to 5 % of the faces, our Hausdorff distance is at most 1.25 times \
             meshoptimizer's.",
            &[Test::ratio_of(HAUSDORFF, [OURS, BASELINE], AtMost(1.25))],
        )
        .at(Places::scenes(&CLOSED).x(5.0, 50.0)),
        Claim::ours(
            "dragon",
            "The dragon with 871 414 faces is simplified to 1 % of them.",
            &[Test::value(one(FACES, OURS), AtMost(8714.0))],
        )
        .at(Places::scenes(&[scans::LARGE]).x(1.0, 1.0)),
        Claim::ours(
            "stated",
            "Our stated error is never less than the measured Hausdorff distance between our mesh and the \
             components that have not vanished. The tolerance is 1.4e-14 diagonals (64 f64 roundings): if a \
             vertex is the farthest point, the simplifier and the measurement compute its distance in different \
             ways.",
            &[Test::difference(one(REMAINING, OURS), one(STATED, OURS), AtMost(TWO_WAYS))],
        ),
    ],
};

const OURS: &str = "ours";
const BASELINE: &str = "meshoptimizer";
const MEAN: &str = "mean distance";
const RMS: &str = "RMS distance";
const HAUSDORFF: &str = "Hausdorff distance";
/// Between the simplified mesh and those of the model's components that have not vanished.
const REMAINING: &str = "Hausdorff distance of the remaining components";
const STATED: &str = "stated error";
const FACES: &str = "faces";

/// Distances below this, in diagonals, count as 0. A flat part can lose faces without moving; its true
/// distance is then 0, and only rounding errors remain.
const ROUNDING: f64 = 1e-9;

/// Largest difference between two computations of one distance, in diagonals: coordinates are at most 1, and
/// a distance takes some dozen operations.
const TWO_WAYS: f64 = 64.0 * f64::EPSILON;

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let model = scans::open(&cell.scene)?;
    let part = cell.x.context("the sweep has values")? / 100.0;
    let target_faces = (model.faces.len() as f64 * part) as usize;
    let samples = bench.effort_of(50_000, 400_000);
    let simplified =
        simplify(&model, &SimplifyOptions { target_faces, ..SimplifyOptions::default() }, &mut |_, _| {});
    let steps = simplified.collapses.steps_to(&model, target_faces);
    let ours = simplified.collapses.faces_after(&model, steps);
    let wedges = model.wedge_points();
    let theirs = baseline(&wedges, &model.faces, target_faces)?;
    let diagonal = Size::of(&model).diagonal;
    let remaining = simplified.collapses.surviving_components(&model, steps);
    let both =
        [(OURS, ours, simplified.collapses.error_after(steps)), (BASELINE, theirs.faces, theirs.stated)];
    let mut rows = Vec::new();
    for (name, faces, stated) in both {
        let mut diagonals = |quantity, distance: f64| {
            let number = if distance > ROUNDING { distance } else { 0.0 };
            rows.push(Row::number(name, quantity, "diagonals", number));
        };
        let found = distances(&model, &wedges, &faces, samples).context("no face is left")?;
        diagonals(MEAN, found.mean);
        diagonals(RMS, found.rms);
        diagonals(HAUSDORFF, found.hausdorff);
        if name == OURS {
            let mut forth = found.forth;
            if remaining.len() < model.faces.len() {
                let [whole, left] = [&remaining, &faces].map(|faces| Triangles { positions: &wedges, faces });
                forth = Size::of(&model).distances(whole, left, samples).context("no face is left")?.forth;
            }
            diagonals(REMAINING, forth.max(found.back));
        }
        rows.push(Row::number(name, STATED, "diagonals", stated / diagonal));
        rows.push(Row::number(name, FACES, "faces", faces.len() as f64));
    }
    Ok(rows)
}
