//! Read-back, the baseline that paper 1 wants to avoid: the request image is copied to the host, and a pass on the CPU
//! makes the list instead of stages 2 and 3. The list has the same triples, in the order of their first pixels.
//!
//! id Tech 5 and LibVT use a request image with a tenth of the picture's side (J. M. P. van Waveren, "id Tech 5
//! Challenges", SIGGRAPH 2009). Here the whole request image is read; [`super::feedback`] samples fewer pixels.

use super::{RequestFormat, TileAddress, reach};
use crate::math::pyramid::Pyramid;
use crate::vk::{Buffer, BufferUse, Cmd, Error, Gpu, Image, MappedValues, Result, TexelCopy};
use std::collections::{BTreeMap, HashSet};

/// Size limit of the bitmap. With level-0 tile addresses each cell has a bit per level: 8.5 GiB for 2^20 x 2^20 texels
/// in tiles of 16.
const MAX_BITMAP_BYTES: u64 = 1 << 30;

/// The CPU's pass over the request image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HostPass {
    /// Puts every pixel's triple into a hash set.
    Hash,
    /// Keeps a bit for each possible triple, and skips a pixel that equals the previous one.
    Bitmap,
}

/// Host copy of the request image, one per frame in flight.
pub struct HostCopy {
    texels: Buffer,
    size: [u32; 2],
}

impl HostCopy {
    /// # Errors
    /// Out of memory.
    pub fn new(gpu: &Gpu, size: [u32; 2], format: RequestFormat) -> Result<HostCopy> {
        let bytes = format.image_format().bytes(size);
        Ok(HostCopy { texels: gpu.buffer("request image on the host", bytes, BufferUse::Readback)?, size })
    }

    /// Copies the whole of `requests`.
    pub fn run(&self, cmd: &mut Cmd<'_>, requests: &Image) {
        let whole = TexelCopy { offset: 0, mip: 0, layer: 0, at: [0; 2], size: self.size };
        cmd.copy_from_image(requests, &self.texels, &[whole]);
    }

    /// The request image as stored, once the copy's frame has ended.
    pub fn words(&self) -> MappedValues<'_, u32> {
        self.texels.mapped()
    }

    /// Bytes on the host.
    pub fn bytes(&self) -> u64 {
        self.texels.bytes()
    }
}

/// The CPU's pass and its state between frames.
pub struct HostList {
    pass: HostPass,
    address: TileAddress,
    words_per_texel: usize,
    pyramid: Pyramid,
    reaches: bool,
    /// For each level, the index of its first bit and the bits per row.
    levels: Vec<(usize, usize)>,
    /// All zero between passes.
    bits: Vec<u64>,
}

impl HostList {
    /// # Errors
    /// [`Error::Limit`]: a bitmap beyond 1 GiB.
    pub fn new(
        pass: HostPass,
        pyramid: &Pyramid,
        format: RequestFormat,
        address: TileAddress,
    ) -> Result<HostList> {
        let streamed = 0..pyramid.first_resident_level();
        let grid = |level| match address {
            TileAddress::Level0 => pyramid.tile_grid(0),
            TileAddress::OwnLevel => pyramid.tile_grid(level),
        };
        let mut levels = Vec::new();
        let mut end = 0u64;
        for [columns, rows] in streamed.map(grid) {
            levels.push((end as usize, columns as usize));
            end += u64::from(columns) * u64::from(rows);
        }
        let bytes = end.div_ceil(64) * 8;
        if pass == HostPass::Bitmap && bytes > MAX_BITMAP_BYTES {
            let what = format!(
                "a bit for each of {end} triples takes {bytes} bytes, more than {MAX_BITMAP_BYTES}; \
                 use variant.address = \"own-level\" or variant.list = \"host-hash\""
            );
            return Err(Error::Limit { object: "bitmap of triples".into(), what });
        }
        let words = if pass == HostPass::Bitmap { bytes as usize / 8 } else { 0 };
        Ok(HostList {
            pass,
            address,
            words_per_texel: format.words(),
            pyramid: *pyramid,
            reaches: false,
            levels,
            bits: vec![0; words],
        })
    }

    /// `reaches`: true if the request image stores, with each triple, which neighbouring tiles the pixel's filter also
    /// reads ([`reach`]).
    pub fn reaching(self, reaches: bool) -> HostList {
        HostList { reaches, ..self }
    }

    /// Lists each distinct triple of the streamed levels in `requests` once, in the grid of this list's tile addresses.
    pub fn list(&mut self, requests: &[u32]) -> Vec<[u32; 3]> {
        match self.pass {
            HostPass::Hash => self.by_hash(requests),
            HostPass::Bitmap => self.by_bitmap(requests),
        }
    }

    /// The number of pixels that request each triple of the streamed levels, with this list's tile addresses. A pixel
    /// counts for its own tile only, not for the neighbouring tiles that its filter reads.
    pub fn coverage(&self, requests: &[u32]) -> BTreeMap<[u32; 3], u64> {
        let mut pixels = BTreeMap::new();
        for run in requests.chunks_exact(self.words_per_texel).collect::<Vec<_>>().chunk_by(|a, b| a == b) {
            if let Some(triple) = self.triple(run[0]) {
                *pixels.entry(triple).or_default() += run.len() as u64;
            }
        }
        pixels
    }

