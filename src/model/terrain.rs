//! Two models of Mount Everest. `everest` has the real heights up to 59 km around it, from a 30" grid
//! (scenes/everest.NOTICE). `valley` covers most of this area with synthetic detail, for appearance.

use super::{Model, Raw, generate};
use crate::math::relief::{AREA_M, EAST_M, NORTH_M, SIDE, relief};
use glam::DVec3;

/// The grid as an open mesh of 32 768 faces. Positions are metres east of the summit, north of it, and above the sea.
pub(super) fn everest() -> Model {
    let heights = &relief().samples;
    let middle = f64::from(SIDE / 2);
    generate::heights([SIDE, SIDE], |column, row| {
        // Model rows go north, picture rows south.
        let sample = (SIDE - 1 - row) * SIDE + column;
        let [east, north] = [column, row].map(|index| f64::from(index) - middle);
        DVec3::new(east * EAST_M, north * NORTH_M, heights[sample as usize])
    })
}

/// Fraction of [`AREA_M`] that the model `valley` covers. Less than 1, because a filter at the texture's edge reads
/// texels of the opposite side.
const SHOWN: f64 = 31.0 / 32.0;
/// Spacing of the middle rows relative to the mean: most faces are around the summit.
const MIDDLE: f64 = 0.42;

/// The surface of [`crate::math::relief`] with `side` x `side` positions: 2 (side - 1)^2 faces, open, without seams,
/// with normals. Texture coordinates run from 1/64 to 63/64, s from west to east and t from north to south. In metres,
/// like [`everest`]; rows and columns are densest at the summit.
///
/// # Panics
/// Unless `side` is in 3 ..= 2^10 + 1.
pub(super) fn valley(side: u32) -> Model {
    assert!((3..=(1 << 10) + 1).contains(&side), "a valley of {side}");
    let at = |index: u32| {
        let u = 2.0 * f64::from(index) / f64::from(side - 1) - 1.0;
        0.5 * AREA_M * SHOWN * (MIDDLE * u + (1.0 - MIDDLE) * u * u * u)
    };
    let spacing = |index: u32| {
        let index = index.min(side - 2);
        at(index + 1) - at(index)
    };
    let places: Vec<[u32; 2]> =
        (0..side).flat_map(|row| (0..side).map(move |column| [column, row])).collect();
    let mut raw = Raw::default();
    for [column, row] in places {
        let [east, north] = [column, row].map(at);
        let finest = spacing(column).max(spacing(row));
        raw.positions.push(DVec3::new(east, north, relief().height_m(east, north, finest)));
        let [s, t] = [0.5 + east / AREA_M, 0.5 - north / AREA_M];
        raw.attributes.coordinates.push([s as f32, t as f32]);
    }
    raw.faces = generate::quads(side - 1, side - 1, |column, row| row * side + column);
    raw.attributes.normals = normals(&raw.positions, &raw.faces);
    generate::welded(&raw)
}

/// Normal of each position, weighted by the areas of its faces.
fn normals(positions: &[DVec3], faces: &[[u32; 3]]) -> Vec<[f32; 3]> {
    let mut sums = vec![DVec3::ZERO; positions.len()];
    for face in faces {
        let [a, b, c] = face.map(|position| positions[position as usize]);
        let area = (b - a).cross(c - a);
        face.iter().for_each(|&position| sums[position as usize] += area);
    }
    sums.into_iter().map(|sum| sum.normalize().as_vec3().to_array()).collect()
}
