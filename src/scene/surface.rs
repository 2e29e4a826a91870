//! `[surface.NAME]`: geometry, texture and filter of one visible object. Declares the geometries and textures that
//! belong to no paper: grids, and a picture as a plain mip chain. Papers declare the other kinds.

use super::Scene;
use super::camera::Ground;
use super::declare::{Settings, choices, settings};
use super::document::SceneFault;
use super::error::list;
use super::eyes::names;
use super::part::SceneTable;
use super::value::{SettingValue, ValueKind, not, plain_settings};
use crate::model::mesh::{self, SourceMesh};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

settings! {
    /// One visible object. All surfaces share one camera, one depth buffer and one ground: an ellipsoid if any
    /// geometry is an ellipsoid, otherwise a plane.
    pub struct SurfaceKeys {
        /// The shape.
        geometry: Table;
        /// The texture, or the name of another surface whose texture is shared. A progressive mesh needs texture
        /// coordinates in 0 ..= 1 for it.
        texture: Option<TextureKeys> = None;
        /// How the texture is filtered. `"auto"` measures all filters (or a relief's methods) on this device and takes
        /// the one that `max_error` or `max_ms` selects. In a scene with a virtual texture, only the surface that has
        /// it can be `"auto"`, and only if it is not a progressive mesh.
        filter: Option<FilterKeys> = None;
        /// With `filter = "auto"`: use the fastest filter whose NMSE is at most this.
        max_error: Option<f64> = None, in 0.0..=1.0;
        /// With `filter = "auto"`: use the most accurate filter whose settled frame takes at most this.
        max_ms: Option<f64> = None, in 0.0..=1e6, unit "ms";
        /// Heights below a plane.
        relief: Option<Table> = None;
        /// True if the sun lights the surface. By default, surfaces with a virtual texture are unlit and all others
        /// are lit.
        lit: Option<bool> = None;
    }
}

/// A texture's own table, or the name of the surface whose texture is shared.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum TextureKeys {
    Own(Table),
    Of(String),
}

/// A filter's own table, or `"auto"`.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum FilterKeys {
    Own(Table),
    Auto(&'static str),
}

plain_settings! {
    TextureKeys, ValueKind::TableOrText, "a table, nor the name of a surface",
        |value, _| match value {
            Value::Table(table) => Some(TextureKeys::Own(table.clone())),
            Value::String(name) => Some(TextureKeys::Of(name.clone())),
            _ => None,
        },
        |texture| match texture {
            TextureKeys::Own(table) => Value::Table(table.clone()),
            TextureKeys::Of(name) => Value::String(name.clone()),
        };
    FilterKeys, ValueKind::TableOrText, "a table, nor \"auto\"",
        |value, _| match value {
            Value::Table(table) => Some(FilterKeys::Own(table.clone())),
            Value::String(word) if word == AUTO => Some(FilterKeys::Auto(AUTO)),
            _ => None,
        },
        |filter| match filter {
            FilterKeys::Own(table) => Value::Table(table.clone()),
            FilterKeys::Auto(word) => Value::String((*word).to_owned()),
        };
}

const AUTO: &str = "auto";

/// What the filter `"auto"` must satisfy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FilterBound {
    MaxError(f64),
    MaxMs(f64),
}

settings! {
    /// The WGS84 ellipsoid in earth-centred metres, as a grid of quads. The texture covers all of it.
    pub struct Ellipsoid derive(Copy) kind "ellipsoid" {
        /// Quads along a parallel.
        columns: u32, in 3..=8192;
        /// Quads from pole to pole.
        rows: u32, in 2..=8192;
    }
}

settings! {
    /// A rectangle in the plane z = 0 around the origin, x to the east and y to the north. The texture covers it
    /// once.
    pub struct Plane derive(Copy) kind "plane" {
        /// East to west.
        width_m: f64, in 1e-3..=1e9, unit "m";
        /// North to south.
        height_m: f64, in 1e-3..=1e9, unit "m";
        /// Quads, west to east.
        columns: u32, in 1..=8192;
        /// Quads, north to south.
        rows: u32, in 1..=8192;
    }
}

