//! The types that a setting can have.

use super::moved;
use serde::Serialize;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// The type of a key's value: docs/scenes.md and `ortelius keys` name it, the JSON Schema has the JSON type.
#[derive(Clone, Debug, PartialEq)]
pub enum ValueKind {
    Whole,
    Number,
    /// This many numbers, as in `[1.0, 2.0]`.
    Numbers(usize),
    Truth,
    Text,
    Names,
    /// Name and meaning of each value.
    Choice(Vec<(&'static str, &'static str)>),
    Table,
    TableOrText,
}

impl ValueKind {
    pub fn words(&self) -> String {
        match self {
            ValueKind::Whole => "integer".into(),
            ValueKind::Number => "number".into(),
            ValueKind::Numbers(count) => format!("{count} numbers"),
            ValueKind::Truth => "true or false".into(),
            ValueKind::Text => "string".into(),
            ValueKind::Names => "list of names".into(),
            ValueKind::Choice(values) => quoted(values.iter().map(|(name, _)| *name)),
            ValueKind::Table => "table".into(),
            ValueKind::TableOrText => "table or string".into(),
        }
    }
}

/// `"a", "b"`.
pub fn quoted<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ")
}

/// A type that settings can have.
pub trait SettingValue: Sized {
    /// The type of the range's bounds; arbitrary if there are no numbers.
    type Number: Copy + PartialOrd + Display + Serialize;

    fn kind() -> ValueKind;

    /// Parses a value; relative paths are resolved against `folder`.
    ///
    /// # Errors
    /// The reason why the value is invalid.
    fn read(value: &Value, folder: &Path) -> Result<Self, String>;

    /// The value as a scene states it; `None` if the scene would omit the key.
    fn to_toml(&self) -> Option<Value>;

    /// The numbers that must be in the key's range.
    fn numbers(&self) -> Vec<Self::Number> {
        Vec::new()
    }
}

pub(super) fn not<T>(value: &Value, what: &str) -> Result<T, String> {
    Err(format!("{value} is not {what}"))
}

impl SettingValue for u32 {
    type Number = u32;
    fn kind() -> ValueKind {
        ValueKind::Whole
    }
    fn read(value: &Value, _: &Path) -> Result<u32, String> {
        let whole = value.as_integer().and_then(|whole| u32::try_from(whole).ok());
        whole.map_or_else(|| not(value, "an integer from 0 to 4294967295"), Ok)
    }
    fn to_toml(&self) -> Option<Value> {
        Some(Value::Integer(i64::from(*self)))
    }
    fn numbers(&self) -> Vec<u32> {
        vec![*self]
    }
}

impl SettingValue for f64 {
    type Number = f64;
    fn kind() -> ValueKind {
        ValueKind::Number
    }
    fn read(value: &Value, _: &Path) -> Result<f64, String> {
        match value {
            Value::Float(number) => Ok(*number),
            // A scene's integers are far below 2^53.
            Value::Integer(whole) => Ok(*whole as f64),
            _ => not(value, "a number"),
        }
    }
    fn to_toml(&self) -> Option<Value> {
        Some(Value::Float(*self))
    }
    fn numbers(&self) -> Vec<f64> {
        vec![*self]
    }
}

impl<const N: usize> SettingValue for [f64; N] {
    type Number = f64;
    fn kind() -> ValueKind {
        ValueKind::Numbers(N)
    }
    fn read(value: &Value, folder: &Path) -> Result<[f64; N], String> {
        let wrong = || format!("{value} is not a list of {N} numbers");
        let numbers = value.as_array().ok_or_else(wrong)?;
        let numbers =
            numbers.iter().map(|number| f64::read(number, folder)).collect::<Result<Vec<_>, _>>()?;
        numbers.try_into().map_err(|_| wrong())
    }
    fn to_toml(&self) -> Option<Value> {
        Some(Value::Array(self.iter().map(|number| Value::Float(*number)).collect()))
    }
    fn numbers(&self) -> Vec<f64> {
        self.to_vec()
    }
}

/// Implements [`SettingValue`] for types without a range of numbers.
macro_rules! plain_settings {
    ($($type:ty, $kind:expr, $what:literal, $read:expr, $write:expr;)*) => {$(
        impl SettingValue for $type {
            type Number = f64;
            fn kind() -> ValueKind {
                $kind
            }
            fn read(value: &Value, folder: &Path) -> Result<$type, String> {
                let read: fn(&Value, &Path) -> Option<$type> = $read;
                read(value, folder).map_or_else(|| not(value, $what), Ok)
            }
            fn to_toml(&self) -> Option<Value> {
                let write: fn(&$type) -> Value = $write;
                Some(write(self))
            }
        }
    )*};
}

pub(super) use plain_settings;

plain_settings! {
    bool, ValueKind::Truth, "true or false", |value, _| value.as_bool(), |truth| Value::Boolean(*truth);
    String, ValueKind::Text, "a string", |value, _| value.as_str().map(str::to_owned), |text| Value::String(text.clone());
    PathBuf, ValueKind::Text, "a path", |value, folder| value.as_str().map(|path| folder.join(path)),
        |path| Value::String(path.display().to_string());
    Vec<String>, ValueKind::Names, "a list of names", |value, _| {
        value.as_array()?.iter().map(|name| name.as_str().map(str::to_owned)).collect()
    }, |names| Value::Array(names.iter().map(|name| Value::String(name.clone())).collect());
    Table, ValueKind::Table, "a table", |value, _| value.as_table().cloned(), |table| Value::Table(table.clone());
}

/// An optional key. `"auto"` is the same as omitting it, except for keys that accept any text.
impl<T: SettingValue> SettingValue for Option<T> {
    type Number = T::Number;
    fn kind() -> ValueKind {
        T::kind()
    }
    fn read(value: &Value, folder: &Path) -> Result<Option<T>, String> {
        match value.as_str() {
            Some("auto") if !matches!(T::kind(), ValueKind::Text | ValueKind::TableOrText) => Ok(None),
            _ => T::read(value, folder).map(Some),
        }
    }
    fn to_toml(&self) -> Option<Value> {
        self.as_ref().and_then(T::to_toml)
    }
    fn numbers(&self) -> Vec<T::Number> {
        self.as_ref().map_or_else(Vec::new, T::numbers)
    }
}

/// An enum whose values are named in scenes. Implemented by [`choices!`](crate::scene::choices).
pub trait Choice: Copy + 'static {
    const ALL: &'static [Self];
    /// Known names that are not values, and why.
    const REFUSED: &'static [(&'static str, &'static str)] = &[];
    fn name(self) -> &'static str;
    fn about(self) -> &'static str;
}

impl<T: Choice> SettingValue for T {
    type Number = f64;
    fn kind() -> ValueKind {
        ValueKind::Choice(T::ALL.iter().map(|value| (value.name(), value.about())).collect())
    }
    fn read(value: &Value, _: &Path) -> Result<T, String> {
        let found = T::ALL.iter().find(|choice| value.as_str() == Some(choice.name()));
        let names = || T::ALL.iter().map(|choice| choice.name());
        let moved = || moved::value(value.as_str()?, names());
        let refused = T::REFUSED.iter().find(|(name, _)| value.as_str() == Some(name));
        let refused = || refused.map(|(_, why)| format!("{value} is not possible here: {why}"));
        let unknown = || {
            let unknown = || format!("{value} is not one of {}", quoted(names()));
            refused().or_else(moved).unwrap_or_else(unknown)
        };
        found.copied().ok_or_else(unknown)
    }
    fn to_toml(&self) -> Option<Value> {
        Some(Value::String(self.name().to_owned()))
    }
}
