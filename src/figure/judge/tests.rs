//! Each rule is tested on both sides of its bound and on it.

use super::super::claim::{
    At, Better, Bound, Claim, Places, Statistic, Test, best, each, every, one, others,
};
use super::super::{Cell, Finding, Machine, Row, Table, TableRecord, Value, Verdict};
use Bound::{Above, AtLeast, AtMost, Below, Equal, Within};
use Verdict::{
    BetterThanStated, HoldsHere, InPart, InPartHere, NotHere, NotMeasurable, NotMeasured, NotReproduced,
    Reproduced, Undecided,
};

fn table(kind: &str, rows: &[(&str, Option<f64>, &str, Value)]) -> Table {
    let record = |(scene, x, variant, value): &(&str, Option<f64>, &str, Value)| TableRecord {
        scene: scene.to_string(),
        x: *x,
        row: Row::new(*variant, "q", "ms", value.clone()),
    };
    let machine = Machine { device: "a device".into(), device_kind: kind.into(), ..Machine::default() };
    Table { machine, records: rows.iter().map(record).collect(), lost: Vec::new() }
}

/// Exact numbers of variants in one scene.
fn exact(numbers: &[(&str, f64)]) -> Table {
    let rows: Vec<_> =
        numbers.iter().map(|&(name, number)| ("s", None, name, Value::Number(number))).collect();
    table("discrete", &rows)
}

/// Interleaved repeated measurements of variants in one scene.
fn rounds(kind: &str, rows: &[(&str, Vec<f64>)]) -> Table {
    let row = |(name, rounds): &(&str, Vec<f64>)| TableRecord {
        scene: "s".into(),
        x: None,
        row: Row::of_rounds(name, "q", "ms", Some(rounds.clone())),
    };
    Table { records: rows.iter().map(row).collect(), ..table(kind, &[]) }
}

fn judged(tests: &'static [Test], table: &Table) -> Finding {
    Claim::ours("id", "text", tests).judge(table)
}

fn verdict(tests: &'static [Test], table: &Table) -> Verdict {
    judged(tests, table).verdict
}

const OF_A: super::super::claim::Pick = one("q", "a");
const OF_B: super::super::claim::Pick = one("q", "b");

#[test]
fn every_bound_has_two_sides_and_an_edge() {
    const AT_LEAST: &[Test] = &[Test::value(OF_A, AtLeast(2.0))];
    const AT_MOST: &[Test] = &[Test::value(OF_A, AtMost(2.0))];
    const ABOVE: &[Test] = &[Test::value(OF_A, Above(2.0))];
    const BELOW: &[Test] = &[Test::value(OF_A, Below(2.0))];
    const EQUAL: &[Test] = &[Test::value(OF_A, Equal(2.0))];
    const RANGE: &[Test] = &[Test::value(OF_A, Within(2.0, 2.0, Better::Neither))];
    let (yes, no) = (Reproduced, NotReproduced);
    for (tests, verdicts) in [
        (AT_LEAST, [no, yes, yes]),
        (AT_MOST, [yes, yes, no]),
        (ABOVE, [no, no, yes]),
        (BELOW, [yes, no, no]),
        (EQUAL, [no, yes, no]),
        (RANGE, [no, yes, no]),
    ] {
        let found = [1.999, 2.0, 2.001].map(|number| verdict(tests, &exact(&[("a", number)])));
        assert_eq!(found, verdicts, "{:?}", tests[0].bound);
        assert_eq!(verdict(tests, &exact(&[("a", f64::NAN)])), no);
    }
}

#[test]
fn better_than_the_range_is_reported_and_worse_is_not_reproduced() {
    const LESS: &[Test] = &[Test::value(OF_A, Within(1.6, 2.0, Better::Less))];
    const MORE: &[Test] = &[Test::value(OF_A, Within(1.6, 2.0, Better::More))];
    let found = |tests| [1.5, 1.6, 2.0, 2.1].map(|number| verdict(tests, &exact(&[("a", number)])));
    assert_eq!(found(LESS), [BetterThanStated, Reproduced, Reproduced, NotReproduced]);
    assert_eq!(found(MORE), [NotReproduced, Reproduced, Reproduced, BetterThanStated]);
    // With an interval across the better end, the claim holds. With an interval across the worse end, the claim is
    // undecided.
    let noisy =
        |middle: f64| rounds("discrete", &[("a", (0..8).map(|n| middle + 0.01 * f64::from(n)).collect())]);
    assert_eq!([1.57, 1.97].map(|middle| verdict(LESS, &noisy(middle))), [Reproduced, Undecided]);
}

