//! Paper 2's part of a frame. The technique brings every visible instance to the level for its distance and updates the
//! index buffers. Then it draws all instances, or passes them as shapes to the technique that textures them.
//!
//! Vertices are shaded as in a plain renderer: the shaders do not depend on levels. The exception is
//! geomorphing, where new vertices move to their positions: see [`vertices`](super::surface::vertices).

use super::config::ProgressiveMeshSettings;
use super::governor::{Budget, Governor};
use super::load::LoadedMesh;
use super::record::MeshFrameRecord;
use super::surface::vertices::VertexBuffer;
use super::surface::{FrameChanges, MeshOnDevice, SurfaceError};
use crate::frame::{
    Allocations, FrameSlot, Onto, PerFrame, Progress, Records, Run, Shape, Target, Technique, View,
};
use crate::math::camera::Pose;
use crate::math::light::LightColours;
use crate::picture;
use crate::vk::shader::Shader;
use crate::vk::shader::progressive_mesh::{geomorph_vert, surface_frag, surface_vert};
use crate::vk::{
    Buffer, BufferUse, Cmd, ColorTarget, Depth, DepthTarget, Frame, Gpu, GraphicsInfo, GraphicsPipeline,
    IndexedGeometry, Need, PassTime, Resource, Result,
};
use glam::DVec3;
use std::time::Instant;

/// The pass that changes levels.
const LEVELS: &str = "levels";
const COMPACT: &str = "compact";
/// The pass that draws the untextured surfaces.
pub const SURFACES: &str = "surfaces";

/// The pipeline of the drawing pass, with one of its two vertex shaders.
///
/// # Errors
/// The driver's compiler fails.
pub fn surfaces_pipeline(
    gpu: &Gpu,
    vertex: &'static Shader,
    target: picture::PixelFormat,
    (vertex_work, light): (u32, LightColours),
) -> Result<GraphicsPipeline> {
    gpu.graphics_pipeline(&GraphicsInfo {
        name: "surfaces",
        specialization: &[&[("VERTEX_WORK", vertex_work)][..], &light.constants()].concat(),
        depth: Some(Depth::Write),
        colors: &[target.into()],
        ..GraphicsInfo::triangles(vertex, &surface_frag::SHADER)
    })
}

/// Paper 2's technique: progressive meshes, each with any number of instances.
pub struct ProgressiveMeshes {
    pub settings: ProgressiveMeshSettings,
    pub surfaces: Vec<MeshOnDevice>,
    pub onto: Onto,
    plain: Option<GraphicsPipeline>,
    geomorph: Option<GraphicsPipeline>,
    copies: Copies,
    staging: PerFrame<Buffer>,
    pending: PerFrame<Option<MeshFrameRecord>>,
    governor: Option<Governor>,
    /// If set, the next frame draws nothing and brings this instance of the first surface to this level.
    only: Option<(usize, u32)>,
}

/// The bytes that a frame uploads, and their destination: (surface, offset there, bytes).
#[derive(Default)]
struct Copies {
    bytes: Vec<u8>,
    parts: Vec<(usize, u64, u64)>,
}

impl ProgressiveMeshes {
    /// # Errors
    /// A missing device feature, or an invalid mesh.
    pub fn new(
        gpu: &Gpu,
        models: &[LoadedMesh],
        settings: ProgressiveMeshSettings,
    ) -> std::result::Result<ProgressiveMeshes, SurfaceError> {
        let surfaces = models
            .iter()
            .map(|model| MeshOnDevice::new(gpu, model))
            .collect::<std::result::Result<Vec<_>, _>>()?;
        let of = (settings.vertex_work, settings.light);
        let pipeline = |vertex: &'static Shader| surfaces_pipeline(gpu, vertex, settings.target, of);
        let any =
            |wanted: fn(&VertexBuffer) -> bool| surfaces.iter().any(|surface| wanted(&surface.vertices));
        let plain = any(|vertices| matches!(vertices, VertexBuffer::Plain(_)));
        let geomorph = any(|vertices| matches!(vertices, VertexBuffer::Morph(_)));
        Ok(ProgressiveMeshes {
            plain: plain.then(|| pipeline(&surface_vert::SHADER)).transpose()?,
            geomorph: geomorph.then(|| pipeline(&geomorph_vert::SHADER)).transpose()?,
            copies: Copies::default(),
            staging: PerFrame::new(|| gpu.buffer("levels: staging", 0, BufferUse::Upload))?,
            pending: PerFrame::default(),
            governor: settings.budget.map(|budget| Governor::new(budget, settings.rule)),
            only: None,
            onto: Onto::Cleared(settings.background),
            surfaces,
            settings,
        })
    }

