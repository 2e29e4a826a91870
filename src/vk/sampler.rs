//! Samplers.

use super::device::{Dead, Device};
use super::{Check, Feature, Gpu, Result};
use ash::vk;
use std::sync::Arc;

/// How a sampler filters between texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SamplerFilter {
    Nearest,
    /// Bilinear within a level, linear between levels.
    Linear,
}

#[derive(Clone, Copy, Debug)]
pub struct SamplerInfo {
    pub filter: SamplerFilter,
    /// True: s repeats. False: s clamps. t always clamps.
    pub wraps_in_s: bool,
}

pub struct Sampler {
    pub(crate) handle: vk::Sampler,
    device: Arc<Device>,
}

impl Gpu {
    pub fn sampler(&self, name: &str, info: SamplerInfo) -> Result<Sampler> {
        let edge = vk::SamplerAddressMode::CLAMP_TO_EDGE;
        let in_s = if info.wraps_in_s { vk::SamplerAddressMode::REPEAT } else { edge };
        self.create_sampler(name, info.filter, [in_s, edge], 1)
    }

    /// A sampler for a texture that tiles the plane. `max_anisotropy` above 1 selects the device's
    /// anisotropic filter with at most that many samples, or the device's own maximum if that is lower. The
    /// device must have been opened with [`Feature::SamplerAnisotropy`].
    ///
    /// # Errors
    /// Out of memory.
    pub fn tiling_sampler(&self, name: &str, max_anisotropy: u32) -> Result<Sampler> {
        let allowed = max_anisotropy == 1 || self.has(Feature::SamplerAnisotropy);
        assert!(allowed, "{name}: the device was opened without samplerAnisotropy");
        self.create_sampler(name, SamplerFilter::Linear, [vk::SamplerAddressMode::REPEAT; 2], max_anisotropy)
    }

    fn create_sampler(
        &self,
        name: &str,
        filter: SamplerFilter,
        [in_s, in_t]: [vk::SamplerAddressMode; 2],
        max_anisotropy: u32,
    ) -> Result<Sampler> {
        let (texels, levels) = match filter {
            SamplerFilter::Nearest => (vk::Filter::NEAREST, vk::SamplerMipmapMode::NEAREST),
            SamplerFilter::Linear => (vk::Filter::LINEAR, vk::SamplerMipmapMode::LINEAR),
        };
        let max = self.device.physical.limits.max_sampler_anisotropy;
        let create = vk::SamplerCreateInfo::default()
            .mag_filter(texels)
            .min_filter(texels)
            .mipmap_mode(levels)
            .address_mode_u(in_s)
            .address_mode_v(in_t)
            .anisotropy_enable(max_anisotropy > 1)
            .max_anisotropy((max_anisotropy as f32).min(max))
            .max_lod(vk::LOD_CLAMP_NONE);
        // SAFETY: the device lives.
        let handle =
            unsafe { self.device.handle.create_sampler(&create, None) }.check("vkCreateSampler", name)?;
        self.device.name(handle, name);
        Ok(Sampler { handle, device: self.device.clone() })
    }
}

impl Drop for Sampler {
    fn drop(&mut self) {
        self.device.bury(Dead::Sampler(self.handle));
    }
}
