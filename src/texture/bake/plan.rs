//! The plan of a bake: its output sizes and its memory and disk use.

use super::error::BakeError;
use super::resample::Enlarged;
use super::source::{Source, SourceName};
use super::{BakeSettings, scratch};
use crate::math::pyramid::Pyramid;
use crate::texture::source::TileFormat;
use crate::texture::tiles::FileLayout;
use std::fmt;

/// Maximum size of a band of level 0. A band has at least one row, even if the row is larger.
const BAND_BYTES: u64 = 32 << 20;
/// The program, its threads' stacks and the allocator's overhead: measured 4-12 MiB.
const PROGRAM_BYTES: u64 = 32 << 20;
/// Memory for the Earth's base picture: decoding it (44 MB), its levels (34 MB) and computing the noise strength. 105
/// MiB measured.
const EARTH_BYTES: u64 = 144 << 20;

/// Sizes of a bake.
#[derive(Clone, Debug)]
pub struct BakePlan {
    pub source_name: String,
    /// Width and height of the source in texels.
    pub source_size: [u32; 2],
    pub layout: FileLayout,
    /// Rows of level 0 that are read and written together.
    pub band_rows: u32,
    /// Bytes of the scratch file; 0 for synthetic sources.
    pub scratch_bytes: u64,
    /// Upper bound of the memory held at any time.
    pub memory_bytes: u64,
}

impl BakePlan {
    pub(super) fn new(settings: &BakeSettings, source: &Source) -> Result<Self, BakeError> {
        let side = settings.tile_side;
        if !side.is_power_of_two() || !(16..=1024).contains(&side) {
            let what = format!("--tile {side}: the side of a tile is a power of two from 16 to 1024");
            return Err(BakeError::Settings(what));
        }
        if matches!(settings.source, SourceName::Ruler(_)) && settings.format == TileFormat::Bc1 {
            let what = "the ruler's texels are hashes, which bc1 would destroy; use --format rgba8";
            return Err(BakeError::Settings(what.into()));
        }
        let source_size = source.size();
        let [width_log2, height_log2] = source_size.map(|side| side.next_power_of_two().ilog2());
        let source_name = settings.source.to_string();
        let pyramid = Pyramid::new(
            width_log2,
            height_log2,
            side.ilog2(),
            settings.border_texels,
            settings.resident_levels,
        )
        .map_err(|error| BakeError::Settings(format!("{source_name}: {error}")))?;
        let layout = FileLayout::new(pyramid, settings.format)
            .map_err(|error| BakeError::Settings(format!("{source_name}: {error}")))?;
        let row_bytes = 4u64 << width_log2;
        // A power of two, so that band ends coincide with tile ends.
        let band_rows = (BAND_BYTES / row_bytes).clamp(1, u64::from(side)) as u32;
        let band_rows = 1 << band_rows.ilog2();
        let scratch_bytes = match source {
            Source::Synthetic(_) => 0,
            Source::Picture { .. } => pyramid.tile_count() * scratch::payload_bytes(&pyramid) as u64,
        };
        let mut plan = Self { source_name, source_size, layout, band_rows, scratch_bytes, memory_bytes: 0 };
        plan.memory_bytes = plan.memory(settings, source);
        Ok(plan)
    }

    /// Memory of the largest phase, plus memory that all phases hold.
    fn memory(&self, settings: &BakeSettings, source: &Source) -> u64 {
        let pyramid = self.layout.pyramid();
        let threads = rayon::current_num_threads() as u64;
        let payload = scratch::payload_bytes(&pyramid) as u64;
        let rgba = pyramid.tile_bytes_rgba8() as u64;
        let record = self.layout.record_bytes() as u64;
        let first_resident = self.layout.resident_bytes(pyramid.first_resident_level()) as u64;
        let band = (u64::from(self.band_rows) * 4) << pyramid.width_log2();
        // 144 bytes per index entry: the journal's entries, completion flags, and the index as numbers and as bytes. A
        // journal entry has 24 bytes. The entries exist twice while they are partitioned, and once more when checked.
        // The journal also has an entry for each coarser tile in the scratch file: a third as many as tiles of level 0.
        let lists = self.layout.entry_count() * 144;
        let always = if matches!(settings.source, SourceName::Earth(_)) { EARTH_BYTES } else { 0 };
        let (reading, checking_bands) = match source {
            Source::Synthetic(_) => (0, 0),
            Source::Picture { rows, .. } => {
                let enlarging = Enlarged::memory_bytes(self.source_size, pyramid.level_size(0));
                // A band and its tiles' pieces. Checking needs the same amount.
                (2 * band + rows.memory_bytes() + enlarging, 2 * band)
            }
        };
        // Four tiles read and one written, per thread.
        let coarser = threads * 5 * payload;
        // A level, the next coarser one, and the copy of the first resident level that the coarsest tiles store as
        // their second mip level.
        let resident = 3 * first_resident + threads * 2 * payload;
        // The tile, its record, a neighbour's rows. A synthetic tile in linear light has 12 bytes per texel.
        let storing = first_resident + threads * (4 * rgba + record + payload);
        let checking = checking_bands.max(threads * record.max(payload));
        let phases = [reading, coarser, resident, storing, checking];
        let largest = phases.into_iter().fold(0, u64::max);
        // An eighth for fragmentation in the allocator.
        PROGRAM_BYTES + always + lists + largest + largest / 8
    }
}

impl fmt::Display for BakePlan {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let pyramid = self.layout.pyramid();
        let [width, height] = pyramid.level_size(0);
        let [source_width, source_height] = self.source_size;
        let format = match self.layout.format() {
            TileFormat::Rgba8 => "rgba8",
            TileFormat::Bc1 => "bc1",
        };
        writeln!(formatter, "source          {} ({source_width} x {source_height})", self.source_name)?;
        let enlarged = if self.source_size == [width, height] { "" } else { ", enlarged" };
        writeln!(
            formatter,
            "level 0         {width} x {height} (2^{} x 2^{}){enlarged}",
            pyramid.width_log2(),
            pyramid.height_log2()
        )?;
        writeln!(
            formatter,
            "levels          {}: 0 ..= {} in tiles, {} ..= {} resident (L' = {})",
            pyramid.coarsest_level() + 1,
            pyramid.first_resident_level() - 1,
            pyramid.first_resident_level(),
            pyramid.coarsest_level(),
            pyramid.resident_levels()
        )?;
        writeln!(
            formatter,
            "tiles           {} of {} x {} texels, border {}, {format}",
            pyramid.tile_count(),
            pyramid.tile_size(),
            pyramid.tile_size(),
            pyramid.border_texels()
        )?;
        writeln!(formatter, "output bytes    {}", self.layout.total_bytes())?;
        writeln!(
            formatter,
            "scratch bytes   {} (beside the output, deleted at the end)",
            self.scratch_bytes
        )?;
        write!(formatter, "memory bytes    at most {}", self.memory_bytes)
    }
}
