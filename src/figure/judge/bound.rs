//! A bound compared with a number and its confidence interval.

use super::super::claim::{Better, Bound};
use super::super::words::human;
use super::{BoundRelation, MIN_ROUNDS};

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

    /// Orders values: the best value has the least shortfall.
    pub(super) fn shortfall(self, value: f64) -> f64 {
        match self {
            Bound::AtLeast(_) | Bound::Above(_) | Bound::Within(.., Better::More) => -value,
            Bound::AtMost(_) | Bound::Below(_) | Bound::Within(.., Better::Less) => value,
            Bound::Equal(bound) => (value - bound).abs(),
            Bound::Within(low, high, Better::Neither) => (value - 0.5 * (low + high)).abs(),
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

    pub(super) fn outcome(
        self,
        value: f64,
        [low, high]: [f64; 2],
        rounds: usize,
        halved: bool,
    ) -> BoundRelation {
        let factor = if halved { 2.0 } else { 1.0 };
        // A range can be missed on either side.
        let astride = self.edges().iter().any(|&edge| low < edge && edge < high);
        match [self.fine(low), self.fine(high)] {
            _ if (1..MIN_ROUNDS).contains(&rounds) => BoundRelation::Undecided(factor * MIN_ROUNDS as f64),
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
