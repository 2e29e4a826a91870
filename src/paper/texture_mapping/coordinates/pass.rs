//! One form of the coordinates as a pass over a band of pixels.

use super::{Band, DerivativeMethod, Form, RowConstants, RowWalk, TiltedPlane, twin};
use crate::vk::shader::texture_mapping::{
    coordinates_band_vert, coordinates_comp, coordinates_frag, coordinates_integer_comp,
    coordinates_runs_comp, coordinates_varying_frag, coordinates_varying_vert,
};
use crate::vk::shader::{PlaneBand, Shader};
use crate::vk::{
    Buffer, BufferUse, Clear, Cmd, ColorTarget, ComputePipeline, Feature, Format, Gpu, GraphicsInfo,
    GraphicsPipeline, Image, ImageInfo, Need, Resource, Result, Sampler, group_line,
};

/// The values written for a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// A bilinear sample of the image, RGBA8: one word. All other outputs have four words.
    Texels,
    /// u w, v w and w. The integers of [`Form::Integer`] are converted to f32.
    Terms,
    /// u and v.
    Coordinates,
    /// du/dx, dv/dx, du/dy and dv/dy. [`DerivativeMethod::Differences`] needs [`Form::Textbook`]; the other two methods
    /// need [`Form::RowConstants`] or [`Form::Walk`].
    Derivatives(DerivativeMethod),
}

/// Pipeline, set-up and target of a form.
pub struct CoordinatesPass {
    form: Form,
    body: Body,
    /// The rows' constants, or one unused word if the form has none.
    rows: Buffer,
    push: PlaneBand,
    words: u32,
}

enum Body {
    Draw(GraphicsPipeline, Image),
    /// The buffer receives the pixels.
    Dispatch(ComputePipeline, Buffer),
}

/// Device features that a form needs.
pub fn needs(form: Form) -> Vec<Need> {
    let integers = Need {
        feature: Feature::Int64,
        pass: "integer coordinates",
        without: "use another form of the coordinates",
    };
    if matches!(form, Form::Integer(_)) { vec![integers] } else { Vec::new() }
}

/// The rows' constants as the shaders' `Row`.
fn rounded(rows: &[RowConstants]) -> Vec<u32> {
    let words = |row: &RowConstants| {
        let values = [&row.start[..], &row.dx, &row.dy, &row.dy_step].concat();
        values.into_iter().map(|value| (value as f32).to_bits())
    };
    rows.iter().flat_map(words).collect()
}

/// The rows' constants as the shaders' `IntegerRow`.
fn integers(rows: &[RowConstants], width: u32) -> Vec<u32> {
    let words = |row: &RowConstants| {
        let values = twin::integers(row, width).concat();
        values.into_iter().flat_map(|value| [value as u32, (value >> 32) as u32])
    };
    rows.iter().flat_map(words).collect()
}

/// The set-up of a band's rows, in the layout that the shader of `form` reads.
pub fn set_up(form: Form, plane: &TiltedPlane, band: Band) -> Vec<u32> {
    let [width, height] = band.size;
    let rows: Vec<_> = (0..height).map(|row| plane.row_constants(band.first_row + row)).collect();
    match form {
        Form::Varyings | Form::NoPerspective | Form::Textbook | Form::TextbookBy(_) => vec![0],
        Form::RowConstants | Form::RowConstantsBy(_) | Form::Walk(_) => rounded(&rows),
        Form::Integer(_) => integers(&rows, width),
    }
}

impl CoordinatesPass {
    /// # Errors
    /// [`Error::MissingFeature`](crate::vk::Error::MissingFeature) if the device lacks a feature of
    /// [`needs`]; a target beyond the device's limits.
    pub fn new(
        gpu: &Gpu,
        form: Form,
        output: Output,
        plane: &TiltedPlane,
        band: Band,
        image_side: u32,
    ) -> Result<CoordinatesPass> {
        gpu.require(&needs(form))?;
        let name = form.name();
        let (output_id, method) = match output {
            Output::Texels => (0, 0),
            Output::Terms => (1, 0),
            Output::Coordinates => (2, 0),
            Output::Derivatives(method) => (3, method as u32),
        };
        let constants = [("OUTPUT", output_id), ("DERIVATIVE_METHOD", method)];
        let words = if output == Output::Texels { 1 } else { 4 };
        let body = match walk_of(form) {
            Some(walk) => {
                let shader = match form {
                    Form::Integer(_) => &coordinates_integer_comp::SHADER,
                    Form::Walk(_) => &coordinates_comp::SHADER,
                    _ => &coordinates_runs_comp::SHADER,
                };
                let bytes = 4 * u64::from(words) * band.size.map(u64::from).iter().product::<u64>();
                let row_constants = u32::from(matches!(form, Form::RowConstantsBy(_)));
                let own = [("WALK", walk_id(walk)), ("ROW_CONSTANTS", row_constants)];
                let constants = used(shader, &[constants, own].concat());
                let pixels = gpu.buffer(&format!("pixels, {name}"), bytes, BufferUse::Storage)?;
                Body::Dispatch(gpu.compute_pipeline(&name, shader, &constants)?, pixels)
            }
            None => {
                let format = if words == 1 { Format::R32Uint } else { Format::Rgba32Uint };
                let pipeline = draw_pipeline(gpu, &name, form, format, constants)?;
                Body::Draw(pipeline, gpu.image(&name, ImageInfo::target(band.size, format))?)
            }
        };
        let rows = gpu.buffer_with("rows", &set_up(form, plane, band), BufferUse::Storage)?;
        Ok(CoordinatesPass { form, body, rows, push: push(form, plane, band, image_side), words })
    }

