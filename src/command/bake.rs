//! `ortelius bake`: a picture, or a synthetic source, becomes a `.tiles` file.

use anyhow::Result;
use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use ortelius::texture::bake::{self, Progress, Settings, SourceName};
use ortelius::texture::source::TileFormat;
use std::path::PathBuf;

/// Bakes a picture, or a synthetic source, into a .tiles file.
///
/// A bake that was stopped goes on when the same command is run again. Until it is done, OUT.partial,
/// OUT.scratch and OUT.journal lie beside OUT.
#[derive(Args, Debug)]
pub struct BakeArgs {
    /// A PNG, JPEG or TIFF/BigTIFF picture (8 bits; any size, also larger than memory if TIFF or PNG), or
    /// earth:M or ruler:M for 2^M x 2^(M-1) texels
    source: String,

    /// The file to write; its folder must exist
    #[arg(short, long, value_name = "OUT.tiles")]
    output: PathBuf,

    /// Side of a tile in texels, a power of two from 16 to 1024
    #[arg(long, value_name = "TEXELS", default_value_t = 512)]
    tile: u32,

    /// Texels of the neighbours around each tile; a multiple of 4 for bc1
    #[arg(long, value_name = "TEXELS", default_value_t = 4)]
    border: u32,

    /// How texels are stored
    #[arg(long, value_enum, default_value_t = Format::Rgba8)]
    format: Format,

    /// Coarsest levels kept whole (the paper's L'); by default as few as possible
    #[arg(long, value_name = "LEVELS")]
    resident_levels: Option<u32>,

    /// Prints levels, tiles, bytes and the memory that a bake takes at most, and writes nothing
    #[arg(long)]
    dry_run: bool,

    /// Replaces OUT, and drops unfinished work of another source or other settings
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Format {
    /// 4 bytes a texel
    Rgba8,
    /// half a byte a texel, no alpha
    Bc1,
}

/// Runs the subcommand. A failure carries a [`bake::BakeError`] or [`bake::SourceError`].
pub fn run(args: &BakeArgs) -> Result<()> {
    let settings = Settings {
        source: args.source.parse::<SourceName>()?,
        output: args.output.clone(),
        tile_side: args.tile,
        border_texels: args.border,
        format: match args.format {
            Format::Rgba8 => TileFormat::Rgba8,
            Format::Bc1 => TileFormat::Bc1,
        },
        resident_levels: args.resident_levels,
        force: args.force,
    };
    if args.dry_run {
        return super::say(bake::plan(&settings)?);
    }
    let bar = Bar::new();
    let baked = bake::bake(&settings, &bar);
    bar.0.finish_and_clear();
    let plan = baked?;
    tracing::info!(
        "{}: {} tiles, {} bytes",
        settings.output.display(),
        plan.layout.pyramid().tile_count(),
        plan.layout.total_bytes()
    );
    Ok(())
}

/// A bar on stderr; hidden where that is no terminal.
pub(super) struct Bar(ProgressBar);

impl Bar {
    pub(super) fn new() -> Self {
        let bar = ProgressBar::no_length();
        let template = "{msg:>8} {wide_bar} {bytes}/{total_bytes} {bytes_per_sec} {eta} left";
        // The template is ours; a wrong one shows the default style.
        bar.set_style(
            ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()),
        );
        Self(bar)
    }

    pub(super) fn finish(&self) {
        self.0.finish_and_clear();
    }
}

impl Progress for Bar {
    fn begin(&self, phase: &'static str, total_bytes: u64) {
        self.0.reset();
        self.0.set_length(total_bytes);
        self.0.set_message(phase);
    }

    fn advance(&self, bytes: u64) {
        self.0.inc(bytes);
    }
}
