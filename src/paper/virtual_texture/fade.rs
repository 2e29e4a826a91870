//! Fade-in of new tiles: optional, not in the paper. The paper shows new tiles immediately, so they pop.
//!
//! id Software blends pages as they arrive (J. M. P. van Waveren, "Software Virtual Textures", 2012). Here a cell of
//! the page table also holds the weight of the next coarser resident tile, which was shown before. The shader also
//! samples the coarser tile, and a third tile if the coarser tile is fading in too. So the picture never jumps, however
//! many levels lie between the tiles. For a tile that is not fading in, the shader samples only that tile.
//!
//! The fade counts frames instead of milliseconds, so the same frames show the same pictures on any machine.

use crate::math::pyramid::TileId;

/// A change for [`super::page_table::PageTable::apply`]: the tile is shown from `slot`. `fade` is the weight of the
/// next coarser tile, in 255ths.
pub fn cell(slot: u32, fade: u8) -> u32 {
    let entry = slot + 1;
    assert!(entry < 1 << 24, "slot {slot} overlaps the bits of the fade");
    u32::from(fade) << 24 | entry
}

/// A tile that is not fully shown yet.
struct Arriving {
    tile: TileId,
    slot: u32,
    /// Number of frames that have shown the tile, this one included.
    shown_frames: u32,
}

/// The tiles that are fading in.
pub struct FadeIn {
    frames: u32,
    arriving: Vec<Arriving>,
}

impl FadeIn {
    /// Creates a fade over `frames` frames: in its n-th frame a tile has the weight `n / (frames + 1)`.
    pub fn new(frames: u32) -> FadeIn {
        FadeIn { frames, arriving: Vec::new() }
    }

    /// Changes the number of frames, also for tiles that are fading in.
    pub fn set_frames(&mut self, frames: u32) {
        self.frames = frames;
    }

    /// Advances by one frame: turns streaming's changes into changes of the page table. If the result has several
    /// changes of a tile, the last one counts.
    pub fn cells(&mut self, changes: &[(TileId, Option<u32>)]) -> Vec<(TileId, u32)> {
        let mut cells = Vec::with_capacity(changes.len() + self.arriving.len());
        for &(tile, slot) in changes {
            self.arriving.retain(|arriving| arriving.tile != tile);
            match slot {
                Some(slot) => self.arriving.push(Arriving { tile, slot, shown_frames: 0 }),
                None => cells.push((tile, 0)),
            }
        }
        let frames = self.frames;
        self.arriving.retain_mut(|arriving| {
            arriving.shown_frames += 1;
            let left = (frames + 1).saturating_sub(arriving.shown_frames);
            // Rounded up, so that a tile counts as fading until its last frame.
            let fade = (255 * left).div_ceil(frames + 1) as u8;
            cells.push((arriving.tile, cell(arriving.slot, fade)));
            left > 0
        });
        cells
    }

    /// True if no tile is fading in.
    pub fn settled(&self) -> bool {
        self.arriving.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TILE: TileId = TileId { level: 2, row: 0, column: 1 };

    #[test]
    fn without_frames_a_tile_is_shown_at_once() {
        let mut fade = FadeIn::new(0);
        assert_eq!(fade.cells(&[(TILE, Some(4))]), [(TILE, 5)]);
        assert!(fade.settled());
        assert_eq!(fade.cells(&[]), []);
    }

    #[test]
    fn a_tile_gains_equal_shares_in_each_frame() {
        let mut fade = FadeIn::new(3);
        let mut left = Vec::new();
        for changes in [&[(TILE, Some(4))][..], &[], &[], &[], &[]] {
            left.extend(fade.cells(changes).iter().map(|&(_, cell)| (cell >> 24, cell & 0xffffff)));
        }
        assert_eq!(left, [(192, 5), (128, 5), (64, 5), (0, 5)]);
        assert!(fade.settled());
    }

    #[test]
    fn a_tile_evicted_while_it_fades_in_is_no_longer_shown() {
        let mut fade = FadeIn::new(3);
        fade.cells(&[(TILE, Some(4))]);
        assert_eq!(fade.cells(&[(TILE, None)]), [(TILE, 0)]);
        assert!(fade.settled());
        // In another slot the fade starts again.
        assert_eq!(fade.cells(&[(TILE, Some(7))]), [(TILE, cell(7, 192))]);
    }

    #[test]
    #[should_panic(expected = "overlaps the bits of the fade")]
    fn a_slot_never_reaches_the_bits_of_the_fade() {
        cell((1 << 24) - 1, 0);
    }
}
