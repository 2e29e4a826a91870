//! pm.extremes: the results for invalid and degenerate meshes.

mod cases;

use super::super::simplify::{Simplified, SimplifyOptions, simplify};
use super::surfaces::baseline;
use crate::figure::prelude::*;
use crate::model::clean;
use crate::reference::distance::Triangles;
use cases::{CASES, Hostile, mesh};
use glam::DVec3;
use std::collections::HashMap;

pub const EXTREMES: Figure = Figure {
    id: "pm.extremes",
    title: "Hostile meshes",
    about: "What happens to meshes that occur in files and that simplifiers handle badly? The cases are the bunny \
            (3674 faces) unchanged (`clean`); moved (`offset 1e4`; `offset 1e7`, where a step of f32 is 1 and the \
            bunny is 10 across; `offset 1e9`, where all its vertices coincide); scaled (`scale 1e-38`, `scale 1e-20`, \
            `scale 1e-9`, `scale 1e15`, `scale 1e30`); with a vertex that is not finite or absurdly far away (`one \
            NaN`, `one infinity`, `one at 1e30`, `one 1000 times out`); with 500 `degenerate faces`, 500 `flat caps` \
            on its edges, or 200 `fins`; with `every face twice`, or with a reversed copy of a tenth of the faces \
            (`backs`); and as a `soup` of triangles. The case `seams` is the bunny with texture seams between charts, \
            reduced to 1 % of its faces. Two cases are other meshes: 1000 `tetrahedra`, and `bow-ties`, 20 cubes that \
            touch in corners. Except for `seams` the target is a quarter of the faces. Our simplifier first cleans \
            the mesh and reports the changes; `meshopt_simplify` gets the mesh unchanged, in f32. Distances are \
            measured to the intended shape, before damage and rounding to f32, in units of the diagonal of its \
            bounding box; faces that are not finite are left out. The deviation that reading and cleaning cause is \
            shown separately, because the stated error does not include it. Rows of `the mesh` describe the mesh \
            before cleaning and simplification.",
    scenes: &CASES,
    variants: || [OURS, BASELINE].map(String::from).into(),
    ours: &["ours"],
    show: Show::nothing("it simplifies damaged meshes and measures distances", "bunny"),
    measure,
    plots: &[Plot::bars(FACES).floor(TARGET)],
    claims: &[
        Claim::ours(
            "outcome",
            "Every mesh has a valid outcome. Either all faces are finite, and their distance from the \
             intended shape is at most the loss in reading plus the stated error. Or the mesh is refused with a \
             reason. Vanished components are not measured: their error is their extent. A loss in reading above \
             1/1000 of the diagonal is reported in words.",
            &[
                Test::value(one(NOT_FINITE, OURS), Equal(0.0)),
                Test::value(one(EXCESS, OURS), AtMost(ROUNDING)),
                Test::value(one(UNREPORTED, OURS), AtMost(LOSS)),
            ],
        ),
        Claim::ours(
            "target",
            "Every mesh is simplified to its target.",
            &[Test::ratio_of(FACES, [OURS, TARGET], AtMost(1.0))],
        ),
        Claim::ours(
            "crowded",
            "Simplification never increases the number of non-manifold edges (edges with more than two faces).",
            &[Test::difference_of(CROWDED, [OURS, MESH], AtMost(0.0))],
        ),
    ],
    ..Figure::BASE
};

const OURS: &str = "ours";
const BASELINE: &str = "meshoptimizer";
const TARGET: &str = "target";
const FACES: &str = "faces";
const HAUSDORFF: &str = "Hausdorff distance";
/// One-sided, from the remaining faces: components that vanished are not measured.
const LEFT: &str = "distance of the remaining faces";
/// One-sided, from the components of the cleaned mesh that did not vanish.
const REMAINING: &str = "distance of the remaining components";
const STATED: &str = "stated error";
const CROWDED: &str = "edges of more than two faces";
const NOT_FINITE: &str = "corners that are not finite";
const VANISHED: &str = "components that vanished";
const CLEANING: &str = "cleaning";
const OUTCOME: &str = "outcome";
/// The distance minus the stated error and the loss.
const EXCESS: &str = "distance beyond the stated error";
const UNREPORTED: &str = "loss that is not reported in words";

const MESH: &str = "the mesh";
const LOST: &str = "lost in reading and cleaning";

/// Distances below this, in diagonals, are rounding errors of f32.
const ROUNDING: f64 = 1e-6;
/// Losses above this, in diagonals, must be reported.
const LOSS: f64 = 1e-3;

/// Sample points on each surface, in addition to the vertices.
const SAMPLES: usize = 20_000;

fn measure(_: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    rows(&mesh(&cell.scene)?, SAMPLES)
}

