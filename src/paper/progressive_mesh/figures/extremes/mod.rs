//! pm.extremes: meshes as they should not be, and what becomes of them.

mod cases;

use super::super::simplify::{Simplified, SimplifyOptions, simplify};
use super::surfaces::rival;
use crate::figure::{Axis, Bench, Cell, Claim, Figure, Finding, Origin, Plot, Row, Table, Value, Verdict};
use crate::model::clean;
use crate::reference::distance::Triangles;
use cases::{CASES, Hostile, mesh};
use glam::DVec3;
use std::collections::HashMap;

pub const EXTREMES: Figure = Figure {
    id: "pm.extremes",
    title: "Hostile meshes",
    about: "What becomes of meshes that files hold and no simplifier likes. The bunny (3674 faces) as it is (`clean`); \
            moved (`offset 1e4`; `offset 1e7`, where a step of f32 is 1 and the bunny 10 across; `offset 1e9`, where all its \
            vertices are one) and scaled (`scale 1e-38`, `scale 1e-20`, `scale 1e-9`, `scale 1e15`, `scale 1e30`); with a vertex that is not finite or absurdly far (`one NaN`, `one \
            infinity`, `one at 1e30`, `one 1000 times out`); with 500 `degenerate faces`, 500 `flat caps` on its \
            edges, 200 `fins`, `every face twice`, a tenth of the faces with `backs`; as a `soup` of triangles; with \
            texture `seams` between charts, down to 1 %; 1000 `tetrahedra`; and `bow-ties`, 20 cubes that touch in \
            corners. But for `seams` the target is a quarter of the faces. Ours cleans first and says what it did; \
            `meshopt_simplify` gets the mesh as it is, in f32. Distances are those from the shape that is meant, \
            before damage and rounding to f32, in diagonals of its box, without faces that are not finite; what \
            ours deviates by after cleaning alone stands apart, and the error that it states comes on top. `the mesh` is \
            what the file holds.",
    scenes: &CASES,
    variants: || [OURS, RIVAL].map(String::from).into(),
    sweep: None,
    measure,
    plots: &[Plot { quantity: FACES, x: Axis::Variant, log_x: false, log_y: false, floor: Some(TARGET) }],
    claims: &[
        Claim {
            id: "outcome",
            text: "Every mesh has an outcome: faces that are finite and deviate from what is meant by no more than \
                   reading cost and the stated error together (which counts a part that vanishes as a whole by its \
                   extent), or a refusal with its reason; and what reading cost, if \
                   more than 1/1000 of the diagonal, is said in words.",
            from: Origin::Ours,
            check: outcome,
        },
        Claim {
            id: "target",
            text: "Every mesh comes down to its target.",
            from: Origin::Ours,
            check: target,
        },
        Claim {
            id: "crowded",
            text: "No mesh gets more edges of more than two faces than it had.",
            from: Origin::Ours,
            check: crowded,
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
const VANISHED: &str = "components that vanished";
const CLEANING: &str = "cleaning";
const OUTCOME: &str = "outcome";

const MESH: &str = "the mesh";
const LOST: &str = "lost in reading and cleaning";
/// What begins an outcome without a mesh.
const REFUSED: &str = "refused: ";
/// Where cleaning did nothing.
const NOTHING: &str = "nothing";

/// Distances in diagonals that are rounding of f32.
const ROUNDING: f64 = 1e-6;
/// A loss in diagonals of which one wants to hear.
const LOSS: f64 = 1e-3;

/// Points on each surface besides the vertices.
const SAMPLES: usize = 20_000;

fn measure(_: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    rows(&mesh(&cell.scene)?, SAMPLES)
}

fn rows(hostile: &Hostile, samples: usize) -> anyhow::Result<Vec<Row>> {
    let Hostile { raw, target_faces, .. } = hostile;
    let theirs = rival(&raw.positions, &raw.faces, *target_faces)?;
    let mut rows = outcome_rows(RIVAL, hostile, &raw.positions, &theirs.faces, theirs.stated, samples);
    rows.extend(own_rows(hostile, samples));
    let number = |variant, quantity, unit, number: usize| {
        Row::new(variant, quantity, unit, Value::Number(number as f64))
    };
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
    if model.faces.is_empty() {
        let zero = Row::new(OURS, FACES, "faces", Value::Number(0.0));
        return vec![zero, text(OUTCOME, format!("{REFUSED}no face is left: {changes}"))];
    }
    let options = SimplifyOptions { target_faces: hostile.target_faces, ..SimplifyOptions::default() };
    let Simplified { collapses, report: relaxed } = simplify(&model, &options, &mut |_, _| {});
    let positions = model.wedge_positions.iter().map(|&position| model.positions[position as usize]);
    let positions: Vec<DVec3> = positions.collect();
    let steps = collapses.errors.len();
    let faces = collapses.faces_after(&model, steps);
    let stated = collapses.error_after(steps);
    let mut rows = outcome_rows(OURS, hostile, &positions, &faces, stated, samples);
    rows.push(distance_row(OURS, LOST, hostile, &positions, &model.faces, samples));
    rows.push(Row::new(OURS, VANISHED, "components", Value::Number(relaxed.components as f64)));
    rows.push(text(CLEANING, if changes.is_empty() { NOTHING.into() } else { changes }));
    let words = match relaxed.shortfall {
        Some(why) => format!("{} faces: {why}", relaxed.faces),
        None if steps == 0 => {
            format!("cleaning left {} faces, no more than the target: nothing to simplify", model.faces.len())
        }
        None => format!(
            "the target; {} components vanished, {} sheets came to touch, {} faces turned too far",
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
    let number = |quantity, unit, number| Row::new(name, quantity, unit, Value::Number(number));
    vec![
        number(FACES, "faces", faces.len() as f64),
        distance_row(name, HAUSDORFF, hostile, positions, faces, samples),
        number(STATED, "diagonals", stated / hostile.size().diagonal),
        number(CROWDED, "edges", crowded_edges(positions, faces) as f64),
        number(NOT_FINITE, "corners", not_finite(positions, faces) as f64),
    ]
}

/// The largest distance from what is meant.
fn distance_row(
    name: &str,
    quantity: &str,
    hostile: &Hostile,
    positions: &[DVec3],
    faces: &[[u32; 3]],
    samples: usize,
) -> Row {
    let finite = |face: &&[u32; 3]| face.iter().all(|&vertex| positions[vertex as usize].is_finite());
    let faces: Vec<[u32; 3]> = faces.iter().filter(finite).copied().collect();
    let meant = Triangles { positions: &hostile.meant.positions, faces: &hostile.meant.faces };
    let found = hostile.size().distances(meant, Triangles { positions, faces: &faces }, samples);
    let missing = || Value::Missing("no face with an area is left".into());
    Row::new(name, quantity, "diagonals", found.map_or_else(missing, |found| Value::Number(found.hausdorff)))
}

fn not_finite(positions: &[DVec3], faces: &[[u32; 3]]) -> usize {
    faces.iter().flatten().filter(|&&vertex| !positions[vertex as usize].is_finite()).count()
}

/// Edges of more than two faces, by the places of their ends.
fn crowded_edges(positions: &[DVec3], faces: &[[u32; 3]]) -> usize {
    let mut edges: HashMap<[[u64; 3]; 2], usize> = HashMap::new();
    // -0 is 0.
    let bits = |vertex: u32| (positions[vertex as usize] + 0.0).to_array().map(f64::to_bits);
    for face in faces {
        for k in 0..3 {
            let (a, b) = (bits(face[k]), bits(face[(k + 1) % 3]));
            *edges.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    edges.values().filter(|&&faces| faces > 2).count()
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
        if faces == 0.0 {
            return text(table, case, OUTCOME).is_some_and(|words| words.starts_with(REFUSED));
        }
        let (Some(distance), Some(stated), Some(lost)) =
            (of(case, HAUSDORFF), of(case, STATED), of(case, LOST))
        else {
            return false;
        };
        let told = lost <= LOSS || text(table, case, CLEANING).is_some_and(|words| words != NOTHING);
        // A part that vanishes counts by its extent, however far it was from the others.
        let vanished = of(case, VANISHED).is_some_and(|parts| parts > 0.0) && stated > 0.0;
        let bounded = stated.is_finite() && (vanished || distance <= stated + lost + ROUNDING);
        of(case, NOT_FINITE) == Some(0.0) && bounded && told
    };
    let cases: Vec<(&str, f64)> = ours(table, FACES).collect();
    let wrong: Vec<&str> =
        cases.iter().filter(|(case, faces)| !right(case, *faces)).map(|(case, _)| *case).collect();
    finding(table, cases.len(), &wrong, "have one")
}

/// Ours at a case, in words.
fn text<'a>(table: &'a Table, case: &str, quantity: &'a str) -> Option<&'a str> {
    let found = table.of(quantity).find(|record| record.scene == case && record.row.variant == OURS);
    match &found?.row.value {
        Value::Text(words) => Some(words),
        _ => None,
    }
}

fn crowded(table: &Table) -> Finding {
    let cases: Vec<(&str, f64)> = ours(table, CROWDED).collect();
    let more = |(case, edges): &&(&str, f64)| {
        table.number(case, None, MESH, CROWDED).is_none_or(|before| *edges > before)
    };
    let wrong: Vec<&str> = cases.iter().filter(more).map(|(case, _)| *case).collect();
    finding(table, cases.len(), &wrong, "get no more")
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
    use crate::figure::Record;

    /// A case of 100 faces, and 100 wanted, with some numbers changed.
    fn judge(changes: &[(&str, f64)], words: [&str; 2]) -> [Verdict; 3] {
        let usual = [
            (FACES, 100.0),
            (HAUSDORFF, 0.1),
            (STATED, 0.2),
            (LOST, 0.0),
            (NOT_FINITE, 0.0),
            (VANISHED, 0.0),
            (CROWDED, 3.0),
        ];
        let mut rows: Vec<(&str, &str, &str, f64)> = usual
            .into_iter()
            .map(|(quantity, number)| {
                let changed = changes.iter().find(|(of, _)| *of == quantity);
                ("soup", OURS, quantity, changed.map_or(number, |change| change.1))
            })
            .collect();
        rows.extend([("soup", TARGET, FACES, 100.0), ("soup", MESH, CROWDED, 3.0)]);
        let mut table = table("cpu", &rows);
        for (quantity, words) in [CLEANING, OUTCOME].into_iter().zip(words) {
            let row = Row::new(OURS, quantity, "", Value::Text(words.into()));
            table.records.push(Record { scene: "soup".into(), x: None, row });
        }
        [outcome(&table), target(&table), crowded(&table)].map(|found| found.verdict)
    }

    #[test]
    fn what_is_worse_than_it_says_refutes_its_claim() {
        use Verdict::{NotReproduced as No, Reproduced as Yes};
        let words = [NOTHING, "the target"];
        for (changes, verdicts) in [
            (vec![], [Yes, Yes, Yes]),
            (vec![(HAUSDORFF, 0.0), (STATED, 0.0)], [Yes, Yes, Yes]),
            (vec![(FACES, 101.0)], [Yes, No, Yes]),
            (vec![(STATED, 0.0)], [No, Yes, Yes]),
            (vec![(HAUSDORFF, 0.3)], [No, Yes, Yes]),
            // Lost, and nobody said so.
            (vec![(HAUSDORFF, 0.3), (LOST, 0.2)], [No, Yes, Yes]),
            (vec![(NOT_FINITE, 1.0)], [No, Yes, Yes]),
            (vec![(HAUSDORFF, 0.3), (VANISHED, 1.0)], [Yes, Yes, Yes]),
            (vec![(HAUSDORFF, 0.3), (VANISHED, 1.0), (STATED, 0.0)], [No, Yes, Yes]),
            (vec![(CROWDED, 4.0)], [Yes, Yes, No]),
            (vec![(FACES, 0.0)], [No, Yes, Yes]),
        ] {
            assert_eq!(judge(&changes, words), verdicts, "{changes:?}");
        }
        assert_eq!(judge(&[(HAUSDORFF, 0.3), (LOST, 0.2)], ["much", "the target"])[0], Yes);
        assert_eq!(judge(&[(FACES, 0.0)], ["", "refused: no face is left"])[0], Yes);
    }

    #[test]
    fn every_case_has_an_outcome_at_its_target() {
        let mut table = table("cpu", &[]);
        for case in CASES {
            let rows = rows(&mesh(case).unwrap(), 500).unwrap();
            table.records.extend(rows.into_iter().map(|row| Record { scene: case.into(), x: None, row }));
        }
        for finding in [outcome(&table), target(&table), crowded(&table)] {
            assert_eq!(finding.verdict, Verdict::Reproduced, "{finding:?}");
        }
        assert_eq!(ours(&table, FACES).filter(|(_, faces)| *faces == 0.0).count(), 1, "offset 1e9");
        // What covers nothing costs nothing: the bunny comes out as without its caps.
        assert!(table.number("flat caps", None, OURS, LOST).unwrap() < ROUNDING);
        assert!(table.number("one 1000 times out", None, OURS, HAUSDORFF).unwrap() < 0.05);
    }
}
