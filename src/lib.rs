//! Ortelius: a research renderer on raw Vulkan. Three papers rebuilt, each beside its modern
//! variants and a slow exact reference; everything measured.
//!
//! Modules stand in floor order: a module may use those above it in this list's floors, never those below.

// floor 0: plain data, no GPU
pub mod math;
pub mod picture;
pub mod stats;
// floor 1: worlds that do not know each other
pub mod reference;
pub mod scene;
pub mod vk;
// floor 2: what is measured, and how it is told
pub mod figure;
// floor 3: the papers; none names another
pub mod paper;
// floor 4: a scene becomes passes
pub mod renderer;

/// The README's example compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
