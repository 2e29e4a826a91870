//! Arithmetic shared by all modules: numbering of levels and tiles, projections, geodesy.

pub mod camera;
pub mod geodesy;
pub mod light;
pub mod mix;
pub mod nearest;
pub mod pyramid;
pub mod ragged;
pub mod relief;
pub mod rows;
pub mod splitmix;
pub mod weight_map;
