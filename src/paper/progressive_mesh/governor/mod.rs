//! The governor, section 4: "for scalability the wanted deviation is changed according to the platform's performance"
//! (how is a gap of the paper).
//!
//! It plans. Before a frame it is known where the eye stands, and so how many faces would be drawn with all wanted
//! errors multiplied by any factor; not known is what a face will cost. That is taken from the last frames: the time
//! for each face that nine of ten will not exceed. The factor is the least with which faces times that cost fit the
//! budget.
//!
//! - A budget that nine of ten frames are to keep is planned with the tenth frame; planned with the mean it would be
//!   broken by every other one. A frame that hangs is one of thirty and counts for nothing.
//! - A machine that becomes slower is noticed within three frames, one that becomes faster after all thirty: detail
//!   goes fast and comes back slowly.
//! - For the camera it does not wait: a crowd that comes into view costs detail in that very frame. A loop on times
//!   alone learns of it two frames late, and must be slow so that it does not ring (`Integral`: the simple rule).
//! - Nothing is summed up, so nothing winds up: the factor never exceeds what makes all instances as coarse as they
//!   get.
//! - It does not ring. A frame of n faces takes a + b n and is taken for c n, where c = b + a / n was right for frames
//!   before. Where the plan rests it is right whatever a is, and from plan to plan its mistake shrinks to the share
//!   that a has in the budget, with the same sign. Where a alone is more than the budget, all ends at the coarsest.

mod integral;

pub use crate::scene::{Fault, Part, settings};
use integral::Integral;

use std::collections::VecDeque;

/// Frames whose times are remembered: half a second at 60 a second.
const FRAMES: usize = 30;
/// The cost of a face is the one at this place among theirs: the 28th of 30, which the next frame exceeds in 3 of 31
/// cases.
const COVERED: f64 = 0.95;
/// A plan is made for this share of the faces that fit ...
const AIM: f64 = 0.95;
/// ... and kept while there are at most all, and at least this share: the error rests, and with it every level of
/// detail.
const KEPT_FROM: f64 = 0.85;
/// Detail comes back where so many frames in a row had room for it: what a glance at less shows is not worth a turn.
const ROOMY_FRAMES: u32 = 4;
/// Octaves by which the error falls in a frame at most: what comes back is executed, copied and, unless it moves, seen
/// to jump.
const FINER_LOG2: f64 = 0.25;
/// The coarsest: 1024 times the scene's error.
const MOST_LOG2: f64 = 10.0;
/// Halvings of [`MOST_LOG2`] until the factor is known to a hundredth of an octave.
const HALVINGS: usize = 10;

settings! {
    /// The governor: the wanted errors of all progressive meshes are raised, up to 1024 times, as far as frames need it
    /// to keep a budget. At least one of the two is stated.
    pub struct Budget derive(Copy) with DEFAULT {
        /// Measured time that nine of ten frames are to take at most.
        frame_ms: Option<f64> = None, in 1e-3..=1e6, unit "ms";
        /// Faces that a frame draws, known before it is drawn: the budget of `--deterministic`, for no two runs take the
        /// same times.
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

/// How a budget is held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rule {
    #[default]
    Planned,
    /// The simple one, of times alone: for figures.
    Integral,
}

/// Holds a frame budget.
#[derive(Clone, Debug)]
pub enum Governor {
    Planned(Planned),
    Integral(Integral),
}

impl Governor {
    /// Starts at the scene's own errors.
    ///
    /// # Panics
    /// If a budget is not positive, or there is none that the rule knows.
    pub fn new(budget: Budget, rule: Rule) -> Governor {
        match rule {
            Rule::Planned => Governor::Planned(Planned::new(budget)),
            Rule::Integral => {
                Governor::Integral(Integral::new(budget.frame_ms.expect("this rule knows times alone")))
            }
        }
    }

    /// By what wanted errors are multiplied in the next frame, 1 ..= 1024. `faces_at` tells how many faces that frame
    /// would draw with a factor; the greater the factor, the fewer or as many.
    pub fn plan(&mut self, faces_at: impl Fn(f64) -> u64) -> f64 {
        match self {
            Governor::Planned(planned) => planned.plan(faces_at),
            Governor::Integral(integral) => integral.factor(),
        }
    }

    /// Takes the time of a frame that has ended, and the faces that were planned for it.
    pub fn frame_took(&mut self, ms: f64, faces: u64) {
        match self {
            Governor::Planned(planned) => planned.frame_took(ms, faces),
            Governor::Integral(integral) => integral.frame_took(ms),
        }
    }
}

/// The governor of this module's head.
#[derive(Clone, Debug)]
pub struct Planned {
    budget: Budget,
    /// Of the last [`FRAMES`] frames.
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

    /// Faces that fit the budget; none while no frame has ended.
    fn fitting(&self) -> Option<f64> {
        let mut sorted: Vec<f64> = self.face_ms.iter().copied().collect();
        sorted.sort_unstable_by(f64::total_cmp);
        // Rounded down: of the first frames, which are slow, the second already outvotes the first.
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

/// log2 of the least factor that draws at most so many faces; where none does, of the least that draws the fewest.
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
