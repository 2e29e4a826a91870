//! tm.25: error and cost of filtered parallax mapping.

use super::contender::pass;
use crate::figure::claim::Bound::{AtLeast, AtMost, Below};
use crate::figure::claim::{Places, Test, one};
use crate::figure::{Bench, Cell, Claim, Contender, Effort, Figure, Plot, Row, Sweep};
use crate::paper::texture_mapping::relief::ReliefKind;
use crate::paper::texture_mapping::relief::parallax::{ParallaxFilter, ParallaxView, truth};
use crate::paper::texture_mapping::relief::pass::FilteredRelief;
use anyhow::Context;

pub const PARALLAX: Figure = Figure {
    id: "tm.25",
    title: "Parallax mapping with filtering",
    about: "Figure 25 of the thesis: filtering only those texels of the footprint that the relief does not hide is \
            more accurate (by expert ratings) and 5.1 % slower. The view is parallel, along x, on `bricks`, \
            `pillars`, `spikes` and `rock` with 64 texels a side and random colours. A pixel is 4 x 4 texels of the \
            top plane. The truth is the mean of exact intersections, 48 x 48 per pixel (quick: 24 x 24). The \
            difference between this truth and one with half as many samples in each direction shows the truth's own \
            error. Errors are NMSE over one period of the relief. The texel count includes the filter and the search \
            for hidden texels, but not the search for the footprint's ends.",
    scenes: &["bricks", "pillars", "spikes", "rock"],
    variants: || {
        ParallaxFilter::ALL
            .map(|method| method.name().to_string())
            .into_iter()
            .chain([FLOOR.to_string()])
            .collect()
    },
    paper: &["visible texels"],
    ours: &["projected width"],
    full_only: &[],
    sweep: Some(Sweep {
        name: "elevation, degrees",
        quick: &[15.0, 30.0, 60.0],
        full: &[15.0, 30.0, 45.0, 60.0, 80.0],
    }),
    measure,
    plots: &[
        Plot::sweep(ERROR).log_y().floor(FLOOR),
        Plot::sweep(TIME).log_y().floor("empty pass"),
        Plot::sweep(TEXELS).log_y(),
    ],
    claims: &[
        Claim::paper(
            "claim 6",
            "accurate",
            "Filtering only the visible texels of the footprint is more accurate than filtering all of them.",
            &[Test::ratio(one(ERROR, "visible texels"), one(ERROR, "whole footprint"), Below(1.0))],
        ),
        Claim::paper(
            "claim 6, figure 25",
            "5-percent",
            "Finding the visible texels costs at most 5.1 % of the speed.",
            &[Test::ratio(one(TIME, "whole footprint"), one(TIME, "visible texels"), AtLeast(0.949))],
        )
        .timed(),
        Claim::ours(
            "projected-width",
            "At 30 degrees on bricks and rock, weights by projected width have at most 1/5 of the error of \
             the visible texels.",
            &[Test::ratio(one(ERROR, "projected width"), one(ERROR, "visible texels"), AtMost(0.2))],
        )
        .at(Places::scenes(&["bricks", "rock"]).x(30.0, 30.0)),
    ],
};

/// Quantities.
const ERROR: &str = "NMSE";
const TIME: &str = "filtering";
const TEXELS: &str = "texels per pixel";

/// The truth's own error.
const FLOOR: &str = "truth with a quarter of the samples";

const SIDE: usize = 64;
const PIXEL: u32 = 4;

/// NMSE: the sum of squared errors, divided by the sum of squares of the truth.
fn error(found: impl Iterator<Item = f64>, right: &[f64]) -> f64 {
    let squares = found.zip(right).map(|(found, right)| (found - right) * (found - right));
    squares.sum::<f64>() / right.iter().map(|right| right * right).sum::<f64>()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let kind = ReliefKind::ALL.into_iter().find(|kind| kind.name() == cell.scene).context("a relief")?;
    let (relief, elevation_degrees) = (kind.relief(SIDE), cell.x.context("a sweep")?);
    let (columns, samples) = if bench.effort == Effort::Quick { (256, 24) } else { (1024, 48) };
    let colours = relief.colours();
    let view = ParallaxView { elevation_degrees, columns, pixel: f64::from(PIXEL) };
    let period = ParallaxView { columns: SIDE as u32 / PIXEL, ..view };
    let right = truth(&relief, &colours, &period, samples);
    let gpu = bench.gpu(&[])?;
    let make = |method| Ok((method, FilteredRelief::new(&gpu, &relief, &colours, &view, method)?));
    let filters = ParallaxFilter::ALL
        .into_iter()
        .map(make)
        .collect::<anyhow::Result<Vec<(ParallaxFilter, FilteredRelief)>>>()?;
    let contenders: Vec<Contender<'_>> =
        filters.iter().map(|(method, own)| pass(&gpu, method.name(), |cmd| own.run(cmd))).collect();
    let timed = bench.interleave(&gpu, contenders)?;
    let mut rows: Vec<Row> = timed.iter().map(|one| one.row(TIME)).collect();
    for (method, own) in &filters {
        let found = own.read(&gpu)?;
        let of_period =
            |at: usize| found[at / period.columns as usize * columns as usize + at % period.columns as usize];
        let own_error = error((0..right.len()).map(|at| f64::from(of_period(at)[0])), &right);
        let texels = found.iter().map(|pixel| f64::from(pixel[1])).sum::<f64>() / found.len() as f64;
        rows.push(Row::number(method.name(), ERROR, "", own_error));
        rows.push(Row::number(method.name(), TEXELS, "texels", texels));
    }
    let coarse = truth(&relief, &colours, &period, samples / 2);
    rows.push(Row::number(FLOOR, ERROR, "", error(coarse.into_iter(), &right)));
    Ok(rows)
}
