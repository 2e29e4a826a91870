//! Kinds of pictures that would be read wrongly are rejected with the command that converts them.

use super::pictures::{
    dotted, geo_tags, write_png, write_tiff_alpha, write_tiff_grey_alpha, write_tiff_tagged, write_tiff_tiles,
};
use super::*;
use tiff::encoder::{TiffEncoder, colortype};
use tiff::tags::{ExtraSamples, Tag};

/// A TIFF's georeference and sample format are honoured or rejected, never ignored.
#[test]
fn a_tiff_that_is_not_the_whole_globe_is_rejected_with_the_command_that_helps() {
    let folder = tempfile::tempdir().unwrap();
    let (source, output) = (folder.path().join("a.tif"), folder.path().join("a.tiles"));
    let picture = dotted(128, 64);
    let globe = geo_tags([360.0 / 128.0, 180.0 / 64.0], [-180.0, 90.0]);
    let keys = |model: u16, datum: u16| {
        (Tag::GeoKeyDirectoryTag, vec![1, 1, 0, 2, 1024, 0, 1, model, 2048, 0, 1, datum])
    };
    let refused = |doubles: &[(Tag, Vec<f64>)], shorts: &[(Tag, Vec<u16>)], expected: &str| {
        write_tiff_tagged(&source, &picture, doubles, shorts);
        let (code, line) = failure(&bake(&source, &output, &["--tile", "32"]));
        assert!(code == 1 && line.contains(expected), "{expected}: {line}");
        assert!(!output.exists() && leftovers(&output).is_empty(), "{line}");
    };
    let patch = geo_tags([10.0 / 128.0, 10.0 / 64.0], [5.0, 50.0]);
    refused(&patch, &[], "longitudes 5.0000 to 15.0000 and latitudes 40.0000 to 50.0000");
    refused(&patch, &[], "gdalwarp -t_srs EPSG:4326 -te -180 -90 180 90");
    refused(&globe, &[keys(1, 4326)], "projection other than longitude and latitude");
    refused(&globe, &[keys(2, 4267)], "EPSG:4267");
    refused(&[(Tag::ModelTransformationTag, vec![1.0; 16])], &[], "rotated or sheared");
    refused(&globe[..1], &[], "one tie point");
    // One more texel in the west.
    let beside = geo_tags([360.0 / 128.0, 180.0 / 64.0], [-180.0 - 360.0 / 128.0, 90.0]);
    refused(&beside, &[], "longitudes -182.8125");
    refused(&[], &[(Tag::GdalNodata, vec![0])], "no-data value");
    // Near misses that are accepted.
    let whole = [(&globe[..], vec![keys(2, 4326)]), (&[], vec![])];
    for (doubles, shorts) in whole {
        write_tiff_tagged(&source, &picture, doubles, &shorts);
        baked(&source, &output, &["--tile", "32", "--force"]);
    }
}

/// Other kinds that GDAL and satellites produce: JPEG (with YCbCr, as GDAL writes it), other compressions, palettes, 16
/// bits. ZSTD, WebP, bands in planes and grey with alpha are read: see `content.rs`.
#[test]
fn a_tiff_of_a_kind_that_is_not_read_is_rejected_with_the_conversion() {
    let folder = tempfile::tempdir().unwrap();
    let (source, output) = (folder.path().join("a.tif"), folder.path().join("a.tiles"));
    let refused = |expected: [&str; 2]| {
        let (code, line) = failure(&bake(&source, &output, &["--tile", "32"]));
        assert!(code == 1 && expected.iter().all(|words| line.contains(words)), "{expected:?}: {line}");
        assert!(!output.exists() && leftovers(&output).is_empty(), "{line}");
    };
    let deflate = "gdal_translate -co COMPRESS=DEFLATE IN OUT";
    let y_cb_cr = (Tag::PhotometricInterpretation, vec![6]);
    for (tags, name) in [
        (vec![(Tag::Compression, vec![7])], "compression 7 (ModernJPEG)"),
        (vec![(Tag::Compression, vec![7]), y_cb_cr], "compression 7"),
        (vec![(Tag::Compression, vec![34887])], "compression 34887"),
    ] {
        write_tiff_tagged(&source, &dotted(128, 64), &[], &tags);
        refused([name, deflate]);
    }
    let encoder = || TiffEncoder::new(fs::File::create(&source).unwrap()).unwrap();
    let mut open = encoder();
    let mut image = open.new_image::<colortype::Gray8>(128, 64).unwrap();
    image.encoder().write_tag(Tag::PhotometricInterpretation, 3u16).unwrap();
    image.encoder().write_tag(Tag::ColorMap, &[7u16; 768][..]).unwrap();
    image.write_data(&[1; 128 * 64]).unwrap();
    refused(["a palette", "gdal_translate -expand rgb IN OUT"]);
    let byte = "gdal_translate -ot Byte -scale IN OUT";
    encoder().write_image::<colortype::RGB16>(128, 64, &[300; 3 * 128 * 64]).unwrap();
    refused(["RGB(16)", byte]);
    encoder().write_image::<colortype::GrayI8>(128, 64, &[3; 128 * 64]).unwrap();
    refused(["signed", byte]);
}

