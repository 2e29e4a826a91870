use super::super::checks::{assert_independent_of_threads, differing_texels, print_time, texel, tile};
use super::*;
use crate::picture::srgb;
use xxhash_rust::xxh3::xxh3_64;

fn terrain(width_log2: u32, tile_log2: u32, border_texels: u32) -> Terrain {
    Terrain::new(Pyramid::new(width_log2, width_log2, tile_log2, border_texels, None).unwrap()).unwrap()
}

#[test]
fn a_texel_is_the_same_in_every_tile_border_and_level_that_contains_it() {
    // Levels of 2^12 and 2^11 texels are refined, 2^10 is the base.
    let (large, small) = (terrain(12, 8, 4), terrain(12, 4, 2));
    let id = |level, row, column| TileId { level, row, column };
    for id in [
        id(0, 0, 0),   // over two edges of the map at once
        id(0, 15, 15), // the same in the south-east
        id(0, 7, 9),   // inside
        id(0, 8, 15),  // over the eastern edge alone
        id(1, 3, 4),   // its second picture is the base
        id(2, 0, 3),   // of the base
    ] {
        assert_eq!(differing_texels(&large, &small, id), 0, "{id:?}");
    }
    // Neighbour test: texels of another place must fail.
    assert!(differing_texels(&large, &terrain(13, 4, 2), id(0, 7, 9)) > 100);
}

#[test]
fn a_tile_does_not_depend_on_the_thread_or_on_earlier_tiles() {
    let terrain = terrain(14, 6, 2);
    let ids: Vec<TileId> =
        (0..64).map(|index| TileId { level: index % 5, row: index % 16, column: index * 7 % 16 }).collect();
    assert_independent_of_threads(&terrain, &ids);
}

/// RMS and mean, in codes of green, of a tile's second picture minus the means of four texels of its first picture.
/// The second picture is read `shift` texels further east. Also the RMS of the second picture about its mean.
fn against_means(terrain: &Terrain, [level, row, column]: [u32; 3], shift: usize) -> [f64; 3] {
    let pyramid = terrain.pyramid();
    let [fine, coarse] = pyramid.stored_sides().map(|side| side as usize);
    let bytes = tile(terrain, level, row, column);
    let (finer, coarser) = bytes.split_at(fine * fine * 4);
    let (border, payload) = (pyramid.border_texels() as usize, pyramid.tile_size() as usize / 2);
    let (mut squares, mut sum, mut own, mut own_squares) = (0.0, 0.0, 0.0, 0.0);
    for (x, y) in (0..payload).flat_map(|y| (0..payload - shift).map(move |x| (x, y))) {
        let four = [0, 1, 2, 3].map(|corner| {
            finer[((border + 2 * y + corner / 2) * fine + border + 2 * x + corner % 2) * 4 + 1]
        });
        let parent = coarser[((border / 2 + y) * coarse + border / 2 + x + shift) * 4 + 1];
        let difference = f64::from(parent) - f64::from(srgb::table().mean_of_four(four));
        squares += difference * difference;
        sum += difference;
        own += f64::from(parent);
        own_squares += f64::from(parent).powi(2);
    }
    let count = (payload * (payload - shift)) as f64;
    [(squares / count).sqrt(), sum / count, (own_squares / count - (own / count).powi(2)).max(0.0).sqrt()]
}

#[test]
fn a_level_is_exactly_the_mean_of_the_finer_one_up_to_the_base_and_nearly_beyond() {
    let terrain = terrain(16, 9, 4);
    for id in [[6, 0, 0], [6, 1, 0], [6, 1, 1]] {
        assert_eq!(against_means(&terrain, id, 0)[..2], [0.0, 0.0], "{id:?}");
    }
    // Everest's south-west face, forest, the plateau: all refined levels.
    for level in 0..6 {
        for [row, column] in [[66, 62], [100, 30], [20, 70]] {
            let id = [level, row >> level, column >> level];
            let [rms, mean, own] = against_means(&terrain, id, 0);
            let [shifted, ..] = against_means(&terrain, id, 8);
            println!(
                "{id:?}: rms {rms:.2}, mean {mean:.2} codes of {own:.1}; moved by 8 texels {shifted:.2}"
            );
            // A level adds only detail: a fraction of the existing contrast, and no brightness shift.
            assert!(rms < 0.25 * own + 3.0 && mean.abs() < 2.5, "{id:?}: {rms} {mean}");
            // Neighbour test: another place must differ more.
            assert!(shifted > 1.2 * rms, "{id:?}: {shifted} {rms}");
        }
    }
}

#[test]
fn snow_lies_on_the_summit_forest_in_the_south_and_dry_ground_in_the_north() {
    let terrain = terrain(10, 4, 2);
    let mean = |left: u32, top: u32| {
        let places = (0..1024).map(|n| [left + n % 32, top + n / 32]);
        let texels: Vec<[u8; 4]> = places.map(|place| texel(&terrain, 0, place)).collect();
        [0, 1, 2].map(|n| texels.iter().map(|texel| u32::from(texel[n])).sum::<u32>() / 1024)
    };
    let [red, green, blue] = mean(490, 520);
    assert!(red > 130 && green > 130 && blue > red, "Everest: {red} {green} {blue}");
    let [red, green, blue] = mean(300, 650);
    assert!(green > red && red > blue && green < 90, "forest: {red} {green} {blue}");
    let [red, green, blue] = mean(560, 180);
    assert!(red > green && green > blue, "Tibet: {red} {green} {blue}");
}

#[test]
fn tiles_of_every_kind_are_pinned() {
    let terrain = terrain(16, 9, 4);
    let hash = |level, row, column| xxh3_64(&tile(&terrain, level, row, column));
    let found = [hash(0, 66, 62), hash(0, 0, 127), hash(3, 10, 4), hash(6, 1, 1)];
    let pinned = [0x68e3_9fa1_0808_5aef, 0x1563_88cb_cfa0_5f56, 0xfce9_a17d_d1f8_3265, 0x6865_fd0d_3123_f637];
    assert_eq!(found, pinned, "{found:#x?}");
}

#[test]
fn a_resident_level_beyond_the_base_equals_the_tiles_and_a_map_that_is_not_square_is_refused() {
    let pyramid = Pyramid::new(12, 12, 8, 4, Some(12)).unwrap();
    let (resident, tiled) = (Terrain::new(pyramid).unwrap(), terrain(12, 8, 4));
    let level = resident.read_resident_level(1).unwrap();
    for (x, y) in [(0, 0), (2047, 2047), (64, 63), (1000, 1111), (512, 511)] {
        let at = (y as usize * 2048 + x as usize) * 4;
        assert_eq!(level[at..at + 4], texel(&tiled, 1, [x, y]), "{x} {y}");
    }
    let oblong = Pyramid::new(10, 9, 6, 4, None).unwrap();
    assert_eq!(Terrain::new(oblong).err(), Some(TerrainError(10, 9)));
}

/// Prints the times that the module's documentation states. It asserts nothing.
#[test]
fn the_time_of_a_tile_is_printed() {
    for (place, row, column) in [("Everest", 0.51, 0.49), ("forest", 0.7, 0.3), ("Tibet", 0.2, 0.6)] {
        for width_log2 in [10, 11, 16, 18] {
            let terrain = terrain(width_log2, 9, 4);
            let tiles = f64::from(1u32 << (width_log2 - 9));
            let [row, column] = [row, column].map(|at| (at * tiles) as u32);
            print_time(&format!("{place}, 2^{width_log2}"), &terrain, row, column);
        }
    }
}
