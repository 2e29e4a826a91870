//! What this paper's figures share: one variant's time over another's, round by round, and the verdict on such gains.

use crate::figure::{Contender, Finding, Row, Table, Timed, Value, Verdict};
use crate::stats::Summary;
use crate::vk::{Cmd, Gpu};

/// A contender of one pass.
pub fn pass<'a>(
    gpu: &'a Gpu,
    variant: impl Into<String>,
    mut record: impl FnMut(&mut Cmd<'_>) -> crate::vk::Result<()> + 'a,
) -> Contender<'a> {
    let variant = variant.into();
    let label = variant.clone();
    let run = move || {
        let mut frame = gpu.frame()?;
        frame.pass(&label, &mut record)?;
        Ok(frame.submit()?.wait()?)
    };
    Contender { variant, run: Box::new(run) }
}

/// `baseline`'s time over each other's, round by round: above 1 the other is faster.
pub fn gains(timed: &[Timed], baseline: &str, quantity: &str) -> Vec<Row> {
    let of = |name: &str| timed.iter().find(|one| one.variant == name)?.total_of_rounds();
    let Some(slow) = of(baseline) else { return Vec::new() };
    let others = timed.iter().filter(|one| one.variant != baseline && one.variant != "empty pass");
    let row = |one: &Timed| {
        let gain = Summary::of_pairs(&slow, &one.total_of_rounds()?, |slow, fast| slow / fast)?;
        Some(Row::new(&*one.variant, quantity, "", Value::Summary(gain)))
    };
    others.filter_map(row).collect()
}

/// What must hold in each place of (a place's words, its number with p5 and p95).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// The whole range.
    AtLeast(f64),
    /// Any of the range.
    MayReach(f64),
    /// The whole range.
    AtMost(f64),
}

impl Bound {
    fn met(self, summary: &Summary) -> bool {
        match self {
            Bound::AtLeast(bound) => summary.p5 >= bound,
            Bound::MayReach(bound) => summary.p95 >= bound,
            Bound::AtMost(bound) => summary.p95 <= bound,
        }
    }

    fn words(self) -> String {
        match self {
            Bound::AtLeast(bound) => format!("at least {bound}"),
            Bound::MayReach(bound) => format!("not below {bound} beyond their spread"),
            Bound::AtMost(bound) => format!("at most {bound}"),
        }
    }
}

/// The verdict on `quantity` of `variant` wherever it was measured and `counts`.
pub fn judge(
    table: &Table,
    quantity: &str,
    variant: &str,
    bound: Bound,
    counts: impl Fn(&str, Option<f64>) -> bool,
) -> Finding {
    let records = table.of(quantity).filter(|r| r.row.variant == variant && counts(&r.scene, r.x));
    let (mut met, mut words) = (Vec::new(), Vec::new());
    for record in records {
        let summary = match &record.row.value {
            Value::Summary(summary) => *summary,
            Value::Number(number) => {
                Summary { count: 1, min: *number, p5: *number, median: *number, p95: *number, max: *number }
            }
            _ => continue,
        };
        met.push(bound.met(&summary));
        let at = record.x.map_or(String::new(), |x| format!(" at {x}"));
        words.push(format!("{}{at} {:.3}", record.scene, summary.median));
    }
    let holding = met.iter().filter(|&&met| met).count();
    let why = format!("{holding} of {} places are {}", met.len(), bound.words());
    let verdict = match holding {
        _ if met.is_empty() && table.missing > 0 => Verdict::NotMeasured,
        _ if met.is_empty() => Verdict::NotMeasurable,
        0 => Verdict::NotReproduced,
        all if all == met.len() && table.missing == 0 => Verdict::Reproduced,
        _ => Verdict::InPart,
    };
    Finding::new(verdict, words.join(", "), why)
}

