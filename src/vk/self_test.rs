//! Driver self-test: one dispatch, one geometry-shader draw with transform feedback if the device has both, and one
//! triangle. `ortelius doctor` runs it in a child process, so that a crashing driver is reported and does not end the
//! program.

use super::shader::self_test::{dispatch_comp, feedback_geom, feedback_vert, triangle_frag, triangle_vert};
use super::{
    Blend, BufferUse, Clear, ColorTarget, Error, Feature, Format, Gpu, GpuOptions, GraphicsInfo, ImageInfo,
    Message, Resource, Result, TransformFeedback,
};

/// Features of the draw with transform feedback. Only paper 1's own variants need them.
const OPTIONAL: [Feature; 2] = [Feature::GeometryShader, Feature::TransformFeedback];

/// Result of a self-test without errors.
pub struct Passed {
    /// The validation messages.
    pub messages: Vec<Message>,
    /// The missing feature without which transform feedback cannot be tested.
    pub lacks: Option<Feature>,
}

/// Runs the tests on one device.
///
/// # Errors
/// The device lacks something that all variants need, or a result is wrong.
pub fn run(options: &GpuOptions<'_>) -> Result<Passed> {
    let gpu = Gpu::new(&GpuOptions { wishes: &OPTIONAL, ..options.clone() })?;
    gpu.require_drawing()?;
    dispatch(&gpu)?;
    let lacks = OPTIONAL.into_iter().find(|feature| !gpu.has(*feature));
    if lacks.is_none() {
        feedback(&gpu)?;
    }
    triangle(&gpu)?;
    Ok(Passed { messages: gpu.messages(), lacks })
}

fn expect(what: &str, found: &[u32], wanted: impl Iterator<Item = u32>) -> Result<()> {
    let wanted: Vec<u32> = wanted.collect();
    match found.iter().zip(&wanted).position(|(f, w)| f != w) {
        None => Ok(()),
        Some(at) => {
            let (found, wanted) = (found[at], wanted[at]);
            let what = format!("{what}: word {at} is {found}, not {wanted}: the driver is broken");
            Err(Error::limit("self-test", what))
        }
    }
}

fn dispatch(gpu: &Gpu) -> Result<()> {
    let pipeline = gpu.compute_pipeline("self-test dispatch", &dispatch_comp::SHADER, &[])?;
    let words = gpu.buffer("self-test words", 4 * 256, BufferUse::Storage)?;
    let host = gpu.buffer("self-test read-back", 4 * 256, BufferUse::Readback)?;
    let mut frame = gpu.frame()?;
    frame.pass("dispatch", |cmd| {
        cmd.dispatch(&pipeline, &[(dispatch_comp::WORDS, Resource::Buffer(&words))], &[], [4, 1, 1])
    })?;
    frame.pass("read-back", |cmd| cmd.copy_buffer(&words, 0, &host, 0, 4 * 256))?;
    frame.submit()?.wait()?;
    expect("dispatch", &host.mapped(), (0..256).map(|x| 3 * x + 1))
}

fn feedback(gpu: &Gpu) -> Result<()> {
    let pipeline = gpu.graphics_pipeline(&GraphicsInfo {
        name: "self-test feedback",
        vertex: &feedback_vert::SHADER,
        geometry: Some(&feedback_geom::SHADER),
        fragment: None,
        specialization: &[],
        points: true,
        depth: None,
        colors: &[],
        blend: Blend::Replace,
    })?;
    let buffer = gpu.buffer("self-test points", 4 * 100, BufferUse::TransformFeedback)?;
    let counter = gpu.buffer("self-test counter", 4, BufferUse::TransformFeedback)?;
    let host = gpu.buffer("self-test read-back", 4 * 101, BufferUse::Readback)?;
    let query = gpu.stream_query("self-test query", 1)?;
    let mut frame = gpu.frame()?;
    frame.pass("feedback", |cmd| {
        cmd.reset(&query, 0);
        cmd.render([1, 1], &[], None, |render| {
            let into =
                TransformFeedback { buffer: &buffer, counter: &counter, query: &query, query_index: 0 };
            render.draw_captured(&pipeline, &[], &[], 100, &into)
        })
    })?;
    frame.pass("read-back", |cmd| {
        cmd.copy_buffer(&buffer, 0, &host, 0, 400);
        cmd.copy_buffer(&counter, 0, &host, 400, 4);
    })?;
    frame.submit()?.wait()?;
    let count = query.read(0)?;
    expect("stream query", &[count.written as u32, count.needed as u32], [100, 100].into_iter())?;
    let wanted = (0..100).filter(|x| x % 2 == 0).flat_map(|x| [2 * x, 2 * x + 1]).chain([400]);
    expect("transform feedback", &host.mapped(), wanted)
}

/// Draws a triangle and checks its pixels. With the wrong vector width, lavapipe crashed only when it rasterised a
/// triangle.
fn triangle(gpu: &Gpu) -> Result<()> {
    let pipeline = gpu.graphics_pipeline(&GraphicsInfo {
        name: "self-test triangle",
        colors: &[Format::R32Uint],
        ..GraphicsInfo::triangles(&triangle_vert::SHADER, &triangle_frag::SHADER)
    })?;
    let image = gpu.image("self-test picture", ImageInfo::target([16, 16], Format::R32Uint))?;
    gpu.run_pass("triangle", |cmd| {
        let target = ColorTarget { image: &image, clear: Clear::Uint([u32::MAX; 4]) };
        cmd.render([16, 16], &[target], None, |render| render.draw(&pipeline, &[], &[], 3))
    })?;
    let wanted = (0..256).map(|index| if index % 16 + index / 16 < 15 { index } else { u32::MAX });
    expect("triangle", bytemuck::cast_slice(&gpu.read_image(&image)?), wanted)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vk::shader::Replaced;

    #[test]
    fn a_wrong_pixel_of_the_triangle_is_reported() {
        let gpu = Gpu::new(&GpuOptions::default()).unwrap();
        triangle(&gpu).unwrap();
        let mut words = triangle_frag::SHADER.spirv.to_vec();
        // The shader's row factor, 16: an OpConstant (opcode 43) of 4 words.
        let at = words.windows(4).position(|word| word[0] == 4 << 16 | 43 && word[3] == 16).unwrap();
        words[at + 3] = 17;
        gpu.replace_shaders(Replaced::from([(triangle_frag::SHADER.name.to_string(), words)]));
        let broken = triangle(&gpu).unwrap_err().to_string();
        assert!(broken.contains("triangle: word 16 is 17, not 16"), "{broken}");
    }
}
