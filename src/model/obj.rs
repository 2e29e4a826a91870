//! Wavefront OBJ: `v`, `vt`, `vn` and `f`; polygons become fans. Everything else (groups, materials, lines, points)
//! is skipped. Numbers are read as f64: in f32 a scan in map coordinates would lose its shape.

use super::error::ModelFault;
use super::raw::{MAX_ITEMS, Raw};
use std::collections::HashMap;

/// Reads the text of an OBJ file.
///
/// # Errors
/// [`ModelFault`] with the line number.
pub(super) fn read(text: &[u8]) -> Result<Raw, ModelFault> {
    let mut reader = Reader::default();
    let mut continued: Vec<u8> = Vec::new();
    let mut first_line = 1;
    for (index, line) in text.split(|&byte| byte == b'\n').enumerate() {
        if continued.is_empty() {
            first_line = index + 1;
        }
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        if let Some(start) = line.strip_suffix(b"\\") {
            continued.extend_from_slice(start);
            // The space separates words, and keeps `continued` from being empty if `start` is.
            continued.push(b' ');
        } else if continued.is_empty() {
            reader.line(line).map_err(|what| ModelFault::line(first_line, what))?;
        } else {
            continued.extend_from_slice(line);
            reader.line(&continued).map_err(|what| ModelFault::line(first_line, what))?;
            continued.clear();
        }
    }
    if !continued.is_empty() {
        reader.line(&continued).map_err(|what| ModelFault::line(first_line, what))?;
    }
    Ok(reader.finish())
}

/// Indices of `vt` and `vn`, if any.
type Extra = [Option<u32>; 2];

#[derive(Default)]
struct Reader {
    /// One vertex for each `v`, and an additional one for each further combination of `vt` and `vn` with this `v`.
    raw: Raw,
    /// Number of `v` lines so far.
    places: usize,
    coordinates: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    /// For each vertex, its `vt` and `vn`, once a face has used it.
    extras: Vec<Option<Extra>>,
    /// Additional vertices for further `vt` and `vn` of a `v`.
    further: HashMap<(u32, Extra), u32>,
    has: [bool; 2],
}

impl Reader {
    fn line(&mut self, line: &[u8]) -> Result<(), String> {
        let words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let mut words = words.take_while(|word| word[0] != b'#');
        match words.next() {
            Some(b"v") => self.vertex(&numbers(words)?),
            Some(b"vt") => match *numbers(words)? {
                [s] => keep(&mut self.coordinates, [s as f32, 1.0]),
                // In OBJ files v = 0 is the picture's lower edge, here t = 0 is the upper one.
                [s, v, ..] => keep(&mut self.coordinates, [s as f32, (1.0 - v) as f32]),
                [] => Err("vt without numbers".into()),
            },
            Some(b"vn") => match *numbers(words)? {
                [x, y, z, ..] => keep(&mut self.normals, [x as f32, y as f32, z as f32]),
                _ => Err("vn needs three numbers".into()),
            },
            Some(b"f") => self.face(words),
            _ => Ok(()),
        }
    }

    fn vertex(&mut self, numbers: &[f64]) -> Result<(), String> {
        let (&[x, y, z], rest) = numbers.split_first_chunk().ok_or("v needs three numbers")?;
        keep(&mut self.raw.positions, glam::DVec3::new(x, y, z))?;
        self.places += 1;
        self.extras.push(None);
        // A colour, as scanners write it. A number before the colour, or a single number, is a weight: skipped.
        if let [red, green, blue] | [_, red, green, blue] = *rest {
            let channel = |value: f64| (value.clamp(0.0, 1.0) * 255.0).round() as u8;
            self.raw.attributes.colors.resize(self.places - 1, [255; 4]);
            self.raw.attributes.colors.push([channel(red), channel(green), channel(blue), 255]);
        }
        Ok(())
    }

