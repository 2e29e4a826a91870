//! What the user can ask for, and the keys for it: one list, from which the help is made, too.

use egui::Key;
use ortelius::scene::camera::Camera;

/// One wish of the user.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    Close,
    Help,
    Panels,
    Pause,
    FullScreen,
    Screenshot,
    Magnify,
    NextVariant,
    Show(usize),
    Compare,
    Difference,
    Play,
    /// To a frame of the chosen path; it is then paused.
    Seek(f64),
    ChoosePath(String),
    Record,
    CopyCamera,
    FlyTo(Camera),
    /// A place among the bookmarks.
    Save(usize),
    Recall(usize),
    /// A key of scenes, and its TOML value.
    Set(String, String),
}

/// Keys that ask for something when pressed.
pub const KEYS: [(Key, &str, Action); 13] = [
    (Key::F1, "help", Action::Help),
    (Key::F2, "panels", Action::Panels),
    (Key::F9, "pause the path, go on", Action::Pause),
    (Key::F11, "full screen", Action::FullScreen),
    (Key::F12, "screenshot, and the report that renders it again", Action::Screenshot),
    (Key::Space, "next variant", Action::NextVariant),
    (Key::X, "this variant beside the next: drag the divider", Action::Compare),
    (Key::V, "the difference of both", Action::Difference),
    (Key::Z, "magnifier", Action::Magnify),
    (Key::P, "play the path", Action::Play),
    (Key::R, "record the path as numbered pictures", Action::Record),
    (Key::C, "copy the camera as TOML (and print it)", Action::CopyCamera),
    (Key::Escape, "quit", Action::Close),
];

/// What moves the eye, for the help alone: [`super::control`] reads it as long as it is held.
pub const MOVES: [(&str, &str); 7] = [
    ("drag", "move the ground"),
    ("right drag", "turn about the middle of the picture"),
    ("wheel, pinch", "nearer, farther"),
    ("double click", "fly there"),
    ("W A S D, Q E", "fly; Q down, E up"),
    ("Shift, Ctrl", "four times as fast, four times as slow"),
    ("1 … 9", "fly to a bookmark; with Ctrl: save it"),
];

/// Bookmarks, in order.
pub const DIGITS: [Key; 9] =
    [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7, Key::Num8, Key::Num9];
