//! Changes between two results: verdicts, and values that differ by more than their spreads.

use super::machine::short_commit;
use super::words::human;
use super::{CellOutcome, Results, Row, Value};
use crate::stats::Summary;
use serde::Serialize;
use std::collections::BTreeMap;

/// Differences between stored results and new results.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Changes {
    /// The stored results: device, date, commit, effort.
    pub before: String,
    pub claims: Vec<ClaimChange>,
    /// Sorted by the factor of the change, up or down, largest first; changes without a ratio last.
    pub values: Vec<ValueChange>,
    /// Values in both results.
    pub common: usize,
    /// Number of values and claims that are only in the stored results (`gone`), or only in the new results (`new`).
    pub gone: usize,
    pub new: usize,
}

/// A claim whose verdict changed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ClaimChange {
    pub figure: String,
    pub claim: String,
    pub before: &'static str,
    pub after: &'static str,
    pub numbers_before: String,
    pub numbers_after: String,
}

/// A value that changed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ValueChange {
    pub figure: String,
    /// Scene, value of the sweep, variant and quantity.
    pub what: String,
    pub before: String,
    pub after: String,
    /// The value after, divided by the value before; `None` unless both are numbers in the same unit and the ratio is
    /// positive and finite.
    pub ratio: Option<f64>,
}

impl Changes {
    /// Compares the figures of `after`; other figures of `before` are ignored. Repeated measurements differ if their
    /// intervals from p5 to p95 are disjoint. Two curves differ if their intervals at any common x are disjoint, or if
    /// they have no common x. Other values differ unless they are equal.
    pub fn between(before: &Results, after: &Results) -> Changes {
        let asked = |id: &str| after.figures.iter().any(|figure| figure.id == id);
        let before = &Results {
            figures: before.figures.iter().filter(|figure| asked(&figure.id)).cloned().collect(),
            ..before.clone()
        };
        let (then, now) = (values_of(before), values_of(after));
        let common = || now.iter().filter_map(|(key, row)| Some((key, *then.get(key)?, *row)));
        let mut values: Vec<ValueChange> =
            common().filter_map(|(key, then, now)| change(key, then, now)).collect();
        let size = |change: &ValueChange| change.ratio.map_or(-1.0, |ratio| ratio.ln().abs());
        values.sort_by(|a, b| size(b).total_cmp(&size(a)));
        let claims = |results: &Results| -> BTreeMap<[String; 2], super::Finding> {
            let all = results.claims();
            all.map(|(f, c)| ([f.id.clone(), c.id.clone()], c.finding.clone())).collect()
        };
        let (claims_then, claims_now) = (claims(before), claims(after));
        let only = |a: usize, b: usize, both: usize| a + b - both;
        let both = common().count() + claims_now.keys().filter(|key| claims_then.contains_key(*key)).count();
        Changes {
            before: described(before),
            claims: claim_changes(&claims_then, &claims_now),
            values,
            common: common().count(),
            gone: only(then.len(), claims_then.len(), both),
            new: only(now.len(), claims_now.len(), both),
        }
    }

    /// Terminal text: the changed verdicts and the `max` largest changes of values.
    pub fn lines(&self, max: usize) -> Vec<String> {
        let mut lines = vec![format!("against {}:", self.before)];
        for c in &self.claims {
            let numbers = format!("{} -> {}", c.numbers_before, c.numbers_after);
            lines.push(format!("verdict  {} {}: {} -> {} ({numbers})", c.figure, c.claim, c.before, c.after));
        }
        for c in self.values.iter().take(max) {
            let ratio = c.ratio.map(|ratio| format!(" ({}x)", human(ratio))).unwrap_or_default();
            lines.push(format!("value    {} {}: {} -> {}{ratio}", c.figure, c.what, c.before, c.after));
        }
        if self.values.len() > max {
            lines.push(format!("…        {} more values changed: see the page", self.values.len() - max));
        }
        let (changed, common) = (self.values.len(), self.common);
        lines.push(format!(
            "{changed} of {common} common values changed beyond their spreads, {} verdicts changed; \
             only in the stored results: {}, only in the new ones: {}",
            self.claims.len(),
            self.gone,
            self.new
        ));
        lines
    }
}

