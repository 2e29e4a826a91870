//! Runs `ortelius view` on a virtual display, sends it input and reads its output.

use crate::display::{Activity, Display, key, wait_for};
use ortelius::picture::write::Srgb8Picture;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tempfile::TempDir;
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{
    self, AtomEnum, ClientMessageEvent, ConfigureWindowAux, ConnectionExt as _, EventMask, PropMode,
};
use x11rb::wrapper::ConnectionExt as _;

/// Value of `-D` for an ellipsoid with few quads. The shipped ellipsoids have 75,000 quads, which would take most of
/// the time of a small picture.
pub const COARSE: &str = "surface.land.geometry={kind='ellipsoid',columns=96,rows=48}";

type Words = Arc<Mutex<String>>;

pub struct Program<'a> {
    display: &'a Display,
    child: Child,
    /// The text of stdout and of stderr so far.
    words: [Words; 2],
    readers: Vec<std::thread::JoinHandle<()>>,
    folder: TempDir,
    /// Bytes of stderr that [`Program::said`] has consumed.
    heard: usize,
    /// The X id of the minimised window.
    minimised: Option<u32>,
}

/// The window's pixels as the X server shows them.
pub struct Seen(pub Srgb8Picture);

impl Seen {
    /// True if the picture has more than 50 colours.
    pub fn is_varied(&self) -> bool {
        let mut colours: Vec<_> = self.0.rgba.chunks_exact(4).collect();
        colours.sort();
        colours.dedup();
        colours.len() > 50
    }
}

fn read(stream: impl Read + Send + 'static, words: Words) -> std::thread::JoinHandle<()> {
    std::thread::spawn(move || {
        for line in BufReader::new(stream).lines() {
            let Ok(line) = line else { return };
            *words.lock().unwrap() += &(line + "\n");
        }
    })
}

