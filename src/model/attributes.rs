//! Attributes of a wedge: everything except its position.

use super::Attributes;
use glam::{DVec3, Vec3};
use std::collections::HashMap;

impl Attributes {
    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.normals.is_empty() && self.coordinates.is_empty() && self.colors.is_empty()
    }

    /// Attributes of the wedges `indices`, in that order.
    ///
    /// # Panics
    /// If there is no such wedge.
    pub fn select(&self, indices: &[u32]) -> Attributes {
        fn chosen<T: Copy>(list: &[T], indices: &[u32]) -> Vec<T> {
            if list.is_empty() {
                return Vec::new();
            }
            indices.iter().map(|&index| list[index as usize]).collect()
        }
        Attributes {
            normals: chosen(&self.normals, indices),
            coordinates: chosen(&self.coordinates, indices),
            colors: chosen(&self.colors, indices),
        }
    }

    /// Bits of one tuple, equal exactly for equal tuples. Missing attributes are 0.
    pub(super) fn bits(&self, index: usize) -> [u32; 6] {
        // -0 + 0 is +0.
        let [x, y, z] = self.normals.get(index).map_or([0; 3], |normal| normal.map(|x| (x + 0.0).to_bits()));
        let [s, t] = self.coordinates.get(index).map_or([0; 2], |st| st.map(|x| (x + 0.0).to_bits()));
        [x, y, z, s, t, self.colors.get(index).map_or(0, |color| u32::from_le_bytes(*color))]
    }
}

/// For each vertex, the first vertex with the same point and attributes; 0 for all if there are no attributes.
pub(super) fn first_alike(attributes: &Attributes, points: &[u32]) -> Vec<u32> {
    if attributes.is_empty() {
        return vec![0; points.len()];
    }
    let mut known = HashMap::with_capacity(points.len());
    let mut first =
        |(vertex, &point)| *known.entry((point, attributes.bits(vertex))).or_insert(vertex as u32);
    points.iter().enumerate().map(&mut first).collect()
}

/// Normalises the normals. A normal that is zero or not finite is replaced by the area-weighted mean of its faces'
/// normals. Returns the number of replaced normals that faces use.
pub(super) fn usable_normals(attributes: &mut Attributes, positions: &[DVec3], faces: &[[u32; 3]]) -> usize {
    // Scale to 1 first: the square of 1e-30 is 0 in f32, and squared areas may underflow in f64.
    let unit = |normal: DVec3| (normal / normal.abs().max_element()).try_normalize();
    let mut lost = HashMap::new();
    for (vertex, normal) in attributes.normals.iter_mut().enumerate() {
        let given = Vec3::from_array(*normal).as_dvec3();
        // Keep vectors that are unit length up to rounding, so that a written model reads back identically.
        let unit = if (given.length_squared() - 1.0).abs() < 1e-6 { Some(given) } else { unit(given) };
        match unit {
            // -0 + 0 is +0.
            Some(unit) => *normal = (unit + DVec3::ZERO).as_vec3().to_array(),
            None => {
                lost.insert(vertex as u32, DVec3::ZERO);
            }
        }
    }
    if lost.is_empty() {
        return 0;
    }
    let mut used = std::collections::HashSet::new();
    for face in faces {
        let [a, b, c] = face.map(|vertex| positions[vertex as usize]);
        for vertex in face {
            if let Some(sum) = lost.get_mut(vertex) {
                *sum += (b - a).cross(c - a);
                used.insert(*vertex);
            }
        }
    }
    for (vertex, sum) in lost {
        // Faces without area have no normal; any unit vector will do.
        attributes.normals[vertex as usize] = unit(sum).unwrap_or(DVec3::Z).as_vec3().to_array();
    }
    used.len()
}

/// Replaces each component of a texture coordinate that is not finite by 0. Returns the number of changed coordinates
/// that faces use.
pub(super) fn finite_coordinates(attributes: &mut Attributes, faces: &[[u32; 3]]) -> usize {
    let is_lost = |coordinate: &[f32; 2]| coordinate.iter().any(|x| !x.is_finite());
    let lost = |vertex: &&u32| attributes.coordinates.get(**vertex as usize).is_some_and(is_lost);
    let used: std::collections::HashSet<u32> = faces.iter().flatten().filter(lost).copied().collect();
    for coordinate in attributes.coordinates.iter_mut().filter(|coordinate| is_lost(coordinate)) {
        *coordinate = coordinate.map(|x| if x.is_finite() { x } else { 0.0 });
    }
    used.len()
}
