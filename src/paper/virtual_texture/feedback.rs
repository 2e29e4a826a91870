//! Subsampled feedback, which engines ship instead of the exact list. Each frame samples one pixel of each block of 2^n
//! pixels, a different one every frame. The host lists the sampled tiles.
//!
//! Sources: Unreal Engine 5 samples one pixel of 16 x 16, in bit-reversed order along a Morton curve. Call of Duty
//! samples one of 8 x 8 (Hooker, GDC 2021), and Gaia Sky one of 8 x 8 without jitter. As in these engines, a tile stays
//! requested until its pixel is sampled again. So the list is the union of the last 2^n frames. This is the shortest
//! history that is complete for a camera at rest. Difference: samples are read from the full-resolution request image,
//! so each sample is exact. The engines' request budgets are left out; the upload and load budgets apply.
//!
//! A frame's samples are a subset of its exact set. The history of a moving camera also holds tiles that have left the
//! picture.

use super::RequestFormat;
use crate::math::pyramid::TileId;
use crate::vk::shader::Sampling;
use crate::vk::shader::virtual_texture::feedback_comp;
use crate::vk::{
    Buffer, BufferUse, Cmd, ComputePipeline, Gpu, Image, MappedValues, ReadAs, Resource, Result,
};
use std::collections::BTreeMap;

/// Largest n: one pixel of 256, as in Unreal Engine 5.
pub const MAX_LOG2: u32 = 8;

/// Width and height of a block of 2^n pixels, as log2: square, or twice as wide as high.
pub fn block_log2(n: u32) -> [u32; 2] {
    [n.div_ceil(2), n / 2]
}

/// Number of frames until every pixel has been sampled.
pub fn cycle(n: u32) -> u64 {
    1 << n
}

/// The pixel of every block that frame `frame` samples. The frame's number in its cycle, with its bits reversed, is the
/// index on the block's Morton curve. Frames half a cycle apart sample neighbours; successive frames sample pixels half
/// a block apart.
pub fn offset(n: u32, frame: u64) -> [u32; 2] {
    let place = match n {
        0 => 0,
        n => ((frame % cycle(n)) as u32).reverse_bits() >> (32 - n),
    };
    let every_second = |first: u32| {
        (first..n).step_by(2).enumerate().fold(0, |all, (to, from)| all | (place >> from & 1) << to)
    };
    [every_second(0), every_second(1)]
}

/// Columns and rows of blocks of 2^n pixels. Blocks at the right and at the bottom may extend beyond the picture.
pub fn blocks(n: u32, size: [u32; 2]) -> [u32; 2] {
    let [width_log2, height_log2] = block_log2(n);
    [size[0].div_ceil(1 << width_log2), size[1].div_ceil(1 << height_log2)]
}

/// The pass that gathers a frame's samples.
pub struct Feedback {
    pipeline: ComputePipeline,
    n: u32,
    words: u64,
}

/// A frame's samples, on the device and on the host.
pub struct Samples {
    device: Buffer,
    host: Buffer,
}

impl Feedback {
    /// # Errors
    /// The driver cannot compile the shader.
    pub fn new(gpu: &Gpu, format: RequestFormat, n: u32) -> Result<Feedback> {
        assert!(n <= MAX_LOG2, "one pixel of 2^{n}");
        let shader = &feedback_comp::SHADER;
        let words = format.words();
        let pipeline = gpu.compute_pipeline(shader.name, shader, &[("REQUEST_WORDS", words as u32)])?;
        Ok(Feedback { pipeline, n, words: words as u64 })
    }

    /// Creates the buffers for the samples of a picture of `size`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn samples(&self, gpu: &Gpu, size: [u32; 2]) -> Result<Samples> {
        let bytes = blocks(self.n, size).map(u64::from).iter().product::<u64>() * 4 * self.words;
        Ok(Samples {
            device: gpu.buffer("feedback", bytes, BufferUse::Storage)?,
            host: gpu.buffer("feedback on the host", bytes, BufferUse::Readback)?,
        })
    }

    /// Gathers the samples that frame `frame` takes from `requests`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn run(&self, cmd: &mut Cmd<'_>, requests: &Image, samples: &Samples, frame: u64) -> Result<()> {
        let blocks = blocks(self.n, requests.info().size);
        let push = Sampling { block_log2: block_log2(self.n), offset: offset(self.n, frame), blocks };
        let resources = [
            (feedback_comp::REQUESTS, Resource::Texture(requests, ReadAs::Whole)),
            (feedback_comp::SAMPLES, Resource::Buffer(&samples.device)),
        ];
        let [wide, high, _] = feedback_comp::SHADER.group;
        let [columns, rows] = [blocks[0].div_ceil(wide), blocks[1].div_ceil(high)];
        cmd.dispatch(&self.pipeline, &resources, bytemuck::bytes_of(&push), [columns, rows, 1])
    }
}