settings! {
    /// The inside of a cylinder that lies on the ground, from the origin to the north. The texture covers it once: s
    /// runs around from the top, counter-clockwise seen from the south; t runs from north to south.
    pub struct Cylinder derive(Copy) kind "cylinder" {
        /// Radius of the wall.
        radius_m: f64, in 1e-3..=1e9, unit "m";
        /// Length from south to north.
        length_m: f64, in 1e-3..=1e9, unit "m";
        /// Quads, once around.
        columns: u32, in 3..=8192;
        /// Quads, north to south.
        rows: u32, in 1..=8192;
    }
}

choices! {
    /// The source of a plain texture.
    pub enum PlainSource {
        /// A PNG, JPEG or TIFF.
        File = "file",
        /// The shipped picture of the earth, 4096 x 2048 texels.
        Earth = "earth",
        /// 64 x 32 squares, black and white, 2048 x 1024 texels.
        Checker = "checker",
        /// Concentric rings of up to half a cycle per texel, 1024 x 1024 texels.
        ZonePlate = "zone-plate",
        /// Colours of the relief `brick-wall`, 256 x 256 texels.
        BrickWall = "brick-wall",
        /// Colours of the relief `cliff`, 512 x 512 texels.
        Cliff = "cliff",
        /// Colours of the relief `bricks`, 256 x 256 texels.
        Bricks = "bricks",
        /// Colours of the relief `rock`, 128 x 128 texels.
        Rock = "rock",
    }
}

settings! {
    /// A picture as one image with its mip chain.
    pub struct Plain kind "plain" {
        /// The source of the picture.
        source: PlainSource = PlainSource::File;
        /// A PNG, JPEG or TIFF, relative to the scene, or to the working directory if given by `-D`.
        path: Option<PathBuf> = None;
    }
    check check_plain;
}

fn check_plain(plain: &Plain, part: &SceneTable<'_>) -> Result<(), SceneFault> {
    match plain.source {
        PlainSource::File => part.required("path", &plain.path, "a plain texture").map(drop),
        other => part.reject(&["path"], &format!("the source {:?}", other.name())),
    }
}

/// The shape of a surface; details only for shapes that belong to no paper.
#[derive(Clone, Debug, PartialEq)]
pub enum Geometry {
    Ellipsoid(Ellipsoid),
    Plane(Plane),
    Cylinder(Cylinder),
    /// The `kind` of another shape; its paper reads the rest.
    Other(String),
}

/// One `[surface.NAME]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    pub name: String,
    pub geometry: Geometry,
    /// The surface whose table contains the texture: this surface, or another one whose texture it shares.
    pub texture: Option<String>,
    /// The bound of the filter `"auto"`.
    pub auto: Option<FilterBound>,
    pub lit: Option<bool>,
}

impl Surface {
    /// The triangles of an ellipsoid, a plane or a cylinder; `None` for other kinds.
    pub fn grid(&self) -> Option<SourceMesh> {
        Some(match self.geometry {
            Geometry::Ellipsoid(Ellipsoid { columns, rows }) => mesh::earth(columns, rows),
            Geometry::Plane(Plane { width_m, height_m, columns, rows }) => {
                mesh::plane(width_m, height_m, columns, rows)
            }
            Geometry::Cylinder(Cylinder { radius_m, length_m, columns, rows }) => {
                mesh::cylinder(radius_m, length_m, columns, rows)
            }
            Geometry::Other(_) => return None,
        })
    }
}

/// The common ground of a scene.
///
/// # Errors
/// A surface without geometry; an ellipsoid together with a plane or a cylinder.
pub(super) fn ground(scene: &Scene) -> Result<Ground, SceneFault> {
    let kinds = names(scene, "surface")?.into_iter().map(|name| Ok((name, kind(scene, name)?)));
    let kinds = kinds.collect::<Result<Vec<_>, _>>()?;
    let of = |kind| kinds.iter().find(|(_, other)| *other == kind).map(|(name, _)| name);
    let flat = ["plane", "cylinder"].into_iter().find_map(|kind| Some((kind, of(kind)?)));
    match (of("ellipsoid"), flat) {
        (Some(ellipsoid), Some((kind, name))) => {
            let what = format!(
                "a scene has one ground, and {ellipsoid} is an ellipsoid; put the {kind} into another scene"
            );
            Err(SceneFault::new(&["surface", name, "geometry", "kind"], what))
        }
        (Some(_), None) => Ok(Ground::Planet),
        _ => Ok(Ground::Plane),
    }
}

