//! Renders all surfaces of a scene in one frame. First, progressive meshes change to their levels. Then surfaces
//! without a virtual texture are drawn. Surfaces with a virtual texture come last, so that texels hidden by another
//! surface request no tile.

use super::RenderError;
use super::plain::PlainSurfaces;
use crate::frame::{
    Allocations, DrawList, FrameSlot, Onto, PerFrame, Progress, Shape, Target, Technique, View,
};
use crate::math::camera::Pose;
use crate::math::light::LightColours;
use crate::paper::progressive_mesh::technique::SURFACES;
use crate::paper::progressive_mesh::{self, ProgressiveMeshes};
use crate::paper::virtual_texture::technique::MESH;
use crate::paper::virtual_texture::{self, VirtualTexture};
use crate::scene::Scene;
use crate::vk::{Frame, Gpu, Need, PassTime};
use glam::DVec3;

/// The techniques of a scene's surfaces.
pub struct Surfaces {
    pub meshes: Option<ProgressiveMeshes>,
    pub plain: Option<PlainSurfaces>,
    pub texture: Option<VirtualTexture>,
    /// The surfaces with the virtual texture: first the surface whose table contains the texture, then the others by
    /// name.
    pub carriers: Vec<Carrier>,
    /// Linear light where no surface is visible.
    pub background: [f32; 3],
    /// Unit vector towards the sun, in world space.
    pub sun: DVec3,
    /// The camera used for levels and streaming, if it is not the rendering camera.
    pub frozen: Option<Pose>,
    /// Numbers of the frames in flight.
    pub frames: PerFrame<u64>,
}

/// The pass of surfaces with a plain texture or none.
const PLAIN: &str = "plain";

/// A surface with the virtual texture.
pub struct Carrier {
    pub name: String,
    /// `None`: a progressive mesh, whose shape changes from frame to frame.
    pub shape: Option<Shape>,
    pub lit: bool,
}

/// One frame of all surfaces.
#[derive(Clone, Debug)]
pub struct Record {
    pub frame: u64,
    /// Times of all passes of the frame.
    pub passes: Vec<PassTime>,
    pub meshes: Option<progressive_mesh::MeshFrameRecord>,
    pub texture: Option<virtual_texture::TextureFrameRecord>,
}

impl Surfaces {
    /// A surface's shape in this frame: its own shape, or the shape of the progressive mesh `name`.
    fn shape(&self, name: &str, own: &Option<Shape>) -> Option<Shape> {
        own.clone().or_else(|| self.meshes.as_ref()?.shape(name))
    }

    /// The passes in order, each with its surfaces.
    pub fn passes_by_surface(&self) -> Vec<(&'static str, Vec<&str>)> {
        let carriers = || self.carriers.iter().map(|carrier| &*carrier.name);
        let plain = || self.plain.iter().flat_map(|plain| &plain.surfaces).map(|surface| &*surface.name);
        let meshes = || self.meshes.iter().flat_map(|meshes| &meshes.surfaces).map(|surface| &*surface.name);
        let textured: Vec<&str> = carriers().chain(plain()).collect();
        let mut found = Vec::new();
        for pass in self.meshes.iter().flat_map(Technique::passes) {
            let is_for = |name: &&str| pass != SURFACES || !textured.contains(name);
            found.push((pass, meshes().filter(is_for).collect()));
        }
        found.extend(self.plain.iter().map(|_| (PLAIN, plain().collect())));
        let of_texture = self.texture.iter().flat_map(Technique::passes);
        found.extend(of_texture.map(|pass| (pass, carriers().collect())));
        found
    }

    /// The shapes with the virtual texture in this frame.
    fn carrying(&self) -> Vec<Shape> {
        self.carriers.iter().filter_map(|Carrier { name, shape, .. }| self.shape(name, shape)).collect()
    }

    /// The shapes with a plain texture in this frame, by index in [`PlainSurfaces::surfaces`].
    pub(super) fn plain_shapes(&self) -> Vec<(usize, Shape)> {
        let surfaces = self.plain.iter().flat_map(|plain| &plain.surfaces).enumerate();
        surfaces.filter_map(|(n, one)| Some((n, self.shape(&one.name, &one.shape)?))).collect()
    }

    /// How the pass of plain surfaces, and the virtual texture's passes, treat the target's content.
    fn onto(&self) -> [Onto; 2] {
        let drawn = self.meshes.as_ref().is_some_and(ProgressiveMeshes::draws);
        let onto = |drawn| if drawn { Onto::Drawn } else { Onto::Cleared(self.background) };
        [onto(drawn), onto(drawn || self.plain.is_some())]
    }

