//! Level changes on the GPU, in a device-local index buffer (ours; the paper executes on the CPU).
//!
//! [`DeviceProgram`] runs a [`Program`]; the host sends a few words per step. All splits between two permutations are
//! one dispatch. Some splits build on others, but their order does not matter (see `apply.comp`). A
//! permutation takes two dispatches, and the construction of a level takes one.

use super::run::{Operation, Program};
use crate::vk::shader::Applying;
use crate::vk::shader::progressive_mesh::apply_comp;
use crate::vk::{Buffer, BufferUse, Cmd, ComputePipeline, Gpu, IndexType, Resource, Result, group_line};

/// Minimum capacity of `kept` in faces (768 KiB), for all instances of a batch. A permutation first copies its moved
/// faces to `kept`. If a permutation moves more faces than this, the capacity is the number of faces that it moves.
const KEPT_FACES: usize = 1 << 16;

/// A program on the device, shared by all instances of its mesh.
pub struct DeviceProgram {
    pipeline: ComputePipeline,
    program: Buffer,
    /// The tables of [`Direct`](super::run::Direct): numbers, faces, predecessors.
    tables: Buffer,
    kept: Buffer,
    /// First word in `program` of the moves.
    moves_at: usize,
    /// First words in `tables` of the faces and of the predecessors.
    faces_at: usize,
    predecessors_at: usize,
}

/// One instance's level change. The instance's slice of the index buffer holds at least the drawn faces of both levels,
/// or only the drawn faces of level `to` if the program constructs that level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LevelChange {
    /// First slot of the instance's slice.
    pub first_slot: u32,
    pub from: u32,
    pub to: u32,
}

/// Dispatches of one round are independent. Each round sees the writes of the earlier rounds.
type Rounds = Vec<Vec<(Applying, [u32; 3])>>;

impl DeviceProgram {
    /// # Errors
    /// Out of memory, or a program larger than shaders can address in a buffer.
    pub fn new(gpu: &Gpu, program: &Program, index: IndexType) -> Result<DeviceProgram> {
        let (corners, moves) = (program.corners(), program.moves());
        let direct = program.direct();
        let mut words = Vec::with_capacity(3 * corners.words.len() + 2 * moves.from.len());
        for ((&word, &up), &down) in corners.words.iter().zip(&corners.up).zip(&corners.down) {
            words.extend([word, up, down]);
        }
        let moves_at = words.len();
        let filled = moves.runs.iter().flat_map(|&[first, end]| first..end);
        words.extend(filled.zip(&moves.from).flat_map(|(to, &from)| [to, from]));
        let tables = [&*direct.numbers, direct.faces.as_flattened(), &*direct.predecessors];
        let faces_at = tables[0].len();
        let buffer = |name, words: &[u32]| {
            let advice = "take an order that moves fewer faces (in-place-10, tail-10, classical) or a smaller mesh, or \
                          let the host change levels (apply = \"cpu\")";
            gpu.require_storage(name, size_of_val(words) as u64, advice)?;
            gpu.buffer_with(name, words, BufferUse::Storage)
        };
        let kept = program.largest_move().max(KEPT_FACES);
        Ok(DeviceProgram {
            pipeline: gpu.compute_pipeline("apply levels", &apply_comp::SHADER, &[index.constant()])?,
            program: buffer("mesh: splits and permutations", &words)?,
            tables: buffer("mesh: tables for constructed levels", &tables.concat())?,
            kept: gpu.buffer("kept faces", 12 * kept as u64, BufferUse::Storage)?,
            moves_at,
            faces_at,
            predecessors_at: faces_at + tables[1].len(),
        })
    }

    /// Bytes of video memory that all instances share.
    pub fn bytes(&self) -> u64 {
        self.program.bytes() + self.tables.bytes() + self.kept.bytes()
    }

    /// Executes `changes` in `indices`. Each change is for a different instance; `indices` is a buffer of
    /// [`BufferUse::WritableIndices`].
    ///
    /// # Errors
    /// Out of memory.
    ///
    /// # Panics
    /// If `program` has no such level. `program` must be the program that was passed to [`DeviceProgram::new`].
    pub fn run(
        &self,
        cmd: &mut Cmd<'_>,
        program: &Program,
        indices: &Buffer,
        changes: &[LevelChange],
    ) -> Result<()> {
        let resources = [
            (apply_comp::PROGRAM, Resource::Buffer(&self.program)),
            (apply_comp::TABLES, Resource::Buffer(&self.tables)),
            (apply_comp::INDICES, Resource::Buffer(indices)),
            (apply_comp::KEPT, Resource::Buffer(&self.kept)),
        ];
        cmd.dispatch_rounds(&self.pipeline, &resources, &self.rounds(program, changes))
    }

    /// The dispatches of all changes. Instances run in lockstep, in batches whose largest permutations fit
    /// into `kept`.
    fn rounds(&self, program: &Program, changes: &[LevelChange]) -> Rounds {
        let capacity = (self.kept.bytes() / 12) as usize;
        let mut rounds = Rounds::new();
        let (mut base, mut kept) = (0, 0);
        for change in changes {
            let steps = program.change(change.from, change.to);
            let kept_faces = |step: &Operation| match step {
                Operation::Write { .. } | Operation::Construct { .. } => 0,
                Operation::Move { faces, .. } => faces.len(),
            };
            let max = steps.iter().map(kept_faces).max().unwrap_or(0);
            if kept + max > capacity {
                (base, kept) = (rounds.len(), 0);
            }
            let dispatches = steps.iter().flat_map(|step| self.dispatches(step, change, kept));
            for (n, dispatch) in dispatches.enumerate() {
                if base + n == rounds.len() {
                    rounds.push(Vec::new());
                }
                rounds[base + n].push(dispatch);
            }
            kept += max;
        }
        rounds
    }

    fn dispatches(&self, step: &Operation, change: &LevelChange, kept: usize) -> Vec<(Applying, [u32; 3])> {
        let dispatch = |kind, up: bool, first: usize, count: usize| {
            let applying = Applying {
                kind,
                down: u32::from(!up),
                first: first as u32,
                count: count as u32,
                slice: 3 * change.first_slot,
                kept_first: 3 * kept as u32,
                listed: 0,
                vertices: 0,
                faces_at: self.faces_at as u32,
                predecessors_at: self.predecessors_at as u32,
            };
            (applying, group_line(count.div_ceil(64) as u64))
        };
        match step {
            Operation::Write { corners, .. } if corners.is_empty() => vec![],
            Operation::Write { corners, up } => vec![dispatch(0, *up, 3 * corners.start, corners.len())],
            Operation::Move { faces, .. } if faces.is_empty() => vec![],
            Operation::Move { faces, up, .. } => {
                [1, 2].map(|kind| dispatch(kind, *up, self.moves_at + 2 * faces.start, faces.len())).into()
            }
            Operation::Construct { numbers, faces, vertices } => {
                let (applying, groups) = dispatch(3, true, numbers.start, *faces as usize);
                vec![(Applying { listed: numbers.len() as u32, vertices: *vertices, ..applying }, groups)]
            }
        }
    }
}
