//! The next coarser mip level.

use crate::picture::srgb;
use rayon::prelude::*;

/// The level after a level of `size` texels (RGB or RGBA): each texel is the mean of 2 x 2 finer texels in linear
/// light. If a side is odd, its last texel is dropped, as Vulkan's level sizes require. If a side is one texel, that
/// texel counts twice.
pub fn coarser<const N: usize>(finer: &[[u8; N]], size: [u32; 2]) -> Vec<[u8; N]> {
    let table = srgb::table();
    let [width, height] = size.map(|side| side as usize);
    let [columns, rows] = [width, height].map(|side| (side / 2).max(1));
    let texel = |x: usize, y: usize| finer[y.min(height - 1) * width + x.min(width - 1)];
    let mean = |index: usize| {
        let (x, y) = (index % columns * 2, index / columns * 2);
        table.mean_of_four_texels([texel(x, y), texel(x + 1, y), texel(x, y + 1), texel(x + 1, y + 1)])
    };
    (0..columns * rows).into_par_iter().map(mean).collect()
}
