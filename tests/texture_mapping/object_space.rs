//! Object-space texturing on the device against its f64 reference.

use super::{SIZE, device};
use ortelius::paper::texture_mapping::agreement::compare_fragments;
use ortelius::paper::texture_mapping::object_space::pass::{ObjectSpaceBuffers, Stages};
use ortelius::paper::texture_mapping::object_space::{
    MAX_PER_PIXEL, TexturedPolygons, TexturedTriangle, reference,
};
use ortelius::paper::texture_mapping::pass::{Targets, Uploaded};
use ortelius::paper::texture_mapping::plane::Tilt;
use ortelius::paper::texture_mapping::texels::GreyMipmap;
use ortelius::reference::pattern::Pattern;
use ortelius::vk::Watched;

fn plane(tilt: &Tilt, spacing: f32) -> TexturedPolygons {
    TexturedPolygons::of_plane(
        &tilt.plane(SIZE[1]),
        SIZE,
        tilt.focal_px(SIZE[1]),
        spacing.into(),
        MAX_PER_PIXEL,
    )
}

fn shown(
    gpu: &Watched,
    polygons: &TexturedPolygons,
    spacing: f32,
    texels: &GreyMipmap,
) -> (Vec<[f32; 4]>, Vec<[u32; 4]>) {
    let texture = Uploaded::new(gpu, "texture", texels).unwrap();
    let targets = Targets::new(gpu, SIZE, false).unwrap();
    let prepared = ObjectSpaceBuffers::new(gpu, polygons, spacing, SIZE, texels.coarsest()).unwrap();
    Stages::new(gpu, true).unwrap().run(gpu, &prepared, &texture, &targets).unwrap();
    prepared.counts(gpu).unwrap();
    (targets.colours(gpu).unwrap(), prepared.sums(gpu).unwrap())
}

/// A rotated cube of `side` pixels around a point, with the whole texture on each face.
fn cube(side: f32, centre: [f32; 3]) -> Vec<TexturedTriangle> {
    let turned = |[x, y, z]: [f32; 3]| {
        let (x, z) = (0.8 * x + 0.6 * z, -0.6 * x + 0.8 * z);
        let (y, z) = (0.6 * y + 0.8 * z, -0.8 * y + 0.6 * z);
        [x, y, z]
    };
    let faces = (0..3).flat_map(|axis| [-1.0, 1.0].map(|sign| (axis, sign)));
    let of_face = |(axis, sign): (usize, f32)| {
        let corner = |a: f32, b: f32| {
            let mut at = [0.0; 3];
            (at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3]) = (sign, a, b);
            let at = turned(at);
            ([0, 1, 2].map(|c| centre[c] + at[c] * side / 2.0), [16.0 * (a + 1.0), 16.0 * (b + 1.0)])
        };
        let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        [[a, b, c], [a, c, d]].map(|three| TexturedTriangle {
            corners: three.map(|(corner, _)| corner),
            texels: three.map(|(_, texels)| texels),
        })
    };
    faces.flat_map(of_face).collect()
}

/// Two cubes; one hides a part of the other.
fn cubes() -> TexturedPolygons {
    let far = cube(26.0, [6.0, 3.0, -60.0]);
    TexturedPolygons { triangles: [far, cube(12.0, [-4.0, -2.0, -20.0])].concat(), camera_px: 80.0 }
}

#[test]
fn a_picture_is_the_f64_reference_up_to_rounding() {
    let gpu = device();
    let texels = GreyMipmap::new(64, Pattern::WhiteNoise.texels(64));
    let turned = Tilt { roll_degrees: 20.0, yaw_degrees: 35.0, ..Tilt::of(70.0) };
    let scenes = [
        ("facing", 1.0, plane(&Tilt::of(0.0), 1.0)),
        ("60 degrees", 1.0, plane(&Tilt::of(60.0), 1.0)),
        ("70 degrees, turned", 0.5, plane(&turned, 0.5)),
        ("overdrawn", 0.5, plane(&Tilt { half_view_degrees: 1.5, ..Tilt::of(87.0) }, 0.5)),
        ("cubes", 0.5, cubes()),
    ];
    for (name, spacing, polygons) in scenes {
        let (found, sums) = shown(&gpu, &polygons, spacing, &texels);
        let means = reference::picture(&polygons, spacing.into(), SIZE, &texels);
        let (agreement, undecided) = compare_fragments(&found, &means);
        println!("{name}: {agreement:?}, {undecided} undecided");
        assert!(agreement.unexplained.is_empty(), "{name}: {:?}", agreement.unexplained);
        assert!(undecided * 5 < found.len(), "{name}: {undecided} undecided");
        // Every pixel that the reference covers is covered on the GPU.
        let uncovered = |n: usize| sums[n][0] == 0 && means[n].fragments > 0 && !means[n].undecided;
        assert_eq!((0..sums.len()).filter(|&n| uncovered(n)).count(), 0, "{name}");
    }
}

