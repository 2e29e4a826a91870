//! The buffer at a level has the same bits after every walk to this level, and has the faces of a mesh built from
//! scratch.

use super::made::{Made, Random, arrange, collapse, quad, torus};
use ortelius::model::Model;
use ortelius::paper::progressive_mesh::mesh::{Births, NOWHERE, ProgressiveMesh};
use ortelius::paper::progressive_mesh::reference::{drawn_in_place, face_set, faces_at, wedges_at};
use ortelius::paper::progressive_mesh::run::{DirtyBlocks, IgnoreWrites, Instances, Program, State};
use ortelius::paper::progressive_mesh::simplify::Collapses;
use proptest::prelude::*;
use std::sync::Arc;

/// A random model, its collapses, and the progressive mesh made from both.
fn anything(seed: u64) -> (Model, Collapses, Made) {
    let random = &mut Random(seed);
    let model = torus(3 + random.below(6), 3 + random.below(6), random.below(2) == 0, random.below(4));
    let collapses = collapse(&model, random.below(model.faces.len()), random);
    let made = arrange(&model, &collapses, 1 + random.below(6), random);
    (model, collapses, made)
}

/// The first difference between the live faces at a level and the faces of a mesh built from scratch.
fn difference(
    live: &[[u32; 3]],
    (model, collapses, made): &(Model, Collapses, Made),
    level: u32,
) -> Option<String> {
    let shown = face_set(live.iter().map(|face| face.map(|vertex| made.wedges[vertex as usize])));
    let built = face_set(faces_at(model, collapses, level));
    let vertices = made.mesh.levels[level as usize].vertices as usize;
    let mut wedges = made.wedges[..vertices].to_vec();
    wedges.sort_unstable();
    if wedges != Vec::from_iter(wedges_at(model, collapses, level)) {
        return Some(format!("level {level}: other wedges are live"));
    }
    let other = shown.iter().zip(&built).find(|(a, b)| a != b);
    (shown != built).then(|| format!("level {level}: {} of {} faces; {other:?}", shown.len(), built.len()))
}

/// All implementations of execution in parallel; each step compares their results.
struct Walk {
    program: Arc<Program>,
    literal: State,
    whole: Vec<[u32; 3]>,
    instance: Instances,
    kept: Vec<[u32; 3]>,
}

impl Walk {
    fn new(mesh: &ProgressiveMesh) -> Walk {
        let program = Arc::new(Program::new(mesh).unwrap());
        let (literal, instance) = (State::new(mesh), Instances::new(program.clone(), 1).unwrap());
        Walk { literal, whole: mesh.faces.clone(), instance, program, kept: Vec::new() }
    }

