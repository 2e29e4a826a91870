//! Pictures in linear light, measures of their difference, and their files.

pub mod error;
pub mod flip;
pub mod map;
pub mod measures;
pub mod read;
pub mod srgb;
pub mod write;

/// Pixel format of a rendered picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PixelFormat {
    /// 8 bits of sRGB, for PNG and the screen.
    Srgb8,
    /// f32 of linear light, for EXR and comparisons.
    Linear32,
}

/// Pixels in linear light, rows from the top, alpha not premultiplied.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    /// `width x height` pixels: red, green, blue, alpha.
    pub rgba: Vec<[f32; 4]>,
}

impl Picture {
    /// A picture of one colour.
    pub fn filled(width: u32, height: u32, rgba: [f32; 4]) -> Picture {
        Picture { width, height, rgba: vec![rgba; width as usize * height as usize] }
    }

    /// A picture of given pixels.
    pub fn new(width: u32, height: u32, rgba: Vec<[f32; 4]>) -> Picture {
        assert_eq!(rgba.len(), width as usize * height as usize, "pixels of {width} x {height}");
        Picture { width, height, rgba }
    }

    /// One pixel; column `x` from the left, row `y` from the top.
    pub fn at(&self, x: u32, y: u32) -> [f32; 4] {
        assert!(x < self.width && y < self.height, "({x}, {y}) in {} x {}", self.width, self.height);
        self.rgba[y as usize * self.width as usize + x as usize]
    }
}