    /// True if a surface has a relief.
    pub fn has_reliefs(&self) -> bool {
        self.plain.iter().flat_map(|plain| &plain.surfaces).any(|surface| surface.relief.is_some())
    }

    /// Returns a function that ends all simulated delays in loads of tiles (`disk.delay_ms`). It is called before a
    /// renderer with unfinished loads is dropped.
    pub fn end_waits(&self) -> impl FnOnce() + Send + use<> {
        let source = self.texture.as_ref().map(|texture| texture.source.clone());
        move || source.iter().for_each(|source| source.stop_waiting())
    }

    /// The light of the scene, if a surface with the virtual texture is lit.
    pub(super) fn light(&self, scene: &Scene) -> Option<LightColours> {
        self.carriers.iter().any(|carrier| carrier.lit).then(|| scene.light_colours())
    }

    /// The surface under which the texture's memory is counted: the first surface that carries the texture.
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
        self.passes_by_surface().into_iter().map(|(pass, _)| pass).collect()
    }

    fn retire(&mut self, gpu: &Gpu, slot: FrameSlot, passes: Vec<PassTime>) -> Result<Record, RenderError> {
        let meshes =
            self.meshes.as_mut().map(|meshes| meshes.retire(gpu, slot, passes.clone())).transpose()?;
        let texture =
            self.texture.as_mut().map(|texture| texture.retire(gpu, slot, passes.clone())).transpose()?;
        Ok(Record { frame: self.frames[slot], passes, meshes, texture })
    }

    fn prepare(&mut self, gpu: &Gpu, view: &View) -> Result<(), RenderError> {
        self.frames[view.slot()] = view.frame;
        if let Some(meshes) = &mut self.meshes {
            meshes.onto = Onto::Cleared(self.background);
            let pose = self.frozen.unwrap_or(view.pose);
            meshes.prepare(gpu, &View { pose, ..*view })?;
        }
        let ([_, onto], shapes) = (self.onto(), self.carrying());
        if let Some(texture) = &mut self.texture {
            (texture.onto, texture.shapes) = (onto, shapes);
            texture.frozen = self.frozen.is_some();
            texture.prepare(gpu, view)?;
        }
        Ok(())
    }

    fn record(&mut self, frame: &mut Frame<'_>, view: &View, target: &Target) -> Result<(), RenderError> {
        if let Some(meshes) = &mut self.meshes {
            meshes.record(frame, view, target)?;
        }
        if let Some(plain) = &self.plain {
            let ([onto, _], shapes) = (self.onto(), self.plain_shapes());
            let seen = |shape| DrawList::lit([shape], *view, 0, self.sun);
            frame.pass(PLAIN, |cmd| plain.draw(cmd, target, onto, &shapes, seen))?;
        }
        if let Some(texture) = &mut self.texture {
            texture.record(frame, view, target)?;
        }
        Ok(())
    }

    fn resize(&mut self, gpu: &Gpu, target: &Target) -> Result<(), RenderError> {
        // The texture is resized first: if this fails, the meshes are unchanged.
        if let Some(texture) = &mut self.texture {
            texture.resize(gpu, target)?;
        }
        if let Some(meshes) = &mut self.meshes {
            meshes.resize(gpu, target)?;
        }
        Ok(())
    }

    fn lift_budgets(&mut self, lifted: bool) {
        self.texture.iter_mut().for_each(|texture| texture.lift_budgets(lifted));
    }

    fn progress(&self) -> Progress {
        let meshes = self.meshes.as_ref().map_or(Progress::Settled, Technique::progress);
        match meshes {
            Progress::Settled => self.texture.as_ref().map_or(Progress::Settled, Technique::progress),
            moving => moving,
        }
    }

    /// Bytes by surface and object, such as `land: tile pool`.
    fn memory(&self) -> Allocations {
        let meshes = self.meshes.iter().flat_map(Technique::memory);
        let owner = self.texture_owner();
        // Each carrier's mesh is counted under the carrier's name.
        let texture = self.texture.iter().flat_map(Technique::memory).filter(|(name, _)| name != MESH);
        let texture = texture.map(|(name, bytes)| (format!("{owner}: {name}"), bytes));
        let own = |carrier: &Carrier| {
            let bytes = carrier.shape.as_ref()?.bytes();
            Some((format!("{}: mesh", carrier.name), bytes))
        };
        let plain = self.plain.iter().flat_map(PlainSurfaces::memory);
        meshes.chain(plain).chain(texture).chain(self.carriers.iter().filter_map(own)).collect()
    }
}
