//! The journal of a bake: lists finished jobs, so that a killed bake can resume.
//!
//! The file is append-only. An entry has 24 bytes: the job, the xxh3 of the job's output, and the xxh3 of these two.
//! It is written after its data; an incomplete last entry is cut off. On resuming, the data of every entry is read
//! back and its hash compared, so neither a kill nor a power failure can leave a job half done.

use super::error::BakeError;
use std::fs::{File, Metadata, OpenOptions, TryLockError};
use std::io::{self, BufReader, Read};
use std::os::unix::fs::{FileExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};
use xxhash_rust::xxh3::{xxh3_64_with_seed, xxh3_128};

const MAGIC: [u8; 16] = *b"ortelius journal";
const HEADER_BYTES: u64 = 32;
const ENTRY_BYTES: usize = 24;

/// One job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Job {
    /// A band of rows of level 0, written to the scratch file.
    Band(u64),
    /// A tile of a coarser level, by index, written to the scratch file.
    Coarser(u64),
    /// A resident level's record, written to the output.
    Resident(u64),
    /// A tile's record, by index, written to the output.
    Tile(u64),
    /// All records, index and header of the output are on disk.
    Complete,
}

impl Job {
    fn to_bits(self) -> u64 {
        let (kind, number) = match self {
            Self::Band(number) => (1, number),
            Self::Coarser(number) => (2, number),
            Self::Resident(number) => (3, number),
            Self::Tile(number) => (4, number),
            Self::Complete => (5, 0),
        };
        kind << 56 | number
    }

    fn from_bits(bits: u64) -> Option<Self> {
        let number = bits & ((1 << 56) - 1);
        Some(match bits >> 56 {
            1 => Self::Band(number),
            2 => Self::Coarser(number),
            3 => Self::Resident(number),
            4 => Self::Tile(number),
            5 => Self::Complete,
            _ => return None,
        })
    }
}

/// An open journal, locked against other processes until it is dropped.
pub(super) struct Journal {
    path: PathBuf,
    seed: u64,
    end: Mutex<(File, u64)>,
}

/// How long to wait for the lock. The system may release the lock of a killed bake only after that bake's parent has
/// continued.
const PATIENCE: Duration = Duration::from_secs(3);

/// Locks out other bakes for as long as `file` is open.
fn lock(file: &File) -> Result<(), TryLockError> {
    let start = Instant::now();
    let mut locked = file.try_lock();
    while matches!(locked, Err(TryLockError::WouldBlock)) && start.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(20));
        locked = file.try_lock();
    }
    match locked {
        // A file system without locks: nothing can prevent two concurrent bakes.
        Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => Ok(()),
        Err(error) => Err(error),
        Ok(()) => Ok(()),
    }
}

/// Opens or creates the file at `path` and locks it. Another bake may end during the wait for its lock, and delete its
/// file. Then `path` is opened or created again.
fn open_locked(path: &Path) -> Result<File, TryLockError> {
    loop {
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path);
        let file = file.map_err(TryLockError::Error)?;
        lock(&file)?;
        if is_at(&file, path) {
            return Ok(file);
        }
    }
}

/// True if `path` names this file.
fn is_at(file: &File, path: &Path) -> bool {
    let of = |about: io::Result<Metadata>| about.map(|about| (about.dev(), about.ino())).ok();
    of(file.metadata()) == of(path.metadata())
}

impl Journal {
    /// Opens or creates the journal of the bake that `identity` fully describes, and returns its entries.
    /// With `force`, another bake's journal is emptied.
    ///
    /// # Errors
    /// [`BakeError::OtherBake`], [`BakeError::Busy`], or an I/O error.
    pub fn open(
        path: &Path,
        identity: &str,
        force: bool,
        needed: u64,
    ) -> Result<(Self, Vec<(Job, u64)>), BakeError> {
        let failed = |source| BakeError::write(path.to_path_buf(), 0, needed, source);
        let file = open_locked(path).map_err(|error| match error {
            TryLockError::WouldBlock => BakeError::Busy { path: path.to_path_buf() },
            TryLockError::Error(error) => failed(error),
        })?;
        let key = xxh3_128(identity.as_bytes());
        let mut header = [0; HEADER_BYTES as usize];
        header[..16].copy_from_slice(&MAGIC);
        header[16..].copy_from_slice(&key.to_le_bytes());
        // Any 64 of the 128 bits suffice: the seed only rejects entries of other journals.
        let seed = key as u64;

        let mut found = Vec::new();
        (&file).take(HEADER_BYTES).read_to_end(&mut found).map_err(failed)?;
        let mut entries = Vec::new();
        if found == header {
            entries = read_entries(&file, seed).map_err(failed)?;
        } else if found.len() == HEADER_BYTES as usize && !force {
            return Err(BakeError::OtherBake { path: path.to_path_buf() });
        }
        let end = HEADER_BYTES + (entries.len() * ENTRY_BYTES) as u64;
        if entries.is_empty() {
            // Killed before the header was complete, or forced: start over.
            file.set_len(0).map_err(failed)?;
            file.write_all_at(&header, 0).map_err(failed)?;
        }
        file.set_len(end).map_err(failed)?;
        Ok((Self { path: path.to_path_buf(), seed, end: Mutex::new((file, end)) }, entries))
    }

