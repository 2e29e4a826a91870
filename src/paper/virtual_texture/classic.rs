//! The classic instead of stages 2 and 3: `U1` is copied to the host, and a pass of the processor makes the list.
//! What paper 1 sets out to avoid, and the truth that its list is measured against: the same list, in order of first
//! pixels.
//!
//! id's and LibVT's systems do it with a `U1` of a tenth of the picture's side (van Waveren, "id Tech 5 Challenges",
//! 2009); here all of `U1` is read, and [`super::feedback`] is the one that looks at fewer pixels.

use super::{Keying, U1Format};
use crate::math::pyramid::Pyramid;
use crate::vk::{Buffer, BufferUse, Cmd, Error, Gpu, Image, Result, TexelCopy};
use std::collections::{BTreeMap, HashSet};

/// Most bytes of a bitmap: paper keying needs a bit for each level of each cell, 8 GiB at 2^20 in tiles of 16.
const MOST_BITMAP_BYTES: u64 = 1 << 30;

/// The processor's pass over `U1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HostPass {
    /// Every pixel's triple into a hash set.
    Hash,
    /// A bit for each triple that can be, and a memo: a pixel like the one before is skipped.
    Bitmap,
}

/// `U1` where the host reads it; one for each frame in flight.
pub struct HostCopy {
    texels: Buffer,
    size: [u32; 2],
}

impl HostCopy {
    /// # Errors
    /// Out of memory.
    pub fn new(gpu: &Gpu, size: [u32; 2], format: U1Format) -> Result<HostCopy> {
        let bytes = format.image_format().bytes(size);
        Ok(HostCopy { texels: gpu.buffer("U1 on the host", bytes, BufferUse::Readback)?, size })
    }

    /// Copies all of `u1`.
    pub fn run(&self, cmd: &mut Cmd<'_>, u1: &Image) {
        let whole = TexelCopy { offset: 0, mip: 0, layer: 0, at: [0; 2], size: self.size };
        cmd.copy_from_image(u1, &self.texels, &[whole]);
    }

    /// `U1` as stored, once the copy's frame has ended.
    pub fn words(&self) -> &[u32] {
        bytemuck::cast_slice(self.texels.mapped())
    }

    /// Bytes on the host.
    pub fn bytes(&self) -> u64 {
        self.texels.bytes()
    }
}

/// The host's pass and what it keeps from frame to frame.
pub struct HostList {
    pass: HostPass,
    keying: Keying,
    words_per_texel: usize,
    grid_log2: [u32; 2],
    first_resident_level: u32,
    /// Where each level's bits begin, and how many of them are a row.
    levels: Vec<(usize, usize)>,
    /// All zero between two passes.
    bits: Vec<u64>,
}

impl HostList {
    /// # Errors
    /// [`Error::Limit`]: a bitmap beyond 1 GiB.
    pub fn new(pass: HostPass, pyramid: &Pyramid, format: U1Format, keying: Keying) -> Result<HostList> {
        let streamed = 0..pyramid.first_resident_level();
        let grid = |level| match keying {
            Keying::Paper => pyramid.tile_grid(0),
            Keying::Native => pyramid.tile_grid(level),
        };
        let mut levels = Vec::new();
        let mut end = 0u64;
        for [columns, rows] in streamed.map(grid) {
            levels.push((end as usize, columns as usize));
            end += u64::from(columns) * u64::from(rows);
        }
        let bytes = end.div_ceil(64) * 8;
        if pass == HostPass::Bitmap && bytes > MOST_BITMAP_BYTES {
            let what = format!(
                "a bit for each of {end} triples is {bytes} bytes, at most {MOST_BITMAP_BYTES} are taken: \
                 variant.keying = \"native\" has the fewest, or use variant.list = \"host-hash\""
            );
            return Err(Error::Limit { object: "bitmap of triples".into(), what });
        }
        let words = if pass == HostPass::Bitmap { bytes as usize / 8 } else { 0 };
        Ok(HostList {
            pass,
            keying,
            words_per_texel: format.words(),
            grid_log2: [
                pyramid.width_log2() - pyramid.tile_log2(),
                pyramid.height_log2() - pyramid.tile_log2(),
            ],
            first_resident_level: pyramid.first_resident_level(),
            levels,
            bits: vec![0; words],
        })
    }

    /// Each distinct triple of `u1`'s streamed levels once, in the keying's grid.
    pub fn list(&mut self, u1: &[u32]) -> Vec<[u32; 3]> {
        match self.pass {
            HostPass::Hash => self.by_hash(u1),
            HostPass::Bitmap => self.by_bitmap(u1),
        }
    }

    /// How many pixels name each triple of the streamed levels, in the keying's grid.
    pub fn coverage(&self, u1: &[u32]) -> BTreeMap<[u32; 3], u64> {
        let mut pixels = BTreeMap::new();
        for run in u1.chunks_exact(self.words_per_texel).collect::<Vec<_>>().chunk_by(|a, b| a == b) {
            if let Some(triple) = self.triple(run[0]) {
                *pixels.entry(triple).or_default() += run.len() as u64;
            }
        }
        pixels
    }

    /// A texel's triple; `None` where it needs no tile.
    fn triple(&self, texel: &[u32]) -> Option<[u32; 3]> {
        let [column_bits, row_bits] = self.grid_log2;
        let [q, i, j] = match *texel {
            // All ones, the background, has a q beyond every level too: `U1Format::fits` sees to it.
            [word] => [
                word >> (row_bits + column_bits),
                word >> column_bits & !(!0 << row_bits),
                word & !(!0 << column_bits),
            ],
            [q, i, j, ..] => [q, i, j],
            _ => unreachable!("U1 has {} words a texel", self.words_per_texel),
        };
        let streamed = q < self.first_resident_level;
        streamed.then(|| match self.keying {
            Keying::Paper => [q, i, j],
            Keying::Native => [q, i >> q, j >> q],
        })
    }