    /// Sets the plane and the first row.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn aim(&mut self, gpu: &Gpu, plane: &TiltedPlane, first_row: u32) -> Result<()> {
        let band = Band { size: self.push.size, first_row };
        self.rows = gpu.buffer_with("rows", &set_up(self.form, plane, band), BufferUse::Storage)?;
        self.push = PlaneBand { to_unit: self.push.to_unit, ..push(self.form, plane, band, 1) };
        Ok(())
    }

    /// Records the form; texels are read from `image`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn run(&self, cmd: &mut Cmd<'_>, image: &Image, sampler: &Sampler) -> Result<()> {
        let push = bytemuck::bytes_of(&self.push);
        let source = (coordinates_frag::IMAGE, Resource::Sampled(image, sampler));
        let rows = (coordinates_frag::SET_UP, Resource::Buffer(&self.rows));
        match &self.body {
            Body::Draw(pipeline, target) => {
                let targets = [ColorTarget { image: target, clear: Clear::Uint([u32::MAX; 4]) }];
                cmd.render(self.push.size, &targets, None, |render| {
                    render.draw(pipeline, &[source, rows], push, 6)
                })
            }
            Body::Dispatch(pipeline, pixels) => {
                let pixels = (coordinates_comp::PIXELS, Resource::Buffer(pixels));
                let lanes = u64::from(self.push.size[1]) * u64::from(self.push.lanes);
                let groups = group_line(lanes.div_ceil(coordinates_comp::SHADER.group[0].into()));
                cmd.dispatch(pipeline, &[source, rows, pixels], push, groups)
            }
        }
    }

    /// The words of all pixels in row order, after all earlier frames have ended.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn read(&self, gpu: &Gpu) -> Result<Vec<u32>> {
        match &self.body {
            Body::Draw(_, target) => gpu.read_image_with(target, bytemuck::pod_collect_to_vec),
            Body::Dispatch(_, pixels) => gpu.read_buffer(pixels),
        }
    }

    /// As [`CoordinatesPass::read`], four values for each pixel.
    ///
    /// # Errors
    /// As [`CoordinatesPass::read`].
    pub fn read_values(&self, gpu: &Gpu) -> Result<Vec<[f32; 4]>> {
        assert_eq!(self.words, 4, "words per pixel");
        Ok(self
            .read(gpu)?
            .chunks_exact(4)
            .map(|words| [0, 1, 2, 3].map(|n| f32::from_bits(words[n])))
            .collect())
    }
}

/// How the threads of a compute form share a row; `None` for forms that draw.
fn walk_of(form: Form) -> Option<RowWalk> {
    match form {
        Form::Varyings | Form::NoPerspective | Form::Textbook | Form::RowConstants => None,
        Form::RowConstantsBy(walk) | Form::TextbookBy(walk) | Form::Walk(walk) | Form::Integer(walk) => {
            Some(walk)
        }
    }
}

fn walk_id(walk: RowWalk) -> u32 {
    match walk {
        RowWalk::Sequential | RowWalk::Lanes(_) => 0,
        RowWalk::TwoEnds => 1,
        RowWalk::Restart(_) => 2,
    }
}

/// Keeps the constants that the shader declares.
fn used<'a>(shader: &Shader, constants: &[(&'a str, u32)]) -> Vec<(&'a str, u32)> {
    let has = |name: &str| shader.specialization.iter().any(|(constant, _)| *constant == name);
    constants.iter().copied().filter(|(name, _)| has(name)).collect()
}

fn push(form: Form, plane: &TiltedPlane, band: Band, image_side: u32) -> PlaneBand {
    let walk = walk_of(form);
    let run = if let Some(RowWalk::Restart(pixels)) = walk { pixels } else { 0 };
    let lanes = walk.map_or(0, |walk| walk.lanes(band.size[0]));
    PlaneBand {
        plane: [0, 1, 2].map(|column| [0, 1, 2].map(|row: usize| plane.0[row][column] as f32)),
        size: band.size,
        first_row: band.first_row,
        to_unit: 1.0 / image_side as f32,
        lanes,
        run,
    }
}

fn draw_pipeline(
    gpu: &Gpu,
    name: &str,
    form: Form,
    format: Format,
    constants: [(&str, u32); 2],
) -> Result<GraphicsPipeline> {
    let [noperspective, smooth] = &coordinates_varying_frag::SHADERS;
    let (vertex, fragment, own) = match form {
        Form::Varyings => (&coordinates_varying_vert::SHADER, smooth, ("PERSPECTIVE", 1)),
        Form::NoPerspective => (&coordinates_varying_vert::SHADER, noperspective, ("PERSPECTIVE", 0)),
        Form::Textbook => (&coordinates_band_vert::SHADER, &coordinates_frag::SHADER, ("ROW_CONSTANTS", 0)),
        _ => (&coordinates_band_vert::SHADER, &coordinates_frag::SHADER, ("ROW_CONSTANTS", 1)),
    };
    gpu.graphics_pipeline(&GraphicsInfo {
        name,
        specialization: &[constants[0], constants[1], own],
        colors: &[format],
        ..GraphicsInfo::triangles(vertex, fragment)
    })
}
