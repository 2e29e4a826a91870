//! Device features by name. A scene's passes list the features they need; no others are enabled.

use super::{Error, Result};
use ash::{ext, khr, vk};
use std::ffi::CStr;

/// An optional device feature that one of our passes can use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Feature {
    GeometryShader,
    LogicOp,
    TransformFeedback,
    TextureCompressionBc,
    /// Atomics and stores in fragment shaders.
    FragmentStores,
    /// Storage buffers of bytes.
    ByteStores,
    /// Subgroup votes, ballots and prefix sums in compute shaders.
    Subgroups,
    /// Counts of shader invocations.
    PipelineStatistics,
    /// The device's own anisotropic filter.
    SamplerAnisotropy,
    /// 64-bit integers in shaders.
    Int64,
}

impl Feature {
    pub const ALL: [Feature; 10] = [
        Feature::GeometryShader,
        Feature::LogicOp,
        Feature::TransformFeedback,
        Feature::TextureCompressionBc,
        Feature::FragmentStores,
        Feature::ByteStores,
        Feature::Subgroups,
        Feature::PipelineStatistics,
        Feature::SamplerAnisotropy,
        Feature::Int64,
    ];

    /// Vulkan's own name.
    pub fn name(self) -> &'static str {
        match self {
            Feature::GeometryShader => "geometryShader",
            Feature::LogicOp => "logicOp",
            Feature::TransformFeedback => "transformFeedback (VK_EXT_transform_feedback)",
            Feature::TextureCompressionBc => "textureCompressionBC",
            Feature::FragmentStores => "fragmentStoresAndAtomics",
            Feature::ByteStores => "storageBuffer8BitAccess",
            Feature::Subgroups => "subgroup vote, ballot and arithmetic in compute shaders",
            Feature::PipelineStatistics => "pipelineStatisticsQuery",
            Feature::SamplerAnisotropy => "samplerAnisotropy",
            Feature::Int64 => "shaderInt64",
        }
    }
}

/// A feature, the pass that needs it, and the variant that works without it. If the feature is missing, the error
/// message states all three.
#[derive(Clone, Copy, Debug)]
pub struct Need {
    pub feature: Feature,
    pub pass: &'static str,
    pub without: &'static str,
}

impl Need {
    fn missing(&self, device: &str) -> Error {
        let Need { feature, pass, without } = *self;
        Error::MissingFeature { device: device.to_owned(), feature: feature.name(), pass, without }
    }

    /// # Errors
    /// [`Error::MissingFeature`] for the first need whose feature is missing (`has` returns false).
    pub(super) fn check_all(needs: &[Need], device: &str, has: impl Fn(Feature) -> bool) -> Result<()> {
        needs.iter().find(|need| !has(need.feature)).map_or(Ok(()), |need| Err(need.missing(device)))
    }
}

/// The capabilities of a device: the features of [`Feature::ALL`] that it has, scalar block layout (which every pass
/// needs), presentation, and its subgroup size.
#[derive(Clone, Debug, Default)]
pub(crate) struct Offered {
    pub(crate) features: Vec<Feature>,
    pub(crate) scalar_block_layout: bool,
    /// True if the device implements only a subset of Vulkan. VK_KHR_portability_subset must then be enabled; the
    /// missing parts are not used.
    pub(crate) portability_subset: bool,
    /// True if the device can present to windows (VK_KHR_swapchain).
    pub(crate) swapchain: bool,
    /// Lanes per subgroup.
    pub(crate) subgroup_size: u32,
}

/// Queries a device of Vulkan 1.3 or later.
pub(crate) fn offered(
    instance: &ash::Instance,
    device: vk::PhysicalDevice,
    extensions: &[String],
) -> Offered {
    let has_extension = |name: &CStr| extensions.iter().any(|e| e.as_bytes() == name.to_bytes());
    let mut feedback = vk::PhysicalDeviceTransformFeedbackFeaturesEXT::default();
    let mut v12 = vk::PhysicalDeviceVulkan12Features::default();
    let mut all = vk::PhysicalDeviceFeatures2::default().push_next(&mut v12);
    if has_extension(ext::transform_feedback::NAME) {
        all = all.push_next(&mut feedback);
    }
    // SAFETY: the chain lives on this stack frame; the physical device is the instance's.
    unsafe { instance.get_physical_device_features2(device, &mut all) };
    let core = all.features;
    let subgroup = subgroup(instance, device);
    let lanes = vk::SubgroupFeatureFlags::BASIC
        | vk::SubgroupFeatureFlags::VOTE
        | vk::SubgroupFeatureFlags::BALLOT
        | vk::SubgroupFeatureFlags::ARITHMETIC;
    let has = |feature: &Feature| match feature {
        Feature::GeometryShader => core.geometry_shader == vk::TRUE,
        Feature::LogicOp => core.logic_op == vk::TRUE,
        Feature::TransformFeedback => feedback.transform_feedback == vk::TRUE,
        Feature::TextureCompressionBc => core.texture_compression_bc == vk::TRUE,
        Feature::FragmentStores => core.fragment_stores_and_atomics == vk::TRUE,
        Feature::ByteStores => v12.storage_buffer8_bit_access == vk::TRUE,
        Feature::PipelineStatistics => core.pipeline_statistics_query == vk::TRUE,
        Feature::SamplerAnisotropy => core.sampler_anisotropy == vk::TRUE,
        Feature::Int64 => core.shader_int64 == vk::TRUE,
        Feature::Subgroups => {
            subgroup.supported_operations.contains(lanes)
                && subgroup.supported_stages.contains(vk::ShaderStageFlags::COMPUTE)
        }
    };
    Offered {
        features: Feature::ALL.into_iter().filter(has).collect(),
        scalar_block_layout: v12.scalar_block_layout == vk::TRUE,
        portability_subset: has_extension(khr::portability_subset::NAME),
        swapchain: has_extension(khr::swapchain::NAME),
        subgroup_size: subgroup.subgroup_size,
    }
}

