//! The error at which an instance is drawn. It follows the wanted error at a limited pace.

use crate::paper::progressive_mesh::config::ProgressiveSurface;
use crate::paper::progressive_mesh::mesh::Level;
use crate::paper::progressive_mesh::run::level_for_error;
use crate::paper::progressive_mesh::surface::vertices::MORPH_BAND_LOG2;

/// An approaching camera raises the drawn error to at most this multiple of the wanted error. Without this bound, a
/// fast approach to a small error would end with an error of many pixels.
const MAX_BEHIND: f64 = 2.0;

/// The error of an instance in one frame, in object units, and the size of a pixel there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstanceError {
    pub error: f64,
    pub pixel: f64,
}

/// How instances of one mesh follow the wanted error.
#[derive(Clone, Copy, Debug)]
pub struct ErrorPace {
    /// The smallest shown error that selects level 0, in object units. All larger errors also select level 0.
    coarsest: f64,
    pixels_per_second: f64,
    /// New vertices move while the shown error falls by this many octaves, and arrive at the error at which they would
    /// appear without geomorphing. 0 without geomorphing.
    ahead: f64,
}

/// The error one frame after `from` on the way to `to`, if it changes by at most `pixels` pixels. `pixel` is the size
/// of a pixel in the unit of the errors.
///
/// The limit is the same at every error, because nearly all visible changes are pixels of the outline (79 of 81 in the
/// worst frame of `knot`). A new vertex near the outline moves it by about the vertex's error. So the number of changed
/// pixels per frame follows the change of the error in pixels. With a limit that grows with the error above 4 pixels,
/// the worst frame of `knot` in pm.pop changes 1.26 % of the pixels visibly, instead of 0.64 %.
pub fn step(pixels: f64, from: f64, to: f64, pixel: f64) -> f64 {
    let (max, change) = (pixels * pixel, to - from);
    if change.abs() > max { from + max.copysign(change) } else { to }
}

impl ErrorPace {
    pub fn new(surface: &ProgressiveSurface, levels: &[Level]) -> ErrorPace {
        let ahead = if surface.geomorph { f64::from(MORPH_BAND_LOG2) } else { 0.0 };
        let coarsest = f64::from(levels[0].error) * ahead.exp2();
        ErrorPace { coarsest, pixels_per_second: surface.pixels_per_second, ahead }
    }

