//! The vertices of each face that miss in a FIFO cache of 16 entries, counted on the device for the window's overlay.
//!
//! Each miss depends on all faces before it, so a single thread would take long for a large mesh. Here each thread
//! simulates a piece of the faces. It first simulates some faces before the piece, from an empty cache. That usually
//! gives the right cache, but not always. A second round therefore compares the cache before each piece with the cache
//! after the preceding piece. Where the caches differ, one thread simulates the piece again. The counts are the same as
//! the counts of one cache for all faces.

use crate::vk::shader::FaceRange;
use crate::vk::shader::progressive_mesh::misses_comp;
use crate::vk::{Buffer, BufferUse, Cmd, ComputePipeline, Gpu, IndexType, Resource, Result};

/// Faces of a piece.
pub const PIECE: u32 = 512;
/// Faces before a piece that are simulated first. In a grid of 45,000 faces in strips of 4 to 300 quads, 64 faces
/// always gave the right cache; in strips of 6 quads, 32 faces never gave it. 128 faces leave a factor of 2.
pub const REPLAYED: u32 = 128;

/// Bytes of the two caches of a piece.
const CACHE_BYTES: u64 = 2 * 4 * 16;

/// Counts the misses of the faces in an index buffer.
pub struct MissCounter {
    pipeline: ComputePipeline,
    /// The caches of all pieces. The buffer grows with the number of pieces.
    caches: Buffer,
}

impl MissCounter {
    /// # Errors
    /// Out of memory.
    pub fn new(gpu: &Gpu, index: IndexType) -> Result<MissCounter> {
        let constants = [index.constant(), ("PIECE", PIECE), ("REPLAYED", REPLAYED)];
        Ok(MissCounter {
            pipeline: gpu.compute_pipeline(misses_comp::SHADER.name, &misses_comp::SHADER, &constants)?,
            caches: gpu.buffer("misses: caches", CACHE_BYTES, BufferUse::Storage)?,
        })
    }

    /// Counts the misses of `ranges`, each given by its first face and its number of faces. The cache is empty at the
    /// start of each range. `misses` has a word for each face in `indices`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn run(
        &mut self,
        gpu: &Gpu,
        cmd: &mut Cmd<'_>,
        (indices, misses): (&Buffer, &Buffer),
        ranges: &[[u32; 2]],
    ) -> Result<()> {
        let mut first_piece = 0;
        let (mut simulated, mut corrected) = (Vec::new(), Vec::new());
        for &[first, count] in ranges {
            let (range, pieces) =
                (FaceRange { first, count, first_piece, corrects: 0 }, count.div_ceil(PIECE));
            simulated.push((range, [pieces.div_ceil(misses_comp::SHADER.group[0]), 1, 1]));
            corrected.push((FaceRange { corrects: 1, ..range }, [1; 3]));
            first_piece += pieces;
        }
        let bytes = CACHE_BYTES * u64::from(first_piece);
        if bytes > self.caches.bytes() {
            self.caches = gpu.buffer("misses: caches", bytes.next_power_of_two(), BufferUse::Storage)?;
        }
        let resources = [
            (misses_comp::INDICES, Resource::Buffer(indices)),
            (misses_comp::MISSES, Resource::Buffer(misses)),
            (misses_comp::CACHES, Resource::Buffer(&self.caches)),
        ];
        cmd.dispatch_rounds(&self.pipeline, &resources, &[simulated, corrected])
    }
}