    fn go_to(&mut self, mesh: &ProgressiveMesh, level: u32) {
        let before = self.literal.level();
        self.literal.go_to(mesh, level);
        self.program.run(&mut self.whole, before, level, &mut self.kept, &mut IgnoreWrites);
        self.instance.go_to(0, level).unwrap();
        assert!(self.whole == self.literal.faces(), "from {before} to {level}: not the paper's buffer");
        assert!(
            self.instance.faces(0) == self.literal.live(mesh),
            "from {before} to {level}: not the live prefix"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn every_level_holds_the_faces_of_a_fresh_build(seed: u64) {
        let all = anything(seed);
        let mesh = &all.2.mesh;
        let mut walk = Walk::new(mesh);
        for level in (0..=mesh.last_level()).chain((0..mesh.last_level()).rev()) {
            walk.go_to(mesh, level);
            prop_assert_eq!(difference(walk.instance.faces(0), &all, level), None);
        }
        prop_assert!(walk.whole == mesh.faces, "level 0 has changed");
    }

    #[test]
    fn a_random_walk_comes_to_each_level_with_the_same_bits(seed: u64) {
        let (_, _, made) = anything(seed);
        let mesh = &made.mesh;
        let mut stepped = State::new(mesh);
        let mut buffers = vec![stepped.faces().to_vec()];
        for level in 1..=mesh.last_level() {
            stepped.go_to(mesh, level);
            buffers.push(stepped.faces().to_vec());
        }
        let (mut walk, mut random) = (Walk::new(mesh), Random(!seed));
        for _ in 0..30 {
            let level = random.below(buffers.len());
            walk.go_to(mesh, level as u32);
            prop_assert!(walk.whole == buffers[level], "another path to level {level} gives other bits");
        }
    }

    #[test]
    fn instances_share_a_buffer_and_nothing_else(seed: u64) {
        let (_, _, made) = anything(seed);
        let program = Arc::new(Program::new(&made.mesh).unwrap());
        let mut instances = Instances::new(program, 9).unwrap();
        let (mut copy, mut random): (Vec<u32>, _) = (Vec::new(), Random(!seed));
        for _ in 0..40 {
            let (instance, level) = (random.below(9), random.below(made.mesh.levels.len()) as u32);
            instances.go_to(instance, level).unwrap();
            copy.resize(3 * instances.buffer().len(), 0);
            for words in instances.take_touched() {
                copy[words.clone()].copy_from_slice(&instances.buffer().as_flattened()[words]);
            }
            for other in 0..9 {
                let mut alone = State::new(&made.mesh);
                alone.go_to(&made.mesh, instances.level(other));
                prop_assert!(instances.faces(other) == alone.live(&made.mesh), "instance {other} after {instance}");
                let slots = instances.slots(other);
                let uploaded = &copy[3 * slots.start..3 * slots.end];
                prop_assert!(uploaded == instances.faces(other).as_flattened(), "{other} was not reported");
            }
        }
    }

    #[test]
    fn all_writes_lie_in_the_touched_ranges(seed: u64) {
        let (_, _, made) = anything(seed);
        let program = Program::new(&made.mesh).unwrap();
        let (mut faces, mut random) = (made.mesh.faces.clone(), Random(!seed));
        let mut copy = faces.clone();
        let (mut level, mut kept) = (0, Vec::new());
        let mut touched = DirtyBlocks::new(faces.len());
        for _ in 0..10 {
            let next = random.below(made.mesh.levels.len()) as u32;
            program.run(&mut faces, level, next, &mut kept, &mut touched);
            for words in touched.take() {
                copy.as_flattened_mut()[words.clone()].copy_from_slice(&faces.as_flattened()[words]);
            }
            prop_assert!(copy == faces, "from {level} to {next}: something was written elsewhere");
            level = next;
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn births_in_place_come_to_each_level_with_the_references_buffer_and_the_faces_of_a_fresh_build(seed: u64) {
        let mut all = anything(seed);
        all.2.mesh.births = Births::InPlace;
        let mesh = &all.2.mesh;
        let last = mesh.last_level();
        let wanted: Vec<_> = (0..=last).map(|level| drawn_in_place(mesh, level)).collect();
        let mut instances = Instances::new(Arc::new(Program::new(mesh).unwrap()), 2).unwrap();
        let (mut copy, mut random): (Vec<u32>, _) = (Vec::new(), Random(!seed));
        let walk: Vec<u32> = (0..30).map(|_| random.below(wanted.len()) as u32).collect();
        for level in (0..=last).chain((0..last).rev()).chain(walk) {
            let instance = random.below(2);
            instances.go_to(instance, level).unwrap();
            prop_assert!(instances.faces(instance) == wanted[level as usize], "level {level}");
            let born = instances.faces(instance).iter().copied().filter(|face| has_area(mesh, face));
            prop_assert_eq!(difference(&born.collect::<Vec<_>>(), &all, level), None);
            copy.resize(3 * instances.buffer().len(), 0);
            for words in instances.take_touched() {
                copy[words.clone()].copy_from_slice(&instances.buffer().as_flattened()[words]);
            }
            let slots = instances.slots(instance);
            let uploaded = &copy[3 * slots.start..3 * slots.end];
            prop_assert!(uploaded == instances.faces(instance).as_flattened(), "level {level} was not uploaded");
        }
    }
}

fn has_area(mesh: &ProgressiveMesh, face: &[u32; 3]) -> bool {
    let [a, b, c] = face.map(|vertex| mesh.vertices.welded[vertex as usize]);
    a != b && b != c && c != a
}

/// The random meshes of the tests above include seams, components, levels with and without permutations, and jumps that
/// construct a level. Some of these jumps also execute permutations since the level's keyframe.
#[test]
fn the_random_meshes_have_seams_components_permutations_and_jumps() {
    let (mut seams, mut components, mut swaps, mut bare, mut jumps, mut moves) = (0, 0, 0, 0, 0, 0);
    for seed in 0..50 {
        let (_, collapses, made) = anything(seed);
        let rows = || collapses.wedges.rows();
        components += usize::from(rows().any(|row| row[0][1] == NOWHERE));
        seams += usize::from(rows().any(|row| row.len() > 1 && row[0][1] != NOWHERE));
        swaps += usize::from(!made.mesh.swaps.levels.is_empty());
        bare += usize::from(made.mesh.swaps.levels.len() < made.mesh.levels.len() - 1);
        let (program, last) = (Program::new(&made.mesh).unwrap(), made.mesh.last_level());
        jumps += usize::from(program.constructs(0, last));
        let moved = |to| program.constructs(0, to) && program.change(0, to).len() > 1;
        moves += usize::from((0..=last).any(moved));
    }
    let counts = [seams, components, swaps, bare, jumps, moves];
    assert!(counts.iter().all(|&n| n >= 10), "{counts:?}");
}

#[test]
fn a_quad_is_split_and_swapped_as_the_paper_says() {
    let mesh = quad();
    let mut state = State::new(&mesh);
    assert_eq!(state.live(&mesh), [[0, 1, 2]]);
    state.go_to(&mesh, 1);
    assert_eq!(state.live(&mesh), [[0, 2, 3], [0, 3, 2]]);
    state.go_to(&mesh, 0);
    assert_eq!(state.faces(), mesh.faces);
}

/// The comparison must detect a split with a missing slot, if the mesh can still be executed.
#[test]
fn a_split_in_another_face_is_not_the_fresh_build() {
    let (mut seen, mut random) = (0, Random(1));
    for seed in 0..50 {
        let mut all = anything(seed);
        let mesh = &mut all.2.mesh;
        if mesh.splits.slots.items().is_empty() {
            continue;
        }
        let mut rows: Vec<Vec<u32>> = mesh.splits.slots.rows().map(<[u32]>::to_vec).collect();
        let filled: Vec<usize> = (0..rows.len()).filter(|&row| !rows[row].is_empty()).collect();
        // One face less uses the new vertex.
        rows[filled[random.below(filled.len())]].pop();
        mesh.splits.slots = rows.into_iter().collect();
        let Ok(program) = Program::new(mesh) else {
            seen += 1;
            continue;
        };
        let mut instance = Instances::new(Arc::new(program), 1).unwrap();
        let last = all.2.mesh.last_level();
        let differs = (0..=last).any(|level| {
            instance.go_to(0, level).unwrap();
            difference(instance.faces(0), &all, level).is_some()
        });
        assert!(differs, "seed {seed}: a face that kept its old vertex was not detected");
        seen += 1;
    }
    assert!(seen >= 30, "{seen} of 50 seeds have splits");
}
