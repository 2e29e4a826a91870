//! The exact fused draw culls clusters in its depth pass. For all meshes and cameras, its list and the depth of its
//! shaded pixels must equal those of stage 1, which draws everything.

use crate::lists::assert_lists;
use crate::{device, scene};
use glam::DVec3;
use ortelius::frame::{DrawList, FrameSlot, Shape, View, world_view};
use ortelius::math::camera::Pose;
use ortelius::math::pyramid::Pyramid;
use ortelius::math::splitmix::SplitMix64;
use ortelius::model::mesh::{Cluster, Mesh, SourceMesh, earth, gpu_mesh, plane};
use ortelius::paper::virtual_texture::config::source_mesh;
use ortelius::paper::virtual_texture::footprint::FootprintPass;
use ortelius::paper::virtual_texture::fused::Fused;
use ortelius::paper::virtual_texture::list_passes::Stage3;
use ortelius::paper::virtual_texture::prepass::Culling;
use ortelius::paper::virtual_texture::read_requests;
use ortelius::paper::virtual_texture::tile_pool::TilePool;
use ortelius::paper::virtual_texture::{Compaction, Config, Dedup, ONE_SAMPLE, RequestFormat, TileAddress};
use ortelius::texture::source::ruler::Ruler;
use ortelius::vk::{Format, Gpu, Image, ImageInfo};
use std::time::Instant;

const SIZE: [u32; 2] = [250, 141];

struct Random(SplitMix64);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.unit()
    }

    fn direction(&mut self) -> DVec3 {
        let (z, turn) = (self.between(-1.0, 1.0), self.between(0.0, std::f64::consts::TAU));
        DVec3::new(turn.cos(), turn.sin(), 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z
    }

    /// An eye at `eye` that looks near `target`, with a field of view from very narrow to fish-eye.
    fn pose(&mut self, eye: DVec3, target: DVec3, altitude: f64) -> Pose {
        let forward = (target - eye).normalize();
        let right = forward.cross(self.direction()).normalize();
        let angle_deg = 10f64.powf(self.between(-1.0, 2.17));
        Pose {
            eye,
            right,
            up: right.cross(forward),
            forward,
            vertical_fov_rad: angle_deg.to_radians(),
            near_m: altitude / 64.0,
            height_m: altitude,
        }
    }

    /// A camera that is just above a ball of radius `scale` metres, far away, or between. It looks at the ball, over it
    /// or past it.
    fn about_a_ball(&mut self, scale: f64) -> Pose {
        let (up, altitude) = (self.direction(), scale * 10f64.powf(self.between(-3.0, 1.0)));
        let eye = up * (scale + altitude);
        let target = self.direction() * scale * self.between(0.0, 1.3);
        self.pose(eye, target, altitude)
    }
}

/// Everything needed to draw one mesh.
struct Drawn<'a> {
    gpu: &'a Gpu,
    config: Config,
    pyramid: Pyramid,
    resident: TilePool,
    target: Image,
    shape: Shape,
    clusters: Vec<Cluster>,
    stage1: FootprintPass,
    fused: Fused,
    stage3: Stage3,
    depth: Image,
}

