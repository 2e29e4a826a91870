//! Part of pm.average: skip lists that take no more memory than an order's commands. At the usual ratio of 0.707 they take
//! less than half of it, and a comparison at unequal memory proves little.

use super::super::cache::Cache;
use super::super::mesh::ProgressiveMesh;
use super::super::rivals::{Rival, rival_costs};
use super::super::run::Program;
use super::orders::{CLOSED, DRAWN, FEW, FIFO_16, MOVED, OURS, judged, mean_of, number};
use crate::figure::{Finding, Row, Table};

/// Of what all instances need to change their levels and to begin with: commands and M0's buffer, or lists and the
/// table of split vertices.
const SHARED: &str = "memory that instances share";
const UNIT: &str = "bytes per face";

/// An order, and the variant of skip lists that takes no more than it.
pub const AT_MEMORY_OF: [(&str, &str); 2] =
    [(OURS, "skip-lists at ours' memory"), (FEW, "skip-lists at few moves' memory")];

/// Rows of an order of `mesh`, and of the skip lists that stand beside it, at `levels` of the mesh in classical order.
pub fn rows(
    name: &str,
    mesh: &ProgressiveMesh,
    plain: &ProgressiveMesh,
    levels: &[u32],
) -> anyhow::Result<Vec<Row>> {
    let faces = mesh.faces.len() as f64;
    let shared = Program::new(mesh)?.command_bytes() as f64 + 12.0 * faces;
    let mut rows = vec![number(name, SHARED, UNIT, shared / faces)];
    if let Some((_, lists)) = AT_MEMORY_OF.iter().find(|(order, _)| *order == name) {
        rows.extend(skip_lists_within(lists, plain, shared, levels));
    }
    Ok(rows)
}

/// As many lists as fit into `most_bytes` with the table of split vertices. Lists that shrink by a factor r take
/// 12 F / (1 - r) bytes together.
fn skip_lists_within(name: &str, plain: &ProgressiveMesh, most_bytes: f64, levels: &[u32]) -> [Row; 4] {
    let (faces, table) = (plain.faces.len() as f64, 4.0 * plain.splits.split_vertices.len() as f64);
    let mut ratio = 1.0 - 12.0 * faces / (most_bytes - table);
    // The sum is over whole levels: reduce the ratio until it fits.
    let found = loop {
        let found = rival_costs(plain, Rival::SkipLists { ratio }, &[Cache::Fifo(16)], levels);
        if found.list_bytes as f64 + table <= most_bytes {
            break found;
        }
        ratio -= 0.002;
    };
    let bytes = found.list_bytes as f64 + table;
    [
        number(name, FIFO_16, "transforms per vertex", found.costs[0].mean()),
        number(name, MOVED, "faces", found.copied_per_split),
        number(name, SHARED, UNIT, bytes / faces),
        number(name, DRAWN, "faces", found.traffic),
    ]
}

/// Reproduced if our order needs no more transforms than skip lists of at most its memory.
pub fn at_equal_memory(table: &Table) -> Finding {
    let of = |variant, quantity| mean_of(table, None, variant, quantity, &CLOSED);
    let pair = |(ours, lists)| {
        Some((of(ours, FIFO_16)?, of(ours, SHARED)?, of(lists, FIFO_16)?, of(lists, SHARED)?))
    };
    let pairs: Option<Vec<_>> = AT_MEMORY_OF.into_iter().map(pair).collect();
    let met = pairs.as_ref().map(|pairs| pairs.iter().all(|(ours, _, lists, _)| ours <= lists));
    let words = pairs.iter().flatten().zip(AT_MEMORY_OF).map(|((ours, memory, lists, theirs), (name, _))| {
        format!("{name} {ours:.2} at {memory:.0} bytes a face, skip lists {lists:.2} at {theirs:.0}")
    });
    let bound = "no more than skip lists; these draw and hold faces without area besides, and copy a list where levels change";
    judged(met, words.collect::<Vec<_>>().join(", "), bound)
}

#[cfg(test)]
mod tests {
    use super::super::tests::table;
    use super::*;
    use crate::figure::{Value, Verdict};
    use crate::paper::progressive_mesh::order::{classical, scratch};

    #[test]
    fn fewer_transforms_of_skip_lists_that_take_no_more_refute() {
        let found = |lists: f64| {
            let rows = CLOSED.into_iter().flat_map(|scene| {
                let of = move |(ours, theirs)| {
                    [
                        (scene, ours, FIFO_16, 1.5),
                        (scene, ours, SHARED, 80.0),
                        (scene, theirs, FIFO_16, lists),
                        (scene, theirs, SHARED, 79.0),
                    ]
                };
                AT_MEMORY_OF.into_iter().flat_map(of)
            });
            at_equal_memory(&table("cpu", &rows.collect::<Vec<_>>())).verdict
        };
        assert_eq!((found(1.5), found(1.4)), (Verdict::Reproduced, Verdict::NotReproduced));
        assert_eq!(at_equal_memory(&table("cpu", &[])).verdict, Verdict::NotMeasurable);
    }

    #[test]
    fn skip_lists_take_as_much_as_they_may_and_no_more() {
        let model = scratch::torus(32);
        let plain = classical(&model, &scratch::collapses(&model, 64));
        let faces = plain.faces.len() as f64;
        for most in [40.0, 80.0, 160.0] {
            let [_, _, shared, _] =
                skip_lists_within("lists", &plain, most * faces, &[plain.last_level() / 2]);
            let Value::Number(bytes) = shared.value else { panic!("{shared:?}") };
            assert!(0.8 * most < bytes && bytes <= most, "{bytes} of {most} bytes a face");
        }
    }
}
