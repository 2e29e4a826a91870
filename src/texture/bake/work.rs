//! The jobs of a bake, in order. A job is skipped if the journal lists it and its output is still intact.

use super::encode::bc1_tile;
use super::error::{BakeError, SourceError};
use super::journal::{Job, Journal};
use super::plan::BakePlan;
use super::resample::Enlarged;
use super::scratch::{Scratch, mean_square, payload_bytes};
use super::source::{Source, synthetic};
use super::{BakeProgress, BakeSettings, Files};
use crate::math::pyramid::TileId;
use crate::texture::coarser::coarser;
use crate::texture::source::{TileFormat, TileSource};
use crate::texture::tiles::{FileLayout, TileFile, index_page};
use rayon::prelude::*;
use std::fs::{self, File, OpenOptions};
use std::io;
use std::num::NonZeroU64;
use std::os::unix::fs::FileExt;
use std::path::Path;
use xxhash_rust::xxh3::xxh3_64;

/// A bake in progress.
pub(super) struct Work<'a> {
    pub layout: FileLayout,
    pub plan: &'a BakePlan,
    pub files: &'a Files,
    journal: Journal,
    pub partial: File,
    pub progress: &'a dyn BakeProgress,
}

/// Jobs that both journal and files confirm, by job number, with the hash of their output. (A hash of 0
/// counts as missing; that job is repeated.)
pub(super) struct Done {
    pub bands: Vec<Option<NonZeroU64>>,
    pub coarser: Vec<Option<NonZeroU64>>,
    /// Records, in the order of the output's index.
    pub records: Vec<Option<NonZeroU64>>,
}

impl Done {
    pub fn nothing(layout: &FileLayout, bands: usize) -> Self {
        Self {
            bands: vec![None; bands],
            coarser: vec![None; layout.pyramid().tile_count() as usize],
            records: vec![None; layout.entry_count() as usize],
        }
    }
}

/// The whole bake, from an opened source to the finished file.
pub(super) fn run(
    settings: &BakeSettings,
    plan: &BakePlan,
    source: Source,
    files: &Files,
    progress: &dyn BakeProgress,
) -> Result<(), BakeError> {
    let layout = plan.layout;
    if files.output.exists() && !settings.force && !files.journal.exists() {
        return Err(BakeError::Exists { path: files.output.clone() });
    }
    let identity = identity_text(plan, &source);
    let (journal, entries) = Journal::open(&files.journal, &identity, settings.force, layout.total_bytes())?;
    if files.output.exists() {
        let renamed = entries.contains(&(Job::Complete, 0)) && !files.partial.exists();
        if renamed && TileFile::open(&files.output).is_ok_and(|file| *file.layout() == layout) {
            // Killed after the rename, before the cleanup.
            return tidy(files);
        }
        if !settings.force {
            if entries.is_empty() {
                remove(&files.journal)?;
            }
            return Err(BakeError::Exists { path: files.output.clone() });
        }
    }
    if entries.is_empty() {
        // Discard files without a journal: nothing proves their content.
        remove(&files.partial)?;
        remove(&files.scratch)?;
    }
    let opened = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&files.partial);
    let write_error = |source| BakeError::write(files.partial.clone(), 0, layout.total_bytes(), source);
    let partial = opened.map_err(write_error)?;
    let work = Work { layout, plan, files, journal, partial, progress };
    let finished = work.do_all(settings, source, &entries);
    if let Err(BakeError::Source(error)) = &finished
        && error.is_permanent()
    {
        // None of these files can be reused.
        for file in [&files.partial, &files.scratch, &files.journal] {
            remove(file)?;
        }
    }
    finished
}

/// Everything that determines the output's bytes.
fn identity_text(plan: &BakePlan, source: &Source) -> String {
    format!(
        "ortelius {}, {:?}, bands of {}, from {}",
        env!("CARGO_PKG_VERSION"),
        plan.layout,
        plan.band_rows,
        source.identity_text()
    )
}

fn remove(path: &Path) -> Result<(), BakeError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(BakeError::Write { path: path.to_path_buf(), offset: 0, source: error })
        }
        _ => Ok(()),
    }
}

/// Deletes the journal last: without it, the other files could not be identified.
fn tidy(files: &Files) -> Result<(), BakeError> {
    remove(&files.scratch)?;
    remove(&files.journal)
}

