//! A method on the GPU: one triangle covers the picture, and its fragments filter a tilted plane.

use super::baselines::FilterBaseline;
use super::coordinates::pass::set_up;
use super::coordinates::{Band, Form};
use super::footprint::{Axes, Determinant, KTexels, MAX_VISITED, Scan};
use super::method::{Coordinates, EllipseFilter, Method, PixelCentre};
use super::plane::TiltedPlane;
use super::texels::GreyMipmap;
use crate::vk::shader::common::screen_vert;
use crate::vk::shader::texture_mapping as glsl;
use crate::vk::shader::{PlanePush, Shader};
use crate::vk::{
    Buffer, BufferUse, Clear, Cmd, ColorTarget, Feature, Format, Gpu, GraphicsInfo, GraphicsPipeline, Image,
    ImageInfo, Need, PassTime, ReadAs, Resource, Result, Sampler,
};

/// A texture in video memory.
pub struct Uploaded {
    pub(super) image: Image,
    /// For [`FilterBaseline::SummedArea`]: summed bytes over 2 x 2 copies of the texture. The first row and the first
    /// column are zeros.
    sums: Image,
    pub(super) coarsest: u32,
}

/// The targets of a pass.
pub struct Targets {
    /// The first image holds red, green and blue in linear light; its alpha holds the number of texels fetched. With
    /// `dumps`, three more images hold each pixel's position, Jacobian and decisions (level, empty footprint, texels
    /// visited).
    images: Vec<Image>,
    pub size: [u32; 2],
}

/// The pipeline of a method, and the inputs of the pipeline except the texture.
pub struct FilterPass {
    pipeline: GraphicsPipeline,
    sampler: Sampler,
    weight_map: Buffer,
    /// The rows' constants, for ellipses whose [`Coordinates`] use them.
    rows: Buffer,
    coarsest: u32,
}

/// What one pixel's invocation computed and decided, from a pass with dumps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dumped {
    /// `None` beyond the horizon.
    pub pixel: Option<PixelCentre>,
    pub colour: [f32; 3],
    pub fetched: u32,
    pub level: u32,
    /// True if no texel had a weight.
    pub empty: bool,
    /// Texels visited.
    pub visited: u32,
}

/// Device features that a method needs.
pub fn needs(method: &Method) -> Vec<Need> {
    match method {
        Method::Baseline(FilterBaseline::Hardware(_)) => vec![Need {
            feature: Feature::SamplerAnisotropy,
            pass: "hardware anisotropy",
            without: "use another filter",
        }],
        _ => Vec::new(),
    }
}

impl Uploaded {
    /// # Errors
    /// Out of memory, device lost.
    pub fn new(gpu: &Gpu, name: &str, texels: &GreyMipmap) -> Result<Uploaded> {
        let info = ImageInfo::texture([texels.side; 2], Format::Rgba8, texels.levels.len() as u32);
        let image = gpu.image(name, info)?;
        let grey = |level: &Vec<u8>| level.iter().flat_map(|&byte| [byte, byte, byte, 255]).collect();
        let levels: Vec<Vec<u8>> = texels.levels.iter().map(grey).collect();
        gpu.fill_levels(&image, &levels)?;
        let side = 2 * texels.side + 1;
        let sums =
            gpu.image(&format!("{name}, sums"), ImageInfo::texture([side; 2], Format::Rgba32Uint, 1))?;
        let words: Vec<u32> = sums_of(texels).iter().flat_map(|&sum| [sum, sum, sum, 0]).collect();
        gpu.fill_levels(&sums, &[bytemuck::cast_slice(&words).to_vec()])?;
        Ok(Uploaded { image, sums, coarsest: texels.coarsest() })
    }
}

/// Entry (x, y) is the sum of all bytes above and to the left, modulo 2^32.
fn sums_of(texels: &GreyMipmap) -> Vec<u32> {
    let side = 2 * texels.side as usize + 1;
    let mut sums = vec![0u32; side * side];
    for y in 1..side {
        let mut row = 0u32;
        for x in 1..side {
            row = row.wrapping_add(u32::from(texels.byte(0, x as i64 - 1, y as i64 - 1)));
            sums[y * side + x] = sums[(y - 1) * side + x].wrapping_add(row);
        }
    }
    sums
}

impl Targets {
    /// # Errors
    /// Out of memory.
    pub fn new(gpu: &Gpu, size: [u32; 2], dumps: bool) -> Result<Targets> {
        let names = ["filtered", "place", "jacobian", "decisions"];
        let image = |name: &&str| gpu.image(name, ImageInfo::target(size, Format::Rgba32Float));
        let images = names[..if dumps { 4 } else { 1 }].iter().map(image).collect::<Result<_>>()?;
        Ok(Targets { images, size })
    }

    pub(super) fn picture(&self) -> &Image {
        &self.images[0]
    }

