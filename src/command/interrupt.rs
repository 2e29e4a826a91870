//! SIGINT, SIGTERM and SIGHUP: removes half-written files, prints one line of advice, and ends the process by the
//! signal, as shells expect.

use anyhow::Context;
use ortelius::picture::write::abandon;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use signal_hook::low_level::emulate_default_handler;
use std::io::{IsTerminal, Write};

/// The signals by which users and systems ask a process to end.
pub const SIGNALS: [i32; 3] = [SIGINT, SIGTERM, SIGHUP];

/// Waits for a signal in the background. `advice`: what the user can do next; `None` if the parent process prints it.
///
/// # Errors
/// The system refuses the signal handlers.
pub fn watch(advice: Option<&'static str>) -> anyhow::Result<()> {
    let ignored = ignored();
    let wanted = SIGNALS.into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0);
    let mut signals = Signals::new(wanted).context("cannot install the signal handlers")?;
    std::thread::spawn(move || {
        let Some(signal) = signals.forever().next() else { return };
        stop(signal, advice);
    });
    Ok(())
}

/// Ends the process by a signal. A second thread that calls this waits until the process ends.
pub fn stop(signal: i32, advice: Option<&str>) -> ! {
    let _held = abandon();
    if let Some(advice) = advice {
        let mut stderr = std::io::stderr();
        // Overwrites a progress bar.
        let line_start = if stderr.is_terminal() { "\r\x1b[K" } else { "" };
        // If stderr is closed, the signal is the only report.
        let _ignored = writeln!(stderr, "{line_start}ortelius: stopped; {advice}");
    }
    // exit() would run the drivers' exit handlers while their threads still run.
    let _failed = emulate_default_handler(signal);
    std::process::abort()
}

/// Bit mask of ignored signals, as set by `nohup`; 0 without /proc.
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}