impl Drawn<'_> {
    fn new<'a>(gpu: &'a Gpu, source: &SourceMesh) -> Drawn<'a> {
        let config = Config {
            dedup: Dedup::FusedExact,
            compact: Compaction::FusedAppend,
            address: TileAddress::OwnLevel,
            request_format: Some(RequestFormat::Packed),
            ..ONE_SAMPLE
        };
        let pyramid = Pyramid::new(18, 17, 9, 4, None).unwrap();
        let resident = TilePool::new(gpu, &Ruler::new(pyramid), 1).unwrap();
        let target = gpu.image("picture", ImageInfo::target(SIZE, Format::Rgba8Srgb)).unwrap();
        let mesh = gpu_mesh(source);
        Drawn {
            shape: Shape::with_depth_alone(gpu, &mesh).unwrap(),
            clusters: mesh.clusters(),
            stage1: FootprintPass::new(gpu, &pyramid, &config, SIZE).unwrap(),
            fused: Fused::new(gpu, &pyramid, &config, &resident, (Format::Rgba8Srgb, None)).unwrap(),
            stage3: Stage3::new(gpu, &pyramid, &config).unwrap(),
            depth: gpu.image("depth", ImageInfo::target(SIZE, Format::Depth32Float)).unwrap(),
            gpu,
            config,
            pyramid,
            resident,
            target,
        }
    }

    /// Compares one camera's depth and list with stage 1's. Returns the share of indices that were culled.
    fn check(&mut self, pose: &Pose, what: &str) -> f64 {
        let gpu = self.gpu;
        let Drawn { fused, resident, shape, target, depth, stage3, .. } = &*self;
        let seen = DrawList::new([shape], View::new(pose, SIZE), 0);
        let mut frame = gpu.frame().unwrap();
        frame.pass("footprint", |cmd| self.stage1.draw(cmd, &seen)).unwrap();
        let list = stage3.list(FrameSlot::FIRST);
        frame.pass("fused", |cmd| fused.draw(cmd, resident, &seen, list, (target, depth))).unwrap();
        stage3.record(&mut frame, FrameSlot::FIRST, fused.mask(FrameSlot::FIRST)).unwrap();
        frame.submit().unwrap().wait().unwrap();
        let triples =
            self.stage3.collect(gpu, FrameSlot::FIRST, self.fused.mask(FrameSlot::FIRST)).unwrap().0;
        let what = format!("{what}: {pose:?}");
        let [whole, culled] = [&*self.stage1.depth, &self.depth].map(|d| gpu.read_image(d).unwrap());
        let differing = whole.chunks(4).zip(culled.chunks(4)).filter(|(a, b)| a != b).count();
        assert_eq!(differing, 0, "{what}: pixels with another depth");
        let requests = read_requests(gpu, &self.stage1, &self.pyramid).unwrap();
        assert_lists(&requests, &self.pyramid, &triples, self.config.address, &what);
        let runs = Culling::new(&world_view(pose, SIZE, 0), SIZE).runs(&self.clusters);
        let drawn: u32 = runs.iter().map(|run| run.end - run.start).sum();
        let all: u32 = self.clusters.iter().map(|cluster| cluster.count).sum();
        1.0 - f64::from(drawn) / f64::from(all)
    }

    /// Checks all cameras. Returns the mean culled share.
    fn check_all(&mut self, poses: impl IntoIterator<Item = Pose>, what: &str) -> f64 {
        let shares: Vec<f64> = poses.into_iter().map(|pose| self.check(&pose, what)).collect();
        let mean = shares.iter().sum::<f64>() / shares.len() as f64;
        println!("{what}: {} cameras, mean culled share {mean:.3}", shares.len());
        mean
    }
}

/// A ball of radius 1 with waves and needles, which move each vertex along its radius by up to `height`.
fn bumpy_ball(random: &mut Random, [columns, rows]: [u32; 2], height: f64) -> SourceMesh {
    let mut mesh = earth(columns, rows);
    let waves: Vec<(DVec3, f64)> =
        (0..4).map(|_| (random.direction() * random.between(2.0, 40.0), random.0.unit())).collect();
    let lift = |place: DVec3| {
        let wave = |(k, phase): &(DVec3, f64)| (k.dot(place) + phase).sin();
        // A few needles, equal on both sides of the seam.
        let needle = if (place * 1e3).round().length_squared() % 11.0 < 1.0 { 1.0 } else { 0.0 };
        waves.iter().map(wave).sum::<f64>() / 8.0 + 0.5 * needle
    };
    for place in &mut mesh.positions {
        *place = place.normalize();
        *place *= 1.0 + height * lift(*place);
    }
    mesh
}

/// The corners of a cluster's triangles, in the GPU's precision.
fn corners(mesh: &Mesh, cluster: &Cluster) -> Vec<[DVec3; 3]> {
    let place = |&index: &u32| {
        let vertex = mesh.vertices[index as usize];
        let [high, low] = [vertex.position_high, vertex.position_low];
        DVec3::from_array(high.map(f64::from)) + DVec3::from_array(low.map(f64::from))
    };
    let indices = &mesh.indices[cluster.first_index as usize..][..cluster.count as usize];
    indices.chunks_exact(3).map(|t| [place(&t[0]), place(&t[1]), place(&t[2])]).collect()
}

#[test]
fn clusters_contain_each_triangle_once_and_their_bounds_contain_every_position_and_normal() {
    for [columns, rows] in [[3, 2], [40, 23], [388, 194]] {
        let mesh = gpu_mesh(&earth(columns, rows));
        let (mut next, mut largest) = (0, 0f64);
        for cluster in mesh.clusters() {
            assert_eq!(cluster.first_index, next);
            assert!(cluster.count > 0 && cluster.count.is_multiple_of(3));
            next += cluster.count;
            for [a, b, c] in corners(&mesh, &cluster) {
                let normal = (b - a).cross(c - a);
                let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
                assert!([a, b, c].iter().all(|p| p.distance(cluster.centre) <= cluster.radius_m));
                assert!(normal.normalize().dot(cluster.axis).min(1.0).acos() <= cluster.spread_rad);
                assert!(normal.length() / longest >= cluster.min_height_m * (1.0 - 1e-12));
            }
            largest = largest.max(cluster.radius_m);
        }
        assert_eq!(next as usize, mesh.indices.len());
        // A cluster has at most 8 x 2 quads of 0.93 degrees, so none runs around the earth.
        assert!(columns < 388 || largest < 1.2e6, "{largest}");
    }
}

