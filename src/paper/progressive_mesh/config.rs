//! The settings of paper 2's frames.

use super::governor::{Budget, Rule};
use crate::picture::Target;
use crate::scene::{GovernorSettings, Scene};
use crate::vk::{Feature, Need};

/// How frames are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Pixels.
    pub size: [u32; 2],
    pub target: Target,
    /// The device counts invocations of shaders: needs its feature.
    pub count_shaders: bool,
    /// Rounds of needless work for each vertex: for figures in which vertices are to be the bottleneck.
    pub vertex_work: u32,
    /// What a frame may take, and how that is held.
    pub budget: Option<Budget>,
    pub rule: Rule,
}

impl Settings {
    /// What a scene asks for.
    pub fn of_scene(scene: &Scene, target: Target) -> Settings {
        Settings {
            size: [scene.view.width, scene.view.height],
            target,
            count_shaders: false,
            vertex_work: 0,
            budget: scene
                .governor
                .map(|GovernorSettings { frame_ms, frame_faces }| Budget { frame_ms, frame_faces }),
            rule: Rule::default(),
        }
    }
}

/// Device features that frames need: give them to `Gpu::new`.
pub fn needs(settings: &Settings) -> Vec<Need> {
    let counts = Need {
        feature: Feature::PipelineStatistics,
        pass: "surfaces",
        without: "do without counts, or choose another --device",
    };
    settings.count_shaders.then_some(counts).into_iter().collect()
}