#[test]
fn ratios_and_differences_are_judged_on_both_sides_and_on_the_bound() {
    const RATIO: &[Test] = &[Test::ratio(OF_A, OF_B, AtLeast(3.0))];
    const DIFFERENCE: &[Test] = &[Test::difference(OF_A, OF_B, AtMost(4.0))];
    let found = |tests, numbers: [f64; 3]| numbers.map(|a| verdict(tests, &exact(&[("a", a), ("b", 2.0)])));
    assert_eq!(found(RATIO, [5.9, 6.0, 6.1]), [NotReproduced, Reproduced, Reproduced]);
    assert_eq!(found(DIFFERENCE, [5.9, 6.0, 6.1]), [Reproduced, Reproduced, NotReproduced]);
    // x / 0 is infinite; 0 / 0 is not a number.
    assert_eq!(verdict(RATIO, &exact(&[("a", 1.0), ("b", 0.0)])), Reproduced);
    assert_eq!(verdict(RATIO, &exact(&[("a", 0.0), ("b", 0.0)])), NotMeasured);
}

#[test]
fn a_time_holds_only_if_its_whole_interval_is_on_the_right_side() {
    const FASTER: &[Test] = &[Test::ratio(OF_A, OF_B, Above(1.0))];
    let found = |factors: [f64; 12]| {
        let slow: Vec<f64> = (1..=12).map(f64::from).collect();
        let a = slow.iter().zip(factors).map(|(ms, factor)| ms * factor).collect();
        judged(FASTER, &rounds("discrete", &[("a", a), ("b", slow)]))
    };
    // Rounds differ by a factor of 12; their ratios do not.
    assert_eq!(found([1.1; 12]).verdict, Reproduced);
    assert_eq!(found([1.0; 12]).verdict, NotReproduced);
    assert_eq!(found([0.9; 12]).verdict, NotReproduced);
    let mixed = found([0.9, 1.2, 0.8, 1.3, 1.1, 1.2, 0.9, 1.1, 1.2, 1.0, 1.3, 0.7]);
    assert_eq!(mixed.verdict, Undecided);
    assert!(mixed.why.contains("undecided:") && mixed.why.contains("rounds would decide"), "{mixed:?}");
}

#[test]
fn the_rounds_to_decide_grow_with_the_inverse_square_of_the_margin() {
    const SLOW: &[Test] = &[Test::value(OF_A, Above(10.0))];
    // 8 rounds: the interval is their whole range, -1 to +1 around the median.
    let around = |middle: f64| [-1.0, -0.5, -0.2, 0.0, 0.0, 0.2, 0.5, 1.0].map(|off| middle + off).to_vec();
    let why = |middle| judged(SLOW, &rounds("discrete", &[("a", around(middle))])).why;
    assert!(why(10.5).ends_with("32 rounds would decide"), "{}", why(10.5));
    assert!(why(10.25).ends_with("128 rounds would decide"), "{}", why(10.25));
    assert!(why(10.0).ends_with("more than 100 000 rounds would decide"), "{}", why(10.0));
}

#[test]
fn fewer_than_six_rounds_decide_nothing() {
    const SLOW: &[Test] = &[Test::value(OF_A, Above(1.0))];
    let found = |count: usize| judged(SLOW, &rounds("discrete", &[("a", vec![5.0; count])]));
    assert_eq!([found(5).verdict, found(6).verdict], [Undecided, Reproduced]);
    assert!(found(5).why.contains("6 rounds would decide"), "{}", found(5).why);
}

