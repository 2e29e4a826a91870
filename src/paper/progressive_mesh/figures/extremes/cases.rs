//! Hostile meshes, each with its intended shape.

use super::super::surfaces::Size;
use crate::model::{Attributes, Raw, named};
use anyhow::Context;
use glam::DVec3;
use std::collections::HashMap;

/// A mesh as in a file, and the shape that it is meant to represent.
pub struct Hostile {
    /// The mesh in the file. Its positions are representable in f32, as in most files.
    pub raw: Raw,
    /// The intended shape: the same surface before damage and rounding.
    pub meant: Raw,
    pub target_faces: usize,
}

impl Hostile {
    /// The unit of measurement: the box of the intended shape, which outliers do not enlarge.
    pub fn size(&self) -> Size {
        Size::around(&self.meant.positions)
    }
}

/// All cases, in the report's order.
pub const CASES: [&str; 22] = [
    "clean",
    "offset 1e4",
    "offset 1e7",
    "offset 1e9",
    "scale 1e-38",
    "scale 1e-20",
    "scale 1e-9",
    "scale 1e15",
    "scale 1e30",
    "one NaN",
    "one infinity",
    "one at 1e30",
    "one 1000 times out",
    "degenerate faces",
    "flat caps",
    "soup",
    "every face twice",
    "fins",
    "backs",
    "tetrahedra",
    "bow-ties",
    "seams",
];

/// The mesh of a case.
pub fn mesh(case: &str) -> anyhow::Result<Hostile> {
    let model = named("bunny").context("the bunny is shipped")?;
    let bunny = Raw { positions: model.positions, faces: model.faces, ..Raw::default() };
    let (mut meant, mut raw) = (bunny.clone(), bunny.clone());
    let middle = raw.positions.len() / 2;
    let mut part = 0.25;
    match case {
        "clean" => {}
        "one NaN" => raw.positions[middle].y = f64::NAN,
        "one infinity" => raw.positions[middle].y = f64::INFINITY,
        "one at 1e30" => raw.positions[middle].y = 1e30,
        "one 1000 times out" => raw.positions[middle] *= 1000.0,
        "degenerate faces" => raw.faces.extend((0..500).map(|n| [n, n, n + 1])),
        "flat caps" => (0..500).for_each(|face| cap(&mut raw, 7 * face)),
        "soup" => raw = soup(&raw),
        "every face twice" => raw.faces.extend_from_within(..),
        "fins" => {
            (0..200).for_each(|face| fin(&mut meant, 17 * face));
            raw = meant.clone();
        }
        "backs" => {
            let backs: Vec<[u32; 3]> = raw.faces.iter().step_by(10).map(|&[a, b, c]| [a, c, b]).collect();
            raw.faces.extend(backs);
        }
        "tetrahedra" => (meant, raw) = (tetrahedra(1000), tetrahedra(1000)),
        "bow-ties" => (meant, raw) = (bow_ties(20), bow_ties(20)),
        "seams" => (raw, part) = (charts(&raw), 0.01),
        other => {
            let number = |word| other.strip_prefix(word).and_then(|number| number.parse::<f64>().ok());
            match (number("offset "), number("scale ")) {
                (Some(offset), _) => meant.positions.iter_mut().for_each(|p| *p += offset),
                (_, Some(scale)) => meant.positions.iter_mut().for_each(|p| *p *= scale),
                _ => anyhow::bail!("there is no case {other:?}"),
            }
            raw = meant.clone();
        }
    }
    raw.positions.iter_mut().for_each(|p| *p = p.as_vec3().as_dvec3());
    let target_faces = (raw.faces.len() as f64 * part) as usize;
    Ok(Hostile { raw, meant, target_faces })
}

/// Adds a degenerate face along the first side of a face: its third corner is the middle of that side.
fn cap(raw: &mut Raw, face: usize) {
    let [a, b, _] = raw.faces[face];
    let middle = (raw.positions[a as usize] + raw.positions[b as usize]) / 2.0;
    raw.positions.push(middle);
    raw.faces.push([a, b, raw.positions.len() as u32 - 1]);
}

