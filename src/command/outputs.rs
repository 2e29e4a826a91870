//! The files that `render` writes. All paths are checked before rendering. Each file is written atomically, except the
//! file of `--records`, which grows line by line.

use super::Usage;
use anyhow::{Context, bail};
use ortelius::picture::write::{Planes, write_bytes, write_exr};
use ortelius::picture::{Picture, PixelFormat};
use ortelius::renderer::report::Report;
use ortelius::renderer::{Record, Renderer};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Placeholder for the frame number in a picture's name.
const FRAME: &str = "{frame}";

pub struct Outputs {
    picture: Option<PathBuf>,
    report: Option<PathBuf>,
    visible: Option<PathBuf>,
    footprint: Option<PathBuf>,
    records: Option<PathBuf>,
}

impl Outputs {
    /// # Errors
    /// Detected before rendering: a missing folder, a target that a rename must not replace, a file name extension
    /// that is not a picture's, one name for two outputs.
    pub fn check(
        picture: Option<&Path>,
        report: Option<&Path>,
        visible: Option<&Path>,
        footprint: Option<&Path>,
        records: Option<&Path>,
    ) -> anyhow::Result<Outputs> {
        for (path, endings) in [(picture, &["png", "exr"][..]), (footprint, &["exr"][..])] {
            let Some(path) = path else { continue };
            if !endings.contains(&ending(path)) {
                let usage = format!("{}: the name must end in .{}", path.display(), endings.join(" or ."));
                bail!(Usage(usage));
            }
        }
        let checked = |path: Option<&Path>| path.map(check_place).transpose();
        let outputs = Outputs {
            picture: checked(picture)?,
            report: checked(report)?,
            visible: checked(visible)?,
            footprint: checked(footprint)?,
            records: checked(records)?,
        };
        let Outputs { picture, report, visible, footprint, records } = &outputs;
        let paths = [picture, report, visible, footprint, records];
        for (n, path) in paths.iter().enumerate() {
            if path.is_some() && paths[..n].contains(path) {
                let path = path.as_ref().expect("just asked").display();
                bail!(Usage(format!("{path} is used for two outputs; give each its own name")));
            }
        }
        Ok(outputs)
    }

    pub fn any(&self) -> bool {
        let Outputs { picture, report, visible, footprint, records } = self;
        [picture, report, visible, footprint, records].into_iter().any(Option::is_some)
    }

    /// The first requested output that only a virtual texture can produce.
    pub fn of_a_texture(&self) -> Option<&'static str> {
        let dumps = [("--dump-visible", &self.visible), ("--dump-footprint", &self.footprint)];
        dumps.into_iter().find(|(_, path)| path.is_some()).map(|(option, _)| option)
    }

    /// True if a requested file contains data of every frame.
    pub fn of_all_frames(&self) -> bool {
        self.report.is_some() || self.visible.is_some()
    }

    /// Path of `--records`.
    pub fn records(&self) -> Option<&Path> {
        self.records.as_deref()
    }

    /// Path of `--dump-visible`.
    pub fn visible(&self) -> Option<&Path> {
        self.visible.as_deref()
    }

    /// True if a single picture is written, not one for each frame.
    pub fn only_the_last(&self) -> bool {
        self.picture.as_ref().is_some_and(|path| !path.to_string_lossy().contains(FRAME))
    }

    /// The format that the picture needs, if one is written.
    pub fn target(&self) -> Option<PixelFormat> {
        self.picture.as_deref().map(|path| match ending(path) {
            "exr" => PixelFormat::Linear32,
            _ => PixelFormat::Srgb8,
        })
    }

    /// Writes the picture of one frame of a sequence, if the name contains `{frame}`.
    ///
    /// # Errors
    /// I/O errors, with the path; device lost.
    pub fn write_frame(&self, renderer: &mut Renderer, frame: usize) -> anyhow::Result<()> {
        match self.picture.as_ref().map(|path| path.to_string_lossy()) {
            Some(name) if name.contains(FRAME) => {
                write_picture(renderer, Path::new(&name.replace(FRAME, &format!("{frame:05}"))))
            }
            _ => Ok(()),
        }
    }

    /// Writes the last picture. `settled`: frame number of the settled picture in a sequence. If it is `None` and
    /// the name contains `{frame}`, nothing is written, because the sequence's last picture is already written.
    ///
    /// # Errors
    /// I/O errors, with the path; device lost.
    pub fn write_last(&self, renderer: &mut Renderer, settled: Option<usize>) -> anyhow::Result<()> {
        match (&self.picture, settled) {
            (Some(path), _) if self.only_the_last() => write_picture(renderer, path),
            (Some(_), Some(frame)) => self.write_frame(renderer, frame),
            _ => Ok(()),
        }
    }

    /// # Errors
    /// I/O errors, with the path; device lost.
    pub fn write_footprint(&self, renderer: &Renderer) -> anyhow::Result<()> {
        let (Some(path), Some(texture)) = (&self.footprint, &renderer.technique.texture) else {
            return Ok(());
        };
        let dump = texture.footprint(&renderer.gpu, renderer.target())?;
        let first_resident = texture.source.pyramid().first_resident_level();
        // (i, j) in the grid of the tile's own level: the level-0 address >> q. -1 for resident levels and the
        // background.
        let own_level = |index: usize| {
            move |&triple: &[u32; 3]| match triple[0] {
                q if q < first_resident => (triple[index] >> q) as f32,
                _ => -1.0,
            }
        };
        let q = |&[q, ..]: &[u32; 3]| if q == u32::MAX { -1.0 } else { q as f32 };
        let coordinate = |n: usize| dump.coordinates.iter().map(|c| c[n]).collect::<Vec<f32>>();
        let derivative = |n: usize| dump.derivatives.iter().map(|d| d[n]).collect::<Vec<f32>>();
        let channels = [
            ("s", coordinate(0)),
            ("t", coordinate(1)),
            ("dsdx", derivative(0)),
            ("dtdx", derivative(1)),
            ("dsdy", derivative(2)),
            ("dtdy", derivative(3)),
            ("q", dump.triples.iter().map(q).collect()),
            ("i", dump.triples.iter().map(own_level(1)).collect()),
            ("j", dump.triples.iter().map(own_level(2)).collect()),
        ];
        let [width, height] = renderer.size();
        let channels = channels.into_iter().map(|(name, samples)| (name.to_string(), samples)).collect();
        Ok(write_exr(path, &Planes { width, height, channels })?)
    }

    /// # Errors
    /// I/O errors, with the path.
    pub fn write_report(&self, report: &Report) -> anyhow::Result<()> {
        Ok(self.report.as_ref().map_or(Ok(()), |path| report.save(path))?)
    }
}

