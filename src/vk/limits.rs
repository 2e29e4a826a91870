//! Checks against the device's limits, before an object is created.

use super::shader::DescriptorKind;
use super::{BufferUse, Error, Gpu, Result};
use ash::vk::PhysicalDeviceLimits;

fn require(fits: bool, object: &str, what: impl FnOnce() -> String) -> Result<()> {
    if fits { Ok(()) } else { Err(Error::limit(object, what())) }
}

/// The size of a two-dimensional dispatch of at least this many groups. One dimension is not enough, because a device
/// may allow only 65,535 groups in it. Shaders compute a group's number with `common/line.glsl`.
pub fn group_line(groups: u64) -> [u32; 3] {
    let rows = groups.div_ceil(32_768).max(1);
    [groups.div_ceil(rows) as u32, rows as u32, 1]
}

/// Checks the number of groups of a dispatch.
pub(super) fn require_groups(limits: &PhysicalDeviceLimits, pipeline: &str, groups: [u32; 3]) -> Result<()> {
    let max = limits.max_compute_work_group_count;
    require((0..3).all(|axis| groups[axis] <= max[axis]), pipeline, || {
        format!("needs {groups:?} workgroups; this device supports {max:?}; choose a smaller picture or mesh")
    })
}

/// Checks the workgroup of a compute shader.
fn require_workgroup(limits: &PhysicalDeviceLimits, name: &str, group: [u32; 3]) -> Result<()> {
    let (invocations, max) = (group.iter().product::<u32>(), limits.max_compute_work_group_invocations);
    require(invocations <= max, name, || {
        format!("needs workgroups of {invocations}; this device supports {max}; choose another variant")
    })?;
    let max = limits.max_compute_work_group_size;
    require((0..3).all(|axis| group[axis] <= max[axis]), name, || {
        format!("needs workgroups of {group:?}; this device supports {max:?}; choose another variant")
    })
}

/// Checks the number of storage buffers of a pipeline. Every stage sees all of them, so the limit per stage applies.
fn require_descriptors(
    limits: &PhysicalDeviceLimits,
    name: &str,
    descriptors: &[(u32, DescriptorKind)],
) -> Result<()> {
    let buffers = descriptors.iter().filter(|(_, kind)| *kind == DescriptorKind::StorageBuffer).count();
    let max = limits.max_per_stage_descriptor_storage_buffers;
    require(buffers as u64 <= u64::from(max), name, || {
        format!(
            "needs {buffers} storage buffers; this device supports {max} per stage; choose another variant"
        )
    })
}

impl Gpu {
    /// Rejects a device that cannot draw: lavapipe crashes in draws with vectors of 512 bits. Its default is 256 or 128
    /// bits, and compute shaders run with all widths.
    ///
    /// # Errors
    /// [`Error::Limit`]
    pub fn require_drawing(&self) -> Result<()> {
        let name = &self.device.physical.name;
        let crashes = name.starts_with("llvmpipe") && name.contains("512 bits");
        let what = "lavapipe crashes with vectors of 512 bits; unset LP_NATIVE_VECTOR_WIDTH";
        require(!crashes, name, || what.into())
    }

    /// Checks that a geometry shader may emit this many points and components and run this many invocations.
    ///
    /// # Errors
    /// [`Error::Limit`] names the exceeded limit and both numbers.
    pub fn require_geometry(&self, name: &str, points: u32, components: u32, invocations: u32) -> Result<()> {
        let limits = &self.device.physical.limits;
        let checks = [
            ("maxGeometryOutputVertices", points, limits.max_geometry_output_vertices),
            ("maxGeometryTotalOutputComponents", components, limits.max_geometry_total_output_components),
            ("maxGeometryShaderInvocations", invocations, limits.max_geometry_shader_invocations),
        ];
        checks.into_iter().try_for_each(|(limit, wanted, max)| {
            require(wanted <= max, name, || {
                format!("needs {limit} = {wanted}; this device has {max}; choose smaller blocks")
            })
        })
    }

    /// Checks a pipeline's workgroup (1 x 1 x 1 without a compute shader) and its descriptors.
    pub(super) fn require_pipeline(
        &self,
        name: &str,
        group: [u32; 3],
        descriptors: &[(u32, DescriptorKind)],
    ) -> Result<()> {
        let limits = &self.device.physical.limits;
        require_workgroup(limits, name, group)?;
        require_descriptors(limits, name, descriptors)
    }

    /// Checks that a workgroup may use this many bytes of shared memory. `advice` says what to do if it may
    /// not.
    ///
    /// # Errors
    /// [`Error::Limit`] with both numbers.
    pub fn require_shared(&self, name: &str, bytes: u64, advice: &str) -> Result<()> {
        let max = self.device.physical.shared_bytes;
        require(bytes <= u64::from(max), name, || {
            format!(
                "needs {bytes} bytes of shared memory for each workgroup; this device has {max}; {advice}"
            )
        })
    }

