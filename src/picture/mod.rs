//! (under construction)

pub mod srgb;
