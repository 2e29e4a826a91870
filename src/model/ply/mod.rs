//! PLY, the Stanford polygon format: ascii and both binary byte orders, with elements and properties in any
//! order. Polygons are read as fans, strips as their triangles. Vertex properties: x y z, nx ny nz, s t (also
//! u v, texture_u texture_v) and red green blue alpha (also r g b a, diffuse_red and so on). Face properties: the
//! texture coordinates of the corners. Everything else is skipped. The format does not say where t begins; as other
//! programs do, it is taken from the picture's lower edge.

mod faces;

use super::error::ModelFault;
use super::number::{Endian, NumberType};
use super::obj::{number, shown};
use super::raw::{MAX_ITEMS, Raw};
use glam::DVec3;

/// Reads a PLY file.
///
/// # Errors
/// [`ModelFault`] with the line (ascii, header) or the byte (binary).
pub(super) fn read(file: &[u8]) -> Result<Raw, ModelFault> {
    let (header, mut values) = header(file)?;
    if header.elements.iter().all(|element| ![&b"face"[..], b"tristrips"].contains(&element.name)) {
        return Err(ModelFault::whole("no element \"face\" or \"tristrips\": a point cloud has no faces"));
    }
    let (mut raw, mut corners) = (Raw::default(), Vec::new());
    for element in &header.elements {
        // Reserve at most what the file's size allows, because a header may declare any count.
        let room = values.left() / element.min_bytes(values.endian).max(1);
        if element.count > room {
            let (name, count) = (shown(element.name), element.count);
            return Err(
                values.fault(format!("{count} of {name} declared, but the file has room for at most {room}"))
            );
        }
        if element.count > MAX_ITEMS {
            return Err(values.fault(format!("more than {MAX_ITEMS} of {}", shown(element.name))));
        }
        match element.name {
            b"vertex" => vertices(element, &mut values, &mut raw)?,
            b"face" => faces::polygons(element, &mut values, &mut raw, &mut corners)?,
            b"tristrips" => faces::strips(element, &mut values, &mut raw)?,
            _ => skip(element, &mut values)?,
        }
    }
    let count = raw.positions.len();
    let wrong = raw.faces.iter().position(|face| face.iter().any(|&vertex| vertex as usize >= count));
    wrong.map_or(Ok(()), |face| {
        let vertex = raw.faces[face].iter().max().expect("a face has three corners");
        Err(ModelFault::whole(format!(
            "triangle {face} refers to vertex {vertex}, but there are only {count}"
        )))
    })?;
    if corners.is_empty() { Ok(raw) } else { faces::of_corners(&raw, &corners) }
}

struct Header<'a> {
    elements: Vec<Element<'a>>,
}

struct Element<'a> {
    name: &'a [u8],
    count: usize,
    properties: Vec<Property<'a>>,
}

#[derive(Clone, Copy)]
struct Property<'a> {
    name: &'a [u8],
    kind: NumberType,
    /// The type of a list's length.
    length: Option<NumberType>,
}

impl Element<'_> {
    fn has(&self, name: &[u8]) -> bool {
        self.properties.iter().any(|property| property.name == name)
    }

    /// Minimum size of one element in the file.
    fn min_bytes(&self, endian: Option<Endian>) -> usize {
        let bytes = |property: &Property| match endian {
            Some(_) => property.length.unwrap_or(property.kind).size(),
            // A digit and a separator.
            None => 2,
        };
        self.properties.iter().map(bytes).sum()
    }
}

/// Real headers have about 20 lines.
const MAX_HEADER_LINES: usize = 1000;

fn header(file: &[u8]) -> Result<(Header<'_>, Values<'_>), ModelFault> {
    let mut elements: Vec<Element> = Vec::new();
    let mut format = None;
    let mut at = 0;
    for line_number in 1..=MAX_HEADER_LINES {
        let Some(length) = file[at..].iter().position(|&byte| byte == b'\n') else {
            return Err(ModelFault::line(line_number, "the header does not end"));
        };
        let line = &file[at..at + length];
        at += length + 1;
        let words: Vec<&[u8]> =
            line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).take(6).collect();
        let fault = |what: &str| Err(ModelFault::line(line_number, format!("{what} {}", shown(line))));
        match *words {
            [b"ply"] if line_number == 1 => {}
            _ if line_number == 1 => return Err(ModelFault::line(1, "does not begin with \"ply\"")),
            [] | [b"comment" | b"obj_info", ..] => {}
            [b"format", b"ascii", _] => format = Some(None),
            [b"format", b"binary_little_endian", _] => format = Some(Some(Endian::Little)),
            [b"format", b"binary_big_endian", _] => format = Some(Some(Endian::Big)),
            [b"element", name, count] => match number(count).filter(|n| *n >= 0.0 && n.fract() == 0.0) {
                Some(_) if elements.iter().any(|element| element.name == name) => return fault("duplicate"),
                Some(count) => elements.push(Element { name, count: count as usize, properties: Vec::new() }),
                None => return fault("not a number of elements:"),
            },
            [b"property", ref words @ ..] => match (property(words), elements.last_mut()) {
                (Some(property), Some(element)) if element.has(property.name) => return fault("duplicate"),
                (Some(property), Some(element)) => element.properties.push(property),
                _ => return fault("not a property of an element:"),
            },
            [b"end_header"] => {
                let endian =
                    format.ok_or_else(|| ModelFault::line(line_number, "the header has no \"format\""))?;
                return Ok((Header { elements }, Values { file, at, line: line_number + 1, endian }));
            }
            _ => return fault("not a line of a PLY header:"),
        }
    }
    Err(ModelFault::line(MAX_HEADER_LINES, "the header does not end"))
}

