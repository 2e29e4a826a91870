//! Picture files: PNG in sRGB bytes, EXR in 32-bit floats with channels of any name. Writes are atomic: a file
//! is written beside the target under a temporary name and then renamed. Folders are never created.

use super::{Picture, srgb};
use crate::file;
use exr::prelude::*;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::File;
use std::io::{self, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};
use thiserror::Error;

/// A file that could not be written or read.
#[derive(Debug, Error)]
pub enum FileError {
    #[error("cannot write {path}: its folder {folder} does not exist; create it first")]
    NoFolder { path: String, folder: String },
    #[error("cannot write {path}: {source}")]
    Write { path: String, source: io::Error },
    #[error("cannot read {path}: {source}")]
    Read { path: String, source: io::Error },
}

/// Bytes of an 8-bit picture: `width x height` times red, green, blue, alpha; colours in sRGB.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Srgb8Picture {
    pub width: u32,
    pub height: u32,
    pub rgba: Vec<u8>,
}

impl Srgb8Picture {
    /// Writes a PNG atomically; its folder must exist.
    ///
    /// # Errors
    /// [`FileError`] names the path.
    pub fn save(&self, path: &Path) -> std::result::Result<(), FileError> {
        write_png(path, self)
    }
}

/// Named planes of 32-bit floats, each `width x height`, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Planes {
    pub width: u32,
    pub height: u32,
    pub channels: BTreeMap<String, Vec<f32>>,
}

/// Writes a file of any kind atomically: `content` writes to `X.PROCESS.partial`, which is renamed to `X` once
/// all is on disk. After an error, neither a new `X` nor the partial file remains, and an older `X` is unchanged.
/// Several processes and threads may write the same `X`: the last one wins, and `X` is never a mixture.
///
/// # Errors
/// [`FileError`] names the path.
pub fn write_atomically(
    path: &Path,
    content: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> std::result::Result<(), FileError> {
    let shown = path.display().to_string();
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    if let Some(folder) = folder.filter(|folder| !folder.exists()) {
        return Err(FileError::NoFolder { path: shown, folder: folder.display().to_string() });
    }
    let (partial, created) = {
        let mut half_written = half_written();
        let partial = unused_name(path, &half_written);
        half_written.push(partial.clone());
        let created = File::create(&partial);
        (partial, created)
    };
    let written = created.and_then(|file| {
        let mut writer = BufWriter::new(file);
        content(&mut writer)?;
        writer.flush()?;
        writer.get_ref().sync_all()
    });
    let mut half_written = half_written();
    half_written.retain(|path| *path != partial);
    written.and_then(|()| std::fs::rename(&partial, path)).map_err(|source| {
        // Best effort: the first error is the one to report; the partial file may not exist.
        std::fs::remove_file(&partial).ok();
        FileError::Write { path: shown, source }
    })
}

/// As [`write_atomically`], for content in memory.
///
/// # Errors
/// [`FileError`] names the path.
pub fn write_bytes(path: &Path, content: impl AsRef<[u8]>) -> std::result::Result<(), FileError> {
    write_atomically(path, |file| file.write_all(content.as_ref()))
}

/// `X.PROCESS.partial`, or `X.PROCESS-1.partial` and so on if another thread of this process is writing `X`.
fn unused_name(path: &Path, half_written: &[PathBuf]) -> PathBuf {
    let process = std::process::id();
    let name = |number: String| {
        let mut name = OsString::from(path);
        name.push(format!(".{process}{number}.partial"));
        PathBuf::from(name)
    };
    let numbered = (1..).map(|number| name(format!("-{number}")));
    let mut names = std::iter::once(name(String::new())).chain(numbered);
    names.find(|name| !half_written.contains(name)).expect("endless")
}

/// Paths of half-written files. Locked while a file is created and while it is renamed.
fn half_written() -> MutexGuard<'static, Vec<PathBuf>> {
    static PATHS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());
    PATHS.lock().expect("no panic while the list of half-written files is locked")
}

/// Removes every half-written file; for a process that is about to end. Until the result is dropped, no file
/// is created or renamed.
pub fn abandon() -> impl Sized {
    let half_written = half_written();
    for partial in half_written.iter() {
        // Best effort: the process is ending, so nothing can handle the error.
        std::fs::remove_file(partial).ok();
    }
    half_written
}

/// Writes an 8-bit RGBA PNG tagged as sRGB.
///
/// # Errors
/// [`FileError`] names the path.
pub fn write_png(path: &Path, picture: &Srgb8Picture) -> std::result::Result<(), FileError> {
    let (width, height) = (picture.width, picture.height);
    let bytes = width as usize * height as usize * 4;
    assert_eq!(picture.rgba.len(), bytes, "bytes of a PNG of {width} x {height}");
    write_atomically(path, |writer| {
        let mut encoder = png::Encoder::new(writer, width, height);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut png = encoder.write_header()?;
        png.write_image_data(&picture.rgba)?;
        png.finish()?;
        Ok(())
    })
}

