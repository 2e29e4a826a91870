//! pm.cpu: the CPU time of a level change.

mod execute;
mod lines;

use super::{scans, session_of};
use crate::figure::prelude::*;
use crate::scene::Scene;
use execute::{
    COPY, FLAT, FLAT_FEW, FLAT_SWAPS, FRAME, LOADED, PRINTED, PRINTED_SWAPS, SPLITS_DOWN, SPLITS_UP, STEP,
};
use lines::{GREEDY, LINES, NO_WEIGHT};

/// A mesh as large as the dragon, and the dragon.
const LARGE: [&str; 2] = ["torus:466", scans::LARGE];

const MOVED: &str = "moved faces for each split";

/// The figure.
pub const CPU: Figure = Figure {
    id: "pm.cpu",
    title: "CPU time of level changes",
    about: "One core executes all splits of a mesh and then all collapses, as the paper's pseudocode and as flat \
            lists, without tswaps and with about 10 and 23 moved faces per split. `bunny` has 3674 faces, `torus:48` \
            9216, `torus:128` 65 536, and `torus:466`, as large as the Stanford dragon, 868 624. The scans \
            `dragon_res4` and, with --full, `dragon` are measured if they have been fetched. The simplifier makes one \
            pass: a second one takes a minute, and with it the rates of splits agreed within their intervals. The \
            paper (headline) says that the CPU's load rises by 20 %, but not relative to what. The figure judges the \
            rise relative to the splits without tswaps, and relative to the host's work for a frame. Rates and times \
            are medians. The frame draws a scene with one instance at a wanted error of one pixel, in a picture of \
            640 x 360 (with --full 1280 x 720), without a level change. The frame's load is the host's time \
            (visibility, levels, recording, submission) plus that of a hundredth of the splits. The whole time until \
            the frame is drawn is shown as well. The figure also counts the 64-byte lines of the index buffer that a \
            split touches, including its share of tswaps, with one level per step. On meshes of up to 100 000 faces \
            they are counted for the paper's greedy too, with and without its weight for lines.",
    scenes: &["bunny", "torus:48", "torus:128", "torus:466", scans::SMALL, scans::LARGE],
    variants,
    paper: &[PRINTED, PRINTED_SWAPS, GREEDY],
    ours: &[FLAT_SWAPS],
    full_only: &[scans::LARGE],
    sweep: None,
    show: Show::nothing("it times the host's work on levels of detail", "bunny"),
    measure,
    plots: &[Plot::bars(SPLITS_UP).log_y(), Plot::bars(STEP).log_y().floor(COPY)],
    claims: &[
        Claim::ours_timed(
            "rate",
            "With 23 moved faces per split, one core executes 20 million splits per second, and as many \
             collapses, on meshes up to 100 000 faces.",
            &Test::values([one(SPLITS_UP, FLAT_SWAPS), one(SPLITS_DOWN, FLAT_SWAPS)], AtLeast(20.0)),
        )
        .at(Places::except(&LARGE)),
        Claim::ours_timed(
            "rate-large",
            "On a mesh as large as the dragon, one core executes 12 million splits per second, and as many \
             collapses.",
            &Test::values([one(SPLITS_UP, FLAT_SWAPS), one(SPLITS_DOWN, FLAT_SWAPS)], AtLeast(12.0)),
        )
        .at(Places::scenes(&LARGE)),
        Claim::ours_timed(
            "flat",
            "Flat lists execute splits and collapses at least 1.5 times as fast as the pseudocode.",
            &[
                Test::ratio_of(SPLITS_UP, [FLAT_SWAPS, PRINTED_SWAPS], AtLeast(1.5)),
                Test::ratio_of(SPLITS_DOWN, [FLAT_SWAPS, PRINTED_SWAPS], AtLeast(1.5)),
            ],
        ),
        Claim::paper_timed(
            "headline",
            "load-of-splits",
            "The extension raises the CPU's load by 20 %: relative to splits without tswaps, in pseudocode.",
            &[Test::ratio_of(STEP, [PRINTED_SWAPS, PRINTED], AtMost(1.2))],
        ),
        Claim::paper_timed(
            "headline",
            "load-of-frames",
            "The extension raises the CPU's load by 20 %: relative to the host's work for a drawn frame that \
             executes a hundredth of the splits, in pseudocode.",
            &[Test::ratio_of(LOADED, [PRINTED_SWAPS, PRINTED], AtMost(1.2))],
        ),
        Claim::ours_timed(
            "our-load-of-frames",
            "With flat lists, tswaps raise the host's work for a drawn frame that executes a hundredth of \
             the splits by at most 20 %.",
            &[Test::ratio_of(LOADED, [FLAT_SWAPS, FLAT], AtMost(1.2))],
        ),
        Claim::paper(
            "5",
            "lines",
            "With its weight for CPU cache lines that were touched before, the paper's greedy touches fewer \
             lines.",
            &[Test::ratio_of(LINES, [NO_WEIGHT, GREEDY], Above(1.0))],
        ),
    ],
};

fn variants() -> Vec<String> {
    let execution = [PRINTED, PRINTED_SWAPS, FLAT, FLAT_FEW, FLAT_SWAPS, COPY, FRAME];
    execution.into_iter().chain([GREEDY, NO_WEIGHT]).map(String::from).collect()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let gpu = bench.gpu(&[])?;
    let orders = execute::Orders::of(&cell.scene)?;
    let size = bench.effort_of([640, 360], [1280, 720]);
    // One instance of one metre, as in the scene.
    let pose = Scene::embedded("bunny")?.camera("near")?.pose();
    let mut session = (session_of(&gpu, &orders.best.mesh, size, |_| ())?, pose);
    let timed = bench.interleave(&gpu, execute::contenders(&mut session, &orders))?;
    let mut rows = execute::time_rows(orders.best.mesh.last_level(), &timed);
    rows.extend(execute::count_rows(&orders));
    if orders.best.program.faces().len() <= 100_000 {
        rows.extend(lines::weighed_rows(&cell.scene)?);
    }
    rows.extend(execute::herd_rows(orders.best.program)?);
    Ok(rows)
}
