//! What the numbers of pm.cpu say.

use super::MOVED;
use super::execute::{
    COPY, FLAT, FLAT_SWAPS, FRAME, FRAME_HOST, FRAME_WHOLE, PRINTED_SWAPS, SPLITS_DOWN, SPLITS_UP, STEP,
};
use super::lines::{GREEDY, LINES, NO_WEIGHT};
use super::send::{BOTH, DEVICE, MAPPED, RANGES, SCATTER, WAYS, WHOLE, WRONG};
use crate::figure::{Finding, Record, Table, Value, Verdict};
use crate::paper::progressive_mesh::figures::{scans, short};

/// The scenes that are as large as the dragon, and itself.
const LARGE: [&str; 2] = ["torus:466", scans::LARGE];

fn scenes(table: &Table) -> Vec<&str> {
    let mut scenes: Vec<&str> = table.records.iter().map(|record| &*record.scene).collect();
    scenes.dedup();
    scenes
}

/// Each scene's words and whether it holds there; nothing for a scene that was not measured.
fn judge<'a>(
    table: &'a Table,
    of: impl Fn(&dyn Fn(&str, &str) -> Option<f64>, &str) -> Option<(bool, String)> + 'a,
) -> (Verdict, String) {
    let look = |scene: &'a str| {
        let number = move |variant: &str, quantity: &str| table.number(scene, None, variant, quantity);
        of(&number, scene).map(|(holds, words)| (holds, format!("{scene} {words}")))
    };
    let found: Vec<(bool, String)> = scenes(table).into_iter().filter_map(look).collect();
    let held = found.iter().filter(|(holds, _)| *holds).count();
    let verdict = match held {
        _ if found.is_empty() => Verdict::NotMeasurable,
        0 => Verdict::NotReproduced,
        all if all == found.len() && table.missing == 0 => Verdict::Reproduced,
        _ => Verdict::InPart,
    };
    (verdict, found.into_iter().map(|(_, words)| words).collect::<Vec<_>>().join(", "))
}

pub fn exact(table: &Table) -> Finding {
    let (verdict, numbers) = judge(table, |number, _| {
        let wrong: Option<Vec<f64>> = WAYS.iter().map(|way| number(way, WRONG)).collect();
        let wrong: f64 = wrong?.iter().sum();
        Some((wrong == 0.0, format!("{wrong} wrong words")))
    });
    Finding::new(verdict, numbers, "live words of all five buffers against a fresh execution")
}

/// A quantity's median with its spread.
fn spread(table: &Table, scene: &str, variant: &str, quantity: &str) -> Option<String> {
    let of = |record: &&Record| record.scene == scene && record.row.variant == variant;
    match &table.of(quantity).find(of)?.row.value {
        Value::Summary(s) => Some(format!("{} ({} .. {})", short(s.median), short(s.p5), short(s.p95))),
        value => value.number().map(short),
    }
}

fn rates(table: &Table, large: bool, least: f64) -> Finding {
    let (verdict, numbers) = judge(table, |number, scene| {
        if LARGE.contains(&scene) != large {
            return None;
        }
        let rates = [number(FLAT_SWAPS, SPLITS_UP)?, number(FLAT_SWAPS, SPLITS_DOWN)?];
        let words = format!(
            "{} up, {} down at {} moved faces for each split (splits only {}; all of it takes as long as {} memory \
             copies of its index buffer)",
            spread(table, scene, FLAT_SWAPS, SPLITS_UP)?,
            spread(table, scene, FLAT_SWAPS, SPLITS_DOWN)?,
            short(number(FLAT_SWAPS, MOVED)?),
            short(number(FLAT, SPLITS_UP)?),
            short(100.0 * number(FLAT_SWAPS, STEP)? / number(COPY, STEP)?),
        );
        Some((rates.into_iter().all(|rate| rate >= least), words))
    });
    Finding::new(verdict, numbers, format!("millions a second, medians (p5 .. p95), against {least}"))
}

pub fn rate(table: &Table) -> Finding {
    rates(table, false, 20.0)
}

pub fn rate_large(table: &Table) -> Finding {
    rates(table, true, 6.0)
}