    /// A run that draws only these meshes.
    ///
    /// # Errors
    /// As [`ProgressiveMeshes::new`].
    pub fn run(
        gpu: Gpu,
        models: &[LoadedMesh],
        settings: ProgressiveMeshSettings,
    ) -> std::result::Result<Run<ProgressiveMeshes>, SurfaceError> {
        let technique = ProgressiveMeshes::new(&gpu, models, settings)?;
        let target = Target::new(&gpu, settings.size, settings.target)?;
        let mut run = Run::new(gpu, technique, target);
        run.keep(Records::all());
        Ok(run)
    }

    /// True if this technique draws pixels itself, because no other technique textures one of the surfaces.
    pub fn draws(&self) -> bool {
        self.plain.is_some() || self.geomorph.is_some()
    }

    /// The shape of surface `name` for the technique that textures it, as of the last prepared frame. `None` if there
    /// is no such surface, or if this technique draws the surface itself.
    pub fn shape(&self, name: &str) -> Option<Shape> {
        self.surfaces.iter().find(|surface| surface.name == name)?.shape()
    }

    /// Sets the governor's budget; `None`: no governor.
    pub fn set_budget(&mut self, budget: Option<Budget>) {
        if budget != self.settings.budget {
            self.governor = budget.map(|budget| Governor::new(budget, self.settings.rule));
            self.settings.budget = budget;
        }
    }

    /// The governor's factor on all errors for this frame.
    fn plan(&mut self) -> f64 {
        let Some(governor) = &mut self.governor else { return 1.0 };
        governor.plan(|factor| self.surfaces.iter().map(|surface| surface.live_faces(factor)).sum())
    }

    /// Brings all instances to their levels. Returns the change and the governor's factor.
    fn choose_levels(&mut self, gpu: &Gpu, view: &View) -> Result<(FrameChanges, f64)> {
        let Self { surfaces, copies, .. } = self;
        if let Some(level) = self.only {
            let mut upload = |bytes: &[u8], at| copies.add(0, bytes, at);
            return Ok((surfaces[0].go_to(gpu, view.slot(), level, &mut upload)?, 1.0));
        }
        self.surfaces.iter_mut().for_each(|surface| surface.follow(view));
        let error_factor = self.plan();
        let Self { surfaces, copies, .. } = self;
        let mut change = FrameChanges::default();
        for (n, surface) in surfaces.iter_mut().enumerate() {
            let mut upload = |bytes: &[u8], at| copies.add(n, bytes, at);
            change += surface.go(gpu, view.slot(), error_factor, &mut upload)?;
        }
        Ok((change, error_factor))
    }

    /// Uploads the level changes, or executes them on the device.
    fn record_levels(&self, cmd: &mut Cmd<'_>, slot: FrameSlot) -> Result<()> {
        let mut from = 0;
        for (n, surface) in self.surfaces.iter().enumerate() {
            let mut ranges = Vec::new();
            for &(_, at, bytes) in self.copies.parts.iter().filter(|(surface, ..)| *surface == n) {
                ranges.push([from, at, bytes]);
                from += bytes;
            }
            surface.record(cmd, &self.staging[slot], &ranges)?;
        }
        Ok(())
    }

    fn draw(&self, cmd: &mut Cmd<'_>, view: &View, target: &Target) -> Result<()> {
        let color = ColorTarget { image: &target.color, clear: self.onto.clear() };
        let depth = DepthTarget { image: &target.depth, clear: self.onto != Onto::Drawn };
        cmd.render(view.size, &[color], Some(depth), |render| {
            for surface in &self.surfaces {
                let (pipeline, resources, vertices) = match &surface.vertices {
                    VertexBuffer::Plain(buffer) => (&self.plain, vec![], Some(buffer)),
                    VertexBuffer::Morph(buffer) => {
                        (&self.geomorph, vec![(geomorph_vert::MORPH, Resource::Buffer(buffer))], None)
                    }
                    VertexBuffer::Textured { .. } => continue,
                };
                let pipeline = pipeline.as_ref().expect("created with the surfaces");
                let geometry = IndexedGeometry { vertices, indices: &surface.indices };
                let slices = surface.slices(&view.pose, view.size, self.settings.sun);
                render.draw_slices(pipeline, &resources, geometry, &slices)?;
            }
            Ok(())
        })
    }
}

