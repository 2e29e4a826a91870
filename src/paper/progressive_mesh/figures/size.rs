//! pm.size: bytes per split, in a file and in memory.

use super::super::mesh::{NOWHERE, ProgressiveMesh};
use super::super::run::Program;
use super::orders::{CLASSICAL, CLOSED, IN_PLACE_23, ORDERS, TAIL_23, WITH_SCANS, every_order, simplified};
use super::{face_orders, models, scans};
use crate::figure::prelude::*;

pub const SIZE: Figure = Figure {
    id: "pm.size",
    title: "Bytes per split",
    about: "The figure shows the bytes that levels of detail take per split: for the split itself, the faces that it \
            adds, the level's error and the tswaps (permutations of faces), without positions and attributes. (A split \
            is a level; on a seam it adds several vertices.) It shows the bytes of a .pmesh file (docs/pmesh.md), by \
            content, and of the flat lists in memory that execute the splits. For comparison, the figure shows the \
            same splits and tswaps as plain 32-bit words, as variable-length numbers (differences of successive \
            numbers, 7 bits per byte), as Forsyth's record of 16-bit indices (6 bytes, and 2 for each index that it \
            changes; no tswaps), and as the index lists of multi-level skip lists (32-bit indices, each list with \
            0.707 of the faces of the finer one). All instances share the lists in memory, and each also has indices \
            of its own, 6 or 12 bytes per face. Less memory may cost more transforms: pm.average compares transforms \
            at equal memory. The paper says that a tswap, stored as a cycle of faces, needs no other memory, and that \
            its inverse is not stored (section 5). The models are `bunny`, `sphere`, `torus`, `knot`, `solid`; the \
            scans `dragon_res4` and, with --full, `dragon` are measured if they have been fetched.",
    scenes: &WITH_SCANS,
    variants,
    paper: &["paper"],
    ours: &["tail-23"],
    full_only: &[scans::LARGE],
    sweep: None,
    show: Show::views(|| models(&WITH_SCANS))
        .variants(|| face_orders().into_iter().filter(|order| variants().contains(&order.name)).collect()),
    measure,
    plots: &[Plot::bars(FILE), Plot::bars(MEMORY)],
    claims: &[
        Claim::ours(
            "with-tswaps",
            "At 23 moved faces per split, the bunny's file takes at most 18 bytes per split, without positions, attributes \
             and header.",
            &Test::values([one(FILE, TAIL_23), one(FILE, IN_PLACE_23)], AtMost(18.0)),
        )
        .at(Places::scenes(&["bunny"])),
        Claim::ours(
            "without",
            "In classical order, the bunny's file takes at most 6 bytes per split, without positions, attributes and \
             header.",
            &[Test::value(one(FILE, CLASSICAL), AtMost(6.0))],
        )
        .at(Places::scenes(&["bunny"])),
        Claim::ours(
            "by-neighbourhood",
            "Coding a moved face by its neighbourhood takes at most a third of the bytes of variable-length \
             numbers, on every model.",
            &[Test::ratio(one(SWAPS, TAIL_23), one(SWAP_NUMBERS, TAIL_23), AtMost(1.0 / 3.0))],
        )
        .at(Places::scenes(&CLOSED)),
    ],
};

const FILE: &str = "file";
const SWAPS: &str = "file: swaps";
const WORDS: &str = "as 32-bit words";
const NUMBERS: &str = "as variable-length numbers";
const SWAP_NUMBERS: &str = "as variable-length numbers: swaps";
const RECORD: &str = "as Forsyth's 16-bit record";
const MEMORY: &str = "memory";
const SKIP_LISTS: &str = "skip lists";
/// Ratio of a skip list's faces to those of the next finer list.
const RATIO: f64 = 0.707;
const UNIT: &str = "bytes per split";

fn variants() -> Vec<String> {
    ORDERS.iter().map(|(name, _)| *name).chain([SKIP_LISTS]).map(str::to_owned).collect()
}

fn measure(_: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let (model, collapses) = simplified(&cell.scene)?;
    let mut rows = Vec::new();
    for (name, mesh) in every_order(&model, &collapses) {
        rows.extend(of_mesh(name, &mesh)?);
    }
    let splits = collapses.wedges.len().max(1) as f64;
    let lists = skip_lists(model.faces.len(), 64) / splits;
    rows.push(Row::number(SKIP_LISTS, MEMORY, UNIT, lists));
    Ok(rows)
}

