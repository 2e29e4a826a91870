//! Part of pm.average: skip lists with at most the memory of an order's program. At the usual ratio of 0.707
//! skip lists take only a part of this memory, so comparing them at that ratio would be unfair to them.

use super::super::baselines::{OrderBaseline, PreparedBaseline, baseline_costs};
use super::super::cache::Cache;
use super::super::mesh::ProgressiveMesh;
use super::super::run::Program;
use super::orders::{CLOSED, DRAWN, FIFO_16, IN_PLACE_10, IN_PLACE_23, MOVED, TAIL_23, number};
use crate::figure::prelude::*;
use crate::vk::IndexType;

/// Memory that all instances share: an order's commands, the tables for jumps over many levels, the faces drawn at each
/// level and the index buffer of level 0; or skip lists and the corners that level changes write. Not counted is what
/// both need: vertices, and the errors of the levels. Indices have 16 bits below 65,536 vertices, and words of commands
/// and tables 32 bits.
const SHARED: &str = "memory that instances share";
const UNIT: &str = "bytes per face";

/// An order, and the skip lists with at most its memory.
pub const AT_MEMORY_OF: [(&str, &str); 3] = [
    (IN_PLACE_23, "skip-lists at in-place-23's memory"),
    (IN_PLACE_10, "skip-lists at in-place-10's memory"),
    (TAIL_23, "skip-lists at tail-23's memory"),
];

/// The rows of an order, and of the corresponding skip lists at `levels` of the mesh in classical order.
pub fn rows(name: &str, program: &Program, plain: &ProgressiveMesh, levels: &[u32]) -> Vec<Row> {
    let faces = plain.faces.len() as f64;
    let shared = program.bytes_beside_levels() as f64;
    let mut rows = vec![number(name, SHARED, UNIT, shared / faces)];
    if let Some((_, lists)) = AT_MEMORY_OF.iter().find(|(order, _)| *order == name) {
        rows.extend(skip_lists_within(lists, plain, shared, levels));
    }
    rows
}

/// The largest number of lists that fit into `max_bytes`. Lists that shrink by a factor r have 1 / (1 - r)
/// times the faces of the full mesh in total.
fn skip_lists_within(name: &str, plain: &ProgressiveMesh, max_bytes: f64, levels: &[u32]) -> [Row; 4] {
    let index = IndexType::of_vertices(plain.vertices.positions.len());
    let lists = |ratio| {
        let baseline = OrderBaseline::SkipLists { ratio };
        let prepared = PreparedBaseline::new(plain, baseline, plain.vertices.welded.clone());
        (prepared.list_bytes(index) as f64, prepared.listed_faces() as f64)
    };
    let (faces, face_bytes) = (plain.faces.len() as f64, index.triangle_bytes() as f64);
    // The corners that level changes write take nearly the same memory at every ratio.
    let (some_bytes, some_faces) = lists(0.9);
    let max_listed = (max_bytes - some_bytes) / face_bytes + some_faces;
    let mut ratio = 1.0 - faces / max_listed;
    // The sum over actual levels may be larger: reduce the ratio until it fits.
    while lists(ratio).0 > max_bytes {
        ratio -= 0.002;
    }
    let found = baseline_costs(plain, OrderBaseline::SkipLists { ratio }, &[Cache::Fifo(16)], levels);
    [
        number(name, FIFO_16, "transforms per vertex", found.costs[0].mean()),
        number(name, MOVED, "faces", found.copied_per_split),
        number(name, SHARED, UNIT, found.list_bytes as f64 / faces),
        number(name, DRAWN, "faces", found.traffic),
    ]
}

/// The comparison at equal memory.
pub const EQUAL_MEMORY: Claim = Claim::ours(
    "equal-memory",
    "With births in place, fewer vertices are transformed than with multi-level skip lists of the same \
     memory (FIFO-16, mean over the models).",
    &[
        Test::ratio_of(FIFO_16, [AT_MEMORY_OF[0].0, AT_MEMORY_OF[0].1], Below(1.0)),
        Test::ratio_of(FIFO_16, [AT_MEMORY_OF[1].0, AT_MEMORY_OF[1].1], Below(1.0)),
    ],
)
.at(Places::mean(&CLOSED));

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::Value;
    use crate::paper::progressive_mesh::order::{classical, scratch};

    #[test]
    fn skip_lists_take_as_much_as_they_may_and_no_more() {
        let model = scratch::torus(32);
        let plain = classical(&model, &scratch::collapses(&model, 64));
        let faces = plain.faces.len() as f64;
        for max in [40.0, 80.0, 160.0] {
            let [_, _, shared, _] =
                skip_lists_within("lists", &plain, max * faces, &[plain.last_level() / 2]);
            let Value::Number(bytes) = shared.value else { panic!("{shared:?}") };
            assert!(0.8 * max < bytes && bytes <= max, "{bytes} of {max} bytes per face");
        }
    }
}
