//! A device of the machine, and the choice among several.

use super::features::{Feature, Offered};
use ash::vk;

/// One device, as enumerated.
#[derive(Clone, Debug)]
pub struct PhysicalDevice {
    pub(crate) handle: vk::PhysicalDevice,
    pub name: String,
    /// "discrete", "integrated", "virtual", "cpu" or "other".
    pub kind: &'static str,
    /// Driver name and version, as the driver reports them.
    pub driver: String,
    /// (major, minor, patch)
    pub api: (u32, u32, u32),
    pub features: Vec<Feature>,
    /// Lanes per subgroup.
    pub subgroup_size: u32,
    /// Shared memory of a workgroup, in bytes.
    pub shared_bytes: u32,
    pub(crate) offered: Offered,
    pub(crate) limits: vk::PhysicalDeviceLimits,
    pub(crate) max_feedback_bytes: u64,
    pub(crate) max_buffer_bytes: u64,
}

impl PhysicalDevice {
    /// True if the device runs shaders on the CPU.
    pub fn is_software(&self) -> bool {
        self.kind == "cpu"
    }

    /// True if the device has Vulkan 1.3 and scalar block layout. Every pass needs both.
    pub fn usable(&self) -> bool {
        self.api >= (1, 3, 0) && self.offered.scalar_block_layout
    }
}

/// The device that `wanted` names: an index, a number in a name (4090), or part of a name. A device may appear under
/// two drivers; the usable one is preferred. If no device is usable, opening the first reports why.
pub(super) fn choose<'a>(
    devices: &'a [PhysicalDevice],
    wanted: Option<&str>,
    presents: bool,
) -> Option<&'a PhysicalDevice> {
    let indexed = wanted.and_then(|wanted| devices.get(wanted.parse::<usize>().ok()?));
    let is_named = |device: &&PhysicalDevice| {
        let Some(wanted) = wanted else { return true };
        // "2" does not name "llvmpipe (LLVM 15.0.6, 256 bits)".
        match wanted.bytes().all(|byte| byte.is_ascii_digit()) {
            true => device.name.split(|c: char| !c.is_ascii_digit()).any(|number| number == wanted),
            false => device.name.to_lowercase().contains(&wanted.to_lowercase()),
        }
    };
    let faults = |device: &&PhysicalDevice| (!device.usable(), presents && !device.offered.swapchain);
    indexed.or_else(|| devices.iter().filter(is_named).min_by_key(faults))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_that_cannot_be_used_is_chosen_last_and_named_when_it_is_opened() {
        let any = crate::vk::Instance::new(false).unwrap().choose(None, false).unwrap();
        let usable = PhysicalDevice { name: "usable (256 bits)".into(), ..any };
        let old = PhysicalDevice { name: "old".into(), api: (1, 2, 0), ..usable.clone() };
        let both = [old, usable];
        let chosen = |wanted| choose(&both, wanted, false).map(|device| &*device.name);
        assert_eq!(chosen(None), Some("usable (256 bits)"));
        assert_eq!(chosen(Some("OLD")), Some("old"));
        assert_eq!(chosen(Some("1")), Some("usable (256 bits)"));
        assert_eq!(chosen(Some("2")), None);
        assert_eq!(choose(&both[..1], None, false).map(|device| &*device.name), Some("old"));
        assert!(choose(&[], None, false).is_none());
    }

    #[test]
    fn a_number_is_an_index_or_else_part_of_a_name() {
        let any = crate::vk::Instance::new(false).unwrap().choose(None, false).unwrap();
        let named = |name: &str| PhysicalDevice { name: name.into(), ..any.clone() };
        let devices = [named("Radeon RX 7900"), named("GeForce RTX 4090"), named("Arc A770")];
        let chosen = |wanted| choose(&devices, Some(wanted), false).map(|device| &*device.name);
        assert_eq!(chosen("4090"), Some("GeForce RTX 4090"));
        assert_eq!(chosen("7900"), Some("Radeon RX 7900"));
        assert_eq!(chosen("770"), Some("Arc A770"));
        assert_eq!(chosen("0"), Some("Radeon RX 7900"));
        assert_eq!(chosen("1"), Some("GeForce RTX 4090"));
        assert!(["3090", "90", "7"].iter().all(|wanted| chosen(wanted).is_none()), "not a whole number");
    }

    #[test]
    fn a_window_prefers_a_device_that_can_present() {
        let any = crate::vk::Instance::new(false).unwrap().choose(None, false).unwrap();
        let with = |name: &str, swapchain| PhysicalDevice {
            name: name.into(),
            offered: Offered { swapchain, ..any.offered.clone() },
            ..any.clone()
        };
        let devices = [with("accelerator", false), with("graphics card", true)];
        let chosen = |wanted, presents| choose(&devices, wanted, presents).unwrap().name.clone();
        assert_eq!(chosen(None, false), "accelerator");
        assert_eq!(chosen(None, true), "graphics card");
        // A device that was named is opened, and the error says that it cannot present.
        assert_eq!(chosen(Some("accel"), true), "accelerator");
        assert_eq!(chosen(Some("0"), true), "accelerator");
    }
}
