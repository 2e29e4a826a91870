//! Looks up the numbers of a claim in a table.

use super::super::claim::{At, Pick, Places, Statistic, VariantPick};
use super::super::{Row, Table, TableRecord, Value};
use crate::stats::median;

/// A variant's number at one place.
#[derive(Clone, Debug, PartialEq)]
pub struct ClaimSample {
    pub variant: String,
    pub unit: String,
    /// Median of `rounds` (of the even rounds if `chosen`), or an exact number.
    pub value: f64,
    /// Empty if `value` is judged as it is: an exact number, a minimum, a maximum, or a mean over scenes.
    pub rounds: Vec<f64>,
    /// Where the number was measured: the sweep's value, or x in a series.
    pub x: Option<f64>,
    /// Scene and value of the sweep. Samples of the same cell were measured in interleaved rounds.
    pub cell: (String, Option<f64>),
    /// True if the variant was chosen from several variants by the even `rounds`. Only the odd rounds then count for
    /// the judgement ([`ClaimSample::judged`]).
    pub chosen: bool,
}

/// The samples for a pick.
#[derive(Debug, Default)]
pub struct FoundSamples {
    pub samples: Vec<ClaimSample>,
    /// Why a variant does not run here.
    pub why_not: Option<String>,
}

/// A scene, or several averaged scenes, at a value of the sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneAt {
    pub scenes: Vec<String>,
    pub x: Option<f64>,
}

impl SceneAt {
    /// True if `other` is the same place, or if `self` is a whole scene and `other` is one value of its sweep.
    pub fn covers(&self, other: &SceneAt) -> bool {
        self.scenes == other.scenes && (self.x.is_none() || self.x == other.x)
    }

    /// `earth/oblique at 720`
    pub fn name(&self) -> String {
        let scene = match &self.scenes[..] {
            [scene] => scene.clone(),
            scenes => format!("mean of {}", scenes.len()),
        };
        self.x.map_or(scene.clone(), |x| format!("{scene} at {x}"))
    }
}

/// The places of a table that match `places`, in the table's order. Without `swept`, values of the sweep are
/// not separate places.
pub fn places(table: &Table, places: &Places, swept: bool) -> Vec<SceneAt> {
    let mut found: Vec<SceneAt> = Vec::new();
    for record in table.records.iter().filter(|record| places.hold(&record.scene, record.x)) {
        let scenes = match places.mean {
            true => places.scenes.iter().map(ToString::to_string).collect(),
            false => vec![record.scene.clone()],
        };
        let place = SceneAt { scenes, x: record.x.filter(|_| swept) };
        if !found.contains(&place) {
            found.push(place);
        }
    }
    found
}

fn number(row: &Row, part: Statistic) -> Option<f64> {
    match (&row.value, part) {
        (Value::Summary(summary), Statistic::Least) => Some(summary.min),
        (Value::Summary(summary), Statistic::Most) => Some(summary.max),
        (value, _) => value.number(),
    }
}

fn sample(record: &TableRecord, part: Statistic) -> Option<ClaimSample> {
    Some(ClaimSample {
        variant: record.row.variant.clone(),
        unit: record.row.unit.clone(),
        value: number(&record.row, part)?,
        rounds: if part == Statistic::Median { record.row.rounds.clone() } else { Vec::new() },
        x: record.x,
        cell: (record.scene.clone(), record.x),
        chosen: false,
    })
}

impl FoundSamples {
    /// The samples of a pick in a place.
    pub fn of(table: &Table, pick: &Pick, place: &SceneAt) -> FoundSamples {
        let mut found = match &place.scenes[..] {
            [scene] => FoundSamples::in_scene(table, pick, pick.scene.unwrap_or(scene), place.x),
            scenes => {
                let each =
                    scenes.iter().map(|scene| FoundSamples::in_scene(table, pick, scene, place.x)).collect();
                FoundSamples::mean(each)
            }
        };
        match pick.who {
            VariantPick::Best(_) => found.samples = best(found.samples).into_iter().collect(),
            _ if pick.x == At::Least => {
                found.samples = found.samples.into_iter().min_by(by_value).into_iter().collect();
            }
            _ => {}
        }
        found
    }

