//! Accessors: numbers in the binary chunk. All bounds are checked before reading.

use super::json::{Accessor, Document};
use crate::model::error::ModelFault;
use crate::model::number::{Endian, NumberType};

/// Rows of numbers.
pub(super) struct Numbers<'a> {
    /// Starts at the first row; holds `count` rows.
    bytes: &'a [u8],
    stride: usize,
    pub count: usize,
    pub columns: usize,
    kind: NumberType,
    normalized: bool,
}

impl Numbers<'_> {
    /// The number as stored.
    pub(super) fn raw(&self, row: usize, column: usize) -> f64 {
        self.kind.read(&self.bytes[row * self.stride + column * self.kind.size()..], Endian::Little)
    }

    /// Integers of normalized accessors become fractions (glTF 2.0, 3.6.2.2).
    pub(super) fn value(&self, row: usize, column: usize) -> f64 {
        let max = match self.kind {
            NumberType::I8 => 127.0,
            NumberType::U8 => 255.0,
            NumberType::I16 => 32767.0,
            NumberType::U16 => 65535.0,
            _ => 1.0,
        };
        let raw = self.raw(row, column);
        if self.normalized { (raw / max).max(-1.0) } else { raw }
    }

    /// The first three numbers of a row.
    pub(super) fn vector(&self, row: usize) -> glam::DVec3 {
        glam::DVec3::from_array(std::array::from_fn(|column| self.value(row, column)))
    }
}

/// The accessor `index`. Its number of columns must be in `columns`. If `count` is given, it must have `count` rows.
pub(super) fn accessor<'a>(
    document: &Document,
    bin: &'a [u8],
    index: usize,
    columns: &[usize],
    count: Option<usize>,
) -> Result<Numbers<'a>, ModelFault> {
    let fault = |what: &str| ModelFault::whole(format!("accessor {index}: {what}"));
    let accessor = document.accessors.get(index).ok_or_else(|| fault("it does not exist"))?;
    let numbers = locate(document, bin, accessor).map_err(|what| fault(&what))?;
    if !columns.contains(&numbers.columns) {
        return Err(fault(&format!(
            "its type is {:.20}, but a type of {columns:?} columns is needed",
            accessor.shape
        )));
    }
    match count {
        Some(count) if count != numbers.count => {
            Err(fault(&format!("it has {} rows, but its primitive has {count} positions", numbers.count)))
        }
        _ => Ok(numbers),
    }
}

fn locate<'a>(document: &Document, bin: &'a [u8], accessor: &Accessor) -> Result<Numbers<'a>, String> {
    if accessor.sparse.is_some() {
        return Err("sparse accessors are not supported; save the file without them".into());
    }
    let kind = match accessor.component_type {
        5120 => NumberType::I8,
        5121 => NumberType::U8,
        5122 => NumberType::I16,
        5123 => NumberType::U16,
        5125 => NumberType::U32,
        5126 => NumberType::F32,
        other => return Err(format!("component type {other} does not exist in glTF")),
    };
    let columns = match accessor.shape.as_str() {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        other => return Err(format!("type {other:.20} cannot hold mesh data")),
    };
    let index = accessor.buffer_view.ok_or("it has no data")?;
    let view = document.buffer_views.get(index).ok_or_else(|| format!("there is no buffer view {index}"))?;
    match document.buffers.get(view.buffer) {
        None => return Err(format!("there is no buffer {}", view.buffer)),
        Some(buffer) if buffer.uri.is_some() => {
            return Err("its data are in another file; save everything as one .glb".into());
        }
        Some(_) if view.buffer != 0 => return Err(format!("buffer {} is not the binary chunk", view.buffer)),
        Some(_) => {}
    }
    let end = view.byte_offset.checked_add(view.byte_length);
    let bytes = end.and_then(|end| bin.get(view.byte_offset..end));
    let bytes = bytes
        .ok_or_else(|| format!("buffer view {index} exceeds the binary chunk of {} bytes", bin.len()))?;
    let row_bytes = columns * kind.size();
    let stride = view.byte_stride.unwrap_or(row_bytes);
    if stride < row_bytes {
        return Err(format!("rows of {row_bytes} bytes overlap at a stride of {stride} bytes"));
    }
    let bytes = bytes.get(accessor.byte_offset..).unwrap_or_default();
    let needed = match accessor.count {
        0 => Some(0),
        count => (count - 1).checked_mul(stride).and_then(|before| before.checked_add(row_bytes)),
    };
    if needed.is_none_or(|needed| needed > bytes.len()) {
        return Err(format!("{} rows exceed buffer view {index}", accessor.count));
    }
    Ok(Numbers { bytes, stride, count: accessor.count, columns, kind, normalized: accessor.normalized })
}