impl<'a> Program<'a> {
    pub fn start(display: &'a Display, arguments: &[&str], environment: &[(&str, &str)]) -> Program<'a> {
        let folder = tempfile::tempdir().unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_ortelius"));
        command.arg("view").args(arguments).current_dir(&folder);
        if matches!(arguments[0], "earth" | "globe") {
            command.args(["-D", COARSE]);
        }
        command.env("DISPLAY", &display.name).env_remove("WAYLAND_DISPLAY").env("ORTELIUS_VALIDATE", "1");
        // Each run has its own bookmarks and kept meshes.
        command.env("XDG_CONFIG_HOME", folder.path()).env("ORTELIUS_CACHE", folder.path().join("cache"));
        command.envs(environment.iter().copied()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let words = [Words::default(), Words::default()];
        let readers = vec![
            read(child.stdout.take().unwrap(), words[0].clone()),
            read(child.stderr.take().unwrap(), words[1].clone()),
        ];
        Program { display, child, words, readers, folder, heard: 0, minimised: None }
    }

    pub fn process(&self) -> u32 {
        self.child.id()
    }

    /// The text of stdout so far.
    pub fn stdout(&self) -> String {
        self.words[0].lock().unwrap().clone()
    }

    pub fn stderr(&self) -> String {
        self.words[1].lock().unwrap().clone()
    }

    fn must_run(&mut self) {
        if let Some(status) = self.child.try_wait().unwrap() {
            panic!("ended with {status}: {}", self.stderr());
        }
    }

    /// The window's X id. Panics if the program has ended.
    fn window(&mut self) -> u32 {
        let window = wait_for("a window", || {
            self.must_run();
            self.display.window()
        });
        self.display.focus(window);
        window
    }

    /// The window's current pixels.
    pub fn picture(&mut self) -> Seen {
        let window = self.window();
        let ([width, height], bgrx) = wait_for("the window's pixels", || self.display.pixels(window));
        let rgba = bgrx.chunks_exact(4).flat_map(|pixel| [pixel[2], pixel[1], pixel[0], 255]).collect();
        Seen(Srgb8Picture { width, height, rgba })
    }

    /// Waits until program and server are idle, however slow the machine is. Saves the picture to the folder
    /// `ORTELIUS_PICTURES` if that is set.
    pub fn settled_picture(&mut self) -> Seen {
        self.window();
        let seen = wait_for("a picture at rest", || {
            self.must_run();
            let rests = Activity::of(self.processes())?.rests();
            rests.then(|| self.picture()).filter(Seen::is_varied)
        });
        if let Ok(folder) = std::env::var("ORTELIUS_PICTURES") {
            static COUNT: AtomicU32 = AtomicU32::new(0);
            let name = format!("{:03}.png", COUNT.fetch_add(1, Ordering::Relaxed));
            seen.0.save(&Path::new(&folder).join(name)).unwrap();
        }
        seen
    }

    fn processes(&self) -> [u32; 2] {
        [self.child.id(), self.display.process()]
    }

    /// Waits until the program has handled its input: it is idle, or has used half a second of processor time.
    fn taken_up(&self) {
        let begun = wait_for("its threads", || Activity::of(self.processes()));
        wait_for("half a second's work", || {
            let now = Activity::of(self.processes())?;
            (now.ran_ns.saturating_sub(begun.ran_ns) > 500_000_000 || now.rests()).then_some(())
        });
    }

    pub fn until(&mut self, what: &str, mut holds: impl FnMut(&mut Program<'a>) -> bool) {
        wait_for(what, || holds(self).then_some(()));
    }

    /// Waits for a picture that differs from `before`, and then for a settled one.
    pub fn until_other(&mut self, what: &str, before: &Seen) -> Seen {
        self.until(what, |window| window.picture().0 != before.0);
        self.settled_picture()
    }

    /// Waits until stderr has `words` after the text that earlier calls have consumed. Returns the rest of the line.
    pub fn said(&mut self, words: &str) -> String {
        let heard = self.heard;
        let (line, end) = wait_for(words, || {
            let all = self.stderr();
            let start = heard + all[heard..].find(words)? + words.len();
            let line = all[start..].lines().next()?;
            Some((line.to_owned(), start + line.len()))
        });
        self.heard = end;
        line
    }

    /// Waits for a line on stdout that contains `words`.
    pub fn printed(&mut self, words: &str) -> String {
        wait_for(words, || {
            let all = self.words[0].lock().unwrap().clone();
            let line = all.lines().find(|line| line.contains(words)).map(str::to_owned);
            line.map(|line| line.trim_start_matches("./").to_owned())
        })
    }

    pub fn press(&mut self, key: u8) {
        self.hold(key, 0);
    }

    /// Presses a key until a printed line satisfies `holds`. One press may not suffice, because the values of a pixel
    /// arrive some frames late. Returns the last such line.
    pub fn press_until_printed(&mut self, key: u8, holds: impl Fn(&str) -> bool) -> String {
        wait_for("a printed line", || {
            self.press(key);
            std::thread::sleep(Duration::from_millis(200));
            self.stdout().lines().rfind(|line| holds(line)).map(str::to_owned)
        })
    }

    /// Presses a key with Ctrl held.
    pub fn press_with_control(&mut self, key: u8) {
        self.window();
        self.display.fake(xproto::KEY_PRESS_EVENT, key::CONTROL, [0, 0]);
        // `press` is not used, because it sets the focus, which would release Ctrl.
        self.display.fake(xproto::KEY_PRESS_EVENT, key, [0, 0]);
        self.display.fake(xproto::KEY_RELEASE_EVENT, key, [0, 0]);
        self.display.fake(xproto::KEY_RELEASE_EVENT, key::CONTROL, [0, 0]);
    }

    /// Unmaps and maps the window, as a window manager does to minimise it.
    pub fn hide_and_show(&mut self) {
        self.minimise();
        std::thread::sleep(Duration::from_millis(200));
        self.restore();
    }

    /// Unmaps the window and marks it as hidden.
    pub fn minimise(&mut self) {
        let window = self.window();
        self.set_hidden(window, &[self.atom("_NET_WM_STATE_HIDDEN")]);
        self.display.connection.unmap_window(window).unwrap();
        self.display.connection.flush().unwrap();
        wait_for("no window", || self.display.window().is_none().then_some(()));
        self.minimised = Some(window);
    }

    pub fn restore(&mut self) {
        let window = self.minimised.take().expect("minimised before");
        self.set_hidden(window, &[]);
        self.display.connection.map_window(window).unwrap();
        self.display.connection.flush().unwrap();
    }

    fn set_hidden(&self, window: u32, states: &[u32]) {
        let state = self.atom("_NET_WM_STATE");
        let connection = &self.display.connection;
        connection.change_property32(PropMode::REPLACE, window, state, AtomEnum::ATOM, states).unwrap();
    }

    fn atom(&self, name: &str) -> u32 {
        self.display.connection.intern_atom(false, name.as_bytes()).unwrap().reply().unwrap().atom
    }

    pub fn hold(&mut self, key: u8, milliseconds: u64) {
        self.window();
        self.display.fake(xproto::KEY_PRESS_EVENT, key, [0, 0]);
        if milliseconds > 0 {
            std::thread::sleep(Duration::from_millis(milliseconds));
            self.taken_up();
        }
        self.display.fake(xproto::KEY_RELEASE_EVENT, key, [0, 0]);
    }

    /// Moves the pointer to a position in the window. The window's corner is the root window's corner.
    pub fn point(&self, at: [i16; 2]) {
        self.display.fake(xproto::MOTION_NOTIFY_EVENT, 0, at);
        // Some time for a frame, as between the motions of a real mouse.
        self.taken_up();
    }

    pub fn drag(&mut self, from: [i16; 2], to: [i16; 2], button: u8) {
        self.window();
        self.point(from);
        self.display.fake(xproto::BUTTON_PRESS_EVENT, button, from);
        for step in 1..=4i16 {
            self.point([0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * step / 4));
        }
        self.display.fake(xproto::BUTTON_RELEASE_EVENT, button, to);
    }

    /// Waits until the program has handled all input so far: keys are handled in the order of the input.
    pub fn handled(&mut self) {
        let before = self.stdout().matches("memory: ").count();
        self.press(key::M);
        self.until("memory is printed", |window| {
            let words = window.stdout();
            words.matches("memory: ").count() > before && words.ends_with('\n')
        });
    }

    /// A drag with the left button. The program handles every step of it, however slow its frames are.
    pub fn drag_in_steps(&mut self, from: [i16; 2], to: [i16; 2], steps: i16) {
        self.window();
        self.display.fake(xproto::MOTION_NOTIFY_EVENT, 0, from);
        self.handled();
        self.display.fake(xproto::BUTTON_PRESS_EVENT, 1, from);
        self.handled();
        for step in 1..=steps {
            let at = [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * step / steps);
            self.display.fake(xproto::MOTION_NOTIFY_EVENT, 0, at);
            self.handled();
        }
        self.display.fake(xproto::BUTTON_RELEASE_EVENT, 1, to);
        self.handled();
    }

    /// Scrolls. Positive notches zoom in.
    pub fn wheel(&mut self, at: [i16; 2], notches: i32) {
        self.window();
        self.point(at);
        let button = if notches > 0 { 4 } else { 5 };
        for _ in 0..notches.abs() {
            self.display.fake(xproto::BUTTON_PRESS_EVENT, button, at);
            self.display.fake(xproto::BUTTON_RELEASE_EVENT, button, at);
        }
    }

    pub fn resize(&mut self, [width, height]: [u32; 2]) {
        let window = self.window();
        let size = ConfigureWindowAux::new().width(width).height(height);
        self.display.connection.configure_window(window, &size).unwrap();
        self.display.connection.flush().unwrap();
        std::thread::sleep(Duration::from_millis(60));
    }

    /// Closes the window as a window manager does.
    pub fn close_button(&mut self) {
        let window = self.window();
        let data = [self.atom("WM_DELETE_WINDOW"), x11rb::CURRENT_TIME, 0, 0, 0];
        let message = ClientMessageEvent::new(32, window, self.atom("WM_PROTOCOLS"), data);
        self.display.connection.send_event(false, window, EventMask::NO_EVENT, message).unwrap();
        self.display.connection.flush().unwrap();
    }

    /// Waits until the program ends. Returns its exit code and all of stderr.
    pub fn ended(mut self) -> (Option<i32>, String) {
        let status = wait_for("the program's end", || self.child.try_wait().unwrap());
        self.readers.drain(..).for_each(|reader| reader.join().unwrap());
        (status.code(), self.stderr())
    }

    /// Presses Escape. Expects exit code 0; warnings are allowed, for example that the clipboard has no owner. Messages
    /// of the validation layer and leaked device memory give another exit code. Returns the folder with the program's
    /// files.
    pub fn quit(mut self) -> TempDir {
        self.press(key::ESCAPE);
        self.written_and_said().0
    }

    /// Presses Escape; then as [`Program::closed_in_silence`].
    pub fn quit_in_silence(mut self) -> TempDir {
        self.press(key::ESCAPE);
        self.closed_in_silence()
    }

    fn written_and_said(mut self) -> (TempDir, String) {
        let folder = std::mem::replace(&mut self.folder, tempfile::tempdir().unwrap());
        let (code, words) = self.ended();
        assert_eq!(code, Some(0), "{words}");
        (folder, words)
    }

    /// Expects exit code 0, no warning and no error. Returns the folder with the program's files.
    pub fn closed_in_silence(self) -> TempDir {
        let (folder, words) = self.written_and_said();
        let loud: Vec<&str> = words.lines().filter(|line| !line.starts_with(" INFO ")).collect();
        assert_eq!(loud, [""; 0], "{words}");
        folder
    }
}

impl Drop for Program<'_> {
    fn drop(&mut self) {
        // Both calls fail only if the process has already ended.
        let _ended = self.child.kill().and_then(|()| self.child.wait().map(drop));
    }
}
