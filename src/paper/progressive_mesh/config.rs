//! The settings of paper 2: a progressive mesh as a surface's geometry, the governor, and how frames are
//! drawn.

use super::choices::{Apply, ErrorMetric, FaceOrder, Layout, UpAxis};
use super::governor::{Budget, Rule};
use crate::math::light::LightColours;
use crate::picture::PixelFormat;
use crate::scene::camera::Ground;
use crate::scene::{
    Geometry, Language, Scene, SceneError, SceneFault, SceneTable, SettingValue, TableDeclaration, settings,
};
use glam::DVec3;
use std::path::{Path, PathBuf};

/// Paper 2's part of the scene language.
pub const LANGUAGE: Language = Language {
    tables: &[
        TableDeclaration::of::<ProgressiveSurface>(&["surface", "*", "geometry"]),
        TableDeclaration::of::<Budget>(&["governor"]),
    ],
    check,
};

fn check(scene: &Scene) -> Result<(), SceneError> {
    if scene.has(&["governor"]) && names(scene).next().is_none() {
        tracing::warn!("{}: no effect, because no surface is a progressive mesh", scene.place(&["governor"]));
    }
    names(scene).try_for_each(|name| match scene.surfaces[name].texture {
        Some(_) if surface(scene, name)?.geomorph => {
            let what = "the texture would not move with the vertices; leave out geomorph, or the texture";
            Err(scene.fault(&["surface", name, "geometry", "geomorph"], what))
        }
        _ => Ok(()),
    })
}

/// The geometry's `kind`.
pub const KIND: &str = "progressive-mesh";

/// The default order of faces.
pub const DEFAULT_ORDER: FaceOrder = FaceOrder::Tail23;

/// Default of `pixels_per_second`: 0.043 pixels per frame at 60 frames per second. With this limit and geomorphing, no
/// frame of pm.pop changes more than 1 % of the covered pixels visibly, on any of its models. A picture with more outline
/// per covered pixel can exceed 1 %. For example, `knot` seen from `above`, which pm.pop does not measure, covers 677
/// pixels, and 10 of them (1.5 %) change visibly in one frame. A lower limit hardly helps: with 1.4, 8 pixels do. A pixel
/// has 16 samples, and each sample that an outline passes changes a dark pixel by up to 24 levels.
///
/// Without geomorphing, new vertices pop, and the limit does not keep the 1 %. It spreads a jump of the wanted error
/// over the frames of 0.39 seconds, which a wanted error of one pixel needs at most: an approach leaves at most two
/// pixels.
pub const PIXELS_PER_SECOND: f64 = 2.58;

/// The largest `pixels_per_second`. Errors of up to 16,000 pixels reach the wanted error in one frame of 1/60 second.
pub const NO_LIMIT: f64 = 1e6;

/// The source of a model.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ModelSource {
    /// A shipped model, or one downloaded by `ortelius fetch`.
    Named(String),
    /// A .ply, .obj, .glb or .pmesh file; the path is complete.
    File(PathBuf),
}

impl SettingValue for ModelSource {
    type Number = f64;
    fn kind() -> crate::scene::ValueKind {
        crate::scene::ValueKind::Text
    }
    fn read(value: &toml::Value, folder: &Path) -> Result<ModelSource, String> {
        let text = String::read(value, folder)?;
        let ending = Path::new(&text).extension().and_then(|ending| ending.to_str()).unwrap_or("");
        match ending.to_ascii_lowercase().as_str() {
            "" => Ok(ModelSource::Named(text)),
            "ply" | "obj" | "glb" | "pmesh" | "gz" => Ok(ModelSource::File(folder.join(text))),
            _ => Err(format!(
                "{text:?}: a file of a model ends in .ply, .obj, .glb or .pmesh, perhaps with .gz after it"
            )),
        }
    }
    fn to_toml(&self) -> Option<toml::Value> {
        match self {
            ModelSource::Named(name) => name.to_toml(),
            ModelSource::File(path) => path.to_toml(),
        }
    }
}

