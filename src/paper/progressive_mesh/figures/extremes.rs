//! pm.extremes: meshes as they should not be, and what becomes of them.

use super::super::simplify::{SimplifyOptions, simplify};
use super::surfaces::{distances, rival};
use crate::figure::{Axis, Bench, Cell, Claim, Figure, Finding, Origin, Plot, Row, Table, Value, Verdict};
use crate::scene::model::{Model, Raw, clean, named};
use anyhow::Context;
use glam::DVec3;
use std::collections::HashMap;

pub const EXTREMES: Figure = Figure {
    id: "pm.extremes",
    title: "Hostile meshes",
    about: "What becomes of meshes that files hold and no simplifier likes. The bunny (3674 faces) as it is (`clean`); \
            moved and scaled (`offset 1e7`, `scale 1e-38`, `scale 1e-9`, `scale 1e30`); with a vertex that is not finite \
            or absurdly far (`one NaN`, `one infinity`, `one at 1e30`, `one 1000 times out`); with 500 `degenerate \
            faces`, 500 `flat caps` on its edges, 200 `fins`, `every face twice`, a tenth of the faces with `backs`; \
            as a `soup` of triangles; and 1000 `tetrahedra`. The target is a quarter of the faces. Ours cleans \
            first and says what it did; `meshopt_simplify` gets the mesh as it is, in f32. The largest distance \
            is that from the cleaned mesh, in diagonals of its box, without faces that are not finite.",
    scenes: &[
        "clean",
        "offset 1e7",
        "scale 1e-38",
        "scale 1e-9",
        "scale 1e30",
        "one NaN",
        "one infinity",
        "one at 1e30",
        "one 1000 times out",
        "degenerate faces",
        "flat caps",
        "soup",
        "every face twice",
        "fins",
        "backs",
        "tetrahedra",
    ],
    variants: || [OURS, RIVAL].map(String::from).into(),
    sweep: None,
    measure,
    plots: &[Plot { quantity: FACES, x: Axis::Variant, log_x: false, log_y: false, floor: Some(TARGET) }],
    claims: &[
        Claim {
            id: "outcome",
            text: "Every mesh has an outcome: faces that are finite, each with three positions, and an error above 0 \
                   wherever it deviates.",
            from: Origin::Ours,
            check: outcome,
        },
        Claim {
            id: "target",
            text: "Every mesh comes down to its target.",
            from: Origin::Ours,
            check: target,
        },
    ],
};

const OURS: &str = "ours";
const RIVAL: &str = "meshoptimizer";
const TARGET: &str = "target";
const FACES: &str = "faces";
const HAUSDORFF: &str = "Hausdorff distance";
const STATED: &str = "stated error";
const CROWDED: &str = "edges of more than two faces";
const NOT_FINITE: &str = "corners that are not finite";
const CLEANING: &str = "cleaning";
const OUTCOME: &str = "outcome";

/// Distances in diagonals that are rounding of f32.
const ROUNDING: f64 = 1e-6;

/// Points on each surface besides the vertices.
const SAMPLES: usize = 20_000;

/// The mesh of a case, with values that f32 holds: files hold no others.
fn mesh(case: &str) -> anyhow::Result<Raw> {
    let model = named("bunny").context("the bunny is shipped")?;
    let mut raw = Raw { positions: model.positions.clone(), faces: model.faces.clone(), ..Raw::default() };
    let middle = raw.positions.len() / 2;
    let count = raw.faces.len();
    match case {
        "clean" => {}
        "offset 1e7" => raw.positions.iter_mut().for_each(|p| *p += 1e7),
        "scale 1e-38" => raw.positions.iter_mut().for_each(|p| *p *= 1e-38),
        "scale 1e-9" => raw.positions.iter_mut().for_each(|p| *p *= 1e-9),
        "scale 1e30" => raw.positions.iter_mut().for_each(|p| *p *= 1e30),
        "one NaN" => raw.positions[middle].y = f64::NAN,
        "one infinity" => raw.positions[middle].y = f64::INFINITY,
        "one at 1e30" => raw.positions[middle].y = 1e30,
        "one 1000 times out" => raw.positions[middle] *= 1000.0,
        "degenerate faces" => raw.faces.extend((0..500).map(|n| [n, n, n + 1])),
        "flat caps" => (0..500).for_each(|face| cap(&mut raw, 7 * face)),
        "soup" => raw = soup(&raw),
        "every face twice" => raw.faces.extend_from_within(..),
        "fins" => (0..200).for_each(|face| fin(&mut raw, 17 * face)),
        "backs" => {
            let backs: Vec<[u32; 3]> = raw.faces.iter().step_by(10).map(|&[a, b, c]| [a, c, b]).collect();
            raw.faces.extend(backs);
        }
        "tetrahedra" => raw = tetrahedra(1000),
        other => anyhow::bail!("there is no case {other:?}"),
    }
    assert!(case != "clean" || raw.faces.len() == count);
    raw.positions.iter_mut().for_each(|p| *p = p.as_vec3().as_dvec3());
    Ok(raw)
}