    /// Checks that shaders can address a storage buffer of this size. `advice` says what to do if they cannot.
    ///
    /// # Errors
    /// [`Error::Limit`] with both numbers.
    pub fn require_storage(&self, name: &str, bytes: u64, advice: &str) -> Result<()> {
        let max = u64::from(self.device.physical.limits.max_storage_buffer_range);
        require(bytes <= max, name, || {
            format!("needs {bytes} bytes; this device's shaders can address {max}; {advice}")
        })
    }

    /// Checks that indices may address this many vertices.
    ///
    /// # Errors
    /// [`Error::Limit`] with both numbers.
    pub fn require_indices(&self, name: &str, vertices: usize) -> Result<()> {
        let max = u64::from(self.device.physical.limits.max_draw_indexed_index_value) + 1;
        require(vertices as u64 <= max, name, || {
            format!(
                "needs {vertices} vertices; this device's indices can address {max}; choose a coarser mesh"
            )
        })
    }

    /// Returns an error if an image may not have this many layers. `advice` says what the layers are and what
    /// to do.
    ///
    /// # Errors
    /// [`Error::Limit`] with both numbers.
    pub fn require_layers(&self, name: &str, layers: u32, advice: impl FnOnce() -> String) -> Result<()> {
        let max = self.device.physical.limits.max_image_array_layers;
        require(layers <= max, name, || {
            format!("needs {layers} layers; this device supports {max}: {}", advice())
        })
    }

    /// Returns an error if the device's limits forbid a buffer of this size for this use.
    ///
    /// # Errors
    /// [`Error::Limit`] with both numbers.
    pub fn require_buffer(&self, name: &str, bytes: u64, usage: BufferUse) -> Result<()> {
        let physical = &self.device.physical;
        let texels = 4 * u64::from(physical.limits.max_texel_buffer_elements);
        let storage = u64::from(physical.limits.max_storage_buffer_range);
        let (whose, max, advice) = match usage {
            BufferUse::Storage => {
                ("shaders can address", storage, "take larger tiles, or lower variant.list_capacity")
            }
            BufferUse::WritableIndices(_) => {
                ("shaders can address", storage, "show fewer instances, or apply levels on the CPU")
            }
            BufferUse::FetchedStorage => ("shaders can address", storage.min(texels), "take larger tiles"),
            BufferUse::Texels => ("texel buffers can hold", texels, "take larger tiles"),
            BufferUse::TransformFeedback => (
                "transform feedback can write",
                physical.max_feedback_bytes,
                "lower variant.list_capacity, or show fewer tiles",
            ),
            _ => ("buffers can hold", u64::MAX, "take a smaller mesh"),
        };
        let max = max.min(physical.max_buffer_bytes);
        require(bytes <= max, name, || format!("needs {bytes} bytes; this device's {whose} {max}; {advice}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The least limits that Vulkan allows.
    fn min() -> PhysicalDeviceLimits {
        PhysicalDeviceLimits {
            max_compute_work_group_count: [65_535; 3],
            max_compute_work_group_invocations: 128,
            max_compute_work_group_size: [128, 128, 64],
            max_per_stage_descriptor_storage_buffers: 4,
            ..PhysicalDeviceLimits::default()
        }
    }

    #[test]
    fn a_line_of_groups_is_long_enough_and_every_device_can_dispatch_it() {
        for groups in [0, 1, 32_768, 32_769, 65_536, 140_625, 1 << 24, 1 << 30] {
            let [x, y, z] = group_line(groups);
            let found = u64::from(x) * u64::from(y);
            // There are fewer idle groups than rows.
            assert!(groups <= found && found < groups.max(1) + u64::from(y), "{groups}: {x} x {y}");
            assert_eq!(z, 1);
            require_groups(&min(), "line", [x, y, z]).unwrap();
        }
    }

    #[test]
    fn too_many_groups_are_refused_with_the_pipelines_name() {
        assert!(require_groups(&min(), "walk", [65_535; 3]).is_ok());
        // 9 million pixels in groups of 64.
        for groups in [[140_625, 1, 1], [1, 65_536, 1], [1, 1, 65_536]] {
            let line = require_groups(&min(), "walk", groups).unwrap_err().to_string();
            assert!(line.starts_with("walk: needs [") && line.contains("65535"), "{line}");
        }
    }

    #[test]
    fn workgroups_and_storage_buffers_beyond_a_limit_are_refused() {
        assert!(require_workgroup(&min(), "wide", [128, 1, 1]).is_ok());
        for group in [[256, 1, 1], [16, 16, 1], [1, 1, 65]] {
            let line = require_workgroup(&min(), "wide", group).unwrap_err().to_string();
            assert!(line.starts_with("wide: needs workgroups of "), "{line}");
        }
        let buffers = [0, 1, 2, 3, 4].map(|binding| (binding, DescriptorKind::StorageBuffer));
        assert!(require_descriptors(&min(), "many", &buffers[..4]).is_ok());
        let textures = [(5, DescriptorKind::SampledImage), (6, DescriptorKind::TexelBuffer)];
        assert!(require_descriptors(&min(), "many", &[&buffers[..4], &textures].concat()).is_ok());
        let line = require_descriptors(&min(), "many", &buffers).unwrap_err().to_string();
        assert!(line.contains("needs 5 storage buffers; this device supports 4"), "{line}");
    }
}
