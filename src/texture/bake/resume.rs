//! Resuming after a kill: the journal's entries are checked against the files.

use super::error::BakeError;
use super::journal::Job;
use super::scratch::{Scratch, payload_bytes, read_back};
use super::work::{Done, Work};
use rayon::prelude::*;
use std::num::NonZeroU64;
use xxhash_rust::xxh3::xxh3_64;

impl Work<'_> {
    /// Reads back the data of all journal entries and keeps those whose hashes match.
    pub fn take_over(
        &self,
        entries: &[(Job, u64)],
        scratch: Option<&Scratch>,
        done: &mut Done,
    ) -> Result<(), BakeError> {
        let pyramid = self.layout.pyramid();
        let payload = payload_bytes(&pyramid);
        let band_bytes = (self.plan.band_rows as usize * 4) << pyramid.width_log2();
        let size = |job| match job {
            Job::Band(_) => band_bytes,
            Job::Coarser(_) => payload,
            Job::Resident(level) => self.layout.resident_record_bytes(level as u32),
            Job::Tile(_) => self.layout.record_bytes(),
            Job::Complete => 0,
        };
        self.progress.begin("checking", entries.iter().map(|&(job, _)| size(job) as u64).sum());
        let check = |&(job, claimed): &(Job, u64)| -> Result<Option<(Job, NonZeroU64)>, BakeError> {
            let found = match (job, scratch) {
                (Job::Band(band), Some(scratch)) => {
                    let rows = self.plan.band_rows;
                    scratch.band_hash(band as u32 * rows, rows)?
                }
                (Job::Coarser(index), Some(scratch)) => scratch.payload_hash(self.layout.tile(index))?,
                (Job::Resident(level), _) => {
                    self.record_hash(self.layout.resident_offset(level as u32), size(job))?
                }
                (Job::Tile(index), _) => self.record_hash(self.layout.record_offset(index), size(job))?,
                _ => 0,
            };
            self.progress.advance(size(job) as u64);
            Ok(NonZeroU64::new(found).filter(|found| found.get() == claimed).map(|found| (job, found)))
        };
        // Bands are large, so check one at a time, not one per thread.
        let (bands, others): (Vec<_>, Vec<_>) =
            entries.iter().copied().partition(|(job, _)| matches!(job, Job::Band(_)));
        let mut found =
            bands.iter().map(check).filter_map(Result::transpose).collect::<Result<Vec<_>, _>>()?;
        found.par_extend(
            others.par_iter().map(check).filter_map(Result::transpose).collect::<Result<Vec<_>, _>>()?,
        );
        for (job, hash) in found {
            match job {
                Job::Band(band) => done.bands[band as usize] = Some(hash),
                Job::Coarser(index) => done.coarser[index as usize] = Some(hash),
                Job::Resident(level) => {
                    done.records[self.layout.resident_entry(level as u32) as usize] = Some(hash);
                }
                Job::Tile(index) => done.records[index as usize] = Some(hash),
                Job::Complete => {}
            }
        }
        Ok(())
    }

    fn record_hash(&self, offset: u64, length: usize) -> Result<u64, BakeError> {
        let mut bytes = vec![0; length];
        read_back(&self.partial, &self.files.partial, &mut bytes, offset)?;
        Ok(xxh3_64(&bytes))
    }
}