/// Splits the first side of a face at its middle: the new face along the side has no area.
fn cap(raw: &mut Raw, face: usize) {
    let [a, b, _] = raw.faces[face];
    let middle = (raw.positions[a as usize] + raw.positions[b as usize]) / 2.0;
    raw.positions.push(middle);
    raw.faces.push([a, b, raw.positions.len() as u32 - 1]);
}

/// A third face at a side.
fn fin(raw: &mut Raw, face: usize) {
    let [a, b, c] = raw.faces[face].map(|vertex| raw.positions[vertex as usize]);
    raw.positions.push((a + b) / 2.0 + (b - a).cross(c - a).normalize_or_zero() * (b - a).length());
    raw.faces.push([raw.faces[face][0], raw.faces[face][1], raw.positions.len() as u32 - 1]);
}

/// Every face with vertices of its own.
fn soup(raw: &Raw) -> Raw {
    let positions = raw.faces.iter().flatten().map(|&vertex| raw.positions[vertex as usize]).collect();
    let faces = (0..raw.faces.len() as u32).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
    Raw { positions, faces, ..Raw::default() }
}

/// Tetrahedra of different sizes in rows, none touching another.
fn tetrahedra(count: u32) -> Raw {
    let mut raw = Raw::default();
    for n in 0..count {
        let corner = DVec3::new(f64::from(n % 32), f64::from(n / 32), 0.0);
        let size = 0.1 + 0.7 * f64::from(n * 7919 % count) / f64::from(count);
        let first = raw.positions.len() as u32;
        raw.positions.extend([DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|axis| corner + axis * size));
        raw.faces
            .extend([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].map(|face| face.map(|v: u32| v + first)));
    }
    raw
}

fn measure(_: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let raw = mesh(&cell.scene)?;
    let (model, report) = clean(&raw);
    let target_faces = raw.faces.len() / 4;
    let simplified = simplify(&model, &SimplifyOptions { target_faces }, &mut |_, _| {});
    let collapses = &simplified.collapses;
    let positions = model.wedge_positions.iter().map(|&position| model.positions[position as usize]);
    let positions: Vec<DVec3> = positions.collect();
    let faces = collapses.faces_after(&model, collapses.errors.len());
    let theirs = rival(&raw.positions, &raw.faces, target_faces)?;
    let mut rows =
        outcome_rows(OURS, &model, &positions, &faces, collapses.error_after(collapses.errors.len()));
    rows.extend(outcome_rows(RIVAL, &model, &raw.positions, &theirs.faces, theirs.stated));
    rows.push(Row::new(TARGET, FACES, "faces", Value::Number(target_faces as f64)));
    let text = |words: String| if words.is_empty() { "nothing".to_string() } else { words };
    rows.push(Row::new(OURS, CLEANING, "", Value::Text(text(report.changes().join("; ")))));
    let relaxed = &simplified.report;
    let words = match relaxed.shortfall {
        Some(why) => format!("{} faces: {why}", relaxed.faces),
        None => format!(
            "the target; {} components vanished, {} sheets came to touch, {} faces turned too far",
            relaxed.components, relaxed.pinches, relaxed.flips
        ),
    };
    rows.push(Row::new(OURS, OUTCOME, "", Value::Text(words)));
    Ok(rows)
}

