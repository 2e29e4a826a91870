//! Errors of the Vulkan environment: no loader, no device, a missing feature, out of memory, device lost.

use ash::vk;
use thiserror::Error;

/// Each message says what was tried and on which object, and most say what the user can do.
#[derive(Clone, Debug, Error)]
pub enum Error {
    #[error(
        "no Vulkan loader (libvulkan.so.1): {0}. Install your GPU's driver, or Mesa's software driver (Debian: mesa-vulkan-drivers); for details, run `ortelius doctor`"
    )]
    Loader(String),
    #[error(
        "no Vulkan driver found; searched {searched}. Install your GPU's driver, or Mesa's software driver (Debian: mesa-vulkan-drivers); for details, run `ortelius doctor`"
    )]
    NoDevice { searched: String },
    #[error("no device {wanted:?}; available: {found}")]
    DeviceChoice { wanted: String, found: String },
    #[error(
        "the validation layer VK_LAYER_KHRONOS_validation is not installed; install it (Debian: vulkan-validationlayers), or omit --validate"
    )]
    NoValidationLayer,
    #[error("{device}: pass {pass:?} needs {feature}, which this device lacks; {without}")]
    MissingFeature { device: String, feature: &'static str, pass: &'static str, without: &'static str },
    #[error("{object}: {what}")]
    Limit { object: String, what: String },
    #[error("{object}: out of memory ({reason}); choose smaller caches or a smaller picture")]
    OutOfMemory { object: String, reason: String },
    #[error(
        "device lost in {call} on {object}: the driver stopped responding; rerun with --validate, or choose another --device"
    )]
    DeviceLost { call: &'static str, object: String },
    #[error("{call} on {object}: {result}")]
    Call { call: &'static str, object: String, result: vk::Result },
}

impl Error {
    /// The message, if the device lacks a feature or a limit is exceeded.
    ///
    /// # Errors
    /// Any other error, unchanged.
    pub fn unsupported(self) -> Result<String, Error> {
        match self {
            Error::MissingFeature { .. } | Error::Limit { .. } => Ok(self.to_string()),
            other => Err(other),
        }
    }

    /// A limit of the device that `object` exceeds.
    pub(crate) fn limit(object: &str, what: impl Into<String>) -> Error {
        Error::Limit { object: object.to_owned(), what: what.into() }
    }
}

/// Turns a Vulkan result into an [`Error`] that names the call and the object. Every Vulkan call uses this.
pub(crate) trait Check<T> {
    fn check(self, call: &'static str, object: &str) -> Result<T, Error>;
}

impl<T> Check<T> for Result<T, vk::Result> {
    fn check(self, call: &'static str, object: &str) -> Result<T, Error> {
        self.map_err(|result| match result {
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
                Error::OutOfMemory { object: object.to_string(), reason: format!("{call}: {result}") }
            }
            vk::Result::ERROR_DEVICE_LOST => Error::DeviceLost { call, object: object.to_string() },
            result => Error::Call { call, object: object.to_string(), result },
        })
    }
}
