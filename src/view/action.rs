//! The actions of the window and their keys. The help (F1) prints this list.

use super::overlay::Overlay;
use egui::Key;
use ortelius::scene::camera::Camera;

/// One action.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    Close,
    Help,
    Panels,
    Profiler,
    Pause,
    Reload,
    Capture,
    FullScreen,
    Screenshot,
    Magnify,
    PrintPixel,
    PrintMemory,
    NextVariant,
    NextView,
    PreviousView,
    View(usize),
    Show(usize),
    Compare,
    /// Opens a variant beside the current one.
    ShowBeside(usize),
    /// Next comparison: both pictures, their difference, FLIP.
    NextComparison,
    Comparison(CompareMode),
    /// Applies the point with this index on the Pareto front.
    Trade(usize),
    NextOverlay,
    Overlay(Option<Overlay>),
    Freeze,
    Play,
    /// Jumps to a frame of the chosen path and pauses there.
    Seek(f64),
    ChoosePath(String),
    Record,
    CopyCamera,
    FlyTo(Camera),
    /// Index of a bookmark, from 0.
    Save(usize),
    Recall(usize),
    /// A key of the scene, and its value in TOML.
    Set(String, String),
    /// A key of the scene that is reset to the scene's own value.
    Reset(String),
}

/// How two variants share the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CompareMode {
    /// One picture on each side of the divider.
    Pictures,
    /// Eight times the absolute difference of their sRGB codes.
    Difference,
    Flip,
}

impl CompareMode {
    pub const ALL: [(CompareMode, &str); 3] = [
        (CompareMode::Pictures, "pictures"),
        (CompareMode::Difference, "difference"),
        (CompareMode::Flip, "FLIP"),
    ];

    pub fn next(self) -> CompareMode {
        match self {
            CompareMode::Pictures => CompareMode::Difference,
            CompareMode::Difference => CompareMode::Flip,
            CompareMode::Flip => CompareMode::Pictures,
        }
    }
}

/// Keys that trigger an action when pressed.
pub const KEYS: [(Key, &str, Action); 22] = [
    (Key::F1, "help", Action::Help),
    (Key::F2, "panels", Action::Panels),
    (Key::F5, "recompile the shaders", Action::Reload),
    (Key::F8, "capture the next frame, if RenderDoc started the program", Action::Capture),
    (Key::F9, "pause or resume the path", Action::Pause),
    (Key::F11, "full screen", Action::FullScreen),
    (Key::F12, "screenshot, and a report that reproduces it", Action::Screenshot),
    (Key::Space, "next variant", Action::NextVariant),
    (Key::PageDown, "next view of the figure", Action::NextView),
    (Key::PageUp, "previous view of the figure", Action::PreviousView),
    (Key::X, "compare with the next variant; drag the divider", Action::Compare),
    (Key::V, "comparison: both pictures, their difference, FLIP", Action::NextComparison),
    (Key::G, "next overlay", Action::NextOverlay),
    (Key::F, "freeze the camera for streaming and culling; the view still moves", Action::Freeze),
    (Key::Z, "magnifier, and the values of the pixel", Action::Magnify),
    (Key::N, "print the values of the magnified pixel", Action::PrintPixel),
    (Key::M, "print the memory in use", Action::PrintMemory),
    (Key::P, "profiler: the passes and their times", Action::Profiler),
    (Key::L, "play the path", Action::Play),
    (Key::R, "record the path as numbered pictures", Action::Record),
    (Key::C, "copy the camera as TOML (and print it)", Action::CopyCamera),
    (Key::Escape, "quit", Action::Close),
];

/// Input that moves the camera, listed for the help. [`super::control`] handles it.
pub const MOVES: [(&str, &str); 7] = [
    ("drag", "move the ground"),
    ("right drag", "orbit about the middle of the picture"),
    ("wheel, pinch", "zoom"),
    ("double click", "fly there"),
    ("W A S D, Q E", "fly; Q: down, E: up"),
    ("Shift, Ctrl", "fly four times faster, four times slower"),
    ("1 … 9", "fly to a bookmark; with Ctrl: save it (kept for later runs)"),
];

/// The keys of the bookmarks, in order.
pub const DIGITS: [Key; 9] =
    [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7, Key::Num8, Key::Num9];