#[test]
fn measurements_without_common_rounds_are_compared_by_their_intervals() {
    const FLAT: &[Test] = &[Test::ratio(OF_A.x(At::X(2.0)), OF_A.x(At::X(1.0)), AtMost(1.25))];
    let found = |large: f64| {
        let at = |x, middle: f64| TableRecord {
            scene: "s".into(),
            x: Some(x),
            row: Row::of_rounds(
                "a",
                "q",
                "ms",
                Some([0.9, 0.95, 1.0, 1.0, 1.05, 1.1].map(|of| of * middle).into()),
            ),
        };
        judged(FLAT, &Table { records: vec![at(1.0, 10.0), at(2.0, large)], ..table("discrete", &[]) })
            .verdict
    };
    assert_eq!([found(10.0), found(12.5), found(16.0)], [Reproduced, Undecided, NotReproduced]);
}

#[test]
fn the_best_is_chosen_on_every_second_round_and_judged_on_the_others() {
    const BEST: &[Test] = &[Test::ratio(
        one("q", "slow"),
        best("q", || ["lucky", "steady"].map(String::from).into()),
        AtLeast(1.5),
    )];
    // The lucky variant is chosen by its even rounds and judged by its odd rounds.
    let lucky: Vec<f64> = (0..16).map(|n| if n % 2 == 0 { 1.0 } else { 2.0 }).collect();
    let with = |lucky: Vec<f64>| {
        rounds("discrete", &[("slow", vec![2.2; 16]), ("lucky", lucky), ("steady", vec![1.4; 16])])
    };
    let found = judged(BEST, &with(lucky));
    assert_eq!(found.verdict, NotReproduced);
    assert!(found.numbers.contains("1.1x") && found.numbers.contains("(lucky)"), "{found:?}");
    let found = judged(BEST, &with(vec![3.0; 16]));
    assert_eq!(found.verdict, Reproduced);
    assert!(found.numbers.contains("(steady)"), "{found:?}");
    // Half of 10 rounds are too few; 12 rounds suffice.
    let few: Vec<(&str, Vec<f64>)> =
        [("slow", 9.0), ("lucky", 1.0), ("steady", 2.0)].map(|(name, ms)| (name, vec![ms; 10])).into();
    let found = judged(BEST, &rounds("discrete", &few));
    assert_eq!(found.verdict, Undecided);
    assert!(found.why.ends_with("12 rounds would decide"), "{}", found.why);
    // Exact numbers are not split.
    assert_eq!(verdict(BEST, &exact(&[("slow", 3.0), ("lucky", 2.0), ("steady", 9.0)])), Reproduced);
}

#[test]
fn a_claim_that_fails_in_some_places_is_in_part_and_names_them() {
    const SMALL: &[Test] = &[Test::value(OF_A, AtMost(1.0))];
    let found = |numbers: [f64; 3]| {
        let rows: Vec<_> = ["s", "t", "u"]
            .into_iter()
            .zip(numbers)
            .map(|(scene, number)| (scene, None, "a", Value::Number(number)))
            .collect();
        judged(SMALL, &table("discrete", &rows))
    };
    assert_eq!(found([1.0; 3]).verdict, Reproduced);
    assert_eq!(found([2.0; 3]).verdict, NotReproduced);
    let part = found([1.0, 2.0, 0.5]);
    assert_eq!(part.verdict, InPart);
    assert_eq!(part.numbers, "q of a: s 1 ms, t 2 ms, u 0.5 ms");
    assert_eq!(part.why, "2 of 3 at most 1, not t");
}

#[test]
fn all_tests_of_a_claim_must_hold() {
    const BOTH: &[Test] = &[Test::value(OF_A, AtMost(1.0)), Test::value(OF_B, AtMost(1.0))];
    let found = |a, b| verdict(BOTH, &exact(&[("a", a), ("b", b)]));
    let (yes, no) = (Reproduced, NotReproduced);
    assert_eq!([found(1.0, 1.0), found(1.0, 2.0), found(2.0, 1.0), found(2.0, 2.0)], [yes, no, no, no]);
    assert_eq!(verdict(BOTH, &exact(&[("a", 1.0)])), NotMeasured, "one of the two is missing");
}

