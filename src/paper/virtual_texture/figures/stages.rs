//! Stages 2 and 3 alone, over a request image that is drawn once (for vt.dedup, vt.compact and others).

use super::common::{SceneView, pixels_of};
use crate::figure::prelude::*;
use crate::frame::{DrawList, FrameSlot, Shape, View};
use crate::math::pyramid::Pyramid;
use crate::math::splitmix::SplitMix64;
use crate::model::mesh;
use crate::paper::virtual_texture::compact::CompactPass;
use crate::paper::virtual_texture::config::{source_mesh, texture};
use crate::paper::virtual_texture::dedup::DedupPass;
use crate::paper::virtual_texture::footprint::FootprintPass;
use crate::paper::virtual_texture::visible_list::VisibleList;
use crate::paper::virtual_texture::{Config, PAPER, RequestFormat, all_needs, lacks};
use crate::texture::source::TileFormat;
use crate::vk::{BufferUse, Frame, Gpu, TexelCopy};
use std::cell::RefCell;

/// Synthetic worst case: a random tile for each pixel.
pub const NOISE: &str = "noise";

/// Scenes of vt.dedup and vt.compact.
pub const SCENES: &[&str] = &["earth/headline", "earth/oblique", "globe/africa", NOISE];

/// A device with stage 1's result.
pub struct Stage1 {
    pub gpu: Gpu,
    pub pyramid: Pyramid,
    pub footprint: FootprintPass,
    pub size: [u32; 2],
}

impl Stage1 {
    /// Draws `scene` at 1280 x 720 (quick; noise at 640 x 360) or 1920 x 1080 pixels. The request image is packed, one
    /// word per pixel, for all variants: the paper's three words are not available on every device.
    ///
    /// # Errors
    /// No device, no such scene, out of memory.
    pub fn draw(bench: &Bench, scene: &str) -> anyhow::Result<Stage1> {
        let size = pixels_of(match (bench.effort, scene) {
            (Effort::Quick, NOISE) => 360.0,
            (Effort::Quick, _) => 720.0,
            (Effort::Full, _) => 1080.0,
        });
        Stage1::draw_at(bench, scene, size)
    }

    /// As [`Stage1::draw`], at a given size.
    ///
    /// # Errors
    /// As [`Stage1::draw`].
    pub fn draw_at(bench: &Bench, scene: &str, size: [u32; 2]) -> anyhow::Result<Stage1> {
        let SceneView { scene: description, pose, .. } =
            SceneView::find(if scene == NOISE { "earth/headline" } else { scene })?;
        let pyramid =
            texture(&description)?.pyramid()?.context("a shipped scene states its texture's size")?;
        let gpu = bench.gpu_with_offered(&all_needs())?;
        let config = Config { request_format: Some(RequestFormat::Packed), ..PAPER };
        let footprint = FootprintPass::new(&gpu, &pyramid, &config, size)?;
        let stage1 = Stage1 { gpu, pyramid, footprint, size };
        if scene == NOISE {
            stage1.fill(&noise(size, &pyramid))?;
        } else {
            let shape = Shape::new(&stage1.gpu, &mesh::gpu_mesh(&source_mesh(&description)?))?;
            stage1.gpu.run_pass("footprint", |cmd| {
                stage1.footprint.draw(cmd, &DrawList::new([&shape], View::new(&pose, size), 0))
            })?;
        }
        Ok(stage1)
    }

    /// Writes the request image from the host.
    fn fill(&self, words: &[u32]) -> anyhow::Result<()> {
        let staging = self.gpu.buffer_with("request image staging", words, BufferUse::Upload)?;
        let whole = TexelCopy { offset: 0, mip: 0, layer: 0, at: [0; 2], size: self.size };
        let requests = &self.footprint.requests;
        self.gpu.run_pass("fill request image", |cmd| cmd.copy_to_image(&staging, requests, &[whole]))?;
        Ok(())
    }

