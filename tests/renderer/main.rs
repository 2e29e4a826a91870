//! Surfaces of every kind in one frame: which surface hides which, the cost of each, and their lighting.
//! Validation and synchronisation validation are on; any message fails the test.

mod filters;
mod relief;
mod scenes;
mod sphere;

use glam::{DVec2, DVec3};
use ortelius::frame::Technique;
use ortelius::model::mesh::SourceMesh;
use ortelius::paper::progressive_mesh::{self, LoadedMesh};
use ortelius::paper::virtual_texture::config::one_sample_scene;
use ortelius::paper::virtual_texture::reference::stage1::{Stage1Check, compare_surfaces};
use ortelius::paper::virtual_texture::reference::visible_tiles;
use ortelius::picture::PixelFormat;
use ortelius::reference::ReferenceView;
use ortelius::reference::supersample::Truth;
use ortelius::renderer::{Options, Renderer};
use ortelius::scene::{SHIPPED, Scene};
use scenes::{Parts, SIZE};
use std::collections::{BTreeMap, BTreeSet};

fn open(scene: &Scene, target: PixelFormat) -> Renderer {
    let options =
        Options { target, size: Some(SIZE), validate: true, deterministic: true, ..Options::default() };
    Renderer::open(scene, &options).unwrap_or_else(|error| panic!("{error}"))
}

fn settled(scene: &Scene, target: PixelFormat) -> Renderer {
    let mut renderer = open(scene, target);
    renderer.settle(&scene.pose(0).unwrap()).unwrap();
    renderer.drain().unwrap();
    renderer
}

/// The green channel of a scene's picture.
fn greens(scene: &Scene) -> Vec<f64> {
    let mut renderer = settled(scene, PixelFormat::Linear32);
    let picture = renderer.linear_picture().unwrap();
    silent(&renderer);
    picture.rgba.iter().map(|pixel| f64::from(pixel[1])).collect()
}

/// The NMSE of a green channel, over the pixels whose kernel lies wholly on the surface. There must be more than
/// `min` of these.
fn nmse(found: &[f64], truth: &Truth, min: usize) -> f64 {
    let whole = || (0..found.len()).filter(|&n| truth.whole[n]);
    assert!(whole().count() > min, "{} whole pixels", whole().count());
    let square: f64 = whole().map(|n| (found[n] - truth.values[n]).powi(2)).sum();
    square / whole().map(|n| truth.values[n].powi(2)).sum::<f64>()
}

fn silent(renderer: &Renderer) {
    let messages = renderer.gpu.messages();
    assert!(messages.is_empty(), "{messages:#?}");
}

/// All surfaces of a frame except `without`, as one mesh. Also, for each triangle, the largest distance of its texture
/// coordinates from their origin, or `None` if it has no virtual texture.
fn all_triangles(scene: &Scene, renderer: &Renderer, without: &str) -> (SourceMesh, Vec<Option<f64>>) {
    let (mut all, mut offsets) = (SourceMesh::default(), Vec::new());
    let mut add = |triangle: [(DVec3, DVec2); 3], offset: Option<f64>| {
        let first = all.positions.len() as u32;
        all.positions.extend(triangle.map(|(position, _)| position));
        all.coordinates.extend(triangle.map(|(_, coordinate)| coordinate));
        all.triangles.push([first, first + 1, first + 2]);
        offsets.push(offset);
    };
    let models: Vec<LoadedMesh> = progressive_mesh::load(scene).unwrap();
    let meshes = renderer.technique.meshes.iter().flat_map(|meshes| &meshes.surfaces);
    for (model, surface) in models.iter().zip(meshes).filter(|(model, _)| model.name != without) {
        assert_eq!(model.name, surface.name);
        let textured = scene.texture_kind(&scene.surfaces[&model.name]) == Some("virtual");
        let vertices = &model.mesh.vertices;
        for (n, (place, _)) in surface.instances().enumerate() {
            for face in surface.faces(n).unwrap() {
                let corner = |vertex: u32| {
                    let position = DVec3::from(vertices.positions[vertex as usize].map(f64::from));
                    let coordinate = vertices.attributes.coordinates.get(vertex as usize);
                    let coordinate = coordinate.map_or(DVec2::ZERO, |st| DVec2::from(st.map(f64::from)));
                    (place.to_world(position), coordinate)
                };
                // A progressive mesh's coordinates have their origin at 0.
                add(face.map(corner), textured.then_some(1.0));
            }
        }
    }
    let others = scene.surfaces.values().filter(|surface| surface.name != without);
    for (surface, grid) in others.filter_map(|surface| Some((surface, surface.grid()?))) {
        for triangle in &grid.triangles {
            let corner = |vertex: u32| (grid.positions[vertex as usize], grid.coordinates[vertex as usize]);
            let is_virtual = scene.texture_kind(surface) == Some("virtual");
            add(triangle.map(corner), is_virtual.then_some(1.0));
        }
    }
    (all, offsets)
}

