//! One judge for every claim: from the rows of a table to a verdict.
//!
//! An exact number meets or misses its bound. A repeated measurement meets the bound if the 95 % confidence interval of
//! its median is on the right side, and misses it if the interval is on the wrong side. Otherwise the claim is
//! undecided. Ratios and differences of interleaved measurements are computed for each round.

mod bound;
mod sample;
#[cfg(test)]
mod tests;
mod words;

use super::claim::{At, Claim, Pick, Places, Term, Test, VariantPick};
use super::{Finding, Row, Table, TableRecord, Value, Verdict};
use crate::stats::{Summary, median, median_interval};
use sample::{ClaimSample, FoundSamples, SceneAt, places};
use words::{numbers, why};

/// Fewest rounds for a 95 % confidence interval of the median: the range of 5 samples misses the median in 6 % of all
/// cases (2 x 2^-5).
const MIN_ROUNDS: usize = 6;

/// Largest number of items that are listed one by one. More items are reported as a range; failing items are named.
const MAX_LISTED: usize = 8;

/// A number's relation to its bound.
#[derive(Clone, Copy, Debug, PartialEq)]
enum BoundRelation {
    Holds,
    /// Beyond the stated range, on its better side.
    Better,
    Fails,
    /// The interval contains the bound. The number estimates how many rounds would exclude it.
    Undecided(f64),
}

/// A number compared with a bound.
#[derive(Clone, Debug)]
struct Item {
    /// The place in which the claim holds or fails with this number.
    at: SceneAt,
    place: String,
    /// The compared variants, if the test chooses among several.
    names: String,
    unit: String,
    value: f64,
    interval: [f64; 2],
    /// Number of rounds from which the interval is computed; 0 for an exact number.
    rounds: usize,
    outcome: BoundRelation,
}

/// All numbers of a test.
#[derive(Debug, Default)]
struct Items {
    items: Vec<Item>,
    /// Places where nothing could be compared, with the reason.
    why_not: Vec<String>,
}

impl Claim {
    /// The verdict on the numbers of `table`.
    pub fn judge(&self, table: &Table) -> Finding {
        let best = if self.somewhere { self.in_best_place(table) } else { None };
        let Some((best, places)) = best else { return self.judge_all(table) };
        let mut finding = self.judge_all(&best);
        finding.why += &format!(" (the best of {places} places, chosen by every second round)");
        finding
    }

    /// The rows of the place with the best number, and the number of places. As for the best of several variants, every
    /// second round chooses the place, and the other rounds remain for the judgement. If the same rounds did both,
    /// noise would favour the chosen place.
    fn in_best_place(&self, table: &Table) -> Option<(Table, usize)> {
        let [test] = self.tests else { return None };
        let chosen_by = test.items(&every_second_round(table, 0), &self.places).items;
        let by =
            |a: &&Item, b: &&Item| test.bound.shortfall(a.value).total_cmp(&test.bound.shortfall(b.value));
        let at = &chosen_by.iter().min_by(by)?.at;
        let mut best = every_second_round(table, 1);
        best.records
            .retain(|record| at.scenes.contains(&record.scene) && at.x.is_none_or(|x| record.x == Some(x)));
        Some((best, chosen_by.len()))
    }

    fn judge_all(&self, table: &Table) -> Finding {
        let mut found: Vec<Items> = self.tests.iter().map(|test| test.items(table, &self.places)).collect();
        let numbers = numbers(self.tests, &found);
        if let Some(why) = self.lost(table) {
            return Finding::new(Verdict::NotMeasured, numbers, why);
        }
        if let Some((verdict, why)) = self.given.iter().find_map(|given| self.unmet(given, table)) {
            return Finding::new(verdict, numbers, why);
        }
        // If a test has no number, the claim has no judgement, whatever the results of the other tests are.
        if let Some(empty) = found.iter().position(|items| items.items.is_empty()) {
            return match found[empty].why_not.first() {
                Some(why) => Finding::new(Verdict::NotMeasurable, numbers, why),
                None => {
                    let label = self.tests[empty].term.label();
                    Finding::new(Verdict::NotMeasured, numbers, format!("no {label} was measured"))
                }
            };
        }
        if self.somewhere {
            found.iter_mut().flat_map(|items| &mut items.items).for_each(Item::double_rounds);
        }
        let items: Vec<&Item> = found.iter().flat_map(|items| &items.items).collect();
        let verdict = verdict(&items);
        let verdict = if self.timed && table.machine.is_software() { verdict.here() } else { verdict };
        Finding::new(verdict, numbers, why(self.tests, &found))
    }

