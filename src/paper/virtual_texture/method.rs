//! The passes that find and show the tiles: stages 1, 2, 3, read-back and texturing. In a fused variant, one draw does
//! the work of stages 1, 2 and texturing. With [`super::choices::RequestDraw::Texturing`] it does the work of stage 1
//! and texturing. Either draw is the pass "fused".

use super::list_passes::{Collected, ListPasses, Stage3};
use super::{Config, footprint::FootprintPass, fused::Fused, texturing::Texturing, tile_pool::TilePool};
use crate::frame::{DrawList, FrameSlot, Target};
use crate::math::light::LightColours;
use crate::math::pyramid::Pyramid;
use crate::vk::{Cmd, Depth, Frame, Gpu, Result};

/// A variant's passes and their buffers for each frame in flight.
pub enum ListAndDraw {
    /// Stage 1, the list passes, and texturing from the request image; or texturing that writes the request image, and
    /// the list passes.
    Staged {
        stage1: Box<FootprintPass>,
        list_passes: ListPasses,
        texturing: Box<Texturing>,
    },
    Fused {
        draw: Box<Fused>,
        stage3: Box<Stage3>,
    },
}

impl ListAndDraw {
    /// Creates the passes. `lit`: the light, if some shapes are lit.
    ///
    /// # Errors
    /// A missing format or a limit of the device; out of memory.
    pub fn new(
        gpu: &Gpu,
        pyramid: &Pyramid,
        config: &Config,
        resident: &TilePool,
        target: &Target,
        lit: Option<LightColours>,
    ) -> Result<ListAndDraw> {
        let shown = (target.color.info().format, lit);
        if config.fused() {
            let draw = Box::new(Fused::new(gpu, pyramid, config, resident, shown)?);
            let stage3 = Box::new(Stage3::new(gpu, pyramid, config)?);
            return Ok(ListAndDraw::Fused { draw, stage3 });
        }
        let depth = (target.depth.clone(), Depth::Write);
        let stage1 = Box::new(FootprintPass::on(gpu, pyramid, config, depth, 0)?);
        let list_passes = ListPasses::new(gpu, pyramid, config, &stage1)?;
        let texturing = Box::new(Texturing::new(gpu, pyramid, config, &stage1, resident, shown)?);
        Ok(ListAndDraw::Staged { stage1, list_passes, texturing })
    }

    /// Stage 1, which draws the request image; `None` for fused variants.
    pub fn stage1(&self) -> Option<&FootprintPass> {
        match self {
            ListAndDraw::Staged { stage1, .. } => Some(stage1),
            ListAndDraw::Fused { .. } => None,
        }
    }

    /// Records the passes of the frame that draws `seen`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        resident: &TilePool,
        seen: &DrawList<'_>,
        target: &Target,
    ) -> Result<()> {
        let slot = seen.view.slot();
        match self {
            ListAndDraw::Staged { stage1, list_passes, texturing } => {
                let picture = |cmd: &mut Cmd<'_>| texturing.draw(cmd, stage1, resident, seen, &target.color);
                if texturing.writes_requests {
                    frame.pass("fused", picture)?;
                    return list_passes.record(frame, &stage1.requests, slot);
                }
                frame.pass("footprint", |cmd| stage1.draw(cmd, seen))?;
                list_passes.record(frame, &stage1.requests, slot)?;
                frame.pass("texturing", picture)
            }
            ListAndDraw::Fused { draw, stage3 } => {
                let images = (&*target.color, &*target.depth);
                frame.pass("fused", |cmd| draw.draw(cmd, resident, seen, stage3.list(slot), images))?;
                stage3.record(frame, slot, draw.mask(slot))
            }
        }
    }

    /// Labels of the passes, in order.
    pub fn passes(&self) -> Vec<&'static str> {
        match self {
            ListAndDraw::Staged { list_passes, texturing, .. } if texturing.writes_requests => {
                [vec!["fused"], list_passes.passes()].concat()
            }
            ListAndDraw::Staged { list_passes, .. } => {
                [vec!["footprint"], list_passes.passes(), vec!["texturing"]].concat()
            }
            ListAndDraw::Fused { stage3, .. } => [vec!["fused"], stage3.passes()].concat(),
        }
    }

    /// The list of the frame in `slot`, which has ended.
    ///
    /// # Errors
    /// Out of memory, device lost.
    pub fn collect(&mut self, gpu: &Gpu, slot: FrameSlot) -> Result<Collected> {
        match self {
            ListAndDraw::Staged { list_passes, .. } => list_passes.collect(gpu, slot),
            ListAndDraw::Fused { draw, stage3 } => stage3.collect(gpu, slot, draw.mask(slot)),
        }
    }

    /// (name, bytes), on the device unless the name says otherwise.
    pub fn memory(&self) -> Vec<(&'static str, u64)> {
        match self {
            ListAndDraw::Staged { stage1, list_passes, texturing } => {
                let requests = ("request image", stage1.requests.bytes());
                let map = texturing.shading.weight_table.memory();
                [requests].into_iter().chain(list_passes.memory()).chain(map).collect()
            }
            ListAndDraw::Fused { draw, stage3 } => {
                let map = draw.shading.weight_table.memory();
                stage3.memory(draw.mask_bytes()).into_iter().chain(map).collect()
            }
        }
    }
}
