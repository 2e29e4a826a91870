use super::super::checks::{assert_independent_of_threads, differing_texels, print_time, texel, tile};
use super::*;
use xxhash_rust::xxh3::xxh3_64;

fn earth(width_log2: u32, tile_log2: u32, border_texels: u32) -> Earth {
    let pyramid = Pyramid::new(width_log2, width_log2 - 1, tile_log2, border_texels, None).unwrap();
    Earth::new(pyramid).unwrap()
}

#[test]
fn a_texel_is_the_same_in_every_tile_border_and_level_that_contains_it() {
    // Levels of 2^14 .. 2^12 texels: two synthetic and the finest real one.
    let (large, small) = (earth(14, 9, 4), earth(14, 4, 2));
    let id = |level, row, column| TileId { level, row, column };
    for id in [
        id(0, 0, 0),   // over the pole and the antimeridian at once
        id(0, 15, 31), // the same in the south-east
        id(0, 7, 19),  // inside
        id(1, 7, 0),   // south-west; its second picture is real imagery
        id(2, 0, 7),   // real imagery
    ] {
        assert_eq!(differing_texels(&large, &small, id), 0, "{id:?}");
    }
}

#[test]
fn the_comparison_of_borders_rejects_texels_of_another_place() {
    let (large, small) = (earth(14, 9, 4), earth(15, 4, 2));
    let id = TileId { level: 0, row: 7, column: 19 };
    assert!(differing_texels(&large, &small, id) > 100);
}

#[test]
fn a_tile_does_not_depend_on_the_thread_or_on_earlier_tiles() {
    let earth = earth(16, 6, 2);
    let ids: Vec<TileId> =
        (0..96).map(|index| TileId { level: index % 5, row: index % 32, column: index * 7 % 64 }).collect();
    assert_independent_of_threads(&earth, &ids);
}

/// The largest difference, in codes, between a level's stored texels and the means of the four stored finer ones, over
/// one tile's payload. The coarser texels are read `shift` texels further east.
fn worst_mean(earth: &Earth, level: u32, row: u32, column: u32, shift: usize) -> u8 {
    let pyramid = earth.pyramid();
    let [fine, coarse] = pyramid.stored_sides().map(|side| side as usize);
    let bytes = tile(earth, level, row, column);
    let (finer, coarser) = bytes.split_at(fine * fine * 4);
    let (border, half) = (pyramid.border_texels() as usize, pyramid.border_texels() as usize / 2);
    let payload = pyramid.tile_size() as usize / 2;
    let mut worst = 0;
    for y in 0..payload {
        for x in 0..payload - shift {
            for channel in 0..3 {
                let four = [0, 1, 2, 3].map(|corner| {
                    let (x, y) = (border + 2 * x + corner % 2, border + 2 * y + corner / 2);
                    finer[(y * fine + x) * 4 + channel]
                });
                let parent = coarser[((half + y) * coarse + half + x + shift) * 4 + channel];
                worst = worst.max(srgb::table().mean_of_four(four).abs_diff(parent));
            }
        }
    }
    worst
}

#[test]
fn the_mean_of_four_is_the_coarser_texel_exactly_if_real_and_within_one_code_if_synthetic() {
    let earth = earth(18, 9, 4);
    assert_eq!(earth.finest_real_level(), 6);
    for (level, row, column) in [(0, 77, 140), (0, 0, 0), (0, 130, 280), (3, 10, 40), (5, 3, 9), (5, 7, 2)] {
        let worst = worst_mean(&earth, level, row, column, 0);
        assert!(worst <= 1, "level {level}, row {row}, column {column}: {worst}");
    }
    for (level, row, column) in [(6, 0, 0), (6, 1, 5), (7, 1, 3), (8, 0, 1)] {
        assert_eq!(worst_mean(&earth, level, row, column, 0), 0, "level {level}");
    }
    // Neighbour test: the texel next to the parent must fail.
    for (level, row, column) in [(0, 77, 280), (3, 10, 40), (6, 1, 5)] {
        assert!(worst_mean(&earth, level, row, column, 1) > 1, "the neighbour passes, too: level {level}");
    }
}

/// The relative texel-to-texel variation of a level's luminance, in a square of 1/32 of the Earth's width (11.25
/// degrees): the square of the mean of sqrt |Haar coefficient / mean|, in f64.
fn band_strength(base: &EarthBase, width_log2: u32, x_32nds: i64, y_32nds: i64) -> f64 {
    let side = 1usize << (width_log2 - 5);
    let [left, top] = [x_32nds, y_32nds].map(|at| at * side as i64);
    let (region, _) = refine::region(base, width_log2, (left, top, side, side));
    let mut roots = 0.0;
    for y in (0..side).step_by(2) {
        let rows = [0, 1].map(|row| region.row(left, top + (y + row) as i64));
        for x in (0..side).step_by(2) {
            let [nw, ne, sw, se] = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(row, side)| {
                let [r, g, b] = rows[row][x + side].map(f64::from);
                0.2126 * r + 0.7152 * g + 0.0722 * b
            });
            let differences = [ne + se - nw - sw, sw + se - nw - ne, nw + se - ne - sw];
            let root = |difference: f64| (difference / (nw + ne + sw + se)).abs().sqrt();
            roots += differences.map(root).iter().sum::<f64>();
        }
    }
    (roots / (side as f64 / 2.0).powi(2) / 3.0).powi(2)
}

