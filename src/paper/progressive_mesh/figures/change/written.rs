//! Counts the bytes that level changes write into the index buffer, without a device.

use super::Meshes;
use super::ways::WriteMethod;
use crate::paper::progressive_mesh::baselines::{OrderBaseline, PreparedBaseline, SkipList};
use crate::paper::progressive_mesh::choices::FaceOrder;
use crate::paper::progressive_mesh::figures::orders::Executable;
use crate::paper::progressive_mesh::mesh::Level;
use crate::paper::progressive_mesh::run::{IgnoreWrites, Operation, Program};

/// The counts of a walk through all levels and back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Written {
    pub bytes: u64,
    pub changes: u64,
    /// Bytes of the largest change.
    pub worst: u64,
    /// Faces of copied lists, on the way up and on the way down.
    pub copied: [u64; 2],
}

impl Written {
    fn add(&mut self, bytes: u64) {
        self.bytes += bytes;
        self.changes += 1;
        self.worst = self.worst.max(bytes);
    }
}

/// Walks through all levels and back in steps of `step` splits, and counts what the method `way` writes. The last step
/// up and the first step down may be smaller.
pub fn walk(way: &WriteMethod, meshes: &Meshes, step: u32) -> Written {
    let Executable { mesh, program: classical } = &meshes.classical;
    let last = mesh.last_level();
    let mut levels: Vec<u32> = (0..last).step_by(step as usize).collect();
    levels.push(last);
    let back = levels.iter().rev().skip(1).copied().collect::<Vec<u32>>();
    levels.extend(back);
    let changes = levels.windows(2).map(|pair| [pair[0], pair[1]]);
    let face = classical.index_type().triangle_bytes();
    let mut written = Written::default();
    match way.order {
        Some(order @ (FaceOrder::Classical | FaceOrder::Tail23 | FaceOrder::InPlace23)) => {
            let program = &meshes.in_order(order).program;
            changes.for_each(|change| written.add(executed(program, change)));
        }
        Some(FaceOrder::Discrete) => changes.for_each(|_| written.add(0)),
        Some(FaceOrder::SkipLists) => {
            let every_vertex = (0..mesh.vertices.positions.len() as u32).collect();
            let baseline = OrderBaseline::of(FaceOrder::SkipLists).expect("they are a baseline");
            let lists = PreparedBaseline::new(mesh, baseline, every_vertex);
            let mut walker = Walker::new(&lists, classical.levels(), face);
            changes.for_each(|change| walker.go(change, &mut written));
        }
        // The other methods write all live faces.
        _ => changes.for_each(|[_, to]| written.add(face * u64::from(classical.levels()[to as usize].faces))),
    }
    written
}

/// Bytes that a level change writes: corners, moved faces, and faces that become live; or the faces of a construction.
fn executed(program: &Program, [from, to]: [u32; 2]) -> u64 {
    let [before, after] = [from, to].map(|level| program.drawn(level));
    let of_operation = |operation: &Operation| match operation {
        Operation::Write { corners, .. } => corners.len() as u64,
        Operation::Move { faces, .. } => 3 * faces.len() as u64,
        Operation::Construct { faces, .. } => 3 * u64::from(*faces),
    };
    let operations: u64 = program.change(from, to).iter().map(of_operation).sum();
    let born = if program.constructs(from, to) { 0 } else { after.saturating_sub(before) };
    program.index_type().bytes() * (operations + 3 * u64::from(born))
}

/// An instance's copy of a skip list.
struct Walker<'a> {
    lists: &'a PreparedBaseline,
    levels: &'a [Level],
    at: usize,
    list: &'a SkipList,
    faces: Vec<[u32; 3]>,
    face_bytes: u64,
}

