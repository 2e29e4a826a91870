//! A vertex's data: position, welding and attributes. A position or an attribute is coded as the difference from the
//! value of the vertex that the new vertex replaces.
//!
//! The coding is lossless. Floats map to integers in the same order, so that close floats are close integers.

use super::coder::{Coder, Number};
use super::level::{Growing, LevelFault, LevelRow};
use crate::paper::progressive_mesh::mesh::{NOWHERE, ProgressiveMesh};

impl Growing {
    /// Encodes or decodes the index of the first vertex that has the new vertex's position. If that is the new vertex
    /// itself, also codes the position.
    pub(super) fn position(
        &mut self,
        coder: &mut impl Coder,
        source: Option<&ProgressiveMesh>,
        row: LevelRow,
    ) -> Result<(), LevelFault> {
        let vertices = source.map(|source| &source.vertices);
        let want = vertices.map_or(row.new, |vertices| vertices.welded[row.new as usize]);
        // 0 if no earlier vertex has this position.
        let back = self.models.welded.code(coder, row.new - want);
        let welded = row
            .new
            .checked_sub(back)
            .ok_or(LevelFault("a vertex is welded to a vertex that does not exist"))?;
        let built = &mut self.mesh.vertices;
        let position = if back > 0 {
            if built.welded[welded as usize] != welded {
                return Err(LevelFault("a vertex is welded to one that is not the first at its position"));
            }
            built.positions[welded as usize]
        } else {
            let near = predecessor(&built.positions, row);
            let want = vertices.map(|vertices| vertices.positions[row.new as usize]);
            floats(coder, &mut self.models.positions, near, want)?
        };
        built.welded.push(welded);
        built.positions.push(position);
        Ok(())
    }

    /// Codes the file's attributes.
    pub(super) fn attributes(
        &mut self,
        coder: &mut impl Coder,
        source: Option<&ProgressiveMesh>,
        row: LevelRow,
    ) -> Result<(), LevelFault> {
        let (has, new) = (self.has, row.new as usize);
        let want = source.map(|source| &source.vertices.attributes);
        let (built, models) = (&mut self.mesh.vertices.attributes, &mut self.models);
        if has.normals {
            let near = predecessor(&built.normals, row);
            let normal = floats(coder, &mut models.normals, near, want.map(|want| want.normals[new]))?;
            built.normals.push(normal);
        }
        if has.coordinates {
            let near = predecessor(&built.coordinates, row);
            let want = want.map(|want| want.coordinates[new]);
            built.coordinates.push(floats(coder, &mut models.coordinates, near, want)?);
        }
        if has.colors {
            let near = predecessor(&built.colors, row);
            let want = want.map_or(near, |want| want.colors[new]);
            let mut color = near;
            for (at, model) in models.colors.iter_mut().enumerate() {
                let step = i32::from(want[at].wrapping_sub(near[at]) as i8);
                color[at] = near[at].wrapping_add(model.code_signed(coder, step) as u8);
            }
            built.colors.push(color);
        }
        Ok(())
    }
}

/// The prediction for a new vertex: the value of the vertex that it replaces, or of the previous vertex if the new
/// vertex replaces no vertex.
fn predecessor<T: Copy + Default>(known: &[T], row: LevelRow) -> T {
    match row.split {
        NOWHERE => known.last().copied().unwrap_or_default(),
        split => known[split as usize],
    }
}

/// Codes finite floats, each as the difference from its prediction.
fn floats<const N: usize>(
    coder: &mut impl Coder,
    models: &mut [Number; N],
    near: [f32; N],
    want: Option<[f32; N]>,
) -> Result<[f32; N], LevelFault> {
    let (mut found, want) = (near, want.unwrap_or(near));
    for at in 0..N {
        let step = rank(want[at]).wrapping_sub(rank(near[at])) as i32;
        let step = models[at].code_signed(coder, step);
        found[at] = of_rank(rank(near[at]).wrapping_add(step as u32));
        if !found[at].is_finite() {
            return Err(LevelFault("a vertex has a number that is not finite"));
        }
    }
    Ok(found)
}

/// The rank of a float in ascending order; -0 is directly before +0.
fn rank(value: f32) -> u32 {
    let bits = value.to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

fn of_rank(rank: u32) -> f32 {
    f32::from_bits(if rank >> 31 == 1 { rank & !(1 << 31) } else { !rank })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_ascend_with_floats_and_are_invertible() {
        let floats = [-f32::MAX, -1.5, -1.0, -f32::MIN_POSITIVE, -1e-45, -0.0, 0.0, 1e-45, 1.0, f32::MAX];
        assert!(floats.is_sorted_by_key(|&float| rank(float)));
        assert!(floats.iter().all(|&float| of_rank(rank(float)).to_bits() == float.to_bits()));
        assert_eq!(rank(0.0) - rank(-0.0), 1);
    }
}
