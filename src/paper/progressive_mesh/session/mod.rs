//! Frames of progressive meshes: every instance that is seen is brought to the level that its distance asks for, what
//! that changed of the index buffers is copied, and all are drawn.
//!
//! A vertex is shaded as in a plain renderer: nothing of the levels is left in the shaders, unless vertices that
//! appear are to move to their places (geomorphing): see [`vertices`].

mod levels;
mod record;
mod resident;
mod rival;
pub mod surface;
pub mod vertices;

pub use super::config::{Settings, needs};
pub use super::load::{LoadError, load, ordered};
pub use super::place;
pub use record::FrameRecord;
pub use surface::{Change, Model, Surface, SurfaceError, SurfaceMemory};

use super::governor::Governor;
use crate::math::camera::Pose;
use crate::picture::Target;
use crate::vk::shader::Shader;
use crate::vk::shader::progressive_mesh::{geomorph_vert, surface_frag, surface_vert};
use crate::vk::{
    Buffer, BufferUse, Clear, ColorTarget, Depth, DepthTarget, FRAMES_IN_FLIGHT, Format, Geometry, Gpu,
    GraphicsInfo, GraphicsPipeline, Image, ImageInfo, Resource, Result, ShaderQuery, Ticket,
};
use std::time::Instant;
use vertices::VertexBuffer;

/// A vertex that appears has reached its place when the wanted error has fallen to 2^-0.5 = 0.71 of what it was at its
/// birth. Wider bands show a mesh that lags behind its level, narrower ones move faster.
pub const MORPH_BAND_LOG2: f32 = 0.5;

/// A frame's passes.
const LEVELS: &str = "levels";
const COMPACT: &str = "compact";
const SURFACES: &str = "surfaces";

/// Runs the frames of progressive meshes on one device.
pub struct Session {
    pub gpu: Gpu,
    pub settings: Settings,
    pub surfaces: Vec<Surface>,
    /// Frames that have ended, in order; those in flight are added by [`Session::drain`].
    pub records: Vec<FrameRecord>,
    plain: Option<GraphicsPipeline>,
    geomorph: Option<GraphicsPipeline>,
    target: Image,
    depth: Image,
    staging: [Buffer; FRAMES_IN_FLIGHT],
    queries: Option<ShaderQuery>,
    in_flight: [Option<(Ticket, FrameRecord)>; FRAMES_IN_FLIGHT],
    governor: Option<Governor>,
    next: u64,
}

/// A pipeline of the pass that draws, with one of its two vertex shaders.
///
/// # Errors
/// The driver's compiler fails.
pub fn surfaces_pipeline(
    gpu: &Gpu,
    vertex: &'static Shader,
    target: Target,
    vertex_work: u32,
) -> Result<GraphicsPipeline> {
    gpu.graphics_pipeline(&GraphicsInfo {
        name: "surfaces",
        vertex,
        geometry: None,
        fragment: Some(&surface_frag::SHADER),
        specialization: &[("VERTEX_WORK", vertex_work)],
        points: false,
        depth: Some(Depth::Write),
        colors: &[target.into()],
        logic_or: false,
    })
}

/// Words that a frame copies, and where they go: (surface, first word there, words).
#[derive(Default)]
struct Copies {
    words: Vec<u32>,
    parts: Vec<(usize, usize, usize)>,
}

impl Session {
    /// # Errors
    /// What the device lacks, a mesh that is not one.
    pub fn new(gpu: Gpu, models: &[Model], settings: Settings) -> std::result::Result<Session, SurfaceError> {
        gpu.require(&needs(&settings))?;
        let surfaces = models
            .iter()
            .map(|model| Surface::new(&gpu, model))
            .collect::<std::result::Result<Vec<_>, _>>()?;
        let morphs = |surface: &Surface| matches!(surface.vertices, VertexBuffer::Morph(_));
        let pipeline =
            |vertex: &'static Shader| surfaces_pipeline(&gpu, vertex, settings.target, settings.vertex_work);
        let plain = surfaces.iter().any(|surface| !morphs(surface));
        let geomorph = surfaces.iter().any(morphs);
        let staging = || gpu.buffer("levels: staging", 0, BufferUse::Upload);
        Ok(Session {
            plain: plain.then(|| pipeline(&surface_vert::SHADER)).transpose()?,
            geomorph: geomorph.then(|| pipeline(&geomorph_vert::SHADER)).transpose()?,
            target: gpu.image("picture", ImageInfo::target(settings.size, settings.target.into()))?,
            depth: gpu.image("depth", ImageInfo::target(settings.size, Format::Depth32Float))?,
            staging: [staging()?, staging()?],
            queries: match settings.count_shaders {
                true => Some(gpu.shader_query("surfaces: counts", FRAMES_IN_FLIGHT as u32)?),
                false => None,
            },
            in_flight: Default::default(),
            governor: settings.budget.map(|budget| Governor::new(budget, settings.rule)),
            records: Vec::new(),
            next: 0,
            surfaces,
            settings,
            gpu,
        })
    }

