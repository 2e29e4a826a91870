//! The picture of a scene in f64: every surface, its texture's mean over each pixel's footprint, and its light.
//! Computing this picture is slow; the window's error overlay computes it while frames continue.
//!
//! A progressive mesh is shown at a level whose stated error is at most a quarter of a pixel, regardless of its level
//! in the frame.

use super::plain::ALBEDO;
use super::relief_truth::Below;
use super::surface::{carries_virtual, is_lit, plain_texture, relief};
use crate::math::camera::Pose;
use crate::math::light::LightColours;
use crate::model::mesh::SourceMesh;
use crate::paper::progressive_mesh::cache::live_faces;
use crate::paper::progressive_mesh::place::{Bounds, Placement};
use crate::paper::progressive_mesh::run::level_for_error;
use crate::paper::progressive_mesh::{self, LoadedMesh};
use crate::paper::virtual_texture::config::owner;
use crate::paper::virtual_texture::reference::picture::{ReferenceFilter, SourceTexels, sides_of};
use crate::reference::filter::{Edges, MipPyramid, srgb8_to_linear};
use crate::reference::supersample::{RADIUS_PX, SIGMA_PX};
use crate::reference::{ReferenceView, Sample};
use crate::scene::{Scene, Surface};
use crate::texture::plain::PlainTexture;
use crate::texture::source::TileSource;
use glam::{DVec2, DVec3};
use std::collections::HashMap;

/// Largest stated error of a mesh in the reference, in pixels.
const MESH_PIXELS: f64 = 0.25;

/// The reference keeps about 400 bytes for a triangle.
const MAX_TRIANGLES: usize = 1_500_000;

/// A scene seen from one pose.
pub struct SceneTruth<'a> {
    layers: Vec<Layer<'a>>,
    sun: DVec3,
    light: LightColours,
    /// How the samples of a footprint are weighted. Reliefs have rays of equal weight.
    pub filter: ReferenceFilter,
}

/// One surface with all its instances.
struct Layer<'a> {
    view: ReferenceView,
    triangles: Vec<[u32; 3]>,
    paint: Paint<'a>,
    /// The relief below a plane with a plain texture.
    relief: Option<Below>,
    /// The normal of each vertex, if the surface is lit.
    normals: Option<Vec<DVec3>>,
}

enum Paint<'a> {
    Virtual(Box<SourceTexels<'a>>),
    Plain(PlainTruth),
    /// Linear albedo.
    Grey(f64),
}

/// A plain texture with sides that are powers of two.
struct PlainTruth {
    size_log2: [u32; 2],
    /// Linear light, by level.
    levels: Vec<Vec<[f64; 4]>>,
}

