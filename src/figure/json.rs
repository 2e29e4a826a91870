//! Readable JSON for `diff`: indented, with one line for each measured row.

use serde::Serialize;
use serde_json::ser::{Formatter, PrettyFormatter, Serializer};
use std::io::{Result, Write};

/// Indents the outer `levels` of arrays and objects; deeper levels are written on one line.
struct Outer {
    pretty: PrettyFormatter<'static>,
    levels: usize,
    depth: usize,
}

/// `value` as text with a final newline.
///
/// # Panics
/// If a map has a key that JSON cannot express; our own types have no such map.
pub fn text(value: &impl Serialize, levels: usize) -> String {
    let mut bytes = Vec::new();
    let formatter = Outer { pretty: PrettyFormatter::new(), levels, depth: 0 };
    let written = value.serialize(&mut Serializer::with_formatter(&mut bytes, formatter));
    assert!(written.is_ok(), "our types serialize as JSON: {written:?}");
    bytes.push(b'\n');
    String::from_utf8(bytes).expect("JSON is UTF-8")
}

impl Outer {
    fn indents(&self) -> bool {
        self.depth <= self.levels
    }

    /// Separates two elements of a line.
    fn separator<W: ?Sized + Write>(writer: &mut W, first: bool) -> Result<()> {
        if first { Ok(()) } else { writer.write_all(b", ") }
    }
}

impl Formatter for Outer {
    fn begin_array<W: ?Sized + Write>(&mut self, writer: &mut W) -> Result<()> {
        self.depth += 1;
        if self.indents() { self.pretty.begin_array(writer) } else { writer.write_all(b"[") }
    }

    fn end_array<W: ?Sized + Write>(&mut self, writer: &mut W) -> Result<()> {
        let indents = self.indents();
        self.depth -= 1;
        if indents { self.pretty.end_array(writer) } else { writer.write_all(b"]") }
    }

    fn begin_array_value<W: ?Sized + Write>(&mut self, writer: &mut W, first: bool) -> Result<()> {
        match self.indents() {
            true => self.pretty.begin_array_value(writer, first),
            false => Self::separator(writer, first),
        }
    }

    fn end_array_value<W: ?Sized + Write>(&mut self, writer: &mut W) -> Result<()> {
        if self.indents() { self.pretty.end_array_value(writer) } else { Ok(()) }
    }

    fn begin_object<W: ?Sized + Write>(&mut self, writer: &mut W) -> Result<()> {
        self.depth += 1;
        if self.indents() { self.pretty.begin_object(writer) } else { writer.write_all(b"{") }
    }

    fn end_object<W: ?Sized + Write>(&mut self, writer: &mut W) -> Result<()> {
        let indents = self.indents();
        self.depth -= 1;
        if indents { self.pretty.end_object(writer) } else { writer.write_all(b"}") }
    }

    fn begin_object_key<W: ?Sized + Write>(&mut self, writer: &mut W, first: bool) -> Result<()> {
        match self.indents() {
            true => self.pretty.begin_object_key(writer, first),
            false => Self::separator(writer, first),
        }
    }

    fn begin_object_value<W: ?Sized + Write>(&mut self, writer: &mut W) -> Result<()> {
        writer.write_all(b": ")
    }

    fn end_object_value<W: ?Sized + Write>(&mut self, writer: &mut W) -> Result<()> {
        if self.indents() { self.pretty.end_object_value(writer) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::text;
    use serde_json::{Value, json};

    #[test]
    fn deeper_levels_are_written_on_one_line_without_loss() {
        let value = json!({"a": [{"b": [1, 2.5], "c": {}}, {}], "d": "e\n", "f": []});
        let one = "{\n  \"a\": [{\"b\": [1, 2.5], \"c\": {}}, {}],\n  \"d\": \"e\\n\",\n  \"f\": []\n}\n";
        assert_eq!(text(&value, 1), one);
        for levels in 0..6 {
            assert_eq!(serde_json::from_str::<Value>(&text(&value, levels)).unwrap(), value);
        }
    }
}
