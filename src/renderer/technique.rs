//! All surfaces of a scene in one frame: progressive meshes are brought to their levels; those without a virtual texture
//! are drawn; then what carries the texture is, over what is there, so that a texel which another surface hides asks
//! for no tile.

use super::RenderError;
use crate::frame::{Memory, Onto, Progress, Shape, Slot, Target, Technique, View};
use crate::paper::progressive_mesh::{self, ProgressiveMeshes};
use crate::paper::virtual_texture::technique::MESH;
use crate::paper::virtual_texture::{self, VirtualTexture};
use crate::vk::{Frame, Gpu, Need, PassTime};

/// What the surfaces of a scene ask for, and nothing else.
pub struct Surfaces {
    pub meshes: Option<ProgressiveMeshes>,
    pub texture: Option<VirtualTexture>,
    /// The surfaces that carry the texture, by name.
    pub carriers: Vec<Carrier>,
    /// Linear light of what no surface covers.
    pub background: [f32; 3],
}

/// A surface that carries the virtual texture.
pub struct Carrier {
    pub name: String,
    /// `None`: a progressive mesh, whose shape is another one in each frame.
    pub shape: Option<Shape>,
}

/// One frame of all surfaces.
#[derive(Clone, Debug)]
pub struct Record {
    pub frame: u64,
    /// Of the whole frame.
    pub passes: Vec<PassTime>,
    pub meshes: Option<progressive_mesh::FrameRecord>,
    pub texture: Option<virtual_texture::FrameRecord>,
}

impl Surfaces {
    /// What carries the texture in this frame.
    fn shapes(&self) -> Vec<Shape> {
        let of = |carrier: &Carrier| match &carrier.shape {
            Some(shape) => Some(shape.clone()),
            None => self.meshes.as_ref().and_then(|meshes| meshes.shape(&carrier.name)),
        };
        self.carriers.iter().filter_map(of).collect()
    }

    /// The surface that the texture's own memory is counted under: the first that carries it.
    fn texture_owner(&self) -> &str {
        self.carriers.first().map_or("texture", |carrier| &carrier.name)
    }
}

impl Technique for Surfaces {
    type Record = Record;
    type Error = RenderError;

    fn needs(&self) -> Vec<Need> {
        let meshes = self.meshes.iter().flat_map(Technique::needs);
        meshes.chain(self.texture.iter().flat_map(Technique::needs)).collect()
    }

    fn passes(&self) -> Vec<&'static str> {
        let meshes = self.meshes.iter().flat_map(Technique::passes);
        meshes.chain(self.texture.iter().flat_map(Technique::passes)).collect()
    }

    fn retire(&mut self, gpu: &Gpu, slot: Slot, passes: Vec<PassTime>) -> Result<Record, RenderError> {
        let meshes =
            self.meshes.as_mut().map(|meshes| meshes.retire(gpu, slot, passes.clone())).transpose()?;
        let texture =
            self.texture.as_mut().map(|texture| texture.retire(gpu, slot, passes.clone())).transpose()?;
        let frame =
            meshes.as_ref().map(|record| record.index).or(texture.as_ref().map(|record| record.index));
        Ok(Record { frame: frame.expect("a scene has a surface"), passes, meshes, texture })
    }

    fn prepare(&mut self, gpu: &Gpu, view: &View) -> Result<(), RenderError> {
        let mut onto = Onto::Cleared(self.background);
        if let Some(meshes) = &mut self.meshes {
            meshes.onto = onto;
            meshes.prepare(gpu, view)?;
            if meshes.draws() {
                onto = Onto::Drawn;
            }
        }
        let shapes = self.shapes();
        if let Some(texture) = &mut self.texture {
            (texture.onto, texture.shapes) = (onto, shapes);
            texture.prepare(gpu, view)?;
        }
        Ok(())
    }

    fn record(&mut self, frame: &mut Frame<'_>, view: &View, target: &Target) -> Result<(), RenderError> {
        if let Some(meshes) = &mut self.meshes {
            meshes.record(frame, view, target)?;
        }
        if let Some(texture) = &mut self.texture {
            texture.record(frame, view, target)?;
        }
        Ok(())
    }

    fn resize(&mut self, gpu: &Gpu, target: &Target) -> Result<(), RenderError> {
        if let Some(meshes) = &mut self.meshes {
            meshes.resize(gpu, target)?;
        }
        if let Some(texture) = &mut self.texture {
            texture.resize(gpu, target)?;
        }
        Ok(())
    }

    fn progress(&self) -> Progress {
        self.texture.as_ref().map_or(Progress::Settled, Technique::progress)
    }

    /// By surface: `land: J1`.
    fn memory(&self) -> Memory {
        let meshes = self.meshes.iter().flat_map(Technique::memory);
        let owner = self.texture_owner();
        // Each carrier's mesh is counted under its own name.
        let texture = self.texture.iter().flat_map(Technique::memory).filter(|(name, _)| name != MESH);
        let texture = texture.map(|(name, bytes)| (format!("{owner}: {name}"), bytes));
        let own = |carrier: &Carrier| {
            let bytes = carrier.shape.as_ref()?.bytes();
            Some((format!("{}: mesh", carrier.name), bytes))
        };
        meshes.chain(texture).chain(self.carriers.iter().filter_map(own)).collect()
    }
}