    /// The error to show next: one step towards `wanted` from `before`, the error shown `seconds` ago in the last
    /// frame. `None`: the last frame did not draw the instance, so `wanted` is shown at once.
    pub fn next(&self, before: Option<InstanceError>, wanted: InstanceError, seconds: f64) -> f64 {
        let Some(before) = before else { return wanted.error };
        // NaN requests the full mesh.
        let [was, to] = [before.error, wanted.error].map(|error| error.max(0.0).min(self.coarsest));
        let as_many_pixels = was * wanted.pixel / before.pixel;
        let from = was.min(as_many_pixels.max(MAX_BEHIND * to));
        let shown = step(self.pixels_per_second * seconds, from, to, wanted.pixel);
        if shown == to { wanted.error } else { shown }
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
    use crate::frame::FRAME_SECONDS;
    use crate::paper::progressive_mesh::config::{self, PIXELS_PER_SECOND};
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

    /// An error of the instance where a pixel is half a unit.
    fn at(error: f64) -> InstanceError {
        InstanceError { error, pixel: 0.5 }
    }

    /// A limit of a quarter of a pixel per second, and frames of a second.
    const QUARTER: &[&str] = &["pixels_per_second=0.25"];

    #[test]
    fn with_the_largest_limit_an_instance_is_drawn_as_wanted_at_once() {
        let (pace, levels) = pace(&["pixels_per_second=1e6"]);
        let next = |before, wanted| pace.next(before, wanted, FRAME_SECONDS);
        assert_eq!((next(Some(at(16.0)), at(0.3)), next(None, at(3.0))), (0.3, 3.0));
        assert_eq!((pace.level(&levels, 3.0), pace.level(&levels, 0.0)), (3, 5));
    }

    #[test]
    fn a_limited_error_changes_by_its_pixels_at_every_error_and_a_newcomer_arrives_at_once() {
        let (pace, _) = pace(QUARTER);
        let next = |before, wanted| pace.next(before, wanted, 1.0);
        assert_eq!(next(None, at(1.0)), 1.0);
        assert_eq!((next(Some(at(8.0)), at(1.0)), next(Some(at(8.0)), at(16.0))), (7.875, 8.125));
        let mut shown = 2.0;
        let frames = (1..).find(|_| {
            shown = next(Some(at(shown)), at(0.0));
            shown == 0.0
        });
        assert_eq!(frames, Some(16), "4 pixels in quarters");
        // An error above level 0's counts as level 0's.
        assert_eq!(next(Some(at(1e6)), at(1.0)), 15.875);
        assert_eq!(next(Some(at(16.0)), at(1e6)), 1e6);
        assert_eq!(next(Some(at(0.9)), at(f64::NAN)), 0.775);
        assert_eq!(next(Some(at(f64::NAN)), at(1.0)), 0.125);
    }

    #[test]
    fn an_approach_leaves_at_most_twice_the_wanted_error() {
        let (pace, _) = pace(QUARTER);
        let next = |before, wanted| pace.next(before, wanted, 1.0);
        let near = |error: f64| InstanceError { error, pixel: 0.05 };
        // The camera comes ten times as near: a pixel shrinks from 0.5 to 0.05 units. The drawn error was 0.5
        // units, or one pixel, and would now be 10 pixels. It is reduced to 2 pixels, twice the wanted error, and then
        // by one step.
        assert_eq!(next(Some(at(0.5)), near(0.05)), 0.1 - 0.25 * 0.05);
        // The drawn error was 16 pixels, more than twice the wanted error of one pixel. The approach does not raise it,
        // and one step reduces it to 15.75 pixels.
        let kept = next(Some(at(8.0)), near(0.05));
        assert!((kept / 0.05 - 15.75).abs() < 1e-9, "{kept}");
        // While the camera moves away, finer levels than wanted are drawn for some frames.
        assert_eq!(next(Some(near(0.05)), at(0.5)), 0.05 + 0.125);
    }

    /// The error after a second of `frames` frames, in which a pixel changes linearly from `pixels[0]` to `pixels[1]`
    /// units. `wanted` and `from` are in units.
    fn after_a_second(pace: &ErrorPace, frames: u32, pixels: [f64; 2], (from, wanted): (f64, f64)) -> f64 {
        let mut shown = InstanceError { error: from, pixel: pixels[0] };
        for frame in 1..=frames {
            let pixel = pixels[0] + (pixels[1] - pixels[0]) * f64::from(frame) / f64::from(frames);
            let error =
                pace.next(Some(shown), InstanceError { error: wanted, pixel }, 1.0 / f64::from(frames));
            shown = InstanceError { error, pixel };
        }
        shown.error
    }

    #[test]
    fn the_error_after_a_second_does_not_depend_on_the_frame_rate() {
        let (pace, _) = pace(&[]);
        for frames in [10, 30, 60, 120] {
            // A still camera: 2.58 pixels of half a unit. Only the sum's rounding depends on the number of frames.
            for (from, wanted, end) in [(8.0, 1.0, 8.0 - 1.29), (1.0, 8.0, 1.0 + 1.29), (1.5, 1.0, 1.0)] {
                let error = after_a_second(&pace, frames, [0.5; 2], (from, wanted));
                assert!((error - end).abs() < 1e-12, "{frames} frames: {error}, {end}");
            }
            // A moving camera: the steps are a Riemann sum of the pixel's size, which is monotonous. Its error is at
            // most one frame's share of the change.
            for pixels in [[0.5, 0.4], [0.4, 0.5]] {
                let error = after_a_second(&pace, frames, pixels, (8.0, 5.0));
                let beside = error - (8.0 - 0.45 * PIXELS_PER_SECOND);
                assert!(beside.abs() <= 0.1 * PIXELS_PER_SECOND / f64::from(frames), "{frames}: {beside}");
            }
        }
        // A limit per frame would give another error: half the frames, half the change.
        let frames =
            |count| (0..count).fold(8.0, |error, _| pace.next(Some(at(error)), at(1.0), FRAME_SECONDS));
        assert!(frames(30) - frames(60) > 0.6);
    }

    #[test]
    fn geomorphing_draws_a_level_that_has_arrived_when_its_error_is_wanted() {
        let (pace, levels) = pace(&["geomorph=true"]);
        assert_eq!(pace.level(&levels, 4.0), 3, "an octave finer");
        let step = 0.5 * (PIXELS_PER_SECOND * FRAME_SECONDS);
        assert_eq!(pace.next(Some(at(1.0)), at(0.5), FRAME_SECONDS), 1.0 - step);
    }
}
