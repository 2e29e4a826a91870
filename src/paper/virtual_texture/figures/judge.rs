//! From numbers to a verdict, the same way for every claim that one thing is cheaper than another.

use crate::figure::{Finding, Table, Value, Verdict};
use crate::stats::Summary;

/// A scene and a value of the sweep at which something was measured.
pub type At = (String, Option<f64>);

/// A variant's number over another's, in one place.
#[derive(Clone, Debug, PartialEq)]
pub struct Ratio {
    pub at: At,
    /// Names, where they differ from place to place ("best of").
    pub of: String,
    pub value: f64,
    /// p5 and p95, where the ratio was taken in each round.
    pub range: Option<[f64; 2]>,
    /// The ranges p5 to p95 of both overlap, or the ratio's own holds 1: neither is the faster one.
    pub tie: bool,
}

/// Where a table has anything, in order.
pub fn places(table: &Table) -> Vec<At> {
    let mut places: Vec<At> = Vec::new();
    for record in &table.records {
        let at = (record.scene.clone(), record.x);
        if !places.contains(&at) {
            places.push(at);
        }
    }
    places
}

/// The variant with the least `quantity` in a place, of those that have it.
pub fn least<'a>(table: &Table, at: &At, quantity: &str, variants: &'a [String]) -> Option<&'a String> {
    let number = |variant: &&String| table.number(&at.0, at.1, variant, quantity);
    let measured = variants.iter().filter(|variant| number(variant).is_some());
    measured.min_by(|a, b| number(a).partial_cmp(&number(b)).expect("medians are numbers"))
}

/// `dear` over `cheap` in each place that has both; of several variants the best one of the place is taken.
pub fn ratios(table: &Table, quantity: &str, dear: &[String], cheap: &[String]) -> Vec<Ratio> {
    let ratio = |at: At| {
        let dear_name = least(table, &at, quantity, dear)?;
        let cheap_name = least(table, &at, quantity, cheap)?;
        let value = |name| table.value(&at.0, at.1, name, quantity);
        let (above, below) = (value(dear_name)?, value(cheap_name)?);
        let of = [(dear, dear_name), (cheap, cheap_name)]
            .into_iter()
            .filter(|(all, _)| all.len() > 1)
            .map(|(_, name)| name.as_str());
        let of = of.collect::<Vec<_>>().join(" over ");
        let value = above.number()? / below.number()?;
        Some(Ratio { of, value, range: None, tie: overlap(above, below), at })
    };
    places(table).into_iter().filter_map(ratio).collect()
}

/// The best of the variants in each place by a `quantity` that is a ratio already, taken round by round: the least
/// where `bound` is a ceiling, else the most.
pub fn best(table: &Table, quantity: &str, variants: &[String], bound: Bound) -> Vec<Ratio> {
    let ratio = |at: At| {
        let measured = variants.iter().filter_map(|name| {
            let value = table.value(&at.0, at.1, name, quantity)?;
            Some((name, value, value.number()?))
        });
        let (name, value, number) = measured.min_by(|(.., a), (.., b)| match bound {
            Bound::AtMost(_) => a.total_cmp(b),
            Bound::AtLeast(_) | Bound::Wins => b.total_cmp(a),
        })?;
        let range = match value {
            Value::Summary(Summary { p5, p95, .. }) => Some([*p5, *p95]),
            _ => None,
        };
        let of = if variants.len() > 1 { name.clone() } else { String::new() };
        Some(Ratio {
            at,
            of,
            value: number,
            tie: range.is_some_and(|[p5, p95]| p5 <= 1.0 && 1.0 <= p95),
            range,
        })
    };
    places(table).into_iter().filter_map(ratio).collect()
}

fn overlap(a: &Value, b: &Value) -> bool {
    let range = |value: &Value| match value {
        Value::Summary(Summary { p5, p95, .. }) => Some((*p5, *p95)),
        other => other.number().map(|number| (number, number)),
    };
    match (range(a), range(b)) {
        (Some(a), Some(b)) => a.0 <= b.1 && b.0 <= a.1,
        _ => false,
    }
}

/// Each place with its ratio: `earth/oblique 2.70 [2.60 .. 2.90] (tile-memo)`.
pub fn words(ratios: &[Ratio]) -> String {
    let word = |Ratio { at: (scene, x), of, value, range, tie }: &Ratio| {
        let x = x.map_or(String::new(), |x| format!(" at {x}"));
        let of = if of.is_empty() { String::new() } else { format!(" ({of})") };
        let tie = if *tie { " (within the spread)" } else { "" };
        let range = range.map_or(String::new(), |[p5, p95]| format!(" [{} .. {}]", short(p5), short(p95)));
        format!("{scene}{x} {}{range}{of}{tie}", short(*value))
    };
    ratios.iter().map(word).collect::<Vec<_>>().join(", ")
}

/// Three digits: 0.0123, 1.23, 12.3, 123, 1234.
pub fn short(number: f64) -> String {
    if number == 0.0 || !number.is_finite() {
        return format!("{number}");
    }
    let digits = (2 - number.abs().log10().floor() as i32).clamp(0, 6);
    format!("{number:.*}", digits as usize)
}