fn property<'a>(words: &[&'a [u8]]) -> Option<Property<'a>> {
    match *words {
        [b"list", length, kind_, name] => {
            let length =
                kind(length).filter(|length| !matches!(length, NumberType::F32 | NumberType::F64))?;
            Some(Property { name, kind: kind(kind_)?, length: Some(length) })
        }
        [kind_, name] => Some(Property { name, kind: kind(kind_)?, length: None }),
        _ => None,
    }
}

fn kind(word: &[u8]) -> Option<NumberType> {
    Some(match word {
        b"char" | b"int8" => NumberType::I8,
        b"uchar" | b"uint8" => NumberType::U8,
        b"short" | b"int16" => NumberType::I16,
        b"ushort" | b"uint16" => NumberType::U16,
        b"int" | b"int32" => NumberType::I32,
        b"uint" | b"uint32" => NumberType::U32,
        b"float" | b"float32" => NumberType::F32,
        b"double" | b"float64" => NumberType::F64,
        _ => return None,
    })
}

/// The values after the header, in order.
struct Values<'a> {
    file: &'a [u8],
    at: usize,
    /// In ascii: the line of `at`, from 1.
    line: usize,
    /// `None`: ascii.
    endian: Option<Endian>,
}

impl<'a> Values<'a> {
    fn left(&self) -> usize {
        // The last value of an ascii file needs no separator after it.
        self.file.len() - self.at + usize::from(self.endian.is_none())
    }

    fn fault(&self, what: impl Into<String>) -> ModelFault {
        match self.endian {
            Some(_) => ModelFault::byte(self.at, what),
            None => ModelFault::line(self.line, what),
        }
    }

    #[inline]
    fn next(&mut self, kind: NumberType) -> Result<f64, ModelFault> {
        let Some(endian) = self.endian else {
            let word = self.word();
            return number(word).ok_or_else(|| match word {
                [] => self.fault("ends before the last value"),
                _ => self.fault(format!("{} is not a number", shown(word))),
            });
        };
        match self.file[self.at..].get(..kind.size()) {
            Some(bytes) => {
                self.at += kind.size();
                Ok(kind.read(bytes, endian))
            }
            None => Err(self.fault("ends before the last value")),
        }
    }

    /// The next word of an ascii file; empty at its end.
    fn word(&mut self) -> &'a [u8] {
        while let Some(byte) = self.file.get(self.at).filter(|byte| byte.is_ascii_whitespace()) {
            self.line += usize::from(*byte == b'\n');
            self.at += 1;
        }
        let rest = &self.file[self.at..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.at += length;
        &rest[..length]
    }

    /// A list's length, checked against the rest of the file.
    fn length(&mut self, length: NumberType, kind: NumberType) -> Result<usize, ModelFault> {
        let count = self.next(length)?;
        let size = if self.endian.is_some() { kind.size() } else { 2 };
        let room = self.left() / size;
        if count >= 0.0 && count.fract() == 0.0 && count <= room as f64 {
            Ok(count as usize)
        } else {
            Err(self.fault(format!("a list of {count} values, but the file has room for at most {room}")))
        }
    }
}

/// Vertex properties, in this order.
const NAMES: [&[&[u8]]; 12] = [
    &[b"x"],
    &[b"y"],
    &[b"z"],
    &[b"nx"],
    &[b"ny"],
    &[b"nz"],
    &[b"s", b"u", b"texture_u"],
    &[b"t", b"v", b"texture_v"],
    &[b"red", b"r", b"diffuse_red"],
    &[b"green", b"g", b"diffuse_green"],
    &[b"blue", b"b", b"diffuse_blue"],
    &[b"alpha", b"a"],
];

fn vertices(element: &Element, values: &mut Values, raw: &mut Raw) -> Result<(), ModelFault> {
    let slot = |property: &Property| NAMES.iter().position(|names| names.contains(&property.name));
    let slots: Vec<Option<usize>> = element.properties.iter().map(slot).collect();
    let has = |wanted: std::ops::Range<usize>| wanted.into_iter().all(|slot| slots.contains(&Some(slot)));
    if !has(0..3) {
        return Err(ModelFault::whole("the vertices lack x, y or z"));
    }
    raw.positions.reserve_exact(element.count);
    for _ in 0..element.count {
        // Opaque if there is no alpha.
        let (mut found, mut colors) = ([0.0; 12], [255; 4]);
        for (property, slot) in element.properties.iter().zip(&slots) {
            if property.length.is_some() {
                pass(values, property)?;
                continue;
            }
            let value = values.next(property.kind)?;
            match *slot {
                Some(slot) if slot >= 8 => colors[slot - 8] = property.kind.channel(value),
                Some(slot) => found[slot] = value,
                None => {}
            }
        }
        let [x, y, z, nx, ny, nz, s, t, ..] = found;
        raw.positions.push(DVec3::new(x, y, z));
        if has(3..6) {
            raw.attributes.normals.push([nx as f32, ny as f32, nz as f32]);
        }
        if has(6..8) {
            raw.attributes.coordinates.push([s as f32, (1.0 - t) as f32]);
        }
        if has(8..11) {
            raw.attributes.colors.push(colors);
        }
    }
    Ok(())
}

/// Skips a value or a list.
fn pass(values: &mut Values, property: &Property) -> Result<(), ModelFault> {
    let count = match property.length {
        Some(length) => values.length(length, property.kind)?,
        None => 1,
    };
    (0..count).try_for_each(|_| values.next(property.kind).map(drop))
}

fn skip(element: &Element, values: &mut Values) -> Result<(), ModelFault> {
    (0..element.count)
        .try_for_each(|_| element.properties.iter().try_for_each(|property| pass(values, property)))
}
