//! Compaction on the device: a pass over the full mesh's faces, in meshoptimizer's order, copies the live
//! faces (Lin and Yu 2006, Bogomjakov and Gotsman 2002: see [`OrderBaseline`](super::OrderBaseline); the shaders are
//! ours).

use super::PreparedBaseline;
use crate::paper::progressive_mesh::cache::live_faces;
use crate::paper::progressive_mesh::mesh::{Level, ProgressiveMesh};
use crate::vk::shader::Compacting;
use crate::vk::shader::progressive_mesh::compact_comp;
use crate::vk::{Buffer, BufferUse, Cmd, ComputePipeline, Gpu, IndexType, Resource, Result};

/// Counts of live faces in memory, one for each workgroup: 256 KiB, or more if a single instance needs more.
const KEPT_COUNTS: u32 = 1 << 16;

/// The faces of one mesh in meshoptimizer's order, on the device, shared by all its instances.
pub struct FaceCompaction {
    pipeline: ComputePipeline,
    ranked: Buffer,
    split_vertices: Buffer,
    counts: Buffer,
    faces: u32,
    /// Workgroups that cover all faces.
    groups: u32,
    first_vertices: u32,
}

/// One instance's slice of the index buffer and the level whose live faces it receives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compact {
    pub first_slot: u32,
    pub level: Level,
}

impl FaceCompaction {
    /// # Errors
    /// Out of memory, or a mesh larger than shaders can address.
    pub fn new(
        gpu: &Gpu,
        mesh: &ProgressiveMesh,
        prepared: &PreparedBaseline,
        index: IndexType,
    ) -> Result<FaceCompaction> {
        let full = live_faces(mesh, mesh.last_level());
        let mut ranked = vec![[0; 4]; full.len()];
        for (slot, (&rank, [a, b, c])) in prepared.ranks().iter().zip(full).enumerate() {
            ranked[rank as usize] = [slot as u32, a, b, c];
        }
        let faces = ranked.len() as u32;
        let group = compact_comp::SHADER.group[0];
        let counts = u64::from(faces.div_ceil(group).max(KEPT_COUNTS));
        let splits = &mesh.splits.split_vertices;
        Ok(FaceCompaction {
            pipeline: gpu.compute_pipeline("compact faces", &compact_comp::SHADER, &[index.constant()])?,
            ranked: gpu.buffer_with("faces by rank", ranked.as_flattened(), BufferUse::Storage)?,
            split_vertices: gpu.buffer_with("split vertices", splits, BufferUse::Storage)?,
            counts: gpu.buffer("counts of live faces", 4 * counts, BufferUse::Storage)?,
            faces,
            groups: faces.div_ceil(group),
            first_vertices: mesh.levels[0].vertices,
        })
    }

    /// Bytes of video memory that all instances share.
    pub fn bytes(&self) -> u64 {
        self.ranked.bytes() + self.split_vertices.bytes() + self.counts.bytes()
    }

    /// Fills slices in `indices`, each of a different instance. `indices` is a buffer of
    /// [`BufferUse::WritableIndices`].
    ///
    /// # Errors
    /// Out of memory.
    pub fn run(&self, cmd: &mut Cmd<'_>, indices: &Buffer, slices: &[Compact]) -> Result<()> {
        let resources = [
            (compact_comp::RANKED, Resource::Buffer(&self.ranked)),
            (compact_comp::SPLIT_VERTICES, Resource::Buffer(&self.split_vertices)),
            (compact_comp::COUNTS, Resource::Buffer(&self.counts)),
            (compact_comp::INDICES, Resource::Buffer(indices)),
        ];
        let groups = self.groups;
        let at_once = (self.counts.bytes() / 4 / u64::from(groups)) as usize;
        let dispatch = |kind: u32, n: usize, compact: &Compact| {
            let compacting = Compacting {
                kind,
                faces: self.faces,
                live_faces: compact.level.faces,
                live_vertices: compact.level.vertices,
                first_vertices: self.first_vertices,
                slice: 3 * compact.first_slot,
                counts_first: n as u32 * groups,
            };
            (compacting, [groups, 1, 1])
        };
        let rounds = |slices: &[Compact]| {
            [0, 1].map(|kind| slices.iter().enumerate().map(|(n, one)| dispatch(kind, n, one)).collect())
        };
        let rounds: Vec<Vec<_>> = slices.chunks(at_once).flat_map(rounds).collect();
        cmd.dispatch_rounds(&self.pipeline, &resources, &rounds)
    }
}