#[test]
fn another_spacing_or_a_moved_polygon_is_not_explained_by_rounding() {
    let gpu = device();
    let texels = GreyMipmap::new(64, Pattern::WhiteNoise.texels(64));
    let polygons = plane(&Tilt::of(60.0), 1.0);
    let (found, _) = shown(&gpu, &polygons, 1.0, &texels);
    let other = Tilt { yaw_degrees: 1.0, ..Tilt::of(60.0) };
    for (spacing, polygons) in [(0.9, polygons.clone()), (1.0, plane(&other, 1.0))] {
        let means = reference::picture(&polygons, spacing, SIZE, &texels);
        let (agreement, _) = compare_fragments(&found, &means);
        assert!(agreement.unexplained.len() > 200, "{spacing}: {}", agreement.unexplained.len());
    }
}

#[test]
fn the_order_of_the_polygons_changes_no_bit() {
    let gpu = device();
    let texels = GreyMipmap::new(64, Pattern::PinkNoise.texels(64));
    let forwards = cubes();
    let backwards = TexturedPolygons {
        triangles: forwards.triangles.iter().rev().copied().collect(),
        ..forwards.clone()
    };
    let [(_, a), (_, b), (_, c)] =
        [&forwards, &backwards, &forwards].map(|polygons| shown(&gpu, polygons, 0.5, &texels));
    assert!(a == b && a == c);
    assert!(a.iter().filter(|sums| sums[0] > 0).count() > 200);
}

#[test]
fn a_plane_has_no_hole_and_a_constant_texture_comes_out_exactly() {
    let gpu = device();
    let texels = GreyMipmap::new(64, Pattern::Constant(119).texels(64));
    for (tilt, spacing) in [(0.0, 1.0), (60.0, 1.0), (80.0, 1.0), (85.0, 0.5)] {
        let (found, sums) = shown(
            &gpu,
            &plane(&Tilt { half_view_degrees: 3.0, ..Tilt::of(tilt) }, spacing),
            spacing,
            &texels,
        );
        assert!(sums.iter().all(|own| own[0] > 0 && own[1] == 119 * own[0]), "{tilt}");
        // A division by 255 has an error of up to 2.5 ulp.
        let off = found.iter().map(|pixel| (pixel[0] - 119.0 / 255.0).abs()).fold(0.0, f32::max);
        assert!(off <= 2f32.powi(-23), "{tilt}: {off}");
    }
}

/// Shows that the test for holes can fail: a spacing above one pixel leaves holes.
#[test]
fn a_spacing_of_two_pixels_leaves_holes() {
    let gpu = device();
    let texels = GreyMipmap::new(64, Pattern::Constant(119).texels(64));
    let (_, sums) = shown(&gpu, &plane(&Tilt { roll_degrees: 20.0, ..Tilt::of(30.0) }, 2.5), 2.5, &texels);
    assert!(sums.iter().any(|own| own[0] == 0));
}

#[test]
fn nothing_is_drawn_of_a_polygon_without_area_or_behind_the_eye() {
    let gpu = device();
    let texels = GreyMipmap::new(64, Pattern::Constant(119).texels(64));
    let flat =
        TexturedTriangle { corners: [[0.0; 3], [9.0, 9.0, 0.0], [4.5, 4.5, 0.0]], texels: [[0.0; 2]; 3] };
    let behind = TexturedTriangle {
        corners: [[0.0, 0.0, 90.0], [9.0, 0.0, 90.0], [0.0, 9.0, 0.0]],
        texels: [[0.0; 2]; 3],
    };
    let polygons = TexturedPolygons { triangles: vec![flat, behind], camera_px: 80.0 };
    let (found, sums) = shown(&gpu, &polygons, 1.0, &texels);
    assert!(sums.iter().all(|own| *own == [0; 4]) && found.iter().all(|pixel| *pixel == [0.0; 4]));
    let (_, sums) = shown(&gpu, &TexturedPolygons { triangles: Vec::new(), camera_px: 80.0 }, 1.0, &texels);
    assert!(sums.iter().all(|own| *own == [0; 4]));
}
