//! The footprint of the pixel under the pointer, against the derivatives of the f64 rasteriser.

use crate::display::{Display, key};
use crate::program::{COARSE, Seen};
use crate::{FAST, open};
use glam::DMat2;
use ortelius::reference::raster::{Derivatives, ReferenceView};
use ortelius::scene::Scene;

/// High enough for the inspector, which begins just above the pointer if the pointer is just below the middle.
const SIZE: [u32; 2] = [720, 590];
/// Over the Alps, where footprints are long and turned.
const CAMERA: &str = "oblique";

/// Size of level 0 of the texture, in texels.
const TEXELS: [f64; 2] = [262_144.0, 131_072.0];

/// The Jacobian in texels of `level` per pixel.
fn jacobian(found: Derivatives, level: i32) -> DMat2 {
    let [width, height] = TEXELS.map(|side| side * f64::from(-level).exp2());
    let Derivatives { dsdx, dtdx, dsdy, dtdy } = found;
    DMat2::from_cols_array(&[dsdx * width, dtdx * height, dsdy * width, dtdy * height])
}

/// The longer and the shorter stretch of a Jacobian, from its invariants: their squares add up to the sum of the
/// squares of its elements, and their product is its determinant.
fn stretches(jacobian: DMat2) -> [f64; 2] {
    let squares: f64 = jacobian.to_cols_array().iter().map(|element| element * element).sum();
    let product = jacobian.determinant().abs();
    let (sum, difference) = ((squares + 2.0 * product).sqrt(), (squares - 2.0 * product).max(0.0).sqrt());
    [(sum + difference) / 2.0, (sum - difference) / 2.0]
}

/// The width and the height of the ellipse in the inspector, in pixels between the middles of its line. The line has
/// the magnifier's colour, so only rows below the magnifier count.
fn drawn(seen: &Seen) -> [f64; 2] {
    let orange = |x: u32, y: u32| {
        let at = 4 * (y * seen.0.width + x) as usize;
        seen.0.rgba[at..at + 3].iter().zip([255, 184, 26]).all(|(found, of)| found.abs_diff(of) < 10)
    };
    let row = |y: u32| (0..seen.0.width).filter(move |&x| orange(x, y));
    let lens = (0..seen.0.height).rev().find(|&y| row(y).count() > 150).expect("the magnifier's lower edge");
    let found: Vec<[u32; 2]> = (lens + 1..seen.0.height).flat_map(|y| row(y).map(move |x| [x, y])).collect();
    // The line is 2 pixels wide.
    [0, 1].map(|axis| {
        let along = || found.iter().map(|at| at[axis]);
        f64::from(along().max().expect("an ellipse") - along().min().expect("an ellipse") + 1) - 2.0
    })
}

#[test]
fn the_footprint_under_the_pointer_is_that_of_the_f64_reference() {
    let scene = Scene::embedded("earth").unwrap().with(&[COARSE.to_owned()]).unwrap();
    let pose = scene.cameras[CAMERA].pose();
    let mesh = scene.surfaces["land"].grid().unwrap();
    let view = ReferenceView::new(&mesh, &pose.world_to_clip(SIZE[0], SIZE[1]), pose.eye, SIZE);
    let display = Display::start();
    let arguments = ["earth", "--size", "720x590", "--no-panels", "--camera", CAMERA, "-D", FAST];
    let mut window = open(&display, &arguments);
    window.settled_picture();
    for (n, at) in [[150, 300], [520, 330]].into_iter().enumerate() {
        window.point(at.map(|at| at as i16));
        if n == 0 {
            window.press(key::Z);
        }
        let start = format!("pixel {}, {};", at[0], at[1]);
        let line = window.press_until_printed(key::N, |line| line.starts_with(&start));
        let number = |name: &str, end: &str| -> f64 {
            let text = line.split(name).nth(1).and_then(|rest| rest.split(end).next());
            text.unwrap().trim().parse().unwrap_or_else(|_| panic!("{name}: {line}"))
        };
        let level = number("tile wanted level ", ",") as i32;
        let printed = [number("footprint ", " x "), number(" x ", " texels")];
        let sample = view.sample(at[0], at[1]).unwrap();
        let reference = jacobian(sample.fine, level);
        // Two decimals are printed. Differences of f32 coordinates within a triangle have a relative error of 1e-3.
        let agrees = |of: [f64; 2]| {
            printed.iter().zip(of).all(|(found, of): (&f64, f64)| (found - of).abs() < 0.005 + 2e-3 * of)
        };
        let expected = stretches(reference);
        assert!(agrees(expected), "{line}: not {expected:?}");
        let beside = view.sample(at[0], at[1] + 8).unwrap();
        assert!(!agrees(stretches(jacobian(beside.fine, level))), "{line}: 8 pixels below is as good");
        // The drawing's 96 pixels show one and a half times the longer axis, but at least 4 and at most 32 texels.
        let to_pixels = 96.0 / (1.5 * expected[0]).clamp(4.0, 32.0);
        let [x, y] = [reference.row(0), reference.row(1)].map(|row| row.length() * to_pixels);
        let [width, height] = drawn(&window.settled_picture());
        let near = (width - x).abs() < 2.0 && (height - y).abs() < 2.0;
        assert!(near, "{line}: {width} x {height} pixels are drawn, not {x:.1} x {y:.1}");
    }
    window.quit();
}