    /// The verdict if the precondition `given` fails, is undecided or was not measured, and why.
    fn unmet(&self, given: &Test, table: &Table) -> Option<(Verdict, String)> {
        let items = given.items(table, &self.places);
        if items.items.is_empty() {
            let why = format!("its precondition was not measured: no {}", given.term.label());
            return Some((Verdict::NotMeasured, why));
        }
        if items.items.iter().all(Item::met) {
            return None;
        }
        let fails = items.items.iter().any(|item| item.outcome == BoundRelation::Fails);
        let (verdict, word) =
            if fails { (Verdict::NotMeasurable, "fails") } else { (Verdict::Undecided, "is undecided") };
        let (given, items) = (std::slice::from_ref(given), std::slice::from_ref(&items));
        Some((verdict, format!("its precondition {word}: {} ({})", numbers(given, items), why(given, items))))
    }
}

/// The table with every second round of each repeated measurement, from round `first` on.
fn every_second_round(table: &Table, first: usize) -> Table {
    let half = |record: &TableRecord| {
        let rounds: Vec<f64> = record.row.rounds.iter().skip(first).step_by(2).copied().collect();
        let value = Summary::of(&rounds).map_or_else(|| record.row.value.clone(), Value::Summary);
        TableRecord { row: Row { rounds, value, ..record.row.clone() }, ..record.clone() }
    };
    Table { records: table.records.iter().map(half).collect(), ..table.clone() }
}

impl Claim {
    /// The number of missing cells and why; `None` if all are present.
    fn lost(&self, table: &Table) -> Option<String> {
        let mut lost: Vec<(&String, usize)> = Vec::new();
        for (_, became) in table.lost.iter().filter(|(cell, _)| self.places.hold(&cell.scene, cell.x)) {
            match lost.iter_mut().find(|(known, _)| *known == became) {
                Some((_, count)) => *count += 1,
                None => lost.push((became, 1)),
            }
        }
        let words = lost.iter().map(|(became, count)| format!("{count} {became}")).collect::<Vec<_>>();
        (!words.is_empty()).then(|| format!("missing cells: {}", words.join(", ")))
    }
}

/// The verdict over all places. A claim holds in a place if all numbers there meet their bounds, and fails in a place
/// if a number there misses its bound. If the claim fails in one place and holds in none (the others are undecided), it
/// is not reproduced: even if it held in all undecided places, it would not hold everywhere.
fn verdict(items: &[&Item]) -> Verdict {
    let (mut holds, mut better, mut fails, mut undecided) = (0, 0, 0, 0);
    for place in judged_places(items) {
        let here: Vec<BoundRelation> =
            items.iter().filter(|item| item.at.covers(place)).map(|item| item.outcome).collect();
        let any = |is: fn(&BoundRelation) -> bool| here.iter().any(is);
        *if any(|outcome| *outcome == BoundRelation::Fails) {
            &mut fails
        } else if any(|outcome| matches!(outcome, BoundRelation::Undecided(_))) {
            &mut undecided
        } else if any(|outcome| *outcome == BoundRelation::Holds) {
            &mut holds
        } else {
            &mut better
        } += 1;
    }
    match (holds + better, fails, undecided) {
        (1.., 1.., _) => Verdict::InPart,
        (_, 1.., _) => Verdict::NotReproduced,
        (_, _, 1..) => Verdict::Undecided,
        _ if holds == 0 => Verdict::BetterThanStated,
        _ => Verdict::Reproduced,
    }
}

/// The places of `items`. A whole scene counts as a place only if no item belongs to a single value of the scene's
/// sweep.
fn judged_places<'a>(items: &[&'a Item]) -> Vec<&'a SceneAt> {
    let mut places: Vec<&SceneAt> = Vec::new();
    for Item { at, .. } in items {
        let divided = at.x.is_none() && items.iter().any(|item| item.at.x.is_some() && at.covers(&item.at));
        if !divided && !places.contains(&at) {
            places.push(at);
        }
    }
    places
}

impl Item {
    /// If half of the rounds are judged, twice as many must be measured.
    fn double_rounds(&mut self) {
        if let BoundRelation::Undecided(rounds) = &mut self.outcome {
            *rounds *= 2.0;
        }
    }

    fn met(&self) -> bool {
        matches!(self.outcome, BoundRelation::Holds | BoundRelation::Better)
    }
}

