//! The values of the pixel under the pointer. They are read two frames after the frame that copied them, so
//! that nothing waits for the GPU.

use super::levels::Levels;
use glam::DMat2;
use ortelius::frame::{PerFrame, Target, View};
use ortelius::vk::{Buffer, BufferUse, Frame, Gpu, Image, Result, TexelCopy};

/// Bytes of the buffer per image. The largest texel has 16 bytes.
const STRIDE: u64 = 16;

/// The pending copies, and the last values that arrived.
#[derive(Default)]
pub struct Probe {
    queries: PerFrame<Option<Query>>,
    pub found: Option<ProbedPixel>,
}

/// The images of one frame that record each pixel's tile and face. `None` where the scene has no such
/// surface.
#[derive(Clone, Copy)]
pub struct LaidOpen<'a> {
    pub levels: Option<&'a Levels>,
    /// As [`ortelius::paper::progressive_mesh::faces::Faces::image`].
    pub faces: Option<&'a Image>,
    /// True if the cache misses in `faces` are those of this frame.
    pub has_misses: bool,
}

/// The copies of one frame: colour, depth, the face of a mesh, and the tile, coordinates and derivatives of a
/// virtual texture.
struct Query {
    buffer: Buffer,
    at: [u32; 2],
    near_m: f64,
    has_meshes: bool,
    has_misses: bool,
    has_texture: bool,
}

/// The values of one pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbedPixel {
    pub at: [u32; 2],
    pub srgb: [u8; 3],
    /// Depth along the viewing direction in metres; `None` for the background.
    pub distance_m: Option<f64>,
    pub face: Option<Face>,
    pub texel: Option<Texel>,
}

/// A face of a progressive mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    /// Index among the visible instances of all surfaces.
    pub instance: u32,
    /// Index of the face in the instance's index buffer.
    pub face: u32,
    /// Level below which the face collapses.
    pub level: u32,
    /// Number of the face's vertices that miss a FIFO-16 cache; `None` if they were not counted.
    pub misses: Option<u32>,
}

/// A pixel's position in the virtual texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texel {
    /// Level, row and column of the tile that the pixel requests.
    pub tile: [u32; 3],
    /// Level of the tile that the pixel shows.
    pub shown_level: u32,
    pub coordinates: [f32; 2],
    /// ds/dx, dt/dx, ds/dy, dt/dy.
    pub derivatives: [f32; 4],
}