    /// Red, green and blue in linear light, and the texel count, of each pixel.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn colours(&self, gpu: &Gpu) -> Result<Vec<[f32; 4]>> {
        gpu.read_image_with(&self.images[0], bytemuck::pod_collect_to_vec)
    }

    /// All values of each pixel. The targets must have been created with dumps.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn dumped(&self, gpu: &Gpu) -> Result<Vec<Dumped>> {
        let read = |image: &Image| -> Result<Vec<[f32; 4]>> {
            gpu.read_image_with(image, bytemuck::pod_collect_to_vec)
        };
        let [colours, places, jacobians, decisions] = &self.images[..] else {
            panic!("{} targets: created without dumps", self.images.len())
        };
        let (colours, places) = (read(colours)?, read(places)?);
        let (jacobians, decisions) = (read(jacobians)?, read(decisions)?);
        let of = |n: usize| {
            let [u, v, determinant, seen] = places[n].map(f64::from);
            let [ux, uy, vx, vy] = jacobians[n].map(f64::from);
            let [r, g, b, fetched] = colours[n];
            let [level, empty, visited, _] = decisions[n];
            let place = [n as u32 % self.size[0], n as u32 / self.size[0]];
            let pixel = PixelCentre { place, centre: [u, v], jacobian: [[ux, uy], [vx, vy]], determinant };
            Dumped {
                pixel: (seen > 0.0).then_some(pixel),
                colour: [r, g, b],
                fetched: fetched as u32,
                level: level as u32,
                empty: empty > 0.0,
                visited: visited as u32,
            }
        };
        Ok((0..colours.len()).map(of).collect())
    }
}

/// The plane as passed to the shaders: constants of the picture, computed in f64.
pub fn push(plane: &TiltedPlane, size: [u32; 2], frame: u32) -> PlanePush {
    let [[a, b, c], [d, e, f], [g, h, i]] = plane.0;
    let single = |row: [f64; 3]| row.map(|number| number as f32);
    let slope = |constant: f64, slope: f64| [constant as f32, slope as f32];
    let det = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
    PlanePush {
        u_row: single([a, b, c]),
        v_row: single([d, e, f]),
        w_row: single([g, h, i]),
        u_x: slope(a * i - c * g, a * h - b * g),
        u_y: slope(b * i - c * h, b * g - a * h),
        v_x: slope(d * i - f * g, d * h - e * g),
        v_y: slope(e * i - f * h, e * g - d * h),
        det: det as f32,
        middle: size.map(|side| side as f32 / 2.0),
        frame,
        low: [f32::NEG_INFINITY; 2],
        high: [f32::INFINITY; 2],
    }
}

/// A method's fragment shaders: without and with dumps.
fn shaders(method: &Method) -> &'static [Shader; 2] {
    match method {
        Method::Ellipse(_) => &glsl::ellipse_frag::SHADERS,
        Method::Baseline(baseline) => match baseline {
            FilterBaseline::Trilinear
            | FilterBaseline::Anisotropic(_)
            | FilterBaseline::Feline(_)
            | FilterBaseline::Mavridis(_) => &glsl::probes_frag::SHADERS,
            FilterBaseline::Hardware(_) => &glsl::hardware_frag::SHADERS,
            FilterBaseline::Pbrt => &glsl::pbrt_frag::SHADERS,
            FilterBaseline::Stochastic(_) => &glsl::stochastic_frag::SHADERS,
            FilterBaseline::SummedArea => &glsl::summed_area_frag::SHADERS,
        },
        Method::ObjectSpace(_) => panic!("object-space texturing is drawn by object_space::pass"),
    }
}

/// A method's specialization constants.
fn constants(method: &Method, coarsest: u32) -> Vec<(&'static str, u32)> {
    let mut constants = vec![("COARSEST", coarsest)];
    match method {
        Method::Ellipse(ellipse) => constants.extend(ellipse_constants(ellipse)),
        Method::Baseline(baseline) => match *baseline {
            FilterBaseline::Trilinear => constants.extend([("RULE", 0), ("MAX", 1)]),
            FilterBaseline::Anisotropic(max) => constants.extend([("RULE", 1), ("MAX", max)]),
            FilterBaseline::Feline(max) => constants.extend([("RULE", 2), ("MAX", max)]),
            FilterBaseline::Mavridis(taps) => constants.extend([("RULE", 3), ("MAX", taps)]),
            FilterBaseline::Stochastic(samples) => constants.push(("SAMPLES", samples)),
            FilterBaseline::Hardware(_) | FilterBaseline::Pbrt | FilterBaseline::SummedArea => {}
        },
        Method::ObjectSpace(_) => {}
    }
    constants
}