    /// Why `config` cannot run here; `None` if it can.
    pub fn lacks(&self, config: &Config) -> Option<String> {
        lacks(&self.gpu, config, &self.pyramid, TileFormat::Rgba8)
    }
}

/// Stages 2 and 3 of one variant over a [`Stage1`], with its list.
pub struct Pair {
    pub name: String,
    pub config: Config,
    dedup: DedupPass,
    compact: CompactPass,
    list: RefCell<VisibleList>,
}

impl Pair {
    /// # Errors
    /// Why the variant does not run here.
    pub fn new(stage1: &Stage1, name: &str, config: Config) -> Result<Pair, String> {
        if let Some(why) = stage1.lacks(&config) {
            return Err(why);
        }
        let (gpu, pyramid) = (&stage1.gpu, &stage1.pyramid);
        let make = || {
            let dedup = DedupPass::new(gpu, pyramid, &config, &stage1.footprint)?;
            let compact = CompactPass::new(gpu, pyramid, &config)?;
            let list = RefCell::new(compact.list(gpu, u64::from(config.list_capacity))?);
            Ok(Pair { name: name.to_string(), config, dedup, compact, list })
        };
        make().map_err(|error: crate::vk::Error| error.to_string())
    }

    fn record(&self, stage1: &Stage1, frame: &mut Frame<'_>) -> crate::vk::Result<()> {
        frame.pass("dedup", |cmd| self.dedup.run(cmd, &stage1.footprint.requests, FrameSlot::FIRST))?;
        self.compact(frame)
    }

    fn compact(&self, frame: &mut Frame<'_>) -> crate::vk::Result<()> {
        frame.pass("compact", |cmd| self.list.borrow().compact(cmd, self.dedup.mask(FrameSlot::FIRST)))
    }

    /// A contender of both stages.
    pub fn contender<'a>(&'a self, stage1: &'a Stage1) -> Contender<'a> {
        Contender::frame(&stage1.gpu, &*self.name, |frame| self.record(stage1, frame))
    }

    /// A contender of stage 3 alone, over the mask of the last [`Pair::triples`].
    pub fn compaction<'a>(&'a self, stage1: &'a Stage1, name: &str) -> Contender<'a> {
        Contender::frame(&stage1.gpu, name, |frame| self.compact(frame))
    }

    /// The list as the device made it.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn triples(&self, stage1: &Stage1) -> anyhow::Result<Vec<[u32; 3]>> {
        let mut frame = stage1.gpu.frame()?;
        self.record(stage1, &mut frame)?;
        let mut list = self.list.borrow_mut();
        frame.pass("read-back", |cmd| list.read_back(cmd))?;
        frame.submit()?.wait()?;
        Ok(self.compact.collect(&stage1.gpu, self.dedup.mask(FrameSlot::FIRST), &mut list)?.0)
    }
}

/// Packed random triples, the same in every run: any streamed level, any cell of level 0's grid.
fn noise(size: [u32; 2], pyramid: &Pyramid) -> Vec<u32> {
    let [columns, rows] = pyramid.tile_grid(0).map(u64::from);
    let levels = u64::from(pyramid.first_resident_level());
    let word = |pixel: u64| {
        let hash = SplitMix64::nth(0, pixel);
        let (q, i, j) = ((hash >> 48) % levels, (hash >> 24) % rows, hash % columns);
        ((q * rows + i) * columns + j) as u32
    };
    (0..u64::from(size[0]) * u64::from(size[1])).map(word).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn noise_covers_all_streamed_levels_and_is_nearly_all_distinct() {
        let pyramid = Pyramid::new(18, 17, 9, 4, None).unwrap();
        let words = noise([320, 180], &pyramid);
        let distinct: BTreeSet<u32> = words.iter().copied().collect();
        // 57,600 random draws of 9 x 131,072: 2.4 % repeat an earlier one.
        assert!(distinct.len() > 55_000, "{}", distinct.len());
        let levels: BTreeSet<u32> = words.iter().map(|word| word >> 17).collect();
        assert_eq!(levels, (0..9).collect());
    }
}