impl Test {
    /// Each number of the term, with its outcome.
    fn items(&self, table: &Table, at: &Places) -> Items {
        let mut found = Items::default();
        let swept = !matches!(self.term, Term::Growth(..) | Term::Steps(_)) && !self.term.crosses();
        for place in places(table, at, swept) {
            match self.term {
                Term::Value(pick) => {
                    let FoundSamples { samples, why_not } = FoundSamples::of(table, &pick, &place);
                    found.why_not.extend(why_not.filter(|_| samples.is_empty()));
                    for sample in samples {
                        let sample = if sample.chosen { sample.judged() } else { sample };
                        found.items.push(self.item(&place, &[&sample], measured(&sample)));
                    }
                }
                Term::Ratio(of, to) | Term::Difference(of, to) => {
                    let (a, b) = (FoundSamples::of(table, &of, &place), FoundSamples::of(table, &to, &place));
                    if a.samples.is_empty() || b.samples.is_empty() {
                        found.why_not.extend(a.why_not.or(b.why_not));
                    }
                    let pairs = a.samples.iter().flat_map(|a| b.samples.iter().map(move |b| (a, b)));
                    found.items.extend(pairs.filter_map(|(a, b)| self.compared(&place, a, b)));
                }
                Term::Growth(pick, _) | Term::Steps(pick) => {
                    let along = along(table, at, &pick, &place);
                    found.why_not.extend(along.why_not.filter(|_| along.samples.len() < 2));
                    found.items.extend(self.grown(&place, &along.samples));
                }
            }
        }
        found
    }

    /// Ratio or difference of two samples; `None` for 0 / 0.
    fn compared(&self, place: &SceneAt, a: &ClaimSample, b: &ClaimSample) -> Option<Item> {
        let halved = a.chosen || b.chosen;
        let judged = |sample: &ClaimSample| if halved { sample.judged() } else { sample.clone() };
        let (a, b) = (judged(a), judged(b));
        if matches!(self.term, Term::Ratio(..)) && a.value == 0.0 && b.value == 0.0 {
            return None;
        }
        Some(self.item(place, &[&a, &b], compared(&a, &b, self.term.of())))
    }

    /// Growth of a quantity from the smallest x to the largest, or from each x to the next.
    fn grown(&self, place: &SceneAt, samples: &[ClaimSample]) -> Vec<Item> {
        let ratio = |small: &ClaimSample, large: &ClaimSample, power: f64| {
            let factor = (large.x.unwrap_or(1.0) / small.x.unwrap_or(1.0)).powf(power);
            let mut grown = compared(large, small, |a, b| a / b);
            grown.value /= factor;
            grown.interval = grown.interval.map(|end| end / factor);
            let at = SceneAt { x: large.x, ..place.clone() };
            self.item(&at, &[large, small], grown)
        };
        match (self.term, samples) {
            // Growth belongs to the whole scene, but is shown with the largest x.
            (Term::Growth(_, power), [small, .., large]) => {
                vec![Item { at: place.clone(), ..ratio(small, large, power) }]
            }
            (Term::Steps(_), _) => samples.windows(2).map(|pair| ratio(&pair[0], &pair[1], 0.0)).collect(),
            _ => Vec::new(),
        }
    }

    fn item(&self, place: &SceneAt, samples: &[&ClaimSample], measured: Measured) -> Item {
        let Measured { value, interval, rounds } = measured;
        let picks = self.term.picks();
        let named = samples.iter().zip(picks).filter(|(_, pick)| pick.who.only().is_none());
        let points = |x: f64| format!(" at {x}");
        let name = |(sample, pick): (&&ClaimSample, _)| match pick {
            Pick { x: At::Points(..), .. } => {
                sample.variant.clone() + &sample.x.map_or(String::new(), points)
            }
            _ => sample.variant.clone(),
        };
        let min = samples.iter().zip(self.term.picks()).find(|(_, pick)| pick.x == At::Least);
        let mut names: Vec<String> = named.map(name).collect();
        names.extend(min.and_then(|(sample, _)| Some(format!("least at {}", sample.x?))));
        let halved = samples.iter().any(|sample| sample.chosen);
        let unit = match self.term {
            Term::Value(_) | Term::Difference(..) => {
                samples.first().map_or(String::new(), |sample| format!(" {}", sample.unit))
            }
            _ => "x".into(),
        };
        Item {
            at: place.clone(),
            place: place.name(),
            names: names.join(" over "),
            unit: if unit == " " { String::new() } else { unit },
            value,
            interval,
            rounds,
            outcome: self.bound.outcome(value, interval, rounds, halved),
        }
    }
}

/// A number with its interval and its rounds.
#[derive(Clone, Copy, Debug)]
struct Measured {
    value: f64,
    interval: [f64; 2],
    rounds: usize,
}

