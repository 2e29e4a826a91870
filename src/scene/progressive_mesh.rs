//! `[progressive_mesh.NAME]`: surfaces of paper 2, and where their instances stand.

use super::check::{Fault, absent, needed, within};
use super::face_order::FaceOrder;
use super::path::Path;
use crate::math::camera::Pose;
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A surface with continuous levels of detail, drawn once or many times.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProgressiveSurface {
    pub source: ModelSource,
    /// The longest side of the model's box in the scene, metres.
    pub size_m: f64,
    /// Which of the model's axes points up in the scene.
    pub up: UpAxis,
    /// Where the middle of the foot of the first instance's box stands: east, north, up.
    pub foot_m: [f64; 3],
    /// Clockwise from north, of every instance.
    pub heading_deg: f64,
    pub instances: u32,
    pub layout: Layout,
    /// The deviation from the full model that is wanted, in pixels of the picture, >= 0; 0 draws the full model. The
    /// levels' errors are estimates, mostly from above, no bounds.
    pub error_pixels: f64,
    /// Vertices that appear move to their place instead of jumping there.
    pub geomorph: bool,
    pub order: FaceOrder,
    pub apply: Apply,
}

/// Where a model comes from.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ModelSource {
    /// A shipped model, or one that `ortelius fetch` has brought.
    Named(String),
    /// .ply, .obj, .glb, or .pmesh; the path is ready to open.
    File(PathBuf),
}

/// The model's axis that points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UpAxis {
    /// As scans and glTF have it.
    #[default]
    Y,
    /// As maps have it.
    Z,
}

/// How instances are spread.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Layout {
    /// Rows and columns that fill an area, east and north, around the first instance's place.
    Grid { area_m: [f64; 2] },
    /// Places and headings by chance in that area.
    Scatter { area_m: [f64; 2], seed: u32 },
    /// Below the eye's way along a path, evenly, each up to `aside_m` to its side by chance.
    Along { path: String, aside_m: f64, seed: u32 },
}

/// Who executes splits, collapses and permutations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Apply {
    /// The host, in its own copy of the index buffer; what it touched is copied.
    #[default]
    Cpu,
    /// Compute shaders, in place.
    Gpu,
}

