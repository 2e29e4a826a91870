//! The mesh without texture coordinates, for depth-only passes.
//!
//! Triangles of different cells of the grid share no [`MeshVertex`](super::MeshVertex), but they share positions: the
//! paper's earth has 300 312 vertices and 74 886 positions. Fewer vertices matter most on a software driver, which
//! transforms all vertices of a draw on one thread.

use super::Mesh;
use std::collections::HashMap;

/// A position as the GPU reads it, 24 bytes, no padding: the first two members of [`MeshVertex`](super::MeshVertex).
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct MeshPosition {
    /// World metres, rounded to the nearest float.
    pub high: [f32; 3],
    /// The rounding error.
    pub low: [f32; 3],
}

impl Mesh {
    /// The same triangles in the same order, with each position stored once regardless of its texture coordinates.
    pub fn positions(&self) -> (Vec<MeshPosition>, Vec<u32>) {
        let (mut positions, mut known) = (Vec::new(), HashMap::new());
        let place_of = self.vertices.iter().map(|vertex| {
            let position = MeshPosition { high: vertex.position_high, low: vertex.position_low };
            // Compared by bits, because the depths of two passes must be equal: 0 and -0 differ, and NaN equals
            // itself.
            let bits: [u32; 6] = bytemuck::cast(position);
            *known.entry(bits).or_insert_with(|| {
                positions.push(position);
                positions.len() as u32 - 1
            })
        });
        let place_of: Vec<u32> = place_of.collect();
        let indices = self.indices.iter().map(|&index| place_of[index as usize]).collect();
        (positions, indices)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{earth, gpu_mesh};
    use super::*;

    #[test]
    fn depth_only_triangles_are_the_same_with_each_position_once() {
        let mesh = gpu_mesh(&earth(388, 194));
        let (positions, indices) = mesh.positions();
        // 193 rings of 388 (the seam is one position), and the poles.
        assert_eq!(positions.len(), 193 * 388 + 2);
        assert_eq!(indices.len(), mesh.indices.len());
        for (&index, &place) in mesh.indices.iter().zip(&indices) {
            let vertex = mesh.vertices[index as usize];
            let position = MeshPosition { high: vertex.position_high, low: vertex.position_low };
            assert_eq!(positions[place as usize], position);
        }
    }
}
