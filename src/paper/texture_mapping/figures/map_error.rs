//! The error of weight maps of every shape, size and precision against the formula, in f64.

use super::lab::Lab;
use super::methods::THESIS;
use crate::figure::{Row, Value};
use crate::math::weight_map::{MapShape, WeightMap};
use crate::paper::texture_mapping::agreement::nmse;
use crate::paper::texture_mapping::method::EllipseFilter;
use crate::paper::texture_mapping::plane::Tilt;

/// NMSE of the f64 picture with a map against the f64 picture by the formula: a number for each map, and a curve along
/// the entries.
pub const MAP_ERROR: &str = "NMSE of a map against the formula, f64";
pub const BY_ENTRIES: &str = "NMSE of maps by entries, f64";

/// NMSE of the thesis's pictures with weight maps against those by the formula.
pub const THESIS_NMSE: f64 = 7.08e-4;

/// Curves are drawn at this tilt only: they hardly depend on the tilt.
const CURVE_TILT: f64 = 60.0;

const ENTRIES: [u32; 4] = [4, 16, 64, 256];

/// The picture is small because every pixel is filtered with 48 maps.
const SIZE: [u32; 2] = [48, 36];

/// A name and the maps of 4 to 256 entries: every shape in 8 and 16 bits, with the nearest entry, and for
/// one-dimensional maps also with interpolation.
fn curves() -> Vec<(String, Vec<WeightMap>)> {
    let mut found = Vec::new();
    let shapes = [
        (MapShape::Square, "2-D map"),
        (MapShape::Quadrant, "quadrant map"),
        (MapShape::Radial, "radial map"),
        (MapShape::SquaredRadius, "r^2 map"),
    ];
    for (shape, name) in shapes {
        for linear in [false, true].into_iter().filter(|linear| shape.is_one_dimensional() || !linear) {
            for bits in [8, 16] {
                let name = format!("{name}, {bits} bits{}", if linear { ", interpolated" } else { "" });
                let map = |entries| WeightMap { shape, entries, bits, linear };
                found.push((name, ENTRIES.map(map).to_vec()));
            }
        }
    }
    found
}

fn name_of(curve: &str, map: &WeightMap) -> String {
    curve.replacen("map", &format!("map of {}", map.entries), 1)
}

/// The names of all curves and of all maps.
pub fn names() -> Vec<String> {
    let curves = curves();
    let maps = curves.iter().flat_map(|(curve, maps)| maps.iter().map(|map| name_of(curve, map)));
    curves.iter().map(|(name, _)| name.clone()).chain(maps).collect()
}

/// All maps of the filter `formula` over a plane tilted by `tilt_degrees`.
pub fn rows(lab: &Lab, formula: &EllipseFilter, tilt_degrees: f64) -> Vec<Row> {
    let plane = Tilt::of(tilt_degrees).plane(SIZE[1]);
    let truth = lab.reference(formula, &plane, SIZE);
    let nmse = |map: &WeightMap| nmse(lab.reference(&formula.map(*map), &plane, SIZE).into_iter(), &truth);
    let mut rows = vec![Row::number(THESIS, MAP_ERROR, "", THESIS_NMSE)];
    if tilt_degrees == CURVE_TILT {
        let flat = ENTRIES.map(|entries| [f64::from(entries), THESIS_NMSE]);
        rows.push(Row::new(THESIS, BY_ENTRIES, "", Value::Series(flat.to_vec())));
    }
    for (curve, maps) in curves() {
        let points: Vec<[f64; 2]> = maps.iter().map(|map| [f64::from(map.entries), nmse(map)]).collect();
        let numbers = maps.iter().zip(&points);
        rows.extend(numbers.map(|(map, [_, nmse])| Row::number(name_of(&curve, map), MAP_ERROR, "", *nmse)));
        if tilt_degrees == CURVE_TILT {
            rows.push(Row::new(curve, BY_ENTRIES, "", Value::Series(points)));
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn maps_have_every_shape_size_and_precision_and_distinct_names() {
        let maps: Vec<WeightMap> = curves().into_iter().flat_map(|(_, maps)| maps).collect();
        assert_eq!(maps.iter().filter(|map| !map.linear).count(), 4 * ENTRIES.len() * 2);
        assert_eq!(maps.iter().filter(|map| map.linear).count(), 2 * ENTRIES.len() * 2);
        let names = names();
        assert_eq!(names.iter().collect::<BTreeSet<_>>().len(), names.len());
        assert!(names.contains(&"radial map of 64, 16 bits, interpolated".to_string()), "{names:?}");
    }
}
