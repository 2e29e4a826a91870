//! Splits of one group in an order that suits the cache, instead of that of their errors.
//!
//! Between two tswaps a level's new faces stand at the tail as splits append them, and there the classical order's 4
//! transforms per vertex are paid. Any order of a group's splits is as good as long as each finds its surroundings
//! as they were (see [`super::depend`]): so walk from split to split such that each uses vertices that the one before
//! has brought. Errors inside a group are then a running maximum, which is the price: see [`super`] for both numbers.

use crate::math::ragged::Ragged;
use std::collections::{HashMap, VecDeque};

/// A split on offer.
pub(super) struct Offer<'a> {
    /// Its collapse.
    pub collapse: u32,
    /// The distinct vertices of the faces that it appends.
    pub vertices: &'a [u32],
}

/// The collapses of `offers` in a coherent order for a cache of `entries`. `offers` are in a valid order;
/// `dependencies` name for each collapse those whose splits come before its own.
pub(super) fn coherent(offers: &[Offer<'_>], dependencies: &Ragged<u32>, entries: u32) -> Vec<u32> {
    let mut walk = Walk::new(offers, dependencies, entries as usize);
    let mut order = Vec::with_capacity(offers.len());
    // The first that is not done depends on none that is not: the offers are in a valid order.
    let mut first = 0;
    while order.len() < offers.len() {
        while walk.done.get(first) == Some(&true) {
            first += 1;
        }
        let next = walk.best().unwrap_or(first);
        walk.take(next);
        order.push(offers[next].collapse);
    }
    order
}

struct Walk<'a> {
    offers: &'a [Offer<'a>],
    entries: usize,
    done: Vec<bool>,
    /// For each offer how many others it waits for, and who waits for it.
    waits: Vec<u32>,
    followers: Vec<Vec<usize>>,
    at_vertex: HashMap<u32, Vec<usize>>,
    cache: VecDeque<u32>,
}

/// What finishing a vertex is worth, against a transform: divided by the number of offers that are left at it.
const VALENCE: f64 = 0.3;

impl<'a> Walk<'a> {
    fn new(offers: &'a [Offer<'a>], dependencies: &Ragged<u32>, entries: usize) -> Self {
        let index: HashMap<u32, usize> = offers.iter().enumerate().map(|(n, o)| (o.collapse, n)).collect();
        let mut walk = Self {
            offers,
            entries,
            done: vec![false; offers.len()],
            waits: vec![0; offers.len()],
            followers: vec![Vec::new(); offers.len()],
            at_vertex: HashMap::new(),
            cache: VecDeque::new(),
        };
        for (n, offer) in offers.iter().enumerate() {
            for before in dependencies.row(offer.collapse as usize).iter().filter_map(|c| index.get(c)) {
                walk.waits[n] += 1;
                walk.followers[*before].push(n);
            }
            offer.vertices.iter().for_each(|&vertex| walk.at_vertex.entry(vertex).or_default().push(n));
        }
        walk
    }

    /// The free offer with the least to transform among those at vertices in the cache.
    fn best(&self) -> Option<usize> {
        let near = self.cache.iter().filter_map(|vertex| self.at_vertex.get(vertex)).flatten().copied();
        let free = near.filter(|&offer| !self.done[offer] && self.waits[offer] == 0);
        free.map(|offer| (self.worth(offer), offer))
            .max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))
            .map(|(_, offer)| offer)
    }

    fn worth(&self, offer: usize) -> f64 {
        let vertex = |vertex: &u32| {
            let missed = !self.cache.contains(vertex);
            VALENCE / self.at_vertex[vertex].len() as f64 - f64::from(u8::from(missed))
        };
        self.offers[offer].vertices.iter().map(vertex).sum()
    }

    fn take(&mut self, offer: usize) {
        self.done[offer] = true;
        let followers = std::mem::take(&mut self.followers[offer]);
        followers.iter().for_each(|&follower| self.waits[follower] -= 1);
        for &vertex in self.offers[offer].vertices {
            let here = self.at_vertex.get_mut(&vertex).expect("every vertex of an offer is listed");
            here.retain(|&other| other != offer);
            if !self.cache.contains(&vertex) {
                self.cache.push_back(vertex);
                if self.cache.len() > self.entries {
                    self.cache.pop_front();
                }
            }
        }
    }
}
