//! Level changes on the device give the host's buffer, bit for bit. Validation is on in every test, and any
//! message fails the test.

use super::made::{Random, arrange, collapse, torus};
use ortelius::paper::progressive_mesh::apply::{DeviceProgram, LevelChange};
use ortelius::paper::progressive_mesh::mesh::{Births, ProgressiveMesh};
use ortelius::paper::progressive_mesh::run::Program;
use ortelius::paper::progressive_mesh::surface::vertices::{
    ALWAYS_LOG2, EXACT_LOG2, MORPH_BAND_LOG2, morph_vertices,
};
use ortelius::vk::{Buffer, BufferUse, Gpu, GpuOptions, IndexType, Watched};

/// The indices of a buffer.
pub fn read(gpu: &Gpu, buffer: &Buffer) -> Vec<u32> {
    match buffer.index_type() {
        IndexType::U16 => gpu.read_buffer::<u16>(buffer).unwrap().into_iter().map(u32::from).collect(),
        IndexType::U32 => gpu.read_buffer(buffer).unwrap(),
    }
}

const WIDTHS: [IndexType; 2] = [IndexType::U16, IndexType::U32];

fn mesh(seed: u64, swap_every: usize) -> ProgressiveMesh {
    let random = &mut Random(seed);
    let model = torus(12, 11, seed.is_multiple_of(2), 3);
    let collapses = collapse(&model, 12, random);
    arrange(&model, &collapses, swap_every, random).mesh
}

#[test]
fn every_morph_is_complete_at_the_smallest_wanted_error_even_after_errors_of_0() {
    let mut mesh = mesh(1, 3);
    mesh.levels.iter_mut().for_each(|level| level.error = 0.0);
    let vertices = morph_vertices(&mesh, &vec![[0.0; 3]; mesh.vertices.positions.len()]);
    assert!(vertices.iter().any(|vertex| vertex.birth_log2 < ALWAYS_LOG2), "some vertices replace others");
    let arrived = |birth_log2: f32| birth_log2 - EXACT_LOG2 >= MORPH_BAND_LOG2;
    assert!(vertices.iter().all(|vertex| arrived(vertex.birth_log2)));
}

#[test]
fn the_device_applies_levels_of_many_instances_like_the_host() {
    let gpu = Watched::open(&GpuOptions::default());
    let mut jumps = 0;
    // Meshes with many permutations, with few, and without any.
    for (seed, swap_every, births) in [
        (1, 3, Births::Tail),
        (2, 30, Births::Tail),
        (3, usize::MAX, Births::Tail),
        (4, 3, Births::InPlace),
        (5, 30, Births::InPlace),
    ] {
        let program = Program::new(&ProgressiveMesh { births, ..mesh(seed, swap_every) }).unwrap();
        jumps += WIDTHS.map(|index| walk_instances(&gpu, &program, index, seed)).iter().sum::<usize>();
    }
    assert!(jumps >= 20, "{jumps} of 280 changes construct a level");
}

/// Returns the number of changes that construct a level.
fn walk_instances(gpu: &Gpu, program: &Program, index: IndexType, seed: u64) -> usize {
    // An odd number, so that a word of two indices belongs to two instances.
    let slots = program.faces().len() | 1;
    let apply = DeviceProgram::new(gpu, program, index).unwrap();
    let mut faces = program.faces().to_vec();
    faces.resize(slots, [7; 3]);
    let mut instances = vec![(0u32, faces); 7];
    let whole: Vec<[u32; 3]> = instances.iter().flat_map(|(_, faces)| faces.clone()).collect();
    let packed = index.packed(whole.as_flattened());
    let indices = gpu.buffer_with("indices", &packed, BufferUse::WritableIndices(index)).unwrap();
    let births = index.packed(program.faces().as_flattened());
    let births = gpu.buffer_with("births", &births, BufferUse::Storage).unwrap();
    let (mut random, mut kept, mut jumps) = (Random(seed), Vec::new(), 0);
    for round in 0..4 {
        let (mut changes, mut born) = (Vec::new(), Vec::new());
        for (n, (level, faces)) in instances.iter_mut().enumerate() {
            // Instance 0 goes up and down all the way; instance 6 keeps its level.
            let to = match n {
                0 if round % 2 == 0 => program.last_level(),
                0 => 0,
                6 => *level,
                _ => random.below(program.levels().len()) as u32,
            };
            program.run(
                faces,
                *level,
                to,
                &mut kept,
                &mut ortelius::paper::progressive_mesh::run::IgnoreWrites,
            );
            jumps += usize::from(program.constructs(*level, to));
            // New faces are copied as in a surface. A construction needs no copy, because it writes all drawn faces.
            let (old, new) = (program.drawn(*level) as usize, program.drawn(to) as usize);
            if new > old && !program.constructs(*level, to) {
                born.push([old, n * slots + old, new - old].map(|faces| 3 * index.bytes() * faces as u64));
            }
            changes.push(LevelChange { first_slot: (n * slots) as u32, from: *level, to });
            *level = to;
        }
        let mut frame = gpu.frame().unwrap();
        frame.pass("births", |cmd| cmd.copy_ranges(&births, &indices, &born)).unwrap();
        frame.pass("apply", |cmd| apply.run(cmd, program, &indices, &changes)).unwrap();
        frame.submit().unwrap().wait().unwrap();
        let words = read(gpu, &indices);
        for (n, (level, faces)) in instances.iter().enumerate() {
            let own = &words[3 * n * slots..3 * (n + 1) * slots];
            let drawn = &faces[..program.drawn(*level) as usize];
            let first = own.iter().zip(drawn.as_flattened()).position(|(a, b)| a != b);
            assert_eq!(first, None, "mesh {seed}, round {round}, instance {n} at level {level}");
        }
    }
    jumps
}

#[test]
fn a_mesh_too_large_for_shaders_to_address_is_refused_with_advice() {
    let gpu = Watched::open(&GpuOptions::default());
    assert!(gpu.require_storage("mesh: splits", 1 << 20, "take a smaller mesh").is_ok());
    let error = gpu.require_storage("mesh: splits", 1 << 33, "take a smaller mesh").unwrap_err().to_string();
    let words = ["mesh: splits", "8589934592", "take a smaller mesh"];
    assert!(words.iter().all(|word| error.contains(word)), "{error}");
}