/// `[governor]`: the wanted errors of all surfaces are raised as far as frames need it to keep a budget; at least one of
/// the two is there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GovernorSettings {
    /// Measured milliseconds.
    pub frame_ms: Option<f64>,
    /// Faces: the budget where frames must be the same on every run.
    pub frame_faces: Option<u32>,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum LayoutKind {
    #[default]
    Grid,
    Scatter,
    Along,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ProgressiveSurfaceFile {
    pub source: String,
    pub size_m: f64,
    #[serde(default)]
    pub up: UpAxis,
    #[serde(default)]
    pub east_m: f64,
    #[serde(default)]
    pub north_m: f64,
    #[serde(default)]
    pub up_m: f64,
    #[serde(default)]
    pub heading_deg: f64,
    #[serde(default = "one")]
    pub instances: u32,
    #[serde(default)]
    pub layout: LayoutKind,
    pub area_m: Option<[f64; 2]>,
    pub path: Option<String>,
    pub aside_m: Option<f64>,
    pub seed: Option<u32>,
    #[serde(default = "one_pixel")]
    pub error_pixels: f64,
    #[serde(default)]
    pub geomorph: bool,
    #[serde(default)]
    pub order: FaceOrder,
    #[serde(default)]
    pub apply: Apply,
}

fn one() -> u32 {
    1
}

fn one_pixel() -> f64 {
    1.0
}

/// What names a file and not a model.
const ENDINGS: [&str; 5] = ["ply", "obj", "glb", "pmesh", "gz"];

/// Checks one surface. `folder` is what a relative source starts from.
pub(super) fn check_surface(
    name: &str,
    file: &ProgressiveSurfaceFile,
    paths: &BTreeMap<String, Path>,
    folder: &std::path::Path,
) -> Result<ProgressiveSurface, Fault> {
    let key = |key| ["progressive_mesh", name, key];
    let metres = |name: &'static str, value: f64| within(&key(name), value, -1e9..=1e9);
    let path = std::path::Path::new(&file.source);
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or("").to_ascii_lowercase();
    let source = match ENDINGS.contains(&ending.as_str()) {
        true => ModelSource::File(folder.join(path)),
        false => ModelSource::Named(file.source.clone()),
    };
    check_order(name, file)?;
    Ok(ProgressiveSurface {
        source,
        size_m: within(&key("size_m"), file.size_m, 1e-6..=1e9)?,
        up: file.up,
        foot_m: [
            metres("east_m", file.east_m)?,
            metres("north_m", file.north_m)?,
            metres("up_m", file.up_m)?,
        ],
        heading_deg: within(&key("heading_deg"), file.heading_deg, -360.0..=360.0)?,
        instances: within(&key("instances"), file.instances, 1..=100_000)?,
        layout: check_layout(name, file, paths)?,
        error_pixels: within(&key("error_pixels"), file.error_pixels, 0.0..=1e6)?,
        geomorph: file.geomorph,
        order: file.order,
        apply: file.apply,
    })
}

/// Whether what is asked for beside an order is its business.
fn check_order(name: &str, file: &ProgressiveSurfaceFile) -> Result<(), Fault> {
    let order = file.order;
    if order.is_rival() && file.apply == Apply::Gpu {
        let what = format!(
            "order = {:?} executes no splits that a device could apply; leave apply out",
            order.name()
        );
        return Err(Fault::new(&["progressive_mesh", name, "apply"], what));
    }
    if order == FaceOrder::Discrete && file.geomorph {
        let what = "the meshes of a discrete chain know no splits, and none moves; leave geomorph out";
        return Err(Fault::new(&["progressive_mesh", name, "geomorph"], what));
    }
    Ok(())
}

fn check_layout(
    name: &str,
    file: &ProgressiveSurfaceFile,
    paths: &BTreeMap<String, Path>,
) -> Result<Layout, Fault> {
    let key = |key| ["progressive_mesh", name, key];
    let area_m = |kind| -> Result<[f64; 2], Fault> {
        absent(&key("path"), &file.path, kind)?;
        absent(&key("aside_m"), &file.aside_m, kind)?;
        let area_m = match (file.area_m, file.instances) {
            (None, 1) => [0.0; 2],
            (area_m, _) => needed(&key("area_m"), area_m, kind)?,
        };
        for side_m in area_m {
            within(&key("area_m"), side_m, 0.0..=1e9)?;
        }
        Ok(area_m)
    };
    let seed = file.seed.unwrap_or(0);
    match file.layout {
        LayoutKind::Grid => {
            absent(&key("seed"), &file.seed, "a grid")?;
            Ok(Layout::Grid { area_m: area_m("a grid")? })
        }
        LayoutKind::Scatter => Ok(Layout::Scatter { area_m: area_m("a scatter")?, seed }),
        LayoutKind::Along => {
            let kind = "a layout along a path";
            absent(&key("area_m"), &file.area_m, kind)?;
            let path = needed(&key("path"), file.path.as_ref(), kind)?;
            if !paths.contains_key(path) {
                let existing = super::error::list(paths.keys());
                return Err(Fault::new(&key("path"), format!("no path {path:?}; there are {existing}")));
            }
            let aside_m = within(&key("aside_m"), file.aside_m.unwrap_or(0.0), 0.0..=1e9)?;
            Ok(Layout::Along { path: path.clone(), aside_m, seed })
        }
    }
}

/// Where an instance stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stand {
    /// The middle of the foot of its box, world metres.
    pub foot: DVec3,
    /// Clockwise from north.
    pub heading_deg: f64,
}

impl ProgressiveSurface {
    /// Where the instances stand. `paths` are the scene's.
    ///
    /// # Panics
    /// If the layout follows a path that is not among them: the scene was checked.
    pub fn stands(&self, paths: &BTreeMap<String, Path>) -> Vec<Stand> {
        let first = Stand { foot: DVec3::from(self.foot_m), heading_deg: self.heading_deg };
        if self.instances == 1 && !matches!(self.layout, Layout::Along { .. }) {
            return vec![first];
        }
        let moved = |by: DVec2, turn_deg: f64| Stand {
            foot: first.foot + by.extend(0.0),
            heading_deg: first.heading_deg + turn_deg,
        };
        let count = self.instances;
        match &self.layout {
            Layout::Grid { area_m } => {
                // As square as the area: columns / rows is about its east / north.
                let [east_m, north_m] = area_m.map(|side_m| side_m.max(1e-9));
                let columns =
                    (f64::from(count) * east_m / north_m).sqrt().ceil().clamp(1.0, f64::from(count));
                let rows = (f64::from(count) / columns).ceil();
                let place = |at: f64, of: f64, side_m: f64| ((at + 0.5) / of - 0.5) * side_m;
                let columns_whole = columns as u32;
                let stand = |n: u32| {
                    let (column, row) = (f64::from(n % columns_whole), f64::from(n / columns_whole));
                    moved(DVec2::new(place(column, columns, east_m), place(row, rows, north_m)), 0.0)
                };
                (0..count).map(stand).collect()
            }
            Layout::Scatter { area_m, seed } => {
                let mut chance = Chance::new(*seed);
                let mut stand = || {
                    let by = DVec2::new(chance.next() - 0.5, chance.next() - 0.5) * DVec2::from(*area_m);
                    moved(by, 360.0 * chance.next())
                };
                (0..count).map(|_| stand()).collect()
            }
            Layout::Along { path, aside_m, seed } => {
                let path = &paths[path];
                let mut chance = Chance::new(*seed);
                let mut stand = |n: u32| {
                    let done = (f64::from(n) + 0.5) / f64::from(count) * f64::from(path.frames);
                    let (eye, right) = way(path, done);
                    let by = eye + right * (2.0 * chance.next() - 1.0) * *aside_m;
                    moved(by, 360.0 * chance.next())
                };
                (0..count).map(&mut stand).collect()
            }
        }
    }
}