fn subgroup(
    instance: &ash::Instance,
    device: vk::PhysicalDevice,
) -> vk::PhysicalDeviceSubgroupProperties<'static> {
    let mut subgroup = vk::PhysicalDeviceSubgroupProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut subgroup);
    // SAFETY: the chain lives on this stack frame; the physical device is the instance's.
    unsafe { instance.get_physical_device_properties2(device, &mut properties) };
    vk::PhysicalDeviceSubgroupProperties { p_next: std::ptr::null_mut(), ..subgroup }
}

impl Offered {
    /// # Errors
    /// [`Error::MissingFeature`] for the first need that the device does not meet; [`Error::Limit`] if `presents` is
    /// true and the device cannot present.
    pub(crate) fn require(&self, device: &str, needs: &[Need], presents: bool) -> Result<()> {
        Need::check_all(needs, device, |feature| self.features.contains(&feature))?;
        if !self.scalar_block_layout {
            return Err(Error::MissingFeature {
                device: device.to_string(),
                feature: "scalarBlockLayout",
                pass: "every pass",
                without: "every variant needs it; choose another --device",
            });
        }
        if presents && !self.swapchain {
            return Err(cannot_present(device));
        }
        Ok(())
    }
}

pub(super) fn cannot_present(device: &str) -> Error {
    Error::limit("window", format!("{device} cannot present to this window; choose another --device"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const NEED: Need = Need { feature: Feature::LogicOp, pass: "dedup", without: "choose the other variant" };

    fn offered(features: &[Feature]) -> Offered {
        Offered {
            features: features.to_vec(),
            scalar_block_layout: true,
            subgroup_size: 8,
            ..Offered::default()
        }
    }

    #[test]
    fn a_missing_feature_is_refused_with_its_name_the_pass_and_the_alternative() {
        for feature in Feature::ALL {
            let others: Vec<_> = Feature::ALL.into_iter().filter(|other| *other != feature).collect();
            let need = Need { feature, ..NEED };
            let line = offered(&others).require("Some GPU", &[need], false).unwrap_err().to_string();
            for word in ["Some GPU", feature.name(), "\"dedup\"", "choose the other variant"] {
                assert!(line.contains(word), "no {word:?} in: {line}");
            }
            assert!(
                offered(&Feature::ALL).require("Some GPU", &[need], false).is_ok(),
                "{feature:?} is there"
            );
        }
    }

    #[test]
    fn the_first_unmet_need_is_the_one_reported() {
        let needs = [
            NEED,
            Need { feature: Feature::GeometryShader, pass: "other", ..NEED },
            Need { feature: Feature::TransformFeedback, pass: "third", ..NEED },
        ];
        let line = offered(&[Feature::LogicOp]).require("Some GPU", &needs, false).unwrap_err().to_string();
        assert!(line.contains("\"other\"") && line.contains("geometryShader"), "{line}");
    }

    #[test]
    fn unneeded_features_may_be_missing_but_scalar_block_layout_may_not() {
        assert!(offered(&[Feature::LogicOp]).require("Some GPU", &[NEED], false).is_ok());
        assert!(offered(&[]).require("Some GPU", &[], false).is_ok());
        let bare = Offered { scalar_block_layout: false, ..offered(&Feature::ALL) };
        let line = bare.require("Some GPU", &[], false).unwrap_err().to_string();
        assert!(line.contains("scalarBlockLayout") && line.contains("--device"), "{line}");
    }

    #[test]
    fn a_device_without_swapchains_is_refused_for_a_window_only() {
        assert!(offered(&[]).require("Some GPU", &[], false).is_ok());
        let line = offered(&[]).require("Some GPU", &[], true).unwrap_err().to_string();
        assert!(line.contains("Some GPU cannot present") && line.contains("--device"), "{line}");
        assert!(Offered { swapchain: true, ..offered(&[]) }.require("Some GPU", &[], true).is_ok());
    }
}