impl Probe {
    /// Reads the values copied two frames ago. Copies the values of pixel `at` from the frame's images; `picture` has
    /// the pixel's colour.
    ///
    /// # Errors
    /// Out of memory.
    pub fn step(
        &mut self,
        gpu: &Gpu,
        frame: &mut Frame<'_>,
        view: &View,
        (target, picture, LaidOpen { levels, faces, has_misses }): (&Target, &Image, LaidOpen<'_>),
        at: Option<[i32; 2]>,
    ) -> Result<()> {
        if let Some(queries) = self.queries[view.slot()].take() {
            self.found = Some(queries.read());
        }
        let inside = |at: [i32; 2]| {
            let at = [u32::try_from(at[0]).ok()?, u32::try_from(at[1]).ok()?];
            (at[0] < view.size[0] && at[1] < view.size[1]).then_some(at)
        };
        let Some(at) = at.and_then(inside) else {
            self.found = None;
            return Ok(());
        };
        let mut images = vec![picture, &*target.depth];
        images.extend(faces);
        images.extend(
            levels
                .iter()
                .flat_map(|levels| [&levels.shown.image, &levels.open.coordinates, &levels.open.derivatives]),
        );
        let buffer = gpu.buffer("probe", STRIDE * images.len() as u64, BufferUse::Readback)?;
        frame.pass("probe", |cmd| {
            for (n, image) in (0..).zip(images) {
                let copy = TexelCopy { offset: STRIDE * n, mip: 0, layer: 0, at, size: [1, 1] };
                cmd.copy_from_image(image, &buffer, &[copy]);
            }
        })?;
        let (near_m, has_meshes, has_texture) = (view.pose.near_m, faces.is_some(), levels.is_some());
        self.queries[view.slot()] = Some(Query { buffer, at, near_m, has_meshes, has_misses, has_texture });
        Ok(())
    }
}

impl Query {
    fn read(&self) -> ProbedPixel {
        let texels = self.buffer.mapped::<[u32; 4]>();
        let words = |n: usize| texels[n];
        let floats = |n: usize| words(n).map(f32::from_bits);
        let [red, green, blue, _] = words(0)[0].to_ne_bytes();
        let [depth, ..] = floats(1);
        let face = || {
            let [instance, face, level, word] = words(2);
            let misses = self.has_misses.then_some(word & 3);
            (instance != u32::MAX).then_some(Face { instance, face, level, misses })
        };
        let first = 2 + usize::from(self.has_meshes);
        let texel = || {
            let ([level, row, column, shown_level], [s, t, ..]) = (words(first), floats(first + 1));
            let texel = Texel {
                tile: [level, row, column],
                shown_level,
                coordinates: [s, t],
                derivatives: floats(first + 2),
            };
            (level != u32::MAX).then_some(texel)
        };
        ProbedPixel {
            at: self.at,
            srgb: [red, green, blue],
            // Depth is reversed: 0 is infinitely far.
            distance_m: (depth > 0.0).then(|| self.near_m / f64::from(depth)),
            face: self.has_meshes.then(face).flatten(),
            texel: self.has_texture.then(texel).flatten(),
        }
    }
}

/// The ellipse that a pixel's disc covers in the texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbedEllipse {
    /// Both full axes in texels of level 0, the longer first.
    pub axes_texels: [f64; 2],
    /// The Jacobian in texels of level 0 per pixel. Its columns are the derivatives with respect to x and y.
    pub jacobian: DMat2,
}

impl Texel {
    /// The footprint of paper 1, section 2.1, as an ellipse: the image of a disc one pixel wide, in a texture of `size`
    /// texels. The axes are the singular values of the Jacobian. `None` if the Jacobian is not finite.
    pub fn ellipse(&self, size: [u32; 2]) -> Option<ProbedEllipse> {
        let [s_x, t_x, s_y, t_y] = self.derivatives.map(f64::from);
        let [width, height] = size.map(f64::from);
        let jacobian = DMat2::from_cols_array(&[s_x * width, t_x * height, s_y * width, t_y * height]);
        let squares = jacobian.transpose() * jacobian;
        let (half_trace, det) = (0.5 * (squares.x_axis.x + squares.y_axis.y), squares.determinant());
        let root = (half_trace * half_trace - det).max(0.0).sqrt();
        let axes = [half_trace + root, (half_trace - root).max(0.0)].map(f64::sqrt);
        jacobian.is_finite().then_some(ProbedEllipse { axes_texels: axes, jacobian })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axes_of_a_turned_footprint_are_its_stretches() {
        // The Jacobian stretches by 6 and 2 texels along axes rotated by 0.5 rad. A rotation of the pixel's
        // axes does not change the ellipse.
        let (turn, own) = (DMat2::from_angle(0.5), DMat2::from_angle(1.1));
        let jacobian = turn * DMat2::from_diagonal(glam::DVec2::new(6.0, 2.0)) * own;
        let [a, b, c, d] = jacobian.to_cols_array();
        let derivatives = [a / 1024.0, b / 512.0, c / 1024.0, d / 512.0].map(|x| x as f32);
        let texel = Texel { tile: [0; 3], shown_level: 0, coordinates: [0.0; 2], derivatives };
        let [major, minor] = texel.ellipse([1024, 512]).unwrap().axes_texels;
        // The tolerance is the rounding error of the f32 derivatives.
        assert!((major - 6.0).abs() < 1e-5 && (minor - 2.0).abs() < 1e-5, "{major} {minor}");
        assert_eq!(Texel { derivatives: [f32::NAN; 4], ..texel }.ellipse([1024, 512]), None);
    }
}
