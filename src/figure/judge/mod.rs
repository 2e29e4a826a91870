//! One judge for every claim: from the rows of a table to a verdict.
//!
//! An exact number meets or misses its bound. A repeated measurement meets the bound if the 95 % confidence interval of
//! its median is on the right side, and misses it if the interval is on the wrong side. Otherwise the claim is
//! undecided. Ratios and differences of interleaved measurements are computed for each round.

mod sample;
#[cfg(test)]
mod tests;

use super::claim::{At, Better, Bound, Claim, Pick, Places, Term, Test, Who};
use super::words::human;
use super::{Finding, Table, Verdict};
use crate::stats::{median, median_interval};
use sample::{FoundSamples, Sample, SceneAt, places};

/// Fewest rounds for a 95 % confidence interval of the median: the range of 5 samples misses the median in 6 % of all
/// cases (2 x 2^-5).
const LEAST_ROUNDS: usize = 6;

/// Largest number of items that are listed one by one. More items are reported as a range; failing items are named.
const MOST_LISTED: usize = 8;

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
        let found: Vec<Items> = self.tests.iter().map(|test| test.items(table, &self.places)).collect();
        let numbers = numbers(self.tests, &found);
        if let Some(why) = self.lost(table) {
            return Finding::new(Verdict::NotMeasured, numbers, why);
        }
        for (given, items) in self.given.iter().map(|test| (test, test.items(table, &self.places))) {
            if items.items.is_empty() {
                let why = format!("its precondition was not measured: no {}", given.term.label());
                return Finding::new(Verdict::NotMeasured, numbers, why);
            }
            if items.items.iter().any(|item| !item.met()) {
                let numbers_given = self::numbers(std::slice::from_ref(given), std::slice::from_ref(&items));
                let why = format!("its precondition fails: {numbers_given}, must be {}", given.bound.words());
                return Finding::new(Verdict::NotMeasurable, numbers, why);
            }
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
        let items: Vec<&Item> = found.iter().flat_map(|items| &items.items).collect();
        let verdict = verdict(&items);
        let verdict = if self.timed && table.machine.is_software() { verdict.here() } else { verdict };
        Finding::new(verdict, numbers, why(self.tests, &found))
    }
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
/// if a number there misses its bound.
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
        (_, _, 1..) => Verdict::Undecided,
        (0, ..) => Verdict::NotReproduced,
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
    fn met(&self) -> bool {
        matches!(self.outcome, BoundRelation::Holds | BoundRelation::Better)
    }

    /// `earth/oblique 2.7x [2.6 .. 2.9] (tile-memo)`
    fn words(&self) -> String {
        let Item { place, names, unit, value, interval: [low, high], rounds, .. } = self;
        let interval =
            if *rounds > 0 { format!(" [{} .. {}]", human(*low), human(*high)) } else { String::new() };
        let names = if names.is_empty() { String::new() } else { format!(" ({names})") };
        // Without the separator, "solid at 50 0.9x" reads as two numbers.
        let colon = if place.ends_with(|c: char| c.is_ascii_digit()) { ":" } else { "" };
        format!("{place}{colon} {}{unit}{interval}{names}", human(*value))
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
    fn compared(&self, place: &SceneAt, a: &Sample, b: &Sample) -> Option<Item> {
        let halved = a.chosen || b.chosen;
        let judged = |sample: &Sample| if halved { sample.judged() } else { sample.clone() };
        let (a, b) = (judged(a), judged(b));
        if matches!(self.term, Term::Ratio(..)) && a.value == 0.0 && b.value == 0.0 {
            return None;
        }
        Some(self.item(place, &[&a, &b], compared(&a, &b, self.term.of())))
    }

    /// Growth of a quantity from the smallest x to the largest, or from each x to the next.
    fn grown(&self, place: &SceneAt, samples: &[Sample]) -> Vec<Item> {
        let ratio = |small: &Sample, large: &Sample, power: f64| {
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

    fn item(&self, place: &SceneAt, samples: &[&Sample], measured: Measured) -> Item {
        let Measured { value, interval, rounds } = measured;
        let picks = self.term.picks();
        let named = samples.iter().zip(picks).filter(|(_, pick)| pick.who.only().is_none());
        let points = |x: f64| format!(" at {x}");
        let name = |(sample, pick): (&&Sample, _)| match pick {
            Pick { x: At::Points(..), .. } => {
                sample.variant.clone() + &sample.x.map_or(String::new(), points)
            }
            _ => sample.variant.clone(),
        };
        let least = samples.iter().zip(self.term.picks()).find(|(_, pick)| pick.x == At::Least);
        let mut names: Vec<String> = named.map(name).collect();
        names.extend(least.and_then(|(sample, _)| Some(format!("least at {}", sample.x?))));
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

fn measured(sample: &Sample) -> Measured {
    let interval = median_interval(&sample.rounds).unwrap_or([sample.value; 2]);
    Measured { value: sample.value, interval, rounds: sample.rounds.len() }
}

/// Applies `of` to two samples: round by round if they are interleaved, otherwise to the ends of both
/// intervals. `of` increases in its first argument and decreases in its second.
fn compared(a: &Sample, b: &Sample, of: impl Fn(f64, f64) -> f64) -> Measured {
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
        let judged = |sample: Sample| if sample.chosen { sample.judged() } else { sample };
        found.samples.extend(here.samples.into_iter().map(|sample| Sample { x: Some(x), ..judged(sample) }));
        found.why_not = found.why_not.or(here.why_not);
    }
    found
}

impl Bound {
    fn met(self, value: f64) -> bool {
        match self {
            Bound::AtLeast(bound) => value >= bound,
            Bound::AtMost(bound) => value <= bound,
            Bound::Above(bound) => value > bound,
            Bound::Below(bound) => value < bound,
            Bound::Equal(bound) => value == bound,
            Bound::Within(low, high, _) => (low..=high).contains(&value),
        }
    }

    /// Met or better.
    fn fine(self, value: f64) -> bool {
        self.met(value) || self.bettered(value)
    }

    /// Outside the range, on its better side.
    fn bettered(self, value: f64) -> bool {
        match self {
            Bound::Within(low, _, Better::Less) => value < low,
            Bound::Within(_, high, Better::More) => value > high,
            _ => false,
        }
    }

    /// Values at which the outcome changes between met and missed.
    fn edges(self) -> Vec<f64> {
        match self {
            Bound::Within(_, edge, Better::Less) | Bound::Within(edge, _, Better::More) => vec![edge],
            Bound::AtLeast(edge)
            | Bound::AtMost(edge)
            | Bound::Above(edge)
            | Bound::Below(edge)
            | Bound::Equal(edge) => vec![edge],
            Bound::Within(low, high, _) => vec![low, high],
        }
    }

    fn outcome(self, value: f64, [low, high]: [f64; 2], rounds: usize, halved: bool) -> BoundRelation {
        let factor = if halved { 2.0 } else { 1.0 };
        // A range can be missed on either side.
        let astride = self.edges().iter().any(|&edge| low < edge && edge < high);
        match [self.fine(low), self.fine(high)] {
            _ if (1..LEAST_ROUNDS).contains(&rounds) => {
                BoundRelation::Undecided(factor * LEAST_ROUNDS as f64)
            }
            [true, true] if self.bettered(low) && self.bettered(high) => BoundRelation::Better,
            [true, true] => BoundRelation::Holds,
            [false, false] if !astride => BoundRelation::Fails,
            _ if rounds == 0 => BoundRelation::Fails,
            _ => BoundRelation::Undecided(factor * self.rounds_to_decide(value, [low, high], rounds as f64)),
        }
    }

    /// Estimates the rounds until the interval excludes the nearest edge: intervals shrink with the square
    /// root of the rounds.
    fn rounds_to_decide(self, value: f64, [low, high]: [f64; 2], rounds: f64) -> f64 {
        let needed = |edge: f64| {
            let (half, away) =
                if edge < value { (value - low, value - edge) } else { (high - value, edge - value) };
            rounds * (half / away).powi(2).max(1.0)
        };
        let inside = self.edges().into_iter().filter(|edge| (low..=high).contains(edge));
        inside.map(needed).fold(rounds + 1.0, f64::max).ceil()
    }

    /// `at most 2`
    pub fn words(self) -> String {
        match self {
            Bound::AtLeast(bound) => format!("at least {}", human(bound)),
            Bound::AtMost(bound) => format!("at most {}", human(bound)),
            Bound::Above(bound) => format!("above {}", human(bound)),
            Bound::Below(bound) => format!("below {}", human(bound)),
            Bound::Equal(bound) => format!("equal to {}", human(bound)),
            Bound::Within(low, high, _) => format!("within {} to {}", human(low), human(high)),
        }
    }
}

impl Who {
    /// The name, if there is only one.
    fn only(self) -> Option<String> {
        match self {
            Who::One(name) => Some(name.into()),
            Who::Best(names) | Who::Each(names) => Some(names()).filter(|names| names.len() == 1)?.pop(),
            Who::Others(_) => None,
        }
    }
}

impl Term {
    fn picks(&self) -> Vec<Pick> {
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
            Who::Best(_) => pick.who.only().unwrap_or_else(|| "the best".into()),
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

/// The numbers of all tests, each after its term.
fn numbers(tests: &[Test], found: &[Items]) -> String {
    let of = |(test, Items { items, .. }): (&Test, &Items)| {
        let values = match &items[..] {
            [] => return None,
            items if items.len() <= MOST_LISTED => {
                items.iter().map(Item::words).collect::<Vec<_>>().join(", ")
            }
            items => {
                let by = |a: &&Item, b: &&Item| a.value.total_cmp(&b.value);
                let (least, most) = (items.iter().min_by(by)?, items.iter().max_by(by)?);
                match least.value == most.value {
                    true => format!("{}{} in all {}", human(least.value), least.unit, items.len()),
                    false => format!("{} to {}, {} numbers", least.words(), most.words(), items.len()),
                }
            }
        };
        Some(format!("{}: {values}", test.term.label()))
    };
    tests.iter().zip(found).filter_map(of).collect::<Vec<_>>().join("; ")
}

/// The bounds, and the places in which a number misses its bound or is undecided.
fn why(tests: &[Test], found: &[Items]) -> String {
    let of = |(test, Items { items, .. }): (&Test, &Items)| {
        let met = items.iter().filter(|item| item.met()).count();
        let better = items.iter().filter(|item| item.outcome == BoundRelation::Better).count();
        let mut words = format!("{met} of {} {}", items.len(), test.bound.words());
        if better > 0 {
            words += &format!(" or better ({better} better)");
        }
        let named = |item: &Item| match items.len() {
            1 => String::new(),
            ..=MOST_LISTED => format!(" {}", item.place),
            _ => format!(" {}", item.words()),
        };
        let failed: Vec<String> =
            items.iter().filter(|item| item.outcome == BoundRelation::Fails).map(named).collect();
        if !failed.is_empty() && failed.len() < items.len() {
            let more = if failed.len() > MOST_LISTED { ", …" } else { "" };
            words += &format!(", not{}{more}", failed[..failed.len().min(MOST_LISTED)].join(","));
        }
        for item in items {
            if let BoundRelation::Undecided(rounds) = item.outcome {
                let rounds = if rounds > 1e5 { "more than 100 000".into() } else { human(rounds) };
                words += &format!(", undecided{}: {rounds} rounds would decide", named(item));
            }
        }
        words
    };
    let mut words: Vec<String> = tests.iter().zip(found).map(of).collect();
    let mut absent: Vec<&String> = found.iter().flat_map(|items| &items.why_not).collect();
    absent.dedup();
    if let Some(first) = absent.first() {
        words.push(format!("not judged in {} places ({first})", absent.len()));
    }
    words.join("; ")
}