/// Why `quantity` of `variants` is nowhere in the table.
pub fn why_none(table: &Table, quantity: &str, variants: &[String]) -> String {
    let of = |r: &&crate::figure::Record| variants.contains(&r.row.variant) && r.row.quantity == quantity;
    let missing = table.records.iter().filter(of).find_map(|r| match &r.row.value {
        Value::Missing(reason) => Some(format!("{}: {reason}", r.row.variant)),
        _ => None,
    });
    missing.unwrap_or_else(|| match table.missing {
        0 => format!("no {quantity} of {} was measured", variants.join(", ")),
        cells => format!("{cells} cells are missing"),
    })
}

/// What a ratio must be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    AtLeast(f64),
    AtMost(f64),
    /// Above 1, and the ranges of both do not overlap.
    Wins,
}

impl Bound {
    fn met(self, ratio: &Ratio) -> bool {
        match self {
            Bound::AtLeast(bound) => ratio.value >= bound,
            Bound::AtMost(bound) => ratio.value <= bound,
            Bound::Wins => ratio.value > 1.0 && !ratio.tie,
        }
    }

    fn words(self) -> String {
        match self {
            Bound::AtLeast(bound) => format!("reach {}x", short(bound)),
            Bound::AtMost(bound) => format!("stay within {}x", short(bound)),
            Bound::Wins => "have a clear winner".into(),
        }
    }
}

/// The verdict on a bound that every place is to meet; without any ratio `why_none` says why it cannot be told.
pub fn judge(table: &Table, bound: Bound, ratios: &[Ratio], why_none: impl FnOnce() -> String) -> Finding {
    if ratios.is_empty() {
        return Finding::new(Verdict::NotMeasurable, "", why_none());
    }
    let met = ratios.iter().filter(|ratio| bound.met(ratio)).count();
    let verdict = match met {
        0 => Verdict::NotReproduced,
        all if all == ratios.len() && table.missing == 0 => Verdict::Reproduced,
        _ => Verdict::InPart,
    };
    let mut why = format!("{met} of {} places {}", ratios.len(), bound.words());
    if table.missing > 0 {
        why += &format!("; {} cells are missing", table.missing);
    }
    Finding::new(verdict, words(ratios), why)
}

