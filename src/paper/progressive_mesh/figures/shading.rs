//! pm.shading: how much of a level's picture differs from the full mesh's, by the normals that it shows.

use super::super::cache::live_faces;
use super::super::choices::{ErrorMetric, FaceOrder};
use super::super::config::{self, ProgressiveSurface};
use super::super::keep::ordered;
use super::super::load::LoadedMesh;
use super::super::mesh::{Level, ProgressiveMesh, Vertices};
use super::super::place::{Bounds, Placement};
use super::super::run::level_for_error;
use super::super::simplify::SimplifyOptions;
use super::super::stand::stands;
use super::super::surface::vertices::{face_normals, normals};
use super::difference::{BEYOND, EXCESS, INSIDE, LevelDifference, RMS, Shot, VISIBLE, WIDEST, WIDEST_BEYOND};
use super::orders::collapses;
use super::pop::{SAMPLES, averaged};
use super::surfaces::distances;
use super::{metrics, scans, seen};
use crate::figure::prelude::*;
use crate::math::camera::Pose;
use crate::model;
use crate::paper::progressive_mesh::{ProgressiveMeshSettings, ProgressiveMeshes};
use crate::picture::PixelFormat;
use crate::picture::write::Srgb8Picture;
use crate::scene::Scene;
use crate::vk::Gpu;
use glam::DVec3;
use std::collections::HashMap;