/// The point of the plane below the eye at a (broken) frame, and the unit vector to the eye's right there.
fn way(path: &Path, frame: f64) -> (DVec2, DVec2) {
    let whole = frame.floor();
    let [before, after]: [Pose; 2] = [whole, whole + 1.0].map(|frame| path.pose(frame as u32));
    let right = before.right.truncate().normalize_or(DVec2::X);
    (before.eye.lerp(after.eye, frame - whole).truncate(), right)
}

/// Numbers from 0 to 1 that look like chance and are the same everywhere: PCG (O'Neill 2014), 32 bits of 64.
struct Chance(u64);

impl Chance {
    fn new(seed: u32) -> Chance {
        Chance(u64::from(seed).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x853c_49e6_748f_ea9b)
    }

    fn next(&mut self) -> f64 {
        let state = self.0;
        self.0 = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mixed = (((state >> 18) ^ state) >> 27) as u32;
        f64::from(mixed.rotate_right((state >> 59) as u32)) / 4_294_967_296.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surface(instances: u32, layout: Layout) -> ProgressiveSurface {
        ProgressiveSurface {
            source: ModelSource::Named("bunny".into()),
            size_m: 1.0,
            up: UpAxis::Y,
            foot_m: [10.0, 20.0, 3.0],
            heading_deg: 0.0,
            instances,
            layout,
            error_pixels: 1.0,
            geomorph: false,
            order: FaceOrder::Ours,
            apply: Apply::Cpu,
        }
    }

    #[test]
    fn a_grid_fills_its_area_and_no_two_stand_on_one_place() {
        let stands = surface(12, Layout::Grid { area_m: [40.0, 30.0] }).stands(&BTreeMap::new());
        assert_eq!(stands.len(), 12);
        let mut places: Vec<[i64; 2]> =
            stands.iter().map(|s| [s.foot.x, s.foot.y].map(|m| (m * 1e6) as i64)).collect();
        places.sort_unstable();
        places.dedup();
        assert_eq!(places.len(), 12);
        for Stand { foot, .. } in stands {
            assert!(
                (foot.x - 10.0).abs() <= 20.0 && (foot.y - 20.0).abs() <= 15.0 && foot.z == 3.0,
                "{foot}"
            );
        }
        // Four columns of three rows: the outer ones stand half a cell from the area's edge.
        let first = surface(12, Layout::Grid { area_m: [40.0, 30.0] }).stands(&BTreeMap::new())[0];
        assert!((first.foot - DVec3::new(-5.0, 10.0, 3.0)).length() < 1e-12, "{}", first.foot);
    }

    #[test]
    fn a_scatter_stays_in_its_area_and_another_seed_is_another_scatter() {
        let scatter =
            |seed| surface(500, Layout::Scatter { area_m: [40.0, 30.0], seed }).stands(&BTreeMap::new());
        let stands = scatter(1);
        assert!(stands.iter().all(|s| (s.foot.x - 10.0).abs() <= 20.0 && (s.foot.y - 20.0).abs() <= 15.0));
        assert_ne!(stands, scatter(2));
        assert_eq!(stands, scatter(1));
        let mean = stands.iter().map(|s| s.foot.x).sum::<f64>() / 500.0;
        // The mean of 500 places has a spread of 40 / sqrt(12 * 500).
        assert!((mean - 10.0).abs() < 4.0 * 40.0 / 6000f64.sqrt(), "{mean}");
    }
}
