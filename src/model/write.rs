//! Writes models as PLY (binary, little-endian) or OBJ (plain triangles). Faces keep their order. PLY
//! stores one vertex for each wedge if the model has attributes, otherwise for each position. OBJ stores one for each
//! position, unless there are colours.

use super::Model;
use crate::picture::write::{FileError, write_atomically};
use std::io::{self, Write};
use std::path::Path;

/// A file format that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    Ply,
    Obj,
}

impl MeshFormat {
    /// Format by file name extension, `.ply` or `.obj`.
    pub fn of(path: &Path) -> Option<MeshFormat> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "ply" => Some(Self::Ply),
            "obj" => Some(Self::Obj),
            _ => None,
        }
    }
}

impl Model {
    /// Writes the model atomically. Reading it returns the same model to the last bit; OBJ loses the alpha of colours.
    ///
    /// Only indices and lengths must be valid: all faces of an uncleaned mesh are written too.
    ///
    /// # Errors
    /// [`FileError`] names the path.
    ///
    /// # Panics
    /// May panic if an index or a length is not valid.
    pub fn write(&self, path: &Path, format: MeshFormat) -> Result<(), FileError> {
        write_atomically(path, |out| match format {
            MeshFormat::Ply => self.write_ply(out),
            MeshFormat::Obj => self.write_obj(out),
        })
    }

    fn write_ply(&self, out: &mut impl Write) -> io::Result<()> {
        // Without attributes, the wedges of a position are identical.
        let split = !self.attributes.is_empty();
        let vertices = if split { self.wedge_positions.len() } else { self.positions.len() };
        // Positions that f32 represents exactly, as in most files, take half the bytes.
        let single = self.positions.iter().all(|position| position.as_vec3().as_dvec3() == *position);
        self.ply_header(out, vertices, if single { "float" } else { "double" })?;
        for vertex in 0..vertices {
            let position = if split { self.wedge_positions[vertex] as usize } else { vertex };
            for value in self.positions[position].to_array() {
                if single {
                    out.write_all(&(value as f32).to_le_bytes())?;
                } else {
                    out.write_all(&value.to_le_bytes())?;
                }
            }
            for value in self.attributes.normals.get(vertex).into_iter().flatten() {
                out.write_all(&value.to_le_bytes())?;
            }
            if let Some(&[s, t]) = self.attributes.coordinates.get(vertex) {
                // From the lower edge. In f64 the difference is exact for every f32 of 2^-30 or more.
                for value in [f64::from(s), 1.0 - f64::from(t)] {
                    out.write_all(&value.to_le_bytes())?;
                }
            }
            if let Some(color) = self.attributes.colors.get(vertex) {
                out.write_all(color)?;
            }
        }
        for face in 0..self.faces.len() {
            out.write_all(&[3])?;
            let corners = if split { self.faces[face] } else { self.face_positions(face) };
            for corner in corners {
                // "int", which every reader supports: a model has fewer than 2^31 wedges.
                out.write_all(&corner.to_le_bytes())?;
            }
        }
        Ok(())
    }

    fn ply_header(&self, out: &mut impl Write, vertices: usize, position: &str) -> io::Result<()> {
        writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}")?;
        let attributes = &self.attributes;
        for (kind, names, there) in [
            (position, &["x", "y", "z"][..], true),
            ("float", &["nx", "ny", "nz"], !attributes.normals.is_empty()),
            ("double", &["s", "t"], !attributes.coordinates.is_empty()),
            ("uchar", &["red", "green", "blue", "alpha"], !attributes.colors.is_empty()),
        ] {
            for name in names.iter().filter(|_| there) {
                writeln!(out, "property {kind} {name}")?;
            }
        }
        writeln!(out, "element face {}\nproperty list uchar int vertex_indices\nend_header", self.faces.len())
    }

    fn write_obj(&self, out: &mut impl Write) -> io::Result<()> {
        let attributes = &self.attributes;
        // OBJ's colours belong to the position (and have no alpha).
        let split = !attributes.colors.is_empty();
        if split {
            for (wedge, &position) in self.wedge_positions.iter().enumerate() {
                let [x, y, z] = self.positions[position as usize].to_array();
                // Four decimals distinguish multiples of 1/255.
                let [r, g, b, _] = attributes.colors[wedge].map(|channel| f64::from(channel) / 255.0);
                writeln!(out, "v {x} {y} {z} {r:.4} {g:.4} {b:.4}")?;
            }
        } else {
            for [x, y, z] in self.positions.iter().map(|position| position.to_array()) {
                writeln!(out, "v {x} {y} {z}")?;
            }
        }
        for [s, t] in &attributes.coordinates {
            // From the lower edge. In f64 the difference is exact for every f32 of 2^-30 or more.
            writeln!(out, "vt {s} {}", 1.0 - f64::from(*t))?;
        }
        for [x, y, z] in &attributes.normals {
            writeln!(out, "vn {x} {y} {z}")?;
        }
        for face in &self.faces {
            write!(out, "f")?;
            for &wedge in face {
                let vertex = if split { wedge } else { self.wedge_positions[wedge as usize] } + 1;
                let wedge = wedge + 1;
                match (attributes.coordinates.is_empty(), attributes.normals.is_empty()) {
                    (true, true) => write!(out, " {vertex}")?,
                    (false, true) => write!(out, " {vertex}/{wedge}")?,
                    (true, false) => write!(out, " {vertex}//{wedge}")?,
                    (false, false) => write!(out, " {vertex}/{wedge}/{wedge}")?,
                }
            }
            writeln!(out)?;
        }
        Ok(())
    }
}
