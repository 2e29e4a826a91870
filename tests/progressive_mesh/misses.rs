//! The device counts each face's cache misses like one FIFO for all faces.

use super::device::read;
use super::made::Random;
use ortelius::paper::progressive_mesh::misses::{MissCounter, PIECE, REPLAYED};
use ortelius::vk::{BufferUse, GpuOptions, IndexType, Watched};
use std::collections::VecDeque;

/// The misses of each face in a FIFO that has already received the vertices of `before`.
fn fifo(before: &[[u32; 3]], faces: &[[u32; 3]]) -> Vec<u32> {
    let mut cache = VecDeque::new();
    let mut misses = |face: &[u32; 3]| {
        let mut missed = 0;
        for vertex in face {
            if !cache.contains(vertex) {
                cache.push_back(*vertex);
                if cache.len() > 16 {
                    cache.pop_front();
                }
                missed += 1;
            }
        }
        missed
    };
    for face in before {
        misses(face);
    }
    faces.iter().map(misses).collect()
}

/// The misses without the second round.
fn replayed(faces: &[[u32; 3]]) -> Vec<u32> {
    let begins = (0..faces.len()).step_by(PIECE as usize);
    let piece = |begin: usize| {
        let end = faces.len().min(begin + PIECE as usize);
        fifo(&faces[begin.saturating_sub(REPLAYED as usize)..begin], &faces[begin..end])
    };
    begins.flat_map(piece).collect()
}

/// Faces whose vertices advance, as in a strip.
fn strip(count: u32, random: &mut Random) -> Vec<[u32; 3]> {
    (0..count).map(|n| [0; 3].map(|_| n / 2 + random.below(12) as u32)).collect()
}

/// Faces among 14 vertices, of which one is replaced every 100 faces. The cache holds all 14 vertices, so the order of
/// its entries depends on much earlier faces, which a replay of a few faces does not include.
fn stubborn(count: u32, random: &mut Random) -> Vec<[u32; 3]> {
    let mut vertices: Vec<u32> = (0..14).collect();
    let face = |n: u32| {
        if n.is_multiple_of(100) {
            vertices[random.below(14)] = 14 + n / 100;
        }
        [0; 3].map(|_| vertices[random.below(14)])
    };
    (0..count).map(face).collect()
}

#[test]
fn the_device_counts_misses_like_one_fifo() {
    let gpu = Watched::open(&GpuOptions::default());
    let mut random = Random(5);
    let (strip, stubborn) = (strip(40_000, &mut random), stubborn(4_000, &mut random));
    assert_eq!(replayed(&strip), fifo(&[], &strip), "no piece needs the second round");
    assert_ne!(replayed(&stubborn), fifo(&[], &stubborn), "some piece needs the second round");
    let at_the_edges = [1, 2, 511, 512, 513, 640, 1025].map(|count| strip[..count].to_vec());
    let parts: Vec<_> = [vec![], strip, stubborn].into_iter().chain(at_the_edges).collect();
    let faces = parts.concat();
    let mut first = 0;
    let ranges: Vec<_> = parts
        .iter()
        .map(|part| {
            let range = [first, part.len() as u32];
            first += part.len() as u32;
            range
        })
        .collect();
    let expected: Vec<u32> = parts.iter().flat_map(|part| fifo(&[], part)).collect();
    for index in [IndexType::U16, IndexType::U32] {
        let packed = index.packed(faces.as_flattened());
        let indices = gpu.buffer_with("indices", &packed, BufferUse::WritableIndices(index)).unwrap();
        let bytes = 4 * faces.len() as u64;
        let misses = gpu.buffer("misses", bytes, BufferUse::WritableIndices(IndexType::U32)).unwrap();
        let mut counter = MissCounter::new(&gpu, index).unwrap();
        gpu.run_pass("count", |cmd| counter.run(&gpu, cmd, (&indices, &misses), &ranges)).unwrap();
        let found = read(&gpu, &misses);
        let wrong = (0..found.len()).find(|&face| found[face] != expected[face]);
        assert_eq!(wrong, None, "{index:?}: {:?}", wrong.map(|face| (found[face], expected[face])));
    }
}
