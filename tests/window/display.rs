//! An Xvfb server, and a connection that reads pixels and sends input.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{self, ConnectionExt as _, ImageFormat, InputFocus};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

/// Key codes of the server's keyboard: evdev codes plus 8.
pub mod key {
    pub const ESCAPE: u8 = 9;
    pub const R: u8 = 27;
    pub const Z: u8 = 52;
    pub const N: u8 = 57;
    pub const M: u8 = 58;
    pub const C: u8 = 54;
    pub const Q: u8 = 24;
    pub const S: u8 = 39;
    pub const A: u8 = 38;
    pub const D: u8 = 40;
    pub const E: u8 = 26;
    pub const P: u8 = 33;
    pub const L: u8 = 46;
    pub const CONTROL: u8 = 37;
    pub const DIGIT_1: u8 = 10;
    pub const F8: u8 = 74;
    pub const F9: u8 = 75;
    pub const F11: u8 = 95;
    pub const F: u8 = 41;
    pub const G: u8 = 42;
    pub const SPACE: u8 = 65;
    pub const PAGE_UP: u8 = 112;
    pub const PAGE_DOWN: u8 = 117;
    pub const W: u8 = 25;
    pub const X: u8 = 53;
    pub const V: u8 = 55;
    pub const F1: u8 = 67;
    pub const F2: u8 = 68;
    pub const F5: u8 = 71;
    pub const F12: u8 = 96;
}

/// A virtual display. Dropping it ends the server.
pub struct Display {
    server: Child,
    pub name: String,
    pub connection: RustConnection,
    root: u32,
}

impl Display {
    pub fn start() -> Display {
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "800x600x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap_or_else(|error| panic!("Xvfb: {error}; `./x test` installs it"));
        let mut number = String::new();
        BufReader::new(server.stdout.take().unwrap()).read_line(&mut number).unwrap();
        let name = format!(":{}", number.trim());
        let (connection, screen) = RustConnection::connect(Some(&name)).unwrap();
        let root = connection.setup().roots[screen].root;
        Display { server, name, connection, root }
    }

    pub fn process(&self) -> u32 {
        self.server.id()
    }

    /// The mapped top-level window whose name starts with `Ortelius`, if there is one.
    pub fn window(&self) -> Option<u32> {
        let tree = self.connection.query_tree(self.root).unwrap().reply().unwrap();
        tree.children.into_iter().find(|window| {
            let seen = self.connection.get_window_attributes(*window).unwrap().reply();
            let named = self.connection.get_property(
                false,
                *window,
                xproto::AtomEnum::WM_NAME,
                xproto::AtomEnum::ANY,
                0,
                64,
            );
            let named = named.unwrap().reply().is_ok_and(|name| name.value.starts_with(b"Ortelius"));
            named && seen.is_ok_and(|seen| seen.map_state == xproto::MapState::VIEWABLE)
        })
    }

    /// Gives the window the keyboard focus. There is no window manager to do it.
    pub fn focus(&self, window: u32) {
        self.connection.set_input_focus(InputFocus::PARENT, window, x11rb::CURRENT_TIME).unwrap();
        self.connection.flush().unwrap();
    }

    /// The window's size, and its pixels in BGRX order.
    pub fn pixels(&self, window: u32) -> Option<([u32; 2], Vec<u8>)> {
        let at = self.connection.get_geometry(window).unwrap().reply().ok()?;
        let (width, height) = (at.width, at.height);
        let image = self.connection.get_image(ImageFormat::Z_PIXMAP, window, 0, 0, width, height, u32::MAX);
        let image = image.unwrap().reply().ok()?;
        Some(([u32::from(width), u32::from(height)], image.data))
    }

    /// Sends a key, button or motion event as if from a device. `kind` is the number of the core event.
    pub fn fake(&self, kind: u8, detail: u8, [x, y]: [i16; 2]) {
        self.connection.xtest_fake_input(kind, detail, 0, self.root, x, y, 0).unwrap();
        self.connection.flush().unwrap();
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        // Both calls fail only if the server has already ended.
        let _ended = self.server.kill().and_then(|()| self.server.wait().map(drop));
    }
}

/// The activity of some processes.
#[derive(Clone, Copy)]
pub struct Activity {
    processes: [u32; 2],
    /// Processor time used so far. Unlike elapsed time, it hardly depends on how busy the machine is.
    pub ran_ns: u64,
    all_sleep: bool,
}

impl Activity {
    /// `None` if a thread or a process has just ended.
    pub fn of(processes: [u32; 2]) -> Option<Activity> {
        let mut found = Activity { processes, ran_ns: 0, all_sleep: true };
        for process in processes {
            for thread in std::fs::read_dir(format!("/proc/{process}/task")).ok()? {
                let read = |name| std::fs::read_to_string(thread.as_ref().ok()?.path().join(name)).ok();
                let (stat, spent) = (read("stat")?, read("schedstat")?);
                // The state follows the name in brackets; `S` is a thread that waits for an event.
                found.all_sleep &= stat.rsplit(") ").next()?.starts_with('S');
                found.ran_ns += spent.split(' ').next()?.parse::<u64>().ok()?;
            }
        }
        Some(found)
    }

    /// True if no thread runs or waits for a processor, now and for 60 ms.
    pub fn rests(self) -> bool {
        std::thread::sleep(Duration::from_millis(60));
        let later = Activity::of(self.processes);
        later.is_some_and(|later| self.all_sleep && later.all_sleep && self.ran_ns == later.ran_ns)
    }
}

/// Calls `ask` until it returns a value.
///
/// # Panics
/// After ten minutes. A busy machine is slow, but no passing test waits this long.
pub fn wait_for<T>(what: &str, mut ask: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        assert!(start.elapsed() < Duration::from_secs(600), "{what}: did not happen within 600 s");
        std::thread::sleep(Duration::from_millis(20));
    }
}
