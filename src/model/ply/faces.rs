//! Faces of a PLY file: polygons, triangle strips, and texture coordinates of face corners.

use super::{Element, MAX_ITEMS, ModelFault, NumberType, Property, Raw, Values, pass};

/// Texture coordinates of a triangle's corners.
pub(super) type Corners = [[f32; 2]; 3];

fn is_corners(property: &Property) -> bool {
    property.length.is_some() && [&b"vertex_indices"[..], b"vertex_index"].contains(&property.name)
}

/// The form that scanning tools write: two numbers for each corner, in order.
fn is_coordinates(property: &Property) -> bool {
    property.length.is_some() && property.name == b"texcoord"
}

fn needs_corners(element: &Element, whose: &str) -> Result<(), ModelFault> {
    match element.count > 0 && !element.properties.iter().any(is_corners) {
        true => Err(ModelFault::whole(format!("{whose} have no list \"vertex_indices\""))),
        false => Ok(()),
    }
}

/// Reads faces as fans of triangles. `coordinates` gets one entry for each triangle, if the file has them.
pub(super) fn polygons(
    element: &Element,
    values: &mut Values,
    raw: &mut Raw,
    coordinates: &mut Vec<Corners>,
) -> Result<(), ModelFault> {
    needs_corners(element, "faces")?;
    let has_coordinates = element.properties.iter().any(is_coordinates);
    raw.faces.reserve_exact(element.count);
    let mut of_face: Vec<f32> = Vec::new();
    for _ in 0..element.count {
        let first = raw.faces.len();
        of_face.clear();
        for property in &element.properties {
            match property.length {
                Some(length) if is_corners(property) => polygon(values, length, property.kind, raw)?,
                Some(length) if is_coordinates(property) => {
                    for _ in 0..values.length(length, property.kind)? {
                        let value = values.next(property.kind)?;
                        // The second number of a pair is t, from the picture's lower edge.
                        of_face.push(if of_face.len() % 2 == 1 { 1.0 - value } else { value } as f32);
                    }
                }
                _ => pass(values, property)?,
            }
        }
        let corners = raw.faces.len() - first + 2;
        if has_coordinates {
            let (pairs, rest) = of_face.as_chunks::<2>();
            if pairs.len() != corners || !rest.is_empty() {
                let what = format!("texcoord has {} numbers for a face of {corners} corners", of_face.len());
                return Err(values.fault(what));
            }
            coordinates.extend((2..corners).map(|n| [pairs[0], pairs[n - 1], pairs[n]]));
        }
    }
    Ok(())
}

fn polygon(
    values: &mut Values,
    length: NumberType,
    kind: NumberType,
    raw: &mut Raw,
) -> Result<(), ModelFault> {
    let corners = values.length(length, kind)?;
    if corners < 3 {
        return Err(values.fault(format!("a face of {corners} corners")));
    }
    if raw.faces.len() + corners > MAX_ITEMS {
        return Err(values.fault(format!("more than {MAX_ITEMS} faces")));
    }
    let (first, mut last) = (corner(values, kind)?, corner(values, kind)?);
    for _ in 2..corners {
        let next = corner(values, kind)?;
        raw.faces.push([first, last, next]);
        last = next;
    }
    Ok(())
}

fn corner(values: &mut Values, kind: NumberType) -> Result<u32, ModelFault> {
    let value = values.next(kind)?;
    index(values, value)
}

/// Converts a value to a vertex index. Whether the vertex exists is checked at the end, when the count is known.
fn index(values: &Values, value: f64) -> Result<u32, ModelFault> {
    let index = value as u32;
    let wrong = || values.fault(format!("{value} is not a vertex index"));
    (f64::from(index) == value).then_some(index).ok_or_else(wrong)
}

/// Reads strips, as the Stanford repository packs scans: each vertex makes a triangle with the two before it, every
/// second one reversed; -1 starts a new strip.
pub(super) fn strips(element: &Element, values: &mut Values, raw: &mut Raw) -> Result<(), ModelFault> {
    needs_corners(element, "tristrips")?;
    for _ in 0..element.count {
        for property in &element.properties {
            match property.length {
                Some(length) if is_corners(property) => strip(values, length, property.kind, raw)?,
                _ => pass(values, property)?,
            }
        }
    }
    Ok(())
}

fn strip(values: &mut Values, length: NumberType, kind: NumberType, raw: &mut Raw) -> Result<(), ModelFault> {
    let count = values.length(length, kind)?;
    if raw.faces.len() + count > MAX_ITEMS {
        return Err(values.fault(format!("more than {MAX_ITEMS} faces")));
    }
    let (mut before, mut place) = ([0; 2], 0);
    for _ in 0..count {
        let value = values.next(kind)?;
        if value == -1.0 {
            place = 0;
            continue;
        }
        let vertex = index(values, value)?;
        if place >= 2 {
            let [a, b] = before;
            raw.faces.push(if place % 2 == 0 { [a, b, vertex] } else { [b, a, vertex] });
        }
        before = [before[1], vertex];
        place += 1;
    }
    Ok(())
}

/// One vertex for each corner, with its own texture coordinates. Cleaning merges equal ones to wedges.
pub(super) fn of_corners(raw: &Raw, coordinates: &[Corners]) -> Result<Raw, ModelFault> {
    if coordinates.len() != raw.faces.len() {
        return Err(ModelFault::whole(
            "it has both tristrips and faces with texcoord; strips cannot have texcoord",
        ));
    }
    let corners = 3 * raw.faces.len();
    if corners > MAX_ITEMS {
        return Err(ModelFault::whole(format!("texcoord for {corners} corners, more than {MAX_ITEMS}")));
    }
    let vertices = raw.faces.as_flattened();
    let mut attributes = raw.attributes.select(vertices);
    attributes.coordinates = coordinates.as_flattened().to_vec();
    Ok(Raw {
        positions: vertices.iter().map(|&vertex| raw.positions[vertex as usize]).collect(),
        attributes,
        faces: (0..raw.faces.len() as u32).map(|face| [3 * face, 3 * face + 1, 3 * face + 2]).collect(),
    })
}
