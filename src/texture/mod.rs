//! Textures as tiles: where tiles come from ([`source`]), pyramids on disk ([`tiles`]), and how pictures become
//! pyramids ([`bake`]).

pub mod bake;
pub mod source;
pub mod tiles;
