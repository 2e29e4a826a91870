//! Counts of stages 2 and 3 that are equal on every device, computed from the request image alone: texels and words
//! that shaders read, atomics, and bytes of the list. A count that depends on the order of invocations, or on the size
//! of a device's subgroups, is replaced by the reason. A test is a load from the tile mask that avoids an atomic (with
//! `mark-bytes`: a store) if the tile is marked already. [`of_list`] counts both stages of a frame.

use crate::figure::{Row, Value};
use crate::math::pyramid::{Pyramid, TileId};
use crate::paper::virtual_texture::dedup::DedupPass;
use crate::paper::virtual_texture::footprint::FootprintPass;
use crate::paper::virtual_texture::tile_mask::TileMask;
use crate::paper::virtual_texture::{Compaction, Config, Dedup, Listing, MaskLayout, TileAddress, reference};
use crate::vk::Gpu;
use std::collections::BTreeSet;

/// Quantities of stage 2: texels of the request image, tests before atomics, and atomics in the device's memory.
pub const TEXELS: &str = "texels fetched";
pub const TESTS: &str = "tests of the tile mask";
pub const ATOMICS: &str = "atomics";

/// Quantity of a draw that textures: texels that the filter reads from the tile pool, mean over the covered pixels.
/// Fragments that are hidden later are not counted. Only draws without a depth-only pass before them have any:
/// `fused`, and `request_draw = "texturing"`.
pub const TEXELS_PER_PIXEL: &str = "texels fetched per pixel";

/// Quantities of stage 3, besides [`ATOMICS`]: words of the tile mask, and bytes of the list without its length.
pub const WORDS: &str = "words of the tile mask read";
pub const WRITTEN: &str = "bytes written to the list";

const RACE: &str = "depends on the order in which the device runs the invocations";
const SUBGROUP: &str = "depends on the number of invocations in a subgroup, which differs between devices";
const OVERDRAWN: &str =
    "fragments that are hidden later set bits, too, so the number depends on the order of the triangles";

/// An exact count, or why there is none.
type Count = Result<u64, &'static str>;

fn row(variant: &str, quantity: String, unit: &str, count: Count) -> Row {
    match count {
        Ok(count) => Row::number(variant, quantity, unit, count as f64),
        Err(why) => Row::new(variant, quantity, unit, Value::Missing(why.into())),
    }
}

/// The triple of each pixel of the request image, row by row.
pub struct Requests<'a> {
    pub triples: &'a [[u32; 3]],
    pub size: [u32; 2],
    pub pyramid: &'a Pyramid,
}

impl Requests<'_> {
    fn streamed(&self, [q, ..]: [u32; 3]) -> bool {
        q < self.pyramid.first_resident_level()
    }

    /// Pixels whose tile is streamed.
    fn streamed_pixels(&self) -> u64 {
        self.triples.iter().filter(|triple| self.streamed(**triple)).count() as u64
    }

    /// Number of streamed triples that differ from the previous pixel's in the same square of 8 x 8 pixels.
    /// `pixel(n)` is the column and row of the square's n-th pixel. With `clamps`, pixels beyond the picture's edge
    /// repeat those at the edge; otherwise they are background.
    fn changes(&self, pixel: fn(u32) -> [u32; 2], clamps: bool) -> u64 {
        let [width, height] = self.size;
        // With `clamps`, workgroups of 8 x 8 squares also read the squares beyond the picture's edge.
        let [columns, rows] = self.size.map(|side| if clamps { side.next_multiple_of(64) } else { side });
        let mut changes = 0;
        for (top, left) in (0..rows).step_by(8).flat_map(|y| (0..columns).step_by(8).map(move |x| (y, x))) {
            let mut last = None;
            for [x, y] in (0..64).map(pixel).map(|[x, y]| [left + x, top + y]) {
                let at = [x.min(width - 1), y.min(height - 1)];
                let triple = self.triples[(at[1] * width + at[0]) as usize];
                let stored =
                    (clamps || at == [x, y]).then_some(triple).filter(|triple| self.is_tile(*triple));
                changes += u64::from(stored != last && stored.is_some_and(|triple| self.streamed(triple)));
                last = stored;
            }
        }
        changes
    }

    /// False for the background.
    fn is_tile(&self, [q, ..]: [u32; 3]) -> bool {
        q <= self.pyramid.coarsest_level()
    }
}

