//! The numbers of a claim and the reason of its verdict, in words.

use super::super::claim::Test;
use super::super::words::human;
use super::{BoundRelation, Item, Items, MAX_LISTED};

impl Item {
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

/// The numbers of all tests, each after its term.
pub fn numbers(tests: &[Test], found: &[Items]) -> String {
    let of = |(test, Items { items, .. }): (&Test, &Items)| {
        let values = match &items[..] {
            [] => return None,
            items if items.len() <= MAX_LISTED => {
                items.iter().map(Item::words).collect::<Vec<_>>().join(", ")
            }
            items => {
                let by = |a: &&Item, b: &&Item| a.value.total_cmp(&b.value);
                let (min, max) = (items.iter().min_by(by)?, items.iter().max_by(by)?);
                match min.value == max.value {
                    true => format!("{}{} in all {}", human(min.value), min.unit, items.len()),
                    false => format!("{} to {}, {} numbers", min.words(), max.words(), items.len()),
                }
            }
        };
        Some(format!("{}: {values}", test.term.label()))
    };
    tests.iter().zip(found).filter_map(of).collect::<Vec<_>>().join("; ")
}

/// The bounds, and the places in which a number misses its bound or is undecided.
pub fn why(tests: &[Test], found: &[Items]) -> String {
    let of = |(test, Items { items, .. }): (&Test, &Items)| {
        let met = items.iter().filter(|item| item.met()).count();
        let better = items.iter().filter(|item| item.outcome == BoundRelation::Better).count();
        let mut words = format!("{met} of {} {}", items.len(), test.bound.words());
        if better > 0 {
            words += &format!(" or better ({better} better)");
        }
        let named = |item: &Item| match items.len() {
            1 => String::new(),
            ..=MAX_LISTED => format!(" {}", item.place),
            _ => format!(" {}", item.words()),
        };
        let failed: Vec<String> =
            items.iter().filter(|item| item.outcome == BoundRelation::Fails).map(named).collect();
        if !failed.is_empty() && failed.len() < items.len() {
            let more = if failed.len() > MAX_LISTED { ", …" } else { "" };
            words += &format!(", not{}{more}", failed[..failed.len().min(MAX_LISTED)].join(","));
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
