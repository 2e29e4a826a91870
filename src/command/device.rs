//! The device of a command, and whether validation is enabled.

use clap::Args;
use ortelius::vk::GpuOptions;

#[derive(Args)]
pub struct DeviceArgs {
    /// Use this device: a part of its name, or its index
    #[arg(long, env = "ORTELIUS_DEVICE")]
    pub device: Option<String>,
    /// Run with Vulkan's validation layer, including synchronisation validation. Any message is a failure. Times
    /// measured with this option are meaningless
    #[arg(long, env = "ORTELIUS_VALIDATE", value_parser = clap::builder::FalseyValueParser::new())]
    pub validate: bool,
}

impl DeviceArgs {
    /// Options for this device, without optional features.
    pub fn options(&self) -> GpuOptions<'_> {
        GpuOptions { device: self.device.as_deref(), validate: self.validate, ..GpuOptions::default() }
    }
}
