//! The settings of a relief in a scene.

use super::relief::parallax::ParallaxFilter;
use super::relief::shipped::{BRICK_WALL, CLIFF};
use super::relief::trace::TracerKind;
use super::relief::{Relief, ReliefKind};
use crate::scene::{Language, SceneFault, SceneTable, TableDeclaration, choices, settings};
use std::path::PathBuf;

choices! {
    /// How a pixel's colour is taken from a relief.
    pub enum ReliefMethod {
        /// The footprint's texels, each weighted by its visible width along the view direction.
        ProjectedWidth = "projected-width",
        /// Paper 3's: the footprint's texels that the relief does not hide, all with the same weight. It looks back at
        /// most 4,096 steps for the points that hide a texel; a step is at most a pixel and at most a texel long. A
        /// texel that only a farther point hides counts as visible.
        VisibleTexels = "visible-texels",
        /// All texels between the hits of the footprint's two ends.
        WholeFootprint = "whole-footprint",
        /// A plain box filter at the hit of the centre's ray.
        UnperturbedDerivatives = "unperturbed-derivatives",
        /// A plain box filter, shifted according to the relief's height at the pixel's centre.
        Offset = "offset",
        /// One ray through a refined distance map, and the texture at its hit.
        Trace = "trace",
        /// As `trace`, through Donnelly's distance map.
        TraceDonnelly = "trace-donnelly",
        /// As `trace`, through a safe cone map.
        TraceCones = "trace-cones",
        /// As `trace`, through a relaxed cone map.
        TraceRelaxedCones = "trace-relaxed-cones",
        /// As `trace`, by linear and binary search, without a map.
        TraceLinear = "trace-linear",
    }
}

choices! {
    /// How a distance is stored in a distance map.
    pub enum MapPrecision {
        /// 32 bits.
        Float = "float",
        /// 16 bits, rounded down.
        Bits16 = "16-bit",
        /// 8 bits, rounded down.
        Bits8 = "8-bit",
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
        /// Precision of the distance map of `"trace"` and `"trace-donnelly"`; other methods have none.
        map_precision: MapPrecision = MapPrecision::Float;
        /// How far the relief's lowest point lies below the plane.
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
    if !keys.method.has_distance_map() {
        part.reject(
            &["map_precision"],
            &format!("the method {:?} has no distance map and", keys.method.name()),
        )?;
    }
    match keys.map {
        ReliefMap::File => part.required("path", &keys.path, "a relief from a file").map(drop),
        _ => part.reject(&["path"], "a shipped or generated relief"),
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

/// How the pixels of a relief are filtered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReliefFilter {
    pub method: ReliefMethod,
    pub precision: MapPrecision,
}

/// What a method does with a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReliefStep {
    /// Filters the footprint.
    Filter(ParallaxFilter),
    /// Traces one ray.
    Trace(TracerKind),
}

impl ReliefMethod {
    pub fn step(self) -> ReliefStep {
        match self {
            ReliefMethod::ProjectedWidth => ReliefStep::Filter(ParallaxFilter::Projected),
            ReliefMethod::VisibleTexels => ReliefStep::Filter(ParallaxFilter::Visible),
            ReliefMethod::WholeFootprint => ReliefStep::Filter(ParallaxFilter::Whole),
            ReliefMethod::UnperturbedDerivatives => ReliefStep::Filter(ParallaxFilter::Unperturbed),
            ReliefMethod::Offset => ReliefStep::Filter(ParallaxFilter::Offset),
            ReliefMethod::Trace | ReliefMethod::TraceDonnelly => ReliefStep::Trace(TracerKind::Distances),
            ReliefMethod::TraceCones => ReliefStep::Trace(TracerKind::Cones),
            ReliefMethod::TraceRelaxedCones => ReliefStep::Trace(TracerKind::RelaxedCones),
            ReliefMethod::TraceLinear => ReliefStep::Trace(TracerKind::Linear),
        }
    }

    pub fn has_distance_map(self) -> bool {
        self.step() == ReliefStep::Trace(TracerKind::Distances)
    }
}

impl MapPrecision {
    /// Bits per cell.
    pub fn bits(self) -> u32 {
        match self {
            MapPrecision::Float => 32,
            MapPrecision::Bits16 => 16,
            MapPrecision::Bits8 => 8,
        }
    }
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
    pub fn filter(&self) -> ReliefFilter {
        ReliefFilter { method: self.method, precision: self.map_precision }
    }

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