fn measured(sample: &ClaimSample) -> Measured {
    let interval = median_interval(&sample.rounds).unwrap_or([sample.value; 2]);
    Measured { value: sample.value, interval, rounds: sample.rounds.len() }
}

/// Applies `of` to two samples: round by round if they are interleaved, otherwise to the ends of both
/// intervals. `of` increases in its first argument and decreases in its second.
fn compared(a: &ClaimSample, b: &ClaimSample, of: impl Fn(f64, f64) -> f64) -> Measured {
    if a.pairs_with(b) {
        let rounds: Vec<f64> = a.rounds.iter().zip(&b.rounds).map(|(&a, &b)| of(a, b)).collect();
        if rounds.iter().all(|round| !round.is_nan()) {
            let value = median(&rounds).expect("pairs have rounds");
            let interval = median_interval(&rounds).expect("pairs have rounds");
            return Measured { value, interval, rounds: rounds.len() };
        }
    }
    let [first, second] = [measured(a), measured(b)];
    let rounds = match [first.rounds, second.rounds] {
        [0, rounds] | [rounds, 0] => rounds,
        [one, other] => one.min(other),
    };
    let interval = [of(first.interval[0], second.interval[1]), of(first.interval[1], second.interval[0])];
    Measured { value: of(first.value, second.value), interval, rounds }
}

/// A pick at every x of its scene, in order of x.
fn along(table: &Table, at: &Places, pick: &Pick, place: &SceneAt) -> FoundSamples {
    let of_scene = |record: &&super::TableRecord| place.scenes.contains(&record.scene);
    let xs = table.records.iter().filter(of_scene).filter_map(|record| record.x);
    let mut xs: Vec<f64> = xs.filter(|x| (at.x[0]..=at.x[1]).contains(x)).collect();
    xs.sort_by(f64::total_cmp);
    xs.dedup();
    let mut found = FoundSamples::default();
    for x in xs {
        let here = FoundSamples::of(table, pick, &SceneAt { x: Some(x), ..place.clone() });
        let judged = |sample: ClaimSample| if sample.chosen { sample.judged() } else { sample };
        found
            .samples
            .extend(here.samples.into_iter().map(|sample| ClaimSample { x: Some(x), ..judged(sample) }));
        found.why_not = found.why_not.or(here.why_not);
    }
    found
}

impl VariantPick {
    /// The name, if there is only one.
    fn only(self) -> Option<String> {
        match self {
            VariantPick::One(name) => Some(name.into()),
            VariantPick::Best(names) | VariantPick::Each(names) => {
                Some(names()).filter(|names| names.len() == 1)?.pop()
            }
            VariantPick::Others(_) => None,
        }
    }
}

impl Term {
    /// The numbers that the term looks up.
    pub fn picks(&self) -> Vec<Pick> {
        match *self {
            Term::Value(pick) | Term::Growth(pick, _) | Term::Steps(pick) => vec![pick],
            Term::Ratio(a, b) | Term::Difference(a, b) => vec![a, b],
        }
    }

    fn of(&self) -> impl Fn(f64, f64) -> f64 {
        let ratio = matches!(self, Term::Ratio(..));
        move |a, b| if ratio { a / b } else { a - b }
    }

    /// True if the term compares values of the sweep with each other. A place is then a whole scene.
    fn crosses(&self) -> bool {
        self.picks().iter().any(|pick| matches!(pick.x, At::X(_) | At::Least))
    }

    /// `stages 2 and 3, paper over the best`
    fn label(&self) -> String {
        let who = |pick: &Pick| match pick.who {
            VariantPick::Best(_) => pick.who.only().unwrap_or_else(|| "the best".into()),
            who => who.only().unwrap_or_else(|| "each".into()),
        };
        let of = |pick: &Pick| format!("{} of {}", pick.quantity, who(pick)).replace(" of each", "");
        let two = |a: &Pick, b: &Pick, word: &str| match a.quantity == b.quantity {
            true if who(a) == who(b) && who(a) != "the best" => of(a),
            true => format!("{}, {} {word} {}", a.quantity, who(a), who(b)),
            false => format!("{} {word} {}", of(a), of(b)),
        };
        match self {
            Term::Value(pick) => of(pick),
            Term::Ratio(a, b) => two(a, b, "over"),
            Term::Difference(a, b) => two(a, b, "less"),
            Term::Growth(pick, _) => format!("growth of {}", of(pick)),
            Term::Steps(pick) => format!("steps of {}", of(pick)),
        }
    }
}
