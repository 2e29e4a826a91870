//! vt.pipeline: the whole frame, pass by pass, of the paper and of what came after it.

use super::common::{Place, pixels_of};
use super::cost::{CHEAPER, FRAME, OVER_PLAIN, OVER_UNLISTED};
use super::judge::{Bound, best, judge, on_a_gpu, ratios, why_none, words};
use super::side_by_side::{Combination, PLAIN, SideBySide, THE_PAPER, UNLISTED, combinations};
use crate::figure::{Axis, Bench, Cell, Claim, Effort, Figure, Finding, Origin, Plot, Row, Table};

pub const PIPELINE: Figure = Figure {
    id: "vt.pipeline",
    title: "The whole frame",
    about: "What a settled frame costs, and which pass costs it: the paper's own pipeline, its native keying, compute \
            shaders in place of geometry shaders and transform feedback, marking in the fragment shader, and the \
            classic read-back of U1 with a pass over it on the host; beside them the same mesh with one plain \
            trilinear texture, and the fused draw without its list (one draw, nothing marked), which tells what \
            fusing adds. The paper (sections 1 and 2) argues that the list of visible tiles is best found wholly \
            on the GPU, and gives no numbers. All frames take turns; ratios to the plain frame, to the one without a list and to \
            the paper's list are taken in each turn, and their median and p5 .. p95 are told. 1280 x 720 (quick) or 1920 x 1080 pixels; the table has the passes.",
    scenes: &["earth/headline", "earth/oblique", "globe/africa"],
    variants,
    sweep: None,
    measure,
    plots: &[Plot { quantity: FRAME, x: Axis::Variant, log_x: false, log_y: false, floor: Some(PLAIN) }],
    claims: &[
        Claim {
            id: "gpu-list",
            text: "Finding the visible tiles on the GPU makes a cheaper frame than the classic read-back of U1 and a \
                   pass over it on the CPU.",
            from: Origin::Paper("1 and 2"),
            check: gpu_list,
        },
        Claim {
            id: "three-times",
            text: "The best exact variant finds the list (stages 2 and 3 together, or what fusing adds to the draw) at \
                   least 3 times cheaper than the paper's best: geometry shader with p = 3 and memo, transform feedback \
                   with blocks of 4 x 4.",
            from: Origin::Ours,
            check: three_times,
        },
        Claim {
            id: "fusing-adds",
            text: "Finding the exact list in the draw that textures takes at most 15 % more than one draw that only \
                   textures.",
            from: Origin::Ours,
            check: fusing_adds,
        },
        Claim {
            id: "twice-plain",
            text: "With the best exact variant a settled frame takes at most twice the time of the same mesh with one \
                   plain trilinear texture.",
            from: Origin::Ours,
            check: twice_plain,
        },
    ],
};

fn variants() -> Vec<String> {
    let names = combinations().into_iter().map(|combination| combination.name.to_string());
    names.chain([PLAIN, UNLISTED].map(String::from)).collect()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let size = pixels_of(match bench.effort {
        Effort::Quick => 720.0,
        Effort::Full => 1080.0,
    });
    let mut frames = SideBySide::settled(
        bench,
        Place::find(&cell.scene)?,
        size,
        (&combinations(), &[PLAIN, UNLISTED]),
        |_| (),
    )?;
    let mut rows = frames.time(bench)?;
    rows.extend(frames.lists());
    Ok(rows)
}

/// Names of the combinations for which `keep` holds.
fn those(keep: impl Fn(&Combination) -> bool) -> Vec<String> {
    combinations().iter().filter(|c| keep(c)).map(|c| c.name.to_string()).collect()
}

fn gpu_list(table: &Table) -> Finding {
    let (classic, gpu) = (those(Combination::is_classic), those(Combination::is_ours));
    let found = ratios(table, FRAME, &classic, &gpu);
    on_a_gpu(table, judge(table, Bound::Wins, &found, || why_none(table, FRAME, &classic)))
}

