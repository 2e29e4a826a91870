//! What the numbers of pm.change say.

use super::super::short;
use super::ways::{CLASSICAL, COMPACTED, COPY, MAPPED, ON_DEVICE, OURS, SKIP_LISTS, WAYS};
use super::{ALL, BOTH, CHANGE, COPIED, DEVICE, ONE, STEPS, WORST, WRITTEN};
use crate::figure::{Finding, Table, Verdict};

/// On each mesh whether it holds, and words: reproduced where it holds on all.
fn judge(table: &Table, why: &str, of: impl Fn(&str) -> Option<(bool, String)>) -> Finding {
    let found: Option<Vec<(bool, String)>> = CHANGE.scenes.iter().map(|scene| of(scene)).collect();
    let Some(found) = found.filter(|_| table.missing == 0) else {
        return Finding::new(Verdict::NotMeasurable, "", "a number is missing, or the device keeps no time");
    };
    let held = found.iter().filter(|(holds, _)| *holds).count();
    let verdict = match held {
        0 => Verdict::NotReproduced,
        all if all == found.len() => Verdict::Reproduced,
        _ => Verdict::InPart,
    };
    let words = CHANGE.scenes.iter().zip(found).map(|(scene, (_, words))| format!("{scene} {words}"));
    Finding::new(verdict, words.collect::<Vec<_>>().join("; "), why)
}

/// Quantities of variants on a mesh at a step.
fn at<'a>(table: &'a Table, scene: &'a str, step: f64) -> impl Fn(&str, &str) -> Option<f64> + 'a {
    move |variant, quantity| table.number(scene, Some(step), variant, quantity)
}

pub fn moves_of_ours(table: &Table) -> Finding {
    judge(
        table,
        "ours less classical, and 276 bytes are 23 faces; mean of all splits and collapses",
        |scene| {
            let of = at(table, scene, ONE);
            let [ours, classical] = [of(OURS, WRITTEN)?, of(CLASSICAL, WRITTEN)?];
            let moved = ours - classical;
            let words = format!(
                "{} bytes a split, {} of them of {} moved faces, classical {}",
                short(ours),
                short(moved),
                short(moved / 12.0),
                short(classical)
            );
            Some((moved <= 12.0 * 23.0, words))
        },
    )
}

pub fn copies_of_lists(table: &Table) -> Finding {
    let why = "a list is copied when it is come to: on the way down all but the finest, 2 faces a split / (1 - 0.707) less those 2; \
               up, all but the coarsest; within 10 % of 4.8 on the way down";
    judge(table, why, |scene| {
        let of = at(table, scene, ONE);
        let [up, down] = [of(SKIP_LISTS, COPIED[0])?, of(SKIP_LISTS, COPIED[1])?];
        let holds = (down / 4.8 - 1.0).abs() <= 0.1;
        Some((holds, format!("{} down, {} up", short(down), short(up))))
    })
}

pub fn lists_write_less(table: &Table) -> Finding {
    let why = "corners in faces without area included; lists pay by faces without area that are drawn, and by memory (pm.average)";
    judge(table, why, |scene| {
        let of = at(table, scene, ONE);
        let [lists, ours] = [of(SKIP_LISTS, WRITTEN)?, of(OURS, WRITTEN)?];
        Some((lists < ours, format!("{} bytes a split, ours {}", short(lists), short(ours))))
    })
}

pub fn small_steps(table: &Table) -> Finding {
    let why = "every permutation on the way is executed, and a step of 10 % meets two or three; a copy is one of the live faces";
    judge(table, why, |scene| {
        let shares = |step| {
            let of = at(table, scene, step);
            Some(of(OURS, WRITTEN)? / of(COPY, WRITTEN)?)
        };
        let found: Vec<f64> = STEPS.into_iter().map(shares).collect::<Option<_>>()?;
        let holds = STEPS.iter().zip(&found).all(|(step, share)| *step > 1.0 || *share < 1.0);
        let percent = |share: &f64| format!("{} %", short(100.0 * share));
        let words: Vec<String> = found.iter().map(percent).collect();
        Some((holds, format!("{} of a copy for one split, 1 %, 10 % and all", words.join(", "))))
    })
}

/// Beyond a copy by no more than a split's own corners.
pub fn bursts(table: &Table) -> Finding {
    let why = "a permutation of all faces writes as much as a copy, and skip lists copy a list; means are a thousandth of it";
    judge(table, why, |scene| {
        let of = at(table, scene, ONE);
        let most = of(COPY, WORST)? + of(CLASSICAL, WORST)?;
        let worst = |name: &'static str| Some((name, of(name, WORST)?));
        let all: Vec<(&str, f64)> = WAYS.iter().map(|way| worst(way.name)).collect::<Option<_>>()?;
        let beyond = all.iter().filter(|(_, bytes)| *bytes > most);
        let beyond: Vec<String> = beyond.map(|(name, bytes)| format!("{name} {}", short(*bytes))).collect();
        let [ours, lists] = [of(OURS, WORST)?, of(SKIP_LISTS, WORST)?];
        let words = match beyond.is_empty() {
            true => format!("ours {}, skip lists {} of {} bytes", short(ours), short(lists), short(most)),
            false => format!("beyond {} bytes: {}", short(most), beyond.join(", ")),
        };
        Some((beyond.is_empty(), words))
    })
}

