//! Formats of images.

use crate::picture::PixelFormat;
use ash::vk;

/// Supported formats, named by the content of a texel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Four bytes, sRGB: filtered in linear light.
    Rgba8Srgb,
    /// Four bytes without sRGB decoding.
    Rgba8,
    /// Like `Rgba8` with blue first; the format of most windows.
    Bgra8,
    Bc1Srgb,
    R32Uint,
    Rgb32Uint,
    Rgba32Uint,
    Rgba32Float,
    Depth32Float,
}

/// The format of the image into which a picture of this pixel format is rendered.
impl From<PixelFormat> for Format {
    fn from(target: PixelFormat) -> Format {
        match target {
            PixelFormat::Srgb8 => Format::Rgba8Srgb,
            PixelFormat::Linear32 => Format::Rgba32Float,
        }
    }
}

impl Format {
    pub(crate) fn vk(self) -> vk::Format {
        match self {
            Format::Rgba8Srgb => vk::Format::R8G8B8A8_SRGB,
            Format::Rgba8 => vk::Format::R8G8B8A8_UNORM,
            Format::Bgra8 => vk::Format::B8G8R8A8_UNORM,
            Format::Bc1Srgb => vk::Format::BC1_RGB_SRGB_BLOCK,
            Format::R32Uint => vk::Format::R32_UINT,
            Format::Rgb32Uint => vk::Format::R32G32B32_UINT,
            Format::Rgba32Uint => vk::Format::R32G32B32A32_UINT,
            Format::Rgba32Float => vk::Format::R32G32B32A32_SFLOAT,
            Format::Depth32Float => vk::Format::D32_SFLOAT,
        }
    }

    /// Bytes of `width x height` texels, tightly packed.
    pub fn bytes(self, [width, height]: [u32; 2]) -> u64 {
        let (width, height) = (u64::from(width), u64::from(height));
        match self {
            Format::Bc1Srgb => width.div_ceil(4) * height.div_ceil(4) * 8,
            Format::Rgba8Srgb | Format::Rgba8 | Format::Bgra8 | Format::R32Uint | Format::Depth32Float => {
                width * height * 4
            }
            Format::Rgb32Uint => width * height * 12,
            Format::Rgba32Uint | Format::Rgba32Float => width * height * 16,
        }
    }

    pub(crate) fn aspect(self) -> vk::ImageAspectFlags {
        match self {
            Format::Depth32Float => vk::ImageAspectFlags::DEPTH,
            _ => vk::ImageAspectFlags::COLOR,
        }
    }
}
