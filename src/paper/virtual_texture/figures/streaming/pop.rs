//! vt.pop: the jumps of pixel values when tiles arrive, without and with fade-in.

use super::super::common::ONE_SAMPLE;
use super::{Route, UNMAGNIFIED, linear, session, show_beside};
use crate::figure::prelude::*;
use crate::frame::Run;
use crate::paper::virtual_texture::VirtualTexture;
use crate::paper::virtual_texture::config::open_texture;
use crate::picture::PixelFormat;
use crate::stats::Summary;
use crate::texture::source::cached::CachedSource;
use anyhow::ensure;
use std::sync::Arc;

/// Frames of the fade, and the variants' names.
const FADES: [(u32, &str); 3] =
    [(0, "at once (the paper)"), (4, "fade-in over 4 frames"), (16, "fade-in over 16 frames")];

const LARGEST: &str = "largest pop";
const ALONG: &str = "pop along the path";
const BEHIND: &str = "mean error";
const LOOKED_AT: &str = "frames compared with the previous one";
const PIXELS: &str = "pixels of a frame";

/// Frames at each pose. A list reaches the host after two frames and a load takes one, so tiles arrive in the fourth.
const STAYS: u32 = 4;

pub const POP: Figure = Figure {
    id: "vt.pop",
    title: "Jumps of pixel values when tiles arrive",
    about: "The pop is the largest change of any pixel's channel between two frames, beyond the change in the fully \
            resident sequence. To make that change zero, the camera rests at each pose for four frames, and a pose's \
            tiles arrive in the last of them. The paper (section 4) shows a tile as soon as it arrives; fade-in blends \
            it with the coarser tile that was shown before. The price is a picture that lags: the mean error compares \
            each pose's last frame with the fully resident one. Levels are those of 8-bit sRGB. The camera `headline` \
            is used without magnification, so that the dive crosses levels. Every pixel of every frame counts. Quick \
            runs compare 39 poses (every second of the path's first 80) at 320 x 180 pixels, full runs compare 239 at \
            1280 x 720. The pictures are the frame after the largest jump and the map of that jump. Pixels have one \
            sample (NA = 1).",
    scenes: &["earth/pan", "earth/dive"],
    variants: || FADES.map(|(_, name)| name.to_owned()).into(),
    paper: &["at once (the paper)"],
    show: Show::scenes(VIEW).variants(settings),
    measure,
    plots: &[Plot::curves(ALONG, "frame"), Plot::bars(BEHIND)],
    claims: &[Claim::ours(
        "tiles-pop",
        "Tiles that are shown as soon as they arrive pop visibly: a pixel jumps by more than 8 levels of 255.",
        &[Test::value(one(LARGEST, FADES[0].1), Above(8.0))],
    )],
    ..Figure::BASE
};

/// The changes of the scene for the window: the tiles of a quick run, without magnification.
const VIEW: &[&str] =
    &[ONE_SAMPLE[0], "surface.land.texture.tile_size=128", UNMAGNIFIED, "cache.gpu_tiles=512"];

/// The variants as settings of a scene.
fn settings() -> Vec<Setting> {
    FADES.map(|(frames, name)| Setting::new(name, [format!("cache.fade_in_frames={frames}")])).into()
}

/// The picture's size, and the frames of the path.
fn extent(effort: Effort) -> ([u32; 2], Vec<u32>) {
    match effort {
        // With tiles of 128, as many tiles are visible as with the paper's tiles of 512 at 1280 x 720.
        Effort::Quick => ([320, 180], (0..80).step_by(2).collect()),
        Effort::Full => ([1280, 720], (0..240).collect()),
    }
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let route = Route::find(&cell.scene, &["surface.land.texture.tile_size=128".into(), UNMAGNIFIED.into()])?;
    let source = CachedSource::new(open_texture(&route.scene)?);
    let (size, frames) = extent(bench.effort);
    let open = |bench: &Bench, fade_in_frames| {
        session(bench, &route.scene, source.clone(), size, |settings| {
            settings.target = PixelFormat::Srgb8;
            settings.streaming.gpu_tiles = 512;
            settings.streaming.host_tiles = 512;
            settings.streaming.deterministic = true;
            settings.streaming.upload_tiles_per_frame = 512;
            settings.streaming.load_tiles_per_frame = 512;
            settings.config.fade_in_frames = fade_in_frames;
        })
    };
    let mut resident = open(bench, 0)?;
    let mut truth: Vec<Arc<[u8]>> = Vec::new();
    for &frame in &frames {
        resident.settle(&route.path.pose(frame))?;
        truth.push(resident.picture_bytes()?.into());
    }
    drop(resident);
    let mut rows = Vec::new();
    for (fade_in_frames, name) in FADES {
        let mut session = open(bench, fade_in_frames)?;
        session.settle(&route.path.pose(frames[0]))?;
        let (found, worst) = watch(&mut session, &route, &frames, &truth, name)?;
        rows.extend(found);
        if let (0, Some([before, after])) = (fade_in_frames, worst) {
            let [before, after] = [before, after].map(|bytes| linear(bytes, size));
            show_beside(bench, &format!("vt.pop-{}-largest", cell.scene.replace('/', "-")), &after, &before)?;
        }
    }
    Ok(rows)
}

/// The pictures before and after the largest jump.
type Worst = Option<[Vec<u8>; 2]>;

/// Runs the path from its settled first pose, and rests at each pose for [`STAYS`] frames.
fn watch(
    session: &mut Run<VirtualTexture>,
    route: &Route,
    frames: &[u32],
    truth: &[Arc<[u8]>],
    name: &str,
) -> anyhow::Result<(Vec<Row>, Worst)> {
    let mut last = session.picture_bytes()?;
    let (mut pops, mut behind, mut largest, mut worst) = (Vec::new(), Vec::new(), 0, None);
    for (&frame, truth) in frames.iter().zip(truth).skip(1) {
        for stay in 0..STAYS {
            session.frame(&route.path.pose(frame))?;
            let picture = session.picture_bytes()?;
            let arrived = session.records.last().map_or(0, |record| record.streaming.uploads);
            ensure!(
                stay > 0 || arrived == 0,
                "{arrived} tiles arrived in a moving frame: the budgets are too small"
            );
            if stay > 0 {
                let changes = picture.iter().zip(&last).map(|(now, before)| now.abs_diff(*before));
                let change = changes.max().unwrap_or(0);
                pops.push([session.records.len() as f64, f64::from(change)]);
                if change > largest {
                    (largest, worst) = (change, Some([last, picture.clone()]));
                }
            }
            last = picture;
        }
        let errors = last.iter().zip(truth.iter()).map(|(now, truth)| f64::from(now.abs_diff(*truth)));
        // Alpha is 255 in both pictures, so only three of four bytes can differ.
        behind.push(errors.sum::<f64>() / (0.75 * last.len() as f64));
    }
    let behind = Summary::of(&behind).context("a path has frames")?;
    let rows = vec![
        Row::number(name, LARGEST, "levels of 255", f64::from(largest)),
        Row::number(name, LOOKED_AT, "frames", pops.len() as f64),
        Row::number(name, PIXELS, "pixels", (last.len() / 4) as f64),
        Row::new(name, ALONG, "levels of 255", Value::Series(pops)),
        Row::new(name, BEHIND, "levels of 255", Value::Summary(behind)),
    ];
    Ok((rows, worst))
}
