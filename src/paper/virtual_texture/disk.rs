//! Injected disk faults: any texture can be read as if from a disk that is slow or fails. Frames must continue
//! meanwhile and recover afterwards.

use crate::math::pyramid::{Pyramid, TileId};
use crate::scene::settings;
use crate::texture::source::ruler::ruler_hash;
use crate::texture::source::{TileError, TileFormat, TileSource};
use std::collections::HashMap;
use std::sync::{Arc, Condvar, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

settings! {
    /// An injected disk fault, to test how frames behave with it.
    pub struct Disk with DEFAULT {
        /// Extra time for each tile read. At most one minute, because settling fails if no tile arrives for so long.
        delay_ms: f64 = 0.0, in 0.0..=60e3, unit "ms";
        /// Start of an outage of `fails_for_s`, in seconds after the first tile request.
        fails_from_s: f64 = 0.0, in 0.0..=1e6, unit "s";
        /// Length of the outage, in which no tile can be read.
        fails_for_s: f64 = 0.0, in 0.0..=1e6, unit "s";
        /// Share of reads that fail at random.
        fails_share: f64 = 0.0, in 0.0..=1.0;
        /// Seed of the random failures.
        seed: u32 = 0;
    }
}

/// A source with injected faults. The resident levels are read without faults: without them there is no picture.
pub struct FaultyDisk {
    whole: Arc<dyn TileSource>,
    faults: Disk,
    /// Time of the first read. The clock of the faults starts then, because opening a device may take longer than the
    /// outage.
    begun: OnceLock<Instant>,
    /// Number of reads of each tile so far. Each attempt fails or succeeds independently of the others.
    attempts: Mutex<HashMap<TileId, u32>>,
    /// True if reads no longer take their extra time.
    hurries: Mutex<bool>,
    hurried: Condvar,
}

impl FaultyDisk {
    /// The clock of the faults starts with the first read of a tile.
    pub fn new(whole: Arc<dyn TileSource>, faults: Disk) -> FaultyDisk {
        let (begun, attempts) = (OnceLock::new(), Mutex::default());
        FaultyDisk { whole, faults, begun, attempts, hurries: Mutex::default(), hurried: Condvar::new() }
    }

    /// Waits for the extra time of a read.
    fn delay(&self) {
        let hurries = self.hurries.lock().unwrap_or_else(PoisonError::into_inner);
        let delay = Duration::from_secs_f64(self.faults.delay_ms / 1e3);
        let waited = self.hurried.wait_timeout_while(hurries, delay, |hurries| !*hurries);
        drop(waited.unwrap_or_else(PoisonError::into_inner));
    }

    /// True during the outage.
    pub fn is_down(&self) -> bool {
        let elapsed_s = self.begun.get().map_or(0.0, |begun| begun.elapsed().as_secs_f64());
        let since_s = elapsed_s - self.faults.fails_from_s;
        (0.0..self.faults.fails_for_s).contains(&since_s)
    }

    /// True if this attempt fails. The n-th attempt at a tile has the same outcome in every run.
    fn draw(&self, tile: TileId) -> bool {
        let mut attempts = self.attempts.lock().unwrap_or_else(PoisonError::into_inner);
        let attempt = attempts.entry(tile).or_default();
        *attempt += 1;
        let place = ruler_hash(tile.level, tile.column, tile.row);
        let drawn = ruler_hash(self.faults.seed, place, *attempt);
        f64::from(drawn) < self.faults.fails_share * 2f64.powi(32)
    }
}

impl TileSource for FaultyDisk {
    fn describe(&self) -> String {
        let Disk { delay_ms, fails_from_s, fails_for_s, fails_share, .. } = self.faults;
        let mut faults = Vec::new();
        if delay_ms > 0.0 {
            faults.push(format!("takes {delay_ms} ms per tile"));
        }
        if fails_for_s > 0.0 {
            faults.push(format!("fails from {fails_from_s} s to {} s", fails_from_s + fails_for_s));
        }
        if fails_share > 0.0 {
            faults.push(format!("fails in {} % of reads", 100.0 * fails_share));
        }
        format!("{}; disk: {}", self.whole.describe(), faults.join(", "))
    }

    fn pyramid(&self) -> Pyramid {
        self.whole.pyramid()
    }

    fn format(&self) -> TileFormat {
        self.whole.format()
    }

    fn read_tile(&self, tile: TileId, bytes: &mut [u8]) -> Result<(), TileError> {
        self.begun.get_or_init(Instant::now);
        self.delay();
        if self.is_down() {
            return Err(TileError::Refused { tile, reason: "the disk is down (disk.fails_for_s)".into() });
        }
        if self.draw(tile) {
            return Err(TileError::Refused { tile, reason: "the disk fails here (disk.fails_share)".into() });
        }
        self.whole.read_tile(tile, bytes)
    }

    fn read_resident_level(&self, level: u32) -> Result<Vec<u8>, TileError> {
        self.whole.read_resident_level(level)
    }

    fn stop_waiting(&self) {
        *self.hurries.lock().unwrap_or_else(PoisonError::into_inner) = true;
        self.hurried.notify_all();
        self.whole.stop_waiting();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::source::ruler::Ruler;

    fn disk(faults: Disk) -> FaultyDisk {
        FaultyDisk::new(Arc::new(Ruler::new(Pyramid::new(9, 8, 4, 2, None).unwrap())), faults)
    }

    fn outcomes(disk: &FaultyDisk) -> Vec<bool> {
        let mut bytes = vec![0; disk.format().tile_bytes(&disk.pyramid())];
        let tiles = (0..16).flat_map(|row| (0..32).map(move |column| TileId { level: 0, row, column }));
        tiles.map(|tile| disk.read_tile(tile, &mut bytes).is_ok()).collect()
    }

    #[test]
    fn a_share_of_the_reads_fails_the_same_for_the_same_seed() {
        let faults = Disk { fails_share: 0.25, ..Disk::default() };
        let (one, other) = (disk(faults.clone()), disk(faults.clone()));
        let first = outcomes(&one);
        assert_eq!(first, outcomes(&other));
        assert_ne!(first, outcomes(&one), "the second attempt at a tile is independent of the first");
        assert_ne!(first, outcomes(&disk(Disk { seed: 1, ..faults })));
        // 512 reads that fail with a probability of 1/4: 128 failures are expected, with a standard deviation of 9.8. 5
        // standard deviations are 49.
        let failed = first.iter().filter(|ok| !**ok).count();
        assert!((79..=177).contains(&failed), "{failed} of 512 failed");
    }

    #[test]
    fn nothing_is_read_during_the_outage_and_everything_after_it() {
        let down = disk(Disk { fails_for_s: 1e6, ..Disk::default() });
        assert!(outcomes(&down).iter().all(|ok| !ok));
        let later = disk(Disk { fails_from_s: 1e6, fails_for_s: 1e6, ..Disk::default() });
        assert!(outcomes(&later).iter().all(|ok| *ok));
        // The delay of 1 ms is longer than the outage.
        let over = disk(Disk { delay_ms: 1.0, fails_for_s: 1e-9, ..Disk::default() });
        assert!(outcomes(&over).iter().all(|ok| *ok));
    }

    #[test]
    fn a_read_that_waits_ends_when_the_texture_is_closed() {
        // Otherwise the 512 reads take 8 hours.
        let slow = Arc::new(disk(Disk { delay_ms: 60e3, ..Disk::default() }));
        let reader = slow.clone();
        let read = std::thread::spawn(move || outcomes(&reader));
        slow.stop_waiting();
        assert!(read.join().unwrap().into_iter().all(|ok| ok), "tiles are read without the extra time");
    }

    #[test]
    fn a_slow_disk_adds_its_delay_and_delivers_the_same_bytes() {
        let slow = disk(Disk { delay_ms: 5.0, ..Disk::default() });
        let (mut late, mut at_once) = (vec![0; slow.format().tile_bytes(&slow.pyramid())], Vec::new());
        at_once.resize(late.len(), 0);
        let tile = TileId { level: 1, row: 2, column: 3 };
        let begin = Instant::now();
        slow.read_tile(tile, &mut late).unwrap();
        assert!(begin.elapsed() >= Duration::from_millis(5));
        slow.whole.read_tile(tile, &mut at_once).unwrap();
        assert_eq!(late, at_once);
    }
}
