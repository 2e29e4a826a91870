//! Textures as tiles: where tiles come from ([`source`]), pyramids on disk ([`tiles`]), and how pictures become
//! pyramids ([`bake`]); pictures that need no tiles ([`plain`]).

pub mod bake;
pub mod plain;
pub mod source;
pub mod tiles;
