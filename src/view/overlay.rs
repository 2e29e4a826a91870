//! The overlays that colour the picture.

use super::judge::Ground;
use super::stage::Stage;

/// The selected overlay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overlay {
    Levels,
    Shortfall,
    Collapse,
    Misses,
    Error,
}

impl Overlay {
    pub const ALL: [Overlay; 5] =
        [Overlay::Levels, Overlay::Shortfall, Overlay::Collapse, Overlay::Misses, Overlay::Error];

    /// Name and meaning.
    pub fn about(self) -> [&'static str; 2] {
        match self {
            Overlay::Levels => ["levels", "the level that each pixel requests, and the edges of its tiles"],
            Overlay::Shortfall => [
                "wanted minus shown",
                "blue: the wanted level is shown; yellow to red: 1 to 3 levels coarser; green: finer",
            ],
            Overlay::Collapse => [
                "collapse levels",
                "each face of a progressive mesh by the level below which it collapses: blue is level 0, red the \
                 finest level",
            ],
            Overlay::Misses => [
                "vertex-cache misses",
                "each face by its vertices that miss a FIFO-16 cache: green 0, yellow 1, orange 2, red 3",
            ],
            Overlay::Error => [
                "error against the reference",
                "of the settled picture, against the f64 mean over each pixel's area; computed while frames continue",
            ],
        }
    }

    /// True if the scene has the data for this overlay.
    pub fn applies(self, stage: &Stage) -> bool {
        match self {
            Overlay::Levels | Overlay::Shortfall => stage.renderer.technique.texture.is_some(),
            Overlay::Collapse | Overlay::Misses => stage.renderer.technique.meshes.is_some(),
            Overlay::Error => Ground::check(stage).is_ok(),
        }
    }

    /// True if it colours the faces of progressive meshes.
    pub fn is_of_meshes(self) -> bool {
        matches!(self, Overlay::Collapse | Overlay::Misses)
    }

    /// The overlay's number in present.frag; 0 if present.frag does not draw it.
    pub fn number(self) -> u32 {
        match self {
            Overlay::Levels => 1,
            Overlay::Shortfall => 2,
            Overlay::Collapse => 3,
            Overlay::Misses => 4,
            Overlay::Error => 0,
        }
    }

    /// The overlay after `now` that applies to the scene; `None` after the last.
    pub fn next(now: Option<Overlay>, stage: &Stage) -> Option<Overlay> {
        let first =
            now.map_or(0, |now| Overlay::ALL.iter().position(|one| *one == now).map_or(0, |at| at + 1));
        Overlay::ALL[first..].iter().copied().find(|one| one.applies(stage))
    }
}