pub fn compaction_looks_at_all(table: &Table) -> Finding {
    judge(table, "device, one split over all splits at once", |scene| {
        let of = |step| at(table, scene, step)(COMPACTED, DEVICE);
        let [one, all] = [of(ONE)?, of(ALL)?];
        Some((one >= 0.5 * all, format!("{} ms for one, {} ms for all", short(one), short(all))))
    })
}

pub fn less_than_a_copy(table: &Table) -> Finding {
    let mut why = "medians of host and device together, each frame's submission included".to_string();
    if table.machine.is_software() {
        why += "; where the device is software, copies and shaders run on the host's own cores";
    }
    judge(table, &why, |scene| {
        let of = at(table, scene, 1.0);
        let copy = of(COPY, BOTH)?;
        let ours = [OURS, MAPPED, ON_DEVICE].map(|name| Some((name, of(name, BOTH)?)));
        let ours = ours.into_iter().collect::<Option<Vec<_>>>()?;
        let holds = ours.iter().any(|(_, ms)| *ms < copy);
        let words: Vec<String> = ours.iter().map(|(name, ms)| format!("{name} {} ms", short(*ms))).collect();
        Some((holds, format!("{}, a copy {} ms", words.join(", "), short(copy))))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::{Record, Row, Value};

    /// The same rows on both meshes: (variant, step, quantity, number).
    fn table(rows: &[(&str, f64, &str, f64)]) -> Table {
        let mut table = super::super::super::tests::table("discrete", &[]);
        for scene in CHANGE.scenes {
            for &(variant, step, quantity, number) in rows {
                let row = Row::new(variant, quantity, "", Value::Number(number));
                table.records.push(Record { scene: scene.to_string(), x: Some(step), row });
            }
        }
        table
    }

    #[test]
    fn a_byte_beyond_23_faces_and_a_list_more_are_refuted() {
        let moved =
            |ours| moves_of_ours(&table(&[(OURS, ONE, WRITTEN, ours), (CLASSICAL, ONE, WRITTEN, 25.0)]));
        assert_eq!(
            [moved(301.0), moved(302.0)].map(|f| f.verdict),
            [Verdict::Reproduced, Verdict::NotReproduced]
        );
        let copied = |down| {
            let rows = [(SKIP_LISTS, ONE, COPIED[0], 6.8), (SKIP_LISTS, ONE, COPIED[1], down)];
            copies_of_lists(&table(&rows)).verdict
        };
        assert_eq!([copied(4.7), copied(6.8)], [Verdict::Reproduced, Verdict::NotReproduced]);
        let less = |lists| {
            lists_write_less(&table(&[(SKIP_LISTS, ONE, WRITTEN, lists), (OURS, ONE, WRITTEN, 300.0)]))
        };
        assert_eq!(
            [less(299.0), less(300.0)].map(|f| f.verdict),
            [Verdict::Reproduced, Verdict::NotReproduced]
        );
        assert_eq!(moves_of_ours(&table(&[])).verdict, Verdict::NotMeasurable);
    }

    #[test]
    fn a_step_of_one_percent_counts_and_ten_do_not() {
        let found = |ours: [f64; 4]| {
            let of = |(step, bytes)| [(OURS, step, WRITTEN, bytes), (COPY, step, WRITTEN, 100.0)];
            small_steps(&table(&STEPS.into_iter().zip(ours).flat_map(of).collect::<Vec<_>>()))
        };
        assert_eq!(found([1.0, 99.0, 200.0, 900.0]).verdict, Verdict::Reproduced);
        assert_eq!(found([1.0, 100.0, 200.0, 900.0]).verdict, Verdict::NotReproduced);
    }

    #[test]
    fn the_worst_way_decides_and_is_named() {
        let found = |random| {
            let bytes = |name| match name {
                "random" => random,
                CLASSICAL => 5.0,
                _ => 100.0,
            };
            bursts(&table(&WAYS.map(|way| (way.name, ONE, WORST, bytes(way.name)))))
        };
        assert_eq!(found(105.0).verdict, Verdict::Reproduced);
        let beyond = found(106.0);
        assert_eq!(beyond.verdict, Verdict::NotReproduced);
        assert!(beyond.numbers.contains("beyond 105 bytes: random 106"), "{beyond:?}");
    }

    #[test]
    fn times_are_held_against_all_splits_and_against_a_copy() {
        let found = |one, best| {
            let table = table(&[
                (COMPACTED, ONE, DEVICE, one),
                (COMPACTED, ALL, DEVICE, 2.0),
                (COPY, 1.0, BOTH, 3.0),
                (OURS, 1.0, BOTH, 9.0),
                (MAPPED, 1.0, BOTH, best),
                (ON_DEVICE, 1.0, BOTH, 9.0),
            ]);
            [compaction_looks_at_all(&table).verdict, less_than_a_copy(&table).verdict]
        };
        assert_eq!(found(1.0, 2.9), [Verdict::Reproduced; 2]);
        assert_eq!(found(0.9, 3.0), [Verdict::NotReproduced; 2]);
    }
}
