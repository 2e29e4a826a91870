//! What the rows say of the figure's claims.

use super::super::judge::{At, Bound, judge, places, ratios, why_none};
use super::watch::{SUBSAMPLINGS, name};
use super::{ALL_PIXELS, FALSE_TILES, MOVING_PRECISION, MOVING_RECALL, TIME, TO_99, TO_ALL, variants};
use crate::figure::{Finding, Record, Table, Value, Verdict};
use crate::paper::virtual_texture::feedback::cycle;

/// The verdict on what `holds` of every record of `quantity` of `variants`; how many it holds of, and of how many.
fn everywhere(
    table: &Table,
    quantity: &str,
    variants: &[String],
    holds: impl Fn(&Record) -> bool,
) -> (Verdict, usize, usize) {
    let measured = |r: &&Record| variants.contains(&r.row.variant) && r.row.value.number().is_some();
    let records: Vec<&Record> = table.of(quantity).filter(measured).collect();
    let met = records.iter().filter(|record| holds(record)).count();
    let verdict = match met {
        _ if records.is_empty() => Verdict::NotMeasurable,
        0 => Verdict::NotReproduced,
        met if met == records.len() && table.missing == 0 => Verdict::Reproduced,
        _ => Verdict::InPart,
    };
    (verdict, met, records.len())
}

/// The ends of what was measured.
fn least(record: &Record) -> f64 {
    match &record.row.value {
        Value::Summary(summary) => summary.min,
        value => value.number().unwrap_or(f64::NAN),
    }
}

fn most(record: &Record) -> f64 {
    match &record.row.value {
        Value::Summary(summary) => summary.max,
        value => value.number().unwrap_or(f64::NAN),
    }
}

/// A quantity's medians in every place, least to most of the variants, and the ends of all: `earth/oblique 17 to 40
/// (1 to 93)`.
fn medians(table: &Table, quantity: &str, variants: &[String]) -> String {
    let short =
        |number: f64| if number.fract() == 0.0 { format!("{number}") } else { format!("{number:.2}") };
    let range = |numbers: Vec<f64>| {
        let ends = [numbers.iter().copied().reduce(f64::min)?, numbers.iter().copied().reduce(f64::max)?];
        let [least, most] = ends.map(short);
        Some(if least == most { least } else { format!("{least} to {most}") })
    };
    let of_place = |at: At| {
        let of = |r: &&Record| variants.contains(&r.row.variant) && (&r.scene, r.x) == (&at.0, at.1);
        let records: Vec<&Record> = table.of(quantity).filter(of).collect();
        let medians = range(records.iter().filter_map(|r| r.row.value.number()).collect())?;
        let ends = range(records.iter().flat_map(|r| [least(r), most(r)]).collect())?;
        Some(format!("{} {medians} ({ends})", at.0))
    };
    places(table).into_iter().filter_map(of_place).collect::<Vec<_>>().join(", ")
}

pub fn subset(table: &Table) -> Finding {
    let (verdict, met, all) =
        everywhere(table, FALSE_TILES, &variants(), |r| r.row.value.number() == Some(0.0));
    let wrong: f64 = table.of(FALSE_TILES).filter_map(|r| r.row.value.number()).sum();
    Finding::new(
        verdict,
        format!("{wrong} tiles too many"),
        format!("{met} of {all} variants in a place have none"),
    )
}

pub fn complete(table: &Table) -> Finding {
    let of_cycle = |record: &Record| {
        let n = SUBSAMPLINGS.into_iter().find(|&n| name(n) == record.row.variant);
        most(record) / n.map_or(0, cycle) as f64
    };
    let (verdict, met, all) = everywhere(table, TO_ALL, &variants(), |r| of_cycle(r) <= 1.0);
    let share = table.of(TO_ALL).map(of_cycle).fold(0.0, f64::max);
    let numbers = format!("the last tile after at most {:.0} % of the cycle", 100.0 * share);
    Finding::new(verdict, numbers, format!("{met} of {all} are complete within their cycle"))
}

pub fn delay(table: &Table) -> Finding {
    let shipped = [6, 8].map(name);
    let (verdict, met, all) = everywhere(table, TO_99, &shipped, |r| r.row.value.number() > Some(1.0));
    let why = format!("{met} of {all} need more than one frame; the tiles missed are those of few pixels");
    Finding::new(verdict, medians(table, TO_99, &shipped), why)
}