/// The rows of both stages of a frame whose request image is `requests`. `footprint` is the stage 1 of a variant that is
/// not fused. Read-back has no rows: its only count, the bytes copied, is stored with its time.
///
/// # Errors
/// Out of memory.
pub fn of_list(
    gpu: &Gpu,
    (name, config): (&str, &Config),
    requests: &Requests<'_>,
    footprint: Option<&FootprintPass>,
) -> crate::vk::Result<Vec<Row>> {
    let Requests { triples, size, pyramid } = requests;
    let [groups, texels] = match footprint {
        _ if config.list != Listing::Device => return Ok(Vec::new()),
        Some(footprint) => DedupPass::new(gpu, pyramid, config, footprint)?.groups_and_texels(*size),
        None => [0, 0],
    };
    let list = reference_list(triples, pyramid, config.address);
    let stage_2 = of_stage_2((name, config.dedup), requests, [groups, texels], ", stage 2");
    // Without the depth prepass, the list also has hidden tiles.
    let exact =
        (config.dedup != Dedup::Fused).then(|| of_stage_3((name, config), &list, pyramid, ", stage 3"));
    Ok(stage_2.into_iter().chain(exact.into_iter().flatten()).collect())
}

/// The reference's list of the visible tiles in a request image.
pub fn reference_list(triples: &[[u32; 3]], pyramid: &Pyramid, address: TileAddress) -> Vec<[u32; 3]> {
    match address {
        TileAddress::Level0 => Vec::from_iter(reference::distinct_triples(triples, pyramid)),
        TileAddress::OwnLevel => {
            let tiles = reference::visible_tiles(triples, pyramid);
            tiles.iter().map(|tile| [tile.level, tile.row, tile.column]).collect()
        }
    }
}

/// The rows of a variant of stage 2. `groups` is its number of workgroups, and `texels` the number of texels that it
/// fetches. `ending` is appended to the name of each quantity.
pub fn of_stage_2(
    (name, dedup): (&str, Dedup),
    requests: &Requests<'_>,
    [groups, texels]: [u64; 2],
    ending: &str,
) -> [Row; 3] {
    let pixels = requests.streamed_pixels();
    let rows_of_pixels = |n: u32| [n % 8, n / 8];
    // Quads of 2 x 2 pixels, row by row. A gather returns the lower left pixel first, then counter-clockwise.
    let quads = |n: u32| {
        let (quad, k) = (n / 4, n % 4);
        [quad % 4 * 2 + [0, 1, 1, 0][k as usize], quad / 4 * 2 + [1, 1, 0, 0][k as usize]]
    };
    let (tests, atomics) = match dedup {
        // Points are merged by the logic operation of the colour attachment.
        Dedup::Geometry | Dedup::Points => (Ok(0), Ok(0)),
        Dedup::AtomicOr => (Ok(0), Ok(pixels)),
        Dedup::SubgroupUnique => (Ok(0), Err(SUBGROUP)),
        Dedup::TestOr => (Ok(pixels), Err(RACE)),
        Dedup::TileMemo => (Ok(requests.changes(rows_of_pixels, false)), Err(RACE)),
        Dedup::Runs => (Ok(requests.changes(quads, true)), Err(RACE)),
        Dedup::SharedHash => (Err(RACE), Err(RACE)),
        Dedup::Bitset => (Ok(groups * requests.pyramid.tile_count().div_ceil(32)), Err(RACE)),
        Dedup::MarkBytes => (Ok(pixels), Ok(0)),
        // One test for each visible fragment of the draw that textures.
        Dedup::FusedExact => (Ok(pixels), Err(RACE)),
        Dedup::Fused => (Err(OVERDRAWN), Err(OVERDRAWN)),
    };
    let count = |quantity: &str, unit, count| row(name, format!("{quantity}{ending}"), unit, count);
    [count(TEXELS, "texels", Ok(texels)), count(TESTS, "tests", tests), count(ATOMICS, "atomics", atomics)]
}

