//! Claims of a figure as data: quantities, variants, places and a bound. [`Claim::judge`] gives the
//! verdict.

/// A claim holds if every test holds in every place; with `somewhere`, if its test holds in at least one place.
#[derive(Clone, Copy)]
pub struct Claim {
    /// Unique in the figure.
    pub id: &'static str,
    pub text: &'static str,
    pub from: Origin,
    /// True for a claim about time of the host or the device. On a software device, the verdict of such a claim has
    /// another name ("holds here" instead of "reproduced"), because its times do not predict the times of a GPU.
    pub timed: bool,
    pub places: Places,
    /// True if the claim is that its only test holds in at least one of the places. Otherwise all tests must hold in
    /// all places.
    pub somewhere: bool,
    pub tests: &'static [Test],
    /// Preconditions. Example: vertices must be the bottleneck before their time counts.
    pub given: &'static [Test],
}

/// Who makes the claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The paper, with its section. Such a claim is judged on the paper's variant.
    Paper(&'static str),
    /// This project.
    Ours,
}

impl std::fmt::Display for Origin {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Origin::Paper(section) => write!(f, "paper, {section}"),
            Origin::Ours => f.write_str("ours"),
        }
    }
}

/// The cells to which a claim applies.
#[derive(Clone, Copy)]
pub struct Places {
    /// Empty: all scenes of the figure.
    pub scenes: &'static [&'static str],
    pub except: &'static [&'static str],
    /// Least and greatest value of the sweep, both included.
    pub x: [f64; 2],
    /// True if the scenes' numbers are averaged before the comparison. There is no mean if one scene has no
    /// number.
    pub mean: bool,
}

/// A number for each place, and its bound.
#[derive(Clone, Copy)]
pub struct Test {
    pub term: Term,
    pub bound: Bound,
}

/// How the number for the bound is computed from a table.
#[derive(Clone, Copy)]
pub enum Term {
    Value(Pick),
    /// For interleaved measurements: the median of the per-round ratios. 0 / 0 is left out.
    Ratio(Pick, Pick),
    Difference(Pick, Pick),
    /// Value at the largest x over value at the smallest x, divided by (largest x / smallest x)^power.
    Growth(Pick, f64),
    /// Value at each x over the value at the next smaller x.
    Steps(Pick),
}

/// A quantity of one variant, or of several variants.
#[derive(Clone, Copy)]
pub struct Pick {
    pub quantity: &'static str,
    pub who: VariantPick,
    /// The scene, if it differs from the scene of the place.
    pub scene: Option<&'static str>,
    pub x: At,
    pub part: Statistic,
}

/// The variants of a pick.
#[derive(Clone, Copy)]
pub enum VariantPick {
    One(&'static str),
    /// The variant with the least median. If measurements are repeated, the variant is chosen on every second round and
    /// judged on the other rounds.
    Best(fn() -> Vec<String>),
    /// All these variants, each judged separately.
    Each(fn() -> Vec<String>),
    /// All variants that have the quantity, except this variant.
    Others(&'static str),
}

/// The value of the sweep.
#[derive(Clone, Copy, PartialEq)]
pub enum At {
    /// The value of the place.
    Place,
    X(f64),
    /// The value at which the quantity is smallest.
    Least,
    /// Points of a [`super::Value::Series`] with x in this range, each judged separately.
    Points(f64, f64),
}

/// The number of a [`super::Value::Summary`].
#[derive(Clone, Copy, PartialEq)]
pub enum Statistic {
    Median,
    Least,
    Most,
}

/// The bound of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    AtLeast(f64),
    AtMost(f64),
    Above(f64),
    Below(f64),
    Equal(f64),
    /// Both ends included; the third field is the better side.
    Within(f64, f64, Better),
}

/// The better side of a range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Better {
    Less,
    More,
    Neither,
}

impl Claim {
    /// A claim of this project.
    pub const fn ours(id: &'static str, text: &'static str, tests: &'static [Test]) -> Claim {
        Claim {
            id,
            text,
            from: Origin::Ours,
            timed: false,
            places: Places::ALL,
            somewhere: false,
            tests,
            given: &[],
        }
    }

    /// A claim of the paper, with section.
    pub const fn paper(
        section: &'static str,
        id: &'static str,
        text: &'static str,
        tests: &'static [Test],
    ) -> Claim {
        Claim { from: Origin::Paper(section), ..Claim::ours(id, text, tests) }
    }

    /// A claim of this project about time.
    pub const fn ours_timed(id: &'static str, text: &'static str, tests: &'static [Test]) -> Claim {
        Claim { timed: true, ..Claim::ours(id, text, tests) }
    }

    /// A claim of the paper about time, with section.
    pub const fn paper_timed(
        section: &'static str,
        id: &'static str,
        text: &'static str,
        tests: &'static [Test],
    ) -> Claim {
        Claim { timed: true, ..Claim::paper(section, id, text, tests) }
    }

