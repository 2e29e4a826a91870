//! The governor, section 4: "for scalability the wanted deviation is changed according to the platform's performance"
//! (the paper does not say how).
//!
//! The governor plans ahead. Before a frame, the camera is known, and so is the number of faces that each factor on the
//! wanted errors would draw. The time per face is unknown; it is estimated from the finished frames. The plan takes the
//! smallest factor for which faces times time per face fit the budget.
//!
//! If no factor keeps the budget, the smallest factor that draws the fewest faces is a bad choice: it depends only on
//! the nearest instance. In the first frames of pm.governor it is 47 and draws 30,016 faces, but a factor of 5.5 draws
//! only 1.5 % more. Such a plan also reverses the factor whenever the nearest instance moves: on an Intel Xeon (family
//! 6, model 167), in 20 % of the frames, with a mean factor of 13. So a plan accepts a few percent more than the fewest
//! faces.
//!
//! - Nine of ten frames must keep the budget, so the plan uses a time per face that one of ten frames exceeds
//!   (`Estimate`). With the mean instead, every other frame would exceed the budget.
//! - If the machine becomes slower, the estimate reaches the new time within five finished frames. It then overshoots
//!   for about 20 frames, in logarithms by at most 36 % of the change. If the machine becomes faster, the estimate
//!   falls by half of the change within 16 frames. So after a change of speed the factor may rise too far and fall
//!   again, once.
//! - Camera motion causes no delay: a crowd that comes into view reduces the detail of the same frame. A
//!   controller that uses only times reacts two frames late, and must be slow to avoid ringing (`Integral`,
//!   the simple rule).
//! - There is no integral term, so there is no wind-up: the factor never exceeds the factor at which all instances are
//!   at their coarsest level.
//! - The plan does not ring while the machine's speed stays the same. A frame of n faces takes a + b n, but the plan
//!   assumes c n, where c = b + a / n comes from earlier frames. In a steady state the estimate is exact for every a.
//!   Otherwise each plan multiplies the estimate's relative error by a's share of the budget, and the error keeps its
//!   sign. If the fixed time a exceeds the budget, the plan ends at the coarsest level.

mod integral;

pub use crate::scene::{SceneFault, SceneTable, settings};
use integral::Integral;

/// A plan aims at this share of the faces that fit the budget.
const AIM: f64 = 0.98;
/// Multiples of the fewest faces, if less would have to be drawn to keep the budget of time: a plan aims at
/// `NEARLY_FEWEST`, and is kept between `SPARES` and `KEPT_FEWEST`.
const NEARLY_FEWEST: f64 = 1.05;
const SPARES: f64 = 1.02;
const KEPT_FEWEST: f64 = 1.1;
/// A plan is kept while its faces are between this share and all of the faces that fit, so that errors and
/// levels do not change in every frame.
const KEPT_FROM: f64 = 0.88;
/// Hysteresis: detail is restored after this many consecutive frames with less than [`KEPT_FROM`] of the
/// faces that fit.
const ROOMY_FRAMES: u32 = 4;
/// Maximum decrease of the error per frame, in octaves. Refining a mesh takes time to execute and to copy, and pops
/// unless new vertices morph.
const FINER_LOG2: f64 = 0.25;
/// The largest factor: 1024 times the scene's error.
const MAX_LOG2: f64 = 10.0;
/// Bisection steps over [`MAX_LOG2`], which give the factor to a hundredth of an octave.
const HALVINGS: usize = 10;

settings! {
    /// The governor multiplies the wanted errors of all progressive meshes by a factor of at most 1024, so
    /// that frames keep a budget. Set at least one of the two budgets.
    pub struct Budget derive(Copy) with DEFAULT {
        /// Limit of the measured frame time, which nine of ten frames should keep.
        frame_ms: Option<f64> = None, in 1e-3..=1e6, unit "ms";
        /// Maximum number of faces in a frame, known before it is drawn. If all instances at their coarsest levels have
        /// more faces, these levels are drawn. Use this budget with `--deterministic`, because times differ between
        /// runs.
        frame_faces: Option<u32> = None, in 1..=u32::MAX, unit "faces";
    }
    check check_budget;
}