#[test]
fn a_claim_holds_in_a_place_if_all_its_tests_hold_there() {
    const BOTH: &[Test] = &[Test::value(OF_A, AtMost(1.0)), Test::value(OF_B, AtMost(1.0))];
    let found = |[s, t]: [[f64; 2]; 2]| {
        let row = |scene, variant, number| (scene, None, variant, Value::Number(number));
        let rows = [row("s", "a", s[0]), row("s", "b", s[1]), row("t", "a", t[0]), row("t", "b", t[1])];
        verdict(BOTH, &table("discrete", &rows))
    };
    assert_eq!(found([[1.0, 1.0], [1.0, 1.0]]), Reproduced);
    assert_eq!(found([[1.0, 1.0], [1.0, 2.0]]), InPart);
    // Half of the numbers meet their bounds, but in no place do both tests hold.
    assert_eq!(found([[1.0, 2.0], [2.0, 1.0]]), NotReproduced);

    // Growth belongs to the scene: if it fails, the claim fails at every value of its sweep.
    const GROWS: &[Test] = &[Test::value(OF_A, AtMost(9.0)), Test::growth(OF_A, 1.0, AtMost(1.0))];
    let grows = |numbers: [f64; 2]| {
        let rows = [(1.0, numbers[0]), (2.0, numbers[1])];
        verdict(GROWS, &table("discrete", &rows.map(|(x, y)| ("s", Some(x), "a", Value::Number(y)))))
    };
    assert_eq!(
        [[1.0, 2.0], [1.0, 3.0], [9.0, 10.0], [5.0, 11.0]].map(grows),
        [Reproduced, NotReproduced, InPart, NotReproduced]
    );
}

#[test]
fn on_a_software_device_a_claim_about_time_holds_here_or_not() {
    const SMALL: &[Test] = &[Test::value(every("q"), AtMost(1.0))];
    let found = |kind, numbers: [f64; 2]| {
        let rows: Vec<_> = ["s", "t"]
            .into_iter()
            .zip(numbers)
            .map(|(scene, number)| (scene, None, "a", Value::Number(number)))
            .collect();
        let (timed, counted) =
            (Claim::paper_timed("1", "id", "text", SMALL), Claim::ours("id", "text", SMALL));
        [timed, counted].map(|claim| claim.judge(&table(kind, &rows)).verdict)
    };
    let numbers = [[1.0, 1.0], [1.0, 2.0], [2.0, 2.0]];
    assert_eq!(numbers.map(|of| found("cpu", of)[0]), [HoldsHere, InPartHere, NotHere]);
    assert_eq!(numbers.map(|of| found("cpu", of)[1]), [Reproduced, InPart, NotReproduced]);
    assert_eq!(numbers.map(|of| found("discrete", of)[0]), [Reproduced, InPart, NotReproduced]);
}

#[test]
fn a_missing_cell_leaves_its_claim_unmeasured() {
    const SMALL: &[Test] = &[Test::value(OF_A, AtMost(1.0))];
    let claim = Claim::ours("id", "text", SMALL).at(Places::scenes(&["s", "t"]).x(1.0, 2.0));
    let rows = [("s", Some(1.0), "a", Value::Number(1.0))];
    let found = |scene: &str, x| {
        let lost = vec![(Cell { scene: scene.into(), x: Some(x) }, "failed".into())];
        claim.judge(&Table { lost, ..table("discrete", &rows) })
    };
    assert_eq!([found("u", 1.0).verdict, found("t", 3.0).verdict], [Reproduced; 2]);
    assert_eq!(found("t", 2.0).verdict, NotMeasured);
    assert_eq!(found("t", 2.0).why, "missing cells: 1 failed");
}

#[test]
fn a_variant_that_does_not_run_is_reported_and_the_others_are_judged() {
    const SMALL: &[Test] = &[Test::value(OF_A, AtMost(1.0))];
    let missing = || Value::Missing("no geometry shader".into());
    let one = [("s", None, "a", missing())];
    let found = judged(SMALL, &table("discrete", &one));
    assert_eq!((found.verdict, &*found.why), (NotMeasurable, "a: no geometry shader"));
    let two = [("s", None, "a", missing()), ("t", None, "a", Value::Number(1.0))];
    let found = judged(SMALL, &table("discrete", &two));
    assert_eq!(found.verdict, Reproduced);
    assert_eq!(found.why, "1 of 1 at most 1; not judged in 1 places (a: no geometry shader)");
    assert_eq!(verdict(SMALL, &table("discrete", &[])), NotMeasured);
}

