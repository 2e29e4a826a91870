//! Files of random meshes: complete, truncated, damaged, and invalid under valid checksums.

use super::super::choices::ErrorMetric;
use super::super::mesh::{Births, Level, NOWHERE, ProgressiveMesh, Splits, Swaps, Vertices};
use super::super::order::{OrderOptions, classical, order};
use super::super::run::State;
use super::super::simplify::{SimplifyOptions, simplify};
use super::write::chunk_checksum;
use super::{CHUNK_HEAD_BYTES, FileFlaw, HEADER_BYTES, version};
use crate::math::ragged::Ragged;
use crate::model::named;
use glam::DVec3;
use xxhash_rust::xxh3::xxh3_64;

/// A small random number generator; its period does not matter.
pub(super) struct Random(pub u64);

impl Random {
    pub(super) fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % end
    }

    fn chance(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }

    fn float(&mut self) -> f32 {
        self.below(2001) as f32 / 1000.0 - 1.0
    }
}

/// A valid mesh that grows by random splits; its geometry is arbitrary.
struct Builder {
    random: Random,
    mesh: ProgressiveMesh,
    /// The current index buffer.
    live: Vec<[u32; 3]>,
    has: [bool; 3],
}

impl Builder {
    fn vertex(&mut self) -> u32 {
        let vertices = &mut self.mesh.vertices;
        let new = vertices.positions.len() as u32;
        let first = match self.random.below(new.max(1) as usize) {
            twin if new > 0 && self.random.chance(10) => vertices.welded[twin],
            _ => new,
        };
        vertices.welded.push(first);
        let position = match first {
            first if first == new => [self.random.float(), self.random.float(), -0.0],
            first => vertices.positions[first as usize],
        };
        vertices.positions.push(position);
        let (attributes, random) = (&mut vertices.attributes, &mut self.random);
        if self.has[0] {
            attributes.normals.push([random.float(), random.float(), 1.0]);
        }
        if self.has[1] {
            attributes.coordinates.push([random.float(), random.float()]);
        }
        if self.has[2] {
            attributes.colors.push([random.below(256) as u8, 7, 8, 255]);
        }
        new
    }

    fn face(&mut self, mut corners: [u32; 3]) {
        corners.rotate_left(self.random.below(3));
        self.mesh.faces.push(corners);
        self.live.push(corners);
    }

    fn split(&mut self, old: u32) {
        let split = self.random.below(old as usize) as u32;
        let new = self.vertex();
        let at = |corners: &[u32; 3]| corners.contains(&split);
        // Changes only faces of the previous level. A face that this level adds is stored with the corners that it has
        // after the level's last split.
        let before = self.mesh.levels.last().map_or(0, |level| level.faces);
        let mut slots: Vec<u32> = (0..before).filter(|&slot| at(&self.live[slot as usize])).collect();
        let (from, to) = (self.random.below(slots.len() + 1), self.random.below(slots.len() + 1));
        slots = slots.get(from..to).unwrap_or(&[]).to_vec();
        for &slot in &slots {
            let face = &mut self.live[slot as usize];
            *face = face.map(|vertex| if vertex == split { new } else { vertex });
        }
        self.mesh.splits.split_vertices.push(split);
        self.mesh.splits.slots.push(slots);
        for _ in 0..self.random.below(3) {
            let third = self.random.below(old as usize) as u32;
            if third != split {
                self.face([split, new, third]);
            }
        }
    }

    /// Adds three vertices that replace nothing, and a face of them.
    fn component(&mut self) {
        let corners = [0; 3].map(|_| {
            self.mesh.splits.split_vertices.push(NOWHERE);
            self.mesh.splits.slots.push([]);
            self.vertex()
        });
        self.face(corners);
    }

    fn swap(&mut self, level: u32) {
        let live = self.live.len();
        let mut order: Vec<usize> = (0..live).collect();
        let (from, to) = (self.random.below(live), self.random.below(live));
        for at in from.min(to)..from.max(to) {
            let other = at + self.random.below(from.max(to) - at);
            order.swap(at, other);
        }
        let mut seen = vec![false; live];
        let swaps = &mut self.mesh.swaps;
        for start in 0..live {
            let (mut cycle, mut at) = (Vec::new(), start);
            while !std::mem::replace(&mut seen[at], true) {
                cycle.push(at as u32);
                at = order[at];
            }
            if cycle.len() > 1 {
                swaps.cycles.push(cycle);
            }
        }
        self.live = order.iter().map(|&from| self.live[from]).collect();
        swaps.levels.push(level);
        swaps.cycle_ends.push(swaps.cycles.len() as u32);
    }