pub const SHADING: Figure = Figure {
    id: "pm.shading",
    title: "Shading at a wanted error",
    about: "A level that is nowhere farther from the full mesh than a pixel may still look different: the paper draws \
            it with the full mesh's normals at the remaining vertices, and its error knows only distances. How many \
            pixels differ visibly from the full mesh at the error that a scene wants? `normals of the level` are \
            area-weighted means over the level's faces; wedges of a crease stay apart. `normal-aware` collapses (`mesh \
            build --metric appearance`) also count the region in which the interpolated normals differ visibly from \
            the model's: its radius is an error like a distance, so an error of e pixels allows a disc of radius e (J. \
            Cohen, M. Olano and D. Manocha, \"Appearance-Preserving Simplification\", SIGGRAPH 1998, and H. Hoppe, \
            \"New Quadric Metric for Simplifying Meshes with Appearance Attributes\", IEEE Visualization 1999, measure \
            or preserve attributes in other ways). They need more faces at the same wanted error. So both are also \
            compared at equal numbers of faces: at the number that the paper's collapses need at this wanted error, \
            and at the number that normal-aware collapses need. Each pixel is the mean of 16 samples in linear light. \
            A pixel differs visibly by more than 8 levels of 8-bit sRGB. A pixel is inside the outline if both \
            pictures cover all of its samples. The widest visible difference is the side of the largest square of \
            pixels that all differ visibly; the excess is this side less the wanted error. But an error in pixels lets \
            a surface move by as much, and a moved picture differs visibly wherever its levels change fast, for \
            example at an outline. So a difference is also compared with what the other picture shows nearby. It is \
            beyond the wanted error if a pixel in one picture is more than 8 levels brighter or darker than all pixels \
            of the other picture that a movement by the wanted error reaches. Near an outline these include the \
            background. `solid/near`, `knot/near` and `dragon_res4/near` are the scene `bunny/near` with another \
            model; solid and knot have stored normals, and solid has creases. The scan is measured if it has been \
            fetched. The pictures have no texture, so the texture coordinates of knot are left out of its error; \
            pm.texture measures what they add.",
    scenes: &["bunny/near", "bunny/above", "solid/near", "knot/near", "dragon_res4/near"],
    variants: || [PAPER, LEVEL, AWARE, AWARE_AS_MANY, PAPER_AS_MANY, LEVEL_AS_MANY].map(String::from).into(),
    paper: &[PAPER],
    ours: &[AWARE],
    full_only: &[],
    sweep: Some(Sweep { name: "wanted error, pixels", quick: &WANTED, full: &WANTED }),
    show: Show::views(|| seen(SHADING.scenes)).variants(|| metrics([PAPER, AWARE])),
    measure,
    plots: &[
        Plot::sweep(VISIBLE).log_x(),
        Plot::sweep(INSIDE).log_x(),
        Plot::sweep(WIDEST).log_x().log_y(),
        Plot::sweep(BEYOND).log_x(),
        Plot::sweep(RMS).log_x(),
        Plot::sweep(FACES).log_x().log_y(),
    ],
    claims: &[
        Claim::ours(
            "distance-bounds",
            "An error that knows only distances bounds what is seen: with the full mesh's normals, no visible \
             difference is wider than the wanted error plus one pixel.",
            &[Test::value(one(EXCESS, PAPER), AtMost(1.0))],
        ),
        Claim::ours(
            "appearance-bounds",
            "With normal-aware collapses, no visible difference is wider than the wanted error plus one pixel.",
            &[Test::value(one(EXCESS, AWARE), AtMost(1.0))],
        ),
        Claim::ours(
            "distance-bounds-moved",
            "With the full mesh's normals, no difference beyond the wanted error is wider than the wanted error.",
            &[Test::value(one(WIDEST_BEYOND, PAPER), AtMost(1.0))],
        ),
        Claim::ours(
            "appearance-bounds-moved",
            "With normal-aware collapses, no difference beyond the wanted error is wider than the wanted error.",
            &[Test::value(one(WIDEST_BEYOND, AWARE), AtMost(1.0))],
        ),
        Claim::ours(
            "at-a-pixel",
            "With normal-aware collapses, at a wanted error of at most a pixel, at most 2 % of the covered pixels \
             lie inside the outline and differ visibly.",
            &[Test::value(one(INSIDE, AWARE), AtMost(2.0))],
        )
        .at(Places::ALL.x(0.0, 1.0)),
        Claim::ours(
            "equal-faces-inside",
            "At equal numbers of faces, normal-aware collapses leave at most 0.75 times as many pixels inside the \
             outline that differ visibly, at wanted errors of 1 to 8 pixels.",
            &[Test::ratio_of(INSIDE, [AWARE, PAPER_AS_MANY], AtMost(0.75))],
        )
        .at(Places::ALL.x(1.0, 8.0)),
        Claim::ours(
            "equal-faces",
            "At equal numbers of faces, normal-aware collapses leave no more pixels that differ visibly, outline \
             included.",
            &[Test::ratio_of(VISIBLE, [AWARE, PAPER_AS_MANY], AtMost(1.0))],
        ),
        Claim::ours(
            "equal-faces-rms",
            "At equal numbers of faces, normal-aware collapses do not raise the root mean square of the difference.",
            &[Test::ratio_of(RMS, [AWARE, PAPER_AS_MANY], AtMost(1.0))],
        ),
        Claim::ours(
            "level-normals",
            "Normals of the level suffice: with the paper's collapses and as many faces as the normal-aware ones, they \
             leave no more pixels inside the outline that differ visibly.",
            &[Test::ratio_of(INSIDE, [LEVEL_AS_MANY, AWARE], AtMost(1.0))],
        ),
    ],
};

const WANTED: [f64; 5] = [0.5, 1.0, 2.0, 4.0, 8.0];

const PAPER: &str = "normals of the full mesh (the paper)";
const LEVEL: &str = "normals of the level";
const AWARE: &str = "normal-aware collapses";
const AWARE_AS_MANY: &str = "normal-aware collapses, as many faces as the paper";
const PAPER_AS_MANY: &str = "the paper, as many faces as normal-aware";
const LEVEL_AS_MANY: &str = "normals of the level, as many faces as normal-aware";

const FACES: &str = "faces";
const DISTANCE: &str = "mean distance";