fn ellipse_constants(ellipse: &EllipseFilter) -> Vec<(&'static str, u32)> {
    let EllipseFilter { footprint, kernel, map, edge } = ellipse;
    let axes = match footprint.axes {
        Axes::Rows => 0,
        Axes::Columns => 1,
        Axes::Corrected => 2,
        Axes::Round => 3,
    };
    let of_map = map.iter().flat_map(|map| map.constants(ellipse.map_reach()));
    let constants = [
        ("AXES", axes),
        ("ALL_POSITIVE", u32::from(footprint.determinant == Determinant::AllPositive)),
        ("K", footprint.k.to_bits()),
        ("K_OF_LEVEL_0", u32::from(footprint.k_texels == KTexels::OfLevel0)),
        ("ROW_SPAN", u32::from(footprint.scan == Scan::RowSpan)),
        ("MINOR_TEXELS", footprint.minor_texels.to_bits()),
        ("MAX_RATIO", footprint.max_ratio.to_bits()),
        ("MAX_REACH", footprint.max_reach.to_bits()),
        ("RADIUS", kernel.radius_px.to_bits()),
        ("MAX_VISITED", (MAX_VISITED as f32).to_bits()),
        ("ALPHA", kernel.alpha.to_bits()),
        ("EDGE", *edge as u32),
    ];
    constants.into_iter().chain(of_map).collect()
}

impl FilterPass {
    /// `coarsest` is the number of the textures' level that has one texel. A pass with `dumps` needs targets with
    /// dumps.
    ///
    /// # Errors
    /// Out of memory; a feature of [`needs`] is missing.
    pub fn new(gpu: &Gpu, method: &Method, coarsest: u32, dumps: bool) -> Result<FilterPass> {
        FilterPass::with(gpu, method, &constants(method, coarsest), coarsest, dumps)
    }

    /// A pass of an ellipse filter that computes coordinates by the given method. The pass draws only pictures of
    /// `plane`. `dumps` is as for [`FilterPass::new`].
    ///
    /// # Errors
    /// Out of memory.
    pub fn by(
        gpu: &Gpu,
        ellipse: &EllipseFilter,
        coarsest: u32,
        coordinates: Coordinates,
        (plane, size): (&TiltedPlane, [u32; 2]),
        dumps: bool,
    ) -> Result<FilterPass> {
        let method = Method::Ellipse(*ellipse);
        let own = [("COORDINATES", coordinates as u32)];
        let mut pass = FilterPass::with(
            gpu,
            &method,
            &[&constants(&method, coarsest)[..], &own].concat(),
            coarsest,
            dumps,
        )?;
        // The set-up counts pixels from the picture's upper left corner.
        let plane = plane.shifted(size.map(|side| -f64::from(side) / 2.0));
        let words = set_up(Form::RowConstants, &plane, Band { size, first_row: 0 });
        pass.rows = gpu.buffer_with("rows", &words, BufferUse::Storage)?;
        Ok(pass)
    }

    fn with(
        gpu: &Gpu,
        method: &Method,
        specialization: &[(&'static str, u32)],
        coarsest: u32,
        dumps: bool,
    ) -> Result<FilterPass> {
        gpu.require(&needs(method))?;
        let shader = &shaders(method)[usize::from(dumps)];
        let pipeline = gpu.graphics_pipeline(&GraphicsInfo {
            specialization,
            colors: &[Format::Rgba32Float; 4][..if dumps { 4 } else { 1 }],
            ..GraphicsInfo::triangles(&screen_vert::SHADER, shader)
        })?;
        let words = match method {
            Method::Ellipse(ellipse @ EllipseFilter { map: Some(map), kernel, .. }) => {
                map.words(kernel.alpha, ellipse.map_reach())
            }
            _ => vec![0],
        };
        let max_anisotropy = match method {
            Method::Baseline(FilterBaseline::Hardware(max)) => *max,
            _ => 1,
        };
        Ok(FilterPass {
            pipeline,
            sampler: gpu.tiling_sampler("tiling sampler", max_anisotropy)?,
            weight_map: gpu.buffer_with("weight map", &words, BufferUse::Texels)?,
            rows: gpu.buffer("no rows", 4, BufferUse::Storage)?,
            coarsest,
        })
    }

    /// Filters the plane of `push`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn draw(
        &self,
        cmd: &mut Cmd<'_>,
        texture: &Uploaded,
        targets: &Targets,
        push: &PlanePush,
    ) -> Result<()> {
        assert_eq!(self.coarsest, texture.coarsest, "coarsest level of the pass and the texture");
        let resources = [
            (glsl::ellipse_frag::TEXTURE_OF, Resource::Sampled(&texture.image, &self.sampler)),
            (glsl::ellipse_frag::WEIGHT_MAP, Resource::Buffer(&self.weight_map)),
            (glsl::ellipse_frag::ROWS, Resource::Buffer(&self.rows)),
            (glsl::summed_area_frag::SUMS, Resource::Texture(&texture.sums, ReadAs::Whole)),
        ];
        let clear = Clear::Float([0.0; 4]);
        let colors: Vec<_> = targets.images.iter().map(|image| ColorTarget { image, clear }).collect();
        cmd.render(targets.size, &colors, None, |render| {
            render.draw(&self.pipeline, &resources, bytemuck::bytes_of(push), 3)
        })
    }

    /// Runs one frame with this pass alone and waits for it. If the device has timestamps, returns the pass's
    /// time in nanoseconds.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn run(
        &self,
        gpu: &Gpu,
        texture: &Uploaded,
        targets: &Targets,
        push: &PlanePush,
    ) -> Result<Vec<PassTime>> {
        gpu.run_pass("filter", |cmd| self.draw(cmd, texture, targets, push))
    }
}