    fn face<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>) -> Result<(), String> {
        let mut first = None;
        let mut last = None;
        let mut corners = 0;
        for word in words {
            let corner = self.corner(word)?;
            corners += 1;
            if let (Some(first), Some(last)) = (first, last) {
                keep(&mut self.raw.faces, [first, last, corner])?;
            }
            if first.is_none() {
                first = Some(corner);
            } else {
                last = Some(corner);
            }
        }
        if corners < 3 { Err(format!("a face of {corners} corners")) } else { Ok(()) }
    }

    /// The vertex of `v`, `v/vt`, `v//vn` or `v/vt/vn`. Additional vertices carry [`FURTHER`] until all `v` are
    /// known.
    fn corner(&mut self, word: &[u8]) -> Result<u32, String> {
        let mut parts = word.split(|&byte| byte == b'/');
        let mut index = |count: usize| match parts.next() {
            None | Some(b"") => Ok(None),
            Some(part) => resolve(part, count).map(Some),
        };
        let place = index(self.places)?.ok_or("a corner has no vertex")?;
        let extra = [index(self.coordinates.len())?, index(self.normals.len())?];
        self.has = [self.has[0] || extra[0].is_some(), self.has[1] || extra[1].is_some()];
        let first = self.extras[place as usize].get_or_insert(extra);
        if *first == extra {
            return Ok(place);
        }
        let next = self.further.len() as u32;
        if next as usize >= MAX_ITEMS {
            return Err(format!("more than {MAX_ITEMS} vertices"));
        }
        Ok(FURTHER | *self.further.entry((place, extra)).or_insert(next))
    }

    fn finish(self) -> Raw {
        let Self { mut raw, places, coordinates, normals, mut extras, further, has } = self;
        let mut made: Vec<(u32, (u32, Extra))> = further.into_iter().map(|(key, made)| (made, key)).collect();
        made.sort_unstable();
        if !raw.attributes.colors.is_empty() {
            raw.attributes.colors.resize(places, [255; 4]);
        }
        for (_, (place, extra)) in made {
            raw.positions.push(raw.positions[place as usize]);
            extras.push(Some(extra));
            if let Some(&color) = raw.attributes.colors.get(place as usize) {
                raw.attributes.colors.push(color);
            }
        }
        for corner in raw.faces.as_flattened_mut() {
            if *corner & FURTHER != 0 {
                *corner = (*corner & !FURTHER) + places as u32;
            }
        }
        // If only some corners have a `vt` or `vn`, cleaning fills in the others and counts them.
        let value =
            |extra: &Option<Extra>, which: usize| extra.and_then(|extra| extra[which]).map(|i| i as usize);
        if has[0] {
            raw.attributes.coordinates = extras
                .iter()
                .map(|extra| value(extra, 0).map_or([f32::NAN; 2], |i| coordinates[i]))
                .collect();
        }
        if has[1] {
            raw.attributes.normals =
                extras.iter().map(|extra| value(extra, 1).map_or([0.0; 3], |i| normals[i])).collect();
        }
        raw
    }
}

/// The bit that marks additional vertices: 2^31, which is above [`MAX_ITEMS`].
const FURTHER: u32 = 1 << 31;

fn keep<T>(list: &mut Vec<T>, item: T) -> Result<(), String> {
    if list.len() >= MAX_ITEMS {
        return Err(format!("more than {MAX_ITEMS} lines of this kind"));
    }
    list.push(item);
    Ok(())
}

fn numbers<'a>(words: impl Iterator<Item = &'a [u8]>) -> Result<Vec<f64>, String> {
    // Reads at most 8 numbers, more than any of these lines has.
    words.take(8).map(|word| number(word).ok_or_else(|| format!("{} is not a number", shown(word)))).collect()
}

/// A decimal number, or nan or inf.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// A word of the file for an error, shortened to fit one line.
pub(super) fn shown(word: &[u8]) -> String {
    let text = String::from_utf8_lossy(&word[..word.len().min(40)]);
    format!("{text:?}")
}

/// Resolves an index from 1, or from the end starting at -1.
fn resolve(word: &[u8], count: usize) -> Result<u32, String> {
    let index: Option<i64> = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
    let index = index.ok_or_else(|| format!("{} is not an index", shown(word)))?;
    let from_0 = if index < 0 { count as i64 + index } else { index - 1 };
    match u32::try_from(from_0) {
        Ok(from_0) if (from_0 as usize) < count => Ok(from_0),
        _ if index == 0 => Err("index 0, but the first index is 1".into()),
        _ => Err(format!("index {index}, but there are only {count} so far")),
    }
}
