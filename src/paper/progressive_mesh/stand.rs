//! The layout of a surface's instances over a plane or an ellipsoid.

use super::choices::Layout;
use super::config::ProgressiveSurface;
use crate::math::camera::Pose;
use crate::math::geodesy::{self, LocalFrame};
use crate::scene::Scene;
use crate::scene::camera::Ground;
use crate::scene::path::CameraPath;
use glam::{DMat3, DVec2, DVec3};

/// The place and heading of an instance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stand {
    /// Centre of the bottom of the instance's box, in world metres.
    pub foot: DVec3,
    /// Clockwise from north.
    pub heading_deg: f64,
    /// Local east, north and up, as columns.
    pub axes: DMat3,
}

impl Stand {
    /// An instance over a plane.
    pub fn on_plane(foot: DVec3, heading_deg: f64) -> Stand {
        Stand { foot, heading_deg, axes: DMat3::IDENTITY }
    }

    /// An instance over the ellipsoid, at height `up_m` on the vertical through a point in space.
    fn on_ellipsoid(point: DVec3, up_m: f64, heading_deg: f64) -> Stand {
        let place = geodesy::ecef_to_geodetic(point);
        let LocalFrame { east, north, up } = geodesy::local_frame(place.latitude_deg, place.longitude_deg);
        let foot = geodesy::geodetic_to_ecef(place.latitude_deg, place.longitude_deg, up_m);
        Stand { foot, heading_deg, axes: DMat3::from_cols(east, north, up) }
    }
}

/// The instances of a surface, before they are moved onto another surface.
///
/// # Panics
/// If the surface names a path that this scene does not have.
pub fn stands(scene: &Scene, surface: &ProgressiveSurface) -> Vec<Stand> {
    let count = surface.instances;
    let stand = |by: DVec2, turn_deg: f64| at(scene, surface, by, turn_deg);
    if count == 1 && surface.layout != Layout::Along {
        return vec![stand(DVec2::ZERO, 0.0)];
    }
    let area_m = surface.area_m.unwrap_or_default();
    let mut random = Pcg32::new(surface.seed.unwrap_or(0));
    match surface.layout {
        Layout::Grid => grid(count, area_m).map(|by| stand(by, 0.0)).collect(),
        Layout::Scatter => {
            let mut next = || {
                let by = DVec2::new(random.next() - 0.5, random.next() - 0.5) * DVec2::from(area_m);
                stand(by, 360.0 * random.next())
            };
            (0..count).map(|_| next()).collect()
        }
        Layout::Along => {
            let path = &scene.paths[surface.path.as_ref().expect("checked: the layout has a path")];
            let aside_m = surface.aside_m.unwrap_or(0.0);
            let mut next = |n: u32| {
                let done = (f64::from(n) + 0.5) / f64::from(count) * f64::from(path.frames);
                let (eye, right) = eye_on_path(path, done, scene.ground);
                let point = eye + right * (2.0 * random.next() - 1.0) * aside_m;
                let turn_deg = 360.0 * random.next();
                match scene.ground {
                    Ground::Plane => stand(point.truncate(), turn_deg),
                    Ground::Planet => {
                        Stand::on_ellipsoid(point, surface.up_m, surface.heading_deg + turn_deg)
                    }
                }
            };
            (0..count).map(&mut next).collect()
        }
    }
}

/// An instance `by` metres east and north of the surface's own position.
fn at(scene: &Scene, surface: &ProgressiveSurface, by: DVec2, turn_deg: f64) -> Stand {
    let heading_deg = surface.heading_deg + turn_deg;
    match scene.ground {
        Ground::Plane => {
            let place = [surface.east_m.unwrap_or(0.0), surface.north_m.unwrap_or(0.0), surface.up_m];
            Stand::on_plane(DVec3::from(place) + by.extend(0.0), heading_deg)
        }
        Ground::Planet => {
            let place = (surface.latitude_deg, surface.longitude_deg);
            let (Some(latitude_deg), Some(longitude_deg)) = place else {
                unreachable!("checked: a mesh over an ellipsoid has a latitude and a longitude")
            };
            let LocalFrame { east, north, up } = geodesy::local_frame(latitude_deg, longitude_deg);
            if by == DVec2::ZERO {
                // This branch does not need the inverse conversion, so the result is also exact at a pole, where the
                // longitude determines the axes.
                let foot = geodesy::geodetic_to_ecef(latitude_deg, longitude_deg, surface.up_m);
                return Stand { foot, heading_deg, axes: DMat3::from_cols(east, north, up) };
            }
            let origin = geodesy::geodetic_to_ecef(latitude_deg, longitude_deg, 0.0);
            Stand::on_ellipsoid(origin + east * by.x + north * by.y, surface.up_m, heading_deg)
        }
    }
}

/// A grid of rows and columns over an area, with nearly square cells.
fn grid(count: u32, area_m: [f64; 2]) -> impl Iterator<Item = DVec2> {
    let [east_m, north_m] = area_m.map(|side_m| side_m.max(1e-9));
    let columns = (f64::from(count) * east_m / north_m).sqrt().ceil().clamp(1.0, f64::from(count));
    let rows = (f64::from(count) / columns).ceil();
    let place = |at: f64, of: f64, side_m: f64| ((at + 0.5) / of - 0.5) * side_m;
    let columns_whole = columns as u32;
    (0..count).map(move |n| {
        let (column, row) = (f64::from(n % columns_whole), f64::from(n / columns_whole));
        DVec2::new(place(column, columns, east_m), place(row, rows, north_m))
    })
}

/// The eye at a fractional frame (over a plane, moved to height 0), and the unit vector to its right.
fn eye_on_path(path: &CameraPath, frame: f64, ground: Ground) -> (DVec3, DVec3) {
    let whole = frame.floor();
    let [before, after]: [Pose; 2] = [whole, whole + 1.0].map(|frame| path.pose(frame as u32));
    match ground {
        Ground::Plane => {
            let right = before.right.truncate().normalize_or(DVec2::X);
            let eye = before.eye.lerp(after.eye, frame - whole).truncate();
            (eye.extend(0.0), right.extend(0.0))
        }
        Ground::Planet => (before.eye.lerp(after.eye, frame - whole), before.right),
    }
}

/// Pseudo-random numbers in 0 .. 1, the same on every machine: PCG with 64-bit state and 32-bit output (M. O'Neill,
/// "PCG: A Family of Simple Fast Space-Efficient Statistically Good Algorithms for Random Number Generation", Harvey
/// Mudd College HMC-CS-2014-0905, 2014).
struct Pcg32(u64);

impl Pcg32 {
    fn new(seed: u32) -> Pcg32 {
        Pcg32(u64::from(seed).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x853c_49e6_748f_ea9b)
    }

    fn next(&mut self) -> f64 {
        let state = self.0;
        self.0 = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mixed = (((state >> 18) ^ state) >> 27) as u32;
        f64::from(mixed.rotate_right((state >> 59) as u32)) / 4_294_967_296.0
    }
}
