//! The stages of object-space texturing on the GPU.

use super::{MAX_FRAGMENTS, TexturedPolygons};
use crate::paper::texture_mapping::pass::{Targets, Uploaded};
use crate::vk::shader::ObjectSpace as Push;
use crate::vk::shader::common::screen_vert;
use crate::vk::shader::texture_mapping::{
    object_rasterise_comp, object_resolve_frag, object_rotate_comp, object_splat_comp, object_texture_comp,
};
use crate::vk::{
    Buffer, BufferUse, Clear, Cmd, ColorTarget, ComputePipeline, Format, Gpu, GraphicsInfo, GraphicsPipeline,
    PassTime, ReadAs, Resource, Result, group_line,
};

/// The pipelines of all stages.
pub struct Stages {
    rotate: ComputePipeline,
    rasterise: ComputePipeline,
    texture: ComputePipeline,
    depth: ComputePipeline,
    splat: ComputePipeline,
    resolve: GraphicsPipeline,
}

/// Polygons in video memory, and the buffers between the stages.
pub struct ObjectSpaceBuffers {
    triangles: Buffer,
    polygons: Buffer,
    counts: Buffer,
    fragments: Buffer,
    colours: Buffer,
    nearest: Buffer,
    sums: Buffer,
    push: Push,
    rows: u32,
}

/// Counts of one picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counts {
    pub fragments: u64,
    /// Atomics of the depth test and of the sums.
    pub atomics: u64,
}

/// Bytes of a `Polygon` of the shaders.
const POLYGON_BYTES: u64 = 4 * (4 + 1 + 2 + 2 + 9 + 3 + 3 + 1 + 3 + 2);

impl Stages {
    /// With `counts`, the shaders count their atomics, which takes time.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(gpu: &Gpu, counts: bool) -> Result<Stages> {
        let splat = |name, sums: u32| {
            let constants = [("SUMS", sums), ("COUNT", u32::from(counts))];
            gpu.compute_pipeline(name, &object_splat_comp::SHADER, &constants)
        };
        Ok(Stages {
            rotate: gpu.compute_pipeline("rotate polygons", &object_rotate_comp::SHADER, &[])?,
            rasterise: gpu.compute_pipeline("rasterise polygons", &object_rasterise_comp::SHADER, &[])?,
            texture: gpu.compute_pipeline("texture fragments", &object_texture_comp::SHADER, &[])?,
            depth: splat("depths of fragments", 0)?,
            splat: splat("splat fragments", 1)?,
            resolve: gpu.graphics_pipeline(&GraphicsInfo {
                name: "resolve pixels",
                colors: &[Format::Rgba32Float],
                ..GraphicsInfo::triangles(&screen_vert::SHADER, &object_resolve_frag::SHADER)
            })?,
        })
    }

    /// Records a pass for each stage.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(
        &self,
        frame: &mut crate::vk::Frame<'_>,
        of: &ObjectSpaceBuffers,
        texture: &Uploaded,
        targets: &Targets,
    ) -> Result<()> {
        assert_eq!(of.push.coarsest, texture.coarsest, "coarsest level of the polygons and the texture");
        assert_eq!(of.push.size, targets.size, "picture size of the polygons and the targets");
        let resources = of.resources(texture);
        let push = bytemuck::bytes_of(&of.push);
        let of_fragments = group_line(of.push.capacity.div_ceil(64).into());
        frame.pass("rotate", |cmd| {
            cmd.fill(&of.counts, of.counts.bytes(), 0);
            cmd.fill(&of.nearest, of.nearest.bytes(), 0);
            cmd.fill(&of.sums, of.sums.bytes(), 0);
            cmd.dispatch(&self.rotate, &resources, push, [of.push.triangles.div_ceil(64).max(1), 1, 1])
        })?;
        let rows = [of.rows.div_ceil(64).max(1), of.push.triangles.max(1), 1];
        if of.push.triangles > 0 {
            frame.pass("rasterise", |cmd| cmd.dispatch(&self.rasterise, &resources, push, rows))?;
        }
        let mut stage = |label, pipeline| {
            frame.pass(label, |cmd: &mut Cmd<'_>| cmd.dispatch(pipeline, &resources, push, of_fragments))
        };
        stage("texture", &self.texture)?;
        stage("depth", &self.depth)?;
        stage("splat", &self.splat)?;
        frame.pass("resolve", |cmd| {
            let target = ColorTarget { image: targets.picture(), clear: Clear::Float([0.0; 4]) };
            cmd.render(targets.size, &[target], None, |render| {
                render.draw(&self.resolve, &resources, push, 3)
            })
        })
    }

    /// Runs one frame with all stages and waits for it. If the device has timestamps, returns the time of
    /// each stage in nanoseconds.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn run(
        &self,
        gpu: &Gpu,
        of: &ObjectSpaceBuffers,
        texture: &Uploaded,
        targets: &Targets,
    ) -> Result<Vec<PassTime>> {
        let mut frame = gpu.frame()?;
        self.record(&mut frame, of, texture, targets)?;
        frame.submit()?.wait()
    }
}

