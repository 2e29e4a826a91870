//! Overlays over the picture.

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
            Overlay::Levels => ["levels", "the level that each pixel asks for, and the edges of its tiles"],
            Overlay::Shortfall => [
                "wanted minus shown",
                "blue: the wanted level is shown; yellow to red: 1 to 3 levels coarser; green: finer",
            ],
            Overlay::Collapse => [
                "collapse levels",
                "faces of progressive meshes by the level below which they collapse: blue M0, red the finest",
            ],
            Overlay::Misses => [
                "vertex-cache misses",
                "vertices of each face that a FIFO-16 cache lacks: 0 green, 1 yellow, 2 orange, 3 red",
            ],
            Overlay::Error => [
                "error against the reference",
                "of the settled picture, against the f64 mean of all that a pixel covers; computed beside the frames",
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

    /// True if it colours the faces of meshes.
    pub fn is_of_meshes(self) -> bool {
        matches!(self, Overlay::Collapse | Overlay::Misses)
    }

    /// The number in present.frag; 0 if present.frag does not draw this overlay.
    pub fn number(self) -> u32 {
        match self {
            Overlay::Levels => 1,
            Overlay::Shortfall => 2,
            Overlay::Collapse => 3,
            Overlay::Misses => 4,
            Overlay::Error => 0,
        }
    }

    /// The next applicable overlay after `now`; `None` after the last.
    pub fn next(now: Option<Overlay>, stage: &Stage) -> Option<Overlay> {
        let first =
            now.map_or(0, |now| Overlay::ALL.iter().position(|one| *one == now).map_or(0, |at| at + 1));
        Overlay::ALL[first..].iter().copied().find(|one| one.applies(stage))
    }
}