/// The word of the tile mask that holds the mark of a triple.
fn word_of([q, i, j]: [u32; 3], pyramid: &Pyramid, config: &Config) -> u64 {
    let [columns, rows] = pyramid.tile_grid(0).map(u64::from);
    let cell = u64::from(i) * columns + u64::from(j);
    let place = match config.address {
        TileAddress::Level0 => u64::from(q) * columns * rows + cell,
        TileAddress::OwnLevel => pyramid.tile_index(TileId { level: q, row: i, column: j }),
    };
    match config.dedup.layout() {
        MaskLayout::Texels => cell,
        MaskLayout::Bits => place / 32,
        MaskLayout::Bytes => place / 4,
    }
}

/// The rows of a variant of stage 3 that makes the list `triples`. `ending` is appended to the name of each quantity.
pub fn of_stage_3(
    (name, config): (&str, &Config),
    triples: &[[u32; 3]],
    pyramid: &Pyramid,
    ending: &str,
) -> [Row; 3] {
    let (compact, words) = (config.compact, TileMask::words_of(pyramid, config));
    let marked = BTreeSet::from_iter(triples.iter().map(|&triple| word_of(triple, pyramid, config)));
    // Invocations of `workgroup` and `ordered` read 16 words each. Workgroups have 64 invocations.
    let lots = |of: u64| BTreeSet::from_iter(marked.iter().map(|word| word / of));
    let words_of = |of: u64| lots(of).into_iter().map(|lot| (words - lot * of).min(of)).sum::<u64>();
    let (read, atomics) = match compact {
        // Transform feedback appends without atomics of the shader.
        Compaction::TransformFeedback => (words, Ok(0)),
        Compaction::Append => (words, Ok(marked.len() as u64)),
        Compaction::Subgroup => (words, Err(SUBGROUP)),
        // Invocations with marks read their words again.
        Compaction::Workgroup => (words + words_of(16), Ok(lots(1024).len() as u64)),
        // Workgroups with marks read their words twice more.
        Compaction::Ordered => (words + 2 * words_of(1024), Ok(0)),
        // The fused draw sets the bits of the tile mask and appends to the list, one word for each triple.
        Compaction::FusedAppend => (0, Ok(triples.len() as u64)),
    };
    let entry = if compact == Compaction::FusedAppend { 4 } else { 12 };
    let count = |quantity: &str, unit, count| row(name, format!("{quantity}{ending}"), unit, count);
    [
        count(WORDS, "words", Ok(read)),
        count(ATOMICS, "atomics", atomics),
        count(WRITTEN, "bytes", Ok(entry * triples.len() as u64)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::virtual_texture::PAPER;

    /// 512 x 256 tiles of level 0, in 9 streamed levels.
    fn pyramid() -> Pyramid {
        Pyramid::new(18, 17, 9, 4, None).unwrap()
    }

    /// The numbers of the rows; `None` for a row that has a reason instead.
    fn numbers(rows: [Row; 3]) -> [Option<f64>; 3] {
        rows.map(|row| row.value.number())
    }

    #[test]
    fn stage_2_tests_each_change_along_its_path_through_a_square() {
        const A: [u32; 3] = [0, 1, 1];
        const B: [u32; 3] = [2, 4, 8];
        const RESIDENT: [u32; 3] = [9, 0, 0];
        const NONE: [u32; 3] = [u32::MAX; 3];
        let count = |triples: &[[u32; 3]], size: [u32; 2], dedup: Dedup| {
            let pyramid = pyramid();
            let requests = Requests { triples, size, pyramid: &pyramid };
            numbers(of_stage_2((dedup.name(), dedup), &requests, [3, 64], ""))
        };
        // A picture of two rows, each A B A B ... The tile changes at every pixel in row order, and at every second
        // pixel in quad order.
        let stripes: Vec<[u32; 3]> = (0..16).map(|n| if n % 2 == 0 { A } else { B }).collect();
        let of = |dedup| count(&stripes, [8, 2], dedup);
        assert_eq!(of(Dedup::Geometry), [Some(64.0), Some(0.0), Some(0.0)]);
        assert_eq!(of(Dedup::AtomicOr), [Some(64.0), Some(0.0), Some(16.0)]);
        assert_eq!(of(Dedup::TestOr), [Some(64.0), Some(16.0), None]);
        assert_eq!(of(Dedup::TileMemo)[1], Some(16.0));
        assert_eq!(of(Dedup::MarkBytes), [Some(64.0), Some(16.0), Some(0.0)]);
        // 3 workgroups, and a bit for each of 174,762 tiles.
        assert_eq!(of(Dedup::Bitset)[1], Some(3.0 * 5462.0));
        assert_eq!(of(Dedup::SharedHash)[1..], [None, None]);
        assert_eq!([of(Dedup::FusedExact)[1], of(Dedup::Fused)[1]], [Some(16.0), None]);
        // From its lower left pixel a quad reads A B B A, and the quad before it ends with A. So a square has 1 + 16 x
        // 2 changes. The 7 squares below it repeat the picture's last row, so each has as many changes. In the 56
        // squares beside the picture, every pixel is a B.
        assert_eq!(of(Dedup::Runs)[1], Some(8.0 * (1.0 + 16.0 * 2.0) + 56.0));
        // Resident levels and the background are never tested, and interrupt a run.
        let breaks = [A, A, RESIDENT, A, NONE, A, B, B];
        assert_eq!(
            [Dedup::TileMemo, Dedup::TestOr].map(|dedup| count(&breaks, [8, 1], dedup)[1]),
            [Some(4.0), Some(6.0)]
        );
        // A run ends at the square's edge, in both directions.
        let one = vec![A; 16 * 9];
        assert_eq!(count(&one, [16, 9], Dedup::TileMemo)[1], Some(4.0));
    }

    #[test]
    fn stage_3_reads_marked_words_again_and_has_one_atomic_for_each() {
        let rows = |config: Config, triples: &[[u32; 3]]| {
            numbers(of_stage_3((config.compact.name(), &config), triples, &pyramid(), ""))
                .map(Option::unwrap_or_default)
        };
        let of = |compact, triples: &[[u32; 3]]| rows(Config { compact, ..PAPER }, triples);
        // Two marks in one word; one mark 5 words further; one mark in the next row, 512 words further but in the same
        // workgroup; and one mark in the last word.
        let triples = [[0, 0, 3], [1, 0, 3], [0, 0, 8], [0, 1, 3], [0, 255, 511]];
        let words = 131_072.0;
        assert_eq!(of(Compaction::TransformFeedback, &triples), [words, 0.0, 60.0]);
        assert_eq!(of(Compaction::Append, &triples), [words, 4.0, 60.0]);
        assert_eq!(of(Compaction::Workgroup, &triples), [words + 3.0 * 16.0, 2.0, 60.0]);
        assert_eq!(of(Compaction::Ordered, &triples), [words + 2.0 * 2.0 * 1024.0, 0.0, 60.0]);
        assert_eq!(of(Compaction::FusedAppend, &triples), [0.0, 5.0, 20.0]);
        assert_eq!(of(Compaction::Append, &[]), [words, 0.0, 0.0]);
        // A bit or a byte for each of 174,762 tiles. The marks are 3, 8, 515, 131,072 and 131,073.
        let own_level = [[0, 0, 3], [0, 0, 8], [0, 1, 3], [1, 0, 0], [1, 0, 1]];
        for (dedup, words, atomics) in [(Dedup::Bitset, 5462.0, 3.0), (Dedup::MarkBytes, 43_691.0, 4.0)] {
            let address = TileAddress::OwnLevel;
            let config = Config { dedup, address, compact: Compaction::Append, ..PAPER };
            assert_eq!(rows(config, &own_level), [words, atomics, 60.0]);
        }
        let subgroup = Config { compact: Compaction::Subgroup, ..PAPER };
        let missing = of_stage_3(("subgroup", &subgroup), &triples, &pyramid(), ", own-level");
        assert_eq!((&*missing[1].quantity, missing[1].value.number()), ("atomics, own-level", None));
    }
}
