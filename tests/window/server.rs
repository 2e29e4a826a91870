//! An Xvfb server.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

/// A virtual display. Dropping it ends the server.
pub struct Server {
    pub process: Child,
    /// As `DISPLAY` has it.
    pub name: String,
}

impl Server {
    pub fn start() -> Server {
        let mut process = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "800x600x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap_or_else(|error| panic!("Xvfb: {error}; `./x test` installs it"));
        let mut number = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut number).unwrap();
        Server { process, name: format!(":{}", number.trim()) }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // Both calls fail only if the server has already ended.
        let _ended = self.process.kill().and_then(|()| self.process.wait().map(drop));
    }
}
