//! The contents of a baked file.

use super::pictures::{
    Picture, dotted, geo_tags, write_png, write_tiff_grey_alpha, write_tiff_strips, write_tiff_tagged,
    write_tiff_tiles,
};
use super::png_by_hand::{self, Raw};
use super::*;
use ortelius::math::pyramid::TileId;
use ortelius::picture::srgb;
use ortelius::texture::source::TileSource;
use ortelius::texture::tiles::TileFile;

/// A level of a baked file, RGBA8, assembled from the tiles' payloads (or from the resident level).
fn level(file: &TileFile, level: u32) -> Picture {
    let pyramid = file.pyramid();
    let [width, height] = pyramid.level_size(level).map(|side| side as usize);
    if level >= pyramid.first_resident_level() {
        return Picture { width, height, rgba: file.read_resident_level(level).unwrap() };
    }
    let mut picture = Picture { width, height, rgba: vec![0; width * height * 4] };
    let (side, border) = (pyramid.tile_size() as usize, pyramid.border_texels() as usize);
    let stored = pyramid.stored_sides()[0] as usize;
    let mut bytes = vec![0; pyramid.tile_bytes_rgba8()];
    let [columns, rows] = pyramid.tile_grid(level);
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        file.read_tile(TileId { level, row, column }, &mut bytes).unwrap();
        for y in 0..side {
            let from = ((y + border) * stored + border) * 4;
            let to = ((row as usize * side + y) * width + column as usize * side) * 4;
            picture.rgba[to..to + side * 4].copy_from_slice(&bytes[from..from + side * 4]);
        }
    }
    picture
}

/// The number of texels of a level that are not the f64 mean of the four of `finer`.
fn texels_that_are_not_means(finer: &Picture, coarser: &Picture) -> usize {
    // The baker computes in units of 2^-24 of linear light and rounds twice. A mean close to the boundary of
    // two codes may round either way. On the linear part of the sRGB curve, the mean of codes 3 and 4 is
    // exactly on this boundary.
    let unit = 2f64.powi(-23);
    let mut wrong = 0;
    for y in 0..coarser.height {
        for x in 0..coarser.width {
            let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(right, low)| {
                finer.texel((2 * x + right).min(finer.width - 1), (2 * y + low).min(finer.height - 1))
            });
            let found = coarser.texel(x, y);
            let colour_is_right = (0..3).all(|channel| {
                let mean = four.iter().map(|texel| srgb::to_linear_f64(texel[channel])).sum::<f64>() / 4.0;
                let range = srgb::from_linear_f64(mean - unit)..=srgb::from_linear_f64(mean + unit);
                range.contains(&found[channel])
            });
            let alpha = four.iter().map(|texel| f64::from(texel[3])).sum::<f64>() / 4.0;
            wrong += usize::from(!colour_is_right || alpha.round() as u8 != found[3]);
        }
    }
    wrong
}

#[test]
fn every_level_is_the_mean_of_four_of_the_files_own_texels() {
    let folder = tempfile::tempdir().unwrap();
    let (source, output) = (folder.path().join("a.png"), folder.path().join("a.tiles"));
    write_png(&source, &dotted(300, 200));
    baked(&source, &output, &["--tile", "32"]);
    let file = TileFile::open(&output).unwrap();
    assert_eq!(file.pyramid().level_size(0), [512, 256]);
    for coarser in 1..=file.pyramid().coarsest_level() {
        let (finer, mut coarser) = (level(&file, coarser - 1), level(&file, coarser));
        assert_eq!(texels_that_are_not_means(&finer, &coarser), 0, "{} x {}", coarser.width, coarser.height);
        // Near misses: a level shifted by a texel is rejected, and so is a level with one texel changed by one code.
        if coarser.width >= 16 {
            coarser.rgba.rotate_left(4);
            assert!(texels_that_are_not_means(&finer, &coarser) > coarser.width * coarser.height / 2);
            coarser.rgba.rotate_right(4);
            coarser.rgba[17] ^= 1;
            assert_eq!(texels_that_are_not_means(&finer, &coarser), 1);
        }
    }
}

