//! What was measured, as rows; claims look numbers up here.

use super::Cell;
use crate::stats::Summary;
use serde::{Deserialize, Serialize};

/// One measured quantity of one variant in one cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    pub variant: String,
    /// "dedup", "points emitted": the same word in all cells.
    pub quantity: String,
    /// "ms", "tiles"; empty for a plain number.
    pub unit: String,
    pub value: Value,
    /// What `value` summarises, in the order of rounds: each ran beside the same round of the cell's other rows.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rounds: Vec<f64>,
}

/// A measured value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Value {
    /// Repeated measurements; finite.
    Summary(Summary),
    /// Exact, or computed; may be infinite or NaN.
    #[serde(with = "any_f64")]
    Number(f64),
    /// (x, y), in order of x; finite, and exact.
    Series(Vec<[f64; 2]>),
    /// Repeated measurements at each x, in order of x; finite.
    Spreads(Vec<(f64, Summary)>),
    /// An outcome in words.
    Text(String),
    /// The variant does not run here, and why.
    Missing(String),
}

/// A row with its cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    pub scene: String,
    pub x: Option<f64>,
    #[serde(flatten)]
    pub row: Row,
}

/// Where something was measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    pub device: String,
    /// "discrete", "integrated", "virtual", "cpu".
    pub device_kind: String,
    pub driver: String,
    pub vulkan: String,
    pub processor: String,
    pub cores: usize,
    /// Commit of the program, "+changes" behind it where it was built with what was not committed.
    pub commit: String,
    /// Day, UTC, as 2026-11-21.
    pub date: String,
}

/// All records of a figure, in order of cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    pub machine: Machine,
    pub records: Vec<Record>,
    /// Cells that were to be measured and are not there, and what became of them: "failed".
    pub lost: Vec<(Cell, &'static str)>,
}

impl Row {
    pub fn new(
        variant: impl Into<String>,
        quantity: impl Into<String>,
        unit: impl Into<String>,
        value: Value,
    ) -> Row {
        let (variant, quantity, unit) = (variant.into(), quantity.into(), unit.into());
        Row { variant, quantity, unit, value, rounds: Vec::new() }
    }

    /// An exact number.
    pub fn number(
        variant: impl Into<String>,
        quantity: impl Into<String>,
        unit: impl Into<String>,
        number: f64,
    ) -> Row {
        Row::new(variant, quantity, unit, Value::Number(number))
    }

    /// What does not run here, and why.
    pub fn missing(variant: impl Into<String>, quantity: impl Into<String>, why: impl Into<String>) -> Row {
        Row::new(variant, quantity, "", Value::Missing(why.into()))
    }

    /// A measurement of each round; `None` where the device keeps no time.
    pub fn of_rounds(variant: &str, quantity: &str, unit: &str, rounds: Option<Vec<f64>>) -> Row {
        let rounds = rounds.unwrap_or_default();
        let summary = Summary::of(&rounds).map(Value::Summary);
        let value = summary.unwrap_or_else(|| Value::Missing("the device keeps no time".into()));
        Row { rounds, ..Row::new(variant, quantity, unit, value) }
    }
}

impl Value {
    /// The median of repeated measurements, or the number itself.
    pub fn number(&self) -> Option<f64> {
        match self {
            Value::Summary(summary) => Some(summary.median),
            Value::Number(number) => Some(*number),
            Value::Series(_) | Value::Spreads(_) | Value::Text(_) | Value::Missing(_) => None,
        }
    }
}

/// JSON has no infinities and no NaN: they are written as the strings "inf", "-inf", "NaN".
pub(super) mod any_f64 {
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Stored {
        Finite(f64),
        Other(String),
    }

    pub fn serialize<S: Serializer>(number: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        match number.is_finite() {
            true => serializer.serialize_f64(*number),
            false => serializer.serialize_str(&number.to_string()),
        }
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        match Stored::deserialize(deserializer)? {
            Stored::Finite(number) => Ok(number),
            Stored::Other(text) => text.parse().map_err(D::Error::custom),
        }
    }
}

impl Table {
    pub fn value(&self, scene: &str, x: Option<f64>, variant: &str, quantity: &str) -> Option<&Value> {
        let found = self
            .records
            .iter()
            .find(|r| r.scene == scene && r.x == x && r.row.variant == variant && r.row.quantity == quantity);
        found.map(|r| &r.row.value)
    }

    /// [`Value::number`] of [`Table::value`].
    pub fn number(&self, scene: &str, x: Option<f64>, variant: &str, quantity: &str) -> Option<f64> {
        self.value(scene, x, variant, quantity).and_then(Value::number)
    }

    /// All records of one quantity.
    pub fn of<'a>(&'a self, quantity: &'a str) -> impl Iterator<Item = &'a Record> {
        self.records.iter().filter(move |r| r.row.quantity == quantity)
    }
}

impl Machine {
    /// A processor poses as the device: its times rank nothing on a GPU.
    pub fn is_software(&self) -> bool {
        self.device_kind == "cpu"
    }
}