/// Adds a third face at one side.
fn fin(raw: &mut Raw, face: usize) {
    let [a, b, c] = raw.faces[face].map(|vertex| raw.positions[vertex as usize]);
    raw.positions.push((a + b) / 2.0 + (b - a).cross(c - a).normalize_or_zero() * (b - a).length());
    raw.faces.push([raw.faces[face][0], raw.faces[face][1], raw.positions.len() as u32 - 1]);
}

/// Each face gets its own vertices.
fn soup(raw: &Raw) -> Raw {
    let positions = raw.faces.iter().flatten().map(|&vertex| raw.positions[vertex as usize]).collect();
    let faces = (0..raw.faces.len() as u32).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
    Raw { positions, faces, ..Raw::default() }
}

/// Tetrahedra of different sizes in rows; none touches another.
fn tetrahedra(count: u32) -> Raw {
    let mut raw = Raw::default();
    for n in 0..count {
        let corner = DVec3::new(f64::from(n % 32), f64::from(n / 32), 0.0);
        let size = 0.1 + 0.7 * f64::from(n * 7919 % count) / f64::from(count);
        let first = raw.positions.len() as u32;
        raw.positions.extend([DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|axis| corner + axis * size));
        raw.faces
            .extend([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].map(|face| face.map(|v: u32| v + first)));
    }
    raw
}

/// Unit cubes in a diagonal row; each shares one vertex with the next.
fn bow_ties(cubes: u32) -> Raw {
    let mut raw = Raw { positions: vec![DVec3::ZERO], ..Raw::default() };
    // The bits of k are the coordinates of corner k; corner 7 is corner 0 of the next cube.
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    for n in 0..cubes {
        let corner =
            |k: u32| DVec3::splat(f64::from(n)) + DVec3::from([1, 2, 4].map(|bit| f64::from(k / bit % 2)));
        raw.positions.extend((1..8).map(corner));
        for side in sides {
            let [a, b, c, d] = side.map(|k| 7 * n + k);
            raw.faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    raw
}

/// Splits a surface into charts of a texture. Faces are grouped by the dominant axis of their normals, so
/// that seams cover the whole surface. A position has one vertex for each of its charts.
fn charts(raw: &Raw) -> Raw {
    let mut charted = Raw::default();
    let mut known = HashMap::new();
    for face in &raw.faces {
        let [a, b, c] = face.map(|vertex| raw.positions[vertex as usize]);
        let normal = (b - a).cross(c - a);
        let axis = (0..3).max_by(|&i, &j| normal[i].abs().total_cmp(&normal[j].abs())).unwrap_or(0);
        let Attributes { coordinates, .. } = &mut charted.attributes;
        let positions = &mut charted.positions;
        charted.faces.push(face.map(|vertex| {
            *known.entry((vertex, axis)).or_insert_with(|| {
                let position = raw.positions[vertex as usize];
                positions.push(position);
                coordinates.push([
                    position[(axis + 1) % 3] as f32,
                    position[(axis + 2) % 3] as f32 + 20.0 * axis as f32,
                ]);
                positions.len() as u32 - 1
            })
        }));
    }
    charted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::clean;

    #[test]
    fn every_case_has_its_mesh() {
        for case in CASES {
            let Hostile { raw, meant, target_faces } = mesh(case).unwrap();
            let min = if case == "bow-ties" { 240 } else { 3674 };
            assert!(raw.faces.len() >= min && meant.faces.len() >= min, "{case} has too few faces");
            assert!((1..raw.faces.len()).contains(&target_faces), "{case} has the target {target_faces}");
            assert!(
                meant.positions.iter().all(|p| p.is_finite()),
                "{case}: the intended shape is not finite"
            );
        }
        assert!(mesh("nothing").is_err());
    }

    #[test]
    fn bow_ties_touch_in_points_alone_and_charts_have_seams() {
        let (model, report) = clean(&mesh("bow-ties").unwrap().raw);
        // Twenty cubes share nineteen points.
        assert_eq!((model.topology().components, report.split_positions, report.turned_faces), (20, 19, 0));
        assert!(model.topology().is_closed());
        let (model, _) = clean(&mesh("seams").unwrap().raw);
        assert!(model.topology().is_closed() && model.topology().seam_edges > 300);
    }
}
