//! Tests of the real window on a virtual display of its own. Keys and pointer input come from the X server,
//! and the tests compare the pixels that the server shows. Validation is on. The program itself fails if it
//! leaks device memory.
#![cfg(all(target_os = "linux", feature = "window"))]

mod bookmarks;
mod close;
mod compare;
mod display;
mod every;
mod footprint;
mod overlays;
mod panels;
mod present;
mod program;
mod reload;
mod renderdoc;
mod views;
mod walk;
mod wireframe;

use display::{Display, key};
use ortelius::picture::write::{Srgb8Picture, read_png};
use program::{Program, Seen};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;

/// Value of `-D` for tests that do not test filters: one trilinear sample is faster than the shipped ellipse.
const FAST: &str = "surface.land.filter={max_anisotropy=1}";

/// A disk that answers after a minute: its tiles are never shown, because the window is closed earlier.
const SLOW_DISK: [&str; 4] = [
    // With small tiles, the resident levels are too coarse for this view.
    "surface.land.texture.width_log2=14",
    "surface.land.texture.height_log2=13",
    "surface.land.texture.tile_size=64",
    "disk.delay_ms=60000",
];

/// Starts `ortelius view ARGUMENTS`.
fn open<'a>(display: &'a Display, arguments: &[&str]) -> Program<'a> {
    Program::start(display, arguments, &[])
}

/// The number of pixels in which two pictures differ.
fn differing(a: &Srgb8Picture, b: &Srgb8Picture) -> usize {
    assert_eq!([a.width, a.height], [b.width, b.height]);
    a.rgba.chunks_exact(4).zip(b.rgba.chunks_exact(4)).filter(|(a, b)| a[..3] != b[..3]).count()
}

#[test]
fn one_changed_pixel_is_counted() {
    let a = Srgb8Picture { width: 2, height: 1, rgba: vec![1, 2, 3, 255, 4, 5, 6, 255] };
    let mut b = a.clone();
    assert_eq!(differing(&a, &b), 0);
    b.rgba[5] = 0;
    assert_eq!(differing(&a, &b), 1);
}

/// Runs `ortelius render REPORT -o OUTPUT`.
fn rendered_again(folder: &Path, report: &str, output: &str) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ortelius"));
    command.current_dir(folder).args(["render", report, "-o", output]).env("ORTELIUS_CACHE", "");
    let ran = command.output().unwrap();
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
}

#[test]
fn the_earth_is_flown_over_and_closed_and_leaves_nothing_behind() {
    let display = Display::start();
    let mut window = open(&display, &["earth", "--size", "320x180", "--no-panels"]);
    let first = window.settled_picture();
    assert!(first.is_varied(), "the picture must not be a single colour");

    window.drag([160, 90], [60, 130], 1);
    let moved = window.until_other("the ground follows the pointer", &first);
    window.wheel([160, 90], 3);
    let nearer = window.until_other("the wheel goes nearer", &moved);
    window.hold(key::W, 400);
    let flown = window.until_other("W flies", &nearer);
    window.drag([160, 90], [190, 60], 3);
    let turned = window.until_other("the right button turns", &flown);
    window.press(key::F1);
    window.until_other("F1 shows the keys", &turned);
    window.press(key::F1);
    window.press(key::F);
    window.wheel([160, 90], -6);
    let yellow =
        |seen: &Seen| seen.0.rgba.chunks_exact(4).filter(|pixel| pixel[..3] == [255, 255, 0]).count();
    window.until("the outline of the frozen camera's view", |window| yellow(&window.picture()) > 50);
    window.press(key::F);
    window.until("the outline disappears", |window| yellow(&window.picture()) == 0);
    window.quit_in_silence();
}

#[test]
fn time_budgets_do_not_delay_a_resting_view() {
    let display = Display::start();
    // A load takes as long as the budgets of thousands of frames.
    let budgets = ["-D", "cache.load_budget_ms=0.001", "-D", "cache.upload_budget_ms=0.001"];
    let arguments = ["earth", "--size", "160x90", "--no-panels", "-D", FAST];
    let mut window = open(&display, &[&arguments[..], &budgets].concat());
    // At rest, no tile is missing.
    assert!(window.settled_picture().is_varied());
    window.quit_in_silence();
}

#[test]
fn a_screenshot_is_what_the_window_shows_and_what_its_report_renders() {
    let display = Display::start();
    // The noise of a settled picture is the same however many frames passed until all tiles had arrived.
    let noisy = ["-D", "surface.land.filter={kind='stochastic',samples=4}"];
    let exact = ["--deterministic"];
    for (scene, tilt, other) in [("earth", "20", &exact[..]), ("herd", "70", &exact), ("earth", "20", &noisy)]
    {
        let arguments = [scene, "--size", "256x144", "--no-panels", "--tilt", tilt];
        let mut window = open(&display, &[&arguments, other].concat());
        let start = window.settled_picture();
        window.drag([128, 72], [120, 80], 1);
        window.until_other("the ground follows the pointer", &start);
        let shown = window.settled_picture();
        window.press(key::F12);
        let png = window.printed(".png");
        let folder = window.quit_in_silence();
        let saved = read_png(&folder.path().join(&png)).unwrap();
        // The window's noise depends on the frames before.
        let equal = differing(&shown.0, &saved) == 0;
        assert_eq!(equal, other == exact, "{scene}: the screenshot must equal the window");
        rendered_again(folder.path(), &png.replace(".png", ".json"), "again.png");
        assert!(saved == read_png(&folder.path().join("again.png")).unwrap(), "{scene}");
    }
}

