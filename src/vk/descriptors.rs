//! The descriptor sets of a frame, from pools that are added as they are needed.

use super::device::Device;
use super::shader::DescriptorKind;
use super::{Check, Result};
use ash::vk;

/// Capacity of a pool: sets, and descriptors of each kind. No shader has more bindings of one kind.
const SETS: u32 = 128;
const DESCRIPTORS: u32 = 256;

const KINDS: [DescriptorKind; 6] = [
    DescriptorKind::CombinedImageSampler,
    DescriptorKind::SampledImage,
    DescriptorKind::StorageImage,
    DescriptorKind::StorageBuffer,
    DescriptorKind::TexelBuffer,
    DescriptorKind::StorageTexelBuffer,
];

impl DescriptorKind {
    pub(crate) fn vk(self) -> vk::DescriptorType {
        match self {
            DescriptorKind::CombinedImageSampler => vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
            DescriptorKind::SampledImage => vk::DescriptorType::SAMPLED_IMAGE,
            DescriptorKind::StorageImage => vk::DescriptorType::STORAGE_IMAGE,
            DescriptorKind::StorageBuffer => vk::DescriptorType::STORAGE_BUFFER,
            DescriptorKind::TexelBuffer => vk::DescriptorType::UNIFORM_TEXEL_BUFFER,
            DescriptorKind::StorageTexelBuffer => vk::DescriptorType::STORAGE_TEXEL_BUFFER,
        }
    }
}

/// Remaining capacity of a pool. It is counted here because some drivers do not reject a set beyond the pool's size.
#[derive(Clone, Copy)]
struct Left {
    sets: u32,
    of_kind: [u32; KINDS.len()],
}

const FULL: Left = Left { sets: SETS, of_kind: [DESCRIPTORS; KINDS.len()] };

impl Left {
    /// The remaining capacity after a set with these bindings; `None` if the set does not fit.
    fn after(self, bindings: &[(u32, DescriptorKind)]) -> Option<Left> {
        let mut left = Left { sets: self.sets.checked_sub(1)?, ..self };
        for (_, kind) in bindings {
            let of_kind = &mut left.of_kind[KINDS.iter().position(|other| other == kind)?];
            *of_kind = of_kind.checked_sub(1)?;
        }
        Some(left)
    }
}

/// All sets are freed together, by [`Descriptors::reset`].
pub(super) struct Descriptors {
    pools: Vec<vk::DescriptorPool>,
    /// Index of the pool that new sets come from.
    current: usize,
    /// Remaining capacity of that pool.
    left: Left,
}

impl Descriptors {
    pub fn new(device: &Device) -> Result<Self> {
        Ok(Self { pools: vec![pool(device)?], current: 0, left: FULL })
    }

    /// Frees all sets. The GPU must have finished with them.
    pub fn reset(&mut self, device: &Device) -> Result<()> {
        for &pool in &self.pools {
            // SAFETY: the caller promises that the sets are not in use.
            unsafe { device.handle.reset_descriptor_pool(pool, vk::DescriptorPoolResetFlags::empty()) }
                .check("vkResetDescriptorPool", "frame")?;
        }
        (self.current, self.left) = (0, FULL);
        Ok(())
    }

    /// A set with these bindings, for the pipeline `name`.
    pub fn allocate(
        &mut self,
        device: &Device,
        layout: vk::DescriptorSetLayout,
        bindings: &[(u32, DescriptorKind)],
        name: &str,
    ) -> Result<vk::DescriptorSet> {
        self.left = match self.left.after(bindings) {
            Some(left) => left,
            None => {
                if self.current + 1 == self.pools.len() {
                    self.pools.push(pool(device)?);
                }
                self.current += 1;
                FULL.after(bindings).expect("a pool holds the bindings of any shader")
            }
        };
        let layouts = [layout];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(self.pools[self.current])
            .set_layouts(&layouts);
        // SAFETY: the pool has room for the set.
        let sets = unsafe { device.handle.allocate_descriptor_sets(&info) };
        Ok(sets.check("vkAllocateDescriptorSets", name)?[0])
    }

    /// The GPU must have finished with all sets.
    pub fn destroy(&mut self, device: &Device) {
        for pool in self.pools.drain(..) {
            // SAFETY: the caller promises that the sets are not in use.
            unsafe { device.handle.destroy_descriptor_pool(pool, None) };
        }
    }
}

fn pool(device: &Device) -> Result<vk::DescriptorPool> {
    let sizes = KINDS.map(|kind| vk::DescriptorPoolSize { ty: kind.vk(), descriptor_count: DESCRIPTORS });
    let info = vk::DescriptorPoolCreateInfo::default().max_sets(SETS).pool_sizes(&sizes);
    // SAFETY: the device lives.
    let pool = unsafe { device.handle.create_descriptor_pool(&info, None) }
        .check("vkCreateDescriptorPool", "frame")?;
    device.name(pool, "frame descriptors");
    Ok(pool)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_fits_while_the_pool_has_sets_and_descriptors_of_its_kinds_left() {
        let texture = [(0, DescriptorKind::SampledImage)];
        let buffers = [0, 1, 2, 3].map(|binding| (binding, DescriptorKind::StorageBuffer));
        let fitting = |bindings: &[(u32, DescriptorKind)]| {
            let mut left = Some(FULL);
            let mut count = 0;
            while let Some(next) = left.and_then(|left| left.after(bindings)) {
                (left, count) = (Some(next), count + 1);
            }
            count
        };
        assert_eq!([fitting(&texture), fitting(&buffers), fitting(&[])], [SETS, DESCRIPTORS / 4, SETS]);
    }
}
