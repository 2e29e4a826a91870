//! The extent of a GeoTIFF on the Earth (OGC 19-008r4, "OGC GeoTIFF Standard", version 1.1, 2019). A texture
//! covers the whole globe in longitude and latitude. Other extents and projections are rejected, with a
//! command that converts them.

use std::io::{Read, Seek};
use tiff::TiffResult;
use tiff::decoder::Decoder;
use tiff::tags::Tag;

/// GeoKeys, by their numbers in the standard.
const MODEL_TYPE: u16 = 1024;
const RASTER_TYPE: u16 = 1025;
const GEOGRAPHIC_TYPE: u16 = 2048;
/// Values of MODEL_TYPE, RASTER_TYPE and GEOGRAPHIC_TYPE.
const GEOGRAPHIC: u16 = 2;
const PIXEL_IS_POINT: u16 = 2;
const WGS_84: u16 = 4326;
const USER_DEFINED: u16 = 32767;

/// The column at 180 degrees west, or the reason to reject the picture. Without georeferencing it is column
/// 0.
pub fn western_column(
    decoder: &mut Decoder<impl Read + Seek>,
    size: [u32; 2],
) -> TiffResult<Result<u32, String>> {
    let helps = "gdalwarp -t_srs EPSG:4326 -te -180 -90 180 90 IN OUT";
    let refused = |what: String| Ok(Err(format!("{what}; a map of the whole globe is needed: {helps}")));
    let keys = decoder.find_tag_unsigned_vec::<u16>(Tag::GeoKeyDirectoryTag)?.unwrap_or_default();
    let mut numbers = |tag| decoder.find_tag(tag)?.map(tiff::decoder::ifd::Value::into_f64_vec).transpose();
    // Header and keys are four numbers each. The last number of a key is its value if the second is 0.
    let key = |wanted: u16| {
        let mut keys = keys.chunks_exact(4).skip(1);
        keys.find(|key| key[0] == wanted && key[1] == 0).map(|key| key[3])
    };
    if let Some(model) = key(MODEL_TYPE).filter(|&model| model != GEOGRAPHIC) {
        return refused(format!(
            "a map in a projection other than longitude and latitude (model type {model})"
        ));
    }
    if let Some(datum) = key(GEOGRAPHIC_TYPE).filter(|datum| ![WGS_84, USER_DEFINED].contains(datum)) {
        return refused(format!("its coordinates are EPSG:{datum}, not EPSG:4326"));
    }
    if numbers(Tag::ModelTransformationTag)?.is_some() {
        return refused("a rotated or sheared map (ModelTransformation)".into());
    }
    let (scale, tie) = (numbers(Tag::ModelPixelScaleTag)?, numbers(Tag::ModelTiepointTag)?);
    let (Some(&[across, down, ..]), Some(&[column, row, _, longitude, latitude, _])) =
        (scale.as_deref(), tie.as_deref())
    else {
        return match scale.is_none() && tie.is_none() {
            true => Ok(Ok(0)),
            false => refused("a map without exactly one scale and one tie point".into()),
        };
    };
    let centre = if key(RASTER_TYPE) == Some(PIXEL_IS_POINT) { 0.5 } else { 0.0 };
    let (west, north) = (longitude - (column + centre) * across, latitude + (row + centre) * down);
    let (wide, high) = (across * f64::from(size[0]), down * f64::from(size[1]));
    // After a shift of up to half a texel, every texel is still the nearest one to its own position.
    let near = |found: f64, wanted: f64, texel: f64| (found - wanted).abs() <= texel.abs() / 2.0;
    let whole = near(north, 90.0, down) && near(wide, 360.0, across) && near(high, 180.0, down);
    match whole {
        true if near(west, -180.0, across) => Ok(Ok(0)),
        true if near(west, 0.0, across) && size[0].is_multiple_of(2) => Ok(Ok(size[0] / 2)),
        _ => refused(format!(
            "a map of longitudes {west:.4} to {:.4} and latitudes {:.4} to {north:.4}",
            west + wide,
            north - high
        )),
    }
}
