//! Description of the machine that measures.

use super::Machine;
use crate::vk::PhysicalDevice;
use std::time::{SystemTime, UNIX_EPOCH};
use xxhash_rust::xxh3::xxh3_64;

impl Machine {
    /// This machine with one of its devices, dated today.
    pub fn here(physical: &PhysicalDevice) -> Machine {
        let (major, minor, patch) = physical.api;
        let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
        Machine {
            device: physical.name.clone(),
            device_kind: physical.kind.to_string(),
            driver: physical.driver.clone(),
            vulkan: format!("{major}.{minor}.{patch}"),
            processor: processor(),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            commit: env!("ORTELIUS_COMMIT").to_string(),
            date: day(seconds / 86_400),
        }
    }

    /// True for the same machine and program; the date is ignored.
    pub fn is_same(&self, other: &Machine) -> bool {
        Machine { date: other.date.clone(), ..self.clone() } == *other
    }
}

/// Identifies a build among others of the same commit: XXH3 (64 bits, hexadecimal) of the executable; "unknown" if the
/// executable cannot be read.
pub fn program() -> String {
    let bytes = std::env::current_exe().and_then(std::fs::read);
    bytes.map_or("unknown".to_string(), |bytes| format!("{:016x}", xxh3_64(&bytes)))
}

/// Mean number of running or waiting processes in the last minute; `None` unless the system reports it
/// (Linux does).
pub fn load() -> Option<f64> {
    std::fs::read_to_string("/proc/loadavg").ok()?.split(' ').next()?.parse().ok()
}

/// Peak resident memory of this process in bytes; `None` unless the system reports it (Linux does).
pub fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

/// The processor's name (Linux), else the architecture.
fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    processor_in(&text).unwrap_or_else(|| std::env::consts::ARCH.to_string())
}

/// The name of the first processor in the text of /proc/cpuinfo.
fn processor_in(text: &str) -> Option<String> {
    let value = |key: &str| {
        let mut lines = text.lines().filter_map(|line| line.split_once(':'));
        Some(lines.find(|(found, _)| found.trim() == key)?.1.trim()).filter(|value| !value.is_empty())
    };
    // "model name" on x86, "Model" on some ARM boards; other processors report only numbers.
    let name = value("model name").or_else(|| value("Model"))?;
    // A virtual machine shortens the name, for example to "AMD EPYC", which says nothing of the generation.
    let numbers = value("cpu family").zip(value("model"));
    Some(numbers.map_or(name.into(), |(family, model)| format!("{name} (family {family}, model {model})")))
}

/// Converts days since 1970-01-01 to a date such as 2026-11-21 (`civil_from_days` of H. Hinnant,
/// "chrono-compatible low-level date algorithms"). Years start in March, so that the leap day is the last
/// day.
fn day(since_1970: u64) -> String {
    let days = since_1970 + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year + year / 4 - year / 100);
    let march_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * march_month + 2) / 5 + 1;
    let month = if march_month < 10 { march_month + 3 } else { march_month - 9 };
    let year = era * 400 + year + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}")
}

/// First twelve digits of a commit, with its mark of uncommitted changes.
pub fn short_commit(commit: &str) -> String {
    let (digits, mark) = commit.split_at(commit.find('+').unwrap_or(commit.len()));
    digits.chars().take(12).chain(mark.chars()).collect()
}

#[cfg(test)]
mod tests {
    use super::{day, peak_memory, processor_in, short_commit};

    #[test]
    fn a_short_commit_keeps_the_mark_of_changes() {
        let long = "0123456789abcdef0123456789abcdef01234567";
        assert_eq!(short_commit(long), "0123456789ab");
        assert_eq!(short_commit(&format!("{long}+changes")), "0123456789ab+changes");
        assert_eq!(short_commit("unknown"), "unknown");
    }

    #[test]
    fn a_processor_is_named_with_its_generation() {
        let of = |text: &str| processor_in(text);
        let x86 = "vendor_id\t: AuthenticAMD\ncpu family\t: 25\nmodel\t\t: 1\nmodel name\t: AMD EPYC\n";
        assert_eq!(of(x86).as_deref(), Some("AMD EPYC (family 25, model 1)"));
        assert_eq!(of("processor\t: 0\nModel\t\t: a board\n").as_deref(), Some("a board"));
        assert_eq!(of("model name\t:\nprocessor\t: 0\n"), None);
        assert_eq!(of(""), None);
    }

    #[test]
    fn peak_memory_includes_freed_memory() {
        // Without Linux's /proc there is nothing to test.
        let Some(before) = peak_memory() else { return };
        let bytes = 64 << 20;
        assert!(std::hint::black_box(vec![1_u8; bytes]).iter().all(|&byte| byte == 1));
        let max = peak_memory().unwrap();
        assert!(max >= before.max(bytes as u64), "{max} bytes after {before} and {bytes}");
    }

    #[test]
    fn days_match_the_calendar() {
        for (days, date) in [
            (0, "1970-01-01"),
            (58, "1970-02-28"),
            (59, "1970-03-01"),
            (11_016, "2000-02-29"),
            (11_017, "2000-03-01"),
            (20_778, "2026-11-21"),
            (47_540, "2100-02-28"),
            (47_541, "2100-03-01"),
        ] {
            assert_eq!(day(days), date);
        }
    }
}
