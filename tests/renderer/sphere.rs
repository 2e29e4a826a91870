//! The chequered ball and the chequered tunnel against the ellipsoid and the cylinder in closed form.

use crate::scenes::SIZE;
use crate::{greens, nmse};
use glam::{DVec3, DVec4};
use ortelius::reference::cylinder::CylinderWall;
use ortelius::reference::ellipsoid;
use ortelius::reference::pattern::Pattern;
use ortelius::reference::supersample::{Density, PixelKernel, Tiled, Truth, supersample};
use ortelius::scene::{Cylinder, Geometry, Scene};

/// The least number of pixels whose kernel lies wholly on the surface.
const WHOLE: usize = 2000;

/// The truth of the default picture without a sun. `coordinate` gives (s, t) of an eye and a ray.
fn truth(scene: &Scene, coordinate: impl Fn([f64; 3], [f64; 3]) -> Option<[f64; 2]> + Sync) -> Truth {
    let pose = scene.pose(0).unwrap();
    let to_world = pose.world_to_clip(SIZE[0], SIZE[1]).inverse();
    let ray = |x: f64, y: f64| -> DVec3 {
        let [x, y] = [2.0 * x / f64::from(SIZE[0]) - 1.0, 2.0 * y / f64::from(SIZE[1]) - 1.0];
        let near = to_world * DVec4::new(x, y, 1.0, 1.0);
        near.truncate() / near.w
    };
    let surface = |x: f64, y: f64| {
        let [s, t] = coordinate(pose.eye.to_array(), ray(x, y).to_array())?;
        Some([2048.0 * s, 1024.0 * t])
    };
    // The same number of squares along both sides.
    let texture = Tiled::new(1024, &Pattern::Checker(32).texels(1024));
    let kernel = PixelKernel::Gaussian { sigma: 0.5, radius: 1.0 };
    supersample(SIZE, surface, |at| texture.at(at), kernel, Density { per_texel: 0.0, min: 24, max: 24 })
}

#[test]
fn the_ball_is_near_its_truth_and_a_turned_one_is_not() {
    let scene = Scene::embedded("sphere").unwrap();
    let of = |changes: &[&str]| {
        let changes: Vec<String> =
            changes.iter().chain(&["surface.ball.lit=false"]).map(|change| (*change).to_string()).collect();
        scene.with(&changes).unwrap()
    };
    let still = of(&[]);
    let truth = truth(&still, ellipsoid::coordinate);
    let own = nmse(&greens(&still), &truth, WHOLE);
    let turned = nmse(&greens(&of(&["cameras.whole.longitude_deg=21.0"])), &truth, WHOLE);
    println!("{own:.2e}, turned by a degree {turned:.2e}, the truth's own {:.2e}", truth.own_nmse());
    assert!(own < 1e-2 && turned > 5.0 * own, "{own:.2e}, turned {turned:.2e}");
}

#[test]
fn the_tunnel_is_near_its_truth_and_a_shifted_one_is_not() {
    let scene = Scene::embedded("tunnel").unwrap();
    let Geometry::Cylinder(Cylinder { radius_m, length_m, .. }) = scene.surfaces["pipe"].geometry else {
        panic!("no cylinder")
    };
    let cylinder = CylinderWall { radius_m, length_m };
    let truth = truth(&scene, |eye, ray| cylinder.coordinate(eye, ray));
    let own = nmse(&greens(&scene), &truth, WHOLE);
    // The shift of 0.3 m is a tenth of a square.
    let other = scene.with(&["cameras.inside.north_m=3.3".into()]).unwrap();
    let shifted = nmse(&greens(&other), &truth, WHOLE);
    println!("{own:.2e}, shifted by 0.3 m {shifted:.2e}, the truth's own {:.2e}", truth.own_nmse());
    assert!(own < 1e-3 && shifted > 5.0 * own, "{own:.2e}, shifted {shifted:.2e}");
}