    fn in_scene(table: &Table, pick: &Pick, scene: &str, x: Option<f64>) -> FoundSamples {
        let named = |variant: &str| match pick.who {
            VariantPick::One(name) => variant == name,
            VariantPick::Others(name) => variant != name,
            VariantPick::Best(names) | VariantPick::Each(names) => names().iter().any(|name| name == variant),
        };
        let there = |at: Option<f64>| match pick.x {
            At::Place | At::Points(..) => at == x,
            At::X(x) => at == Some(x),
            At::Least => true,
        };
        let mut found = FoundSamples::default();
        let of = table.of(pick.quantity).filter(|record| record.scene == scene && there(record.x));
        for record in of.filter(|record| named(&record.row.variant)) {
            match (&record.row.value, pick.x) {
                (Value::Missing(why), _) => found.why_not = Some(format!("{}: {why}", record.row.variant)),
                (Value::Series(points), At::Points(low, high)) => {
                    let inside = points.iter().filter(|[x, _]| (low..=high).contains(x));
                    found.samples.extend(inside.map(|&[x, value]| ClaimSample {
                        value,
                        x: Some(x),
                        rounds: Vec::new(),
                        variant: record.row.variant.clone(),
                        unit: record.row.unit.clone(),
                        cell: (record.scene.clone(), record.x),
                        chosen: false,
                    }));
                }
                _ => found.samples.extend(sample(record, pick.part)),
            }
        }
        found
    }

    /// The mean of each variant over the scenes, for variants with a number in every scene.
    fn mean(each: Vec<FoundSamples>) -> FoundSamples {
        let why_not = each.iter().find_map(|found| found.why_not.clone());
        let first = each.first().map_or(&[][..], |found| &found.samples);
        let mean = |first: &ClaimSample| {
            let of = |found: &FoundSamples| {
                found.samples.iter().find(|s| s.variant == first.variant).map(|s| s.value)
            };
            let values: Option<Vec<f64>> = each.iter().map(of).collect();
            let values = values?;
            let value = values.iter().sum::<f64>() / values.len() as f64;
            Some(ClaimSample { value, rounds: Vec::new(), ..first.clone() })
        };
        FoundSamples { samples: first.iter().filter_map(mean).collect(), why_not }
    }
}

fn by_value(a: &ClaimSample, b: &ClaimSample) -> std::cmp::Ordering {
    a.value.total_cmp(&b.value)
}

/// The sample with the least value. If the measurements are repeated, the sample is chosen on the even rounds and
/// judged on the odd rounds ([`ClaimSample::judged`]), so that a lucky round does not bias the judgement.
fn best(mut samples: Vec<ClaimSample>) -> Option<ClaimSample> {
    if samples.len() > 1 && samples.iter().all(|sample| sample.rounds.len() > 1) {
        for sample in &mut samples {
            sample.value = sample.every_second(0).value;
            sample.chosen = true;
        }
    }
    samples.into_iter().min_by(by_value)
}

impl ClaimSample {
    fn every_second(&self, first: usize) -> ClaimSample {
        let rounds: Vec<f64> = self.rounds.iter().skip(first).step_by(2).copied().collect();
        ClaimSample { value: median(&rounds).unwrap_or(self.value), rounds, ..self.clone() }
    }

    /// The sample with only its odd rounds, to compare it with a sample that was chosen on the even rounds.
    pub fn judged(&self) -> ClaimSample {
        self.every_second(1)
    }

    /// True if the rounds of both samples were interleaved.
    pub fn pairs_with(&self, other: &ClaimSample) -> bool {
        !self.rounds.is_empty() && self.rounds.len() == other.rounds.len() && self.cell == other.cell
    }
}
