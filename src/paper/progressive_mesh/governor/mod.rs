//! The governor, section 4: "for scalability the wanted deviation is changed according to the platform's performance"
//! (the paper does not say how).
//!
//! It plans ahead. Before a frame the eye is known, and so is the number of faces that any factor of the wanted
//! errors would draw. The cost of a face is unknown; it is estimated from the last frames as the time per face that
//! nine of ten frames do not exceed. The factor is the smallest for which faces times cost fit the budget.
//!
//! - Nine of ten frames must keep the budget, so the plan uses the 90 % quantile; with the mean every other frame
//!   would exceed it. A frame that hangs is one of thirty and has no effect.
//! - A slower machine is noticed within three frames, a faster one after all thirty: detail goes fast and comes back
//!   slowly.
//! - Camera motion causes no delay: a crowd that comes into view costs detail in that very frame. A loop on times alone
//!   reacts two frames late, and must be slow to avoid ringing (`Integral`: the simple rule).
//! - Nothing is integrated, so nothing winds up: the factor never exceeds the one at which all instances are at their
//!   coarsest.
//! - It does not ring. A frame of n faces takes a + b n and is estimated as c n, where c = b + a / n was right for
//!   earlier frames. At rest the estimate is exact whatever a is. From plan to plan its error shrinks to a's share
//!   of the budget, with the same sign. If a alone exceeds the budget, the plan ends at the coarsest.

mod integral;

pub use crate::scene::{Fault, Part, settings};
use integral::Integral;

use std::collections::VecDeque;

/// Frames whose times are kept: half a second at 60 frames a second.
const FRAMES: usize = 30;
/// Quantile of the costs of a face: the 28th of 30, which the next frame exceeds in 3 of 31 cases.
const COVERED: f64 = 0.95;
/// A plan aims at this share of the faces that fit ...
const AIM: f64 = 0.95;
/// ... and is kept while the faces are between this share and all: the error rests, and with it every level of detail.
const KEPT_FROM: f64 = 0.85;
/// Hysteresis: detail comes back after this many frames in a row below that share.
const ROOMY_FRAMES: u32 = 4;
/// Most octaves by which the error falls in a frame: refinement costs execution and copies, and pops unless it is
/// morphed.
const FINER_LOG2: f64 = 0.25;
/// The coarsest factor: 1024 times the scene's error.
const MOST_LOG2: f64 = 10.0;
/// Bisections of [`MOST_LOG2`] until the factor is known to a hundredth of an octave.
const HALVINGS: usize = 10;

settings! {
    /// The governor: raises the wanted errors of all progressive meshes, up to 1024 times, until frames keep a budget.
    /// Set at least one of the two.
    pub struct Budget derive(Copy) with DEFAULT {
        /// Nine of ten frames take at most this measured time.
        frame_ms: Option<f64> = None, in 1e-3..=1e6, unit "ms";
        /// Most faces in a frame, known before it is drawn. The budget for `--deterministic`, because times differ
        /// between runs.
        frame_faces: Option<u32> = None, in 1..=u32::MAX, unit "faces";
    }
    check check_budget;
}

fn check_budget(budget: &Budget, part: &Part<'_>) -> Result<(), Fault> {
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
    /// The simple rule, on times alone: for figures.
    Integral,
}

/// Keeps a frame budget.
#[derive(Clone, Debug)]
pub enum Governor {
    Planned(Planned),
    Integral(Integral),
}

impl Governor {
    /// Starts at the scene's own errors.
    ///
    /// # Panics
    /// If a budget is not positive, or the rule supports none of those given.
    pub fn new(budget: Budget, rule: Rule) -> Governor {
        match rule {
            Rule::Planned => Governor::Planned(Planned::new(budget)),
            Rule::Integral => {
                Governor::Integral(Integral::new(budget.frame_ms.expect("the integral rule needs frame_ms")))
            }
        }
    }