    /// Records that a job is done. Called from several threads.
    ///
    /// # Errors
    /// [`BakeError::Full`] or [`BakeError::Write`].
    pub fn append(&self, job: Job, hash: u64, needed: u64) -> Result<(), BakeError> {
        let mut entry = [0; ENTRY_BYTES];
        entry[..8].copy_from_slice(&job.to_bits().to_le_bytes());
        entry[8..16].copy_from_slice(&hash.to_le_bytes());
        let check = xxh3_64_with_seed(&entry[..16], self.seed);
        entry[16..].copy_from_slice(&check.to_le_bytes());
        // A panicking thread reports its own message; the journal still ends with whole entries.
        let mut end = self.end.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let (file, at) = &mut *end;
        file.write_all_at(&entry, *at)
            .map_err(|source| BakeError::write(self.path.clone(), *at, needed, source))?;
        *at += ENTRY_BYTES as u64;
        Ok(())
    }

    /// Flushes the file to disk.
    pub fn sync(&self) -> io::Result<()> {
        let end = self.end.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        end.0.sync_all()
    }
}

/// The valid entries from the file's position on, up to the first incomplete or damaged one.
fn read_entries(file: &File, seed: u64) -> io::Result<Vec<(Job, u64)>> {
    let mut reader = BufReader::new(file);
    let mut entries = Vec::new();
    let mut entry = [0; ENTRY_BYTES];
    loop {
        match reader.read_exact(&mut entry) {
            Ok(()) => {}
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(entries),
            Err(error) => return Err(error),
        }
        let [job, hash, check] = [0, 8, 16].map(|at| {
            let mut bytes = [0; 8];
            bytes.copy_from_slice(&entry[at..at + 8]);
            u64::from_le_bytes(bytes)
        });
        match Job::from_bits(job) {
            Some(job) if check == xxh3_64_with_seed(&entry[..16], seed) => entries.push((job, hash)),
            _ => return Ok(entries),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    const ENTRIES: [(Job, u64); 5] = [
        (Job::Band(0), 7),
        (Job::Coarser(9), 8),
        (Job::Resident(10), 9),
        (Job::Tile(1 << 26), 1),
        (Job::Complete, 0),
    ];

    fn filled(path: &Path) {
        let (journal, found) = Journal::open(path, "this bake", false, 0).unwrap();
        assert!(found.is_empty());
        for (job, hash) in ENTRIES {
            journal.append(job, hash, 0).unwrap();
        }
        journal.sync().unwrap();
    }

    #[test]
    fn whole_entries_survive_a_journal_cut_anywhere() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        filled(&path);
        let whole = fs::read(&path).unwrap();
        for length in 0..=whole.len() {
            fs::write(&path, &whole[..length]).unwrap();
            let (journal, found) = Journal::open(&path, "this bake", false, 0).unwrap();
            let entries = length.saturating_sub(32) / 24;
            assert_eq!(found, ENTRIES[..entries], "cut to {length}");
            // New entries follow the last whole entry.
            journal.append(Job::Tile(3), 4, 0).unwrap();
            drop(journal);
            let (_journal, found) = Journal::open(&path, "this bake", false, 0).unwrap();
            assert_eq!(found.len(), entries + 1);
            assert_eq!(found[entries], (Job::Tile(3), 4));
        }
    }

    #[test]
    fn a_flipped_byte_ends_the_list_before_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        filled(&path);
        let whole = fs::read(&path).unwrap();
        for at in 32..whole.len() {
            let mut flipped = whole.clone();
            flipped[at] ^= 0x10;
            fs::write(&path, &flipped).unwrap();
            let (_journal, found) = Journal::open(&path, "this bake", false, 0).unwrap();
            assert_eq!(found, ENTRIES[..(at - 32) / 24], "byte {at}");
        }
    }

    #[test]
    fn another_bakes_journal_is_refused_unless_forced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        filled(&path);
        let refused = Journal::open(&path, "that bake", false, 0);
        assert!(matches!(refused, Err(BakeError::OtherBake { .. })));
        let (_journal, found) = Journal::open(&path, "that bake", true, 0).unwrap();
        assert!(found.is_empty());
    }

    #[test]
    fn a_bake_that_ends_while_another_waits_leaves_the_journal_to_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let (first, _) = Journal::open(&path, "this bake", false, 0).unwrap();
        std::thread::scope(|threads| {
            let second = threads.spawn(|| Journal::open(&path, "this bake", false, 0));
            // Whether or not the other thread has opened the old file by now, it must lock the new one.
            std::thread::sleep(Duration::from_millis(200));
            fs::remove_file(&path).unwrap();
            drop(first);
            let (_second, entries) = second.join().unwrap().unwrap();
            assert!(path.exists() && entries.is_empty());
            assert!(matches!(Journal::open(&path, "this bake", false, 0), Err(BakeError::Busy { .. })));
        });
    }

    #[test]
    fn a_journal_in_use_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let _journal = Journal::open(&path, "this bake", false, 0).unwrap();
        assert!(matches!(Journal::open(&path, "this bake", false, 0), Err(BakeError::Busy { .. })));
    }
}
