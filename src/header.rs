//! The header of each JSON output: its first two keys, which state the format's name and version (docs/formats.md).

use serde::{Deserialize, Serialize};
use serde_json::Value;
use thiserror::Error;

/// A kind of JSON output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JsonFormat {
    pub name: &'static str,
    /// The version that this program writes, and the newest that it reads. It increases when a reader of the previous
    /// version would misread the file.
    pub version: u32,
    /// The oldest version that it reads.
    pub oldest: u32,
    /// The name that version 1 used, if it was different. A text without a name is also version 1.
    pub first_name: Option<&'static str>,
}

/// An output with its header.
#[derive(Clone, Debug, Serialize)]
pub struct Headed<T> {
    format: &'static str,
    version: u32,
    #[serde(flatten)]
    content: T,
}

/// A text in a format that this program cannot read.
#[derive(Debug, Error)]
pub enum WrongFormat {
    #[error(transparent)]
    Json(#[from] serde_json::Error),
    /// Both as text.
    #[error("{found}; this program reads {read}")]
    Other { found: String, read: String },
}

#[derive(Deserialize)]
struct Head {
    format: Option<String>,
    version: Option<Value>,
}

impl JsonFormat {
    /// A format whose other versions are not read.
    pub const fn new(name: &'static str, version: u32) -> JsonFormat {
        JsonFormat { name, version, oldest: version, first_name: None }
    }

    /// `content` with the header in front.
    pub fn head<T: Serialize>(&self, content: T) -> Headed<T> {
        Headed { format: self.name, version: self.version, content }
    }

    /// Checks a text's header and returns its version.
    ///
    /// # Errors
    /// [`WrongFormat`] names the text's format and version, and the supported ones.
    pub fn check(&self, text: &str) -> Result<u32, WrongFormat> {
        let Head { format, version } = serde_json::from_str(text)?;
        let stated = version.as_ref().and_then(Value::as_u64).and_then(|version| u32::try_from(version).ok());
        let known = match format.as_deref() {
            None => Some(1),
            name if name == self.first_name => Some(1),
            Some(name) if name == self.name => stated,
            Some(_) => None,
        };
        known.filter(|version| (self.oldest..=self.version).contains(version)).ok_or_else(|| {
            let version = version.map(|version| format!(" version {version}")).unwrap_or_default();
            let found = match format {
                Some(format) => format!("format {format:?}{version}"),
                None => "it states no format".to_owned(),
            };
            WrongFormat::Other { found, read: self.read() }
        })
    }

    /// The supported format and versions, as text.
    fn read(&self) -> String {
        match self.oldest == self.version {
            true => format!("format {:?} version {}", self.name, self.version),
            false => format!("format {:?} versions {} to {}", self.name, self.oldest, self.version),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    const TWO: JsonFormat =
        JsonFormat { name: "ortelius-made", version: 2, oldest: 1, first_name: Some("made 1") };

    #[test]
    fn a_header_comes_first_and_is_read_again() {
        let text = serde_json::to_string(&TWO.head(json!({"a": 1}))).unwrap();
        assert_eq!(text, r#"{"format":"ortelius-made","version":2,"a":1}"#);
        assert_eq!(TWO.check(&text).unwrap(), 2);
    }

    #[test]
    fn a_text_without_a_header_is_version_1_and_so_is_the_first_name() {
        assert_eq!(TWO.check(r#"{"a": 1}"#).unwrap(), 1);
        assert_eq!(TWO.check(r#"{"format": "made 1", "version": "0.1.0"}"#).unwrap(), 1);
        let only_two = JsonFormat { oldest: 2, first_name: None, ..TWO };
        let error = only_two.check(r#"{"a": 1}"#).unwrap_err().to_string();
        assert_eq!(error, "it states no format; this program reads format \"ortelius-made\" version 2");
    }

    #[test]
    fn a_newer_version_and_another_format_are_refused_and_both_are_named() {
        for (text, found) in [
            (r#"{"format": "ortelius-made", "version": 3}"#, "format \"ortelius-made\" version 3"),
            (r#"{"format": "ortelius-made", "version": "2"}"#, "format \"ortelius-made\" version \"2\""),
            (r#"{"format": "ortelius-made"}"#, "format \"ortelius-made\""),
            (r#"{"format": "other", "version": 1}"#, "format \"other\" version 1"),
            (r#"{"format": "made 0"}"#, "format \"made 0\""),
        ] {
            let error = TWO.check(text).unwrap_err().to_string();
            let read = "this program reads format \"ortelius-made\" versions 1 to 2";
            assert_eq!(error, format!("{found}; {read}"));
        }
        assert!(matches!(TWO.check("no"), Err(WrongFormat::Json(_))));
    }
}