fn rows(hostile: &Hostile, samples: usize) -> anyhow::Result<Vec<Row>> {
    let Hostile { raw, target_faces, .. } = hostile;
    let theirs = baseline(&raw.positions, &raw.faces, *target_faces)?;
    let mut rows = outcome_rows(BASELINE, hostile, &raw.positions, &theirs.faces, theirs.stated, samples);
    rows.extend(own_rows(hostile, samples));
    let number = |variant, quantity, unit, number: usize| Row::number(variant, quantity, unit, number as f64);
    rows.push(number(TARGET, FACES, "faces", *target_faces));
    rows.push(number(MESH, FACES, "faces", raw.faces.len()));
    rows.push(number(MESH, CROWDED, "edges", crowded_edges(&raw.positions, &raw.faces)));
    rows.push(number(MESH, NOT_FINITE, "corners", not_finite(&raw.positions, &raw.faces)));
    Ok(rows)
}

fn own_rows(hostile: &Hostile, samples: usize) -> Vec<Row> {
    let (model, report) = clean(&hostile.raw);
    let text = |quantity, words: String| Row::new(OURS, quantity, "", Value::Text(words));
    let changes = report.changes().join("; ");
    let number = |quantity, number| Row::number(OURS, quantity, "diagonals", number);
    let unreported = |lost: f64| number(UNREPORTED, if changes.is_empty() { lost } else { 0.0 });
    if model.faces.is_empty() {
        let none = [(FACES, "faces"), (NOT_FINITE, "corners"), (EXCESS, "diagonals")];
        let mut rows: Vec<Row> = none.map(|(quantity, unit)| Row::number(OURS, quantity, unit, 0.0)).into();
        rows.extend([
            unreported(f64::INFINITY),
            text(OUTCOME, format!("refused: no face is left: {changes}")),
        ]);
        return rows;
    }
    let options = SimplifyOptions { target_faces: hostile.target_faces, ..SimplifyOptions::default() };
    let Simplified { collapses, report: relaxed } = simplify(&model, &options, &mut |_, _| {});
    let positions = model.wedge_points();
    let steps = collapses.errors.len();
    let faces = collapses.faces_after(&model, steps);
    let stated = collapses.error_after(steps);
    let mut rows = outcome_rows(OURS, hostile, &positions, &faces, stated, samples);
    let [lost, _] = distance_rows(OURS, [LOST, LEFT], hostile, &positions, &model.faces, samples);
    rows.push(lost);
    let remaining = collapses.surviving_components(&model, steps);
    let [whole, left] = [&remaining, &faces].map(|faces| Triangles { positions: &positions, faces });
    let found = hostile.size().distances(whole, left, samples).map(|found| found.forth);
    rows.push(Row::new(OURS, REMAINING, "diagonals", found.map_or_else(missing, Value::Number)));
    rows.push(Row::number(OURS, VANISHED, "components", relaxed.components as f64));
    rows.push(number(EXCESS, excess(&rows)));
    rows.push(unreported(number_of(&rows, LOST).unwrap_or(f64::INFINITY)));
    rows.push(text(CLEANING, if changes.is_empty() { "nothing".into() } else { changes }));
    let words = match relaxed.shortfall {
        Some(why) => format!("{} faces: {why}", relaxed.faces),
        None if steps == 0 => {
            format!("cleaning left {} faces, no more than the target: nothing to simplify", model.faces.len())
        }
        None => format!(
            "reached the target; {} components vanished, {} collapses joined two sheets, {} rotated a face too far",
            relaxed.components, relaxed.pinches, relaxed.flips
        ),
    };
    rows.push(text(OUTCOME, words));
    rows
}

fn outcome_rows(
    name: &str,
    hostile: &Hostile,
    positions: &[DVec3],
    faces: &[[u32; 3]],
    stated: f64,
    samples: usize,
) -> Vec<Row> {
    let number = |quantity, unit, number| Row::number(name, quantity, unit, number);
    let [hausdorff, left] = distance_rows(name, [HAUSDORFF, LEFT], hostile, positions, faces, samples);
    vec![
        number(FACES, "faces", faces.len() as f64),
        hausdorff,
        left,
        number(STATED, "diagonals", stated / hostile.size().diagonal),
        number(CROWDED, "edges", crowded_edges(positions, faces) as f64),
        number(NOT_FINITE, "corners", not_finite(positions, faces) as f64),
    ]
}

fn missing() -> Value {
    Value::Missing("no face with an area is left".into())
}

/// The largest distance from the intended shape: two-sided, and one-sided from the faces.
fn distance_rows(
    name: &str,
    quantities: [&str; 2],
    hostile: &Hostile,
    positions: &[DVec3],
    faces: &[[u32; 3]],
    samples: usize,
) -> [Row; 2] {
    let finite = |face: &&[u32; 3]| face.iter().all(|&vertex| positions[vertex as usize].is_finite());
    let faces: Vec<[u32; 3]> = faces.iter().filter(finite).copied().collect();
    let meant = Triangles { positions: &hostile.meant.positions, faces: &hostile.meant.faces };
    let found = hostile.size().distances(meant, Triangles { positions, faces: &faces }, samples);
    let value = |number: Option<f64>| number.map_or_else(missing, Value::Number);
    let numbers = [found.map(|found| found.hausdorff), found.map(|found| found.back)];
    [0, 1].map(|at| Row::new(name, quantities[at], "diagonals", value(numbers[at])))
}

