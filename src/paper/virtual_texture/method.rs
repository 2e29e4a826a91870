//! The passes that find and show the tiles: stages 1, 2, 3, read-back, texturing; or, where the variant is fused, one
//! draw that does the work of stages 1, 2 and of texturing.

use super::lister::{Collected, Lister, Stage3};
use super::{Config, footprint::Footprint, fused::Fused, resident::Resident, texturing::Texturing};
use crate::frame::{Seen, Slot, Target};
use crate::math::light::LightColours;
use crate::math::pyramid::Pyramid;
use crate::vk::{Depth, Frame, Gpu, Result};

/// A variant's passes, with the room that each frame in flight has in them.
pub enum Method {
    /// Stage 1 and, after the list, texturing from `U1`.
    Staged {
        stage1: Box<Footprint>,
        lister: Lister,
        texturing: Box<Texturing>,
    },
    Fused {
        draw: Box<Fused>,
        stage3: Box<Stage3>,
    },
}

impl Method {
    /// `lit`: by what some shapes are lit.
    ///
    /// # Errors
    /// A format, a limit or memory that the device lacks.
    pub fn new(
        gpu: &Gpu,
        pyramid: &Pyramid,
        config: &Config,
        resident: &Resident,
        target: &Target,
        lit: Option<LightColours>,
    ) -> Result<Method> {
        let shown = (target.color.info().format, lit);
        if config.fused() {
            let draw = Box::new(Fused::new(gpu, pyramid, config, resident, shown)?);
            let stage3 = Box::new(Stage3::new(gpu, pyramid, config)?);
            return Ok(Method::Fused { draw, stage3 });
        }
        let depth = (target.depth.clone(), Depth::Write);
        let stage1 = Box::new(Footprint::on(gpu, pyramid, config, depth, 0)?);
        let lister = Lister::new(gpu, pyramid, config, &stage1)?;
        let texturing = Box::new(Texturing::new(gpu, pyramid, config, &stage1, resident, shown)?);
        Ok(Method::Staged { stage1, lister, texturing })
    }

    /// Stage 1; a fused variant has none.
    pub fn stage1(&self) -> Option<&Footprint> {
        match self {
            Method::Staged { stage1, .. } => Some(stage1),
            Method::Fused { .. } => None,
        }
    }

    /// Records the passes of the frame that `seen` is of.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        resident: &Resident,
        seen: &Seen<'_>,
        target: &Target,
    ) -> Result<()> {
        let slot = seen.view.slot();
        match self {
            Method::Staged { stage1, lister, texturing } => {
                frame.pass("footprint", |cmd| stage1.draw(cmd, seen))?;
                lister.record(frame, &stage1.u1, slot)?;
                frame.pass("texturing", |cmd| texturing.draw(cmd, stage1, resident, seen, &target.color))
            }
            Method::Fused { draw, stage3 } => {
                let images = (&*target.color, &*target.depth);
                frame.pass("fused", |cmd| draw.draw(cmd, resident, seen, stage3.room(slot), images))?;
                stage3.record(frame, slot)
            }
        }
    }

    /// Labels of the passes, in order.
    pub fn passes(&self) -> Vec<&'static str> {
        match self {
            Method::Staged { lister, .. } => [vec!["footprint"], lister.passes(), vec!["texturing"]].concat(),
            Method::Fused { stage3, .. } => [vec!["fused"], stage3.passes()].concat(),
        }
    }

    /// The list of the frame in `slot`, which has ended.
    ///
    /// # Errors
    /// Out of memory, device lost.
    pub fn collect(&mut self, gpu: &Gpu, slot: Slot) -> Result<Collected> {
        match self {
            Method::Staged { lister, .. } => lister.collect(gpu, slot),
            Method::Fused { stage3, .. } => stage3.collect(gpu, slot),
        }
    }

    /// (name, bytes); on the device where the name does not say otherwise.
    pub fn memory(&self) -> Vec<(&'static str, u64)> {
        match self {
            Method::Staged { stage1, lister, .. } => {
                [vec![("U1", stage1.u1.bytes())], lister.memory()].concat()
            }
            Method::Fused { stage3, .. } => stage3.memory(),
        }
    }
}