pub(super) fn ending(path: &Path) -> &str {
    path.extension().and_then(|ending| ending.to_str()).unwrap_or("")
}

/// Where a file will be written: the path itself, or its target if it is a link, so that a link stays a link.
pub(super) fn check_place(path: &Path) -> anyhow::Result<PathBuf> {
    let shown = path.display();
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if folder.exists() && !folder.is_dir() {
        bail!("{shown}: {} is a file, not a folder; choose another path", folder.display());
    }
    if !folder.is_dir() {
        bail!("{shown}: folder {} does not exist; create it first", folder.display());
    }
    if path.is_dir() {
        bail!("{shown} is a folder; give a file name");
    }
    // A report must not overwrite a scene, or a bake that took hours.
    if ["tiles", "toml"].contains(&ending(path)) {
        bail!(Usage(format!("{shown}: this output must not be named .{}", ending(path))));
    }
    let place = match path.is_symlink() {
        true => path.canonicalize().with_context(|| format!("{shown}: dangling link"))?,
        false => path.to_path_buf(),
    };
    // Outputs are written by a rename, which would replace /dev/null or a pipe itself.
    if place.exists() && !place.is_file() {
        bail!("{shown} exists and is not a regular file; choose another name");
    }
    // Outputs are first written beside their target, so test now whether that is possible.
    let beside = place.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    tempfile::tempfile_in(beside)
        .with_context(|| format!("{shown}: cannot write a file in {}", beside.display()))?;
    Ok(place)
}

/// Refuses an output path that is the input file, for example a report that would overwrite its model.
pub(super) fn check_apart(output: &Path, input: &Path) -> anyhow::Result<()> {
    let real = |path: &Path| path.canonicalize().ok();
    if real(output).is_some_and(|output| real(input) == Some(output)) {
        bail!(Usage(format!("{}: this is the input file; choose another name", output.display())));
    }
    Ok(())
}

/// Checks that a folder exists or can be created, and is writable, before any work starts. Creates nothing.
pub(super) fn check_folder(path: &Path) -> anyhow::Result<()> {
    let shown = path.display();
    let named =
        |part: &Path| if part.as_os_str().is_empty() { PathBuf::from(".") } else { part.to_path_buf() };
    let there = path.ancestors().map(named).find(|part| part.exists()).unwrap_or_else(|| PathBuf::from("."));
    if !there.is_dir() {
        bail!("-o {shown}: {} is not a folder; choose another path", there.display());
    }
    tempfile::tempfile_in(&there)
        .with_context(|| format!("-o {shown}: cannot write in {}; choose another path", there.display()))?;
    Ok(())
}

fn write_picture(renderer: &mut Renderer, path: &Path) -> anyhow::Result<()> {
    match renderer.kind() {
        PixelFormat::Srgb8 => renderer.picture()?.save(path)?,
        PixelFormat::Linear32 => {
            let Picture { width, height, rgba } = renderer.linear_picture()?;
            let channel = |c: usize| rgba.iter().map(|pixel| pixel[c]).collect();
            let channels =
                ["R", "G", "B"].into_iter().enumerate().map(|(c, name)| (name.to_string(), channel(c)));
            write_exr(path, &Planes { width, height, channels: channels.collect() })?;
        }
    }
    Ok(())
}

/// Writes a line `frame,q,i,j` for each visible tile of every frame, or of the last frame if `only_last`. i
/// and j are the row and column in level q; the tiles of a frame are sorted.
///
/// # Errors
/// I/O errors, with the path.
pub fn write_visible(path: &Path, records: &[Record], only_last: bool) -> anyhow::Result<()> {
    let first = if only_last { records.len().saturating_sub(1) } else { 0 };
    let mut text = String::from("frame,q,i,j\n");
    for record in records[first..].iter().filter_map(|record| record.texture.as_ref()) {
        for tile in &record.visible {
            writeln!(text, "{},{},{},{}", record.index, tile.level, tile.row, tile.column)?;
        }
    }
    Ok(write_bytes(path, &text)?)
}