impl<'a> SceneTruth<'a> {
    /// Loads the scene's meshes and plain textures; `tiles` are the tiles of the scene's virtual texture.
    ///
    /// # Errors
    /// A file that cannot be read, or content that the reference cannot show.
    pub fn new(
        scene: &Scene,
        tiles: Option<&'a dyn TileSource>,
        pose: &Pose,
        size: [u32; 2],
    ) -> Result<SceneTruth<'a>, String> {
        let owner = owner(scene).map_err(|error| error.to_string())?;
        let models = progressive_mesh::load(scene).map_err(|error| error.to_string())?;
        let layer = |surface: &Surface| {
            let (mesh, normals) = match surface.grid() {
                Some(grid) => {
                    let normals = normals(&grid.positions, &grid.triangles);
                    (grid, normals)
                }
                None => {
                    let model = models.iter().find(|model| model.name == surface.name);
                    instances(model.ok_or("a surface without a mesh")?, pose, size, MESH_PIXELS)?
                }
            };
            let is_virtual = carries_virtual(surface, owner);
            let paint = match (is_virtual, tiles) {
                (true, Some(tiles)) => Paint::Virtual(Box::new(SourceTexels::new(tiles))),
                (true, None) => return Err("the virtual texture is not open".to_owned()),
                (false, _) if surface.texture.is_none() && surface.grid().is_none() => Paint::Grey(ALBEDO),
                (false, _) => Paint::Plain(PlainTruth::of(scene, surface)?),
            };
            let relief = relief(scene, surface).map_err(|error| error.to_string())?;
            Ok(Layer {
                relief: relief.map(|(_, relief, size_m)| Below::new(relief, size_m, pose.eye)),
                view: ReferenceView::new(&mesh, &pose.world_to_clip(size[0], size[1]), pose.eye, size),
                triangles: mesh.triangles,
                paint,
                normals: is_lit(surface, owner).then_some(normals),
            })
        };
        let layers = scene.surfaces.values().map(layer).collect::<Result<Vec<_>, String>>()?;
        let filter = ReferenceFilter::Area;
        Ok(SceneTruth { layers, sun: scene.sun(), light: scene.light_colours(), filter })
    }

    /// True if a surface is visible at a pixel's centre.
    pub fn covers(&self, x: u32, y: u32) -> bool {
        self.layers.iter().any(|layer| layer.view.sample(x, y).is_some())
    }

    /// True if a surface has a relief. Only pixels of reliefs depend on the number of rays.
    pub fn has_reliefs(&self) -> bool {
        self.layers.iter().any(|layer| layer.relief.is_some())
    }

    /// The linear colour of a pixel; `None` where the background is visible. A pixel of a relief is the mean of
    /// `rays x rays` rays.
    pub fn pixel(&self, x: u32, y: u32, rays: u32) -> Option<[f64; 4]> {
        let samples = self.layers.iter().filter_map(|layer| Some((layer, layer.view.sample(x, y)?)));
        let (layer, sample) = samples.min_by(|(_, a), (_, b)| a.w_m.total_cmp(&b.w_m))?;
        let colour = match (&layer.paint, &layer.relief) {
            (Paint::Plain(plain), Some(below)) => {
                return Some(self.mean_of_rays(layer, (plain, below), [x, y], rays));
            }
            (Paint::Virtual(texels), _) => texels.pixel(&sample, self.filter),
            (Paint::Plain(plain), None) => plain.pixel(&sample, self.filter),
            (Paint::Grey(albedo), _) => [*albedo, *albedo, *albedo, 1.0],
        };
        let Some(normals) = &layer.normals else { return Some(colour) };
        let corners = layer.triangles[sample.triangle as usize].map(|vertex| normals[vertex as usize]);
        let normal: DVec3 = (0..3).map(|n| corners[n] * sample.weights[n]).sum();
        Some(self.lit(colour, normal))
    }

    /// The mean over all rays of a pixel that meet a relief. Each ray samples the finest level of the texture.
    fn mean_of_rays(
        &self,
        layer: &Layer<'_>,
        (plain, below): (&PlainTruth, &Below),
        pixel: [u32; 2],
        rays: u32,
    ) -> [f64; 4] {
        let (hits, mut sum) = (below.hits(&layer.view, pixel, rays), [0.0; 4]);
        for hit in &hits {
            let albedo = plain.texture().bilinear(0, hit.at[0], hit.at[1]);
            let colour = if layer.normals.is_some() { self.lit(albedo, hit.normal) } else { albedo };
            (0..4).for_each(|channel| sum[channel] += colour[channel] / hits.len() as f64);
        }
        sum
    }

    /// A colour in the scene's light.
    fn lit(&self, [r, g, b, a]: [f64; 4], normal: DVec3) -> [f64; 4] {
        let cosine = normal.normalize_or(DVec3::Z).dot(self.sun).max(0.0);
        let light = |n: usize| f64::from(self.light.sky[n]) + f64::from(self.light.sun[n]) * cosine;
        [r * light(0), g * light(1), b * light(2), a]
    }

    /// Checks that all texels so far could be read.
    ///
    /// # Errors
    /// The first tile that could not be read.
    pub fn check_read(&self) -> Result<(), String> {
        let mut texels = self.layers.iter().filter_map(|layer| match &layer.paint {
            Paint::Virtual(texels) => Some(&**texels),
            _ => None,
        });
        texels.try_for_each(SourceTexels::check).map_err(|error| error.to_string())
    }
}

impl PlainTruth {
    fn of(scene: &Scene, surface: &Surface) -> Result<PlainTruth, String> {
        let texture = plain_texture(scene, surface.texture.as_deref()).map_err(|error| error.to_string())?;
        let PlainTexture { size, levels } = texture;
        if !size.iter().all(|side| side.is_power_of_two()) {
            return Err(format!(
                "{}: the reference needs a texture with sides of powers of two",
                surface.name
            ));
        }
        let linear: [f64; 256] = std::array::from_fn(|code| srgb8_to_linear(code as u8));
        let texel =
            |rgba: &[u8]| [linear[rgba[0] as usize], linear[rgba[1] as usize], linear[rgba[2] as usize], 1.0];
        let levels = levels.iter().map(|level| level.chunks_exact(4).map(texel).collect()).collect();
        Ok(PlainTruth { size_log2: size.map(u32::ilog2), levels })
    }

