//! `ortelius bake`: converts a picture, or a synthetic source, to a `.tiles` file.

use super::named;
use super::progress::ProgressLine;
use anyhow::Result;
use clap::Args;
use ortelius::texture::bake::{self, BakeProgress, BakeSettings, SourceName};
use ortelius::texture::source::TileFormat;
use std::path::PathBuf;

/// Bakes a picture, or a synthetic source, to a .tiles file.
///
/// To resume an interrupted bake, run the same command again. Until the bake is done, OUT.partial, OUT.scratch and
/// OUT.journal lie beside OUT.
#[derive(Args, Debug)]
pub struct BakeArgs {
    /// A PNG, JPEG or TIFF/BigTIFF picture (8 bits per sample; PNG and TIFF may be larger than memory), or earth:M or
    /// ruler:M for 2^M x 2^(M-1) texels
    source: String,

    /// The file to write; its folder must exist
    #[arg(short, long, value_name = "OUT.tiles")]
    output: PathBuf,

    /// Side of a tile in texels, a power of two from 16 to 1024
    #[arg(long, value_name = "TEXELS", default_value_t = 512)]
    tile: u32,

    /// Width of the border around each tile, copied from its neighbours, in texels; a multiple of 4 for bc1
    #[arg(long, value_name = "TEXELS", default_value_t = 4)]
    border: u32,

    /// Storage format of the texels
    #[arg(long, value_parser = named(|_: TileFormat| true), default_value = "rgba8")]
    format: TileFormat,

    /// Number of coarsest levels that are stored without tiles and are always in video memory (the paper's L').
    /// Default: as few as possible
    #[arg(long, value_name = "LEVELS")]
    resident_levels: Option<u32>,

    /// Print levels, tiles, bytes and the peak memory of the bake, and write nothing
    #[arg(long)]
    dry_run: bool,

    /// Replace OUT, and discard an unfinished bake of another source or other settings
    #[arg(long)]
    force: bool,
}

/// Runs the subcommand. A failure carries a [`bake::BakeError`] or [`bake::SourceError`].
pub fn run(args: &BakeArgs) -> Result<()> {
    let settings = BakeSettings {
        source: args.source.parse::<SourceName>()?,
        output: args.output.clone(),
        tile_side: args.tile,
        border_texels: args.border,
        format: args.format,
        resident_levels: args.resident_levels,
        force: args.force,
    };
    if args.dry_run {
        return super::say(bake::plan(&settings)?);
    }
    let bar = ProgressLine::of_bytes();
    let baked = bake::bake(&settings, &bar);
    drop(bar);
    let plan = baked?;
    tracing::info!(
        "{}: {} tiles, {} bytes",
        settings.output.display(),
        plan.layout.pyramid().tile_count(),
        plan.layout.total_bytes()
    );
    Ok(())
}

impl BakeProgress for ProgressLine {
    fn begin(&self, phase: &'static str, total_bytes: u64) {
        self.phase(phase, Some(total_bytes));
    }

    fn advance(&self, bytes: u64) {
        ProgressLine::advance(self, bytes);
    }
}