fn outcome_rows(name: &str, model: &Model, positions: &[DVec3], faces: &[[u32; 3]], stated: f64) -> Vec<Row> {
    let number = |quantity, unit, number| Row::new(name, quantity, unit, Value::Number(number));
    let finite = |face: &&[u32; 3]| face.iter().all(|&vertex| positions[vertex as usize].is_finite());
    let usable: Vec<[u32; 3]> = faces.iter().filter(finite).copied().collect();
    let corners = faces.iter().flatten().filter(|&&vertex| !positions[vertex as usize].is_finite()).count();
    let mut edges: HashMap<[[u64; 3]; 2], usize> = HashMap::new();
    // -0 is 0.
    let bits = |vertex: u32| (positions[vertex as usize] + 0.0).to_array().map(f64::to_bits);
    for face in faces {
        for k in 0..3 {
            let (a, b) = (bits(face[k]), bits(face[(k + 1) % 3]));
            *edges.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    let crowded = edges.values().filter(|&&faces| faces > 2).count();
    let distance = distances(model, positions, &usable, SAMPLES).map(|found| found.hausdorff);
    vec![
        number(FACES, "faces", faces.len() as f64),
        match distance {
            Some(distance) => number(HAUSDORFF, "diagonals", distance),
            None => Row::new(name, HAUSDORFF, "diagonals", Value::Missing("no face is left".into())),
        },
        number(STATED, "object units", stated),
        number(CROWDED, "edges", crowded as f64),
        number(NOT_FINITE, "corners", corners as f64),
    ]
}

/// Ours at every case: a quantity's number.
fn ours<'a>(table: &'a Table, quantity: &'a str) -> impl Iterator<Item = (&'a str, f64)> + 'a {
    let own = table.of(quantity).filter(|record| record.row.variant == OURS);
    own.filter_map(|record| Some((record.scene.as_str(), record.row.value.number()?)))
}

fn finding(table: &Table, all: usize, wrong: &[&str], what: &str) -> Finding {
    let verdict = match wrong.len() {
        _ if all == 0 => Verdict::NotMeasurable,
        0 if table.missing == 0 => Verdict::Reproduced,
        many if many == all => Verdict::NotReproduced,
        _ => Verdict::InPart,
    };
    let numbers = format!("{} of {all} meshes {what}", all - wrong.len());
    let why = if wrong.is_empty() { "none does not".into() } else { format!("not: {}", wrong.join(", ")) };
    Finding::new(verdict, numbers, why)
}

fn outcome(table: &Table) -> Finding {
    let of = |case: &str, quantity| table.number(case, None, OURS, quantity);
    let right = |case: &str, faces: f64| {
        let deviates = of(case, HAUSDORFF).is_some_and(|distance| distance > ROUNDING);
        let states = of(case, STATED).is_some_and(|stated| stated.is_finite() && (stated > 0.0 || !deviates));
        faces > 0.0 && of(case, NOT_FINITE) == Some(0.0) && of(case, HAUSDORFF).is_some() && states
    };
    let cases: Vec<(&str, f64)> = ours(table, FACES).collect();
    let wrong: Vec<&str> =
        cases.iter().filter(|(case, faces)| !right(case, *faces)).map(|(case, _)| *case).collect();
    finding(table, cases.len(), &wrong, "have one")
}

fn target(table: &Table) -> Finding {
    let cases: Vec<(&str, f64)> = ours(table, FACES).collect();
    let above = |(case, faces): &&(&str, f64)| {
        table.number(case, None, TARGET, FACES).is_none_or(|target| *faces > target)
    };
    let wrong: Vec<&str> = cases.iter().filter(above).map(|(case, _)| *case).collect();
    finding(table, cases.len(), &wrong, "reach it")
}

#[cfg(test)]
mod tests {
    use super::super::tests::table;
    use super::*;

    fn verdicts(faces: f64, distance: f64, stated: f64, not_finite: f64) -> [Verdict; 2] {
        let table = table(
            "cpu",
            &[
                ("soup", OURS, FACES, faces),
                ("soup", OURS, HAUSDORFF, distance),
                ("soup", OURS, STATED, stated),
                ("soup", OURS, NOT_FINITE, not_finite),
                ("soup", TARGET, FACES, 100.0),
            ],
        );
        [outcome(&table).verdict, target(&table).verdict]
    }

    #[test]
    fn a_nan_or_a_deviation_without_an_error_refutes_the_outcome_and_a_face_too_many_the_target() {
        use Verdict::{NotReproduced, Reproduced};
        assert_eq!(verdicts(100.0, 0.1, 0.2, 0.0), [Reproduced, Reproduced]);
        assert_eq!(verdicts(100.0, 0.0, 0.0, 0.0), [Reproduced, Reproduced]);
        assert_eq!(verdicts(101.0, 0.1, 0.2, 0.0), [Reproduced, NotReproduced]);
        assert_eq!(verdicts(100.0, 0.1, 0.0, 0.0), [NotReproduced, Reproduced]);
        assert_eq!(verdicts(100.0, 0.1, 0.2, 1.0), [NotReproduced, Reproduced]);
    }

    #[test]
    fn every_case_has_its_mesh() {
        for case in EXTREMES.scenes {
            let raw = mesh(case).unwrap();
            assert!(raw.faces.len() >= 3674, "{case} has {} faces", raw.faces.len());
        }
        assert!(mesh("nothing").is_err());
    }
}