impl Samples {
    /// Copies the samples to the host buffer.
    pub fn read_back(&self, cmd: &mut Cmd<'_>) {
        cmd.copy_buffer(&self.device, 0, &self.host, 0, self.device.bytes());
    }

    /// The samples in the request image's format, once the frame has ended. Pixels outside the picture are background.
    pub fn words(&self) -> MappedValues<'_, u32> {
        self.host.mapped()
    }

    /// Bytes on the device, and on the host.
    pub fn bytes(&self) -> [u64; 2] {
        [self.device.bytes(), self.host.bytes()]
    }
}

/// The union of the tiles seen in the last frames.
#[derive(Clone, Debug)]
pub struct SampleHistory {
    frames: u64,
    now: u64,
    /// The frame in which each tile was last seen.
    seen: BTreeMap<TileId, u64>,
}

impl SampleHistory {
    /// A memory of the last `frames` frames (at least one), the current frame included.
    pub fn new(frames: u64) -> SampleHistory {
        assert!(frames > 0, "a memory of no frame");
        SampleHistory { frames, now: 0, seen: BTreeMap::new() }
    }

    /// Number of frames that are remembered.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Adds a frame's tiles; returns all remembered tiles, in the order of [`TileId`].
    pub fn add(&mut self, tiles: &[TileId]) -> Vec<TileId> {
        self.now += 1;
        self.seen.extend(tiles.iter().map(|&tile| (tile, self.now)));
        let (now, frames) = (self.now, self.frames);
        self.seen.retain(|_, last| *last + frames > now);
        self.seen.keys().copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn a_cycle_samples_every_pixel_of_a_block_once() {
        for n in 0..=MAX_LOG2 {
            let [width, height] = block_log2(n).map(|log2| 1 << log2);
            let sampled: BTreeSet<_> = (0..cycle(n)).map(|frame| offset(n, frame)).collect();
            let block: BTreeSet<_> = (0..width).flat_map(|x| (0..height).map(move |y| [x, y])).collect();
            assert_eq!(sampled, block, "n = {n}");
            assert_eq!(offset(n, 3), offset(n, 3 + cycle(n)), "n = {n}");
        }
    }

    #[test]
    fn the_first_16_frames_sample_each_4x4_part_of_a_16x16_block_once() {
        let corners: BTreeSet<_> = (0..16).map(|frame| offset(8, frame).map(|at| at / 4)).collect();
        assert_eq!(corners.len(), 16);
        assert_eq!((offset(8, 0), offset(8, 1), offset(8, 2)), ([0, 0], [0, 8], [8, 0]));
    }

    #[test]
    fn blocks_cover_a_picture_that_they_do_not_divide() {
        assert_eq!(blocks(8, [1920, 1080]), [120, 68]);
        assert_eq!(blocks(3, [5, 3]), [2, 2]);
        assert_eq!(blocks(0, [5, 3]), [5, 3]);
    }

    #[test]
    fn a_tile_is_remembered_for_the_given_number_of_frames() {
        let tile = |column| TileId { level: 0, row: 0, column };
        let mut memory = SampleHistory::new(3);
        assert_eq!(memory.add(&[tile(1), tile(0)]), [tile(0), tile(1)]);
        assert_eq!(memory.add(&[tile(1)]), [tile(0), tile(1)]);
        assert_eq!(memory.add(&[]), [tile(0), tile(1)]);
        assert_eq!(memory.add(&[]), [tile(1)], "tile 1 was seen one frame after tile 0");
        assert_eq!(memory.add(&[tile(2)]), [tile(2)]);
        assert_eq!(SampleHistory::new(1).add(&[tile(2)]), [tile(2)]);
    }
}