fn described(results: &Results) -> String {
    let of = |m: &super::Machine| {
        format!("{}, {}, {}, commit {}", m.device, m.processor, m.date, short_commit(&m.commit))
    };
    let machines: Vec<String> = results.machines.iter().map(of).collect();
    format!("{} ({})", machines.join("; "), results.effort.name())
}

/// The figure's id; then scene, value of the sweep, variant and quantity as one text.
type Key = [String; 2];

fn values_of(results: &Results) -> BTreeMap<Key, &Row> {
    let mut found = BTreeMap::new();
    for figure in &results.figures {
        for cell in &figure.cells {
            let CellOutcome::Rows(rows) = &cell.outcome else { continue };
            for row in rows {
                let what = format!("{}, {}, {}", cell.cell, row.variant, row.quantity);
                found.insert([figure.id.clone(), what], row);
            }
        }
    }
    found
}

/// True if the p5 .. p95 intervals overlap.
fn meet(then: &Summary, now: &Summary) -> bool {
    then.p5 <= now.p95 && now.p5 <= then.p95
}

fn change([figure, what]: &Key, before: &Row, after: &Row) -> Option<ValueChange> {
    let same = match (&before.value, &after.value) {
        (Value::Summary(then), Value::Summary(now)) => meet(then, now),
        (Value::Spreads(then), Value::Spreads(now)) => {
            // Points whose x is in only one of the results are not compared.
            let beside = |x: f64| now.iter().find(|(other, _)| *other == x).map(|(_, now)| now);
            let mut pairs = then.iter().filter_map(|(x, then)| Some((then, beside(*x)?))).peekable();
            pairs.peek().is_some() && pairs.all(|(then, now)| meet(then, now))
        }
        // NaN != NaN, but NaN in both results is no change.
        (Value::Number(then), Value::Number(now)) => then == now || (then.is_nan() && now.is_nan()),
        (then, now) => then == now,
    };
    if same && before.unit == after.unit {
        return None;
    }
    let ratio = match (before.value.number(), after.value.number()) {
        (Some(then), Some(now)) if before.unit == after.unit => {
            Some(now / then).filter(|ratio| ratio.is_finite() && *ratio > 0.0)
        }
        _ => None,
    };
    let [before, after] = [before, after].map(shown);
    Some(ValueChange { figure: figure.clone(), what: what.clone(), before, after, ratio })
}

fn shown(row: &Row) -> String {
    let unit = if row.unit.is_empty() { String::new() } else { format!(" {}", row.unit) };
    match &row.value {
        Value::Summary(summary) => format!("{}{unit}", human(summary.median)),
        Value::Number(number) => format!("{}{unit}", human(*number)),
        Value::Series(points) => format!("a series of {}", points.len()),
        Value::Spreads(points) => format!("a series of {} spreads", points.len()),
        Value::Text(text) => text.clone(),
        Value::Missing(why) => format!("missing: {why}"),
    }
}

fn claim_changes(
    before: &BTreeMap<Key, super::Finding>,
    after: &BTreeMap<Key, super::Finding>,
) -> Vec<ClaimChange> {
    let changed = |(key, now): (&Key, &super::Finding)| {
        let then = before.get(key).filter(|then| then.verdict != now.verdict)?;
        let [figure, claim] = key.clone();
        Some(ClaimChange {
            figure,
            claim,
            before: then.verdict.name(),
            after: now.verdict.name(),
            numbers_before: then.numbers.clone(),
            numbers_after: now.numbers.clone(),
        })
    };
    after.iter().filter_map(changed).collect()
}
