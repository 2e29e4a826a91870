//! vt.feedback: which tiles subsampled feedback misses, and for how long. Engines ship subsampled feedback.

mod along;
mod cut;
mod times;
mod watch;

use super::common::{ONE_SAMPLE, SceneView, pixels_of, setting};
use crate::figure::prelude::*;
use crate::paper::virtual_texture::config::Filter;
use crate::paper::virtual_texture::{Config, Listing, PAPER, RequestFormat};
use watch::{SUBSAMPLINGS, Watch, name};

pub const FEEDBACK: Figure = Figure {
    id: "vt.feedback",
    title: "Subsampled feedback compared with the exact list",
    about: "The paper lists the tiles of all of a frame's pixels in that frame (section 2). Engines sample one pixel \
            in 4 to 256, a different one in each frame, and accumulate: one in 64 in Call of Duty, one in 256 in \
            Unreal Engine 5. Recall is the share of the exact list's tiles that the sampled list contains. Delay is \
            the number of frames after a cut until a tile is listed. Precision is the share of the list's tiles that \
            are visible, under a moving camera. A pixel is served if the list contains its tile. A tile listed in the \
            first frame after the cut has delay 1; the list of frame n has all samples of frames 1 to n. With every \
            method, including the exact one, a list reaches the host two frames later. Times include gathering the \
            samples, copying them to the host and listing them there. \"All pixels\" copies the whole request image \
            and runs the same pass over it. The pictures show in red the pixels whose tiles are missed in the first \
            frame with one pixel in 256. Pixels have one sample (NA = 1); more samples would list more tiles and not \
            change how pixels are chosen.",
    scenes: &["earth/headline", "earth/oblique", "globe/africa", "earth/pan", "earth/dive", "earth/orbit"],
    variants: || SUBSAMPLINGS.map(name).into_iter().chain([ALL_PIXELS.to_string()]).collect(),
    paper: &["all pixels"],
    sweep: Some(Sweep { name: "picture height, pixels", quick: &[720.0], full: &[360.0, 720.0, 1080.0] }),
    show: Show::scenes(ONE_SAMPLE).variants(settings),
    measure,
    plots: &[
        Plot::curves(RECALL, "frames after a cut").log_x(),
        Plot::curves(PIXELS, "frames after a cut").log_x(),
        Plot::bars(MOVING_RECALL),
        Plot::bars(MOVING_PRECISION),
        Plot::bars(TIME).log_y().floor("empty pass"),
    ],
    claims: &[
        Claim::ours(
            "delay",
            "The exact list has all tiles at once. In every view, a list from one pixel in 64 or in 256 has all tiles \
             only after more than one frame (median over all starts in the cycle).",
            &[Test::value(each(TO_ALL, || [6, 8].map(name).into()), Above(1.0))],
        ),
        Claim::ours(
            "moving",
            "Accumulating lists is not enough for a moving camera. With one pixel in 256, the list of a single frame \
            lacks visible tiles in some frames of every path, and most tiles accumulated over a whole cycle are no \
            longer visible.",
            &[
                Test::value(one(MOVING_RECALL, "1/256").part(Statistic::Least), Below(1.0)),
                Test::value(one(MOVING_PRECISION, "1/256"), Below(0.5)),
            ],
        ),
        Claim::ours_timed(
            "cost",
            "A list from one pixel in 64 takes at most a tenth of the time of a list from all pixels.",
            &[Test::ratio_of(TIME, [ALL_PIXELS, "1/64"], AtLeast(10.0))],
        ),
    ],
    ..Figure::BASE
};

const RECALL: &str = "recall after a cut";
const PIXELS: &str = "pixels served after a cut";
const TO_ALL: &str = "frames until all tiles are listed";
const MOVING_RECALL: &str = "recall of one moving frame";
const MOVING_PRECISION: &str = "precision of a moving cycle";
const TIME: &str = "gather, copy and list";
const ALL_PIXELS: &str = "all pixels";

/// The variants as settings of a scene: one pixel in 2^n.
fn settings() -> Vec<Setting> {
    let all_pixels = (ALL_PIXELS.to_owned(), 0);
    let variants = SUBSAMPLINGS.into_iter().map(|log2| (name(log2), log2)).chain([all_pixels]);
    let config = |feedback_log2| Config { list: Listing::Feedback, feedback_log2, ..PAPER };
    variants.map(|(name, log2)| setting(name, &config(log2))).collect()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let size = pixels_of(cell.x.expect("the sweep has values"));
    let opened = SceneView::find(&cell.scene)?.open(bench, size, |settings| {
        settings.config.filter = Filter::ONE_SAMPLE;
        // No tile is streamed here. The request image is packed, as usual for a copy to the host.
        settings.streaming.gpu_tiles = 1;
        settings.config.request_format = Some(RequestFormat::Packed);
    })?;
    let mut watch = Watch::new(opened)?;
    match watch.opened.path.clone() {
        Some(path) => along::measure(&mut watch, path.frames, |frame| path.pose(frame)),
        None => {
            let rows_of_pixels = size[1];
            let scene = cell.scene.replace('/', "-");
            let named = format!("vt.feedback-{scene}-{rows_of_pixels}-first-frame-of-one-in-256");
            let mut rows = cut::measure(bench, &named, &mut watch)?;
            rows.extend(times::measure(bench, &watch)?);
            Ok(rows)
        }
    }
}
