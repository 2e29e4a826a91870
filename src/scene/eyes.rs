//! `[view]`, `[cameras.NAME]` and `[paths.NAME]`: the cameras of a scene, with the checks that involve several keys.

use super::camera::{Camera, Ground, GroundPoint};
use super::declare::{Settings, choices, settings};
use super::document::SceneFault;
use super::error::list;
use super::part::SceneTable;
use super::path::{self, Motion};
use std::collections::BTreeMap;

settings! {
    /// The picture to render.
    pub struct PictureSettings {
        /// Width of the picture.
        width: u32, in 1..=16_384, unit "pixels";
        /// Height of the picture.
        height: u32, in 1..=16_384, unit "pixels";
        /// A name among the scene's cameras.
        camera: String;
        /// A name among the scene's paths. If stated, the camera follows this path from the path's own start.
        path: Option<String> = None;
        /// Linear light where no surface is visible.
        background: [f64; 3] = [0.0; 3], in 0.0..=1e3;
    }
}

settings! {
    /// A named camera: a position on the ground, a height above it, and a direction.
    pub struct CameraKeys {
        /// Geodetic latitude. Required over an ellipsoid, not allowed over a plane.
        latitude_deg: Option<f64> = None, in -90.0..=90.0, unit "degrees";
        /// Geodetic longitude. Required over an ellipsoid, not allowed over a plane.
        longitude_deg: Option<f64> = None, in -360.0..=360.0, unit "degrees";
        /// East of the plane's centre. Required over a plane, not allowed over an ellipsoid.
        east_m: Option<f64> = None, in -1e9..=1e9, unit "m";
        /// North of the plane's centre. Required over a plane, not allowed over an ellipsoid.
        north_m: Option<f64> = None, in -1e9..=1e9, unit "m";
        /// Height above the ellipsoid or the plane.
        altitude_m: f64, in 1e-3..=1e9, unit "m";
        /// Direction of view, clockwise from north; when looking straight down, the picture's up direction.
        heading_deg: f64 = 0.0, in -360.0..=360.0, unit "degrees";
        /// 0 is straight down, 90 horizontal in the direction of the heading, 180 straight up.
        tilt_deg: f64 = 0.0, in 0.0..=180.0, unit "degrees";
        /// Angle between the picture's top and bottom edges, before magnification. The default near plane does not cut
        /// the ground at any angle of the range, as long as the picture is at most 5 times as wide as high.
        vertical_fov_deg: f64 = 60.0, in 1e-3..=170.0, unit "degrees";
        /// Divides the tangent of half the angle: 4 shows a quarter of the width and height.
        magnification: f64 = 1.0, in 1.0..=1e6;
        /// Distance of the near plane: nothing nearer is drawn. By default a 64th of the altitude. Above terrain,
        /// choose a 64th of the height above the terrain.
        near_m: Option<f64> = None, in 1e-6..=1e8, unit "m";
    }
}

choices! {
    /// How a camera moves along a path.
    pub enum PathKind {
        /// Circles around the ground point at the centre of the picture.
        Orbit = "orbit",
        /// Along a great circle (over a plane: a straight line) at constant altitude.
        Pan = "pan",
        /// Straight up or down; the logarithm of the altitude changes linearly.
        Dive = "dive",
        /// Stays at each of several cameras for an equal share of the frames.
        Teleport = "teleport",
    }
}

settings! {
    /// A named camera path through the scene.
    pub struct PathKeys {
        /// The kind of motion.
        kind: PathKind;
        /// Steps from the start to the end; later frames stay at the end.
        frames: u32, in 1..=1_000_000, unit "frames";
        /// Where the path starts. Required except for a teleport.
        camera: Option<String> = None;
        /// The stops of a teleport.
        cameras: Option<Vec<String>> = None;
        /// The total angle of an orbit; positive is counter-clockwise seen from above.
        degrees: Option<f64> = None, in -36_000.0..=36_000.0, unit "degrees";
        /// The direction of a pan, clockwise from north.
        heading_deg: Option<f64> = None, in -360.0..=360.0, unit "degrees";
        /// Length of a pan on the ground.
        distance_m: Option<f64> = None, in -1e9..=1e9, unit "m";
        /// The final altitude of a dive.
        to_altitude_m: Option<f64> = None, in 1e-3..=1e9, unit "m";
    }
}