fn three_times(table: &Table) -> Finding {
    let others = those(|c| c.is_ours() && c.name != THE_PAPER);
    let bound = Bound::AtLeast(3.0);
    judge(table, bound, &best(table, CHEAPER, &others, bound), || why_none(table, CHEAPER, &others))
}

fn fusing_adds(table: &Table) -> Finding {
    let fused = |exact| those(|c| c.config.fused() && c.exact == exact);
    let bound = Bound::AtMost(1.15);
    let over = |names: &[String]| best(table, OVER_UNLISTED, names, bound);
    let mut finding =
        judge(table, bound, &over(&fused(true)), || why_none(table, OVER_UNLISTED, &fused(true)));
    let superset = over(&fused(false));
    if !superset.is_empty() {
        finding.numbers += &format!("; without the exactness: {}", words(&superset));
    }
    finding
}

fn twice_plain(table: &Table) -> Finding {
    let exact = those(Combination::is_ours);
    let bound = Bound::AtMost(2.0);
    judge(table, bound, &best(table, OVER_PLAIN, &exact, bound), || why_none(table, OVER_PLAIN, &exact))
}

#[cfg(test)]
mod tests {
    use super::super::judge::tests::table;
    use super::*;
    use crate::figure::Verdict::{NotMeasurable, NotReproduced, Reproduced};

    const NATIVE: &str = "paper, native keying";

    #[test]
    fn three_times_is_judged_by_the_best_exact_variant() {
        let verdict = |ours| {
            let rows = [("s", None, NATIVE, CHEAPER, ours), ("s", None, "fused, exact", CHEAPER, 0.5 * ours)];
            three_times(&table("cpu", &rows)).verdict
        };
        assert_eq!((verdict(3.1), verdict(2.9)), (Reproduced, NotReproduced));
        assert_eq!(three_times(&table("cpu", &[])).verdict, NotMeasurable);
    }

    #[test]
    fn the_gpu_list_is_held_against_the_best_classic_on_a_gpu_alone() {
        let verdict = |kind, ms| {
            let rows = [
                ("s", None, "classic, hash set", FRAME, 40.0),
                ("s", None, "classic, bitmap", FRAME, 10.0),
                ("s", None, THE_PAPER, FRAME, ms),
            ];
            gpu_list(&table(kind, &rows)).verdict
        };
        assert_eq!((verdict("discrete", 8.0), verdict("discrete", 12.0)), (Reproduced, NotReproduced));
        assert_eq!(verdict("cpu", 8.0), NotMeasurable);
        assert_eq!(gpu_list(&table("discrete", &[])).verdict, NotMeasurable);
    }

    #[test]
    fn fusing_adds_what_the_best_exact_one_adds() {
        let verdict = |exact, superset| {
            let rows = [
                ("s", None, "fused, exact", OVER_UNLISTED, 1.3),
                ("s", None, "fused, exact, appending", OVER_UNLISTED, exact),
                ("s", None, "fused", OVER_UNLISTED, superset),
            ];
            fusing_adds(&table("cpu", &rows)).verdict
        };
        assert_eq!(verdict(1.14, 1.2), Reproduced);
        assert_eq!(verdict(1.16, 1.05), NotReproduced, "a superset is not what was promised");
        assert_eq!(fusing_adds(&table("cpu", &[])).verdict, NotMeasurable);
    }

    #[test]
    fn twice_plain_takes_the_cheapest_exact_frame() {
        let verdict = |frame| {
            let rows = [
                ("s", None, THE_PAPER, OVER_PLAIN, 9.0),
                ("s", None, NATIVE, OVER_PLAIN, frame),
                ("s", None, "fused", OVER_PLAIN, 1.5),
            ];
            twice_plain(&table("cpu", &rows)).verdict
        };
        assert_eq!((verdict(1.9), verdict(2.1)), (Reproduced, NotReproduced));
        let superset = [("s", None, "fused", OVER_PLAIN, 1.5)];
        assert_eq!(twice_plain(&table("discrete", &superset)).verdict, NotMeasurable);
    }
}
