//! The error at which an instance is drawn: the wanted one, followed at a limited pace.

use crate::paper::progressive_mesh::config::ProgressiveSurface;
use crate::paper::progressive_mesh::mesh::Level;
use crate::paper::progressive_mesh::run::level_for_error;
use crate::paper::progressive_mesh::surface::vertices::MORPH_BAND_LOG2;

/// Default of `octaves_per_frame` with geomorphing: the pace of an approach that halves the distance in 16 frames.
const OCTAVES_PER_FRAME: f64 = 1.0 / 16.0;

/// How instances of one mesh follow the wanted error. Errors are in object units.
#[derive(Clone, Copy, Debug)]
pub struct ErrorPace {
    /// log2 of the errors beyond which a picture does not change.
    range: [f64; 2],
    octaves_per_frame: Option<f64>,
    /// New vertices move while the shown error falls by this many octaves, and arrive at the error at which they would
    /// appear without geomorphing. 0 without geomorphing.
    ahead: f64,
}

impl ErrorPace {
    pub fn new(surface: &ProgressiveSurface, levels: &[Level]) -> ErrorPace {
        let ahead = if surface.geomorph { f64::from(MORPH_BAND_LOG2) } else { 0.0 };
        let of_geomorph = surface.geomorph.then_some(OCTAVES_PER_FRAME);
        let positive = levels.iter().rev().find(|level| level.error > 0.0);
        let range = positive.map_or([0.0; 2], |finest| {
            [f64::from(finest.error).log2() - 1.0, f64::from(levels[0].error).log2() + ahead + 1.0]
        });
        ErrorPace { range, octaves_per_frame: surface.octaves_per_frame.or(of_geomorph), ahead }
    }

    /// The error to show next: one step towards `wanted` from `before`, the error shown in the last frame. `None`: the
    /// last frame did not draw the instance, so `wanted` is shown at once.
    pub fn next(&self, before: Option<f64>, wanted: f64) -> f64 {
        let (Some(most), Some(before)) = (self.octaves_per_frame, before) else { return wanted };
        let [least, largest] = self.range;
        // NaN wants the full mesh.
        let [from, to] = [before, wanted].map(|error| error.log2().max(least).min(largest));
        if (to - from).abs() <= most { wanted } else { (from + (to - from).clamp(-most, most)).exp2() }
    }

    /// The error that selects the level and moves the vertices: smaller than the shown error by `ahead` octaves.
    pub fn chosen(&self, shown: f64) -> f64 {
        if self.ahead > 0.0 { shown * (-self.ahead).exp2() } else { shown }
    }

    /// The level that is drawn at the shown error.
    pub fn level(&self, levels: &[Level], shown: f64) -> u32 {
        level_for_error(levels, self.chosen(shown) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::progressive_mesh::config;
    use crate::scene::Scene;

    /// Levels with errors 16, 8, 4, 2, 1 and 0.
    fn pace(changes: &[&str]) -> (ErrorPace, Vec<Level>) {
        let changes: Vec<String> =
            changes.iter().map(|change| format!("surface.bunny.geometry.{change}")).collect();
        let surface = config::surface(&Scene::load_with("bunny", &changes).unwrap(), "bunny").unwrap();
        let errors = [16.0, 8.0, 4.0, 2.0, 1.0, 0.0];
        let levels: Vec<Level> = errors.map(|error| Level { error, ..Level::default() }).into();
        (ErrorPace::new(&surface, &levels), levels)
    }

    #[test]
    fn without_a_limit_an_instance_is_drawn_as_wanted_at_once() {
        let (pace, levels) = pace(&[]);
        assert_eq!((pace.next(Some(16.0), 0.3), pace.next(None, 3.0)), (0.3, 3.0));
        assert_eq!((pace.level(&levels, 3.0), pace.level(&levels, 0.0)), (3, 5));
    }

    #[test]
    fn a_limited_error_arrives_after_its_octaves_and_a_newcomer_at_once() {
        let (pace, _) = pace(&["octaves_per_frame=0.25"]);
        assert_eq!(pace.next(None, 1.0), 1.0);
        let mut shown = 8.0;
        let frames = (1..).find(|_| {
            let before = shown;
            shown = pace.next(Some(shown), 1.0);
            assert!(before / shown < 1.2, "{before}, {shown}");
            shown == 1.0
        });
        assert_eq!(frames, Some(12));
        // Beyond the levels' errors nothing changes: 0 is not infinitely far away.
        let mut shown = 1.0;
        assert!((0..8).any(|_| {
            shown = pace.next(Some(shown), 0.0);
            shown == 0.0
        }));
        assert!(pace.next(Some(0.9), f64::NAN) < 0.9);
    }

    #[test]
    fn geomorphing_draws_a_level_that_has_arrived_when_its_error_is_wanted() {
        let (pace, levels) = pace(&["geomorph=true"]);
        assert_eq!(pace.level(&levels, 4.0), 3, "an octave finer");
        assert_eq!(pace.next(Some(4.0), 2.0), 4.0 * (-1.0f64 / 16.0).exp2());
    }
}
