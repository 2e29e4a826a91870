//! vt.feedback: what subsampled feedback, which engines ship, misses of the exact list, and for how long.

mod along;
mod cut;
mod times;
mod watch;

use super::common::{Place, pixels_of};
use crate::figure::claim::{Bound::Above, Bound::AtLeast, Bound::Below, Claim, Part, Test, each, one};
use crate::figure::{Bench, Cell, Figure, Plot, Row, Sweep};
use crate::paper::virtual_texture::U1Format;
use watch::{SUBSAMPLINGS, Watch, name};

pub const FEEDBACK: Figure = Figure {
    id: "vt.feedback",
    title: "Subsampled feedback beside the exact list",
    about: "The paper lists every tile that a frame's pixels name, in that frame (section 2). Engines look at one pixel \
            of 4 to 256, another one in each frame, and collect: Call of Duty 1 of 64, Unreal Engine 5 1 of 256. How many \
            of the exact list's tiles does that find (recall), how many frames after a cut (delay), and how much of what \
            a moving camera's memory still asks for is visible (precision)? A delay counts from the first frame that is drawn \
            after the cut, whose own list has delay 1; after frame n the lists of frames 1 to n are known. The two frames until \
            any list reaches the host come on top for all, the exact one too. Times are of gathering the samples, copying them to \
            the host and listing them there; \"all pixels\" is the copy of U1 and the same pass over it. Pictures: what one pixel of \
            256 has not named in the first frame, in red.",
    scenes: &["earth/headline", "earth/oblique", "globe/africa", "earth/pan", "earth/dive", "earth/orbit"],
    variants,
    sweep: Some(Sweep { name: "picture height, pixels", quick: &[720.0], full: &[360.0, 720.0, 1080.0] }),
    measure,
    plots: &[
        Plot::curves(RECALL, "frames after a cut").log_x(),
        Plot::curves(PIXELS, "frames after a cut").log_x(),
        Plot::bars(MOVING_RECALL),
        Plot::bars(MOVING_PRECISION),
        Plot::bars(TIME).log_y().floor("empty pass"),
    ],
    claims: &[
        Claim::paper(
            "2",
            "delay",
            "The exact list has at once what one pixel of 64 or of 256 takes several frames for: in every place more than \
             one until all tiles are listed, in the median over all frames of the cycle to start in.",
            &[Test::value(each(TO_ALL, || [6, 8].map(name).into()), Above(1.0))],
        ),
        Claim::ours(
            "moving",
            "Under a moving camera no memory mends that: what one frame's pixels of 256 see lacks visible tiles in some \
             frames of every path, and most of what a whole cycle remembers is visible no more.",
            &[
                Test::value(one(MOVING_RECALL, "1/256").part(Part::Least), Below(1.0)),
                Test::value(one(MOVING_PRECISION, "1/256"), Below(0.5)),
            ],
        ),
        Claim::ours(
            "cost",
            "In return a list from one pixel of 64 takes at most a tenth of the time of one from all pixels.",
            &[Test::ratio(one(TIME, ALL_PIXELS), one(TIME, "1/64"), AtLeast(10.0))],
        )
        .timed(),
    ],
};

const RECALL: &str = "recall after a cut";
const PIXELS: &str = "pixels served after a cut";
const TO_ALL: &str = "frames to all tiles";
const MOVING_RECALL: &str = "recall of one moving frame";
const MOVING_PRECISION: &str = "precision of a moving cycle";
const TIME: &str = "gather, copy and list";
const ALL_PIXELS: &str = "all pixels";

fn variants() -> Vec<String> {
    SUBSAMPLINGS.map(name).into_iter().chain([ALL_PIXELS.to_string()]).collect()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let size = pixels_of(cell.x.expect("the sweep has values"));
    let opened = Place::find(&cell.scene)?.open(bench, size, |settings| {
        // No tile is ever streamed here; and who copies U1 packs it.
        settings.streaming.gpu_tiles = 1;
        settings.config.u1 = Some(U1Format::Packed);
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
