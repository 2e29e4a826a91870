//! Measured rows, and the table in which claims look up numbers.

use super::Cell;
use crate::stats::Summary;
use crate::vk::Work;
use serde::{Deserialize, Serialize};

/// One measured quantity of one variant in one cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    pub variant: String,
    /// "dedup", "points emitted": the same spelling in all cells.
    pub quantity: String,
    /// "ms", "tiles"; empty for a plain number.
    pub unit: String,
    pub value: Value,
    /// The samples that `value` summarises, by round; rows of a cell are interleaved round by round.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rounds: Vec<f64>,
    /// For a time: the work done in this time, counted in a separate run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub work: Option<Work>,
}

/// A measured value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Value {
    /// Repeated measurements; finite.
    Summary(Summary),
    /// Exact or computed; may be infinite or NaN.
    #[serde(with = "any_f64")]
    Number(f64),
    /// (x, y), sorted by x; finite and exact.
    Series(Vec<[f64; 2]>),
    /// Repeated measurements at each x, sorted by x; finite.
    Spreads(Vec<(f64, Summary)>),
    /// An outcome in words.
    Text(String),
    /// The variant does not run on this device; with the reason.
    Missing(String),
}

/// A row with its cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TableRecord {
    pub scene: String,
    pub x: Option<f64>,
    #[serde(flatten)]
    pub row: Row,
}

/// The machine of a measurement.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    pub device: String,
    /// "discrete", "integrated", "virtual", "cpu".
    pub device_kind: String,
    pub driver: String,
    pub vulkan: String,
    pub processor: String,
    pub cores: usize,
    /// Commit of the program, with "+changes" if it was built with uncommitted changes.
    pub commit: String,
    /// Date in UTC: 2026-11-21.
    pub date: String,
}

/// All records of a figure, in order of cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    pub machine: Machine,
    pub records: Vec<TableRecord>,
    /// Cells without a measurement, and why: "failed".
    pub lost: Vec<(Cell, String)>,
}

impl Row {
    pub fn new(
        variant: impl Into<String>,
        quantity: impl Into<String>,
        unit: impl Into<String>,
        value: Value,
    ) -> Row {
        let (variant, quantity, unit) = (variant.into(), quantity.into(), unit.into());
        Row { variant, quantity, unit, value, rounds: Vec::new(), work: None }
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

    /// A quantity of a variant that does not run here, with the reason.
    pub fn missing(variant: impl Into<String>, quantity: impl Into<String>, why: impl Into<String>) -> Row {
        Row::new(variant, quantity, "", Value::Missing(why.into()))
    }

    /// A sample for each round; `None` if the device has no timestamps.
    pub fn of_rounds(variant: &str, quantity: &str, unit: &str, rounds: Option<Vec<f64>>) -> Row {
        let rounds = rounds.unwrap_or_default();
        let summary = Summary::of(&rounds).map(Value::Summary);
        let value = summary.unwrap_or_else(|| Value::Missing("the device has no timestamps".into()));
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

/// JSON has no infinities and no NaN; they are stored as the strings "inf", "-inf" and "NaN".
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
    pub fn of<'a>(&'a self, quantity: &'a str) -> impl Iterator<Item = &'a TableRecord> {
        self.records.iter().filter(move |r| r.row.quantity == quantity)
    }
}

impl Machine {
    /// True for a software device. The times of such a device do not predict GPU rankings.
    pub fn is_software(&self) -> bool {
        self.device_kind == "cpu"
    }
}