    fn level(&mut self, error: f32) {
        let (vertices, faces) = (self.mesh.vertices.positions.len() as u32, self.live.len() as u32);
        self.mesh.levels.push(Level { vertices, faces, error });
    }
}

/// A mesh with this many levels above the coarsest.
pub(super) fn mesh(seed: u64, splits: u32, has: [bool; 3]) -> ProgressiveMesh {
    let random = Random(seed);
    let mut builder = Builder { random, mesh: ProgressiveMesh::default(), live: Vec::new(), has };
    builder.mesh.vertices.centre = DVec3::new(1e9, -0.0, 1.0 / 3.0);
    for _ in 0..4 {
        builder.vertex();
    }
    [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]].into_iter().for_each(|face| builder.face(face));
    builder.level(splits as f32);
    for level in 1..=splits {
        let old = builder.mesh.vertices.positions.len() as u32;
        match builder.random.below(10) {
            0 => builder.component(),
            1 | 2 => (0..2).for_each(|_| builder.split(old)),
            _ => builder.split(old),
        }
        builder.level((splits - level) as f32 / 3.0);
        if builder.random.chance(10) {
            builder.swap(level);
        }
    }
    builder.mesh.check().expect("a file may hold it");
    builder.mesh
}

/// The mesh truncated to its first levels.
fn until(mesh: &ProgressiveMesh, levels: usize) -> ProgressiveMesh {
    let mut cut = mesh.clone();
    cut.levels.truncate(levels);
    let Level { vertices, faces, .. } = cut.levels[levels - 1];
    cut.faces.truncate(faces as usize);
    cut.vertices.positions.truncate(vertices as usize);
    cut.vertices.welded.truncate(vertices as usize);
    let attributes = &mut cut.vertices.attributes;
    attributes.normals.truncate(vertices as usize);
    attributes.coordinates.truncate(vertices as usize);
    attributes.colors.truncate(vertices as usize);
    let rows = (vertices - cut.levels[0].vertices) as usize;
    cut.splits.split_vertices.truncate(rows);
    cut.splits.slots = mesh.splits.slots.rows().take(rows).map(<[u32]>::to_vec).collect();
    cut.swaps.levels.retain(|&level| (level as usize) < levels);
    cut.swaps.cycle_ends.truncate(cut.swaps.levels.len());
    let cycles = cut.swaps.cycle_ends.last().map_or(0, |&end| end as usize);
    cut.swaps.cycles = mesh.swaps.cycles.rows().take(cycles).map(<[u32]>::to_vec).collect();
    cut
}

#[test]
fn a_mesh_reads_back_bit_for_bit() {
    for (seed, splits) in [(1, 0), (2, 1), (3, 50), (4, 300), (5, 1000)] {
        for has in [[false; 3], [true; 3], [false, true, false]] {
            let mesh = mesh(seed, splits, has);
            let (bytes, contents) = mesh.to_bytes();
            let loaded = ProgressiveMesh::from_bytes(&bytes).unwrap();
            assert!(loaded.mesh == mesh, "{splits} splits, attributes {has:?}");
            let bits = |mesh: &ProgressiveMesh| -> Vec<u32> {
                mesh.vertices.positions.iter().flatten().map(|float| float.to_bits()).collect()
            };
            assert_eq!(bits(&loaded.mesh), bits(&mesh), "-0 must stay -0");
            assert_eq!(loaded.contents, contents, "writer and reader count the same bits");
            assert!(!contents.is_cut() && contents.bytes == bytes.len() as u64);
        }
    }
}

#[test]
fn a_file_keeps_the_metric_and_rejects_flags_that_its_version_does_not_have() {
    for births in [Births::Tail, Births::InPlace] {
        let old = ProgressiveMesh { births, ..example() };
        assert_eq!(version(&old), if births == Births::InPlace { 2 } else { 1 });
        for metric in [None, Some(ErrorMetric::Geometry), Some(ErrorMetric::Appearance)] {
            let mesh = ProgressiveMesh { metric, ..old.clone() };
            let (mut bytes, _) = mesh.to_bytes();
            assert_eq!(ProgressiveMesh::from_bytes(&bytes).unwrap().mesh, mesh);
            assert_eq!(u32::from(bytes[8]), if metric.is_some() { 3 } else { version(&old) });
            bytes[12] ^= if metric.is_some() { 1 << 5 } else { 1 << 3 };
            reseal(&mut bytes);
            let flaw = FileFlaw::Header("attributes or flags of an unknown kind");
            assert_eq!(ProgressiveMesh::from_bytes(&bytes), Err(flaw));
        }
    }
}