fn check_budget(budget: &Budget, part: &SceneTable<'_>) -> Result<(), SceneFault> {
    match (budget.frame_ms, budget.frame_faces) {
        (None, None) => Err(part.whole("a governor needs a budget: frame_ms, frame_faces, or both")),
        _ => Ok(()),
    }
}

/// How a budget is kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rule {
    #[default]
    Planned,
    /// The simple rule, which uses only frame times. For figures.
    Integral,
}

/// Keeps a frame budget.
#[derive(Clone, Debug)]
pub enum Governor {
    Planned(Planned),
    Integral(Integral),
}

impl Governor {
    /// A governor that starts with the scene's own errors.
    ///
    /// # Panics
    /// If a budget is not positive, or the rule does not support the given budget.
    pub fn new(budget: Budget, rule: Rule) -> Governor {
        match rule {
            Rule::Planned => Governor::Planned(Planned::new(budget)),
            Rule::Integral => {
                Governor::Integral(Integral::new(budget.frame_ms.expect("the integral rule needs frame_ms")))
            }
        }
    }

    /// The factor on all wanted errors in the next frame, 1 ..= 1024. `faces_at` returns the faces that the frame would
    /// draw with a factor. This number must not increase with the factor.
    pub fn plan(&mut self, faces_at: impl Fn(f64) -> u64) -> f64 {
        match self {
            Governor::Planned(planned) => planned.plan(faces_at),
            Governor::Integral(integral) => integral.factor(),
        }
    }

    /// Records the time of a finished frame, and the faces that were planned for it.
    pub fn frame_took(&mut self, ms: f64, faces: u64) {
        match self {
            Governor::Planned(planned) => planned.frame_took(ms, faces),
            Governor::Integral(integral) => integral.frame_took(ms),
        }
    }
}

/// The governor that the module's documentation describes.
#[derive(Clone, Debug)]
pub struct Planned {
    budget: Budget,
    /// Of log2 of the milliseconds per face; `None` before the first finished frame.
    face_ms_log2: Option<Estimate>,
    /// Number of consecutive frames that could have drawn more faces.
    roomy: u32,
    factor_log2: f64,
}

impl Planned {
    fn new(budget: Budget) -> Planned {
        let Budget { frame_ms, frame_faces } = budget;
        assert!(frame_ms.is_some() || frame_faces.is_some(), "a governor without a budget");
        assert!(frame_ms.is_none_or(|ms| ms > 0.0) && frame_faces != Some(0), "{budget:?}");
        Planned { budget, face_ms_log2: None, roomy: 0, factor_log2: 0.0 }
    }

    fn frame_took(&mut self, ms: f64, faces: u64) {
        if !(ms > 0.0 && ms.is_finite()) || faces == 0 {
            return;
        }
        let log2 = (ms / faces as f64).log2();
        match &mut self.face_ms_log2 {
            Some(estimate) => estimate.add(log2),
            none => *none = Some(Estimate::new(log2)),
        }
    }

    /// The numbers of faces that fit the budget. `None` before the first finished frame if there is no budget in
    /// faces.
    fn fitting(&self, faces_at: impl Fn(f64) -> u64) -> Option<Fitting> {
        let face_ms = self.face_ms_log2.as_ref().map(|estimate| estimate.nine_of_ten().exp2());
        let by_time = self.budget.frame_ms.zip(face_ms).map(|(ms, face_ms)| {
            let fewest = faces_at(MAX_LOG2.exp2()) as f64;
            Fitting {
                roomy_below: (KEPT_FROM * ms / face_ms).max(SPARES * fewest),
                aim: (AIM * ms / face_ms).max(NEARLY_FEWEST * fewest),
                max: (ms / face_ms).max(KEPT_FEWEST * fewest),
            }
        });
        let by_faces = self.budget.frame_faces.map(f64::from).map(|faces| Fitting {
            roomy_below: KEPT_FROM * faces,
            aim: AIM * faces,
            max: faces,
        });
        by_time.into_iter().chain(by_faces).reduce(Fitting::both)
    }