settings! {
    /// A mesh with continuous levels of detail, drawn once or many times (paper 2). A face is visible from the side on
    /// which its corners run counter-clockwise.
    pub struct ProgressiveSurface kind "progressive-mesh" {
        /// A shipped model (`"bunny"`, `"sphere"`, `"torus"`, `"knot"`, `"solid"`, `"grid"`, `"everest"`, `"valley"`;
        /// `"sphere:40"` is a finer one), a model downloaded by `ortelius fetch` (`"dragon"`), or a file: .ply, .obj,
        /// .glb, .pmesh.
        source: ModelSource;
        /// The longest side of the model's bounding box in the scene.
        size_m: f64, in 1e-6..=1e9, unit "m";
        /// The model's axis that points up in the scene.
        up: UpAxis = UpAxis::Y;
        /// Over a plane: east coordinate of the centre of the bounding box's bottom; default 0.
        east_m: Option<f64> = None, in -1e9..=1e9, unit "m";
        /// Over a plane: north coordinate of the centre of the bounding box's bottom; default 0.
        north_m: Option<f64> = None, in -1e9..=1e9, unit "m";
        /// Over an ellipsoid: latitude of the centre of the bounding box's bottom. The model is upright in
        /// the local east-north-up frame. Required, except for the layout `"along"`.
        latitude_deg: Option<f64> = None, in -90.0..=90.0, unit "degrees";
        /// Over an ellipsoid: longitude of the centre of the bounding box's bottom. Required, except for the
        /// layout `"along"`.
        longitude_deg: Option<f64> = None, in -360.0..=360.0, unit "degrees";
        /// Height of the bounding box's bottom above the plane or the ellipsoid, or above `ground`.
        up_m: f64 = 0.0, in -1e9..=1e9, unit "m";
        /// Heading of every instance, clockwise from north.
        heading_deg: f64 = 0.0, in -360.0..=360.0, unit "degrees";
        /// Number of instances. They share the vertex buffer, and each has its own level.
        instances: u32 = 1, in 1..=100_000;
        /// How several instances are arranged. Over an ellipsoid they are arranged in the tangent plane and
        /// then moved onto the ellipsoid.
        layout: Layout = Layout::Grid;
        /// East and north sides of the area of a grid or a scatter; required for several instances.
        area_m: Option<[f64; 2]> = None, in 0.0..=1e9, unit "m";
        /// The path of the layout `"along"`.
        path: Option<String> = None;
        /// Maximum distance to the side of the path in the layout `"along"`; default 0.
        aside_m: Option<f64> = None, in 0.0..=1e9, unit "m";
        /// Seed of the random layouts `"scatter"` and `"along"`; default 0.
        seed: Option<u32> = None;
        /// Another surface on which each instance stands: a progressive mesh with one instance, or a plane.
        /// Heights are those of the ground's full mesh.
        ground: Option<String> = None;
        /// The wanted deviation from the full model in the picture; 0 draws the full model. The errors of the
        /// levels are estimates, not proven bounds: they are measured at all vertices and at 77 points of
        /// each face.
        error_pixels: f64 = 1.0, in 0.0..=1e6, unit "pixels";
        /// New vertices move gradually instead of popping. A vertex starts at the position of the vertex that was
        /// split. It reaches its own position while the wanted error falls from twice the error of the vertex's level
        /// to exactly that error. This draws levels with half the wanted error, and so about twice the faces. Not
        /// possible with a texture, because the texture coordinates would not move.
        geomorph: bool = false;
        /// The largest change of an instance's error per second while the instance is in view. After a jump of the
        /// wanted error, the drawn error follows over several frames; while the camera approaches, it is at most twice
        /// the wanted error. With the default, the drawn error reaches a wanted error of one pixel within 0.4 seconds
        /// of a jump of the camera; with `geomorph` as well, at most 1 % of the covered pixels change visibly in a
        /// frame (measured by pm.pop). Changes of the governor's factor are not limited. For this limit, a frame of a
        /// path counts as 1/30 second, and any other frame of `render` as 1/60 second. A window uses the measured time.
        /// 1e6 is no limit in practice.
        pixels_per_second: f64 = PIXELS_PER_SECOND, in 0.01..=NO_LIMIT, unit "pixels per second";
        /// The metric of the levels' errors; default `"geometry"`. A `.pmesh` file keeps the metric with which it
        /// was built; if the key is given, it must be that metric.
        metric: Option<ErrorMetric> = None;
        /// The order of faces in the index buffer. A `.pmesh` file keeps its own order; for a baseline it must have the
        /// classical order.
        order: FaceOrder = DEFAULT_ORDER;
        /// Which processor executes level changes.
        apply: Apply = Apply::Cpu;
    }
    check check_surface;
}

fn check_surface(surface: &ProgressiveSurface, part: &SceneTable<'_>) -> Result<(), SceneFault> {
    check_order(surface, part)?;
    check_place(surface, part)?;
    check_layout(surface, part)?;
    check_ground(surface, part)
}

/// Checks that other settings fit the order.
fn check_order(surface: &ProgressiveSurface, part: &SceneTable<'_>) -> Result<(), SceneFault> {
    let order = surface.order;
    if order.is_baseline() && surface.apply != Apply::Cpu {
        let what =
            format!("order = {:?} is a baseline and executes no splits; leave apply out", order.name());
        return Err(part.fault("apply", what));
    }
    if order == FaceOrder::Discrete && surface.geomorph {
        let what = "the meshes of a discrete chain have no splits to morph; leave geomorph out";
        return Err(part.fault("geomorph", what));
    }
    Ok(())
}