/// The wanted error and the scenes of the pictures that are written.
const PICTURED: (f64, [&str; 2]) = (4.0, ["bunny/near", "solid/near"]);

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let wanted = cell.x.context("the sweep has values")?;
    let (name, eye) = cell.scene.split_once('/').context("a scene is MODEL/CAMERA")?;
    let model = scans::open(name)?;
    let stage = ShadingScene::new(bench, name, eye)?;
    // The picture has no texture. pm.texture measures what texture coordinates add to the error.
    let mut bare = model.clone();
    bare.attributes.coordinates.clear();
    let [plain, aware] = [ErrorMetric::Geometry, ErrorMetric::Appearance].map(|metric| {
        let options = SimplifyOptions { metric, ..SimplifyOptions::default() };
        let of = if metric == ErrorMetric::Appearance { &bare } else { &model };
        ordered(&model, &collapses(of, &options), FaceOrder::Classical)
    });
    let [at_plain, at_aware] = [&plain, &aware].map(|mesh| stage.level(mesh, wanted));
    let faces = |mesh: &ProgressiveMesh, level: u32| mesh.levels[level as usize].faces;
    let as_few = level_with(&aware, faces(&plain, at_plain));
    let as_many = level_with(&plain, faces(&aware, at_aware));
    let own = |mesh: &ProgressiveMesh| normals(mesh, &live_faces(mesh, mesh.last_level()));
    let of_level =
        |mesh: &ProgressiveMesh, level: u32| face_normals(mesh, &live_faces(mesh, level), &smooth(mesh));
    let truth = stage.shot(&plain, plain.last_level(), own(&plain))?;
    let pictured = wanted == PICTURED.0 && PICTURED.1.contains(&&*cell.scene);
    let mut rows = Vec::new();
    for (variant, mesh, level, normals) in [
        (PAPER, &plain, at_plain, own(&plain)),
        (LEVEL, &plain, at_plain, of_level(&plain, at_plain)),
        (AWARE, &aware, at_aware, own(&aware)),
        (AWARE_AS_MANY, &aware, as_few, own(&aware)),
        (PAPER_AS_MANY, &plain, as_many, own(&plain)),
        (LEVEL_AS_MANY, &plain, as_many, of_level(&plain, as_many)),
    ] {
        let shot = stage.shot(mesh, level, normals)?;
        rows.extend(LevelDifference::between(&shot, &truth, wanted).rows(variant, wanted));
        rows.push(Row::number(variant, FACES, "faces", f64::from(faces(mesh, level))));
        if [PAPER, AWARE_AS_MANY].contains(&variant) {
            rows.push(Row::number(variant, DISTANCE, "diagonals", mean_distance(&model, mesh, level)?));
        }
        if pictured {
            picture(bench, cell, variant, &shot, stage.size)?;
        }
    }
    if pictured {
        picture(bench, cell, "full mesh", &truth, stage.size)?;
    }
    Ok(rows)
}

/// The mean distance between a model and a level, in diagonals.
fn mean_distance(model: &model::Model, mesh: &ProgressiveMesh, level: u32) -> anyhow::Result<f64> {
    let Vertices { positions, centre, .. } = &mesh.vertices;
    let positions: Vec<DVec3> = positions.iter().map(|&p| *centre + DVec3::from(p.map(f64::from))).collect();
    Ok(distances(model, &positions, &live_faces(mesh, level), 20_000).context("no face is left")?.mean)
}

fn picture(bench: &mut Bench, cell: &Cell, what: &str, shot: &Shot, size: [u32; 2]) -> anyhow::Result<()> {
    let rgba = shot.levels.iter().flat_map(|&level| [level, level, level, 255]).collect();
    let name = format!("{} {} {what}", SHADING.id, cell.scene).replace([' ', '/', ',', '(', ')', '\''], "-");
    bench.picture(&name, &Srgb8Picture { width: size[0], height: size[1], rgba })
}

/// A scene's camera and settings, for any mesh in place of the scene's.
struct ShadingScene {
    gpu: Gpu,
    settings: ProgressiveMeshSettings,
    scene: Scene,
    surface: ProgressiveSurface,
    pose: Pose,
    /// Width and height in pixels.
    size: [u32; 2],
}

impl ShadingScene {
    /// The scene `bunny` with another model.
    fn new(bench: &Bench, model: &str, eye: &str) -> anyhow::Result<ShadingScene> {
        let scene = Scene::load_with("bunny", &[format!("surface.bunny.geometry.source={model}")])?;
        let surface = config::surface(&scene, "bunny")?;
        let size = bench.effort_of([320, 180], [1280, 720]);
        Ok(ShadingScene {
            gpu: bench.gpu(&[])?,
            settings: ProgressiveMeshSettings {
                size: size.map(|side| side * SAMPLES),
                ..ProgressiveMeshSettings::of_scene(&scene, PixelFormat::Linear32)?
            },
            surface,
            pose: scene.camera(eye)?.pose(),
            scene,
            size,
        })
    }