/// Reads a PNG of any kind as 8-bit RGBA; 16-bit samples lose their lower byte.
///
/// # Errors
/// [`FileError::Read`].
pub fn read_png(path: &Path) -> std::result::Result<Srgb8Picture, FileError> {
    let read = || -> io::Result<Srgb8Picture> {
        let mut decoder = png::Decoder::new(BufReader::new(file::open(path)?));
        decoder
            .set_transformations(png::Transformations::normalize_to_color8() | png::Transformations::ALPHA);
        let mut reader = decoder.read_info()?;
        let size = reader.output_buffer_size().ok_or_else(|| io::Error::other("larger than memory"))?;
        let mut samples = vec![0; size];
        let info = reader.next_frame(&mut samples)?;
        samples.truncate(info.buffer_size());
        let rgba = match info.color_type {
            png::ColorType::Rgba => samples,
            // The transformations leave only RGBA, and grey with alpha.
            _ => samples.chunks_exact(2).flat_map(|pair| [pair[0], pair[0], pair[0], pair[1]]).collect(),
        };
        Ok(Srgb8Picture { width: info.width, height: info.height, rgba })
    };
    read().map_err(|source| FileError::Read { path: path.display().to_string(), source })
}

/// Writes one unnamed EXR layer, so that channel names are exactly those in `planes`. Values are 32-bit floats,
/// lossless, including NaN and infinities.
///
/// # Errors
/// [`FileError`] names the path.
pub fn write_exr(path: &Path, planes: &Planes) -> std::result::Result<(), FileError> {
    let (width, height) = (planes.width as usize, planes.height as usize);
    let channels = planes.channels.iter().map(|(name, samples)| {
        assert_eq!(samples.len(), width * height, "samples of {name} in an EXR of {width} x {height}");
        let name = Text::new_or_none(name).unwrap_or_else(|| panic!("{name:?} is not a valid channel name"));
        AnyChannel::new(name, FlatSamples::F32(samples.clone()))
    });
    let layer = Layer::new(
        (width, height),
        LayerAttributes::default(),
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels.collect()),
    );
    let image = Image::from_layer(layer);
    write_atomically(path, |writer| image.write().non_parallel().to_buffered(writer).map_err(io_error))
}

/// Reads the first layer of an EXR as 32-bit floats.
///
/// # Errors
/// [`FileError::Read`].
pub fn read_exr(path: &Path) -> std::result::Result<Planes, FileError> {
    let read = || -> io::Result<Planes> {
        let image = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .non_parallel()
            .from_buffered(BufReader::new(file::open(path)?))
            .map_err(io_error)?;
        let layer = image.layer_data;
        let side = |side: usize| u32::try_from(side).map_err(io::Error::other);
        let mut channels = BTreeMap::new();
        for channel in &layer.channel_data.list {
            let samples: Vec<f32> = channel.sample_data.values_as_f32().collect();
            if samples.len() != layer.size.area() {
                return Err(io::Error::other(format!("channel {} is subsampled", channel.name)));
            }
            channels.insert(channel.name.to_string(), samples);
        }
        Ok(Planes { width: side(layer.size.width())?, height: side(layer.size.height())?, channels })
    };
    read().map_err(|source| FileError::Read { path: path.display().to_string(), source })
}

fn io_error(error: exr::error::Error) -> io::Error {
    match error {
        exr::error::Error::Io(error) => error,
        other => io::Error::other(other.to_string()),
    }
}

const RGBA: [&str; 4] = ["R", "G", "B", "A"];

impl From<&Picture> for Srgb8Picture {
    /// Nearest code of each channel; values outside 0 ..= 1 clamp.
    fn from(picture: &Picture) -> Srgb8Picture {
        let codes = |[r, g, b, a]: &[f32; 4]| {
            let [r, g, b] = [r, g, b].map(|&channel| srgb::from_linear_f64(f64::from(channel)));
            [r, g, b, (a * 255.0).round() as u8]
        };
        let rgba = picture.rgba.iter().flat_map(codes).collect();
        Srgb8Picture { width: picture.width, height: picture.height, rgba }
    }
}

impl From<&Srgb8Picture> for Picture {
    fn from(picture: &Srgb8Picture) -> Picture {
        let linear = |pixel: &[u8]| {
            let [r, g, b] = [0, 1, 2].map(|c| srgb::to_linear_f64(pixel[c]) as f32);
            [r, g, b, f32::from(pixel[3]) / 255.0]
        };
        Picture::new(picture.width, picture.height, picture.rgba.chunks_exact(4).map(linear).collect())
    }
}

impl From<&Picture> for Planes {
    /// Channels R, G, B, A.
    fn from(picture: &Picture) -> Planes {
        let plane = |channel: usize| picture.rgba.iter().map(|pixel| pixel[channel]).collect();
        Planes {
            width: picture.width,
            height: picture.height,
            channels: RGBA.iter().enumerate().map(|(i, name)| ((*name).to_owned(), plane(i))).collect(),
        }
    }
}