#[test]
fn a_screenshot_that_waits_for_its_tiles_does_not_stop_the_window() {
    let display = Display::start();
    let slow: Vec<&str> = SLOW_DISK.into_iter().chain([FAST]).flat_map(|change| ["-D", change]).collect();
    let mut window = open(&display, &[&["globe", "--size", "160x90", "--no-panels"], &slow[..]].concat());
    window.until("the resident tiles", |window| window.picture().is_varied());
    window.press(key::F12);
    window.press(key::F12);
    window.said("the last screenshot still waits for its tiles");
    let before = window.picture();
    window.press(key::F1);
    window.until("F1 shows the keys", |window| differing(&window.picture().0, &before.0) > 1000);
    assert!(!window.stdout().contains(".png"), "{}", window.stdout());
    window.press(key::ESCAPE);
    window.said("the screenshot is not saved");
}

#[test]
fn a_recording_that_waits_for_its_tiles_does_not_stop_the_window() {
    let display = Display::start();
    let changes = SLOW_DISK.into_iter().chain(["view.path=dive", FAST]).flat_map(|change| ["-D", change]);
    let arguments: Vec<&str> =
        ["globe", "--size", "160x90", "--no-panels"].into_iter().chain(changes).collect();
    let mut window = open(&display, &arguments);
    window.until("the resident tiles", |window| window.picture().is_varied());
    window.press(key::R);
    window.press(key::R);
    window.said("the last recording still goes on");
    let before = window.picture();
    window.press(key::F1);
    window.until("F1 shows the keys", |window| differing(&window.picture().0, &before.0) > 1000);
    window.press(key::ESCAPE);
    window.said("the recording ends after");
}

#[test]
fn a_minimised_window_finishes_its_screenshot() {
    let display = Display::start();
    let mut window = open(&display, &["earth", "--size", "256x144", "--no-panels", "-D", "disk.delay_ms=20"]);
    window.settled_picture();
    let saved = |window: &Program<'_>| window.stdout().lines().filter(|line| line.ends_with(".png")).count();
    let before = loop {
        let before = saved(&window);
        window.press(key::F12);
        window.handled();
        window.minimise();
        // A screenshot that ends before the window is hidden tests nothing.
        if saved(&window) == before {
            break before;
        }
        window.restore();
    };
    window.until("the screenshot", |window| saved(window) > before);
    let png = window.stdout().lines().rfind(|line| line.ends_with(".png")).unwrap().to_owned();
    let png = png.trim_start_matches("./").to_owned();
    window.restore();
    let shown = window.settled_picture();
    let folder = window.quit_in_silence();
    assert!(read_png(&folder.path().join(&png)).unwrap().width == shown.0.width);
    rendered_again(folder.path(), &png.replace(".png", ".json"), "again.png");
    assert!(
        read_png(&folder.path().join(png)).unwrap() == read_png(&folder.path().join("again.png")).unwrap()
    );
}

#[test]
fn a_recorded_path_is_rendered_again_by_its_report() {
    let display = Display::start();
    let scene = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/globe.toml")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = "\n[paths.short]\nkind = \"dive\"\nframes = 4\ncamera = \"africa\"\nto_altitude_m = 4e6\n";
    let name = folder.path().join("short.toml");
    std::fs::write(&name, scene + path).unwrap();
    let arguments = [name.to_str().unwrap(), "--size", "160x90", "--no-panels", "-D", "view.path=short"];
    // A fake ffmpeg that records its arguments.
    let (bin, script) = (folder.path().join("bin"), "#!/bin/sh\necho \"$@\" > film.mp4\n");
    std::fs::create_dir(&bin).unwrap();
    std::fs::write(bin.join("ffmpeg"), script).unwrap();
    std::fs::set_permissions(bin.join("ffmpeg"), std::fs::Permissions::from_mode(0o755)).unwrap();
    let paths = format!("{}:{}", bin.display(), std::env::var("PATH").unwrap());
    let mut window = Program::start(&display, &arguments, &[("PATH", &paths)]);
    window.settled_picture();
    window.press(key::R);
    let film = window.printed("ortelius-");
    let folder = window.quit_in_silence();
    let asked = std::fs::read_to_string(folder.path().join(format!("{film}/film.mp4"))).unwrap();
    assert!(asked.contains("-framerate 30 -i %05d.png") && asked.ends_with(" film.mp4\n"), "{asked}");
    let animation = std::fs::File::open(folder.path().join(format!("{film}/animation.png"))).unwrap();
    let mut animation = png::Decoder::new(std::io::BufReader::new(animation)).read_info().unwrap();
    let control = animation.info().animation_control.unwrap();
    assert_eq!((control.num_frames, control.num_plays), (4, 0));
    for frame in 0..4 {
        let mut rgb = vec![0; animation.output_buffer_size().unwrap()];
        animation.next_frame(&mut rgb).unwrap();
        let recorded = read_png(&folder.path().join(format!("{film}/{frame:05}.png"))).unwrap();
        let recorded: Vec<u8> = recorded.rgba.chunks_exact(4).flat_map(|pixel| pixel[..3].to_vec()).collect();
        assert!(rgb == recorded, "frame {frame} of the animation");
    }
    rendered_again(folder.path(), &format!("{film}/report.json"), "again-{frame}.png");
    for frame in 0..4 {
        let recorded = read_png(&folder.path().join(format!("{film}/{frame:05}.png"))).unwrap();
        let again = read_png(&folder.path().join(format!("again-{frame:05}.png"))).unwrap();
        assert!(recorded == again, "frame {frame}");
    }
}