    pub const fn at(self, places: Places) -> Claim {
        Claim { places, ..self }
    }

    /// The claim that the test holds in at least one place.
    pub const fn somewhere(self) -> Claim {
        assert!(self.tests.len() == 1, "only one number can choose the best place");
        Claim { somewhere: true, ..self }
    }

    pub const fn given(self, given: &'static [Test]) -> Claim {
        Claim { given, ..self }
    }
}

impl Places {
    pub const ALL: Places =
        Places { scenes: &[], except: &[], x: [f64::NEG_INFINITY, f64::INFINITY], mean: false };

    pub const fn scenes(scenes: &'static [&'static str]) -> Places {
        Places { scenes, ..Places::ALL }
    }

    pub const fn except(except: &'static [&'static str]) -> Places {
        Places { except, ..Places::ALL }
    }

    /// The mean over these scenes.
    pub const fn mean(scenes: &'static [&'static str]) -> Places {
        Places { scenes, mean: true, ..Places::ALL }
    }

    /// The same places, limited to values of the sweep from `low` to `high`.
    pub const fn x(self, low: f64, high: f64) -> Places {
        Places { x: [low, high], ..self }
    }

    /// True if the cell belongs to these places.
    pub fn hold(&self, scene: &str, x: Option<f64>) -> bool {
        (self.scenes.is_empty() || self.scenes.contains(&scene))
            && !self.except.contains(&scene)
            && x.is_none_or(|x| (self.x[0]..=self.x[1]).contains(&x))
    }
}

/// A quantity of one variant.
pub const fn one(quantity: &'static str, variant: &'static str) -> Pick {
    Pick::of(quantity, VariantPick::One(variant))
}

/// A quantity of the variant for which the quantity is smallest.
pub const fn best(quantity: &'static str, variants: fn() -> Vec<String>) -> Pick {
    Pick::of(quantity, VariantPick::Best(variants))
}

/// A quantity of each of these variants.
pub const fn each(quantity: &'static str, variants: fn() -> Vec<String>) -> Pick {
    Pick::of(quantity, VariantPick::Each(variants))
}

/// A quantity of every variant that has the quantity, except one variant.
pub const fn others(quantity: &'static str, but: &'static str) -> Pick {
    Pick::of(quantity, VariantPick::Others(but))
}

/// A quantity of every variant that has the quantity.
pub const fn every(quantity: &'static str) -> Pick {
    others(quantity, "")
}

impl Pick {
    const fn of(quantity: &'static str, who: VariantPick) -> Pick {
        Pick { quantity, who, scene: None, x: At::Place, part: Statistic::Median }
    }

    pub const fn scene(self, scene: &'static str) -> Pick {
        Pick { scene: Some(scene), ..self }
    }

    pub const fn x(self, x: At) -> Pick {
        Pick { x, ..self }
    }

    pub const fn part(self, part: Statistic) -> Pick {
        Pick { part, ..self }
    }
}

impl Test {
    pub const fn value(of: Pick, bound: Bound) -> Test {
        Test { term: Term::Value(of), bound }
    }

    /// One bound for several quantities.
    pub const fn values<const N: usize>(of: [Pick; N], bound: Bound) -> [Test; N] {
        let mut tests = [Test::value(of[0], bound); N];
        let mut n = 1;
        while n < N {
            tests[n] = Test::value(of[n], bound);
            n += 1;
        }
        tests
    }

    pub const fn ratio(of: Pick, to: Pick, bound: Bound) -> Test {
        Test { term: Term::Ratio(of, to), bound }
    }

    pub const fn difference(of: Pick, less: Pick, bound: Bound) -> Test {
        Test { term: Term::Difference(of, less), bound }
    }

    /// The first variant's quantity divided by the second's.
    pub const fn ratio_of(quantity: &'static str, [of, to]: [&'static str; 2], bound: Bound) -> Test {
        Test::ratio(one(quantity, of), one(quantity, to), bound)
    }

    /// [`Test::ratio_of`] for several pairs of variants.
    pub const fn ratios_of<const N: usize>(
        quantity: &'static str,
        pairs: [[&'static str; 2]; N],
        bound: Bound,
    ) -> [Test; N] {
        let mut tests = [Test::ratio_of(quantity, pairs[0], bound); N];
        let mut n = 1;
        while n < N {
            tests[n] = Test::ratio_of(quantity, pairs[n], bound);
            n += 1;
        }
        tests
    }

    /// The first variant's quantity less the second's.
    pub const fn difference_of(quantity: &'static str, [of, less]: [&'static str; 2], bound: Bound) -> Test {
        Test::difference(one(quantity, of), one(quantity, less), bound)
    }

    pub const fn growth(of: Pick, power: f64, bound: Bound) -> Test {
        Test { term: Term::Growth(of, power), bound }
    }

    pub const fn steps(of: Pick, bound: Bound) -> Test {
        Test { term: Term::Steps(of), bound }
    }
}