impl Planes {
    /// The channels R, G, B and A as a picture; opaque without A. `None` if a colour is missing.
    pub fn picture(&self) -> Option<Picture> {
        let [red, green, blue] = ["R", "G", "B"].map(|name| self.channels.get(name));
        let (red, green, blue, alpha) = (red?, green?, blue?, self.channels.get("A"));
        let pixels = (0..red.len())
            .map(|i| [red[i], green[i], blue[i], alpha.map_or(1.0, |alpha| alpha[i])])
            .collect();
        Some(Picture::new(self.width, self.height, pixels))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder_content(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = std::fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    fn bytes() -> Srgb8Picture {
        Srgb8Picture { width: 5, height: 3, rgba: (0..60).map(|i| (i * 37 % 256) as u8).collect() }
    }

    #[test]
    fn a_png_comes_back_byte_for_byte_and_leaves_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        write_png(&path, &bytes()).unwrap();
        assert_eq!(read_png(&path).unwrap(), bytes());
        assert_eq!(folder_content(folder.path()), ["a.png"]);
        let mut other = bytes();
        other.rgba[59] ^= 1;
        assert_ne!(read_png(&path).unwrap(), other, "the last bit counts");
    }

    #[test]
    fn a_grey_png_is_read_as_opaque_rgba() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("grey.png");
        let mut encoder = png::Encoder::new(File::create(&path).unwrap(), 2, 1);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.write_header().unwrap().write_image_data(&[7, 200]).unwrap();
        assert_eq!(read_png(&path).unwrap().rgba, [7, 7, 7, 255, 200, 200, 200, 255]);
    }

    #[test]
    fn an_exr_keeps_names_and_every_bit_of_every_float() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("footprint.exr");
        let values = vec![f32::NAN, f32::INFINITY, -0.0, 1e-45, 16_777_217.0, 0.1];
        let channels = ["s", "dsdx", "q", "Z"].map(|name| (name.to_owned(), values.clone()));
        let planes = Planes { width: 3, height: 2, channels: channels.into() };
        write_exr(&path, &planes).unwrap();
        let read = read_exr(&path).unwrap();
        assert_eq!((read.width, read.height), (3, 2));
        assert_eq!(read.channels.keys().collect::<Vec<_>>(), ["Z", "dsdx", "q", "s"]);
        for plane in read.channels.values() {
            let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(plane), bits(&values));
        }
        assert_eq!(folder_content(folder.path()), ["footprint.exr"]);
    }

    #[test]
    fn a_picture_goes_through_an_exr_unchanged() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.exr");
        let picture = Picture::new(1, 2, vec![[0.25, 3.0, 1e-9, 0.5], [1.0, -2.0, 0.0, 1.0]]);
        write_exr(&path, &Planes::from(&picture)).unwrap();
        assert_eq!(read_exr(&path).unwrap().picture().unwrap(), picture);
    }

    #[test]
    fn a_missing_folder_is_named_and_not_created() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("no/a.png");
        let error = write_png(&path, &bytes()).unwrap_err();
        assert!(matches!(error, FileError::NoFolder { .. }));
        let message = error.to_string();
        assert!(message.contains("no/a.png") && message.ends_with("create it first"), "{message}");
        assert!(folder_content(folder.path()).is_empty());
    }

    #[test]
    fn a_failure_keeps_the_older_file_and_leaves_no_partial_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        std::fs::write(&path, "older").unwrap();
        let error = write_atomically(&path, |writer| {
            writer.write_all(b"new")?;
            Err(io::Error::other("disk full"))
        });
        let message = error.unwrap_err().to_string();
        assert!(message.starts_with("cannot write ") && message.ends_with("a.txt: disk full"), "{message}");
        assert_eq!(std::fs::read(&path).unwrap(), b"older");
        assert_eq!(folder_content(folder.path()), ["a.txt"]);
        // Renaming over a folder fails.
        std::fs::create_dir(folder.path().join("b.png")).unwrap();
        assert!(write_png(&folder.path().join("b.png"), &bytes()).is_err());
        assert_eq!(folder_content(folder.path()), ["a.txt", "b.png"]);
    }

    #[test]
    fn two_writers_of_one_file_do_not_share_what_they_write() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_atomically(&path, |first| {
            first.write_all(b"first")?;
            write_atomically(&path, |second| second.write_all(b"second")).unwrap();
            assert_eq!(std::fs::read(&path).unwrap(), b"second");
            Ok(())
        })
        .unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"first");
        assert_eq!(folder_content(folder.path()), ["a.txt"]);
    }

    #[test]
    fn a_damaged_file_is_an_error_with_its_path() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        write_png(&path, &bytes()).unwrap();
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
        assert!(read_png(&path).unwrap_err().to_string().contains("a.png: "));
        assert!(read_exr(&path).unwrap_err().to_string().contains("a.png: "));
        assert!(read_exr(&folder.path().join("none.exr")).is_err());
    }
}