#[test]
fn a_picture_that_fits_is_level_0_unchanged_with_neighbouring_texels_as_borders() {
    let folder = tempfile::tempdir().unwrap();
    let (source, output) = (folder.path().join("a.png"), folder.path().join("a.tiles"));
    let picture = dotted(256, 128);
    write_png(&source, &picture);
    baked(&source, &output, &["--tile", "32"]);
    let file = TileFile::open(&output).unwrap();
    let pyramid = file.pyramid();
    assert!(level(&file, 0) == picture);
    let levels: Vec<Picture> = (0..=pyramid.coarsest_level()).map(|number| level(&file, number)).collect();
    let mut bytes = vec![0; pyramid.tile_bytes_rgba8()];
    let mut wrapped_or_mirrored = 0;
    for index in 0..pyramid.tile_count() {
        let tile = file.layout().tile(index);
        file.read_tile(tile, &mut bytes).unwrap();
        let mut texels = bytes.chunks_exact(4);
        for (step, side) in [0, 1].into_iter().zip(pyramid.stored_sides()) {
            let level = &levels[(tile.level + step) as usize];
            let [left, top] = [tile.column, tile.row]
                .map(|at| (i64::from(at) * 32 - i64::from(pyramid.border_texels())) >> step);
            for y in top..top + i64::from(side) {
                for x in left..left + i64::from(side) {
                    // Beyond a pole: the mirrored row, half a turn away. Beyond the date line: the opposite end of the
                    // row.
                    let height = level.height as i64;
                    let beyond = !(0..height).contains(&y);
                    let row = if y < 0 {
                        -1 - y
                    } else if y >= height {
                        2 * height - 1 - y
                    } else {
                        y
                    };
                    let turn = if beyond { level.width as i64 / 2 } else { 0 };
                    let column = (x + turn).rem_euclid(level.width as i64);
                    wrapped_or_mirrored += usize::from(beyond || column != x);
                    let expected = level.texel(column as usize, row as usize);
                    assert_eq!(texels.next(), Some(&expected[..]), "{tile:?} step {step} at {x}, {y}");
                }
            }
        }
    }
    assert!(wrapped_or_mirrored > 1000, "{wrapped_or_mirrored}");
}

/// Longitudes 0 to 360: the eastern half of the file becomes the western half of the texture.
#[test]
fn a_tiff_that_begins_at_greenwich_is_rolled() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let picture = dotted(128, 64);
    let mut rolled = Picture { rgba: picture.rgba.clone(), ..picture };
    for row in rolled.rgba.chunks_exact_mut(4 * 128) {
        row.rotate_left(4 * 64);
    }
    let scale = [360.0 / 128.0, 180.0 / 64.0];
    write_tiff_tagged(&path("east.tif"), &picture, &geo_tags(scale, [0.0, 90.0]), &[]);
    write_tiff_tagged(&path("west.tif"), &rolled, &geo_tags(scale, [-180.0, 90.0]), &[]);
    let [east, west] = ["east", "west"]
        .map(|name| baked(&path(&format!("{name}.tif")), &path(&format!("{name}.tiles")), &["--tile", "32"]));
    assert!(east == west);
}