#[test]
fn a_recording_alone_ends_by_itself() {
    let display = Display::start();
    let mut window = open(
        &display,
        &["earth", "--size", "64x36", "--record", "-D", "view.path=orbit", "-D", "paths.orbit.frames=3"],
    );
    let film = window.printed("ortelius-");
    let folder = window.closed_in_silence();
    assert!(folder.path().join(film).join("animation.png").exists());
}

#[test]
fn without_a_display_one_line_names_the_headless_command() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ortelius"));
    for name in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(name);
    }
    let ran = command.args(["view", "earth"]).output().unwrap();
    let words = String::from_utf8(ran.stderr).unwrap();
    assert_eq!(ran.status.code(), Some(2), "{words}");
    assert!(words.lines().count() == 1 && words.contains("ortelius render SCENE -o"), "{words}");
}

/// lavapipe crashes with vectors of 512 bits. tests/faults has the same test for the other commands.
#[test]
fn vectors_of_512_bits_are_refused() {
    let display = Display::start();
    let arguments =
        ["earth", "--size", "64x36", "--record", "-D", "view.path=orbit", "-D", "paths.orbit.frames=3"];
    let window = Program::start(&display, &arguments, &[("LP_NATIVE_VECTOR_WIDTH", "512")]);
    let (code, words) = window.ended();
    let is_refused = code == Some(1) && words.contains("unset LP_NATIVE_VECTOR_WIDTH");
    assert!(is_refused || !words.contains("llvmpipe"), "{code:?}: {words}");
}

#[test]
fn a_measurement_prints_its_flights_and_ends() {
    let display = Display::start();
    // With two variants, the open panels show the time of each frame. The keys must be pressed all the same.
    let scene = ["globe", "--size", "400x300", "-D", FAST];
    let variants = [1, 4].map(|samples| format!("surface.land.filter.max_anisotropy={samples}"));
    let variants = ["--variant", &variants[0], "--variant", &variants[1]];
    let measure = ["--measure=times.json", "--frames", "20"];
    let mut window = open(&display, &[&scene[..], &variants, &measure].concat());
    let flights = ["cold caches", "warm caches", "panels closed", "panels open"];
    for flight in flights {
        window.printed(&format!("{flight}: 24 frames, median "));
    }
    window.printed("99th percentile, cold over warm: ");
    window.printed("longest frame without its waits for the device and the display: cold ");
    window.printed("panels: median ");
    let frames = window.printed("frames from a key press to a changed picture: ");
    // These are counts, not times.
    let max: u32 = frames.rsplit("; maximum ").next().unwrap().parse().unwrap();
    let all_counted = !frames.contains("no change") && !frames.contains("not counted");
    assert!(max <= 2 && all_counted, "{frames}");
    let folder = window.closed_in_silence();
    let times = std::fs::read_to_string(folder.path().join("times.json")).unwrap();
    let times: serde_json::Value = serde_json::from_str(&times).unwrap();
    assert_eq!((&times["format"], &times["version"]), (&"ortelius-window-times".into(), &2.into()));
    assert_eq!(times["response"], frames.as_str());
    assert_eq!((&times["size"], &times["panels_ms"]["count"]), (&serde_json::json!([400, 300]), &24.into()));
    for key in ["device", "driver", "processor", "commit"] {
        assert!(!times["machine"][key].as_str().unwrap().is_empty(), "{key}");
    }
    for (flight, name) in times["flights"].as_array().unwrap().iter().zip(flights) {
        assert_eq!((&flight["name"], &flight["frame"]["count"]), (&name.into(), &24.into()));
        // This time excludes waits, so it is at most the frame's time.
        let host = flight["host_longest"].as_f64().unwrap();
        assert!(host > 0.0 && host <= flight["frame"]["max"].as_f64().unwrap(), "{flight}");
    }
}
