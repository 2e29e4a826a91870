//! The reference of the settled picture: the f64 mean over each pixel's footprint, in windows spread over the picture.

use crate::math::camera::Pose;
use crate::model::mesh::SourceMesh;
use crate::paper::virtual_texture::reference::picture::{ReferenceFilter, SourceTexels};
use crate::picture::{Picture, srgb};
use crate::reference::ReferenceView;
use crate::scene::choices;
use crate::texture::source::TileSource;

/// Maximum number of pixels of the reference. A pixel takes 10 to 200 us, so the reference takes seconds.
const MAX_PIXELS: u32 = 57_600;
/// Windows of larger pictures: the side in pixels, and the maximum numbers of windows across and down.
const WINDOW: u32 = 32;
const ACROSS: [u32; 2] = [10, 5];

choices! {
    /// The weights of a pixel's samples in the reference.
    pub enum TradeKernel {
        /// A Gaussian with a standard deviation of half a pixel, as in the filter "ellipse".
        Gaussian = "gaussian",
        /// Equal weights in the pixel's square. Favours filters that take samples along the footprint.
        Box = "box",
    }
}

impl TradeKernel {
    pub fn filter(self) -> ReferenceFilter {
        match self {
            TradeKernel::Gaussian => ReferenceFilter::Gaussian,
            TradeKernel::Box => ReferenceFilter::Area,
        }
    }

    pub fn describe(self) -> &'static str {
        match self {
            TradeKernel::Gaussian => {
                "the f64 mean over each pixel's footprint, weighted by a Gaussian (standard deviation 0.5 pixels, \
                 radius 1)"
            }
            TradeKernel::Box => "the f64 mean over each pixel's footprint (a box of one pixel)",
        }
    }
}

/// The reference at some pixels of a picture, as a mosaic of their windows.
pub struct Mosaic {
    pub picture: Picture,
    what: &'static str,
    size: [u32; 2],
    windows: Windows,
    /// True for pixels that the textured surface covers together with all their neighbours.
    inside: Vec<bool>,
}

/// Equally spaced windows of a picture.
struct Windows {
    count: [u32; 2],
    side: [u32; 2],
}

impl Windows {
    fn of(size: [u32; 2]) -> Windows {
        if size[0] * size[1] <= MAX_PIXELS {
            return Windows { count: [1, 1], side: size };
        }
        let side = size.map(|pixels| pixels.min(WINDOW));
        Windows { count: [0, 1].map(|n| (size[n] / side[n]).min(ACROSS[n])), side }
    }

    /// Width and height of the mosaic.
    fn mosaic(&self) -> [u32; 2] {
        [0, 1].map(|n| self.count[n] * self.side[n])
    }

    /// The position of a mosaic pixel in a picture of `size`. The outer windows touch the picture's edges.
    fn place(&self, size: [u32; 2], at: [u32; 2]) -> [u32; 2] {
        [0, 1].map(|n| {
            let (window, inner) = (at[n] / self.side[n], at[n] % self.side[n]);
            let free = size[n] - self.side[n];
            match self.count[n] {
                1 => free / 2 + inner,
                count => window * free / (count - 1) + inner,
            }
        })
    }
}

impl Mosaic {
    /// The picture of a textured mesh.
    ///
    /// # Errors
    /// A tile that cannot be read.
    pub fn new(
        source: &dyn TileSource,
        mesh: &SourceMesh,
        pose: &Pose,
        size: [u32; 2],
        kernel: TradeKernel,
    ) -> anyhow::Result<Mosaic> {
        let view = ReferenceView::new(mesh, &pose.world_to_clip(size[0], size[1]), pose.eye, size);
        let texels = SourceTexels::new(source);
        let pixel = |x, y| Some(texels.pixel(&view.sample(x, y)?, kernel.filter()));
        let seen = |x, y| view.sample(x, y).is_some();
        let mosaic = Mosaic::of(size, kernel.describe(), seen, pixel);
        texels.check()?;
        Ok(mosaic)
    }