    /// A texel's triple with (i, j) in level 0's grid, and its reach; `None` if it needs no tile.
    fn decoded(&self, texel: &[u32]) -> Option<([u32; 3], u32)> {
        let (first, reach) = if self.reaches { reach::split(texel[0]) } else { (texel[0], 0) };
        let [column_bits, row_bits] = [self.pyramid.width_log2(), self.pyramid.height_log2()]
            .map(|side| side - self.pyramid.tile_log2());
        let triple = match *texel {
            // The background, all ones, decodes to a q beyond every level. `RequestFormat::fits` ensures this.
            [_] => [
                first >> (row_bits + column_bits),
                first >> column_bits & !(!0 << row_bits),
                first & !(!0 << column_bits),
            ],
            [_, i, j, ..] => [first, i, j],
            _ => unreachable!("the request image has {} words per texel", self.words_per_texel),
        };
        (triple[0] < self.pyramid.first_resident_level()).then_some((triple, reach))
    }

    fn addressed(&self, [q, i, j]: [u32; 3]) -> [u32; 3] {
        match self.address {
            TileAddress::Level0 => [q, i, j],
            TileAddress::OwnLevel => [q, i >> q, j >> q],
        }
    }

    /// The triple of a texel's own tile.
    fn triple(&self, texel: &[u32]) -> Option<[u32; 3]> {
        self.decoded(texel).map(|(triple, _)| self.addressed(triple))
    }

    /// The triples of all tiles that a texel needs.
    fn triples(&self, texel: &[u32]) -> impl Iterator<Item = [u32; 3]> {
        let of =
            |(triple, reach)| [triple].into_iter().chain(reach::neighbours(&self.pyramid, triple, reach));
        self.decoded(texel).into_iter().flat_map(of).map(|triple| self.addressed(triple))
    }

    fn by_hash(&self, requests: &[u32]) -> Vec<[u32; 3]> {
        let mut seen = HashSet::new();
        let triples = requests.chunks_exact(self.words_per_texel).flat_map(|texel| self.triples(texel));
        triples.filter(|triple| seen.insert(*triple)).collect()
    }

    fn by_bitmap(&mut self, requests: &[u32]) -> Vec<[u32; 3]> {
        let mut bits = std::mem::take(&mut self.bits);
        let mut list = Vec::new();
        let mut last: &[u32] = &[];
        for texel in requests.chunks_exact(self.words_per_texel) {
            if texel == last {
                continue;
            }
            last = texel;
            for triple in self.triples(texel) {
                let (word, bit) = self.place(triple);
                if bits[word] & bit == 0 {
                    bits[word] |= bit;
                    list.push(triple);
                }
            }
        }
        // Clears only the words with set bits, which is cheaper than clearing all words.
        for triple in &list {
            let (word, _) = self.place(*triple);
            bits[word] = 0;
        }
        self.bits = bits;
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

    /// A picture with runs, resident levels, background, and the first and last cell.
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

    fn stored(picture: &[[u32; 3]], format: RequestFormat) -> Vec<u32> {
        let store = |&[q, i, j]: &[u32; 3]| match format {
            RequestFormat::Rgb32 => vec![q, i, j],
            RequestFormat::Rgba32 => vec![q, i, j, 0],
            RequestFormat::Packed if q == u32::MAX => vec![u32::MAX],
            RequestFormat::Packed => vec![q << 7 | i << 4 | j],
        };
        picture.iter().flat_map(store).collect()
    }

    #[test]
    fn every_pass_format_and_tile_address_lists_the_reference_tiles_once() {
        let (pyramid, picture) = (pyramid(), picture());
        let tiles = reference::visible_tiles(&picture, &pyramid);
        let triples = reference::distinct_triples(&picture, &pyramid);
        for pass in [HostPass::Hash, HostPass::Bitmap] {
            for &format in RequestFormat::ALL {
                for address in [TileAddress::Level0, TileAddress::OwnLevel] {
                    let what = format!("{pass:?}, {format:?}, {address:?}");
                    let mut host = HostList::new(pass, &pyramid, format, address).unwrap();
                    let list = host.list(&stored(&picture, format));
                    let entries: BTreeSet<_> = list.iter().copied().collect();
                    assert_eq!(entries.len(), list.len(), "{what}: an entry is listed twice");
                    match address {
                        TileAddress::Level0 => assert_eq!(entries, triples, "{what}"),
                        TileAddress::OwnLevel => {
                            let own_level =
                                entries.iter().map(|&[level, row, column]| TileId { level, row, column });
                            assert_eq!(own_level.collect::<BTreeSet<_>>(), tiles, "{what}");
                        }
                    }
                    assert_eq!(host.list(&stored(&picture, format)), list, "{what}: the second pass");
                    assert_eq!(host.list(&[]), [[0; 3]; 0], "{what}: bits of the last pass are left over");
                }
            }
        }
    }

    #[test]
    fn coverage_counts_every_pixel_that_needs_a_tile() {
        let picture = [[0, 1, 2], [0, 1, 2], [1, 1, 2], [0, 1, 2], [u32::MAX; 3], [1, 0, 3], [4, 0, 0]];
        let host =
            HostList::new(HostPass::Hash, &pyramid(), RequestFormat::Packed, TileAddress::OwnLevel).unwrap();
        let expected = BTreeMap::from([([0, 1, 2], 3), ([1, 0, 1], 2)]);
        assert_eq!(host.coverage(&stored(&picture, RequestFormat::Packed)), expected);
    }

    #[test]
    fn a_bitmap_beyond_a_gibibyte_is_refused_with_alternatives() {
        let pyramid = Pyramid::new(20, 20, 4, 0, None).unwrap();
        let of = |pass, address| HostList::new(pass, &pyramid, RequestFormat::Rgba32, address);
        let line = of(HostPass::Bitmap, TileAddress::Level0).err().unwrap().to_string();
        assert!(line.contains("own-level") && line.contains("host-hash"), "{line}");
        assert!(of(HostPass::Bitmap, TileAddress::OwnLevel).is_ok());
        assert!(of(HostPass::Hash, TileAddress::Level0).is_ok());
    }
}
