//! Generated models of any size up to about 2^24 faces. The bits are the same on every machine: the only
//! transcendental functions are those of `libm`.
//!
//! All are closed except [`grid`]. [`knot`] has texture seams, [`fn@solid`] the sharp edges of a machined part; the
//! others have no attributes.

mod solid;

pub use solid::solid;

use super::{Attributes, Model, Raw, clean};
use glam::DVec3;
use std::f64::consts::TAU;

/// Welds a generated mesh, which must need no other cleaning.
pub(super) fn welded(raw: &Raw) -> Model {
    let (model, report) = clean(raw);
    assert_eq!(report.changes(), [""; 0], "a generated mesh needs no cleaning");
    model
}

/// Triangles of a grid of `columns` x `rows` quads, two for each quad, row by row. `corner` returns a corner's vertex
/// from its column and row. Counter-clockwise if rows go up while columns go right.
pub(super) fn quads(columns: u32, rows: u32, corner: impl Fn(u32, u32) -> u32) -> Vec<[u32; 3]> {
    let mut faces = Vec::with_capacity(columns as usize * rows as usize * 2);
    for row in 0..rows {
        for column in 0..columns {
            let [a, b] = [corner(column, row), corner(column + 1, row)];
            let [c, d] = [corner(column, row + 1), corner(column + 1, row + 1)];
            faces.extend([[a, b, d], [a, d, c]]);
        }
    }
    faces
}

/// A fractal height field over the unit square around the origin, heights along z, open: `side` x `side` positions and
/// `2 (side - 1)^2` faces.
///
/// # Panics
/// Unless `side` is in 2 ..= 2^11.
pub fn grid(side: u32, seed: u32) -> Model {
    assert!((2..=1 << 11).contains(&side), "a grid of {side} x {side}");
    heights([side, side], |column, row| {
        let [x, y] = [column, row].map(|index| f64::from(index) / f64::from(side - 1));
        DVec3::new(x - 0.5, y - 0.5, fractal(x, y, seed))
    })
}

/// A height field from a function: `size` positions in columns and rows.
pub(super) fn heights(size: [u32; 2], position: impl Fn(u32, u32) -> DVec3) -> Model {
    let [columns, rows] = size;
    let positions =
        (0..rows).flat_map(|row| (0..columns).map(move |column| [column, row])).map(|[c, r]| position(c, r));
    let faces = quads(columns - 1, rows - 1, |column, row| row * columns + column);
    welded(&Raw { positions: positions.collect(), faces, ..Raw::default() })
}

/// Six octaves of noise, each at twice the frequency and half the height. The first has 4 x 4 cells and heights of
/// +-0.1.
fn fractal(x: f64, y: f64, seed: u32) -> f64 {
    let octave = |octave: u32| {
        let cells = f64::from(4u32 << octave);
        value_noise(x * cells, y * cells, seed.wrapping_mul(0x9E37_79B1).wrapping_add(octave)) / cells
    };
    0.4 * (0..6).map(octave).sum::<f64>()
}

/// Smooth noise in -1 ..= 1: hashed values at integers, blended by 3t^2 - 2t^3.
fn value_noise(x: f64, y: f64, seed: u32) -> f64 {
    let at = |x: f64, y: f64| f64::from(hash(x as u32, y as u32, seed)) / f64::from(u32::MAX) * 2.0 - 1.0;
    let smooth = |t: f64| t * t * (3.0 - 2.0 * t);
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let (left, bottom) = (x.floor(), y.floor());
    let (s, t) = (smooth(x - left), smooth(y - bottom));
    let row = |y: f64| mix(at(left, y), at(left + 1.0, y), s);
    mix(row(bottom), row(bottom + 1.0), t)
}

fn hash(x: u32, y: u32, seed: u32) -> u32 {
    let mut bits = x.wrapping_mul(0x85EB_CA6B) ^ y.wrapping_mul(0xC2B2_AE3D) ^ seed.wrapping_mul(0x27D4_EB2F);
    for multiplier in [0x7feb_352d, 0x846c_a68b] {
        bits ^= bits >> 16;
        bits = bits.wrapping_mul(multiplier);
        bits ^= bits >> 15;
    }
    bits
}

/// A geodesic sphere of radius 1: each edge of an icosahedron is divided into `frequency` parts, 20 frequency^2
/// faces.
///
/// # Panics
/// Unless `frequency` is in 1 ..= 2^9.
pub fn sphere(frequency: u32) -> Model {
    assert!((1..=1 << 9).contains(&frequency), "a sphere of frequency {frequency}");
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    // (0, +-1, +-golden) and its rotations: four corners for each axis.
    let signs = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
    let corner = |axis: usize, [one, two]: [f64; 2]| {
        let mut corner = [0.0; 3];
        corner[(axis + 1) % 3] = one;
        corner[(axis + 2) % 3] = two * golden;
        DVec3::from_array(corner)
    };
    let corners: Vec<DVec3> = (0..3).flat_map(|axis| signs.map(|signs| corner(axis, signs))).collect();
    // Edges have length 2; the next larger distance is 2 golden.
    let near = |a: usize, b: usize| (corners[a] - corners[b]).length() < 2.1;
    let mut raw = Raw::default();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in (b + 1..12).filter(|&c| near(a, b) && near(b, c) && near(c, a)) {
                let [a, b, c] = [a, b, c].map(|index| corners[index]);
                let outward = (b - a).cross(c - a).dot(a) > 0.0;
                patch(&mut raw, if outward { [a, b, c] } else { [a, c, b] }, frequency);
            }
        }
    }
    welded(&raw)
}

