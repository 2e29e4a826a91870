//! The figures' views for the window: for each figure, shipped scenes with the same subject, and the methods of the
//! figure that a scene can select.

use crate::figure::{FigureView, Setting};
use crate::paper::texture_mapping::config::{ReliefMethod, ReliefStep};
use crate::paper::texture_mapping::relief::ReliefKind;
use crate::paper::texture_mapping::relief::parallax::ParallaxFilter;

/// No changes to a scene.
pub const NONE: [&str; 0] = [];

/// A flat scene whose camera `tilted` looks at the board's centre from 24 m. At the shipped sizes a texel is 1/16 m.
fn tilted(name: String, scene: &str, degrees: f64) -> FigureView {
    const DISTANCE_M: f64 = 24.0;
    let (sin, cos) = degrees.to_radians().sin_cos();
    let (north, up) = (-DISTANCE_M * sin, DISTANCE_M * cos);
    let place = format!("east_m=0.0, north_m={north:.6}, altitude_m={up:.6}, tilt_deg={degrees:?}");
    FigureView::new(name, &format!("{scene}/tilted"), [format!("cameras.tilted={{{place}}}")])
}

/// The checker board at several tilts.
pub fn tilted_boards(degrees: &[f64]) -> Vec<FigureView> {
    degrees.iter().map(|&tilt| tilted(format!("tilt {tilt}"), "plane-tilt", tilt)).collect()
}

/// The checker board and the zone plate at several tilts. Scenes have no 1/f noise; the zone plate replaces
/// it, because it contains the same frequencies.
pub fn patterns(degrees: &[f64]) -> Vec<FigureView> {
    let of = |(pattern, scene): (&str, &str), tilt| tilted(format!("{pattern}, tilt {tilt}"), scene, tilt);
    let scenes = [("checker", "plane-tilt"), ("zone plate", "zone-plate")];
    scenes.into_iter().flat_map(|scene| degrees.iter().map(move |&tilt| of(scene, tilt))).collect()
}

/// The figure's planes, and the curved surfaces of the shipped scenes.
pub fn filtered_surfaces() -> Vec<FigureView> {
    let curved = ["sphere/whole", "sphere/pole", "tunnel/inside", "tunnel/wall"];
    let curved = curved.map(|scene| FigureView::new(scene, scene, NONE));
    patterns(&[0.0, 60.0, 80.0]).into_iter().chain(curved).collect()
}

/// Views with camera paths, along which filters flicker, and views at rest.
pub fn moving() -> Vec<FigureView> {
    let paths = ["plane-tilt/pan", "tunnel/flight"].map(|scene| FigureView::new(scene, scene, NONE));
    paths.into_iter().chain(patterns(&[60.0, 80.0])).collect()
}

/// A filter of a plain texture.
fn filter(name: &str, keys: &str) -> Setting {
    Setting::new(name, [format!("surface.NAME.filter={{{keys}}}")])
}

/// The ellipse filter with a minor axis of at least one texel. `max_ratio` limits the ratio of the axes. A scene
/// allows at most 16.
fn ellipse(name: &str, max_ratio: u32) -> Setting {
    filter(name, &format!("kind='ellipse', max_anisotropy={max_ratio}, minor_texels=1"))
}

pub fn ellipse_and_trilinear() -> Vec<Setting> {
    vec![ellipse("ellipse", 16), filter("trilinear", "")]
}

pub fn ellipses_and_trilinear() -> Vec<Setting> {
    vec![ellipse("ellipse, ratio 16", 16), ellipse("ellipse, ratio 4", 4), filter("trilinear", "")]
}

/// The generated reliefs, whose depth is a quarter of their width, in one of the shipped scenes.
fn generated() -> impl Iterator<Item = FigureView> {
    let view = |kind: ReliefKind| {
        let (scene, colours) = match kind {
            ReliefKind::Bricks | ReliefKind::Pillars => ("relief-brick/low", "bricks"),
            ReliefKind::Spikes | ReliefKind::Rock => ("relief-rock/low", "rock"),
        };
        let map = format!("surface.NAME.relief.map={}", kind.name());
        let texture = format!("surface.NAME.texture.source={colours}");
        FigureView::new(kind.name(), scene, [map, texture, "surface.NAME.relief.depth_m=1.0".to_owned()])
    };
    ReliefKind::ALL.into_iter().map(view)
}

/// The shipped reliefs, then the generated reliefs.
pub fn reliefs() -> Vec<FigureView> {
    let shipped = ["relief-brick/low", "relief-rock/low", "relief-brick/above", "relief-rock/above"];
    shipped.map(|scene| FigureView::new(scene, scene, NONE)).into_iter().chain(generated()).collect()
}

pub fn method(method: ReliefMethod) -> String {
    format!("surface.NAME.relief.method={}", method.name())
}

/// The generated reliefs, traced. They are shallower than the figure's, whose maps would take minutes to build.
pub fn traced_reliefs() -> Vec<FigureView> {
    let traced = |view: FigureView| {
        let depth = "surface.NAME.relief.depth_m=0.2".to_owned();
        let changes = view.changes.into_iter().chain([depth, method(ReliefMethod::Trace)]).collect();
        FigureView { changes, ..view }
    };
    generated().map(traced).collect()
}

pub fn relief_methods() -> Vec<Setting> {
    let filtered = ReliefMethod::ALL.iter().filter_map(|&own| match own.step() {
        ReliefStep::Filter(filter) => Some((filter.name(), own)),
        ReliefStep::Trace(_) => None,
    });
    // One traced ray is the nearest setting to the figure's single texel.
    let point = (ParallaxFilter::Point.name(), ReliefMethod::Trace);
    filtered.chain([point]).map(|(name, own)| Setting::new(name, [method(own)])).collect()
}