impl Work<'_> {
    fn do_all(
        &self,
        settings: &BakeSettings,
        source: Source,
        entries: &[(Job, u64)],
    ) -> Result<(), BakeError> {
        let mut done = Done::nothing(&self.layout, self.band_count());
        let scratch = match &source {
            Source::Synthetic(_) => None,
            Source::Picture { .. } => Some(Scratch::open(&self.files.scratch, self.layout.pyramid())?),
        };
        if !entries.is_empty() {
            tracing::info!(
                "{}: resuming; {} jobs are already done",
                self.files.output.display(),
                entries.len()
            );
            self.take_over(entries, scratch.as_ref(), &mut done)?;
        }
        match (source, scratch) {
            (Source::Picture { rows, path, identity }, Some(mut scratch)) => {
                if done.records.contains(&None) {
                    let level_0 = Enlarged::new(rows, self.layout.pyramid().level_size(0));
                    self.write_bands(level_0, &scratch, &done)?;
                    if !identity.still_holds(&path) {
                        return Err(SourceError::Changed { path }.into());
                    }
                    self.write_coarser(&scratch, &done)?;
                    self.write_resident_means(&mut scratch, &mut done)?;
                    self.write_tiles(&scratch, &mut done)?;
                }
            }
            (Source::Synthetic(_), _) => {
                let source = synthetic(&settings.source, self.layout.pyramid())?;
                self.write_resident(source.as_ref(), &mut done)?;
                self.write_tiles(source.as_ref(), &mut done)?;
            }
            (Source::Picture { path, .. }, None) => unreachable!("{} has no scratch file", path.display()),
        }
        self.finish(&done)
    }

    fn band_count(&self) -> usize {
        let rows = self.layout.pyramid().level_size(0)[1];
        rows.div_ceil(self.plan.band_rows) as usize
    }

    fn write_bands(&self, mut level_0: Enlarged, scratch: &Scratch, done: &Done) -> Result<(), BakeError> {
        let row_bytes = 4usize << self.layout.pyramid().width_log2();
        let rows = self.plan.band_rows as usize;
        let missing = done.bands.iter().filter(|band| band.is_none()).count();
        self.progress.begin("bands", (missing * rows * row_bytes) as u64);
        let mut rgba = vec![0; rows * row_bytes];
        for (band, _) in done.bands.iter().enumerate().filter(|(_, band)| band.is_none()) {
            let top = (band * rows) as u32;
            level_0.read(top, &mut rgba)?;
            scratch.write_band(top, &rgba)?;
            self.note(Job::Band(band as u64), xxh3_64(&rgba))?;
            self.progress.advance(rgba.len() as u64);
        }
        Ok(())
    }

    fn note(&self, job: Job, hash: u64) -> Result<(), BakeError> {
        self.journal.append(job, hash, self.layout.total_bytes())
    }

    /// Writes level 1 and all coarser levels of the scratch file, one after another.
    fn write_coarser(&self, scratch: &Scratch, done: &Done) -> Result<(), BakeError> {
        let pyramid = self.layout.pyramid();
        let payload = payload_bytes(&pyramid);
        let level_0_tiles: u64 = pyramid.tile_grid(0).map(u64::from).iter().product();
        let missing = done.coarser[level_0_tiles as usize..].iter().filter(|tile| tile.is_none()).count();
        self.progress.begin("levels", (missing * payload) as u64);
        let mut start = level_0_tiles;
        for level in 1..pyramid.first_resident_level() {
            let count: u64 = pyramid.tile_grid(level).map(u64::from).iter().product();
            (start..start + count)
                .into_par_iter()
                .filter(|&index| done.coarser[index as usize].is_none())
                .try_for_each_init(
                    || (vec![0; payload], vec![0; payload]),
                    |(finer, bytes), index| {
                        let tile = self.layout.tile(index);
                        scratch.mean_payload(tile, finer, bytes)?;
                        scratch.write_payload(tile, bytes)?;
                        self.note(Job::Coarser(index), xxh3_64(bytes))?;
                        self.progress.advance(payload as u64);
                        Ok::<(), BakeError>(())
                    },
                )?;
            start += count;
        }
        Ok(())
    }

    /// Computes the resident levels as means of four texels. The finest one is kept in `scratch` for the coarsest
    /// tiles.
    fn write_resident_means(&self, scratch: &mut Scratch, done: &mut Done) -> Result<(), BakeError> {
        let pyramid = self.layout.pyramid();
        let side = pyramid.tile_size() as usize;
        let first = pyramid.first_resident_level();
        let mut level = vec![0; self.layout.resident_bytes(first)];
        let wide = pyramid.level_size(first)[0] as usize;
        let [columns, _] = pyramid.tile_grid(first - 1);
        // Each row of tiles fills whole texel rows of `level`, so the parallel chunks are disjoint.
        level.par_chunks_mut(wide * side / 2 * 4).enumerate().try_for_each_init(
            || vec![0; payload_bytes(&pyramid)],
            |payload, (row, out)| {
                (0..columns).try_for_each(|column| {
                    scratch.read_payload(TileId { level: first - 1, row: row as u32, column }, payload)?;
                    mean_square(payload, side, out, wide, [column as usize * side / 2, 0]);
                    Ok::<(), BakeError>(())
                })
            },
        )?;
        scratch.first_resident = level.clone();
        for number in first..=pyramid.coarsest_level() {
            if number > first {
                level = coarser(level.as_chunks::<4>().0, pyramid.level_size(number - 1)).into_flattened();
            }
            self.write_resident_level(number, &level, done)?;
        }
        Ok(())
    }

    fn write_resident(&self, source: &dyn TileSource, done: &mut Done) -> Result<(), BakeError> {
        let pyramid = self.layout.pyramid();
        for level in pyramid.first_resident_level()..=pyramid.coarsest_level() {
            self.write_resident_level(level, &source.read_resident_level(level)?, done)?;
        }
        Ok(())
    }

    fn write_resident_level(&self, level: u32, bytes: &[u8], done: &mut Done) -> Result<(), BakeError> {
        let entry = self.layout.resident_entry(level) as usize;
        if done.records[entry].is_none() {
            let mut record = bytes.to_vec();
            record.resize(self.layout.resident_record_bytes(level), 0);
            let hash = xxh3_64(&record);
            self.write(&record, self.layout.resident_offset(level))?;
            self.note(Job::Resident(u64::from(level)), hash)?;
            done.records[entry] = NonZeroU64::new(hash);
        }
        Ok(())
    }

    fn write_tiles(&self, source: &dyn TileSource, done: &mut Done) -> Result<(), BakeError> {
        let pyramid = self.layout.pyramid();
        let tiles = pyramid.tile_count() as usize;
        let record_bytes = self.layout.record_bytes();
        let missing = done.records[..tiles].iter().filter(|tile| tile.is_none()).count();
        self.progress.begin("tiles", (missing * record_bytes) as u64);
        done.records[..tiles].par_iter_mut().enumerate().filter(|(_, hash)| hash.is_none()).try_for_each_init(
            || (vec![0; pyramid.tile_bytes_rgba8()], vec![0; record_bytes]),
            |(rgba, record), (index, hash)| {
                source.read_tile(self.layout.tile(index as u64), rgba)?;
                self.encode(rgba, &mut record[..self.layout.tile_bytes()]);
                *hash = NonZeroU64::new(xxh3_64(record));
                self.write(record, self.layout.record_offset(index as u64))?;
                self.note(Job::Tile(index as u64), hash.map_or(0, NonZeroU64::get))?;
                self.progress.advance(record_bytes as u64);
                Ok(())
            },
        )
    }

    fn encode(&self, rgba: &[u8], bytes: &mut [u8]) {
        match self.layout.format() {
            TileFormat::Rgba8 => bytes.copy_from_slice(rgba),
            TileFormat::Bc1 => bc1_tile(&self.layout.pyramid(), rgba, bytes),
        }
    }

    fn write(&self, bytes: &[u8], offset: u64) -> Result<(), BakeError> {
        self.partial.write_all_at(bytes, offset).map_err(|source| {
            BakeError::write(self.files.partial.clone(), offset, self.layout.total_bytes(), source)
        })
    }

    /// Writes index and header, then renames: the file appears only when it is complete.
    fn finish(&self, done: &Done) -> Result<(), BakeError> {
        let entries: Vec<u64> = done.records.iter().map(|hash| hash.map_or(0, NonZeroU64::get)).collect();
        self.write(&index_page(&self.layout, &entries), self.layout.index_offset())?;
        self.write(&self.layout.header_page(), 0)?;
        let failed =
            |source| BakeError::write(self.files.partial.clone(), 0, self.layout.total_bytes(), source);
        self.partial.sync_all().map_err(failed)?;
        self.note(Job::Complete, 0)?;
        self.journal.sync().map_err(failed)?;
        TileFile::open(&self.files.partial)?;
        fs::rename(&self.files.partial, &self.files.output).map_err(failed)?;
        File::open(&self.files.folder).and_then(|folder| folder.sync_all()).map_err(failed)?;
        tidy(self.files)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::bake::input::RowReader;
    use crate::texture::bake::{SourceName, bake, plan};
    use std::sync::Mutex;

    /// A kill after the rename and before the cleanup: tests/bake hardly ever hits this moment.
    #[test]
    fn a_bake_killed_after_the_rename_only_tidies_up() {
        let folder = tempfile::tempdir().unwrap();
        let settings = BakeSettings {
            source: SourceName::Ruler(6),
            output: folder.path().join("a.tiles"),
            tile_side: 32,
            border_texels: 4,
            format: TileFormat::Rgba8,
            resident_levels: None,
            force: false,
        };
        let plan = bake(&settings, &()).unwrap();
        let baked = fs::read(&settings.output).unwrap();
        let files = Files::of(&settings.output).unwrap();
        let identity = identity_text(&plan, &Source::open(&settings.source).unwrap());
        let (journal, _) = Journal::open(&files.journal, &identity, false, 0).unwrap();
        journal.append(Job::Complete, 0, 0).unwrap();
        drop(journal);
        fs::write(&files.scratch, "left").unwrap();
        bake(&settings, &()).unwrap();
        assert_eq!(fs::read(&settings.output).unwrap(), baked);
        assert!(!files.journal.exists() && !files.scratch.exists() && !files.partial.exists());
        // With no leftovers, the same command is a second bake, and the output already exists.
        assert!(matches!(bake(&settings, &()), Err(BakeError::Exists { .. })));
        assert!(!files.journal.exists());
    }
    /// A picture that fails at its 41st row.
    struct Failing(Box<dyn RowReader>, u32, Option<SourceError>);

    impl RowReader for Failing {
        fn size(&self) -> [u32; 2] {
            self.0.size()
        }

        fn memory_bytes(&self) -> u64 {
            self.0.memory_bytes()
        }

        fn next_row(&mut self, rgba: &mut [u8]) -> Result<(), SourceError> {
            self.1 += 1;
            if self.1 > 40 { Err(self.2.take().expect("one error")) } else { self.0.next_row(rgba) }
        }

        fn skip(&mut self, rows: u32) -> Result<(), SourceError> {
            self.1 += rows;
            self.0.skip(rows)
        }
    }

    /// The bytes of the bands that are written.
    struct Bands(Mutex<u64>);

    impl BakeProgress for Bands {
        fn begin(&self, phase: &'static str, total_bytes: u64) {
            if phase == "bands" {
                *self.0.lock().unwrap() += total_bytes;
            }
        }

        fn advance(&self, _bytes: u64) {}
    }

    #[test]
    fn a_read_error_keeps_the_unfinished_work_and_damage_deletes_it() {
        let folder = tempfile::tempdir().unwrap();
        let picture = folder.path().join("a.png");
        let texel = |x, y| image::Rgb([x as u8, y as u8, (x * y) as u8]);
        image::RgbImage::from_fn(64, 64, texel).save(&picture).unwrap();
        let settings = |name: &str| BakeSettings {
            source: SourceName::Picture(picture.clone()),
            output: folder.path().join(name),
            tile_side: 16,
            border_texels: 4,
            format: TileFormat::Rgba8,
            resident_levels: None,
            force: false,
        };
        let fails = |settings: &BakeSettings, error: SourceError| {
            let Source::Picture { rows, path, identity } = Source::open(&settings.source).unwrap() else {
                panic!("a picture");
            };
            let source = Source::Picture { rows: Box::new(Failing(rows, 0, Some(error))), path, identity };
            let files = Files::of(&settings.output).unwrap();
            run(settings, &plan(settings).unwrap(), source, &files, &()).unwrap_err();
            [files.partial, files.scratch, files.journal].map(|file| file.exists())
        };
        let (undisturbed, resumed) = (settings("undisturbed.tiles"), settings("resumed.tiles"));
        bake(&undisturbed, &()).unwrap();
        let source = io::Error::from_raw_os_error(libc::EIO);
        assert_eq!(fails(&resumed, SourceError::Read { path: picture.clone(), source }), [true; 3]);
        let bands = Bands(Mutex::new(0));
        bake(&resumed, &bands).unwrap();
        assert!(fs::read(&resumed.output).unwrap() == fs::read(&undisturbed.output).unwrap());
        // Of four bands of 16 rows, two were written before the error.
        assert_eq!(bands.0.into_inner().unwrap(), 2 * 16 * 64 * 4);
        let damaged = SourceError::Damaged { path: picture.clone(), reason: "cut".into() };
        assert_eq!(fails(&settings("damaged.tiles"), damaged), [false; 3]);
    }
}