    /// `what` names the reference. `seen` is true for pixels that the surface covers. `pixel` is the linear colour of a
    /// pixel that is compared.
    pub fn of(
        size: [u32; 2],
        what: &'static str,
        seen: impl Fn(u32, u32) -> bool,
        pixel: impl Fn(u32, u32) -> Option<[f64; 4]>,
    ) -> Mosaic {
        let windows = Windows::of(size);
        let [columns, rows] = windows.mosaic();
        let (mut rgba, mut inside) = (Vec::new(), Vec::new());
        for at in (0..columns * rows).map(|n| [n % columns, n / columns]) {
            let [x, y] = windows.place(size, at);
            let colour = covered(size, [x, y], &seen).then(|| pixel(x, y)).flatten();
            inside.push(colour.is_some());
            rgba.push(colour.map_or(BLACK, |colour| colour.map(|channel| channel as f32)));
        }
        Mosaic { picture: Picture::new(columns, rows, rgba), what, size, windows, inside }
    }

    /// The same pixels of a settled picture, given as sRGB bytes. Pixels at the textured surface's outline are black,
    /// as in the reference.
    pub fn cut(&self, bytes: &[u8]) -> Picture {
        let Picture { width, height, .. } = self.picture;
        assert_eq!(
            bytes.len(),
            4 * self.size[0] as usize * self.size[1] as usize,
            "bytes of {:?}",
            self.size
        );
        let pixel = |n: u32| {
            let [x, y] = self.windows.place(self.size, [n % width, n / width]);
            let at = 4 * (y as usize * self.size[0] as usize + x as usize);
            let [r, g, b] = [0, 1, 2].map(|c| srgb::to_linear_f64(bytes[at + c]) as f32);
            if self.inside[n as usize] { [r, g, b, 1.0] } else { BLACK }
        };
        Picture::new(width, height, (0..width * height).map(pixel).collect())
    }

    /// Describes the reference in words, for reports.
    pub fn describe(&self) -> String {
        let [columns, rows] = self.windows.mosaic();
        let counted = self.inside.iter().filter(|inside| **inside).count();
        let place = match [columns, rows] == self.size {
            true => "in the whole picture".to_string(),
            false => {
                let ([across, down], [width, height]) = (self.windows.count, self.windows.side);
                format!("in {across} x {down} windows of {width} x {height} pixels")
            }
        };
        format!(
            "Errors are those of the settled picture, in 8 bits of sRGB, against {}, {place}: {counted} of {} pixels; \
             the others lie beyond the textured surface or at its outline.",
            self.what,
            self.inside.len()
        )
    }
}

const BLACK: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// True if the surface covers a pixel and its neighbours.
fn covered([width, height]: [u32; 2], [x, y]: [u32; 2], seen: &impl Fn(u32, u32) -> bool) -> bool {
    let [right, bottom] = [(x + 1).min(width - 1), (y + 1).min(height - 1)];
    (y.saturating_sub(1)..=bottom).all(|y| (x.saturating_sub(1)..=right).all(|x| seen(x, y)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_lie_inside_the_picture_and_reach_its_corners() {
        for size in [[64, 36], [320, 180], [1920, 1080], [16384, 64], [321, 180], [20, 16384]] {
            let windows = Windows::of(size);
            let mosaic = windows.mosaic();
            assert!(mosaic[0] * mosaic[1] <= MAX_PIXELS, "{size:?}");
            let last = windows.place(size, mosaic.map(|side| side - 1));
            assert!((0..2).all(|n| last[n] < size[n]), "{size:?}: {last:?}");
            if windows.count.iter().all(|&count| count > 1) {
                assert_eq!((windows.place(size, [0, 0]), last), ([0, 0], size.map(|side| side - 1)));
            }
        }
        assert_eq!(Windows::of([320, 180]).mosaic(), [320, 180]);
        assert_eq!(Windows::of([1920, 1080]).mosaic(), [320, 160]);
    }
}