    /// Names of a frame's passes, in order: levels are executed, or copied; a rival that the device executes has a pass
    /// of its own; surfaces are drawn.
    pub fn passes(&self) -> Vec<&'static str> {
        let compacts = self.surfaces.iter().any(Surface::compacts);
        [Some(LEVELS), compacts.then_some(COMPACT), Some(SURFACES)].into_iter().flatten().collect()
    }

    /// One frame from `pose`: levels, copies, draws.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn frame(&mut self, pose: &Pose) -> Result<()> {
        self.finish(self.flight())?;
        let start = Instant::now();
        let (mut copies, mut change) = (Copies::default(), Change::default());
        let error_factor = self.plan(pose);
        for (n, surface) in self.surfaces.iter_mut().enumerate() {
            let pixels = surface.settings.error_pixels * error_factor;
            let mut upload = |words: &[u32], at| copies.add(n, words, at);
            change += surface.go(&self.gpu, pose, self.settings.size, pixels, &mut upload)?;
        }
        self.send(start, Some(pose), &copies, change, error_factor)
    }

    /// A frame that draws nothing: an instance of the first surface goes to a level. For what that alone costs.
    ///
    /// # Errors
    /// As [`Session::frame`].
    ///
    /// # Panics
    /// If shaders are to be counted: none runs.
    pub fn change_level(&mut self, instance: usize, level: u32) -> Result<()> {
        assert!(self.queries.is_none(), "no draw to count in");
        self.finish(self.flight())?;
        let start = Instant::now();
        let mut copies = Copies::default();
        let mut upload = |words: &[u32], at| copies.add(0, words, at);
        let change = self.surfaces[0].go_to(&self.gpu, (instance, level), &mut upload)?;
        self.send(start, None, &copies, change, 1.0)
    }

    /// The place in flight of the next frame.
    fn flight(&self) -> usize {
        (self.next % FRAMES_IN_FLIGHT as u64) as usize
    }

    /// Submits a frame whose levels were begun at `start`.
    fn send(
        &mut self,
        start: Instant,
        pose: Option<&Pose>,
        copies: &Copies,
        change: Change,
        error_factor: f64,
    ) -> Result<()> {
        let flight = self.flight();
        copies.stage(&self.gpu, &mut self.staging[flight])?;
        let record = FrameRecord {
            index: self.next,
            change,
            host: start.elapsed(),
            error_factor,
            passes: Vec::new(),
            counts: None,
        };
        let ticket = self.record(pose, flight, copies)?;
        self.surfaces.iter_mut().for_each(Surface::submitted);
        self.in_flight[flight] = Some((ticket, record));
        self.next += 1;
        Ok(())
    }

    /// The governor's factor on all wanted errors for a frame from `pose`.
    fn plan(&mut self, pose: &Pose) -> f64 {
        let Some(governor) = &mut self.governor else { return 1.0 };
        let of_surface = |surface| (surface, Surface::wanted_errors(surface, pose, self.settings.size));
        let wanted: Vec<_> = self.surfaces.iter().map(of_surface).collect();
        governor
            .plan(|factor| wanted.iter().map(|(surface, wanted)| surface.live_faces(wanted, factor)).sum())
    }

    fn record(&self, pose: Option<&Pose>, flight: usize, copies: &Copies) -> Result<Ticket> {
        let mut frame = self.gpu.frame()?;
        frame.pass(LEVELS, |cmd| {
            let mut from = 0;
            for (n, surface) in self.surfaces.iter().enumerate() {
                let mut ranges = Vec::new();
                for &(_, at, words) in copies.parts.iter().filter(|(surface, ..)| *surface == n) {
                    ranges.push([from, 4 * at as u64, 4 * words as u64]);
                    from += 4 * words as u64;
                }
                surface.record(cmd, &self.staging[flight], &ranges)?;
            }
            Ok(())
        })?;
        if self.surfaces.iter().any(Surface::compacts) {
            frame.pass(COMPACT, |cmd| self.surfaces.iter().try_for_each(|surface| surface.compact(cmd)))?;
        }
        if let Some(pose) = pose {
            frame.pass(SURFACES, |cmd| match &self.queries {
                Some(query) => cmd.counted(query, flight as u32, |cmd| self.draw(cmd, pose)),
                None => self.draw(cmd, pose),
            })?;
        }
        frame.submit()
    }

    fn draw(&self, cmd: &mut crate::vk::Cmd<'_>, pose: &Pose) -> Result<()> {
        let size = self.settings.size;
        let color = ColorTarget { image: &self.target, clear: Clear::Float(self.settings.background) };
        let depth = DepthTarget { image: &self.depth, clear: true };
        cmd.render(size, &[color], Some(depth), |render| {
            for surface in &self.surfaces {
                let slices = surface.slices(pose, size, self.settings.sun);
                let (pipeline, resources, vertices) = match &surface.vertices {
                    VertexBuffer::Plain(buffer) => (&self.plain, vec![], Some(buffer)),
                    VertexBuffer::Morph(buffer) => {
                        (&self.geomorph, vec![(geomorph_vert::MORPH, Resource::Buffer(buffer))], None)
                    }
                };
                let pipeline = pipeline.as_ref().expect("made for the surfaces that there are");
                let geometry = Geometry { vertices, indices: &surface.indices };
                render.draw_slices(pipeline, &resources, geometry, &slices)?;
            }
            Ok(())
        })
    }

    /// Waits for the frame in place `flight`, and keeps its record.
    fn finish(&mut self, flight: usize) -> Result<()> {
        let Some((ticket, mut record)) = self.in_flight[flight].take() else { return Ok(()) };
        record.passes = ticket.wait()?;
        record.counts = self.queries.as_ref().map(|query| query.read(flight as u32)).transpose()?;
        if let (Some(governor), Some(ms)) = (&mut self.governor, record.milliseconds()) {
            governor.frame_took(ms, record.change.live_faces);
        }
        self.records.push(record);
        Ok(())
    }

    /// Waits for every frame in flight, so that [`Session::records`] holds all of them.
    ///
    /// # Errors
    /// Device lost.
    pub fn drain(&mut self) -> Result<()> {
        for n in self.next..self.next + FRAMES_IN_FLIGHT as u64 {
            self.finish((n % FRAMES_IN_FLIGHT as u64) as usize)?;
        }
        Ok(())
    }

    /// The last frame's picture, rows from the top: sRGB bytes or f32 of linear light, RGBA.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn picture_bytes(&mut self) -> Result<Vec<u8>> {
        self.drain()?;
        self.gpu.read_image(&self.target)
    }

    /// (name, bytes) of all that the scene made in video memory; staging grows with what a frame changes.
    pub fn memory(&self) -> Vec<(String, u64)> {
        let of_surface = |surface: &Surface| {
            let buffers = [("vertices", surface.vertices.bytes()), ("indices", surface.indices.bytes())];
            let program = surface.program_bytes();
            let named = |(what, bytes)| (format!("{}: {what}", surface.name), bytes);
            buffers.into_iter().chain(program).map(named).collect::<Vec<_>>()
        };
        let mut memory: Vec<_> = self.surfaces.iter().flat_map(of_surface).collect();
        memory.push(("levels: staging".into(), self.staging.iter().map(Buffer::bytes).sum()));
        memory.push(("depth".into(), self.depth.bytes()));
        memory.push(("picture".into(), self.target.bytes()));
        memory
    }
}

impl Copies {
    fn add(&mut self, surface: usize, words: &[u32], at: usize) {
        self.words.extend_from_slice(words);
        self.parts.push((surface, at, words.len()));
    }

    /// Into mapped memory, a larger one where it does not suffice.
    fn stage(&self, gpu: &Gpu, staging: &mut Buffer) -> Result<()> {
        let bytes: &[u8] = bytemuck::cast_slice(&self.words);
        if staging.bytes() < bytes.len() as u64 {
            *staging =
                gpu.buffer("levels: staging", bytes.len().next_power_of_two() as u64, BufferUse::Upload)?;
        }
        staging.mapped_mut()[..bytes.len()].copy_from_slice(bytes);
        Ok(())
    }
}

impl std::ops::AddAssign for Change {
    fn add_assign(&mut self, other: Change) {
        self.instances_seen += other.instances_seen;
        self.faces += other.faces;
        self.live_faces += other.live_faces;
        self.vertices += other.vertices;
        self.splits += other.splits;
        self.collapses += other.collapses;
        self.upload_bytes += other.upload_bytes;
    }
}