#[test]
fn a_cluster_with_nan_or_without_area_has_infinite_or_empty_bounds() {
    let mut mesh = gpu_mesh(&plane(30.0, 40.0, 1, 1));
    let [cluster] = mesh.clusters()[..] else { panic!("two triangles are one cluster") };
    assert!((cluster.min_height_m - 24.0).abs() < 1e-12, "sides of 30, 40 and 50 m: {cluster:?}");
    assert!((cluster.radius_m - 25.0).abs() < 1e-12);
    assert!((cluster.axis - DVec3::Z).length() < 1e-15 && cluster.spread_rad < 1e-6);
    let whole = mesh.clone();
    mesh.vertices[2].position_high[1] = f32::NAN;
    let [cluster] = mesh.clusters()[..] else { panic!("two triangles are one cluster") };
    assert_eq!((cluster.radius_m, cluster.min_height_m), (f64::INFINITY, 0.0));
    mesh = whole;
    mesh.indices[1] = mesh.indices[0];
    let [cluster] = mesh.clusters()[..] else { panic!("two triangles are one cluster") };
    assert_eq!(cluster.min_height_m, 0.0);
    assert!(cluster.spread_rad > 1.5, "an undefined normal is in no cone: {}", cluster.spread_rad);
}

#[test]
fn culling_in_the_depth_pass_changes_neither_depth_nor_list() {
    let gpu = device();
    let mut random = Random(SplitMix64(3));
    for (name, height) in [("ball", 0.0), ("hills", 0.02), ("ridges", 0.3)] {
        for grid in [[97, 48], [24, 12]] {
            let mut drawn = Drawn::new(&gpu, &bumpy_ball(&mut random, grid, height));
            let poses: Vec<Pose> = (0..60).map(|_| random.about_a_ball(1.0)).collect();
            let left_out = drawn.check_all(poses, &format!("{name} of {grid:?}"));
            let min = if grid[0] > 50 { 0.2 } else { 0.0 };
            assert!(left_out > min, "{left_out}: nothing is culled, so the test proves nothing");
        }
    }
}

#[test]
fn open_surfaces_above_each_other_and_seen_from_below_keep_their_depth() {
    let gpu = device();
    let mut random = Random(SplitMix64(4));
    let mut sheets = plane(2.0, 2.0, 40, 40);
    let first = sheets.positions.len() as u32;
    sheets.positions.extend_from_within(..);
    sheets.coordinates.extend_from_within(..);
    sheets.triangles.extend_from_within(..);
    let half = sheets.triangles.len() / 2;
    for corner in sheets.triangles[half..].as_flattened_mut() {
        *corner += first;
    }
    for (n, place) in sheets.positions.iter_mut().enumerate() {
        let above = if n as u32 >= first { 0.2 } else { 0.0 };
        place.z = above + 0.15 * (5.0 * place.x).sin() * (7.0 * place.y).cos();
    }
    let mut drawn = Drawn::new(&gpu, &sheets);
    let poses: Vec<Pose> = (0..80).map(|_| random.about_a_ball(0.6)).collect();
    assert!(drawn.check_all(poses, "sheets") > 0.2);
}

#[test]
fn most_of_the_shipped_earth_is_culled() {
    let gpu = device();
    let mut random = Random(SplitMix64(5));
    let earth = scene("earth");
    let mut drawn = Drawn::new(&gpu, &source_mesh(&earth).unwrap());
    let globe = scene("globe");
    for (name, camera) in earth.cameras.iter().chain(&globe.cameras) {
        let left_out = drawn.check(&camera.pose(), name);
        println!("{name}: {left_out:.3}");
        // From far away a triangle is hardly higher than the distance by which snapping moves vertices.
        assert!(left_out > 0.5 || globe.cameras.contains_key(name), "{name}: {left_out}");
    }
    drawn.check_all((0..20).map(|_| random.about_a_ball(6.4e6)), "cameras about the earth");
    let view = world_view(&earth.cameras["oblique"].pose(), [1920, 1080], 0);
    let begun = Instant::now();
    let runs = (0..100).map(|_| Culling::new(&view, [1920, 1080]).runs(&drawn.clusters).len()).sum::<usize>();
    println!("{} draws, {:?} on the host", runs / 100, begun.elapsed() / 100);
}
