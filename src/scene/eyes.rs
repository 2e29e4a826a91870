//! `[view]`, `[cameras.NAME]` and `[paths.NAME]`: how a scene states its eyes, and the checks that need more than one
//! key.

use super::camera::{Camera, Ground, Place};
use super::declare::{Settings, choices, settings};
use super::document::Fault;
use super::error::list;
use super::part::Part;
use super::path::{self, Motion};
use std::collections::BTreeMap;

settings! {
    /// The picture to make.
    pub struct View {
        /// Width of the picture.
        width: u32, in 1..=16_384, unit "pixels";
        /// Height of the picture.
        height: u32, in 1..=16_384, unit "pixels";
        /// A name among the scene's cameras.
        camera: String;
        /// A name among the scene's paths; the eye then follows it from the path's own start.
        path: Option<String> = None;
        /// Linear light where no surface is seen.
        background: [f64; 3] = [0.0; 3], in 0.0..=1e3;
    }
}

settings! {
    /// A named eye: a place on the ground, a height above it, and where it looks.
    pub struct CameraKeys {
        /// Geodetic; over an ellipsoid, and required there.
        latitude_deg: Option<f64> = None, in -90.0..=90.0, unit "degrees";
        /// Over an ellipsoid, and required there.
        longitude_deg: Option<f64> = None, in -360.0..=360.0, unit "degrees";
        /// From the plane's middle; over a plane, and required there.
        east_m: Option<f64> = None, in -1e9..=1e9, unit "m";
        /// As `east_m`.
        north_m: Option<f64> = None, in -1e9..=1e9, unit "m";
        /// Above the ellipsoid or the plane.
        altitude_m: f64, in 1e-3..=1e9, unit "m";
        /// Clockwise from north: the direction that is up in the picture when the eye looks straight down.
        heading_deg: f64 = 0.0, in -360.0..=360.0, unit "degrees";
        /// 0 looks straight down, 90 to the horizontal in the direction of the heading, 180 straight up.
        tilt_deg: f64 = 0.0, in 0.0..=180.0, unit "degrees";
        /// Angle between the picture's upper and lower edge before magnification. Above 178 the near plane would cut
        /// into the ground at the picture's corners.
        vertical_fov_deg: f64 = 60.0, in 1e-3..=170.0, unit "degrees";
        /// Divides the tangent of half the angle: 4 shows a quarter of the width and of the height.
        magnification: f64 = 1.0, in 1.0..=1e6;
    }
}

choices! {
    /// How an eye moves along a path.
    pub enum PathKind {
        /// Circles about the ground's point in the middle of the picture.
        Orbit = "orbit",
        /// Along a great circle, or over a plane along a straight line, at constant altitude.
        Pan = "pan",
        /// Straight up or down; the logarithm of the altitude changes evenly.
        Dive = "dive",
        /// At each of several cameras for an equal share of the frames.
        Teleport = "teleport",
    }
}

settings! {
    /// A named way of the eye through the scene.
    pub struct PathKeys {
        /// How the eye moves.
        kind: PathKind;
        /// Steps from the start to the end; later frames hold the end.
        frames: u32, in 1..=1_000_000, unit "frames";
        /// Where it starts; required, but for a teleport.
        camera: Option<String> = None;
        /// The stops of a teleport.
        cameras: Option<Vec<String>> = None;
        /// The whole angle of an orbit; positive is counter-clockwise seen from above.
        degrees: Option<f64> = None, in -36_000.0..=36_000.0, unit "degrees";
        /// Where a pan leaves to, clockwise from north.
        heading_deg: Option<f64> = None, in -360.0..=360.0, unit "degrees";
        /// Length of a pan on the ground.
        distance_m: Option<f64> = None, in -1e9..=1e9, unit "m";
        /// The end of a dive.
        to_altitude_m: Option<f64> = None, in 1e-3..=1e9, unit "m";
    }
}

/// The names of a section's tables, each checked.
pub(super) fn names<'a>(scene: &'a super::Scene, section: &str) -> Result<Vec<&'a str>, Fault> {
    let Some(value) = scene.document.value(&[section]) else { return Ok(Vec::new()) };
    let wrong = || Fault::new(&[section], format!("{value} is not a table of tables"));
    let names = value.as_table().ok_or_else(wrong)?.keys().map(String::as_str);
    names
        .map(|name| match name.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c)) {
            true if !name.is_empty() => Ok(name),
            _ => {
                let what = format!("{name:?} is not a name: letters, digits, _ and - only");
                Err(Fault::new(&[section, name], what))
            }
        })
        .collect()
}

pub(super) fn camera(part: &Part<'_>, ground: Ground) -> Result<Camera, Fault> {
    let keys = CameraKeys::read(part)?;
    let place = match ground {
        Ground::Planet => {
            let kind = "a camera over the earth";
            part.absent(&["east_m", "north_m"], kind)?;
            Place::Planet {
                latitude_deg: part.needed("latitude_deg", &keys.latitude_deg, kind)?,
                longitude_deg: part.needed("longitude_deg", &keys.longitude_deg, kind)?,
            }
        }
        Ground::Plane => {
            let kind = "a camera over a plane";
            part.absent(&["latitude_deg", "longitude_deg"], kind)?;
            Place::Plane {
                east_m: part.needed("east_m", &keys.east_m, kind)?,
                north_m: part.needed("north_m", &keys.north_m, kind)?,
            }
        }
    };
    let CameraKeys { altitude_m, heading_deg, tilt_deg, vertical_fov_deg, magnification, .. } = keys;
    Ok(Camera { place, altitude_m, heading_deg, tilt_deg, vertical_fov_deg, magnification })
}

pub(super) fn path(part: &Part<'_>, cameras: &BTreeMap<String, Camera>) -> Result<path::Path, Fault> {
    let keys = PathKeys::read(part)?;
    let find = |key: &str, camera: &String| {
        cameras.get(camera).copied().ok_or_else(|| {
            part.fault(key, format!("no camera {camera:?}; there are {}", list(cameras.keys())))
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
    part.absent(&others, kind)?;
    let start = || find("camera", &part.needed("camera", &keys.camera, kind)?);
    let number = |name, value| part.needed::<f64>(name, value, kind);
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
            let stops = part.needed("cameras", &keys.cameras, kind)?;
            if stops.is_empty() {
                return Err(part.fault("cameras", "a teleport needs at least one camera"));
            }
            Motion::Teleport {
                stops: stops.iter().map(|stop| find("cameras", stop)).collect::<Result<_, _>>()?,
            }
        }
    };
    let path = path::Path { frames: keys.frames, motion };
    path.check().map_err(|error| part.fault("camera", error.to_string()))?;
    Ok(path)
}

/// Whether the view's camera and path are there.
pub(super) fn check_view(
    view: &View,
    cameras: &BTreeMap<String, Camera>,
    paths: &BTreeMap<String, path::Path>,
) -> Result<(), Fault> {
    if !cameras.contains_key(&view.camera) {
        let what = format!("no camera {:?}; there are {}", view.camera, list(cameras.keys()));
        return Err(Fault::new(&["view", "camera"], what));
    }
    match &view.path {
        Some(path) if !paths.contains_key(path) => {
            let what = format!("no path {path:?}; there are {}", list(paths.keys()));
            Err(Fault::new(&["view", "path"], what))
        }
        _ => Ok(()),
    }
}