#[test]
fn synthetic_octaves_on_land_are_about_as_strong_as_the_finest_real_one() {
    let base = base::base().unwrap();
    // Sahara, Andes, India, Australia: column and row of a square, counted from the north-west corner.
    for (x, y) in [(17, 6), (10, 9), (22, 6), (28, 10)] {
        let real = band_strength(base, 12, x, y);
        let ratios = [13, 14, 15].map(|width_log2| band_strength(base, width_log2, x, y) / real);
        let coarser = [10, 11].map(|width_log2| band_strength(base, width_log2, x, y) / real);
        println!("square {x}, {y}: {coarser:.2?}, {real:.4}, then times {ratios:.2?}");
        assert!(ratios.iter().all(|ratio| (0.8..1.25).contains(ratio)), "{x} {y}: {ratios:?}");
    }
}

#[test]
fn tiles_of_every_kind_are_pinned() {
    let earth = earth(18, 9, 4);
    let hash = |level, row, column| xxh3_64(&tile(&earth, level, row, column));
    let found =
        [hash(0, 77, 140), hash(0, 0, 511), hash(0, 255, 0), hash(3, 10, 40), hash(6, 1, 5), hash(8, 0, 0)];
    let pinned = [
        0xc934_8b50_5290_29ee,
        0xa4d7_030f_609f_186f,
        0xcb7f_f459_5de0_5ae9,
        0xf9ac_b074_eabb_eb27,
        0xc337_1d88_2ae6_850d,
        0xf207_4b2f_aee2_a551,
    ];
    assert_eq!(found, pinned, "{found:#x?}");
}

#[test]
fn a_small_earth_is_only_imagery_and_a_map_of_another_shape_is_refused() {
    let small = earth(9, 6, 4);
    assert_eq!(small.finest_real_level(), 0);
    assert_eq!(small.read_resident_level(9).unwrap().len(), 4);
    let square = Pyramid::new(9, 9, 6, 4, None).unwrap();
    assert_eq!(Earth::new(square).err(), Some(EarthError::Shape(9, 9)));
}

#[test]
fn a_resident_level_in_the_synthetic_part_equals_the_tiles() {
    let pyramid = Pyramid::new(14, 13, 9, 4, Some(14)).unwrap();
    let (resident, tiled) = (Earth::new(pyramid).unwrap(), earth(14, 9, 4));
    let level = resident.read_resident_level(1).unwrap();
    for (x, y) in [(0, 0), (8191, 4095), (511, 512), (4000, 1111), (512, 511)] {
        let at = (y as usize * 8192 + x as usize) * 4;
        assert_eq!(level[at..at + 4], texel(&tiled, 1, [x, y]), "{x} {y}");
    }
}

/// Mean differences between adjacent columns (axis 0) or rows (axis 1) in a square of 64 x 64 texels of the level
/// `2^width_log2` wide. Returns three values: the difference across the middle line of the square, the largest one
/// elsewhere, and the one across the middle line after the far half is shifted by 21 texels along the line.
fn steps(width_log2: u32, axis: usize, [left, top]: [i64; 2]) -> [f64; 3] {
    let (region, _) = refine::region(base::base().unwrap(), width_log2, (left, top, 64, 64));
    let texel = |x: i64, y: i64| region.row(left + x, top + y)[0][1];
    let step = |at: i64, moved: i64| -> f64 {
        let steps = (0..64).map(|along| match axis {
            0 => texel(at, along).abs_diff(texel(at + 1, (along + moved) % 64)),
            _ => texel(along, at).abs_diff(texel((along + moved) % 64, at + 1)),
        });
        steps.map(f64::from).sum::<f64>() / 64.0
    };
    let max = (8..56).filter(|&at| at != 31).map(|at| step(at, 0)).fold(0.0, f64::max);
    [step(31, 0), max, step(31, 21)]
}

#[test]
fn neither_the_antimeridian_nor_a_pole_has_a_visible_seam() {
    // Kamchatka's latitude; the Arctic Ocean; Antarctica. A level of 2^14 texels, 4 x 4 for each texel of
    // the imagery.
    for (axis, left, top) in [(0, -32, 1100), (1, 5000, -32), (1, 9000, 8192 - 32)] {
        let [edge, max, torn] = steps(14, axis, [left, top]);
        // The imagery's own difference at that edge. Synthetic detail keeps the imagery's means, and Antarctica's snow
        // is nearly white, so the detail has little room to smooth the edge.
        let real = match axis {
            0 => steps(12, axis, [-32, top / 4]),
            _ => steps(12, axis, [left / 4, if top < 0 { -32 } else { 2048 - 32 }]),
        };
        let allowed = (1.1 * max).max(real[0]);
        println!("axis {axis} at {left}, {top}: {edge}, most elsewhere {max}, torn {torn}, imagery {real:?}");
        // The difference across the edge may not exceed those around it, or the imagery's own.
        assert!(edge <= allowed, "axis {axis} at {left}, {top}: {edge}, allowed {allowed}");
        // Neighbour test: a shifted edge must fail. At a pole the 64 columns meet in almost one point, so every shift
        // fits.
        assert!(axis == 1 || torn > allowed, "axis {axis} at {left}, {top}: torn {torn}, allowed {allowed}");
    }
}

/// Prints the times that the module's documentation states. It asserts nothing.
#[test]
fn the_time_of_a_tile_is_printed() {
    // Tibet and Alaska. 2^12 is imagery; the others are 1, 6 and 8 octaves finer.
    for (place, [longitude, latitude]) in [("Tibet", [87.0, 31.0]), ("Alaska", [-150.0, 65.0])] {
        for width_log2 in [12, 13, 18, 20] {
            let earth = earth(width_log2, 9, 4);
            let tiles = f64::from(1u32 << (width_log2 - 9));
            let column = ((longitude + 180.0) / 360.0 * tiles) as u32;
            let row = ((90.0 - latitude) / 360.0 * tiles) as u32;
            print_time(&format!("{place}, 2^{width_log2}"), &earth, row, column);
        }
    }
}