    /// The level that a wanted error in pixels selects.
    fn level(&self, mesh: &ProgressiveMesh, pixels: f64) -> u32 {
        let bounds = Bounds::of(&mesh.vertices.positions);
        let place = Placement::new(&self.surface, &bounds, &stands(&self.scene, &self.surface)[0]);
        level_for_error(&mesh.levels, place.wanted_error(&self.pose, self.size[1], pixels) as f32)
    }

    /// The picture of a level whose vertices have these normals.
    fn shot(&self, mesh: &ProgressiveMesh, level: u32, normals: Vec<[f32; 3]>) -> anyhow::Result<Shot> {
        let mesh = still(mesh, level, normals);
        let model = LoadedMesh::new(&self.scene, "bunny", self.surface.clone(), mesh);
        let mut run = ProgressiveMeshes::run(self.gpu.clone(), &[model], self.settings)?;
        run.frame(&self.pose)?;
        let samples: Vec<[f32; 4]> = run.read_picture(bytemuck::pod_collect_to_vec)?;
        let [width, height] = self.size.map(|side| side as usize);
        // The corner sample shows the background.
        let side = SAMPLES as usize;
        let covered = |x: usize, y: usize| samples[y * width * side + x] != samples[0];
        let inside = |n: usize| {
            let [left, top] = [n % width * side, n / width * side];
            (0..side * side).all(|n| covered(left + n % side, top + n / side))
        };
        Ok(Shot {
            width,
            levels: averaged(&samples, [width, height], side),
            inside: (0..width * height).map(inside).collect(),
        })
    }
}

/// A mesh that has only one level, with other normals.
fn still(mesh: &ProgressiveMesh, level: u32, normals: Vec<[f32; 3]>) -> ProgressiveMesh {
    let faces = live_faces(mesh, level);
    let attributes = model::Attributes { normals, ..model::Attributes::default() };
    let vertices = Vertices { attributes, ..mesh.vertices.clone() };
    let only = Level { vertices: vertices.positions.len() as u32, faces: faces.len() as u32, error: 0.0 };
    ProgressiveMesh { vertices, faces, levels: vec![only], ..ProgressiveMesh::default() }
}

/// The finest level with at most `faces` faces.
fn level_with(mesh: &ProgressiveMesh, faces: u32) -> u32 {
    (mesh.levels.partition_point(|level| level.faces <= faces) as u32).saturating_sub(1)
}

/// For each vertex, the first vertex at its position with the same normal in the model, so that creases stay.
fn smooth(mesh: &ProgressiveMesh) -> Vec<u32> {
    let Vertices { welded, attributes, .. } = &mesh.vertices;
    let mut firsts = HashMap::new();
    let first = |(vertex, &position): (u32, &u32)| {
        let own = attributes.normals.get(vertex as usize).map(|normal| normal.map(f32::to_bits));
        *firsts.entry((position, own)).or_insert(vertex)
    };
    (0..).zip(welded).map(first).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::named;

    #[test]
    fn normals_of_the_full_level_are_near_the_models_and_creases_stay() {
        let model = named("solid:8").unwrap();
        let collapses = collapses(&model, &SimplifyOptions::default());
        let mesh = ordered(&model, &collapses, FaceOrder::Classical);
        let full = live_faces(&mesh, mesh.last_level());
        let own = normals(&mesh, &full);
        let near =
            |a: [f32; 3], b: [f32; 3]| DVec3::from(a.map(f64::from)).dot(DVec3::from(b.map(f64::from)));
        let of_faces = face_normals(&mesh, &full, &smooth(&mesh));
        assert!(full.iter().flatten().all(|&v| near(own[v as usize], of_faces[v as usize]) > 0.9));
        assert!(
            mesh.vertices.positions.len() > 1 && smooth(&mesh) != mesh.vertices.welded,
            "the solid has creases"
        );
    }
}