    fn by_hash(&self, u1: &[u32]) -> Vec<[u32; 3]> {
        let mut seen = HashSet::new();
        let triples = u1.chunks_exact(self.words_per_texel).filter_map(|texel| self.triple(texel));
        triples.filter(|triple| seen.insert(*triple)).collect()
    }

    fn by_bitmap(&mut self, u1: &[u32]) -> Vec<[u32; 3]> {
        let mut list = Vec::new();
        let mut last: &[u32] = &[];
        for texel in u1.chunks_exact(self.words_per_texel) {
            if texel == last {
                continue;
            }
            last = texel;
            let Some(triple) = self.triple(texel) else { continue };
            let (word, bit) = self.place(triple);
            if self.bits[word] & bit == 0 {
                self.bits[word] |= bit;
                list.push(triple);
            }
        }
        // The list names every bit that was set: cheaper than clearing them all.
        for triple in &list {
            let (word, _) = self.place(*triple);
            self.bits[word] = 0;
        }
        list
    }

    fn place(&self, [q, i, j]: [u32; 3]) -> (usize, u64) {
        let (first, columns) = self.levels[q as usize];
        let bit = first + i as usize * columns + j as usize;
        (bit / 64, 1 << (bit % 64))
    }
}

#[cfg(test)]
mod tests {
    use super::super::reference;
    use super::*;
    use crate::math::pyramid::TileId;
    use std::collections::BTreeSet;

    /// Streamed levels 0 ..= 3, a grid of 16 x 8.
    fn pyramid() -> Pyramid {
        Pyramid::new(8, 7, 4, 2, None).expect("a small one")
    }

    /// A picture with runs, G1, background and the first and last cell.
    fn picture() -> Vec<[u32; 3]> {
        let mut state = 1u32;
        let mut next = |below: u32| {
            state = state.wrapping_mul(0x915f_77f5).wrapping_add(0x9e37_79b9);
            (state >> 16) % below
        };
        let mut picture = vec![[0, 0, 0], [3, 7, 15], [4, 0, 0]];
        while picture.len() < 3000 {
            let triple = match next(8) {
                0 => [u32::MAX; 3],
                q => [q % 5, next(8), next(16)],
            };
            picture.extend(std::iter::repeat_n(triple, 1 + next(4) as usize));
        }
        picture
    }

    fn stored(picture: &[[u32; 3]], format: U1Format) -> Vec<u32> {
        let store = |&[q, i, j]: &[u32; 3]| match format {
            U1Format::Rgb32 => vec![q, i, j],
            U1Format::Rgba32 => vec![q, i, j, 0],
            U1Format::Packed if q == u32::MAX => vec![u32::MAX],
            U1Format::Packed => vec![q << 7 | i << 4 | j],
        };
        picture.iter().flat_map(store).collect()
    }

    #[test]
    fn every_pass_format_and_keying_lists_the_reference_set_once() {
        let (pyramid, picture) = (pyramid(), picture());
        let tiles = reference::visible_tiles(&picture, &pyramid);
        let triples = reference::distinct_triples(&picture, &pyramid);
        for pass in [HostPass::Hash, HostPass::Bitmap] {
            for &format in U1Format::ALL {
                for keying in [Keying::Paper, Keying::Native] {
                    let what = format!("{pass:?}, {format:?}, {keying:?}");
                    let mut host = HostList::new(pass, &pyramid, format, keying).unwrap();
                    let list = host.list(&stored(&picture, format));
                    let entries: BTreeSet<_> = list.iter().copied().collect();
                    assert_eq!(entries.len(), list.len(), "{what}: an entry twice");
                    match keying {
                        Keying::Paper => assert_eq!(entries, triples, "{what}"),
                        Keying::Native => {
                            let native =
                                entries.iter().map(|&[level, row, column]| TileId { level, row, column });
                            assert_eq!(native.collect::<BTreeSet<_>>(), tiles, "{what}");
                        }
                    }
                    assert_eq!(host.list(&stored(&picture, format)), list, "{what}: again");
                    assert_eq!(host.list(&[]), [[0; 3]; 0], "{what}: nothing is left over");
                }
            }
        }
    }

    #[test]
    fn coverage_counts_every_pixel_that_needs_a_tile() {
        let picture = [[0, 1, 2], [0, 1, 2], [1, 1, 2], [0, 1, 2], [u32::MAX; 3], [1, 0, 3], [4, 0, 0]];
        let host = HostList::new(HostPass::Hash, &pyramid(), U1Format::Packed, Keying::Native).unwrap();
        let expected = BTreeMap::from([([0, 1, 2], 3), ([1, 0, 1], 2)]);
        assert_eq!(host.coverage(&stored(&picture, U1Format::Packed)), expected);
    }

    #[test]
    fn a_bitmap_beyond_a_gibibyte_is_refused_with_the_ways_out() {
        let pyramid = Pyramid::new(20, 20, 4, 0, None).unwrap();
        let of = |pass, keying| HostList::new(pass, &pyramid, U1Format::Rgba32, keying);
        let line = of(HostPass::Bitmap, Keying::Paper).err().unwrap().to_string();
        assert!(line.contains("native") && line.contains("host-hash"), "{line}");
        assert!(of(HostPass::Bitmap, Keying::Native).is_ok());
        assert!(of(HostPass::Hash, Keying::Paper).is_ok());
    }
}