#[test]
fn the_beginning_of_a_file_is_a_coarser_mesh() {
    let mesh = mesh(7, 60, [true; 3]);
    let (bytes, contents) = mesh.to_bytes();
    assert!(contents.whole.chunks > 5, "{contents:?}");
    let (mut last, mut kinds) = (0, 0);
    for length in 0..bytes.len() {
        match ProgressiveMesh::from_bytes(&bytes[..length]) {
            Ok(loaded) => {
                let levels = loaded.mesh.levels.len();
                assert!(levels >= last && loaded.contents.is_cut());
                if levels > last {
                    assert!(loaded.mesh == until(&mesh, levels), "{levels} levels in {length} bytes");
                    kinds += 1;
                }
                last = levels;
            }
            Err(FileFlaw::NotPmesh) => assert!(length < HEADER_BYTES),
            Err(FileFlaw::NoBase { bytes, needs }) => {
                assert!(bytes == length as u64 && bytes < needs && last == 0)
            }
            Err(other) => panic!("{length} bytes: {other}"),
        }
    }
    assert_eq!(kinds, contents.whole.chunks - 1, "each chunk except the last");
    let longer = [&*bytes, &[0]].concat();
    assert_eq!(ProgressiveMesh::from_bytes(&longer), Err(FileFlaw::Longer(1)));
}

#[test]
fn every_byte_is_checksummed() {
    let (bytes, _) = mesh(8, 40, [true; 3]).to_bytes();
    for at in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1 << (at % 8);
        let flaw = ProgressiveMesh::from_bytes(&damaged).expect_err("a damaged byte was not detected");
        let where_it_is = match flaw {
            FileFlaw::NotPmesh => 0..8,
            FileFlaw::Version(_) => 8..12,
            FileFlaw::Header(_) => 12..HEADER_BYTES,
            FileFlaw::Chunk { offset, .. } => offset as usize..bytes.len(),
            other => panic!("{other}"),
        };
        assert!(where_it_is.contains(&at), "byte {at} in {where_it_is:?}");
    }
}

/// Recomputes the checksums of the header and of each chunk that is present.
pub(super) fn reseal(bytes: &mut [u8]) {
    if bytes.len() < HEADER_BYTES {
        return;
    }
    let seal = xxh3_64(&bytes[..HEADER_BYTES - 8]);
    bytes[HEADER_BYTES - 8..HEADER_BYTES].copy_from_slice(&seal.to_le_bytes());
    let (mut at, mut number) = (HEADER_BYTES, 0);
    while at + CHUNK_HEAD_BYTES <= bytes.len() {
        let payload = u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        let end = at + CHUNK_HEAD_BYTES + payload;
        if end > bytes.len() {
            return;
        }
        let seal = chunk_checksum(number, &bytes[at..end]);
        bytes[at + CHUNK_HEAD_BYTES - 8..at + CHUNK_HEAD_BYTES].copy_from_slice(&seal.to_le_bytes());
        (at, number) = (end, number + 1);
    }
}

/// Makes one to four changes: a flipped bit, a byte, an extreme number, a truncation, or a repeated piece.
fn mutate(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..=random.below(4) {
        let at = random.below(bytes.len().max(1)).min(bytes.len().saturating_sub(1));
        match random.below(6) {
            _ if bytes.is_empty() => {}
            0 | 1 => bytes[at] ^= 1 << random.below(8),
            2 => bytes[at] = random.below(256) as u8,
            3 => {
                let extreme = [0, 1, u32::MAX, 1 << 31, 1 << 20, 0x7f80_0000][random.below(6)];
                let at = at & !3;
                let end = bytes.len().min(at + 4);
                bytes[at..end].copy_from_slice(&extreme.to_le_bytes()[..end - at]);
            }
            4 => bytes.truncate(at),
            _ => {
                let piece = bytes[at..bytes.len().min(at + 40)].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, piece);
            }
        }
    }
}

