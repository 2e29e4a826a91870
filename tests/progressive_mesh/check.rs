//! Meshes that cannot be executed are rejected.

use super::made::{Random, arrange, collapse, quad, torus};
use ortelius::paper::progressive_mesh::mesh::{Births, Level, NOWHERE, ProgressiveMesh};

fn flaw(change: impl FnOnce(&mut ProgressiveMesh)) -> String {
    let mut mesh = quad();
    assert_eq!(mesh.check(), Ok(()));
    change(&mut mesh);
    mesh.check().unwrap_err().to_string()
}

#[test]
fn each_flaw_is_reported_with_its_place() {
    let level = |vertices, faces, error| Level { vertices, faces, error };
    let slots = |rows: &[&[u32]]| rows.iter().map(|row| row.to_vec()).collect();
    type Change<'a> = Box<dyn Fn(&mut ProgressiveMesh) + 'a>;
    let cases: [(Change, &str); 24] = [
        (Box::new(|m| m.levels.clear()), "levels: the list is empty"),
        (Box::new(|m| m.levels[1].faces = 3), "last level: 3 faces of 2"),
        (Box::new(|m| m.levels[1].vertices = 5), "last level: 5 vertices of 4"),
        (Box::new(|m| m.levels[0] = level(3, 3, 1.0)), "level 1: fewer vertices or faces"),
        (Box::new(|m| m.levels[0].error = -1.0), "level 1: error 0 after -1"),
        (Box::new(|m| m.levels[1].error = f32::NAN), "level 1: error NaN after 1"),
        (Box::new(|m| m.levels[0].error = f32::INFINITY), "levels: errors from inf"),
        (Box::new(|m| m.splits.split_vertices.clear()), "splits: 0 targets and 1 rows for 1 vertices"),
        (Box::new(|m| m.splits.split_vertices[0] = 3), "vertex 3: splits 3 in 1 faces, of 3 live"),
        (Box::new(|m| m.splits.split_vertices[0] = NOWHERE), "splits 4294967295 in 1 faces"),
        (Box::new(|m| m.splits.slots = slots(&[&[1]])), "vertex 3: slot 1 of 1 live faces"),
        (Box::new(|m| m.splits.slots = slots(&[&[0, 0]])), "slot 0 has [0, 3, 2], without 1"),
        (Box::new(|m| m.faces[0] = [0, 3, 2]), "level 0, face 0: [0, 3, 2] of 3 live vertices"),
        (Box::new(|m| m.faces[1] = [0, 2, 2]), "level 1, face 1: [0, 2, 2] is not a triangle"),
        (Box::new(|m| m.swaps.levels[0] = 0), "swaps: levels are not ascending from 1"),
        (Box::new(|m| m.swaps.cycle_ends[0] = 2), "swaps: 1 cycles, but levels have 2"),
        (Box::new(|m| m.swaps.cycles = slots(&[&[0, 2]])), "permutation of level 1: slot 2 of 2 live"),
        (Box::new(|m| m.swaps.cycles = slots(&[&[1]])), "permutation of level 1: a cycle of 1 slots"),
        (Box::new(|m| m.swaps.cycles = slots(&[&[0, 1, 0]])), "permutation of level 1: slot 0 is in two"),
        (Box::new(|m| m.swaps.cycles = slots(&[&[1, 0]])), "a cycle from slot 1: each must begin"),
        (Box::new(|m| m.splits.slots = slots(&[&[0, u32::MAX, 0]])), "vertex 3: its slots are not ascending"),
        (
            Box::new(|m| m.vertices.welded[3] = 2),
            "vertex 3: at [0.0, 1.0, 0.0], welded to 2 at [1.0, 1.0, 0.0]",
        ),
        (Box::new(|m| m.births = Births::InPlace), "level 1, face 1: it has an area before its level"),
        (Box::new(|m| m.vertices.positions[2][1] = f32::NAN), "vertex 2: position [1.0, NaN, 0.0]"),
    ];
    for (change, words) in cases {
        let reported = flaw(change);
        assert!(reported.contains(words) && !reported.contains('\n'), "{reported:?}, wanted {words:?}");
    }
}

/// One random word of the lists is changed: the mesh is either rejected, or runs without a panic.
#[test]
fn a_mesh_with_a_changed_word_is_rejected_or_runs() {
    let random = &mut Random(7);
    let model = torus(5, 4, true, 2);
    let collapses = collapse(&model, 10, random);
    let made = arrange(&model, &collapses, 3, random);
    assert_eq!(made.mesh.check(), Ok(()));
    let mut refused = 0;
    for _ in 0..2000 {
        let mut mesh = made.mesh.clone();
        let value = match random.below(4) {
            0 => NOWHERE,
            _ => random.below(100) as u32,
        };
        let change = |list: &mut Vec<u32>, random: &mut Random| {
            let at = random.below(list.len());
            list[at] = value;
        };
        match random.below(6) {
            0 => change(&mut mesh.splits.split_vertices, random),
            1 => change(&mut mesh.swaps.levels, random),
            2 => change(&mut mesh.swaps.cycle_ends, random),
            3 => {
                let mut rows: Vec<Vec<u32>> = mesh.splits.slots.rows().map(<[u32]>::to_vec).collect();
                let at = random.below(rows.len());
                rows[at].push(value);
                mesh.splits.slots = rows.into_iter().collect();
            }
            4 => {
                let at = random.below(mesh.faces.len());
                mesh.faces[at][random.below(3)] = value;
            }
            _ => {
                let at = random.below(mesh.levels.len());
                mesh.levels[at].faces = value;
            }
        }
        match mesh.check() {
            Err(_) => refused += 1,
            Ok(()) => {
                let mut state = ortelius::paper::progressive_mesh::run::State::new(&mesh);
                state.go_to(&mesh, mesh.last_level());
                state.go_to(&mesh, 0);
                assert_eq!(state.faces(), mesh.faces);
            }
        }
    }
    assert!(refused > 1500, "{refused} of 2000 were rejected");
}