/// As `finding`, where it was measured on a GPU; on a processor that poses as one the numbers stand and judge nothing.
///
/// Which claims pass through here: those of the paper that one thing is faster than another, or fast enough, for it speaks
/// of GPUs. Counts and errors are any device's; and what we claim ourselves is of the device at hand, this one included.
pub fn on_a_gpu(table: &Table, finding: Finding) -> Finding {
    if !table.machine.is_software() || finding.verdict == Verdict::NotMeasurable {
        return finding;
    }
    let why = format!("{} is a software device, whose times rank nothing on a GPU", table.machine.device);
    Finding::new(Verdict::NotMeasurable, finding.numbers, why)
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::figure::{Machine, Record, Row};

    /// Times whose p5 and p95 lie a twentieth around the median.
    pub fn summary(median: f64) -> Value {
        let (p5, p95) = (0.95 * median, 1.05 * median);
        Value::Summary(Summary { count: 10, min: p5, p5, median, p95, max: p95 })
    }

    /// A table of times: (scene, x, variant, quantity, median).
    pub fn table(device_kind: &str, rows: &[(&str, Option<f64>, &str, &str, f64)]) -> Table {
        let record = |&(scene, x, variant, quantity, median): &(&str, Option<f64>, &str, &str, f64)| Record {
            scene: scene.into(),
            x,
            row: Row::new(variant, quantity, "ms", summary(median)),
        };
        Table { machine: machine(device_kind), records: rows.iter().map(record).collect(), missing: 0 }
    }

    fn machine(device_kind: &str) -> Machine {
        Machine {
            device: "Some device".into(),
            device_kind: device_kind.into(),
            driver: String::new(),
            vulkan: "1.3".into(),
            processor: String::new(),
            cores: 2,
            commit: String::new(),
            date: "2026-11-21".into(),
        }
    }

    fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| name.to_string()).collect()
    }

    fn finding(bound: Bound, rows: &[(&str, Option<f64>, &str, &str, f64)]) -> Finding {
        let table = table("discrete", rows);
        judge(&table, bound, &ratios(&table, "t", &names(&["a"]), &names(&["b", "c"])), || "none".into())
    }

    #[test]
    fn the_best_of_several_is_taken_in_each_place_and_named() {
        let rows = [
            ("s", None, "a", "t", 12.0),
            ("s", None, "b", "t", 4.0),
            ("s", None, "c", "t", 3.0),
            ("u", Some(2.0), "a", "t", 12.0),
            ("u", Some(2.0), "b", "t", 2.0),
        ];
        let found = finding(Bound::AtLeast(3.0), &rows);
        assert_eq!(found.verdict, Verdict::Reproduced);
        assert_eq!(found.numbers, "s 4.00 (c), u at 2 6.00 (b)");
    }

    #[test]
    fn every_some_or_no_place_makes_the_verdict() {
        let two = |first: f64, second: f64| {
            let rows = [
                ("s", None, "a", "t", first),
                ("s", None, "b", "t", 1.0),
                ("u", None, "a", "t", second),
                ("u", None, "b", "t", 1.0),
            ];
            finding(Bound::AtLeast(3.0), &rows).verdict
        };
        assert_eq!(two(3.0, 9.0), Verdict::Reproduced);
        assert_eq!(two(2.9, 9.0), Verdict::InPart);
        assert_eq!(two(2.9, 0.1), Verdict::NotReproduced);
    }

    #[test]
    fn a_tie_is_no_winner_but_may_meet_a_larger_bound() {
        let rows = [("s", None, "a", "t", 1.02), ("s", None, "b", "t", 1.0)];
        let found = finding(Bound::Wins, &rows);
        assert_eq!(found.verdict, Verdict::NotReproduced);
        assert!(found.numbers.contains("within the spread"), "{found:?}");
        assert_eq!(finding(Bound::AtLeast(0.8), &rows).verdict, Verdict::Reproduced);
        let clear = [("s", None, "a", "t", 1.2), ("s", None, "b", "t", 1.0)];
        assert_eq!(finding(Bound::Wins, &clear).verdict, Verdict::Reproduced);
    }

    #[test]
    fn a_ratio_that_was_taken_in_each_round_is_told_with_its_range_and_the_best_one_counts() {
        let rows =
            [("s", None, "a", "over", 1.8), ("s", None, "b", "over", 2.3), ("u", None, "b", "over", 1.02)];
        let table = table("discrete", &rows);
        let found = |bound| best(&table, "over", &names(&["a", "b"]), bound);
        assert_eq!(words(&found(Bound::AtMost(2.0))[..1]), "s 1.80 [1.71 .. 1.89] (a)");
        let values = |bound| found(bound).iter().map(|ratio| ratio.value).collect::<Vec<f64>>();
        assert_eq!(values(Bound::AtMost(2.0)), [1.8, 1.02]);
        assert_eq!(values(Bound::AtLeast(2.0)), [2.3, 1.02]);
        assert_eq!(found(Bound::Wins).iter().map(|ratio| ratio.tie).collect::<Vec<_>>(), [false, true]);
        assert_eq!(best(&table, "over", &names(&["c"]), Bound::Wins), []);
    }

    #[test]
    fn a_ceiling_is_met_from_below() {
        let rows = [("s", None, "a", "t", 1.9), ("s", None, "b", "t", 1.0)];
        assert_eq!(finding(Bound::AtMost(2.0), &rows).verdict, Verdict::Reproduced);
        assert_eq!(finding(Bound::AtMost(1.8), &rows).verdict, Verdict::NotReproduced);
    }

    #[test]
    fn what_is_missing_makes_no_claim_true_and_is_told() {
        let mut cut = table("discrete", &[("s", None, "a", "t", 9.0), ("s", None, "b", "t", 1.0)]);
        cut.missing = 2;
        let (a, b, c) = (names(&["a"]), names(&["b"]), names(&["c"]));
        let found = judge(&cut, Bound::AtLeast(3.0), &ratios(&cut, "t", &a, &b), || "none".into());
        assert_eq!(found.verdict, Verdict::InPart);
        assert!(found.why.contains("2 cells are missing"), "{}", found.why);
        let none = ratios(&cut, "t", &a, &c);
        let found = judge(&cut, Bound::AtLeast(3.0), &none, || why_none(&cut, "t", &c));
        assert_eq!((found.verdict, &*found.why), (Verdict::NotMeasurable, "2 cells are missing"));
        let reason = Row::new("c", "t", "ms", Value::Missing("no geometry shader".into()));
        cut.records.push(Record { scene: "s".into(), x: None, row: reason });
        assert_eq!(why_none(&cut, "t", &c), "c: no geometry shader");
    }

    #[test]
    fn a_software_device_keeps_its_numbers_and_judges_nothing() {
        let rows = [("s", None, "a", "t", 9.0), ("s", None, "b", "t", 1.0)];
        let verdict = |kind| {
            let table = table(kind, &rows);
            let found = ratios(&table, "t", &names(&["a"]), &names(&["b"]));
            on_a_gpu(&table, judge(&table, Bound::AtLeast(3.0), &found, || "none".into()))
        };
        assert_eq!(verdict("discrete").verdict, Verdict::Reproduced);
        let software = verdict("cpu");
        assert_eq!((software.verdict, &*software.numbers), (Verdict::NotMeasurable, "s 9.00"));
        assert!(software.why.contains("software"), "{}", software.why);
    }

    #[test]
    fn three_digits_whatever_the_size() {
        let written = [0.0, 0.012345, 1.2345, 12.345, 123.45, 1234.5].map(short);
        assert_eq!(written, ["0", "0.0123", "1.23", "12.3", "123", "1234"]);
    }
}
