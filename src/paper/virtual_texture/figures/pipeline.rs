//! vt.pipeline: the whole frame, pass by pass, of the paper's method, later variants and the baselines.

use super::common::{PAPERS, SceneView, pixels_of};
use super::cost::{FRAME, LIST};
use super::side_by_side::{Combination, PLAIN, SideBySide, THE_PAPER, UNLISTED, combinations, settings};
use crate::figure::prelude::*;

pub const PIPELINE: Figure = Figure {
    id: "vt.pipeline",
    title: "The whole frame",
    about: "The figure shows the time of a settled frame, pass by pass, with the paper's filter: up to NA = 16 samples \
            along the footprint, in tiles whose border of 16 texels contains them. The variants are: the paper's \
            pipeline; the same with own-level tile addresses; compute shaders in place of geometry shaders and \
            transform feedback; marking in the fragment shader (fused); one draw that textures and stores the triples \
            in a second colour attachment; and read-back, in which the host makes the list from a copy of the request \
            image. The baselines are the same mesh with one plain texture, of which a pixel takes one trilinear sample, \
            and the fused draw without marking, which shows what fusing adds. The paper (sections 1 and 2) argues that \
            the list of visible tiles should be found entirely on the GPU, and gives no numbers. All frames take \
            turns. Pictures have 1280 x 720 (quick) or 1920 x 1080 pixels; the table has the passes. The figure also has counts that are the same on every device. An instrumented shader counts \
            the texels that the filter fetches per covered pixel. The texels, words, tests, atomics and bytes of \
            stages 2 and 3 are counted from the request image.",
    scenes: &["earth/headline", "earth/oblique", "globe/africa"],
    variants,
    paper: &["paper"],
    ours: &["fused, exact"],
    show: Show::scenes(PAPERS).variants(|| settings(&combinations())),
    measure,
    plots: &[Plot::bars(FRAME).floor(PLAIN)],
    claims: &[
        Claim::paper_timed(
            "1 and 2",
            "gpu-list",
            "A frame that finds the visible tiles on the GPU is faster than one that reads the request image back and \
             finds them on the CPU.",
            &[Test::ratio(
                best(FRAME, || those(Combination::is_read_back)),
                one(FRAME, THE_PAPER),
                Above(1.0),
            )],
        ),
        Claim::ours_timed(
            "our-gpu-list",
            "The best exact variant's frame is also faster than every frame with read-back.",
            &[Test::ratio(best(FRAME, || those(Combination::is_read_back)), best(FRAME, exact), Above(1.0))],
        ),
        Claim::ours_timed(
            "three-times",
            "The best exact variant finds the list (stages 2 and 3 together, or what fusing adds to the draw) at \
            least 3 times faster than the paper's best pair: a geometry shader over blocks of 8 x 8 pixels with \
            memo, and transform feedback over blocks of 4 x 4 texels.",
            &[Test::ratio(
                one(LIST, THE_PAPER),
                best(LIST, || those(|c| c.is_ours() && c.name != THE_PAPER)),
                AtLeast(3.0),
            )],
        ),
        Claim::ours_timed(
            "fusing-adds",
            "A frame without a separate stage 1 that finds the exact list (fused, or with the triples in a second \
             colour attachment) takes at most 15 % more than one that only textures.",
            &[Test::ratio(
                best(FRAME, || those(|c| c.is_ours() && c.config.finds_while_texturing())),
                one(FRAME, UNLISTED),
                AtMost(1.15),
            )],
        ),
        Claim::ours_timed(
            "twice-plain",
            "With the best exact variant a settled frame takes at most twice the time of the same mesh with one plain \
             trilinear texture.",
            &[Test::ratio(best(FRAME, exact), one(FRAME, PLAIN), AtMost(2.0))],
        ),
    ],
    ..Figure::BASE
};

fn variants() -> Vec<String> {
    let names = combinations().into_iter().map(|combination| combination.name.to_string());
    names.chain([PLAIN, UNLISTED].map(String::from)).collect()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let size = pixels_of(bench.effort_of(720.0, 1080.0));
    let mut frames = SideBySide::settled(
        bench,
        SceneView::find(&cell.scene)?,
        size,
        (&combinations(), &[PLAIN, UNLISTED]),
        |_| (),
    )?;
    frames.rows(bench)
}

/// Names of the combinations for which `keep` holds.
fn those(keep: impl Fn(&Combination) -> bool) -> Vec<String> {
    combinations().iter().filter(|c| keep(c)).map(|c| c.name.to_string()).collect()
}

fn exact() -> Vec<String> {
    those(Combination::is_ours)
}