pub fn flat(table: &Table) -> Finding {
    let (verdict, numbers) = judge(table, |number, _| {
        let of = |quantity| Some(number(FLAT_SWAPS, quantity)? / number(PRINTED_SWAPS, quantity)?);
        let ratios = [of(SPLITS_UP)?, of(SPLITS_DOWN)?];
        let words = format!("{}x up, {}x down", short(ratios[0]), short(ratios[1]));
        Some((ratios.into_iter().all(|ratio| ratio >= 1.5), words))
    });
    Finding::new(verdict, numbers, "with 23 moved faces for each split")
}

pub fn load_of_splits(table: &Table) -> Finding {
    let (verdict, numbers) = judge(table, |number, _| {
        let rise = number(FLAT_SWAPS, STEP)? / number(FLAT, STEP)? - 1.0;
        Some((rise <= 0.2, format!("+{:.0} %", 100.0 * rise)))
    });
    let why = "moving a face writes three words and reads three, a split writes three or four in all";
    Finding::new(verdict, numbers, why)
}

pub fn load_of_frames(table: &Table) -> Finding {
    let (verdict, numbers) = judge(table, |number, _| {
        let [with, without] = [number(FLAT_SWAPS, STEP)?, number(FLAT, STEP)?];
        let rise = |frame: f64| 100.0 * ((frame + with) / (frame + without) - 1.0);
        let [host, whole] = [number(FRAME, FRAME_HOST)?, number(FRAME, FRAME_WHOLE)?];
        let words = format!(
            "+{:.1} % ({} us of {} us; of the whole frame's {} ms +{:.1} %)",
            rise(host),
            short(1e3 * with),
            short(1e3 * host),
            short(whole),
            rise(whole)
        );
        Some((rise(host) <= 20.0, words))
    });
    Finding::new(
        verdict,
        numbers,
        "one instance, a hundredth of the splits executed beside the host's share of a drawn frame; beside the whole \
         frame the rise is smaller still",
    )
}

pub fn lines(table: &Table) -> Finding {
    let (verdict, numbers) = judge(table, |number, _| {
        let [with, without] = [number(GREEDY, LINES)?, number(NO_WEIGHT, LINES)?];
        let words = format!(
            "{} instead of {} (ours {}, splits alone {})",
            short(with),
            short(without),
            short(number(FLAT_SWAPS, LINES)?),
            short(number(FLAT, LINES)?),
        );
        Some((with < without, words))
    });
    Finding::new(
        verdict,
        numbers,
        "lines of 64 bytes for each split; a moved face touches at least 12 bytes of one",
    )
}

