//! A machined part: flat faces, cylinders and fillets that meet in sharp edges, where a position has one wedge for
//! each normal.

use super::welded;
use crate::model::{Model, Raw};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

/// Top of the plate; its bottom is z = 0. Lengths are multiples of 1/8, so that adjacent strips of the surface share
/// their border positions bit for bit.
const TOP: f64 = 0.75;
/// Radius of the fillets, and width of the chamfers.
const FILLET: f64 = 0.125;
/// Rows of quads of a fillet, a flat ring or a wall.
const ROWS: u32 = 4;

/// A plate of 3 x 2 cells of side 2: rounded and counterbored holes, and bosses with a fillet at the foot and a
/// chamfer. Each side of a cell has `detail` quads, so each hole and boss has 4 `detail` quads around it. The number of
/// faces is proportional to `detail`; at 16 it is 16 384.
///
/// # Panics
/// Unless `detail` is a power of two in 4 ..= 2^12. With another number, points on the border between two cells would
/// differ by rounding.
pub fn solid(detail: u32) -> Model {
    assert!(detail.is_power_of_two() && (4..=1 << 12).contains(&detail), "a solid of detail {detail}");
    let mut raw = Raw::default();
    for (index, profile) in
        [hole(0.625), boss(0.5, 1.0), counterbore(), counterbore(), hole(0.5), boss(0.75, 0.5)]
            .iter()
            .enumerate()
    {
        let centre = DVec3::new(2.0 * (index % 3) as f64, 2.0 * (index / 3) as f64, 0.0);
        for strip in profile {
            revolve(&mut raw, strip, centre, detail);
        }
    }
    walls(&mut raw, detail);
    welded(&raw)
}

/// A ring around a cell's axis.
#[derive(Clone, Copy)]
struct Ring {
    /// 1: the cell's square; 0: the circle; values between interpolate.
    square: f64,
    radius: f64,
    z: f64,
    /// The normal: component away from the axis, and component up.
    normal: [f64; 2],
}

/// A strip of the surface: consecutive rings that join smoothly. The edge between two strips is sharp unless their
/// normals agree.
type Strip = Vec<Ring>;

fn steps(ring: impl Fn(f64) -> Ring) -> Strip {
    (0..=ROWS).map(|step| ring(f64::from(step) / f64::from(ROWS))).collect()
}

/// From the cell's square inwards to a circle.
fn inward(radius: f64, z: f64) -> Strip {
    steps(|at| Ring { square: 1.0 - at, radius, z, normal: [0.0, 1.0] })
}

/// From a circle outwards to the cell's square, seen from below.
fn outward(radius: f64) -> Strip {
    steps(|at| Ring { square: at, radius, z: 0.0, normal: [0.0, -1.0] })
}

/// Straight from one (radius, z) to another. With the radius to the right and z up, the outward normal points to the
/// right of the direction.
fn straight(from: [f64; 2], to: [f64; 2]) -> Strip {
    let way = [to[0] - from[0], to[1] - from[1]];
    let length = way[0].hypot(way[1]);
    let normal = [way[1] / length, -way[0] / length];
    steps(|at| {
        // The end must be exact, because the next strip starts there.
        let [radius, z] = std::array::from_fn(|i| if at == 1.0 { to[i] } else { from[i] + at * way[i] });
        Ring { square: 0.0, radius, z, normal }
    })
}

/// A quarter circle; `point` returns (radius, z) and the normal from the sine and cosine of an angle of 0 to 90
/// degrees.
fn quarter(point: impl Fn(f64, f64) -> ([f64; 2], [f64; 2])) -> Strip {
    steps(|at| {
        let (sine, cosine) = if at == 1.0 { (1.0, 0.0) } else { libm::sincos(at * FRAC_PI_2) };
        let ([radius, z], normal) = point(sine, cosine);
        Ring { square: 0.0, radius, z, normal }
    })
}

/// A hole with a rounded upper edge.
fn hole(radius: f64) -> Vec<Strip> {
    let mouth = radius + FILLET;
    let rounding =
        quarter(|sine, cosine| ([mouth - FILLET * sine, TOP - FILLET + FILLET * cosine], [-sine, cosine]));
    vec![inward(mouth, TOP), rounding, straight([radius, TOP - FILLET], [radius, 0.0]), outward(radius)]
}

