//! Every claim of every real figure holds on a table that meets its tests, and fails on a table that breaks one of
//! these tests.

use ortelius::figure::claim::{At, Better, Bound, Claim, Pick, Places, Term, Test, VariantPick};
use ortelius::figure::{Effort, Figure, Machine, Row, Table, TableRecord, Value, Verdict};
use ortelius::renderer::figures::FAMILIES;
use std::collections::BTreeMap;

/// Scene, bits of x, variant and quantity.
type Key = (String, Option<u64>, String, &'static str);

/// A table under construction.
#[derive(Clone, Default)]
struct Rows {
    numbers: BTreeMap<Key, f64>,
    curves: BTreeMap<Key, Vec<[f64; 2]>>,
}

/// A number on the right side of a bound, and a number on the wrong side.
fn sides(bound: Bound) -> [f64; 2] {
    let off = |edge: f64| (edge.abs() * 1e-3).max(1e-3);
    match bound {
        Bound::AtLeast(edge) | Bound::Above(edge) => [edge + off(edge), edge - off(edge)],
        Bound::AtMost(edge) | Bound::Below(edge) => [edge - off(edge), edge + off(edge)],
        Bound::Equal(edge) => [edge, edge + 1.0],
        Bound::Within(low, high, Better::More) => [(low + high) / 2.0, low - off(low)],
        Bound::Within(low, high, _) => [(low + high) / 2.0, high + off(high)],
    }
}

fn variants(who: VariantPick) -> Vec<String> {
    match who {
        VariantPick::One(name) => vec![name.into()],
        VariantPick::Best(names) | VariantPick::Each(names) => names(),
        VariantPick::Others(_) => vec!["any other".into()],
    }
}

impl Rows {
    fn keys(pick: &Pick, scene: &str, x: Option<f64>) -> Vec<Key> {
        let scene = pick.scene.unwrap_or(scene);
        let x = if let At::X(x) = pick.x { Some(x) } else { x };
        let key = |name: String| (scene.to_string(), x.map(f64::to_bits), name, pick.quantity);
        variants(pick.who).into_iter().map(key).collect()
    }

    fn set(&mut self, pick: &Pick, scene: &str, x: Option<f64>, number: f64) {
        for key in Rows::keys(pick, scene, x) {
            match pick.x {
                At::Points(low, high) => {
                    // A claim about a border of 0 and a claim about wider borders use different points of one curve.
                    let curve = self.curves.entry(key).or_default();
                    curve.retain(|[x, _]| !(low..=high).contains(x));
                    curve.extend([[low, number], [high, number]]);
                }
                _ => drop(self.numbers.insert(key, number)),
            }
        }
    }

    fn get(&self, pick: &Pick, scene: &str, x: Option<f64>) -> Option<f64> {
        self.numbers.get(&Rows::keys(pick, scene, x)[0]).copied()
    }

    /// Adds rows that give the term the value `number`. If the first of two picks has a row already, the second is
    /// varied.
    fn make(&mut self, term: Term, (scene, x): (&str, Option<f64>), xs: &[f64], number: f64) {
        match term {
            Term::Value(pick) => self.set(&pick, scene, x, number),
            // All places get the value 1, which is then the least value. Only the compared place gets `number`, so that
            // the ratio is `number`.
            Term::Ratio(a, b) if b.x == At::Least => {
                let At::X(at) = a.x else { panic!("the least is compared with a stated x") };
                self.set(&Pick { x: At::Place, ..b }, scene, x, if x == Some(at) { number } else { 1.0 });
            }
            Term::Ratio(a, b) | Term::Difference(a, b) => {
                let of = |a: f64, b: f64| if matches!(term, Term::Ratio(..)) { a * b } else { a + b };
                let less = |a: f64| if matches!(term, Term::Ratio(..)) { a / number } else { a - number };
                match (self.get(&a, scene, x), self.get(&b, scene, x)) {
                    (Some(first), None) => self.set(&b, scene, x, less(first)),
                    (_, second) => {
                        let second = second.unwrap_or(8.0);
                        self.set(&b, scene, x, second);
                        self.set(&a, scene, x, of(number, second));
                    }
                }
            }
            Term::Growth(pick, power) => {
                let x = x.expect("a sweep");
                let factor = if Some(&x) == xs.last() { number } else { 1.0 };
                self.set(&pick, scene, Some(x), 8.0 * factor * (x / xs[0]).powf(power));
            }
            Term::Steps(pick) => {
                let x = x.expect("a sweep");
                let step = xs.iter().position(|other| *other == x).expect("a value of the sweep");
                self.set(&pick, scene, Some(x), 8.0 * number.powi(step as i32));
            }
        }
    }

    fn table(&self, kind: &str) -> Table {
        let record = |(scene, x, variant, quantity): &Key, value| TableRecord {
            scene: scene.clone(),
            x: x.map(f64::from_bits),
            row: Row::new(variant.clone(), *quantity, "", value),
        };
        let numbers = self.numbers.iter().map(|(key, &number)| record(key, Value::Number(number)));
        let curves = self.curves.iter().map(|(key, points)| {
            let mut points = points.clone();
            points.sort_by(|a, b| a[0].total_cmp(&b[0]));
            points.dedup();
            record(key, Value::Series(points))
        });
        let machine = Machine { device_kind: kind.into(), ..Machine::default() };
        Table { machine, records: numbers.chain(curves).collect(), lost: Vec::new() }
    }
}

/// The cells of a claim: the cells of a full run, or the cells of a quick run.
fn cells(figure: &Figure, places: &Places) -> Vec<(String, Option<f64>)> {
    let all = [Effort::Full, Effort::Quick].into_iter().flat_map(|effort| figure.cells(effort));
    let mut found: Vec<(String, Option<f64>)> = Vec::new();
    for cell in all.filter(|cell| places.hold(&cell.scene, cell.x)) {
        if !found.contains(&(cell.scene.clone(), cell.x)) {
            found.push((cell.scene, cell.x));
        }
    }
    found
}

/// Rows that give every test of `claim` a number on the right side of its bound, except test `broken`.
fn rows(figure: &Figure, claim: &Claim, broken: Option<usize>) -> Rows {
    let cells = cells(figure, &claim.places);
    assert!(!cells.is_empty(), "{} {}: no cell of the figure belongs to it", figure.id, claim.id);
    let mut xs: Vec<f64> = cells.iter().filter_map(|(_, x)| *x).collect();
    xs.sort_by(f64::total_cmp);
    xs.dedup();
    let mut rows = Rows::default();
    let mut make = |test: &Test, wrong: bool| {
        for (scene, x) in &cells {
            rows.make(test.term, (scene, *x), &xs, sides(test.bound)[usize::from(wrong)]);
        }
    };
    claim.given.iter().chain(claim.tests).for_each(|test| make(test, false));
    if let Some(at) = broken {
        make(&claim.tests[at], true);
    }
    rows
}

#[test]
fn every_claim_holds_on_a_fitting_table_and_fails_if_one_test_is_broken() {
    let mut count = 0;
    for figure in FAMILIES.iter().flat_map(|(_, figures)| *figures) {
        for claim in figure.claims {
            let name = format!("{} {}", figure.id, claim.id);
            let found = |broken, kind| claim.judge(&rows(figure, claim, broken).table(kind));
            let right = found(None, "discrete");
            assert_eq!(right.verdict, Verdict::Reproduced, "{name}: {right:?}");
            for at in 0..claim.tests.len() {
                let wrong = found(Some(at), "discrete");
                // The first value of the sweep has no step, because no smaller value precedes it.
                let allowed: &[Verdict] =
                    match claim.tests.iter().any(|test| matches!(test.term, Term::Steps(_))) {
                        true => &[Verdict::NotReproduced, Verdict::InPart],
                        false => &[Verdict::NotReproduced],
                    };
                assert!(allowed.contains(&wrong.verdict), "{name}, test {at}: {wrong:?}");
                let here = found(Some(at), "cpu").verdict;
                let is_of_time = [Verdict::NotHere, Verdict::InPartHere].contains(&here);
                assert_eq!(is_of_time, claim.timed, "{name}, test {at} on a software device: {here:?}");
            }
            count += 1;
        }
    }
    assert!(count > 80, "{count} claims");
}