    fn texture(&self) -> MipPyramid<impl Fn(u32, u32, u32) -> [f64; 4] + '_> {
        let [width_log2, height_log2] = self.size_log2;
        let texel = move |level: u32, x: u32, y: u32| {
            self.levels[level as usize][(y * (1 << width_log2.saturating_sub(level)) + x) as usize]
        };
        MipPyramid { width_log2, height_log2, edges: Edges::Columns, texel }
    }

    /// The mean over the pixel's footprint.
    fn pixel(&self, sample: &Sample, filter: ReferenceFilter) -> [f64; 4] {
        let (texture, Sample { s, t, .. }) = (self.texture(), *sample);
        let sides = sides_of(sample, texture.level_size(0));
        match filter {
            ReferenceFilter::Gaussian => texture.gaussian(&sides, s, t, SIGMA_PX, RADIUS_PX),
            _ => texture.area(&sides, s, t),
        }
    }
}

/// The visible instances of a model in world space, at a level whose stated error is at most `pixels`; and a normal for
/// each vertex.
pub(super) fn instances(
    model: &LoadedMesh,
    pose: &Pose,
    size: [u32; 2],
    pixels: f64,
) -> Result<(SourceMesh, Vec<DVec3>), String> {
    let vertices = &model.mesh.vertices;
    let positions: Vec<DVec3> = vertices.positions.iter().map(|at| DVec3::from(at.map(f64::from))).collect();
    let full = || live_faces(&model.mesh, model.mesh.last_level());
    let own: Vec<DVec3> = match vertices.attributes.normals.is_empty() {
        true => normals(&positions, &full()),
        false => vertices.attributes.normals.iter().map(|n| DVec3::from(n.map(f64::from))).collect(),
    };
    let coordinates: Vec<DVec2> = match vertices.attributes.coordinates.is_empty() {
        true => vec![DVec2::ZERO; positions.len()],
        false => vertices.attributes.coordinates.iter().map(|at| DVec2::from(at.map(f64::from))).collect(),
    };
    let bounds = Bounds::of(&vertices.positions);
    let (mut levels, mut mesh, mut turned) = (HashMap::new(), SourceMesh::default(), Vec::new());
    for stand in &model.stands {
        let place = Placement::new(&model.surface, &bounds, stand);
        if !place.is_seen(pose, size) {
            continue;
        }
        let wanted = place.wanted_error(pose, size[1], pixels);
        let level = level_for_error(&model.mesh.levels, wanted as f32);
        let faces = levels.entry(level).or_insert_with(|| live_faces(&model.mesh, level));
        let live = model.mesh.levels[level as usize].vertices as usize;
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(positions[..live].iter().map(|at| place.to_world(*at)));
        mesh.coordinates.extend(&coordinates[..live]);
        turned.extend(own[..live].iter().map(|normal| place.rotation * *normal));
        mesh.triangles.extend(faces.iter().map(|face| face.map(|vertex| first + vertex)));
        if mesh.triangles.len() > MAX_TRIANGLES {
            return Err(format!(
                "{}: the reference of this view has more than {MAX_TRIANGLES} triangles",
                model.name
            ));
        }
    }
    Ok((mesh, turned))
}

/// The area-weighted mean of the normals of the faces around each position.
fn normals(positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<DVec3> {
    // Adding 0 turns -0 into 0, so that both have the same bits.
    let key = |at: DVec3| (at + 0.0).to_array().map(f64::to_bits);
    let mut sums: HashMap<[u64; 3], DVec3> = HashMap::new();
    for triangle in triangles {
        let [a, b, c] = triangle.map(|vertex| positions[vertex as usize]);
        let twice_area = (b - a).cross(c - a);
        [a, b, c].into_iter().for_each(|corner| *sums.entry(key(corner)).or_default() += twice_area);
    }
    positions
        .iter()
        .map(|at| sums.get(&key(*at)).copied().unwrap_or_default().normalize_or(DVec3::Z))
        .collect()
}
