//! The ruler texture with one kind of error at a time: the check of every texel must detect each.

use ortelius::math::camera::Pose;
use ortelius::math::pyramid::{Pyramid, TileId};
use ortelius::model::mesh;
use ortelius::paper::virtual_texture::ruler::Verdicts;
use ortelius::paper::virtual_texture::streaming::StreamingConfig;
use ortelius::paper::virtual_texture::{Config, ONE_SAMPLE, PAPER, all_needs};
use ortelius::paper::virtual_texture::{VirtualTexture, VirtualTextureSettings};
use ortelius::picture::PixelFormat;
use ortelius::scene::camera::{Camera, GroundPoint};
use ortelius::texture::source::ruler::Ruler;
use ortelius::texture::source::{TileError, TileFormat, TileSource};
use ortelius::vk::{GpuOptions, Watched};
use std::sync::Arc;

/// The ruler with a modification of each tile.
struct Spoilt {
    ruler: Ruler,
    /// Arguments: side of the tile's interior in texels, border, and the tile's bytes.
    spoil: fn(usize, usize, &mut [u8]),
    /// Maps a requested tile to the tile that is read in its place.
    instead: fn(TileId) -> TileId,
}

impl TileSource for Spoilt {
    fn describe(&self) -> String {
        format!("{}, spoilt", self.ruler.describe())
    }
    fn pyramid(&self) -> Pyramid {
        self.ruler.pyramid()
    }
    fn format(&self) -> TileFormat {
        self.ruler.format()
    }
    fn read_tile(&self, tile: TileId, bytes: &mut [u8]) -> Result<(), TileError> {
        self.ruler.read_tile((self.instead)(tile), bytes)?;
        let pyramid = self.pyramid();
        (self.spoil)(pyramid.stored_sides()[0] as usize, pyramid.border_texels() as usize, bytes);
        Ok(())
    }
    fn read_resident_level(&self, level: u32) -> Result<Vec<u8>, TileError> {
        self.ruler.read_resident_level(level)
    }
}

fn pose([tilt_deg, vertical_fov_deg]: [f64; 2]) -> Pose {
    let place = GroundPoint::Planet { latitude_deg: 46.0, longitude_deg: 8.0 };
    Camera {
        place,
        altitude_m: 300e3,
        heading_deg: 0.0,
        tilt_deg,
        vertical_fov_deg,
        magnification: 1.0,
        near_m: None,
    }
    .pose()
}

/// The verdicts on a settled frame of 320 x 180 pixels, straight down on tiles of 64 x 64.
fn verdicts(spoil: fn(usize, usize, &mut [u8]), instead: fn(TileId) -> TileId) -> Verdicts {
    let verdicts = seen(ONE_SAMPLE, [0.0, 45.0], spoil, instead);
    // Straight down from 300 km the ground fills the frame, and no tile is coarse enough for a resident
    // level.
    assert_eq!((verdicts.covered, verdicts.from_g1, verdicts.not_resident), (320 * 180, 0, 0));
    verdicts
}

/// The verdicts from 300 km; `angles_deg` are the camera's tilt and vertical field of view.
fn seen(
    config: Config,
    angles_deg: [f64; 2],
    spoil: fn(usize, usize, &mut [u8]),
    instead: fn(TileId) -> TileId,
) -> Verdicts {
    let gpu = Watched::open(&GpuOptions { needs: &all_needs(), ..GpuOptions::default() });
    let ruler = Ruler::new(Pyramid::new(15, 14, 6, 4, None).unwrap());
    let mesh = mesh::gpu_mesh(&mesh::earth(97, 49));
    let streaming = StreamingConfig { deterministic: true, gpu_tiles: 1024, ..StreamingConfig::default() };
    let settings = VirtualTextureSettings { size: [320, 180], config, streaming, target: PixelFormat::Srgb8 };
    let source = Arc::new(Spoilt { ruler, spoil, instead });
    let mut renderer = VirtualTexture::run(gpu.clone(), source, &mesh, settings).unwrap();
    renderer.settle(&pose(angles_deg)).unwrap();
    renderer.ruler_verdicts().unwrap()
}

/// Flips the lowest bit of red.
fn flip(texels: &mut [u8], side: usize, which: impl Fn(usize, usize) -> bool) {
    for (index, texel) in texels.chunks_exact_mut(4).enumerate() {
        if which(index % side, index / side) {
            texel[0] ^= 1;
        }
    }
}

#[test]
fn an_unspoilt_ruler_has_no_wrong_texel() {
    assert_eq!(verdicts(|_, _, _| {}, |tile| tile).wrong, 0);
}

#[test]
fn a_wrong_bit_in_each_tile_is_detected() {
    // Row 32 of the texels of each tile.
    let wrong = verdicts(
        |side, border, bytes| flip(&mut bytes[..side * side * 4], side, |_, y| y == border + 31),
        |t| t,
    );
    assert!(wrong.wrong > 0 && wrong.wrong < wrong.covered / 4, "{wrong:?}");
}

#[test]
fn a_wrong_border_is_detected() {
    let spoil = |side: usize, border: usize, bytes: &mut [u8]| {
        let outside = |at: usize| at < border || at >= side - border;
        flip(&mut bytes[..side * side * 4], side, |x, y| outside(x) || outside(y));
    };
    let wrong = verdicts(spoil, |tile| tile);
    assert!(wrong.wrong > 0 && wrong.wrong < wrong.covered / 4, "{wrong:?}");
}

/// The outer three of a border's four texels. A sample at the pixel's centre reads at most one texel beyond the
/// payload; samples along the footprint read more. The camera sees the ground at 53 to 80 degrees from its normal,
/// where 2 to 6 samples are taken, and pixels are larger than texels.
#[test]
fn a_wrong_texel_that_only_samples_along_the_footprint_read_is_detected() {
    let spoil = |side: usize, border: usize, bytes: &mut [u8]| {
        let outer = |at: usize| at + 1 < border || at > side - border;
        flip(&mut bytes[..side * side * 4], side, |x, y| outer(x) || outer(y));
    };
    let of = |config, spoil| seen(config, [60.0, 20.0], spoil, |tile| tile);
    let [centre, along] = [ONE_SAMPLE, PAPER].map(|config| of(config, spoil));
    assert!(centre.wrong == 0 && along.wrong > 50 && along.wrong < along.covered / 4, "{along:?}");
    assert_eq!(of(PAPER, |_, _, _| {}).wrong, 0);
}

#[test]
fn a_wrong_coarser_picture_is_detected() {
    let wrong =
        verdicts(|side, _, bytes| flip(&mut bytes[side * side * 4..], side / 2, |_, _| true), |tile| tile);
    assert_eq!(wrong.wrong, wrong.covered);
}

#[test]
fn a_tile_of_another_place_is_detected() {
    let wrong = verdicts(|_, _, _| {}, |tile| TileId { column: tile.column ^ 1, ..tile });
    assert_eq!(wrong.wrong, wrong.covered);
}
