//! Arithmetic shared by all modules: levels and tiles, cameras and geodesy, light, reliefs, weight maps, random
//! numbers.

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