fn check_place(surface: &ProgressiveSurface, part: &SceneTable<'_>) -> Result<(), SceneFault> {
    match part.scene.ground {
        Ground::Plane => part.reject(&["latitude_deg", "longitude_deg"], "a mesh over a plane"),
        Ground::Planet => {
            let kind = "a mesh over an ellipsoid";
            part.reject(&["east_m", "north_m"], kind)?;
            if surface.layout == Layout::Along {
                return part.reject(&["latitude_deg", "longitude_deg"], "a layout along a path");
            }
            part.required("latitude_deg", &surface.latitude_deg, kind)?;
            part.required("longitude_deg", &surface.longitude_deg, kind).map(drop)
        }
    }
}

fn check_layout(surface: &ProgressiveSurface, part: &SceneTable<'_>) -> Result<(), SceneFault> {
    let area = |kind| match surface.instances {
        1 => Ok(()),
        _ => part.required("area_m", &surface.area_m, kind).map(drop),
    };
    match surface.layout {
        Layout::Grid => {
            part.reject(&["seed", "path", "aside_m"], "a grid")?;
            area("a grid")
        }
        Layout::Scatter => {
            part.reject(&["path", "aside_m"], "a scatter")?;
            area("a scatter")
        }
        Layout::Along => {
            let kind = "a layout along a path";
            part.reject(&["area_m"], kind)?;
            let path = part.required("path", &surface.path, kind)?;
            match part.scene.path(&path) {
                Ok(_) => Ok(()),
                Err(error) => Err(part.fault("path", error.to_string())),
            }
        }
    }
}

fn check_ground(surface: &ProgressiveSurface, part: &SceneTable<'_>) -> Result<(), SceneFault> {
    let Some(name) = &surface.ground else { return Ok(()) };
    let key = |key| part.scene.has(&["surface", name, "geometry", key]);
    // If the value is not a number, the check of the other surface reports this.
    let instances = part.scene.value(&["surface", name, "geometry", "instances"]);
    let instances = instances.and_then(toml::Value::as_integer).unwrap_or(1);
    let wrong = |what: String| Err(part.fault("ground", what));
    match part.scene.surfaces.get(name).map(|surface| &surface.geometry) {
        None => {
            let others = part.scene.surfaces.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
            wrong(format!("no surface {name:?}; there are {others}"))
        }
        Some(Geometry::Plane(_)) => Ok(()),
        Some(Geometry::Other(kind)) if kind == KIND => match () {
            () if key("ground") => wrong(format!("{name} has a ground itself")),
            () if instances != 1 => wrong(format!("{name} has {instances} instances; a ground is one mesh")),
            () => Ok(()),
        },
        Some(_) => wrong(format!("{name} is not a progressive mesh or a plane; leave ground out")),
    }
}

/// The names of the surfaces that are progressive meshes, in order.
pub fn names(scene: &Scene) -> impl Iterator<Item = &str> {
    let is_one = |geometry: &Geometry| matches!(geometry, Geometry::Other(kind) if kind == KIND);
    scene.surfaces.values().filter(move |surface| is_one(&surface.geometry)).map(|surface| &*surface.name)
}

/// The progressive mesh of a surface.
///
/// # Errors
/// An invalid key, or another kind of geometry.
pub fn surface(scene: &Scene, name: &str) -> Result<ProgressiveSurface, SceneError> {
    scene.read(&["surface", name, "geometry"])
}

/// Settings of frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProgressiveMeshSettings {
    /// Width and height in pixels.
    pub size: [u32; 2],
    pub target: PixelFormat,
    /// Rounds of artificial work per vertex, for figures that need a vertex-bound frame.
    pub vertex_work: u32,
    /// The budget of a frame, and the rule that keeps it.
    pub budget: Option<Budget>,
    pub rule: Rule,
    /// Direction towards the sun, in world axes.
    pub sun: DVec3,
    pub light: LightColours,
    /// The background, in linear light.
    pub background: [f32; 3],
}

impl ProgressiveMeshSettings {
    /// The settings of a scene.
    ///
    /// # Errors
    /// A governor without a budget.
    pub fn of_scene(scene: &Scene, target: PixelFormat) -> Result<ProgressiveMeshSettings, SceneError> {
        Ok(ProgressiveMeshSettings {
            size: [scene.view.width, scene.view.height],
            target,
            vertex_work: 0,
            budget: scene.has(&["governor"]).then(|| scene.read(&["governor"])).transpose()?,
            rule: Rule::default(),
            sun: scene.sun(),
            light: scene.light_colours(),
            background: scene.view.background.map(|channel| channel as f32),
        })
    }
}