    /// The factor of all wanted errors in the next frame, 1 ..= 1024. `faces_at` gives the faces that the frame would
    /// draw at a factor; it must not rise with the factor.
    pub fn plan(&mut self, faces_at: impl Fn(f64) -> u64) -> f64 {
        match self {
            Governor::Planned(planned) => planned.plan(faces_at),
            Governor::Integral(integral) => integral.factor(),
        }
    }

    /// Records the time of a finished frame, and the faces planned for it.
    pub fn frame_took(&mut self, ms: f64, faces: u64) {
        match self {
            Governor::Planned(planned) => planned.frame_took(ms, faces),
            Governor::Integral(integral) => integral.frame_took(ms),
        }
    }
}

/// The governor described at the head of this module.
#[derive(Clone, Debug)]
pub struct Planned {
    budget: Budget,
    /// Milliseconds per face in the last [`FRAMES`] frames.
    face_ms: VecDeque<f64>,
    /// Frames in a row that could have drawn more.
    roomy: u32,
    factor_log2: f64,
}

impl Planned {
    fn new(budget: Budget) -> Planned {
        let Budget { frame_ms, frame_faces } = budget;
        assert!(frame_ms.is_some() || frame_faces.is_some(), "a governor without a budget");
        assert!(frame_ms.is_none_or(|ms| ms > 0.0) && frame_faces != Some(0), "{budget:?}");
        Planned { budget, face_ms: VecDeque::with_capacity(FRAMES), roomy: 0, factor_log2: 0.0 }
    }

    fn frame_took(&mut self, ms: f64, faces: u64) {
        if !(ms > 0.0 && ms.is_finite()) || faces == 0 {
            return;
        }
        if self.face_ms.len() == FRAMES {
            self.face_ms.pop_front();
        }
        self.face_ms.push_back(ms / faces as f64);
    }

    /// Faces that fit the budget; `None` while no frame has ended and there is no budget in faces.
    fn fitting(&self) -> Option<f64> {
        let mut sorted: Vec<f64> = self.face_ms.iter().copied().collect();
        sorted.sort_unstable_by(f64::total_cmp);
        // Rounded down: with two frames the faster one counts, since the first frames are slow.
        let rank = (COVERED * sorted.len().saturating_sub(1) as f64) as usize;
        let by_time = self.budget.frame_ms.zip(sorted.get(rank)).map(|(ms, face_ms)| ms / face_ms);
        let by_faces = self.budget.frame_faces.map(f64::from);
        by_time.into_iter().chain(by_faces).min_by(f64::total_cmp)
    }

    fn plan(&mut self, faces_at: impl Fn(f64) -> u64) -> f64 {
        if let Some(fitting) = self.fitting() {
            let faces = faces_at(self.factor_log2.exp2()) as f64;
            self.roomy = if faces < KEPT_FROM * fitting { self.roomy + 1 } else { 0 };
            if faces > fitting {
                self.factor_log2 = least_log2(AIM * fitting, faces_at);
            } else if self.roomy > ROOMY_FRAMES {
                let finest = least_log2(AIM * fitting, faces_at);
                self.factor_log2 = finest.max(self.factor_log2 - FINER_LOG2);
            }
        }
        self.factor_log2.exp2()
    }
}

/// log2 of the least factor that draws at most `most_faces`; if no factor does, of the least that draws the fewest.
fn least_log2(most_faces: f64, faces_at: impl Fn(f64) -> u64) -> f64 {
    let faces_at = |log2: f64| faces_at(log2.exp2()) as f64;
    let most = most_faces.max(faces_at(MOST_LOG2));
    if faces_at(0.0) <= most {
        return 0.0;
    }
    let (mut too_fine, mut enough) = (0.0, MOST_LOG2);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (too_fine + enough);
        if faces_at(middle) <= most { enough = middle } else { too_fine = middle }
    }
    enough
}

#[cfg(test)]
mod tests;