impl<'a> Walker<'a> {
    /// A copy of the list of level 0.
    fn new(lists: &'a PreparedBaseline, levels: &'a [Level], face_bytes: u64) -> Walker<'a> {
        let (at, list) = lists.skip_list(0);
        Walker { lists, levels, at, list, faces: lists.drawn(0, &[]), face_bytes }
    }

    fn go(&mut self, [from, to]: [u32; 2], written: &mut Written) {
        let (at, list) = self.lists.skip_list(to);
        if at == self.at {
            let corners = list.run(self.levels, &mut self.faces, [from, to], &mut IgnoreWrites);
            return written.add(self.face_bytes / 3 * corners as u64);
        }
        // The new list is written as a whole, with the corners of the new level.
        (self.at, self.list) = (at, list);
        self.faces = self.lists.drawn(to, &[]);
        written.copied[usize::from(to < from)] += self.faces.len() as u64;
        written.add(self.face_bytes * self.faces.len() as u64);
    }
}

#[cfg(test)]
mod tests {
    use super::super::ways::WAYS;
    use super::*;

    /// Corners and moved faces of some operations.
    fn counted(operations: &[Operation]) -> [u64; 2] {
        operations.iter().fold([0; 2], |[corners, moves], operation| match operation {
            Operation::Write { corners: range, .. } => [corners + range.len() as u64, moves],
            Operation::Move { faces, .. } => [corners, moves + faces.len() as u64],
            Operation::Construct { .. } => [corners, moves],
        })
    }

    #[test]
    fn a_walk_writes_each_corner_each_move_and_each_list_once_in_each_direction() {
        let meshes = Meshes::of("sphere:8").unwrap();
        let [classical, tail, in_place] =
            [&meshes.classical, &meshes.tail, &meshes.in_place].map(|of| &of.program);
        let [last, base] = [tail.last_level(), 0].map(|level| tail.levels()[level as usize]);
        let by = |name: &str, step| {
            let way = WAYS.iter().find(|way| way.name == name).unwrap();
            walk(way, &meshes, step)
        };
        // A small mesh: indices of 16 bits.
        let corners = 2 * classical.corners().words.len() as u64;
        let born = 6 * u64::from(last.faces - base.faces);
        let splits = u64::from(tail.last_level());
        let found = by("classical", 1);
        assert_eq!((found.bytes, found.changes), (2 * corners + born, 2 * splits));
        // All faces of the last level on the way up, and of the first level on the way down.
        let copies = 6 * u64::from(last.faces + base.faces);
        assert_eq!(by("compacted", 1 << 20).bytes, copies);
        // With births in place, level 0 already has the first group's faces.
        let in_place_copies = 6 * u64::from(last.faces + in_place.drawn(0));
        for (name, program, copies) in [("tail-23", tail, copies), ("in-place-23", in_place, in_place_copies)]
        {
            let last = program.last_level();
            let steps = (0..last).flat_map(|level| [[level, level + 1], [level + 1, level]]);
            let cheapest = |[from, to]: [u32; 2]| {
                let [old, new] = [from, to].map(|level| u64::from(program.drawn(level)));
                let [corners, moves] = counted(&program.steps(from, to));
                let constructed = 6 * (new + counted(&program.change(from, to))[1]);
                (2 * corners + 6 * (moves + new.saturating_sub(old))).min(constructed)
            };
            assert_eq!(by(name, 1).bytes, steps.map(cheapest).sum::<u64>(), "{name}");
            let corners = 2 * program.corners().words.len() as u64;
            let moves = 6 * program.moves().from.len() as u64;
            assert!(by(name, 1).bytes <= 2 * (corners + moves) + copies, "{name}");
            // A jump from end to end is a construction, after which permutations move less than half of the faces.
            let jump = by(name, 1 << 20).bytes;
            assert!((copies..copies + copies / 2).contains(&jump), "{name}: {jump} bytes, {copies}");
        }
        assert_eq!((by("discrete", 3).bytes, by("copy of the live faces", 5)), (0, by("random", 5)));
        let lists = by("skip-lists", 1);
        let [up, down] = lists.copied;
        // Up, all lists except the coarsest are copied; down, all except the finest.
        assert!(up > down && lists.worst == 6 * u64::from(last.faces), "{lists:?}");
        assert!(lists.bytes > 6 * (up + down) && lists.bytes < 6 * (up + down) + 6 * corners, "{lists:?}");
    }
}
