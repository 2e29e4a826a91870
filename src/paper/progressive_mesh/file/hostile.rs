//! Worst-case files: as much content per byte as possible. A hub is a vertex with very many faces.

use super::super::mesh::{Level, ProgressiveMesh, Swaps, Vertices};
use super::live::{Live, RingFace};
use super::tests::{Random, reseal};
use super::{CHUNK_HEAD_BYTES, CORNERS_PER_BYTE, FileFlaw, HEADER_BYTES};
use crate::math::ragged::Ragged;

/// `faces` faces that share only vertex 0, and one further level for each of `levels`: (number of splits,
/// split vertex, number of slots that each split changes, counted from slot 0).
fn hub(faces: u32, levels: &[(u32, u32, u32)]) -> ProgressiveMesh {
    let base = Level { vertices: 2 * faces + 1, faces, error: 0.0 };
    let mut mesh = ProgressiveMesh {
        faces: (0..faces).map(|face| [0, 2 * face + 1, 2 * face + 2]).collect(),
        levels: vec![base],
        ..ProgressiveMesh::default()
    };
    for &(splits, split, slots) in levels {
        let before = mesh.levels[mesh.levels.len() - 1];
        mesh.levels.push(Level { vertices: before.vertices + splits, ..before });
        for _ in 0..splits {
            mesh.splits.split_vertices.push(split);
            mesh.splits.slots.push(0..slots);
        }
    }
    let vertices = mesh.levels[mesh.levels.len() - 1].vertices;
    let positions = vec![[0.5; 3]; vertices as usize];
    mesh.vertices = Vertices { positions, welded: (0..vertices).collect(), ..Vertices::default() };
    mesh
}

fn back(bytes: &[u8]) -> ProgressiveMesh {
    ProgressiveMesh::from_bytes(bytes).unwrap().mesh
}

#[test]
fn a_hub_that_moves_from_vertex_to_vertex_costs_bytes() {
    let (faces, count) = (500, 200);
    let levels: Vec<(u32, u32, u32)> =
        (0..count).map(|level| (1, if level == 0 { 0 } else { 2 * faces + level }, faces)).collect();
    let mesh = hub(faces, &levels);
    let (mut bytes, _) = mesh.to_bytes();
    assert!(back(&bytes) == mesh);
    let corners = u64::from(faces * count);
    assert!(bytes.len() as u64 * CORNERS_PER_BYTE >= corners, "{} bytes", bytes.len());
    assert_eq!(bytes.pop(), Some(0), "the last byte is not needed");
    let first = u32::from_le_bytes(bytes[HEADER_BYTES..HEADER_BYTES + 4].try_into().unwrap()) as usize;
    let last = HEADER_BYTES + CHUNK_HEAD_BYTES + first;
    let payload = (bytes.len() - last - CHUNK_HEAD_BYTES) as u32;
    bytes[last..last + 4].copy_from_slice(&payload.to_le_bytes());
    let length = bytes.len() as u64;
    bytes[56..64].copy_from_slice(&length.to_le_bytes());
    reseal(&mut bytes);
    let what = "more corners change than its bytes can hold";
    assert_eq!(
        ProgressiveMesh::from_bytes(&bytes),
        Err(FileFlaw::Chunk { chunk: 1, offset: last as u64, what })
    );
}

#[test]
fn splits_of_one_hub_suggest_no_more_than_enough() {
    let mut mesh = hub(400, &[(200, 0, 0)]);
    // The coder suggests likely faces (`suggest` in level.rs). Of these faces it suggests only the first.
    let vertices = mesh.levels[1].vertices;
    let born = [[801, 1, 0], [vertices - 1, 0, 799], [1, vertices - 1, 5]];
    mesh.faces.extend(born);
    mesh.levels[1].faces += born.len() as u32;
    assert!(back(&mesh.to_bytes().0) == mesh);
}

/// The ring of a vertex, found by a linear search for each next face.
fn searched_ring(live: &Live, vertex: u32) -> Vec<RingFace> {
    let row = live.around.row(vertex as usize).iter();
    let faces: Vec<RingFace> = row
        .map(|&face| {
            let corners = live.corners[face as usize];
            let at = corners.iter().position(|&corner| corner == vertex).unwrap();
            RingFace { face, first: corners[(at + 1) % 3], second: corners[(at + 2) % 3] }
        })
        .collect();
    let (mut ring, mut left) = (Vec::new(), faces.clone());
    let is_start = |face: &RingFace| faces.iter().all(|other| other.second != face.first);
    while let Some(&start) = left.iter().find(|face| is_start(face)).or(left.first()) {
        let mut next = Some(start);
        while let Some(face) = next.filter(|face| left.contains(face)) {
            left.retain(|other| *other != face);
            ring.push(face);
            next = faces.iter().find(|other| other.first == face.second).copied();
        }
    }
    ring
}

#[test]
fn the_ring_of_random_faces_equals_that_of_a_linear_search() {
    let mut random = Random(5);
    for count in 0..300 {
        let (mut live, around) = (Live::default(), 2 + random.below(12));
        (0..=around).for_each(|_| live.add_vertex());
        for _ in 0..count % 15 {
            let (a, b) = (1 + random.below(around), random.below(around - 1));
            // Different from `a`.
            let b = 1 + (a + b) % around;
            live.add_face([0, a as u32, b as u32]);
        }
        assert_eq!(live.ring(0), searched_ring(&live, 0), "{:?}", live.corners);
    }
}

/// Searching the 10 million faces of the rings, or 80,000 suggestions for each of 20,000 new faces, would take minutes.
#[test]
fn a_hub_of_many_faces_is_written_and_read_in_proportion_to_its_splits() {
    let faces = 20_000;
    let mut mesh = hub(faces, &[(500, 0, 0)]);
    mesh.faces.extend((0..faces - 2).map(|n| [2 * n + 1, 2 * n + 3, 2 * n + 5]));
    mesh.levels[1].faces += faces - 2;
    assert!(back(&mesh.to_bytes().0) == mesh);
}

#[test]
fn two_faces_of_a_hub_move_and_then_all() {
    let mut mesh = hub(600, &[(1, 0, 0), (1, 0, 300), (1, 0, 0)]);
    let all = (0..600).map(|n| n * 7 % 600);
    mesh.swaps = Swaps {
        levels: vec![1, 3],
        cycle_ends: vec![1, 2],
        cycles: Ragged::from_iter([vec![11, 590], all.collect()]),
    };
    // After the first permutation slot 11 holds another of the hub's faces.
    assert!(back(&mesh.to_bytes().0) == mesh);
}
