//! The overlays that colour the picture.

use super::stage::Stage;

/// The selected overlay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overlay {
    Levels,
    Shortfall,
    Collapse,
    Misses,
    Steps,
    Error,
}

impl Overlay {
    pub const ALL: [Overlay; 6] = [
        Overlay::Levels,
        Overlay::Shortfall,
        Overlay::Collapse,
        Overlay::Misses,
        Overlay::Steps,
        Overlay::Error,
    ];

    /// Name and meaning.
    pub fn about(self) -> [&'static str; 2] {
        match self {
            Overlay::Levels => [
                "levels",
                "the level that each pixel requests, with the edges of the tiles and their names (level: row column)",
            ],
            Overlay::Shortfall => [
                "shown minus requested level",
                "blue: the requested level is shown; yellow to red: 1 to 3 levels coarser; green: finer",
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
            Overlay::Steps => [
                "relief steps",
                "steps of each pixel's ray through a relief, or texels that it visits: blue 1, green 16, red 256",
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
            Overlay::Steps => stage.renderer.technique.has_reliefs(),
            Overlay::Error => true,
        }
    }

    /// True if the overlay colours the faces of progressive meshes.
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
            Overlay::Steps => 5,
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