/// The frame's request image against the f64 reference of all surfaces except `without`.
fn against_reference(scene: &Scene, renderer: &Renderer, without: &str) -> Stage1Check {
    let pose = scene.pose(0).unwrap();
    let texture = renderer.technique.texture.as_ref().unwrap();
    let requests = texture.requests(&renderer.gpu, renderer.target()).unwrap();
    let (mesh, offsets) = all_triangles(scene, renderer, without);
    let view = ReferenceView::new(&mesh, &pose.world_to_clip(SIZE[0], SIZE[1]), pose.eye, SIZE);
    compare_surfaces(&requests, &view, &texture.source.pyramid(), 1, |triangle| offsets[triangle as usize])
}

#[test]
fn a_texel_behind_another_surface_asks_for_no_tile() {
    let parts = Parts::new();
    for variant in ["", "[variant]\ndedup = \"fused-exact\"\naddress = \"own-level\"\ncompact = \"append\"\n"]
    {
        let scene = parts.scene(&["land", "hill", "bunny", "board"], variant);
        let renderer = settled(&scene, PixelFormat::Srgb8);
        let check = against_reference(&scene, &renderer, "");
        println!("{} of {} pixels differ", check.differing, check.pixels);
        assert!(
            check.unexplained.is_empty(),
            "{variant} {} {:#?}",
            check.unexplained.len(),
            check.unexplained
        );
        // References that lack one of the surfaces in front must not match.
        for hides in ["bunny", "board", "hill"] {
            let blind = against_reference(&scene, &renderer, hides);
            assert!(blind.unexplained.len() > 50, "{hides}: {}", blind.unexplained.len());
        }
        // The visible-tile list equals exactly the list that follows from the pixels' requests.
        let texture = renderer.technique.texture.as_ref().unwrap();
        let requests = texture.requests(&renderer.gpu, renderer.target()).unwrap();
        let record = renderer.records.last().unwrap().texture.as_ref().unwrap();
        let listed: BTreeSet<_> = record.visible.iter().copied().collect();
        assert_eq!(listed, visible_tiles(&requests, &texture.source.pyramid()), "{variant}");
        let verdicts = texture.ruler_verdicts(&renderer.gpu, renderer.target()).unwrap();
        assert_eq!((verdicts.wrong, verdicts.not_resident), (0, 0), "{variant}");
        assert!(verdicts.covered > 5000, "{verdicts:?}");
        silent(&renderer);
    }
}

/// The shipped scene of both papers: a terrain of 204,800 faces and 500 meshes on it.
#[test]
fn the_valleys_visible_set_is_that_of_the_reference() {
    let scene = one_sample_scene("valley").unwrap();
    let renderer = settled(&scene, PixelFormat::Srgb8);
    let check = against_reference(&scene, &renderer, "");
    println!("{} of {} pixels differ", check.differing, check.pixels);
    assert!(check.unexplained.is_empty(), "{} {:#?}", check.unexplained.len(), check.unexplained);
    let blind = against_reference(&scene, &renderer, "herd");
    assert!(blind.unexplained.len() > 500, "{}", blind.unexplained.len());
    let texture = renderer.technique.texture.as_ref().unwrap();
    let requests = texture.requests(&renderer.gpu, renderer.target()).unwrap();
    let record = renderer.records.last().unwrap().texture.as_ref().unwrap();
    let listed: BTreeSet<_> = record.visible.iter().copied().collect();
    assert_eq!(listed, visible_tiles(&requests, &texture.source.pyramid()));
    silent(&renderer);
}