pub fn moving(table: &Table) -> Finding {
    let shipped = [name(8)];
    let (recall, lacking, paths) = everywhere(table, MOVING_RECALL, &shipped, |r| least(r) < 1.0);
    let (precision, stale, _) =
        everywhere(table, MOVING_PRECISION, &shipped, |r| r.row.value.number() < Some(0.5));
    let verdict = if recall == precision { recall } else { Verdict::InPart };
    let numbers =
        [MOVING_RECALL, MOVING_PRECISION].map(|q| format!("{q}: {}", medians(table, q, &shipped))).join("; ");
    let why = format!(
        "{lacking} of {paths} paths lack tiles in some frame, {stale} have a median precision below half"
    );
    Finding::new(verdict, numbers, why)
}

pub fn cost(table: &Table) -> Finding {
    let (all, few) = ([ALL_PIXELS.to_string()], [name(6)]);
    let found = ratios(table, TIME, &all, &few);
    judge(table, Bound::AtLeast(10.0), &found, || why_none(table, TIME, &few))
}

#[cfg(test)]
mod tests {
    use super::super::super::judge::tests::table as times;
    use super::*;
    use crate::figure::Row;
    use crate::stats::Summary;

    /// A table of (n, quantity, samples).
    fn table(rows: &[(u32, &str, &[f64])]) -> Table {
        let record = |&(n, quantity, samples): &(u32, &str, &[f64])| Record {
            scene: "a/b".into(),
            x: None,
            row: Row::new(name(n), quantity, "", Value::Summary(Summary::of(samples).unwrap())),
        };
        Table { records: rows.iter().map(record).collect(), ..times("cpu", &[]) }
    }

    #[test]
    fn one_tile_too_many_refutes_the_subset() {
        let found = |tiles| subset(&table(&[(2, FALSE_TILES, &[0.0]), (8, FALSE_TILES, &[tiles])])).verdict;
        assert_eq!((found(0.0), found(1.0)), (Verdict::Reproduced, Verdict::InPart));
    }

    #[test]
    fn a_tile_later_than_the_cycle_refutes_completeness_whatever_the_median() {
        let found = |last| complete(&table(&[(2, TO_ALL, &[1.0, 1.0, 1.0, last])])).verdict;
        assert_eq!((found(4.0), found(5.0)), (Verdict::Reproduced, Verdict::NotReproduced));
    }

    #[test]
    fn a_delay_is_more_than_one_frame_in_the_median() {
        let found = |frames: &[f64]| delay(&table(&[(8, TO_99, frames)])).verdict;
        assert_eq!(
            (found(&[1.0, 2.0, 2.0]), found(&[1.0, 1.0, 9.0])),
            (Verdict::Reproduced, Verdict::NotReproduced)
        );
        assert_eq!(delay(&table(&[(2, TO_99, &[9.0])])).verdict, Verdict::NotMeasurable);
        let two = table(&[(6, TO_99, &[1.0, 4.0, 5.0]), (8, TO_99, &[9.0, 17.0, 30.0])]);
        assert_eq!(delay(&two).numbers, "a/b 4 to 17 (1 to 30)");
    }

    #[test]
    fn a_moving_camera_must_both_lack_tiles_and_keep_stale_ones() {
        let found = |recall, precision| {
            moving(&table(&[(8, MOVING_RECALL, &[recall, 1.0, 1.0]), (8, MOVING_PRECISION, &[precision])]))
                .verdict
        };
        assert_eq!(found(0.9, 0.4), Verdict::Reproduced);
        assert_eq!(found(1.0, 0.4), Verdict::InPart);
        assert_eq!(found(1.0, 0.6), Verdict::NotReproduced);
    }

    #[test]
    fn a_cheaper_list_takes_a_tenth_on_the_device_at_hand() {
        let found = |all| {
            cost(&times("cpu", &[("a/b", None, ALL_PIXELS, TIME, all), ("a/b", None, "1/64", TIME, 1.0)]))
                .verdict
        };
        assert_eq!((found(10.0), found(9.0)), (Verdict::Reproduced, Verdict::NotReproduced));
    }
}