pub fn touched(table: &Table) -> Finding {
    let (verdict, numbers) = judge(table, |number, _| {
        let times: Option<Vec<(f64, &str)>> = [WHOLE, RANGES, MAPPED, SCATTER, DEVICE]
            .iter()
            .map(|way| Some((number(way, BOTH)?, *way)))
            .collect();
        let times = times?;
        let least = times.iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
        let words = format!(
            "{} of {} ms, least {} ms {}",
            short(times[1].0),
            short(times[0].0),
            short(least.0),
            least.1
        );
        Some((times[1].0 < times[0].0, words))
    });
    let mut why = "ten frames of a hundredth of the splits each, host and device together".to_string();
    if table.machine.is_software() {
        why += "; of a software device, whose memory is the host's: ways rank otherwise across a bus";
    }
    Finding::new(verdict, numbers, why)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::progressive_mesh::figures::tests::table as table_of;

    fn table(numbers: &[(&str, &str, &str, f64)]) -> Table {
        table_of("discrete", numbers)
    }

    fn rates_of(scene: &str, up: f64, down: f64) -> Vec<(&str, &'static str, &'static str, f64)> {
        vec![
            (scene, FLAT_SWAPS, SPLITS_UP, up),
            (scene, FLAT_SWAPS, SPLITS_DOWN, down),
            (scene, FLAT_SWAPS, MOVED, 22.0),
            (scene, FLAT_SWAPS, STEP, 2.0),
            (scene, FLAT, SPLITS_UP, 200.0),
            (scene, COPY, STEP, 1.0),
        ]
    }

    #[test]
    fn a_rate_must_be_reached_both_ways_and_the_large_mesh_has_its_own() {
        let verdict = |up, down| rate(&table(&rates_of("bunny", up, down))).verdict;
        assert_eq!(verdict(20.0, 20.0), Verdict::Reproduced);
        assert_eq!([verdict(19.9, 30.0), verdict(30.0, 19.9)], [Verdict::NotReproduced; 2]);
        let both = [rates_of("bunny", 30.0, 30.0), rates_of(LARGE[0], 5.0, 7.0)].concat();
        assert_eq!(rate(&table(&both)).verdict, Verdict::Reproduced);
        assert_eq!(rate_large(&table(&both)).verdict, Verdict::NotReproduced);
        assert_eq!(rate_large(&table(&both[..6])).verdict, Verdict::NotMeasurable);
    }

    #[test]
    fn a_fifth_more_is_met_by_the_frame_and_not_by_the_splits() {
        let steps = |host| {
            [
                ("bunny", FLAT, STEP, 1.0),
                ("bunny", FLAT_SWAPS, STEP, 6.0),
                ("bunny", FRAME, FRAME_HOST, host),
                ("bunny", FRAME, FRAME_WHOLE, 100.0),
            ]
        };
        assert_eq!(load_of_splits(&table(&steps(40.0))).verdict, Verdict::NotReproduced);
        let found = load_of_frames(&table(&steps(40.0)));
        assert_eq!(found.verdict, Verdict::Reproduced);
        assert!(found.numbers.contains("+12.2 %") && found.numbers.contains("+5.0 %"), "{found:?}");
        assert_eq!(load_of_frames(&table(&steps(4.0))).verdict, Verdict::NotReproduced);
    }

    #[test]
    fn the_weight_must_save_lines_on_every_model() {
        let rows = |with| {
            [(GREEDY, with), (NO_WEIGHT, 10.0), (FLAT_SWAPS, 6.0), (FLAT, 2.0)]
                .map(|(variant, count)| ("bunny", variant, LINES, count))
        };
        let verdict = |with| lines(&table(&rows(with))).verdict;
        assert_eq!([verdict(9.9), verdict(10.0)], [Verdict::Reproduced, Verdict::NotReproduced]);
        assert_eq!(lines(&table(&rows(9.0)[..1])).verdict, Verdict::NotMeasurable);
    }

    #[test]
    fn one_wrong_word_of_one_way_refutes() {
        let rows = |wrong| WAYS.map(|way| ("bunny", way, WRONG, if way == SCATTER { wrong } else { 0.0 }));
        assert_eq!(exact(&table(&rows(0.0))).verdict, Verdict::Reproduced);
        assert_eq!(exact(&table(&rows(1.0))).verdict, Verdict::NotReproduced);
        assert_eq!(exact(&table(&rows(0.0)[..4])).verdict, Verdict::NotMeasurable);
    }

    #[test]
    fn ranges_are_held_against_all_live_faces_and_the_least_is_named() {
        let rows = |ranges| {
            let times = [5.0, ranges, 2.0, 3.0, 4.0];
            [0, 1, 2, 3, 4].map(|n| ("bunny", WAYS[n], BOTH, times[n]))
        };
        let found = touched(&table(&rows(4.9)));
        assert_eq!(found.verdict, Verdict::Reproduced);
        assert!(found.numbers.ends_with(&format!("least 2.00 ms {MAPPED}")), "{found:?}");
        assert_eq!(touched(&table(&rows(5.0))).verdict, Verdict::NotReproduced);
    }

    #[test]
    fn the_same_speed_is_not_faster() {
        let rows = |rate| {
            [FLAT_SWAPS, PRINTED_SWAPS].into_iter().zip([rate, 10.0]).flat_map(|(variant, rate)| {
                [SPLITS_UP, SPLITS_DOWN].map(|quantity| ("bunny", variant, quantity, rate))
            })
        };
        let verdict = |rate| flat(&table(&rows(rate).collect::<Vec<_>>())).verdict;
        assert_eq!([verdict(15.0), verdict(14.9)], [Verdict::Reproduced, Verdict::NotReproduced]);
    }
}
