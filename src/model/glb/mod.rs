//! Binary glTF 2.0: the triangles (lists, strips and fans) of every mesh in the scene, transformed by their nodes.
//! Points and lines are skipped. Skins and morph targets are not applied.

mod accessor;
mod json;

use super::error::ModelFault;
use super::raw::Raw;
use accessor::{Numbers, accessor};
use glam::{DMat3, DMat4, DQuat, DVec3};
use json::{Document, Node, Primitive};

/// Limit of faces and vertices, because nodes may instantiate a mesh any number of times. In a file with more bytes
/// than this, the limit is the number of bytes.
const MAX_PLACED: usize = 1 << 24;

/// Prefixes of required extensions that do not change the shape.
const HARMLESS: [&str; 5] =
    ["KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "KHR_mesh_quantization"];

/// Reads a GLB file.
///
/// # Errors
/// [`ModelFault`] with the chunk's byte or the object's index.
pub(super) fn read(file: &[u8]) -> Result<Raw, ModelFault> {
    let (text, bin) = chunks(file)?;
    let document: Document =
        serde_json::from_slice(text).map_err(|error| ModelFault::whole(format!("invalid JSON: {error}")))?;
    let strange = |name: &&String| !HARMLESS.iter().any(|harmless| name.starts_with(harmless));
    if let Some(extension) = document.extensions_required.iter().find(strange) {
        return Err(ModelFault::whole(format!(
            "it requires the extension {extension:.60}, which is not supported; save the file without it"
        )));
    }
    let mut builder =
        Builder { document: &document, bin, raw: Raw::default(), max: MAX_PLACED.max(file.len()) };
    if document.nodes.is_empty() {
        for mesh in 0..document.meshes.len() {
            builder.mesh(mesh, DMat4::IDENTITY)?;
        }
    } else {
        builder.scene()?;
    }
    Ok(builder.finish())
}

/// The JSON text and the binary chunk, which may be missing.
fn chunks(file: &[u8]) -> Result<(&[u8], &[u8]), ModelFault> {
    let word = |at: usize| {
        let bytes = file.get(at..at + 4)?;
        Some(u32::from_le_bytes(bytes.try_into().ok()?))
    };
    if file.get(..4) != Some(b"glTF") {
        return Err(ModelFault::byte(0, "does not begin with \"glTF\""));
    }
    if word(4) != Some(2) {
        return Err(ModelFault::byte(4, "not version 2"));
    }
    let chunk = |at: usize, kind: &[u8; 4]| -> Result<&[u8], ModelFault> {
        let length = word(at).ok_or_else(|| ModelFault::byte(at, "ends before the chunk"))? as usize;
        if file.get(at + 4..at + 8) != Some(kind) {
            return Err(ModelFault::byte(at + 4, format!("not a chunk {:?}", String::from_utf8_lossy(kind))));
        }
        let content = file[at + 8..].get(..length);
        content.ok_or_else(|| ModelFault::byte(at, format!("a chunk of {length} bytes exceeds the file")))
    };
    let text = chunk(12, b"JSON")?;
    let second = 20 + text.len().next_multiple_of(4);
    let bin = if file.len() > second { chunk(second, b"BIN\0")? } else { &[] };
    Ok((text, bin))
}

struct Builder<'a> {
    document: &'a Document,
    bin: &'a [u8],
    raw: Raw,
    max: usize,
}