/// As `finding` on a GPU; a software device's times judge no paper.
pub fn on_a_gpu(table: &Table, finding: Finding) -> Finding {
    if !table.machine.is_software()
        || matches!(finding.verdict, Verdict::NotMeasurable | Verdict::NotMeasured)
    {
        return finding;
    }
    let why = format!("{} is a software device, whose times rank nothing on a GPU", table.machine.device);
    Finding::new(Verdict::NotMeasurable, finding.numbers, why)
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::figure::{Machine, Record};

    /// A table of (scene, x, variant, quantity, median), each with p5 and p95 a tenth around it.
    pub fn table_of(kind: &str, rows: &[(&str, Option<f64>, &str, &str, f64)]) -> Table {
        let machine = Machine {
            device: "Some device".into(),
            device_kind: kind.into(),
            driver: String::new(),
            vulkan: String::new(),
            processor: String::new(),
            cores: 2,
            commit: String::new(),
            date: String::new(),
        };
        let record = |&(scene, x, variant, quantity, median): &(&str, Option<f64>, &str, &str, f64)| {
            let (p5, p95) = (median - 0.1, median + 0.1);
            let summary = Summary { count: 10, min: p5, p5, median, p95, max: p95 };
            Record { scene: scene.into(), x, row: Row::new(variant, quantity, "", Value::Summary(summary)) }
        };
        Table { machine, records: rows.iter().map(record).collect(), missing: 0 }
    }

    fn gains_of(kind: &str, numbers: &[f64]) -> Table {
        let rows: Vec<_> = numbers.iter().map(|&gain| ("s", Some(gain), "a", "gain", gain)).collect();
        table_of(kind, &rows)
    }

    #[test]
    fn a_bound_is_met_by_the_whole_range_everywhere_somewhere_or_nowhere() {
        let verdict = |bound, numbers: &[f64]| {
            judge(&gains_of("cpu", numbers), "gain", "a", bound, |_, _| true).verdict
        };
        assert_eq!(verdict(Bound::AtLeast(1.25), &[1.4, 1.36]), Verdict::Reproduced);
        assert_eq!(verdict(Bound::AtLeast(1.25), &[1.4, 1.3]), Verdict::InPart);
        assert_eq!(verdict(Bound::AtLeast(1.25), &[1.3]), Verdict::NotReproduced);
        assert_eq!(verdict(Bound::MayReach(1.25), &[1.2]), Verdict::Reproduced);
        assert_eq!(verdict(Bound::MayReach(1.25), &[1.1]), Verdict::NotReproduced);
        assert_eq!(verdict(Bound::AtMost(1.25), &[1.1]), Verdict::Reproduced);
        assert_eq!(verdict(Bound::AtMost(1.25), &[1.2]), Verdict::NotReproduced);
        assert_eq!(verdict(Bound::AtMost(1.25), &[]), Verdict::NotMeasurable);
    }

    #[test]
    fn only_places_that_count_are_judged() {
        let table = gains_of("cpu", &[1.0, 2.0]);
        let finding = judge(&table, "gain", "a", Bound::AtLeast(1.5), |_, x| x == Some(2.0));
        assert_eq!((finding.verdict, &*finding.numbers), (Verdict::Reproduced, "s at 2 2.000"));
    }

    #[test]
    fn a_missing_cell_and_a_software_device_are_no_success() {
        let mut cut = gains_of("cpu", &[1.4]);
        cut.missing = 1;
        let found = judge(&cut, "gain", "a", Bound::AtLeast(1.0), |_, _| true);
        assert_eq!(found.verdict, Verdict::InPart);
        assert_eq!(on_a_gpu(&cut, found.clone()).verdict, Verdict::NotMeasurable);
        assert_eq!(on_a_gpu(&gains_of("discrete", &[]), found).verdict, Verdict::InPart);
    }

    #[test]
    fn a_gain_is_taken_round_by_round() {
        let timed = |variant: &str, ms: [u64; 3]| {
            let pass =
                |ms: u64| vec![crate::vk::PassTime { label: variant.into(), ns: Some(ms * 1_000_000) }];
            Timed::of(variant, ms.map(pass).to_vec())
        };
        let all =
            [timed("slow", [20, 400, 60]), timed("fast", [10, 200, 20]), timed("empty pass", [1, 1, 1])];
        let rows = gains(&all, "slow", "gain");
        assert_eq!(rows.len(), 1);
        assert_eq!((&*rows[0].variant, rows[0].value.number()), ("fast", Some(2.0)));
        assert!(gains(&all, "absent", "gain").is_empty());
    }
}
