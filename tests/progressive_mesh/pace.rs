//! A camera that jumps: the error of an instance in view follows the wanted error at a limited pace.

use crate::pictures::{device, open};
use ortelius::frame::{FRAME_SECONDS, Run};
use ortelius::math::camera::Pose;
use ortelius::paper::progressive_mesh::ProgressiveMeshes;
use ortelius::paper::progressive_mesh::config::PIXELS_PER_SECOND;
use ortelius::paper::progressive_mesh::run::level_for_error;
use ortelius::paper::progressive_mesh::surface::pace::step;
use ortelius::scene::Scene;

/// The bunny close up and far away, drawn with an error of one pixel.
struct Jumps {
    session: Run<ProgressiveMeshes>,
    near: Pose,
    far: Pose,
}

impl Jumps {
    fn new(changes: &[&str]) -> Jumps {
        let changes: Vec<String> =
            changes.iter().map(|change| format!("surface.bunny.geometry.{change}")).collect();
        let scene = Scene::load_with("bunny", &changes).unwrap();
        let [near, far] = ["near", "far"].map(|camera| scene.camera(camera).unwrap().pose());
        Jumps { session: open(&device(), &scene), near, far }
    }

    fn level(&self) -> u32 {
        self.session.technique.surfaces[0].instances().next().unwrap().1
    }

    /// The levels of the frames from `pose` until the wanted error is drawn.
    fn to(&mut self, pose: &Pose) -> Vec<u32> {
        let mut levels = Vec::new();
        while levels.is_empty() || !self.session.settled() {
            self.session.frame(pose).unwrap();
            levels.push(self.level());
        }
        levels
    }

    /// The level at an error of one pixel, and the size of a pixel in object units.
    fn wanted(&self, pose: &Pose) -> (u32, f64) {
        let pixel = self.session.technique.surfaces[0].instances().next().unwrap().0;
        let pixel = pixel.wanted_error(pose, self.session.size()[1], 1.0);
        (self.level_of(pixel), pixel)
    }

    fn level_of(&self, error: f64) -> u32 {
        level_for_error(self.session.technique.surfaces[0].program.levels(), error as f32)
    }

    /// The levels of errors that start at `from`, change by the default limit in each frame, and end at a pixel.
    fn limited(&self, from: f64, pixel: f64) -> Vec<u32> {
        let next = |error: &f64| {
            (*error != pixel).then(|| step(PIXELS_PER_SECOND * FRAME_SECONDS, *error, pixel, pixel))
        };
        std::iter::successors(Some(from), next).skip(1).map(|error| self.level_of(error)).collect()
    }
}

#[test]
fn a_jump_of_the_camera_reaches_the_wanted_level_by_limited_steps() {
    let mut jumps = Jumps::new(&[]);
    let (near, far) = (jumps.near, jumps.far);
    let ((finest, small), (coarsest, large)) = (jumps.wanted(&near), jumps.wanted(&far));
    assert!(large > 2.0 * small && finest > coarsest + 500, "{coarsest} to {finest}");
    assert_eq!(jumps.to(&far), [coarsest], "nothing was in view before");
    // An approach leaves two pixels, and 0.043 pixels of them vanish in each frame.
    let nearer = jumps.to(&near);
    assert_eq!(nearer, jumps.limited(2.0 * small, small));
    assert_eq!((nearer.len(), *nearer.last().unwrap()), (24, finest));
    // While the camera is far away, finer levels than wanted are drawn for at most as long.
    let farther = jumps.to(&far);
    // The wanted error is above the coarsest level's, at which all steps end.
    assert_eq!(farther, jumps.limited(small, large)[..farther.len()]);
    assert!(farther.len() <= 24 && *farther.last().unwrap() == coarsest, "{farther:?}");
    // The frame of the jump hides its own change: nothing else of the picture stays, either. Afterwards no frame makes
    // an eighth of the splits that one frame makes without a limit.
    let max = nearer.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap();
    assert!(8 * max < finest - coarsest, "{max} of {}", finest - coarsest);
}

#[test]
fn without_a_limit_a_jump_changes_the_level_in_one_frame() {
    let mut jumps = Jumps::new(&["pixels_per_second=1e6"]);
    let (near, far) = (jumps.near, jumps.far);
    let ((finest, _), (coarsest, _)) = (jumps.wanted(&near), jumps.wanted(&far));
    for (pose, level) in [(&near, finest), (&far, coarsest), (&near, finest)] {
        assert_eq!(jumps.to(pose), [level]);
    }
}