    fn plan(&mut self, faces_at: impl Fn(f64) -> u64) -> f64 {
        if let Some(fitting) = self.fitting(&faces_at) {
            let faces = faces_at(self.factor_log2.exp2()) as f64;
            self.roomy = if faces < fitting.roomy_below { self.roomy + 1 } else { 0 };
            if faces > fitting.max {
                self.factor_log2 = min_log2(fitting.aim, faces_at);
            } else if self.roomy > ROOMY_FRAMES {
                let finest = min_log2(fitting.aim, faces_at);
                self.factor_log2 = finest.max(self.factor_log2 - FINER_LOG2);
            }
        }
        self.factor_log2.exp2()
    }
}

/// The running mean and mean absolute deviation of noisy values, as TCP estimates round-trip times (V. Jacobson,
/// "Congestion Avoidance and Control", SIGCOMM 1988). Each value is first replaced by the median of the last three, so
/// one hanging frame has no effect.
#[derive(Clone, Debug)]
struct Estimate {
    recent: [f64; 3],
    mean: f64,
    deviation: f64,
    values: u32,
}

impl Estimate {
    /// Weight of the newest value. The first values have equal weights, so a slow first frame is soon forgotten.
    const NEWEST: f64 = 0.15;
    /// One of ten values exceeds the mean by more than this many deviations: 1.606 if the noise is normal, 1.6 if it is
    /// uniform.
    const NINE_OF_TEN: f64 = 1.6;

    fn new(value: f64) -> Estimate {
        Estimate { recent: [value; 3], mean: value, deviation: 0.0, values: 1 }
    }

    fn add(&mut self, value: f64) {
        self.recent.rotate_left(1);
        self.recent[2] = value;
        let mut sorted = self.recent;
        sorted.sort_unstable_by(f64::total_cmp);
        self.values = self.values.saturating_add(1);
        let weight = Self::NEWEST.max(1.0 / f64::from(self.values));
        let above = sorted[1] - self.mean;
        self.mean += weight * above;
        self.deviation += weight * (above.abs() - self.deviation);
    }

    /// A value that nine of ten values do not exceed.
    fn nine_of_ten(&self) -> f64 {
        self.mean + Self::NINE_OF_TEN * self.deviation
    }
}

/// Numbers of faces that fit a budget: detail is restored below the first, a plan aims at the second, and is replaced
/// above the third.
#[derive(Clone, Copy, Debug)]
struct Fitting {
    roomy_below: f64,
    aim: f64,
    max: f64,
}

impl Fitting {
    /// The numbers that fit two budgets.
    fn both(self, other: Fitting) -> Fitting {
        Fitting {
            roomy_below: self.roomy_below.min(other.roomy_below),
            aim: self.aim.min(other.aim),
            max: self.max.min(other.max),
        }
    }
}

/// log2 of the smallest factor that draws at most `max_faces`. If every factor draws more faces, log2 of the smallest
/// factor that draws the fewest faces.
fn min_log2(max_faces: f64, faces_at: impl Fn(f64) -> u64) -> f64 {
    let faces_at = |log2: f64| faces_at(log2.exp2()) as f64;
    let max = max_faces.max(faces_at(MAX_LOG2));
    if faces_at(0.0) <= max {
        return 0.0;
    }
    let (mut too_fine, mut enough) = (0.0, MAX_LOG2);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (too_fine + enough);
        if faces_at(middle) <= max { enough = middle } else { too_fine = middle }
    }
    enough
}

#[cfg(test)]
mod tests;
