//! `hashes.txt`: the driver of the recording, then a line for each view of each case.
//!
//! A picture's hash has the processor's vendor in its name: lavapipe's reciprocals are the processor's approximations,
//! whose last bits differ between AMD and Intel. Tile lists and index buffers are integers and equal on both.

use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

const DRIVER: &str = "# driver: ";

/// The first 16 bytes of a SHA-256, in hexadecimal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hash(pub String);

impl Hash {
    pub fn of_bytes(bytes: &[u8]) -> Hash {
        let digest = Sha256::digest(bytes);
        Hash(digest.iter().take(16).map(|byte| format!("{byte:02x}")).collect())
    }

    /// Hashes words as little-endian bytes on every machine.
    pub fn of_words(words: impl Iterator<Item = u32>) -> Hash {
        Hash::of_bytes(&words.flat_map(u32::to_le_bytes).collect::<Vec<u8>>())
    }
}

/// The name of a picture's hash on this machine, such as `picture@AuthenticAMD`.
pub fn picture_here() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let vendor =
        text.lines().find(|line| line.starts_with("vendor_id")).and_then(|line| line.split(": ").nth(1));
    format!("picture@{}", vendor.unwrap_or(std::env::consts::ARCH))
}

/// The hashes of one view of a case: `picture@PROCESSOR`, `tiles`, `list`, `faces`.
#[derive(Clone, Debug)]
pub struct Entry {
    pub name: String,
    pub hashes: Vec<(String, Hash)>,
}

/// Hashes by the case's name and the kind of hash.
pub type Hashes = BTreeMap<(String, String), Hash>;

/// A file's contents.
#[derive(Clone, Debug, PartialEq)]
pub struct Recorded {
    pub driver: String,
    pub hashes: Hashes,
}

/// # Panics
/// Two entries have the same name and kind.
pub fn collect(entries: &[Entry]) -> Hashes {
    let mut hashes = Hashes::new();
    for entry in entries {
        for (what, hash) in &entry.hashes {
            let before = hashes.insert((entry.name.clone(), what.clone()), hash.clone());
            assert!(before.is_none(), "{} has two {what}", entry.name);
        }
    }
    hashes
}

pub fn write(recorded: &Recorded) -> String {
    let mut text = format!("{DRIVER}{}\n", recorded.driver);
    let mut last = "";
    for ((name, what), Hash(hash)) in &recorded.hashes {
        match last == name {
            true => write!(text, " {what}:{hash}"),
            false => write!(text, "\n{name} {what}:{hash}"),
        }
        .expect("a String takes everything");
        last = name;
    }
    text.push('\n');
    text
}

/// # Panics
/// A line is not in the format of [`write`].
pub fn read(text: &str) -> Recorded {
    let mut lines = text.lines();
    let driver =
        lines.next().and_then(|line| line.strip_prefix(DRIVER)).expect("the first line names the driver");
    let mut hashes = Hashes::new();
    for line in lines.filter(|line| !line.is_empty()) {
        let mut words = line.split(' ');
        let name = words.next().expect("split gives one word");
        for word in words {
            let (what, hash) = word.split_once(':').unwrap_or_else(|| panic!("no hash in: {line}"));
            hashes.insert((name.to_owned(), what.to_owned()), Hash(hash.to_owned()));
        }
    }
    Recorded { driver: driver.to_owned(), hashes }
}

/// The record to write after a run that gave `found`. It has the hashes of `found`. It keeps the picture hashes of
/// other processors from `recorded` for cases of which nothing changed on this processor: neither the picture nor an
/// integer.
pub fn merged(recorded: &Recorded, found: &Recorded, picture: &str) -> Recorded {
    let is_comparable = |what: &str| !what.starts_with("picture@") || what == picture;
    let changed: BTreeSet<&str> = recorded
        .hashes
        .iter()
        .filter(|(key, old)| is_comparable(&key.1) && found.hashes.get(*key) != Some(*old))
        .map(|((name, _), _)| &**name)
        .collect();
    let mut hashes = found.hashes.clone();
    for (key @ (name, what), hash) in &recorded.hashes {
        let here = (name.clone(), picture.to_owned());
        if !is_comparable(what) && !changed.contains(&**name) && found.hashes.contains_key(&here) {
            hashes.insert(key.clone(), hash.clone());
        }
    }
    Recorded { driver: found.driver.clone(), hashes }
}

/// A line for each hash that is missing, additional or different. On another driver only index buffers are compared. A
/// picture that is recorded only on other processors is not compared. `picture` is [`picture_here`].
pub fn differences(recorded: &Recorded, found: &Recorded, picture: &str) -> Vec<String> {
    let same_driver = recorded.driver == found.driver;
    let is_of_this_processor = |what: &str| !what.starts_with("picture@") || what == picture;
    let mut lines = Vec::new();
    for (key @ (name, what), hash) in
        recorded.hashes.iter().filter(|((_, what), _)| is_of_this_processor(what))
    {
        match found.hashes.get(key) {
            None => lines.push(format!("{name}: {what} is recorded, and was not rendered")),
            Some(other) if other != hash && (same_driver || what == "faces") => {
                lines.push(format!("{name}: {what} differs"));
            }
            Some(_) => {}
        }
    }
    // A picture without a record on this processor is new, unless another processor has one.
    let known: BTreeSet<&str> = recorded
        .hashes
        .keys()
        .filter(|(_, what)| what.starts_with("picture@"))
        .map(|(name, _)| &**name)
        .collect();
    let unknown = found.hashes.keys().filter(|key| !recorded.hashes.contains_key(*key));
    let unknown = unknown.filter(|(name, what)| what != picture || (same_driver && !known.contains(&**name)));
    lines.extend(unknown.map(|(name, what)| format!("{name}: {what} is not recorded")));
    lines
}