impl ObjectSpaceBuffers {
    /// Buffers for pictures of `size` pixels; `coarsest` is the number of the texture's level that has one texel.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(
        gpu: &Gpu,
        polygons: &TexturedPolygons,
        spacing: f32,
        size: [u32; 2],
        coarsest: u32,
    ) -> Result<ObjectSpaceBuffers> {
        let count = polygons.triangles.len() as u32;
        let max = polygons.max_fragments(f64::from(spacing));
        let rows = polygons.max_rows(f64::from(spacing));
        assert!(max <= MAX_FRAGMENTS && count < 1 << 16, "{max} fragments of {count} triangles");
        assert!(rows < 1 << 16, "{rows} rows of fragments do not fit 16 bits");
        let storage = |name, bytes: u64| gpu.buffer(name, bytes.max(4), BufferUse::Storage);
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let none = [super::TexturedTriangle { corners: [[0.0; 3]; 3], texels: [[0.0; 2]; 3] }];
        let triangles = if count == 0 { &none[..] } else { &polygons.triangles };
        Ok(ObjectSpaceBuffers {
            triangles: gpu.buffer_with("triangles", triangles, BufferUse::Storage)?,
            polygons: storage("rotated polygons", POLYGON_BYTES * triangles.len() as u64)?,
            counts: storage("counts of fragments", 12)?,
            fragments: storage("fragments", 8 * max.max(1))?,
            colours: storage("colours of fragments", 4 * max)?,
            nearest: storage("nearest planes", 4 * pixels)?,
            sums: storage("sums of fragments", 16 * pixels)?,
            push: Push {
                size,
                camera: polygons.camera_px,
                spacing,
                triangles: count,
                capacity: max as u32,
                coarsest,
            },
            rows,
        })
    }

    fn resources<'a>(&'a self, texture: &'a Uploaded) -> [(u32, Resource<'a>); 8] {
        [
            (object_rotate_comp::TRIANGLES, Resource::Buffer(&self.triangles)),
            (object_rotate_comp::POLYGONS, Resource::Buffer(&self.polygons)),
            (object_splat_comp::COUNTS, Resource::Buffer(&self.counts)),
            (object_splat_comp::FRAGMENTS, Resource::Buffer(&self.fragments)),
            (object_splat_comp::COLOURS, Resource::Buffer(&self.colours)),
            (object_splat_comp::NEAREST, Resource::Buffer(&self.nearest)),
            (object_splat_comp::SUMS, Resource::Buffer(&self.sums)),
            (object_texture_comp::TEXTURE_OF, Resource::Texture(&texture.image, ReadAs::Whole)),
        ]
    }

    /// Counts of the last picture; the [`Stages`] must have been created with `counts`.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn counts(&self, gpu: &Gpu) -> Result<Counts> {
        let [fragments, depth_tests, sums] = gpu.read_buffer::<u32>(&self.counts)?[..] else {
            unreachable!("three counts")
        };
        assert!(fragments <= self.push.capacity, "{fragments} fragments of at most {}", self.push.capacity);
        Ok(Counts { fragments: fragments.into(), atomics: u64::from(depth_tests) + u64::from(sums) })
    }

    /// For each pixel, the sum of weights and the sums of weighted red, green and blue bytes.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn sums(&self, gpu: &Gpu) -> Result<Vec<[u32; 4]>> {
        gpu.read_buffer(&self.sums)
    }
}