#[test]
fn a_claim_needs_its_precondition() {
    const SMALL: &[Test] = &[Test::value(OF_A, AtMost(1.0))];
    const GIVEN: &[Test] = &[Test::ratio(OF_B, OF_A, AtLeast(4.0))];
    let claim = Claim::ours("id", "text", SMALL).given(GIVEN);
    let found = |b| claim.judge(&exact(&[("a", 1.0), ("b", b)]));
    assert_eq!([found(3.9).verdict, found(4.0).verdict], [NotMeasurable, Reproduced]);
    assert_eq!(found(3.9).why, "its precondition fails: q, b over a: s 3.9x (0 of 1 at least 4)");
    assert_eq!(claim.judge(&exact(&[("a", 1.0)])).verdict, NotMeasured);

    // Six equal rounds of `a`. The rounds of `b` have an interval below, then across, then above the bound.
    let noisy = |low: f64, high: f64| {
        let b = [low, high].repeat(3);
        claim.judge(&rounds("discrete", &[("a", vec![1.0; 6]), ("b", b)]))
    };
    let of = [noisy(3.0, 3.9), noisy(3.0, 4.5), noisy(4.0, 4.5)];
    assert_eq!(of.each_ref().map(|finding| finding.verdict), [NotMeasurable, Undecided, Reproduced]);
    assert!(
        of[1].why.starts_with("its precondition is undecided: q, b over a: s 3.75x [3 .. 4.5]"),
        "{}",
        of[1].why
    );
}

#[test]
fn noise_in_one_place_does_not_hide_a_failure_in_another() {
    const SMALL: &[Test] = &[Test::value(OF_A, AtMost(1.0))];
    let of = |scene: &str, rounds: [f64; 2]| TableRecord {
        scene: scene.into(),
        x: None,
        row: Row::of_rounds("a", "q", "ms", Some(rounds.repeat(3))),
    };
    let (holds, noise, fails) = ([0.8, 0.9], [0.9, 1.1], [1.1, 1.2]);
    let found = |places: &[[f64; 2]]| {
        let records = ["s", "t", "u"].iter().zip(places).map(|(scene, rounds)| of(scene, *rounds)).collect();
        verdict(SMALL, &Table { records, ..table("discrete", &[]) })
    };
    assert_eq!([found(&[holds, noise]), found(&[noise, noise])], [Undecided; 2]);
    assert_eq!([found(&[fails, noise]), found(&[fails, fails, noise])], [NotReproduced; 2]);
    assert_eq!(found(&[holds, noise, fails]), InPart);
}

#[test]
fn the_best_place_is_chosen_on_every_second_round_and_judged_on_the_others() {
    const FAST: &[Test] = &[Test::ratio(OF_B, OF_A, AtLeast(2.0))];
    let claim = Claim::ours("id", "text", FAST).somewhere();
    let exact = |ratios: [f64; 3]| {
        let places = ["s", "t", "u"].into_iter().zip(ratios);
        let rows: Vec<_> = places
            .flat_map(|(scene, ratio)| {
                [("a", 1.0), ("b", ratio)].map(|(name, q)| (scene, None, name, Value::Number(q)))
            })
            .collect();
        claim.judge(&table("discrete", &rows))
    };
    assert_eq!([exact([1.0, 2.0, 1.5]).verdict, exact([1.0, 1.9, 1.5]).verdict], [Reproduced, NotReproduced]);
    assert!(exact([1.0, 2.0, 1.5]).numbers.ends_with("t 2x"), "{}", exact([1.0, 2.0, 1.5]).numbers);
    assert!(exact([1.0, 2.0, 1.5]).why.contains("best of 3 places"), "{}", exact([1.0, 2.0, 1.5]).why);

    // In t, only the rounds that choose the place are fast. In s, all rounds are fast enough.
    let noisy = |of_s: f64| {
        let row = |scene: &str, name: &str, rounds: [f64; 2]| TableRecord {
            scene: scene.into(),
            x: None,
            row: Row::of_rounds(name, "q", "ms", Some(rounds.repeat(6))),
        };
        let rows =
            [("s", "b", [of_s; 2]), ("t", "b", [3.0, 1.0]), ("s", "a", [1.0; 2]), ("t", "a", [1.0; 2])];
        let records = rows.map(|(scene, name, rounds)| row(scene, name, rounds)).to_vec();
        claim.judge(&Table { records, ..table("discrete", &[]) }).verdict
    };
    assert_eq!([noisy(2.5), noisy(3.5)], [NotReproduced, Reproduced]);
}