/// Names of a section's tables, checked.
pub(super) fn names<'a>(scene: &'a super::Scene, section: &str) -> Result<Vec<&'a str>, SceneFault> {
    let Some(value) = scene.document.value(&[section]) else { return Ok(Vec::new()) };
    let wrong = || SceneFault::new(&[section], format!("{value} is not a table of tables"));
    let names = value.as_table().ok_or_else(wrong)?.keys().map(String::as_str);
    names
        .map(|name| match name.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c)) {
            true if !name.is_empty() => Ok(name),
            _ => {
                let what = format!("{name:?} is not a name: letters, digits, _ and - only");
                Err(SceneFault::new(&[section, name], what))
            }
        })
        .collect()
}

pub(super) fn camera(part: &SceneTable<'_>, ground: Ground) -> Result<Camera, SceneFault> {
    let keys = CameraKeys::read(part)?;
    let place = match ground {
        Ground::Planet => {
            let kind = "a camera over the earth";
            part.reject(&["east_m", "north_m"], kind)?;
            GroundPoint::Planet {
                latitude_deg: part.required("latitude_deg", &keys.latitude_deg, kind)?,
                longitude_deg: part.required("longitude_deg", &keys.longitude_deg, kind)?,
            }
        }
        Ground::Plane => {
            let kind = "a camera over a plane";
            part.reject(&["latitude_deg", "longitude_deg"], kind)?;
            GroundPoint::Plane {
                east_m: part.required("east_m", &keys.east_m, kind)?,
                north_m: part.required("north_m", &keys.north_m, kind)?,
            }
        }
    };
    let CameraKeys { altitude_m, heading_deg, tilt_deg, vertical_fov_deg, magnification, near_m, .. } = keys;
    Ok(Camera { place, altitude_m, heading_deg, tilt_deg, vertical_fov_deg, magnification, near_m })
}

pub(super) fn path(
    part: &SceneTable<'_>,
    cameras: &BTreeMap<String, Camera>,
) -> Result<path::CameraPath, SceneFault> {
    let keys = PathKeys::read(part)?;
    let find = |key: &str, camera: &String| {
        cameras.get(camera).copied().ok_or_else(|| {
            part.fault(key, format!("no camera {camera:?}; available: {}", list(cameras.keys())))
        })
    };
    let (kind, own): (_, &[&str]) = match keys.kind {
        PathKind::Orbit => ("an orbit", &["camera", "degrees"]),
        PathKind::Pan => ("a pan", &["camera", "heading_deg", "distance_m"]),
        PathKind::Dive => ("a dive", &["camera", "to_altitude_m"]),
        PathKind::Teleport => ("a teleport", &["cameras"]),
    };
    let all = ["camera", "cameras", "degrees", "heading_deg", "distance_m", "to_altitude_m"];
    let others: Vec<&str> = all.into_iter().filter(|key| !own.contains(key)).collect();
    part.reject(&others, kind)?;
    let start = || find("camera", &part.required("camera", &keys.camera, kind)?);
    let number = |name, value| part.required::<f64>(name, value, kind);
    let motion = match keys.kind {
        PathKind::Orbit => Motion::Orbit { start: start()?, degrees: number("degrees", &keys.degrees)? },
        PathKind::Pan => Motion::Pan {
            start: start()?,
            heading_deg: number("heading_deg", &keys.heading_deg)?,
            distance_m: number("distance_m", &keys.distance_m)?,
        },
        PathKind::Dive => {
            Motion::Dive { start: start()?, to_altitude_m: number("to_altitude_m", &keys.to_altitude_m)? }
        }
        PathKind::Teleport => {
            let stops = part.required("cameras", &keys.cameras, kind)?;
            if stops.is_empty() {
                return Err(part.fault("cameras", "a teleport needs at least one camera"));
            }
            Motion::Teleport {
                stops: stops.iter().map(|stop| find("cameras", stop)).collect::<Result<_, _>>()?,
            }
        }
    };
    let path = path::CameraPath { frames: keys.frames, motion };
    path.check().map_err(|what| part.fault("camera", what))?;
    Ok(path)
}

/// Checks that the view's camera and path exist.
pub(super) fn check_view(
    view: &PictureSettings,
    cameras: &BTreeMap<String, Camera>,
    paths: &BTreeMap<String, path::CameraPath>,
) -> Result<(), SceneFault> {
    if !cameras.contains_key(&view.camera) {
        let what = format!("no camera {:?}; available: {}", view.camera, list(cameras.keys()));
        return Err(SceneFault::new(&["view", "camera"], what));
    }
    match &view.path {
        Some(path) if !paths.contains_key(path) => {
            let what = format!("no path {path:?}; available: {}", list(paths.keys()));
            Err(SceneFault::new(&["view", "path"], what))
        }
        _ => Ok(()),
    }
}