#[test]
fn triples_of_the_texturing_draw_give_the_same_frame_beside_other_surfaces_and_in_the_sun() {
    let parts = Parts::new();
    let names = ["land", "hill", "bunny", "board"];
    let frame = |names: &[&str], variant: &str| {
        let more = format!("[variant]\ndedup = \"runs\"\ncompact = \"append\"\n{variant}");
        let text = parts.text(names, &more).replace("[surface.hill]\n", "[surface.hill]\nlit = true\n");
        let mut renderer = settled(&parts.scene_of(&text).unwrap(), PixelFormat::Srgb8);
        let texture = renderer.technique.texture.as_ref().unwrap();
        let requests = texture.requests(&renderer.gpu, renderer.target()).unwrap();
        let visible = renderer.records.last().unwrap().texture.as_ref().unwrap().visible.clone();
        let picture = renderer.picture_bytes().unwrap();
        silent(&renderer);
        (requests, visible, picture)
    };
    let (requests, visible, picture) = frame(&names, "");
    let stores = frame(&names, "request_draw = \"texturing\"\n");
    let differing = picture.iter().zip(&stores.2).filter(|(a, b)| a != b).count();
    assert_eq!((differing, &visible, &requests), (0, &stores.1, &stores.0));
    let alone = frame(&["land", "hill"], "request_draw = \"texturing\"\n");
    assert!(alone.0 != requests, "the other surfaces hide nothing, so the test proves nothing");
}

