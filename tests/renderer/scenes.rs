//! A plane with a virtual texture, a hill that shares the texture, a bunny that hides parts of the plane and of the
//! hill, and a board with a picture.

use ortelius::scene::{Scene, SceneError};
use std::fmt::Write as _;
use std::path::PathBuf;
use tempfile::TempDir;

pub const SIZE: [u32; 2] = [160, 90];

const LAND: &str = r#"
[surface.land]
geometry = { kind = "plane", width_m = 2000.0, height_m = 1000.0, columns = 16, rows = 8 }
filter = { max_anisotropy = 1 }
[surface.land.texture]
kind = "virtual"
source = "ruler"
width_log2 = 16
height_log2 = 15
tile_size = 128
"#;

const HILL: &str = r#"
[surface.hill]
texture = "land"
[surface.hill.geometry]
kind = "progressive-mesh"
source = "hill.obj"
size_m = 160.0
up = "z"
north_m = 60.0
error_pixels = 0.5
"#;

const BUNNY: &str = r#"
[surface.bunny.geometry]
kind = "progressive-mesh"
source = "bunny"
size_m = 50.0
east_m = -60.0
north_m = -60.0
instances = 3
layout = "grid"
area_m = [160.0, 30.0]
"#;

/// A wall from a model. A `plane` surface would lie in the ground.
const BOARD: &str = r#"
[surface.board.geometry]
kind = "progressive-mesh"
source = "board.obj"
size_m = 60.0
up = "z"
east_m = 75.0
north_m = -40.0
[surface.board.texture]
kind = "plain"
path = "board.png"
"#;

pub const VIEW: &str = r#"
[view]
width = 160
height = 90
camera = "c"
[cameras.c]
east_m = 0.0
north_m = -220.0
altitude_m = 60.0
tilt_deg = 72.0
"#;

/// The model and picture files that the surfaces use.
pub struct Parts(TempDir);

impl Parts {
    pub fn new() -> Parts {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("hill.obj"), hill()).unwrap();
        let wall = "v 0 0 0\nv 4 0 0\nv 4 0 3\nv 0 0 3\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";
        std::fs::write(folder.path().join("board.obj"), wall).unwrap();
        std::fs::write(folder.path().join("wide.obj"), wall.replace("vt 1 1", "vt 1.5 1")).unwrap();
        let picture = image::RgbImage::from_fn(64, 48, |x, y| image::Rgb([4 * x as u8, 5 * y as u8, 200]));
        picture.save(folder.path().join("board.png")).unwrap();
        Parts(folder)
    }

    pub fn text(&self, names: &[&str], more: &str) -> String {
        let parts = [("land", LAND), ("hill", HILL), ("bunny", BUNNY), ("board", BOARD)];
        let parts: String =
            parts.iter().filter(|(name, _)| names.contains(name)).map(|(_, part)| *part).collect();
        format!("{parts}{VIEW}{more}")
    }

    fn path(&self) -> PathBuf {
        self.0.path().join("parts.toml")
    }

    pub fn scene_of(&self, text: &str) -> Result<Scene, SceneError> {
        Scene::from_text(&self.path(), text.to_owned())
    }

    /// A scene of these surfaces.
    pub fn scene(&self, names: &[&str], more: &str) -> Scene {
        self.scene_of(&self.text(names, more)).unwrap_or_else(|error| panic!("{error}"))
    }

    /// The same scene with one surface lit by the sun.
    pub fn lit(&self, name: &str, more: &str) -> Scene {
        let table = format!("[surface.{name}]\n");
        let text = self.text(&[name], more).replace(&table, &format!("{table}lit = true\n"));
        self.scene_of(&text).unwrap_or_else(|error| panic!("{error}"))
    }

    /// The same surfaces with other names.
    pub fn renamed(&self, names: &[&str], others: &[&str]) -> Scene {
        let text = names.iter().zip(others).fold(self.text(names, ""), |text, (name, other)| {
            text.replace(&format!("surface.{name}"), &format!("surface.{other}"))
                .replace(&format!("texture = \"{name}\""), &format!("texture = \"{other}\""))
        });
        self.scene_of(&text).unwrap_or_else(|error| panic!("{error}"))
    }
}

/// A bump of 16 x 16 quads with texture coordinates in the middle of the texture.
fn hill() -> String {
    let side = 17;
    let mut text = String::new();
    for row in 0..side {
        for column in 0..side {
            let [x, y] = [column, row].map(|at| f64::from(at) / 8.0 - 1.0);
            let z = 0.6 * (1.0 - x * x) * (1.0 - y * y);
            writeln!(text, "v {x} {y} {z}\nvt {} {}", 0.5 + 0.1 * x, 0.5 - 0.1 * y).unwrap();
        }
    }
    let corner = |column: i32, row: i32| row * side + column + 1;
    for row in 0..side - 1 {
        for column in 0..side - 1 {
            let [a, b] = [corner(column, row), corner(column + 1, row)];
            let [c, d] = [corner(column + 1, row + 1), corner(column, row + 1)];
            writeln!(text, "f {a}/{a} {b}/{b} {c}/{c}\nf {a}/{a} {c}/{c} {d}/{d}").unwrap();
        }
    }
    text
}
