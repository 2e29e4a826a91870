//! Textures as tiles: tile sources ([`source`]), pyramids on disk ([`tiles`]), baking pictures to pyramids
//! ([`bake`]), and pictures without tiles ([`plain`]).

pub mod bake;
mod coarser;
pub mod plain;
pub mod source;
pub mod tiles;
