//! Checks against the device's limits, before an object is created.

use super::shader::Shader;
use super::{BufferUse, Error, Gpu, Result};

fn require(fits: bool, object: &str, what: impl FnOnce() -> String) -> Result<()> {
    if fits { Ok(()) } else { Err(Error::limit(object, what())) }
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
        checks.into_iter().try_for_each(|(limit, wanted, most)| {
            require(wanted <= most, name, || {
                format!("needs {limit} = {wanted}; this device has {most}; choose smaller blocks")
            })
        })
    }

    /// Checks the workgroup of a compute shader.
    pub(super) fn require_workgroup(&self, name: &str, shader: &Shader) -> Result<()> {
        let invocations = shader.group.iter().product::<u32>();
        let most = self.device.physical.limits.max_compute_work_group_invocations;
        require(invocations <= most, name, || {
            format!("needs workgroups of {invocations}; this device supports {most}; choose another variant")
        })
    }

    /// Checks that a workgroup may use this many bytes of shared memory. `advice` says what to do if it may
    /// not.
    ///
    /// # Errors
    /// [`Error::Limit`] with both numbers.
    pub fn require_shared(&self, name: &str, bytes: u64, advice: &str) -> Result<()> {
        let most = self.device.physical.shared_bytes;
        require(bytes <= u64::from(most), name, || {
            format!(
                "needs {bytes} bytes of shared memory for each workgroup; this device has {most}; {advice}"
            )
        })
    }

    /// Checks that shaders can address a storage buffer of this size. `advice` says what to do if they cannot.
    ///
    /// # Errors
    /// [`Error::Limit`] with both numbers.
    pub fn require_storage(&self, name: &str, bytes: u64, advice: &str) -> Result<()> {
        let most = u64::from(self.device.physical.limits.max_storage_buffer_range);
        require(bytes <= most, name, || {
            format!("needs {bytes} bytes; this device's shaders can address {most}; {advice}")
        })
    }

    /// Checks that indices may address this many vertices.
    ///
    /// # Errors
    /// [`Error::Limit`] with both numbers.
    pub fn require_indices(&self, name: &str, vertices: usize) -> Result<()> {
        let most = u64::from(self.device.physical.limits.max_draw_indexed_index_value) + 1;
        require(vertices as u64 <= most, name, || {
            format!(
                "needs {vertices} vertices; this device's indices can address {most}; choose a coarser mesh"
            )
        })
    }

    /// Returns an error if an image may not have this many layers. `advice` says what the layers are and what
    /// to do.
    ///
    /// # Errors
    /// [`Error::Limit`] with both numbers.
    pub fn require_layers(&self, name: &str, layers: u32, advice: impl FnOnce() -> String) -> Result<()> {
        let most = self.device.physical.limits.max_image_array_layers;
        require(layers <= most, name, || {
            format!("needs {layers} layers; this device supports {most}: {}", advice())
        })
    }

    /// Returns an error if the device's limits forbid a buffer of this size for this use.
    pub(super) fn require_buffer(&self, name: &str, bytes: u64, usage: BufferUse) -> Result<()> {
        let physical = &self.device.physical;
        let texels = 4 * u64::from(physical.limits.max_texel_buffer_elements);
        let storage = u64::from(physical.limits.max_storage_buffer_range);
        let (whose, most, advice) = match usage {
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
                physical.most_feedback_bytes,
                "lower variant.list_capacity, or show fewer tiles",
            ),
            _ => return Ok(()),
        };
        require(bytes <= most, name, || {
            format!("needs {bytes} bytes; this device's {whose} {most}; {advice}")
        })
    }
}
