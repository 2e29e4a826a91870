//! The settings of a relief in a scene.

use super::relief::shipped::{BRICK_WALL, CLIFF};
use super::relief::{Relief, ReliefKind};
use crate::scene::{Language, SceneFault, SceneTable, TableDeclaration, choices, settings};
use std::path::PathBuf;

choices! {
    /// How a pixel's colour is taken from a relief.
    pub enum ReliefMethod {
        /// The footprint's texels, each weighted by its visible width along the view direction.
        ProjectedWidth = "projected-width",
        /// One ray through a refined distance map, and the texture at its hit.
        Trace = "trace",
    }
}

choices! {
    /// Where a relief's heights come from.
    pub enum ReliefMap {
        /// A grey picture, in which white is the height of the plane.
        File = "file",
        /// A shipped brick wall, 256 texels a side.
        BrickWall = "brick-wall",
        /// A shipped cliff, 128 texels a side.
        Cliff = "cliff",
        /// Bricks with deep joints, 256 texels a side.
        Bricks = "bricks",
        /// Noise of four octaves, 128 texels a side.
        Rock = "rock",
        /// Narrow pillars on a deep floor, 256 texels a side.
        Pillars = "pillars",
        /// A stair with single spikes, 256 texels a side.
        Spikes = "spikes",
    }
}

settings! {
    /// A height field below a square plane with a plain texture (paper 3: parallax mapping with filtering, and the
    /// refined distance map). It replaces the plane's filter.
    pub struct ReliefKeys {
        /// How a pixel is filtered.
        method: ReliefMethod = ReliefMethod::ProjectedWidth;
        /// Depth of the lowest height below the plane.
        depth_m: f64, in 1e-6..=1e6, unit "m";
        /// The heights.
        map: ReliefMap;
        /// A square picture whose side is a power of two from 16 to 4096 texels. The path is relative to the scene
        /// (given by `-D`: to the working directory). Required for `"file"`.
        path: Option<PathBuf> = None;
    }
    check check;
}

fn check(keys: &ReliefKeys, part: &SceneTable<'_>) -> Result<(), SceneFault> {
    match keys.map {
        ReliefMap::File => part.needed("path", &keys.path, "a relief from a file").map(drop),
        _ => part.absent(&["path"], "a shipped or generated relief"),
    }
}

/// Paper 3's part of the scene language.
pub const LANGUAGE: Language = Language {
    tables: &[TableDeclaration::of::<ReliefKeys>(&["surface", "*", "relief"])],
    check: |_| Ok(()),
};

/// Side in texels of a generated relief and of its colour picture. Noise is smooth, so a smaller relief is enough, and
/// its distance map is built sooner.
pub fn side_of(kind: ReliefKind) -> usize {
    if kind == ReliefKind::Rock { 128 } else { 256 }
}

impl ReliefMap {
    /// The shipped or generated relief; `None` if the heights come from a file.
    fn relief(self) -> Option<Relief> {
        let generated = |kind: ReliefKind| Some(kind.relief(side_of(kind)));
        match self {
            ReliefMap::File => None,
            ReliefMap::BrickWall => Some(BRICK_WALL.relief()),
            ReliefMap::Cliff => Some(CLIFF.relief()),
            ReliefMap::Bricks => generated(ReliefKind::Bricks),
            ReliefMap::Rock => generated(ReliefKind::Rock),
            ReliefMap::Pillars => generated(ReliefKind::Pillars),
            ReliefMap::Spikes => generated(ReliefKind::Spikes),
        }
    }
}

impl ReliefKeys {
    /// The relief below a plane with a side of `size_m`. `picture` is the file's size in texels and its grey bytes.
    ///
    /// # Errors
    /// A text if the picture's size is not allowed.
    pub fn relief(&self, size_m: f64, picture: Option<([u32; 2], Vec<u8>)>) -> Result<Relief, String> {
        let relief = match (self.map.relief(), picture) {
            (Some(relief), _) => relief,
            (None, Some(([width, height], heights))) => {
                if width != height || !width.is_power_of_two() || !(16..=4096).contains(&width) {
                    return Err(format!(
                        "a relief cannot have {width} x {height} texels; use a square picture whose side is a power of \
                         two from 16 to 4096"
                    ));
                }
                Relief { side: width as usize, depth: 0.0, heights }
            }
            (None, None) => unreachable!("a relief from a file has its picture"),
        };
        Ok(Relief { depth: (self.depth_m / size_m * relief.side as f64) as f32, ..relief })
    }
}
