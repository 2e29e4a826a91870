//! Ortelius: a research renderer on raw Vulkan. Three papers rebuilt, each beside its modern
//! variants and a slow exact reference; everything measured.
//!
//! Modules are listed by floor: a module may use those of the floors above it in this list, never those below.

#![deny(unsafe_code)]

// floor 0: plain data, no GPU
pub mod math;
pub mod picture;
pub mod stats;
// floor 1: worlds that do not know each other
pub mod model;
pub mod reference;
pub mod texture;
#[allow(unsafe_code)]
pub mod vk;
// floor 2: what is shown, how frames are made, what is measured
pub mod figure;
pub mod scene;
// floor 3: the papers; none names another
pub mod paper;
// floor 4: a scene becomes passes
pub mod renderer;

/// The README's example compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