#[test]
fn ten_thousand_mutated_files_are_rejected_or_valid() {
    let originals: Vec<Vec<u8>> = [(20, 0), (21, 30), (22, 120)]
        .iter()
        .map(|&(seed, splits)| {
            let metric = (seed == 21).then_some(ErrorMetric::Appearance);
            let mesh = mesh(seed, splits, [seed == 21, seed != 22, seed == 21]);
            ProgressiveMesh { metric, ..mesh }.to_bytes().0
        })
        .collect();
    let mut random = Random(99);
    let (mut valid, mut refused) = (0, 0);
    for round in 0..10_000 {
        let mut bytes = originals[round % 3].clone();
        mutate(&mut bytes, &mut random);
        // Without this, the checksums would reject most files before the decoder runs.
        if round % 8 != 0 {
            reseal(&mut bytes);
        }
        let Ok(loaded) = ProgressiveMesh::from_bytes(&bytes) else {
            refused += 1;
            continue;
        };
        valid += 1;
        let mesh = &loaded.mesh;
        let items = mesh.faces.len() + mesh.vertices.positions.len() + mesh.swaps.cycles.items().len();
        assert!(items <= 4 * bytes.len(), "{items} items of {} bytes", bytes.len());
        mesh.check().unwrap();
        let mut state = State::new(mesh);
        [mesh.last_level(), 0].iter().for_each(|&level| state.go_to(mesh, level));
        assert!(state.faces() == mesh.faces);
        // An accepted mesh must also survive writing and reading.
        if !loaded.contents.is_cut() {
            assert!(ProgressiveMesh::from_bytes(&mesh.to_bytes().0).unwrap().mesh == *mesh);
        }
    }
    assert!(valid > 100 && refused > 1000, "{valid} valid, {refused} refused");
    assert!(!is_limited() || Vec::<u8>::new().try_reserve_exact(MAX_KIB << 10).is_err(), "no limit");
}

/// Limit of the address space of a test process that reads damaged files. It suffices for the program, two
/// stacks and two allocator arenas, but not for the memory that a single wrong length would reserve.
const MAX_KIB: usize = 512 << 10;
const LIMITED: &str = "ORTELIUS_TEST_LIMITED";

fn is_limited() -> bool {
    std::env::var_os(LIMITED).is_some()
}

/// Runs the test above in a process with limited memory.
#[test]
#[cfg(unix)]
fn mutated_files_take_bounded_memory() {
    let script = format!("ulimit -v {MAX_KIB} && exec \"$0\" \"$@\"");
    let test = "paper::progressive_mesh::file::tests::ten_thousand_mutated_files_are_rejected_or_valid";
    let mut command = std::process::Command::new("sh");
    command.args(["-c", &script]).arg(std::env::current_exe().unwrap());
    command.args(["--exact", test, "--test-threads=1"]).env(LIMITED, "1");
    let ran = command.output().unwrap();
    let said = String::from_utf8_lossy(&ran.stdout);
    assert!(
        ran.status.success() && said.contains("1 passed"),
        "{said}{}",
        String::from_utf8_lossy(&ran.stderr)
    );
}

#[test]
fn the_bunny_takes_few_bytes_a_split() {
    let model = named("bunny").unwrap();
    let collapses = simplify(&model, &SimplifyOptions::default(), &mut |_, _| {}).collapses;
    let tail = order(&model, &collapses, &OrderOptions::TAIL_23, &mut |_, _| {});
    // Measured (pm.size): 5 bytes in classical order, 15 with permutations. The limits are higher, so that
    // small changes of `simplify` pass.
    let in_place = order(&model, &collapses, &OrderOptions::IN_PLACE_23, &mut |_, _| {});
    for (mesh, max) in [(classical(&model, &collapses), 8.0), (tail, 20.0), (in_place, 21.0)] {
        let (bytes, contents) = mesh.to_bytes();
        assert!(ProgressiveMesh::from_bytes(&bytes).unwrap().mesh == mesh);
        let each = contents.bytes_per_split(&mesh);
        assert!(each < max, "{each}: {contents:?}");
    }
}

/// The example in docs/pmesh.md.
fn example() -> ProgressiveMesh {
    let level = |vertices, faces, error| Level { vertices, faces, error };
    ProgressiveMesh {
        vertices: Vertices {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.5, 0.5, 0.0]],
            welded: (0..5).collect(),
            ..Vertices::default()
        },
        faces: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3], [1, 2, 4], [3, 1, 4]],
        levels: vec![level(4, 4, 0.5), level(5, 6, 0.0)],
        splits: Splits { split_vertices: vec![1], slots: Ragged::from_iter([[3]]) },
        swaps: Swaps { levels: vec![1], cycle_ends: vec![1], cycles: Ragged::from_iter([[1, 4]]) },
        ..ProgressiveMesh::default()
    }
}

#[test]
fn the_documented_example_is_what_is_written() {
    let text = include_str!("../../../../docs/pmesh.md");
    let example_text = text.split("```").nth(1).expect("a block of bytes");
    let documented: Vec<u8> = example_text
        .lines()
        .filter_map(|line| line.split_once("  "))
        .flat_map(|(_, bytes)| bytes.split(' ').map(|byte| u8::from_str_radix(byte, 16).unwrap()))
        .collect();
    let mesh = example();
    mesh.check().unwrap();
    assert_eq!(mesh.to_bytes().0, documented);
}
