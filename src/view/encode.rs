//! Encodes a recording as a looping animated PNG, and also as an MP4 if ffmpeg is installed.

use anyhow::{Context, bail};
use ortelius::picture::write::{read_png, write_atomically};
use ortelius::scene::path::FRAMES_PER_SECOND;
use std::io;
use std::path::Path;
use std::process::Command;

/// Writes `animation.png` from the pictures `00000.png`, `00001.png`, … of a folder: RGB, endless loop.
///
/// # Errors
/// A file cannot be read or written; the error names its path.
pub fn animation(folder: &Path, frames: u32) -> anyhow::Result<()> {
    let picture = |frame: u32| read_png(&folder.join(format!("{frame:05}.png")));
    let first = picture(0)?;
    write_atomically(&folder.join("animation.png"), |file| {
        let mut encoder = png::Encoder::new(file, first.width, first.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        encoder.set_compression(png::Compression::High);
        encoder.set_animated(frames, 0).map_err(io::Error::other)?;
        encoder.set_frame_delay(1, FRAMES_PER_SECOND).map_err(io::Error::other)?;
        let mut writer = encoder.write_header().map_err(io::Error::other)?;
        for frame in 0..frames {
            let picture = picture(frame).map_err(io::Error::other)?;
            let rgb: Vec<u8> =
                picture.rgba.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
            writer.write_image_data(&rgb).map_err(io::Error::other)?;
        }
        writer.finish().map_err(io::Error::other)
    })?;
    Ok(())
}

/// Writes `film.mp4` from the same pictures. Returns false if ffmpeg is not installed.
///
/// # Errors
/// ffmpeg cannot be started, or it fails; the error contains the first line of ffmpeg's message.
pub fn film(folder: &Path) -> anyhow::Result<bool> {
    let mut command = Command::new("ffmpeg");
    command.args(["-loglevel", "error", "-nostdin", "-y", "-framerate", &FRAMES_PER_SECOND.to_string()]);
    // The codec supports only even sizes.
    command.args([
        "-i",
        "%05d.png",
        "-vf",
        "crop=trunc(iw/2)*2:trunc(ih/2)*2",
        "-pix_fmt",
        "yuv420p",
        "film.mp4",
    ]);
    let ran = match command.current_dir(folder).output() {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
        ran => ran.context("ffmpeg")?,
    };
    if !ran.status.success() {
        let words = String::from_utf8_lossy(&ran.stderr);
        bail!("ffmpeg: {}; the numbered pictures are complete", words.lines().next().unwrap_or("failed"));
    }
    Ok(true)
}