/// A counterbored hole.
fn counterbore() -> Vec<Strip> {
    let step = TOP / 2.0;
    vec![
        inward(0.75, TOP),
        straight([0.75, TOP], [0.75, step]),
        straight([0.75, step], [0.375, step]),
        straight([0.375, step], [0.375, 0.0]),
        outward(0.375),
    ]
}

/// A cylinder on top of the plate.
fn boss(radius: f64, height: f64) -> Vec<Strip> {
    let (foot, end) = (radius + FILLET, TOP + height);
    let fillet =
        quarter(|sine, cosine| ([foot - FILLET * sine, TOP + FILLET - FILLET * cosine], [sine, cosine]));
    let chamfer = [radius - FILLET, end];
    vec![
        inward(foot, TOP),
        fillet,
        straight([radius, TOP + FILLET], [radius, end - FILLET]),
        straight([radius, end - FILLET], chamfer),
        straight(chamfer, [0.0, end]),
        outward(0.0),
    ]
}

/// Adds the quads between consecutive rings of a strip, around the axis at `centre`.
fn revolve(raw: &mut Raw, strip: &Strip, centre: DVec3, detail: u32) {
    let around = 4 * detail;
    let first = raw.positions.len() as u32;
    for ring in strip {
        for step in 0..around {
            let (sine, cosine) = libm::sincos(TAU * f64::from(step) / f64::from(around) - FRAC_PI_4);
            let round = DVec3::new(cosine, sine, 0.0);
            let flat = square(step, detail) * ring.square + round * (ring.radius * (1.0 - ring.square));
            raw.positions.push(centre + flat + DVec3::Z * ring.z);
            let normal = round * ring.normal[0] + DVec3::Z * ring.normal[1];
            raw.attributes.normals.push(normal.as_vec3().to_array());
        }
    }
    let corner = |step: u32, ring: u32| first + ring * around + step % around;
    for ring in 0..strip.len() as u32 - 1 {
        let is_point = |ring: u32| strip[ring as usize].square == 0.0 && strip[ring as usize].radius == 0.0;
        for step in 0..around {
            let [a, b] = [corner(step, ring), corner(step + 1, ring)];
            let [c, d] = [corner(step, ring + 1), corner(step + 1, ring + 1)];
            if !is_point(ring) {
                raw.faces.push([a, b, d]);
            }
            if !is_point(ring + 1) {
                raw.faces.push([a, d, c]);
            }
        }
    }
}

/// Point `step` of a cell's border, counter-clockwise from its lower right corner; coordinates are multiples of 2 /
/// detail.
fn square(step: u32, detail: u32) -> DVec3 {
    let along = 2.0 * f64::from(step % detail) / f64::from(detail) - 1.0;
    match step / detail {
        0 => DVec3::new(1.0, along, 0.0),
        1 => DVec3::new(-along, 1.0, 0.0),
        2 => DVec3::new(-1.0, -along, 0.0),
        _ => DVec3::new(along, -1.0, 0.0),
    }
}

/// The outer walls of the plate: -1 ..= 5 by -1 ..= 3.
fn walls(raw: &mut Raw, detail: u32) {
    let sides: [([f64; 2], [f64; 2], u32); 4] = [
        ([-1.0, -1.0], [1.0, 0.0], 3),
        ([5.0, -1.0], [0.0, 1.0], 2),
        ([5.0, 3.0], [-1.0, 0.0], 3),
        ([-1.0, 3.0], [0.0, -1.0], 2),
    ];
    for ([x, y], [along_x, along_y], cells) in sides {
        let first = raw.positions.len() as u32;
        let columns = cells * detail;
        for row in 0..=ROWS {
            for column in 0..=columns {
                let way = 2.0 * f64::from(column) / f64::from(detail);
                let z = TOP * f64::from(row) / f64::from(ROWS);
                raw.positions.push(DVec3::new(x + along_x * way, y + along_y * way, z));
                raw.attributes.normals.push([along_y as f32, -along_x as f32, 0.0]);
            }
        }
        raw.faces.extend(super::quads(columns, ROWS, |column, row| first + row * (columns + 1) + column));
    }
}