#[test]
fn the_mean_the_growth_and_the_steps_follow_their_definitions() {
    const MEAN: &[Test] = &[Test::value(OF_A, AtMost(2.0))];
    let of = |numbers: &[(&'static str, f64, f64)]| {
        let rows: Vec<_> =
            numbers.iter().map(|&(scene, x, number)| (scene, Some(x), "a", Value::Number(number))).collect();
        table("discrete", &rows)
    };
    let mean = Claim::ours("id", "text", MEAN).at(Places::mean(&["s", "t"]));
    let found = |second| mean.judge(&of(&[("s", 1.0, 1.0), ("t", 1.0, second)])).verdict;
    assert_eq!([found(2.9), found(3.0), found(3.1)], [Reproduced, Reproduced, NotReproduced]);
    assert_eq!(mean.judge(&of(&[("s", 1.0, 1.0)])).verdict, NotMeasured, "a scene is missing");

    const GROWTH: &[Test] = &[Test::growth(OF_A, 2.0, AtMost(1.25))];
    // x grows by a factor of 4, so growth of order 2 is a factor of 16. Values between do not count.
    let found = |max| verdict(GROWTH, &of(&[("s", 4.0, max), ("s", 1.0, 2.0), ("s", 2.0, 99.0)]));
    assert_eq!([found(39.0), found(40.0), found(41.0)], [Reproduced, Reproduced, NotReproduced]);
    assert_eq!(verdict(GROWTH, &of(&[("s", 1.0, 2.0)])), NotMeasured, "one x has no growth");

    const STEPS: &[Test] = &[Test::steps(OF_A, Below(1.0))];
    let found = |last| verdict(STEPS, &of(&[("s", 1.0, 3.0), ("s", 2.0, 2.0), ("s", 3.0, last)]));
    assert_eq!([found(1.9), found(2.0)], [Reproduced, InPart]);
}

#[test]
fn a_pick_selects_an_end_or_a_point_or_the_least_value_or_the_other_variants() {
    let summary = Value::Summary(crate::stats::Summary::of(&[1.0, 2.0, 9.0]).unwrap());
    let spread = table("discrete", &[("s", None, "a", summary)]);
    const MIN: &[Test] = &[Test::value(OF_A.part(Statistic::Least), Equal(1.0))];
    const MEDIAN: &[Test] = &[Test::value(OF_A, Equal(2.0))];
    const MAX: &[Test] = &[Test::value(OF_A.part(Statistic::Most), Equal(9.0))];
    assert_eq!([MIN, MEDIAN, MAX].map(|tests| verdict(tests, &spread)), [Reproduced; 3]);

    const POINTS: &[Test] =
        &[Test::value(each("q", || vec!["a".into()]).x(At::Points(1.0, 2.0)), AtMost(5.0))];
    let curve = |at_2| {
        let points = Value::Series(vec![[0.0, 99.0], [1.0, 5.0], [2.0, at_2], [4.0, 99.0]]);
        verdict(POINTS, &table("discrete", &[("s", None, "a", points)]))
    };
    assert_eq!([curve(5.0), curve(5.1)], [Reproduced, NotReproduced]);

    const LOWEST: &[Test] = &[Test::ratio(OF_A.x(At::X(2.0)), OF_A.x(At::Least), AtMost(2.0))];
    let swept = |at_2| {
        let at = |x, number| ("s", Some(x), "a", Value::Number(number));
        judged(LOWEST, &table("discrete", &[at(1.0, 4.0), at(2.0, at_2), at(3.0, 3.0)]))
    };
    assert_eq!([swept(6.0).verdict, swept(6.1).verdict], [Reproduced, NotReproduced]);
    assert!(swept(6.0).numbers.ends_with("s 2x (least at 3)"), "{:?}", swept(6.0));

    const SAME: &[Test] = &[Test::difference(others("q", "b"), OF_B, Equal(0.0))];
    let found = |c| judged(SAME, &exact(&[("a", 7.0), ("b", 7.0), ("c", c)]));
    assert_eq!([found(7.0).verdict, found(8.0).verdict], [Reproduced, NotReproduced]);
}