/// Names of passes and features, and bytes by name.
type Costs = (BTreeSet<&'static str>, BTreeSet<String>, BTreeMap<String, u64>);

fn costs(renderer: &Renderer) -> Costs {
    let passes = renderer.technique.passes().into_iter().collect();
    let needs = renderer.technique.needs();
    let features = needs.iter().map(|need| format!("{:?} {}", need.feature, need.pass));
    (passes, features.collect(), renderer.memory().into_iter().collect())
}

#[test]
fn deleting_a_surface_deletes_exactly_its_passes_features_and_bytes() {
    let parts = Parts::new();
    let all = ["land", "hill", "bunny", "board"];
    let (passes, features, bytes) = costs(&open(&parts.scene(&all, ""), PixelFormat::Srgb8));
    // The passes and features that belong to a surface. Those that other surfaces also need stay.
    let texture = ["upload", "footprint", "dedup", "compact", "read-back", "texturing"];
    let cases: [(&[&str], &[&str], bool); 4] = [
        (&["bunny"], &["surfaces"], false),
        (&["board"], &["plain"], false),
        (&["hill"], &[], false),
        (&["land", "hill"], &texture, true),
    ];
    for (deleted, gone, all_features) in cases {
        let left: Vec<&str> = all.into_iter().filter(|name| !deleted.contains(name)).collect();
        let (passes_left, features_left, bytes_left) =
            costs(&open(&parts.scene(&left, ""), PixelFormat::Srgb8));
        let expected: BTreeSet<_> = passes.iter().filter(|pass| !gone.contains(pass)).copied().collect();
        assert_eq!(passes_left, expected, "without {deleted:?}");
        assert_eq!(features_left, if all_features { BTreeSet::new() } else { features.clone() });
        let is_deleted = |name: &str| deleted.iter().any(|gone| name.starts_with(&format!("{gone}: ")));
        let expected: BTreeMap<_, _> = bytes
            .iter()
            .filter(|(name, _)| !is_deleted(name))
            .map(|(name, bytes)| (name.clone(), *bytes))
            .collect();
        assert_eq!(bytes_left, expected, "without {deleted:?}");
        assert!(bytes_left.len() < bytes.len(), "{deleted:?} had bytes");
    }
    assert!(!features.is_empty());
}

#[test]
fn the_order_of_surfaces_changes_no_pixel() {
    let parts = Parts::new();
    let names = ["land", "hill", "bunny", "board"];
    let picture = |scene: &Scene| settled(scene, PixelFormat::Srgb8).picture_bytes().unwrap();
    let shown = picture(&parts.scene(&names, ""));
    assert!(shown == picture(&parts.renamed(&names, &["z", "y", "x", "a"])));
    assert!(shown != picture(&parts.scene(&["land", "hill", "board"], "")), "the bunny must be visible");
    assert!(shown != picture(&parts.scene(&["land", "bunny", "board"], "")), "the hill must be visible");
    assert!(shown != picture(&parts.scene(&["land", "hill", "bunny"], "")), "the board must be visible");
}

#[test]
fn the_sun_lights_what_the_scene_says() {
    let parts = Parts::new();
    let floats = |scene: &Scene| settled(scene, PixelFormat::Linear32).linear_picture().unwrap().rgba;
    let fused = "[variant]\ndedup = \"fused\"\naddress = \"own-level\"\ncompact = \"append\"\n";
    // A weight map has shaders of its own.
    let [one, map] = ["{max_anisotropy=1}", "{kind='ellipse', weight_map='radial'}"];
    for (variant, filter) in [("", one), (fused, one), ("", map), (fused, map)] {
        let filtered =
            |scene: Scene| floats(&scene.with(&[format!("surface.land.filter={filter}")]).unwrap());
        let unlit = filtered(parts.scene(&["land"], variant));
        let sun = "[sun]\nazimuth_deg = 10.0\nelevation_deg = 30.0\n";
        let lit = filtered(parts.lit("land", &format!("{sun}{variant}")));
        // A level plane has the same light everywhere: 0.25 from the sky and 0.75 sin 30 from the sun.
        let of_pixels = unlit.iter().zip(&lit).filter(|(unlit, _)| unlit[0] > 1e-3);
        let worst =
            of_pixels.clone().map(|(unlit, lit)| (lit[0] / unlit[0] - 0.625).abs()).fold(0.0, f32::max);
        assert!(of_pixels.count() > 5000 && worst < 1e-5, "{variant}: {worst}");
    }
}

#[test]
fn twenty_resizes_of_all_surfaces_show_what_new_renderers_show() {
    let parts = Parts::new();
    let scene = parts.scene(&["land", "hill", "bunny", "board"], "");
    let pose = scene.pose(0).unwrap();
    let mut renderer = settled(&scene, PixelFormat::Srgb8);
    let compiled = renderer.gpu.compiled_pipelines();
    for n in 0..20 {
        let size = [[160, 90], [31, 77], [200, 40], [1, 1], [64, 64]][n % 5];
        renderer.resize(size).unwrap();
        renderer.settle(&pose).unwrap();
        let options = Options { size: Some(size), validate: true, deterministic: true, ..Options::default() };
        let mut new = Renderer::open(&scene, &options).unwrap();
        new.settle(&pose).unwrap();
        assert!(renderer.picture_bytes().unwrap() == new.picture_bytes().unwrap(), "{size:?}");
        silent(&new);
    }
    assert_eq!(renderer.gpu.compiled_pipelines(), compiled, "no pipeline depends on the size");
    silent(&renderer);
}

#[test]
fn streaming_and_culling_follow_the_frozen_eye_and_not_the_camera() {
    let scene = one_sample_scene("valley").unwrap();
    let mut renderer = settled(&scene, PixelFormat::Srgb8);
    let pose = scene.pose(0).unwrap();
    let elsewhere = pose.moved(pose.up * 3000.0 - pose.forward * 20_000.0);
    let found = |renderer: &mut Renderer| {
        (0..8).for_each(|_| renderer.frame(&elsewhere).unwrap());
        renderer.drain().unwrap();
        let wanted = renderer.technique.texture.as_ref().unwrap().streaming.wanted().to_vec();
        let record = renderer.records.last().unwrap();
        let textured = record.texture.as_ref().unwrap();
        let age = textured.index - textured.list_of.unwrap();
        (wanted, record.meshes.as_ref().unwrap().change.faces, age)
    };
    let wanted = renderer.technique.texture.as_ref().unwrap().streaming.wanted().to_vec();
    let faces = renderer.records.last().unwrap().meshes.as_ref().unwrap().change.faces;
    renderer.technique.frozen = Some(pose);
    // The first of the 8 frames has frozen the list of two frames before.
    assert_eq!(found(&mut renderer), (wanted.clone(), faces, 9));
    renderer.technique.frozen = None;
    let (now, fewer, age) = found(&mut renderer);
    assert_eq!(age, 2);
    assert!(now != wanted && fewer != faces, "the unfrozen camera has other levels");
    silent(&renderer);
}

#[test]
fn what_cannot_be_shown_is_refused_with_its_line() {
    let parts = Parts::new();
    let refused = |names: &[&str], more: &str, from: &str, to: &str| {
        let text = parts.text(names, more);
        assert!(text.contains(from), "{from:?} is not in the scene");
        let scene = parts.scene_of(&text.replace(from, to));
        let options = Options { size: Some(SIZE), ..Options::default() };
        scene
            .map(|scene| Renderer::open(&scene, &options).map(drop))
            .map_or_else(|error| error.to_string(), |opened| opened.err().unwrap().to_string())
    };
    let shared = refused(
        &["land", "hill"],
        "",
        "texture = \"land\"",
        "texture = \"land\"\nfilter = { kind = \"bilinear\" }",
    );
    assert!(shared.contains("parts.toml:") && shared.contains("one filter"), "{shared}");
    // The paper's 16 samples are the default, and are not reduced to suit the texture.
    let line = "filter = { max_anisotropy = 1 }\n[surface.land.texture]";
    let border = refused(&["land"], "", line, "[surface.land.texture]\nborder = 0");
    assert!(border.contains("surface.land.filter.max_anisotropy") && border.contains("up to 16"), "{border}");
    let bunny = refused(
        &["land", "bunny"],
        "",
        "[surface.bunny.geometry]",
        "[surface.bunny]\ntexture = \"land\"\n[surface.bunny.geometry]",
    );
    assert!(bunny.contains("parts.toml:") && bunny.contains("no texture coordinates"), "{bunny}");
    let wide = refused(&["board"], "", "board.obj", "wide.obj");
    assert!(wide.contains("parts.toml:") && wide.contains("outside 0 ..= 1"), "{wide}");
    let unlit = refused(
        &["bunny"],
        "",
        "[surface.bunny.geometry]",
        "[surface.bunny]\nlit = false\n[surface.bunny.geometry]",
    );
    assert!(unlit.contains("always lit"), "{unlit}");
    let filter = refused(
        &["board"],
        "",
        "[surface.board.texture]",
        "[surface.board.filter]\nkind = \"bilinear\"\n[surface.board.texture]",
    );
    assert!(filter.contains("sampler"), "{filter}");
}

/// The default picture of each scene shows its surfaces: they cover at least 10 % of the pixels. A pixel is covered if
/// it does not have the background colour. No surface has this colour.
#[test]
fn the_default_picture_of_a_shipped_scene_shows_its_surfaces() {
    for (name, _) in SHIPPED {
        let scene = Scene::embedded(name).unwrap().with(&["view.background=[1.0, 0.0, 1.0]".into()]).unwrap();
        let camera = scene.view.path.is_none();
        assert!(camera, "{name}: `-o x.png` would show the last pose of a path");
        let covered = |scene: &Scene| {
            let pose = scene.camera(&scene.view.camera).unwrap().pose();
            let options = Options { size: Some([160, 90]), deterministic: true, ..Options::default() };
            let mut renderer = Renderer::open(scene, &options).unwrap();
            renderer.settle(&pose).unwrap();
            let picture = renderer.picture().unwrap();
            let pixels = picture.rgba.as_chunks::<4>().0;
            pixels.iter().filter(|pixel| **pixel != [255, 0, 255, 255]).count() * 100 / pixels.len()
        };
        let percent = covered(&scene);
        println!("{name}: {percent} % covered");
        assert!(percent >= 10, "{name}: {percent} %");
    }
}