impl Builder<'_> {
    /// Adds the default scene, or the first one if there is no default.
    fn scene(&mut self) -> Result<(), ModelFault> {
        let document = self.document;
        let index = document.scene.unwrap_or(0);
        let scene = document.scenes.get(index);
        let scene = scene.ok_or_else(|| ModelFault::whole(format!("there is no scene {index}")))?;
        let mut open: Vec<(usize, DMat4)> =
            scene.nodes.iter().rev().map(|&node| (node, DMat4::IDENTITY)).collect();
        let mut seen = vec![false; document.nodes.len()];
        while let Some((index, parent)) = open.pop() {
            let node = document.nodes.get(index);
            let node = node.ok_or_else(|| ModelFault::whole(format!("there is no node {index}")))?;
            if std::mem::replace(&mut seen[index], true) {
                return Err(ModelFault::whole(format!(
                    "node {index} appears twice in the scene, or is its own ancestor"
                )));
            }
            let to_world = parent * transform(node);
            open.extend(node.children.iter().rev().map(|&child| (child, to_world)));
            if let Some(mesh) = node.mesh {
                self.mesh(mesh, to_world)?;
            }
        }
        Ok(())
    }

    fn mesh(&mut self, index: usize, to_world: DMat4) -> Result<(), ModelFault> {
        let document = self.document;
        let mesh = document
            .meshes
            .get(index)
            .ok_or_else(|| ModelFault::whole(format!("there is no mesh {index}")))?;
        for (at, primitive) in mesh.primitives.iter().enumerate() {
            let placed = self.primitive(primitive, to_world);
            placed.map_err(|fault| {
                ModelFault::whole(format!("mesh {index}, primitive {at}: {}", fault.what))
            })?;
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &Primitive, to_world: DMat4) -> Result<(), ModelFault> {
        let mode = primitive.mode.unwrap_or(4);
        if mode < 4 {
            return Ok(());
        }
        let attribute = |name: &str, columns: &[usize], count: Option<usize>| {
            let index = primitive.attributes.get(name);
            index.map(|&index| accessor(self.document, self.bin, index, columns, count)).transpose()
        };
        let positions =
            attribute("POSITION", &[3], None)?.ok_or_else(|| ModelFault::whole("it has no POSITION"))?;
        let count = positions.count;
        let normals = attribute("NORMAL", &[3], Some(count))?;
        let coordinates = attribute("TEXCOORD_0", &[2], Some(count))?;
        let colors = attribute("COLOR_0", &[3, 4], Some(count))?;
        let corners = self.corners(primitive, count)?;
        let triangles = corners.len().saturating_sub(2);
        if self.raw.positions.len() + count > self.max || self.raw.faces.len() + triangles > self.max {
            return Err(ModelFault::whole(format!("more than {} vertices or faces", self.max)));
        }
        let first = self.raw.positions.len();
        self.faces(&corners, mode, first as u32, to_world)?;
        self.raw.positions.extend((0..count).map(|row| to_world.transform_point3(positions.vector(row))));
        self.attributes(first, [normals, coordinates, colors], to_world);
        Ok(())
    }

    /// The vertices in drawing order.
    fn corners(&self, primitive: &Primitive, count: usize) -> Result<Vec<u32>, ModelFault> {
        let Some(index) = primitive.indices else {
            return Ok((0..count as u32).collect());
        };
        let indices = accessor(self.document, self.bin, index, &[1], None)?;
        let corner = |row: usize| {
            let vertex = indices.raw(row, 0);
            let fits = vertex >= 0.0 && vertex < count as f64 && vertex.fract() == 0.0;
            let fault = || ModelFault::whole(format!("index {row} is {vertex}, not a vertex below {count}"));
            if fits { Ok(vertex as u32) } else { Err(fault()) }
        };
        (0..indices.count).map(corner).collect()
    }

    fn faces(&mut self, corners: &[u32], mode: u32, first: u32, to_world: DMat4) -> Result<(), ModelFault> {
        let count = corners.len();
        let triangle = |[a, b, c]: [usize; 3]| [a, b, c].map(|at| first + corners[at]);
        let drawn: Vec<[u32; 3]> = match mode {
            4 if !count.is_multiple_of(3) => {
                return Err(ModelFault::whole(format!("{count} corners do not form whole triangles")));
            }
            4 => (0..count / 3).map(|i| triangle([3 * i, 3 * i + 1, 3 * i + 2])).collect(),
            // Every second triangle of a strip has the opposite winding.
            5 => (2..count).map(|i| triangle([i - 2, i - 1 + i % 2, i - i % 2])).collect(),
            6 => (2..count).map(|i| triangle([0, i - 1, i])).collect(),
            other => return Err(ModelFault::whole(format!("mode {other} does not exist in glTF"))),
        };
        // A mirroring transform reverses the winding (glTF 2.0, 3.7.4).
        let mirrored = to_world.determinant() < 0.0;
        self.raw
            .faces
            .extend(drawn.into_iter().map(|[a, b, c]| if mirrored { [a, c, b] } else { [a, b, c] }));
        Ok(())
    }

    /// Adds a primitive's attributes. If it lacks an attribute that other primitives have, the values are filled in:
    /// invalid normals or coordinates, which cleaning replaces and counts, or the colour white.
    fn attributes(
        &mut self,
        first: usize,
        [normals, coordinates, colors]: [Option<Numbers>; 3],
        to_world: DMat4,
    ) {
        let attributes = &mut self.raw.attributes;
        if let Some(normals) = normals {
            attributes.normals.resize(first, [0.0; 3]);
            let to_world = DMat3::from_mat4(to_world).inverse().transpose();
            let normal = |row| (to_world * normals.vector(row)).normalize().as_vec3().to_array();
            attributes.normals.extend((0..normals.count).map(normal));
        }
        if let Some(coordinates) = coordinates {
            attributes.coordinates.resize(first, [f32::NAN; 2]);
            let coordinate = |row| [0, 1].map(|column| coordinates.value(row, column) as f32);
            attributes.coordinates.extend((0..coordinates.count).map(coordinate));
        }
        if let Some(colors) = colors {
            attributes.colors.resize(first, [255; 4]);
            let channel = |row: usize, column: usize| match colors.columns {
                columns if column < columns => {
                    (colors.value(row, column) * 255.0).round().clamp(0.0, 255.0) as u8
                }
                _ => 255,
            };
            let color = |row| std::array::from_fn(|column| channel(row, column));
            attributes.colors.extend((0..colors.count).map(color));
        }
    }

    fn finish(mut self) -> Raw {
        let count = self.raw.positions.len();
        let attributes = &mut self.raw.attributes;
        if !attributes.normals.is_empty() {
            attributes.normals.resize(count, [0.0; 3]);
        }
        if !attributes.coordinates.is_empty() {
            attributes.coordinates.resize(count, [f32::NAN; 2]);
        }
        if !attributes.colors.is_empty() {
            attributes.colors.resize(count, [255; 4]);
        }
        self.raw
    }
}

fn transform(node: &Node) -> DMat4 {
    if let Some(columns) = &node.matrix {
        return DMat4::from_cols_array(columns);
    }
    let rotation = DQuat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
    DMat4::from_translation(DVec3::from_array(node.translation.unwrap_or_default()))
        * DMat4::from_quat(rotation.normalize())
        * DMat4::from_scale(DVec3::from_array(node.scale.unwrap_or([1.0; 3])))
}