impl Run<ProgressiveMeshes> {
    /// Renders a frame that only brings one instance of the first surface to a level, to measure the cost.
    ///
    /// # Errors
    /// As [`Run::frame`].
    pub fn change_level(&mut self, instance: usize, level: u32) -> std::result::Result<(), SurfaceError> {
        self.technique.only = Some((instance, level));
        let nowhere = Pose {
            eye: DVec3::ZERO,
            right: DVec3::X,
            up: DVec3::Z,
            forward: DVec3::Y,
            vertical_fov_rad: 1.0,
            near_m: 1.0,
            height_m: f64::INFINITY,
        };
        let done = self.frame(&nowhere);
        self.technique.only = None;
        done
    }
}

impl Technique for ProgressiveMeshes {
    type Record = MeshFrameRecord;
    type Error = SurfaceError;

    fn needs(&self) -> Vec<Need> {
        Vec::new()
    }

    /// The passes: level changes, the compaction of a baseline, and drawing.
    fn passes(&self) -> Vec<&'static str> {
        let compacts = self.surfaces.iter().any(MeshOnDevice::compacts);
        let passes = [Some(LEVELS), compacts.then_some(COMPACT), self.draws().then_some(SURFACES)];
        passes.into_iter().flatten().collect()
    }

    fn retire(
        &mut self,
        _: &Gpu,
        slot: FrameSlot,
        times: Vec<PassTime>,
    ) -> std::result::Result<MeshFrameRecord, SurfaceError> {
        let mut record = self.pending[slot].take().expect("a frame that has ended was prepared");
        record.passes = times;
        if let (Some(governor), Some(ms)) = (&mut self.governor, record.milliseconds()) {
            governor.frame_took(ms, record.change.live_faces);
        }
        Ok(record)
    }

    fn prepare(&mut self, gpu: &Gpu, view: &View) -> std::result::Result<(), SurfaceError> {
        let start = Instant::now();
        self.copies = Copies::default();
        let (change, error_factor) = self.choose_levels(gpu, view)?;
        self.copies.stage(gpu, &mut self.staging[view.slot()])?;
        self.pending[view.slot()] = Some(MeshFrameRecord {
            index: view.frame,
            change,
            host: start.elapsed(),
            error_factor,
            passes: Vec::new(),
        });
        Ok(())
    }

    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &View,
        target: &Target,
    ) -> std::result::Result<(), SurfaceError> {
        let slot = view.slot();
        frame.pass(LEVELS, |cmd| self.record_levels(cmd, slot))?;
        if self.surfaces.iter().any(MeshOnDevice::compacts) {
            frame.pass(COMPACT, |cmd| self.surfaces.iter().try_for_each(|surface| surface.compact(cmd)))?;
        }
        if self.draws() && self.only.is_none() {
            frame.pass(SURFACES, |cmd| self.draw(cmd, view, target))?;
        }
        self.surfaces.iter_mut().for_each(MeshOnDevice::recorded);
        Ok(())
    }

    fn resize(&mut self, _: &Gpu, target: &Target) -> std::result::Result<(), SurfaceError> {
        self.settings.size = target.size();
        Ok(())
    }

    fn progress(&self) -> Progress {
        match self.surfaces.iter().any(MeshOnDevice::arriving) {
            true => Progress::Arriving,
            false => Progress::Settled,
        }
    }

    /// The staging buffers grow with the uploads of a frame.
    fn memory(&self) -> Allocations {
        let of_surface = |surface: &MeshOnDevice| {
            let buffers = [("vertices", surface.vertices.bytes()), ("indices", surface.index_bytes())];
            let program = surface.program_bytes();
            let named = |(what, bytes)| (format!("{}: {what}", surface.name), bytes);
            buffers.into_iter().chain(program).map(named).collect::<Vec<_>>()
        };
        let mut memory: Vec<_> = self.surfaces.iter().flat_map(of_surface).collect();
        memory.push(("levels: staging".into(), self.staging.iter().map(Buffer::bytes).sum()));
        memory
    }
}

impl Copies {
    fn add(&mut self, surface: usize, bytes: &[u8], at: u64) {
        self.bytes.extend_from_slice(bytes);
        self.parts.push((surface, at, bytes.len() as u64));
    }

    /// Copies the bytes to the staging buffer, which grows if necessary.
    fn stage(&self, gpu: &Gpu, staging: &mut Buffer) -> Result<()> {
        let bytes = &self.bytes;
        if staging.bytes() < bytes.len() as u64 {
            *staging =
                gpu.buffer("levels: staging", bytes.len().next_power_of_two() as u64, BufferUse::Upload)?;
        }
        staging.mapped_mut()[..bytes.len()].copy_from_slice(bytes);
        Ok(())
    }
}