fn of_mesh(name: &str, mesh: &ProgressiveMesh) -> anyhow::Result<Vec<Row>> {
    let splits = f64::from(mesh.last_level().max(1));
    let (_, contents) = mesh.to_bytes();
    let mut rows = Vec::new();
    let mut row = |quantity: &str, bytes: f64| {
        rows.push(Row::number(name, quantity, UNIT, bytes / splits));
    };
    row(FILE, contents.bytes_per_split(mesh) * splits);
    for (content, bits) in contents.sizes.named() {
        row(&format!("file: {content}"), bits / 8.0);
    }
    row("file: headers of file and chunks", contents.frame_bytes);
    let slots = mesh.splits.slots.items().len();
    row(WORDS, 4.0 * words(mesh) as f64);
    let [split_numbers, swap_numbers] = [split_numbers(mesh), swap_numbers(mesh)];
    row(NUMBERS, (split_numbers + swap_numbers) as f64);
    row(SWAP_NUMBERS, swap_numbers as f64);
    row(RECORD, (6 * mesh.splits.slots.len() + 2 * slots) as f64);
    row(MEMORY, Program::new(mesh)?.bytes() as f64);
    Ok(rows)
}

/// 32-bit words. A split has splitVert, numN with numF, and slots; a tswap has numF and slots.
fn words(mesh: &ProgressiveMesh) -> usize {
    let (slots, cycles) = (&mesh.splits.slots, &mesh.swaps.cycles);
    2 * slots.len() + slots.items().len() + cycles.len() + cycles.items().len()
}

/// Bytes of a number with 7 bits per byte.
fn number_bytes(number: u32) -> usize {
    (32 - number.leading_zeros()).div_ceil(7).max(1) as usize
}

/// Bytes of the difference from the previous number; updates the previous number.
fn step_bytes(before: &mut u32, number: u32) -> usize {
    let step = number.wrapping_sub(std::mem::replace(before, number)) as i32;
    number_bytes((step << 1 ^ step >> 31) as u32)
}

fn split_numbers(mesh: &ProgressiveMesh) -> usize {
    let (mut last_split, mut last_slot) = (0, 0);
    let rows = mesh.splits.split_vertices.iter().zip(mesh.splits.slots.rows());
    rows.map(|(&split, slots)| {
        let split = if split == NOWHERE { last_split } else { split };
        let vertex = step_bytes(&mut last_split, split);
        // numN and numF share a byte.
        vertex + 1 + slots.iter().map(|&slot| step_bytes(&mut last_slot, slot)).sum::<usize>()
    })
    .sum()
}

fn swap_numbers(mesh: &ProgressiveMesh) -> usize {
    let mut last = 0;
    let cycle = |slots: &[u32]| {
        number_bytes(slots.len() as u32)
            + slots.iter().map(|&slot| step_bytes(&mut last, slot)).sum::<usize>()
    };
    mesh.swaps.cycles.rows().map(cycle).sum()
}

/// Bytes of the index lists, from a mesh of `faces` faces down to one of `min`.
fn skip_lists(faces: usize, min: usize) -> f64 {
    let lists = std::iter::successors(Some(faces as f64), |faces| Some(faces * RATIO));
    lists.take_while(|&faces| faces >= min as f64).map(|faces| 12.0 * faces.round()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::ragged::Ragged;

    #[test]
    fn on_a_seam_several_new_vertices_count_as_one_split() {
        use super::super::super::mesh::Level;
        let mut mesh = ProgressiveMesh { levels: vec![Level::default(); 3], ..ProgressiveMesh::default() };
        // Two levels, three vertices: 2 x 3 words and 1 slot.
        mesh.splits.split_vertices = vec![NOWHERE; 3];
        mesh.splits.slots = Ragged::from_iter([vec![], vec![7], vec![]]);
        let splits = f64::from(mesh.last_level());
        assert_eq!(words(&mesh) as f64 * 4.0 / splits, 14.0);
    }

    #[test]
    fn numbers_take_seven_bits_a_byte() {
        assert_eq!([0, 1, 127, 128, 16_383, 16_384, u32::MAX].map(number_bytes), [1, 1, 1, 2, 2, 3, 5]);
        let mut before = 100;
        assert_eq!([36, 100, 164, 163].map(|next| step_bytes(&mut before, next)), [1, 2, 2, 1]);
        let mut mesh = ProgressiveMesh::default();
        mesh.splits.split_vertices = vec![3, NOWHERE];
        mesh.splits.slots = Ragged::from_iter([vec![5, 300], vec![]]);
        mesh.swaps.cycles = Ragged::from_iter([[1, 200, 201]]);
        assert_eq!((split_numbers(&mesh), swap_numbers(&mesh)), (1 + 1 + 1 + 2 + 1 + 1, 1 + 1 + 2 + 1));
    }

    #[test]
    fn skip_lists_are_a_geometric_sum() {
        assert_eq!(skip_lists(100, 64), 12.0 * (100.0 + 71.0));
        let sum = skip_lists(1_000_000, 1) / 12.0 / 1e6;
        assert!((sum - 1.0 / (1.0 - RATIO)).abs() < 1e-4, "{sum}");
    }
}