/// Divides one face of the icosahedron into frequency^2 triangles. Adjacent patches give a point of their common edge
/// the same bits, because its position is a sum of two terms and a 0.
fn patch(raw: &mut Raw, [a, b, c]: [DVec3; 3], frequency: u32) {
    let first = raw.positions.len() as u32;
    for row in 0..=frequency {
        for column in 0..=frequency - row {
            let weights = [frequency - row - column, column, row].map(f64::from);
            raw.positions.push((a * weights[0] + b * weights[1] + c * weights[2]).normalize());
        }
    }
    // Each row is one shorter than the row before.
    let point =
        |column: u32, row: u32| first + row * (frequency + 1) - row * row.saturating_sub(1) / 2 + column;
    for row in 0..frequency {
        for column in 0..frequency - row {
            let [here, right, above] = [point(column, row), point(column + 1, row), point(column, row + 1)];
            raw.faces.push([here, right, above]);
            if column + 1 < frequency - row {
                raw.faces.push([right, point(column + 1, row + 1), above]);
            }
        }
    }
}

/// A torus about the z axis, radii 1 and 0.4: `2 rows` quads around the axis and `rows` quads around the tube, 4 rows^2
/// faces.
///
/// # Panics
/// Unless `rows` is in 3 ..= 2^11.
pub fn torus(rows: u32) -> Model {
    assert!((3..=1 << 11).contains(&rows), "a torus of {rows} rows");
    let columns = 2 * rows;
    let mut raw = Raw::default();
    for row in 0..rows {
        let (height, out) = libm::sincos(TAU * f64::from(row) / f64::from(rows));
        let radius = 1.0 + 0.4 * out;
        for column in 0..columns {
            let (sine, cosine) = libm::sincos(TAU * f64::from(column) / f64::from(columns));
            raw.positions.push(DVec3::new(radius * cosine, radius * sine, 0.4 * height));
        }
    }
    raw.faces = quads(columns, rows, |column, row| row % rows * columns + column % columns);
    welded(&raw)
}

/// A tube along the (2, 3) torus knot: `12 rows` quads along it and `rows` quads around it, 24 rows^2 faces. It has
/// normals, and texture coordinates from 0 to 1 along it (s) and around it (t), with a seam in each direction.
///
/// # Panics
/// Unless `rows` is in 3 ..= 2^9.
pub fn knot(rows: u32) -> Model {
    assert!((3..=1 << 9).contains(&rows), "a knot of {rows} rows");
    let columns = 12 * rows;
    let mut raw = Raw::default();
    let Attributes { normals, coordinates, .. } = &mut raw.attributes;
    for column in 0..=columns {
        let ([middle, out, aside], s) = (knot_frame(column % columns, columns), turn(column, columns));
        for row in 0..=rows {
            // The modulo gives both sides of a seam the same bits.
            let (sine, cosine) = libm::sincos(TAU * turn(row % rows, rows));
            let normal = out * cosine + aside * sine;
            raw.positions.push(middle + normal * 0.35);
            normals.push(normal.as_vec3().to_array());
            coordinates.push([s as f32, turn(row, rows) as f32]);
        }
    }
    raw.faces = quads(rows, columns, |row, column| column * (rows + 1) + row);
    welded(&raw)
}

fn turn(index: u32, count: u32) -> f64 {
    f64::from(index) / f64::from(count)
}

/// A point of the knot, which lies on a torus of radii 2 and 0.8; the torus's normal there; and the cross product of
/// the knot's tangent and that normal.
fn knot_frame(column: u32, columns: u32) -> [DVec3; 3] {
    let angle = TAU * turn(column, columns);
    let ((sine_2, cosine_2), (sine_3, cosine_3)) = (libm::sincos(2.0 * angle), libm::sincos(3.0 * angle));
    let radius = 2.0 + 0.8 * cosine_3;
    let middle = DVec3::new(radius * cosine_2, radius * sine_2, 0.8 * sine_3);
    let out = DVec3::new(cosine_3 * cosine_2, cosine_3 * sine_2, sine_3);
    let along = DVec3::new(
        -2.4 * sine_3 * cosine_2 - 2.0 * radius * sine_2,
        -2.4 * sine_3 * sine_2 + 2.0 * radius * cosine_2,
        2.4 * cosine_3,
    );
    [middle, out, along.normalize().cross(out)]
}