#[test]
fn png_and_every_kind_of_tiff_of_one_picture_make_the_same_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let mut opaque = dotted(300, 170);
    opaque.rgba.iter_mut().skip(3).step_by(4).for_each(|alpha| *alpha = 255);
    let settings = ["--tile", "32"];
    write_png(&path("rgba.png"), &opaque);
    let expected = baked(&path("rgba.png"), &path("rgba.png.tiles"), &settings);
    for (name, big, side) in [("small.tif", false, 64), ("big.tif", true, 16), ("wide.tif", true, 512)] {
        write_tiff_tiles(&path(name), &opaque, big, side);
        let found = baked(&path(name), &path(&format!("{name}.tiles")), &settings);
        assert!(found == expected, "{name}");
    }
    for (name, compression, rows) in [
        ("plain.tif", tiff::encoder::Compression::Uncompressed, 7),
        ("lzw.tif", tiff::encoder::Compression::Lzw, 300),
        ("deflate.tif", tiff::encoder::Compression::Deflate(Default::default()), 1),
        ("packbits.tif", tiff::encoder::Compression::Packbits, 64),
    ] {
        write_tiff_strips(&path(name), &opaque, compression, rows);
        let found = baked(&path(name), &path(&format!("{name}.tiles")), &settings);
        assert!(found == expected, "{name}");
    }
    // Near miss: one changed texel gives another file.
    opaque.rgba[4 * 12345] ^= 0x40;
    write_png(&path("other.png"), &opaque);
    assert!(baked(&path("other.png"), &path("other.tiles"), &settings) != expected);
}

#[test]
fn the_file_does_not_depend_on_the_number_of_threads_in_either_format() {
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("a.png");
    write_png(&source, &dotted(260, 128));
    for format in ["rgba8", "bc1"] {
        let files: Vec<Vec<u8>> = ["1", "2", "7"]
            .map(|threads| {
                let output = folder.path().join(format!("{format}{threads}.tiles"));
                let mut command = bake_command(&source, &output, &["--tile", "64", "--format", format]);
                assert!(command.env("RAYON_NUM_THREADS", threads).output().unwrap().status.success());
                let verified = ortelius().arg("verify").arg(&output).output().unwrap();
                assert!(verified.status.success());
                fs::read(output).unwrap()
            })
            .to_vec();
        assert!(files[0] == files[1] && files[1] == files[2], "{format}");
    }
}

#[test]
fn a_dry_run_writes_nothing_and_states_the_bytes_that_a_bake_makes() {
    let folder = tempfile::tempdir().unwrap();
    let (source, output) = (folder.path().join("a.png"), folder.path().join("a.tiles"));
    write_png(&source, &dotted(300, 200));
    let dry = bake(&source, &output, &["--tile", "32", "--dry-run"]);
    assert!(dry.status.success());
    assert!(!output.exists() && leftovers(&output).is_empty());
    let written = baked(&source, &output, &["--tile", "32"]).len() as u64;
    assert_eq!(stated(&dry, "output bytes"), written);
    assert_eq!(TileFile::open(&output).unwrap().layout().total_bytes(), written);
}

#[test]
fn grey_palette_and_interlaced_png_mean_the_same_texels() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let (width, height) = (61, 37);
    let settings = ["--tile", "32"];
    let picture = dotted(width, height);
    let grey: Vec<u8> = picture.rgba.iter().copied().skip(1).step_by(4).collect();
    let palette: Vec<[u8; 3]> = (0..=255).map(|index| [255 - index, index, index ^ 0x5A]).collect();
    let bake_raw = |name: &str, colour_type, interlaced, palette: &[[u8; 3]], samples: &[u8]| {
        png_by_hand::write(&path(name), &Raw { width, height, colour_type, interlaced, palette, samples });
        baked(&path(name), &path(&format!("{name}.tiles")), &settings)
    };
    let bake_rgba = |name: &str, texel: &dyn Fn(u8) -> [u8; 4]| {
        let rgba = grey.iter().flat_map(|&grey| texel(grey)).collect();
        write_png(&path(name), &Picture { width, height, rgba });
        baked(&path(name), &path(&format!("{name}.tiles")), &settings)
    };
    write_png(&path("rgba.png"), &picture);
    let expected = baked(&path("rgba.png"), &path("rgba.tiles"), &settings);
    assert!(bake_raw("interlaced.png", 6, true, &[], &picture.rgba) == expected);
    let grey_alpha: Vec<u8> = grey.iter().flat_map(|&grey| [grey, grey / 2]).collect();
    let expected = bake_rgba("grey-rgba.png", &|grey| [grey, grey, grey, 255]);
    assert!(bake_raw("grey.png", 0, false, &[], &grey) == expected);
    let expected = bake_rgba("grey-alpha-rgba.png", &|grey| [grey, grey, grey, grey / 2]);
    assert!(bake_raw("grey-alpha.png", 4, true, &[], &grey_alpha) == expected);
    let expected = bake_rgba("palette-rgba.png", &|index| {
        let [r, g, b] = palette[usize::from(index)];
        [r, g, b, 255]
    });
    assert!(bake_raw("palette.png", 3, false, &palette, &grey) == expected);
}

