//! The actions of the window and their keys. The help is generated from the same list.

use super::overlay::Overlay;
use egui::Key;
use ortelius::scene::camera::Camera;

/// One action.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    Close,
    Help,
    Panels,
    Pause,
    Reload,
    Capture,
    FullScreen,
    Screenshot,
    Magnify,
    PrintPixel,
    PrintMemory,
    NextVariant,
    Show(usize),
    Compare,
    /// Shows a variant beside the current one.
    ShowBeside(usize),
    /// Cycles through pictures, their difference, and FLIP.
    NextComparison,
    Comparison(Comparison),
    /// Selects a setting from the Pareto front.
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
    /// Index of a bookmark.
    Save(usize),
    Recall(usize),
    /// A scene key and its TOML value.
    Set(String, String),
}

/// How two variants share the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Comparison {
    /// Side by side at the divider.
    Pictures,
    /// Eight times the difference of their bytes.
    Difference,
    Flip,
}

impl Comparison {
    pub const ALL: [(Comparison, &str); 3] = [
        (Comparison::Pictures, "pictures"),
        (Comparison::Difference, "difference"),
        (Comparison::Flip, "FLIP"),
    ];

    pub fn next(self) -> Comparison {
        match self {
            Comparison::Pictures => Comparison::Difference,
            Comparison::Difference => Comparison::Flip,
            Comparison::Flip => Comparison::Pictures,
        }
    }
}

/// Keys that trigger an action when pressed.
pub const KEYS: [(Key, &str, Action); 19] = [
    (Key::F1, "help", Action::Help),
    (Key::F2, "panels", Action::Panels),
    (Key::F5, "compile the shaders again", Action::Reload),
    (Key::F8, "capture the next frame, where RenderDoc started the program", Action::Capture),
    (Key::F9, "pause the path, go on", Action::Pause),
    (Key::F11, "full screen", Action::FullScreen),
    (Key::F12, "screenshot, and the report that renders it again", Action::Screenshot),
    (Key::Space, "next variant", Action::NextVariant),
    (Key::X, "this variant beside the next: drag the divider", Action::Compare),
    (Key::V, "both, their difference, FLIP", Action::NextComparison),
    (Key::G, "next overlay: levels and tiles, wanted minus shown, …", Action::NextOverlay),
    (Key::F, "stream and cull for this eye on, and look from elsewhere", Action::Freeze),
    (Key::Z, "magnifier, and the numbers of the pixel", Action::Magnify),
    (Key::N, "print the numbers under the magnifier", Action::PrintPixel),
    (Key::M, "print the memory that is held", Action::PrintMemory),
    (Key::P, "play the path", Action::Play),
    (Key::R, "record the path as numbered pictures", Action::Record),
    (Key::C, "copy the camera as TOML (and print it)", Action::CopyCamera),
    (Key::Escape, "quit", Action::Close),
];

/// Keys that move the camera, for the help only: [`super::control`] reads them while they are held.
pub const MOVES: [(&str, &str); 7] = [
    ("drag", "move the ground"),
    ("right drag", "turn about the middle of the picture"),
    ("wheel, pinch", "nearer, farther"),
    ("double click", "fly there"),
    ("W A S D, Q E", "fly; Q down, E up"),
    ("Shift, Ctrl", "four times as fast, four times as slow"),
    ("1 … 9", "fly to a bookmark; with Ctrl: save it, for later runs too"),
];

/// Bookmarks, in order.
pub const DIGITS: [Key; 9] =
    [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7, Key::Num8, Key::Num9];
