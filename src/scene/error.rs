//! Errors in a scene, with their position: `file:line:column`, the line, and a caret below it.

use crate::picture::write::FileError;
use std::ops::Range;
use thiserror::Error;

/// A scene that cannot be used.
#[derive(Debug, Error)]
pub enum SceneError {
    #[error("{path}: cannot read the scene: {source}")]
    Read { path: String, source: std::io::Error },
    #[error(transparent)]
    Write(#[from] FileError),
    /// An error inside the file; `line` and `column` (in characters) count from 1.
    #[error("{path}:{line}:{column}: {what}\n{snippet}")]
    Content { path: String, line: usize, column: usize, what: String, snippet: String },
    #[error("{name:?} is neither a scene file nor a shipped scene; shipped scenes: {shipped}")]
    Unknown { name: String, shipped: String },
    /// An invalid override.
    #[error("-D {change}: {what}")]
    Override { change: String, what: String },
    #[error("scene {scene} has no camera {name:?}; it has {existing}")]
    Camera { scene: String, name: String, existing: String },
    #[error("scene {scene} has no path {name:?}; it has {existing}")]
    Path { scene: String, name: String, existing: String },
}

/// Bytes of a line that are shown on each side of an error.
const SHOWN_BYTES: usize = 100;

impl SceneError {
    /// An error at the bytes `span` of a scene's text.
    pub(super) fn at(path: &str, text: &str, span: Range<usize>, what: &str) -> SceneError {
        let start = floor_char(text, span.start);
        let end = floor_char(text, span.end).max(start);
        let line_start = text[..start].rfind('\n').map_or(0, |newline| newline + 1);
        let line_end = text[start..].find('\n').map_or(text.len(), |newline| start + newline);
        let [line, column] = SceneError::line_and_column(text, start);
        // A line may be as long as the file, so only the part around the error is shown.
        let shown_from = floor_char(text, line_start.max(start.saturating_sub(SHOWN_BYTES)));
        let shown_to = floor_char(text, line_end.min(start + SHOWN_BYTES));
        let printable = |c: char| if c.is_control() && c != '\t' { char::REPLACEMENT_CHARACTER } else { c };
        let source_line: String =
            text[shown_from..shown_to].trim_end_matches('\r').chars().map(printable).collect();
        // Tabs are repeated, so that the caret lines up at any tab width.
        let before: String =
            text[shown_from..start].chars().map(|c| if c == '\t' { '\t' } else { ' ' }).collect();
        let carets = text[start..end.min(shown_to).max(start)].trim_end().chars().count().max(1);
        let number = line.to_string();
        let margin = " ".repeat(number.len());
        SceneError::Content {
            path: path.to_owned(),
            line,
            column,
            // One line only: parsers put what they expected on a second line.
            what: what.trim().replace('\n', "; "),
            snippet: format!("{number} | {source_line}\n{margin} | {before}{}", "^".repeat(carets)),
        }
    }

    /// Line and column of a byte; both count from 1, columns in characters.
    pub(super) fn line_and_column(text: &str, byte: usize) -> [usize; 2] {
        let before = &text[..floor_char(text, byte)];
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        [before.matches('\n').count() + 1, before[line_start..].chars().count() + 1]
    }
}

/// Start of the character that contains byte `index`.
fn floor_char(text: &str, index: usize) -> usize {
    (0..=index.min(text.len())).rev().find(|&index| text.is_char_boundary(index)).unwrap_or(0)
}

/// `a, b, c`, or `none`.
pub(super) fn list<T: AsRef<str>>(names: impl IntoIterator<Item = T>) -> String {
    let names: Vec<String> = names.into_iter().map(|name| name.as_ref().to_owned()).collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_caret_is_below_its_letter_even_after_tabs_and_umlauts() {
        let text = "a = 1\n\tö = xyz # end\n";
        let start = text.find("xyz").unwrap();
        let error = SceneError::at("s.toml", text, start..start + 3, "no\nsuch").to_string();
        assert_eq!(error, "s.toml:2:6: no; such\n2 | \tö = xyz # end\n  | \t    ^^^");
    }

    #[test]
    fn a_line_without_end_is_cut_and_control_characters_are_replaced() {
        let text = format!("a = \"{}\u{1b}[31mred", "ä".repeat(1 << 20));
        let start = text.find("red").unwrap();
        let error = SceneError::at("s.toml", &text, start..start + 3, "no").to_string();
        assert!(error.len() < 500 && error.contains("ää\u{fffd}[31mred"), "{error}");
        let lines: Vec<&str> = error.lines().collect();
        let column = |line: &str, what: &str| line[..line.find(what).unwrap()].chars().count();
        assert_eq!(column(lines[1], "red"), column(lines[2], "^^^"));
    }

    #[test]
    fn an_error_at_the_end_of_the_text_still_has_a_caret() {
        let error = SceneError::at("s.toml", "a = ", 4..4, "ends").to_string();
        assert_eq!(error, "s.toml:1:5: ends\n1 | a = \n  |     ^");
        assert!(SceneError::at("s.toml", "", 7..9, "ends").to_string().starts_with("s.toml:1:1: ends"));
    }
}