/// The kind of a surface's geometry.
fn kind<'a>(scene: &'a Scene, name: &str) -> Result<&'a str, SceneFault> {
    let key = ["surface", name, "geometry", "kind"];
    scene.word(&key).ok_or_else(|| match scene.document.value(&key) {
        Some(value) => SceneFault::new(&key, format!("{value} is not text")),
        None => SceneFault::new(&key, "a surface needs geometry = { kind = ... }"),
    })
}

pub(super) fn surfaces(scene: &Scene) -> Result<BTreeMap<String, Surface>, SceneFault> {
    let names = names(scene, "surface")?;
    if names.is_empty() {
        return Err(SceneFault::new(
            &["surface"],
            "the scene is empty: it needs at least one [surface.NAME]",
        ));
    }
    let all = names.iter().map(|&name| Ok((name.to_owned(), surface(scene, name, &names)?)));
    all.collect()
}

/// Refuses a relief where the surface cannot carry it.
fn check_relief(part: &SceneTable<'_>, keys: &SurfaceKeys, geometry: &Geometry) -> Result<(), SceneFault> {
    let fault = |what: &str| Err(part.fault("relief", what));
    match geometry {
        Geometry::Plane(Plane { width_m, height_m, .. }) if width_m == height_m => {}
        Geometry::Plane(_) => {
            return fault("its texels are square; make width_m and height_m of the plane equal");
        }
        _ => return fault("only a plane can have a relief; set geometry.kind = \"plane\", or omit relief"),
    }
    if keys.texture.is_none() {
        return fault("a relief needs a plain texture; add one");
    }
    if matches!(keys.filter, Some(FilterKeys::Own(_))) {
        return fault("a relief has its own filter method; omit filter or relief");
    }
    Ok(())
}

/// The bound of the filter `"auto"`.
fn auto(part: &SceneTable<'_>, keys: &SurfaceKeys) -> Result<Option<FilterBound>, SceneFault> {
    let bounds = [keys.max_error.map(FilterBound::MaxError), keys.max_ms.map(FilterBound::MaxMs)];
    let auto = matches!(keys.filter, Some(FilterKeys::Auto(_)));
    match (auto, bounds) {
        (false, [None, None]) => Ok(None),
        (true, [Some(bound), None] | [None, Some(bound)]) => Ok(Some(bound)),
        (true, [None, None]) => Err(part.fault("filter", "\"auto\" needs a bound: max_error or max_ms")),
        (true, _) => Err(part.fault("max_ms", "\"auto\" has one bound: leave out max_ms or max_error")),
        (false, [Some(_), _]) => Err(part.fault("max_error", "only filter = \"auto\" has a bound")),
        (false, _) => Err(part.fault("max_ms", "only filter = \"auto\" has a bound")),
    }
}

fn surface(scene: &Scene, name: &str, names: &[&str]) -> Result<Surface, SceneFault> {
    let path = ["surface", name];
    let part = SceneTable::of(scene, &path)?;
    let keys = SurfaceKeys::read(&part)?;
    let at = ["surface", name, "geometry"];
    let grid = SceneTable::of(scene, &at)?;
    let geometry = match kind(scene, name)? {
        "ellipsoid" => Geometry::Ellipsoid(Ellipsoid::read(&grid)?),
        "plane" => Geometry::Plane(Plane::read(&grid)?),
        "cylinder" => Geometry::Cylinder(Cylinder::read(&grid)?),
        kind => Geometry::Other(kind.to_owned()),
    };
    if keys.filter.is_some() && keys.texture.is_none() {
        return Err(part.fault("filter", "a surface without a texture has no filter"));
    }
    if keys.relief.is_some() {
        check_relief(&part, &keys, &geometry)?;
    }
    let auto = auto(&part, &keys)?;
    let texture = match keys.texture {
        None => None,
        Some(TextureKeys::Own(_)) => Some(name.to_owned()),
        Some(TextureKeys::Of(other)) => {
            let own = scene.document.value(&["surface", &other, "texture"]).is_some_and(Value::is_table);
            if !own {
                let has = |name: &&&str| {
                    scene.document.value(&["surface", name, "texture"]).is_some_and(Value::is_table)
                };
                let existing = list(names.iter().filter(has));
                let what = format!(
                    "surface {other:?} does not exist or has no texture of its own; surfaces with a texture: {existing}"
                );
                return Err(part.fault("texture", what));
            }
            Some(other)
        }
    };
    Ok(Surface { name: name.to_owned(), geometry, texture, auto, lit: keys.lit })
}
