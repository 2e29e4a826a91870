//! Fade-in of tiles that arrive, which the paper has not: it shows them at once, and they pop.
//!
//! id Software's remedy ("Software Virtual Textures", 2012) is to blend pages as they come. Here a cell of the display
//! table also says which share of the picture still belongs to what was shown before, the next coarser tile in `J1`;
//! the shader goes on to that one, and to a third where that one is fading too. So the picture never jumps, however
//! many levels lie between a tile and its stand-in, and where nothing fades one sample is taken as before.
//! Frames are counted, not milliseconds: the same frames show the same pictures on any machine.

use crate::math::pyramid::TileId;

/// The display table's cell of a tile in `slot`: `fade` (255: all) of the picture is still the next coarser tile's.
pub fn cell(slot: u32, fade: u8) -> u32 {
    let entry = slot + 1;
    assert!(entry < 1 << 24, "slot {slot} has no room beside the fade");
    u32::from(fade) << 24 | entry
}

/// A tile that is not fully shown yet.
struct Arriving {
    tile: TileId,
    slot: u32,
    /// Frames that have shown it, this one included.
    shown_frames: u32,
}

/// The tiles that are fading in.
pub struct FadeIn {
    frames: u32,
    arriving: Vec<Arriving>,
}

impl FadeIn {
    /// A tile has `n / (frames + 1)` of the picture in its n-th frame.
    pub fn new(frames: u32) -> FadeIn {
        FadeIn { frames, arriving: Vec::new() }
    }

    /// Fades over another number of frames from now on, also those that are under way.
    pub fn set_frames(&mut self, frames: u32) {
        self.frames = frames;
    }

    /// Steps by a frame: from the frame's changes of the display, as streaming reports them, to the cells that are to
    /// be written, the last word about a tile last.
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
            // Rounded up: a tile that is still arriving never counts as there.
            let fade = (255 * left).div_ceil(frames + 1) as u8;
            cells.push((arriving.tile, cell(arriving.slot, fade)));
            left > 0
        });
        cells
    }

    /// Whether every tile is shown in full.
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
    fn a_tile_that_leaves_while_it_arrives_is_not_shown_any_more() {
        let mut fade = FadeIn::new(3);
        fade.cells(&[(TILE, Some(4))]);
        assert_eq!(fade.cells(&[(TILE, None)]), [(TILE, 0)]);
        assert!(fade.settled());
        // In another slot it begins anew.
        assert_eq!(fade.cells(&[(TILE, Some(7))]), [(TILE, cell(7, 192))]);
    }

    #[test]
    #[should_panic(expected = "no room beside the fade")]
    fn a_slot_never_reaches_the_bits_of_the_fade() {
        cell((1 << 24) - 1, 0);
    }
}