fn not_finite(positions: &[DVec3], faces: &[[u32; 3]]) -> usize {
    faces.iter().flatten().filter(|&&vertex| !positions[vertex as usize].is_finite()).count()
}

/// Edges of more than two faces, by the positions of their ends.
fn crowded_edges(positions: &[DVec3], faces: &[[u32; 3]]) -> usize {
    let mut edges: HashMap<[[u64; 3]; 2], usize> = HashMap::new();
    // Adding 0 turns -0 into 0.
    let bits = |vertex: u32| (positions[vertex as usize] + 0.0).to_array().map(f64::to_bits);
    for face in faces {
        for k in 0..3 {
            let (a, b) = (bits(face[k]), bits(face[(k + 1) % 3]));
            *edges.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    edges.values().filter(|&&faces| faces > 2).count()
}

fn number_of(rows: &[Row], quantity: &str) -> Option<f64> {
    rows.iter().find(|row| row.quantity == quantity)?.value.number()
}

/// How far our faces lie from the intended shape beyond the stated error and the loss, in diagonals. Infinite if one
/// of these numbers is missing, or if components vanished with a stated error of 0.
fn excess(own: &[Row]) -> f64 {
    let of = |quantity| number_of(own, quantity);
    // The error of a vanished component is its extent, regardless of its distance from the others.
    let vanished = of(VANISHED).is_some_and(|parts| parts > 0.0);
    let remaining = of(LEFT).zip(of(REMAINING)).map(|(left, remaining)| left.max(remaining));
    let distance = if vanished { remaining } else { of(HAUSDORFF) };
    match (distance, of(STATED), of(LOST)) {
        (Some(distance), Some(stated), Some(lost)) if stated.is_finite() && (!vanished || stated > 0.0) => {
            distance - stated - lost
        }
        _ => f64::INFINITY,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::{Machine, Table, TableRecord, Verdict};

    #[test]
    fn a_distance_above_the_stated_error_plus_the_loss_is_an_excess() {
        let excess = |changes: &[(&str, f64)]| {
            let usual = [(HAUSDORFF, 0.1), (LEFT, 0.0), (REMAINING, 0.0), (STATED, 0.2), (LOST, 0.0)];
            // The first row of a quantity counts.
            let rows = changes
                .iter()
                .chain(&usual)
                .map(|(quantity, number)| Row::number(OURS, *quantity, "", *number));
            super::excess(&rows.collect::<Vec<_>>())
        };
        let vanished = (VANISHED, 1.0);
        for (changes, kept) in [
            (vec![], true),
            (vec![(HAUSDORFF, 0.0), (STATED, 0.0)], true),
            (vec![(HAUSDORFF, 0.2 + 0.5 * ROUNDING)], true),
            (vec![(HAUSDORFF, 0.2 + 2.0 * ROUNDING)], false),
            (vec![(STATED, 0.0)], false),
            (vec![(STATED, f64::INFINITY)], false),
            (vec![(HAUSDORFF, 0.35), (LOST, 0.2)], true),
            (vec![(HAUSDORFF, 0.3), vanished], true),
            // The remaining surface is too far away as well.
            (vec![(HAUSDORFF, 0.3), (LEFT, 0.3), vanished], false),
            // A component that did not vanish lost a part.
            (vec![(HAUSDORFF, 0.3), (REMAINING, 0.3), vanished], false),
            (vec![(HAUSDORFF, 0.3), (STATED, 0.0), vanished], false),
        ] {
            assert_eq!(excess(&changes) <= ROUNDING, kept, "{changes:?}");
        }
        assert_eq!(super::excess(&[]), f64::INFINITY);
    }

    #[test]
    fn every_case_has_an_outcome_at_its_target() {
        let machine = Machine { device_kind: "cpu".into(), ..Machine::default() };
        let mut table = Table { machine, records: Vec::new(), lost: Vec::new() };
        for case in CASES {
            let rows = rows(&mesh(case).unwrap(), 500).unwrap();
            table.records.extend(rows.into_iter().map(|row| TableRecord {
                scene: case.into(),
                x: None,
                row,
            }));
        }
        for claim in EXTREMES.claims {
            let finding = claim.judge(&table);
            assert_eq!(finding.verdict, Verdict::Reproduced, "{finding:?}");
        }
        let of = |case, quantity| table.number(case, None, OURS, quantity).unwrap();
        assert_eq!(CASES.iter().filter(|case| of(case, FACES) == 0.0).collect::<Vec<_>>(), [&"offset 1e9"]);
        // Removing flat caps changes no surface.
        assert!(of("flat caps", LOST) < ROUNDING);
        assert!(of("one 1000 times out", HAUSDORFF) < 0.05);
    }
}
