//! Which device a command runs on, and whether the validation layer listens.

use clap::Args;
use ortelius::vk::GpuOptions;

#[derive(Args)]
pub struct DeviceArgs {
    /// Part of a device's name, or its index
    #[arg(long, env = "ORTELIUS_DEVICE")]
    pub device: Option<String>,
    /// Run with Vulkan's validation layer, synchronisation included; any message of it is a failure. Times then mean
    /// nothing
    #[arg(long, env = "ORTELIUS_VALIDATE", value_parser = clap::builder::FalseyValueParser::new())]
    pub validate: bool,
}

impl DeviceArgs {
    /// The device, opened with no optional feature.
    pub fn options(&self) -> GpuOptions<'_> {
        GpuOptions { device: self.device.as_deref(), validate: self.validate, ..GpuOptions::default() }
    }
}