#[test]
fn a_fourth_band_that_is_not_plain_alpha_is_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let (source, output) = (folder.path().join("a.tif"), folder.path().join("a.tiles"));
    let picture = dotted(128, 64);
    let of = |kind: ExtraSamples| {
        write_tiff_alpha(&source, &picture, kind);
        bake(&source, &output, &["--tile", "32"])
    };
    assert!(failure(&of(ExtraSamples::AssociatedAlpha)).1.contains("premultiplied"));
    assert!(failure(&of(ExtraSamples::Unspecified)).1.contains("not alpha"));
    assert!(of(ExtraSamples::UnassociatedAlpha).status.success());
    write_tiff_grey_alpha(&source, &picture, ExtraSamples::Unspecified);
    assert!(failure(&bake(&source, &output, &["--tile", "32"])).1.contains("not alpha"));
}

#[test]
fn a_tiff_with_missing_tiles_is_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let (source, output) = (folder.path().join("a.tif"), folder.path().join("a.tiles"));
    write_tiff_tiles(&source, &dotted(128, 64), false, 64);
    let mut bytes = fs::read(&source).unwrap();
    // TileByteCounts: the array of lengths, located by its value for two tiles.
    let length = (64 * 64 * 3_u32).to_le_bytes();
    let at = bytes.windows(8).position(|pair| pair[..4] == length && pair[4..] == length).unwrap();
    bytes[at + 4..at + 8].fill(0);
    fs::write(&source, bytes).unwrap();
    let (code, line) = failure(&bake(&source, &output, &["--tile", "32"]));
    assert!(code == 1 && line.contains("SPARSE_OK=FALSE"), "{line}");
}

#[test]
fn a_tiff_with_a_mask_is_rejected_and_one_with_a_smaller_copy_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let (source, output) = (folder.path().join("a.tif"), folder.path().join("a.tiles"));
    let picture = dotted(128, 64);
    // NewSubfileType: 1 is a smaller copy, 4 a mask (TIFF 6.0, section 8).
    for (kind, refused) in [(4_u32, true), (5, true), (1, false)] {
        let mut encoder = TiffEncoder::new(fs::File::create(&source).unwrap()).unwrap();
        encoder.write_image::<colortype::RGB8>(128, 64, &picture.rgb()).unwrap();
        let mut second = encoder.new_image::<colortype::Gray8>(64, 32).unwrap();
        second.encoder().write_tag(Tag::NewSubfileType, kind).unwrap();
        second.write_data(&[255; 64 * 32]).unwrap();
        let ran = bake(&source, &output, &["--tile", "32", "--force"]);
        match refused {
            true => assert!(failure(&ran).1.contains("it has a mask: gdal_translate"), "{kind}: {ran:?}"),
            false => assert!(ran.status.success(), "{kind}: {ran:?}"),
        }
    }
}

/// The orientation of a photograph is in its EXIF data, that of a TIFF in a tag.
#[test]
fn a_rotated_picture_is_rejected_with_the_conversion() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("a.tiles");
    let photograph = include_bytes!("../../scenes/bmng.jpg");
    let plain = folder.path().join("plain.png");
    write_png(&plain, &dotted(128, 64));
    let png = fs::read(&plain).unwrap();
    for orientation in [1_u8, 6] {
        // One entry, the orientation (0x0112).
        let mut exif = b"II\x2a\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0".to_vec();
        exif.extend([orientation, 0, 0, 0, 0, 0, 0, 0]);
        let segment = [b"\xFF\xE1\0\x22Exif\0\0", &exif[..]].concat();
        let mut chunk = Vec::new();
        png_by_hand::chunk(&mut chunk, b"eXIf", &exif);
        let tagged = folder.path().join("a.tif");
        write_tiff_tagged(
            &tagged,
            &dotted(128, 64),
            &[],
            &[(Tag::Orientation, vec![u16::from(orientation)])],
        );
        for (name, bytes) in [
            ("a.jpg", [&photograph[..2], &segment, &photograph[2..]].concat()),
            // Behind the header of 33 bytes, and before the end of 12.
            ("before.png", [&png[..33], &chunk, &png[33..]].concat()),
            ("after.png", [&png[..png.len() - 12], &chunk, &png[png.len() - 12..]].concat()),
            ("a.tif", fs::read(&tagged).unwrap()),
        ] {
            let source = folder.path().join(name);
            fs::write(&source, bytes).unwrap();
            let more: &[&str] = if name == "a.jpg" { &["--dry-run"] } else { &["--tile", "32", "--force"] };
            let ran = bake(&source, &output, more);
            match orientation {
                1 => assert!(ran.status.success(), "{name}: {ran:?}"),
                _ => assert!(failure(&ran).1.contains("magick IN -auto-orient OUT"), "{name}: {ran:?}"),
            }
            assert!(leftovers(&output).is_empty(), "{name}");
        }
    }
}
