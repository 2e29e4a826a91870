//! What the world can do to us: no loader, no device, a feature missing, memory full, device lost.

use ash::vk;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use thiserror::Error;

/// Each message says what was tried, on what, and what the user can do.
#[derive(Clone, Debug, Error)]
pub enum Error {
    #[error(
        "no Vulkan loader (libvulkan.so.1): {0}. Install your GPU's driver, or Mesa's software driver (Debian: mesa-vulkan-drivers); `ortelius doctor` tells more"
    )]
    Loader(String),
    #[error(
        "no Vulkan driver answers; searched {searched}. Install your GPU's driver, or Mesa's software driver (Debian: mesa-vulkan-drivers); `ortelius doctor` tells more"
    )]
    NoDevice { searched: String },
    #[error("no device {wanted:?}; there are: {found}")]
    DeviceChoice { wanted: String, found: String },
    #[error(
        "the validation layer VK_LAYER_KHRONOS_validation is not installed (Debian: vulkan-validationlayers), or leave out --validate"
    )]
    NoValidationLayer,
    #[error("{device}: pass {pass:?} needs {feature}, which this device lacks; {without}")]
    MissingFeature { device: String, feature: &'static str, pass: &'static str, without: &'static str },
    #[error("{object}: {what}")]
    Limit { object: String, what: String },
    #[error("{object}: out of memory ({reason}); choose smaller caches or a smaller picture")]
    OutOfMemory { object: String, reason: String },
    #[error(
        "device lost in {call} on {object}: the driver gave up; rerun with --validate, or another --device"
    )]
    DeviceLost { call: &'static str, object: String },
    #[error("{call} on {object}: {result}")]
    Call { call: &'static str, object: String, result: vk::Result },
}

/// Turns a Vulkan result into an [`Error`] that names the call and the object: every call goes through here.
pub(crate) trait Check<T> {
    fn check(self, call: &'static str, object: &str) -> Result<T, Error>;
}

impl<T> Check<T> for Result<T, vk::Result> {
    fn check(self, call: &'static str, object: &str) -> Result<T, Error> {
        let result = if lost_on_purpose(call) { Err(vk::Result::ERROR_DEVICE_LOST) } else { self };
        result.map_err(|result| match result {
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
                Error::OutOfMemory { object: object.to_string(), reason: format!("{call}: {result}") }
            }
            vk::Result::ERROR_DEVICE_LOST => Error::DeviceLost { call, object: object.to_string() },
            result => Error::Call { call, object: object.to_string(), result },
        })
    }
}

/// A fault that the environment asks for: no driver loses its device when a test wants it to.
/// `ORTELIUS_LOSE_DEVICE=vkQueueSubmit2:3` lets the third call of that name say that the device is lost.
fn lost_on_purpose(call: &str) -> bool {
    static WANTED: OnceLock<Option<(String, u64)>> = OnceLock::new();
    static CALLS: AtomicU64 = AtomicU64::new(0);
    let wanted = WANTED.get_or_init(|| parse_fault(&std::env::var("ORTELIUS_LOSE_DEVICE").ok()?));
    match wanted {
        Some((name, nth)) if name == call => CALLS.fetch_add(1, Ordering::Relaxed) + 1 == *nth,
        _ => false,
    }
}

/// CALL or CALL:N; the first call where N is left out or no number.
fn parse_fault(text: &str) -> Option<(String, u64)> {
    let (name, nth) = text.split_once(':').unwrap_or((text, "1"));
    (!name.is_empty()).then(|| (name.to_owned(), nth.parse().unwrap_or(1)))
}