/// The mean difference in codes of two pictures of one size, the second shifted by some columns.
fn mean_difference(one: &Picture, other: &Picture, columns: usize) -> f64 {
    assert_eq!((one.width, one.height), (other.width, other.height));
    let mut sum = 0.0;
    for y in 0..one.height {
        for x in 0..one.width {
            let (a, b) = (one.texel(x, y), other.texel((x + columns) % one.width, y));
            sum += (0..3).map(|channel| f64::from(a[channel].abs_diff(b[channel]))).sum::<f64>();
        }
    }
    sum / (3 * one.width * one.height) as f64
}

#[test]
fn a_jpeg_enlarged_and_averaged_agrees_with_the_area_averaged_earth_source() {
    let folder = tempfile::tempdir().unwrap();
    let (source, output) = (folder.path().join("bmng.jpg"), folder.path().join("a.tiles"));
    fs::write(&source, &include_bytes!("../../scenes/bmng.jpg")[..]).unwrap();
    baked(&source, &output, &[]);
    let from_jpeg = level(&TileFile::open(&output).unwrap(), 4);
    let output = folder.path().join("earth.tiles");
    baked(Path::new("earth:9"), &output, &["--tile", "64"]);
    let earth = level(&TileFile::open(&output).unwrap(), 0);
    // The filters differ: cubic enlargement and box filters in the baked file, box filters of other sizes in `earth`.
    // That gives at most one code on average. A shift by one column of 512 gives several codes.
    let (here, beside) = (mean_difference(&from_jpeg, &earth, 0), mean_difference(&from_jpeg, &earth, 1));
    println!("{here} codes, {beside} one column off");
    assert!(here < 1.0 && beside > 3.0 * here, "{here}, {beside}");
}

#[test]
fn a_tiff_in_grey_with_alpha_means_the_texels_of_the_png() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let mut picture = dotted(128, 64);
    picture.rgba.chunks_exact_mut(4).for_each(|texel| texel.copy_within(0..1, 1));
    picture.rgba.chunks_exact_mut(4).for_each(|texel| texel.copy_within(0..1, 2));
    write_tiff_grey_alpha(&path("a.tif"), &picture, tiff::tags::ExtraSamples::UnassociatedAlpha);
    write_png(&path("a.png"), &picture);
    let [tiff, png] = ["tif", "png"]
        .map(|kind| baked(&path(&format!("a.{kind}")), &path(&format!("{kind}.tiles")), &["--tile", "32"]));
    assert!(tiff == png);
}

/// The same 20 x 16 texels in strips and tiles, by texel and by plane, in each compression.
#[test]
fn tiffs_of_one_picture_bake_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/corpus/tiff");
    let of = |name: &str| {
        baked(&corpus.join(name), &folder.path().join(name).with_extension("tiles"), &["--tile", "16"])
    };
    let strips = of("strips.tif");
    for name in [
        "tiles-deflate.tif",
        "planes-strips.tif",
        "planes-tiles-deflate.tif",
        "zstd.tif",
        "zstd-planes-tiles.tif",
        "webp.tif",
    ] {
        assert!(of(name) == strips, "{name}");
    }
    assert!(of("packbits-big-endian.tif") != strips, "it has alpha");
}
