//! tm.pareto: what each filter costs and what error it makes, all on one chart.

use super::lab::{GAUSSIAN, Lab, errors, excused, geometric_mean, short};
use super::methods::{self, OURS};
use crate::figure::{
    Axis, Bench, Cell, Claim, Effort, Figure, Finding, Origin, Plot, Row, Table, Value, Verdict,
};
use crate::paper::texture_mapping::method::Method;
use crate::paper::texture_mapping::plane::{Plane, Tilt};
use crate::picture::write::Srgb8Picture;
use crate::reference::pattern::Pattern;
use crate::reference::supersample::{Kernel, Truth};

pub const PARETO: Figure = Figure {
    id: "tm.pareto",
    title: "Filters: time and texels against error",
    about: "18 cases (`planes`): checker of 2 texels, zone plate and 1/f noise on a plane at 0, 30, 60, 70, 75 and 80 degrees of tilt, 16 \
            degrees from edge to edge, one texel a pixel at the centre. The truth is the f64 mean of thousands of stratified samples a pixel \
            under a Gaussian of sigma 0.5 pixels cut at one pixel, the kernel of EWA filters; its own error is the line that no method can \
            pass. A box of one pixel is the second truth: box-like filters are nearer to it. NMSE is the geometric mean over the cases. \
            Texels fetched a pixel are the cost that no device changes; samplers of the device count none. The time is the mean over the \
            six tilts of 1/f noise. 96 x 72 (quick) or 256 x 192 pixels. On a software device the sampler's anisotropic filter is an EWA \
            scan, which is shown under that name and never as a GPU's.",
    scenes: &["planes"],
    variants: || {
        methods::all().into_iter().map(|(name, _)| name).chain([FLOOR.into(), FRONT.into()]).collect()
    },
    sweep: None,
    measure,
    plots: &[
        Plot {
            quantity: BY_TEXELS,
            x: Axis::Series("texels fetched a pixel"),
            log_x: true,
            log_y: true,
            floor: None,
        },
        Plot { quantity: BY_TIME, x: Axis::Series("NMSE"), log_x: true, log_y: true, floor: None },
        Plot { quantity: NMSE, x: Axis::Variant, log_x: false, log_y: true, floor: Some(FLOOR) },
        Plot { quantity: BOX, x: Axis::Variant, log_x: false, log_y: true, floor: Some(FLOOR) },
        Plot { quantity: FLIP, x: Axis::Variant, log_x: false, log_y: false, floor: None },
        Plot { quantity: TIME, x: Axis::Variant, log_x: false, log_y: true, floor: Some("empty pass") },
    ],
    claims: &[
        Claim {
            id: "best",
            text: "Our filter: an NMSE of at most 1e-4 with at most 100 texels a pixel, and at most 1e-3 in the worst case.",
            from: Origin::Ours,
            check: |table| within(table, OURS, 1e-4, 1e-3, 100.0),
        },
        Claim {
            id: "cheap",
            text: "A cheap setting of it: an NMSE of at most 5e-4 with at most 32 texels a pixel.",
            from: Origin::Ours,
            check: |table| within(table, CHEAP, 5e-4, f64::INFINITY, 32.0),
        },
        Claim {
            id: "front",
            text: "At equal counts of texels no baseline lies below our front.",
            from: Origin::Ours,
            check: front_holds,
        },
        Claim {
            id: "truth",
            text: "The truth's own error is at most a tenth of the best filter's.",
            from: Origin::Ours,
            check: truth_holds,
        },
    ],
};

const CHEAP: &str = "ellipse, ratio 4";
const FLOOR: &str = "the truth's own error";
const FRONT: &str = "front of all";

const NMSE: &str = "NMSE";
const WORST_CASE: &str = "NMSE of the worst case";
const BOX: &str = "NMSE against a box";
const FLIP: &str = "FLIP";
const WORST_PIXEL: &str = "worst pixel";
const TEXELS: &str = "texels fetched a pixel";
const TIME: &str = "time a pixel";
const BY_TEXELS: &str = "NMSE by texels";
const BY_TIME: &str = "time by NMSE";

const PATTERNS: [Pattern; 3] = [Pattern::Checker(2), Pattern::ZonePlate, Pattern::PinkNoise];
const TILTS: [f64; 6] = [0.0, 30.0, 60.0, 70.0, 75.0, 80.0];

/// A method's numbers in the cases so far.
#[derive(Default)]
struct Score {
    nmse: Vec<f64>,
    of_box: Vec<f64>,
    flip: Vec<f64>,
    worst: f64,
    fetched: Vec<f64>,
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let size = if bench.effort == Effort::Quick { [96, 72] } else { [256, 192] };
    let gpu = bench.gpu(&[])?;
    let (present, absent): (Vec<_>, Vec<_>) =
        methods::all().into_iter().partition(|(name, method)| excused(&gpu, name, method).is_none());
    let planes = TILTS.map(|tilt| Tilt::of(tilt).plane(size[1]));
    let mut scores: Vec<Score> = present.iter().map(|_| Score::default()).collect();
    let mut floors = Vec::new();
    for pattern in PATTERNS {
        let lab = Lab::new(&gpu, pattern, size)?;
        let truths: Vec<[Truth; 2]> = planes
            .iter()
            .map(|plane| [GAUSSIAN, Kernel::Box].map(|kernel| lab.truth(plane, kernel)))
            .collect();
        floors.extend(truths.iter().map(|[truth, _]| truth.own_nmse));
        for ((name, method), score) in present.iter().zip(&mut scores) {
            score_of(&lab, method, &planes, &truths, score)?;
            if pattern == Pattern::PinkNoise {
                continue;
            }
            let shown = lab.show(&lab.pass(method)?, &planes[5], 0)?;
            let file = format!("tm.pareto-{}-{}-{}", cell.scene, pattern.name(), plain(name));
            bench.picture(&file, &Srgb8Picture::from(&shown.picture))?;
        }
    }
    let mut rows: Vec<Row> =
        present.iter().zip(&scores).flat_map(|((name, _), score)| rows_of(name, score)).collect();
    rows.push(Row::new(FLOOR, NMSE, "", Value::Number(geometric_mean(&floors))));
    rows.push(Row::new(FLOOR, BOX, "", Value::Number(geometric_mean(&floors))));
    for (name, method) in &absent {
        let why = excused(&gpu, name, method).expect("partitioned by it");
        rows.push(Row::new(&**name, NMSE, "", Value::Missing(why.into())));
    }
    rows.push(Row::new(FRONT, BY_TEXELS, "", Value::Series(front(&scores))));
    rows.extend(time_rows(bench, &Lab::new(&gpu, Pattern::PinkNoise, size)?, &present, &planes, &scores)?);
    Ok(rows)
}

fn score_of(
    lab: &Lab,
    method: &Method,
    planes: &[Plane],
    truths: &[[Truth; 2]],
    score: &mut Score,
) -> anyhow::Result<()> {
    let pass = lab.pass(method)?;
    for (plane, [gaussian, of_box]) in planes.iter().zip(truths) {
        let shown = lab.show(&pass, plane, 0)?;
        let found = errors(&shown.picture, gaussian)?;
        score.nmse.push(found.nmse);
        score.flip.push(found.flip);
        score.worst = score.worst.max(found.worst);
        score.of_box.push(errors(&shown.picture, of_box)?.nmse);
        score.fetched.push(shown.fetched);
    }
    Ok(())
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn rows_of(name: &str, score: &Score) -> Vec<Row> {
    let (nmse, fetched) = (geometric_mean(&score.nmse), mean(&score.fetched));
    let number = |quantity, unit, number| Row::new(name, quantity, unit, Value::Number(number));
    let mut rows = vec![
        number(NMSE, "", nmse),
        number(WORST_CASE, "", score.nmse.iter().copied().fold(0.0, f64::max)),
        number(BOX, "", geometric_mean(&score.of_box)),
        number(FLIP, "", mean(&score.flip)),
        number(WORST_PIXEL, "of white", score.worst),
    ];
    // A device's sampler does not tell.
    if fetched > 0.0 {
        rows.push(number(TEXELS, "texels", fetched));
        rows.push(Row::new(name, BY_TEXELS, "", Value::Series(vec![[fetched, nmse]])));
    }
    rows
}

/// (texels, NMSE) of the methods than which none has fewer texels and no larger error, in order of texels.
fn front(scores: &[Score]) -> Vec<[f64; 2]> {
    let mut points: Vec<[f64; 2]> = scores
        .iter()
        .map(|score| [mean(&score.fetched), geometric_mean(&score.nmse)])
        .filter(|[fetched, _]| *fetched > 0.0)
        .collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut least = f64::INFINITY;
    points.retain(|&[_, nmse]| {
        let better = nmse < least;
        least = least.min(nmse);
        better
    });
    points
}

fn time_rows(
    bench: &Bench,
    lab: &Lab,
    methods: &[(String, Method)],
    planes: &[Plane],
    scores: &[Score],
) -> anyhow::Result<Vec<Row>> {
    let timed = lab.times(bench, methods, planes)?;
    let mut rows: Vec<Row> = timed.iter().map(|timed| lab.time_row(timed, planes.len(), TIME)).collect();
    for (row, score) in rows.clone().iter().zip(scores) {
        if let Value::Summary(ns) = row.value {
            let spread = Value::Spreads(vec![(geometric_mean(&score.nmse), ns)]);
            rows.push(Row::new(&*row.variant, BY_TIME, "ns", spread));
        }
    }
    Ok(rows)
}

/// A name as part of a file's.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '.' { c } else { '-' }).collect()
}

/// The one cell's number.
fn number(table: &Table, variant: &str, quantity: &str) -> Option<f64> {
    table.number(PARETO.scenes[0], None, variant, quantity)
}

fn within(table: &Table, variant: &str, most_nmse: f64, most_worst: f64, most_texels: f64) -> Finding {
    let of = |quantity| number(table, variant, quantity);
    let (Some(nmse), Some(worst), Some(texels)) = (of(NMSE), of(WORST_CASE), of(TEXELS)) else {
        return Finding::new(Verdict::NotMeasured, "", format!("{variant} was not measured"));
    };
    let holds = nmse <= most_nmse && worst <= most_worst && texels <= most_texels;
    let numbers = format!("{variant}: {}, worst case {}, {texels:.1} texels", short(nmse), short(worst));
    verdict(holds, numbers, "geometric mean and largest NMSE of the 18 cases")
}

fn verdict(holds: bool, numbers: String, why: &str) -> Finding {
    Finding::new(if holds { Verdict::Reproduced } else { Verdict::NotReproduced }, numbers, why)
}

/// (name, texels, NMSE) of all measured methods that count texels.
fn points(table: &Table) -> Vec<(String, f64, f64)> {
    let of = |(name, _): (String, Method)| {
        let (texels, nmse) = (number(table, &name, TEXELS)?, number(table, &name, NMSE)?);
        Some((name, texels, nmse))
    };
    methods::all().into_iter().filter_map(of).collect()
}

fn front_holds(table: &Table) -> Finding {
    let (ours, others): (Vec<_>, Vec<_>) =
        points(table).into_iter().partition(|(name, ..)| name.starts_with(OURS));
    if ours.is_empty() || others.is_empty() {
        return Finding::new(Verdict::NotMeasured, "", "nothing to compare");
    }
    let beaten =
        |(_, texels, nmse): &(String, f64, f64)| ours.iter().any(|(_, t, e)| t <= texels && e <= nmse);
    let below: Vec<String> = others
        .iter()
        .filter(|other| !beaten(other))
        .map(|(name, texels, nmse)| format!("{name} ({texels:.1} texels, {})", short(*nmse)))
        .collect();
    let (count, of) = (others.len() - below.len(), others.len());
    let numbers = format!("{count} of {of} have a setting of ours with no more texels and no larger error");
    let why = if below.is_empty() { "all".into() } else { format!("not {}", below.join(", ")) };
    let verdict = match below.len() {
        0 => Verdict::Reproduced,
        n if n < of => Verdict::InPart,
        _ => Verdict::NotReproduced,
    };
    Finding::new(verdict, numbers, why)
}

fn truth_holds(table: &Table) -> Finding {
    let best = points(table).into_iter().map(|(.., nmse)| nmse).min_by(f64::total_cmp);
    let (Some(best), Some(floor)) = (best, number(table, FLOOR, NMSE)) else {
        return Finding::new(Verdict::NotMeasured, "", "nothing was measured");
    };
    let numbers = format!("{} beside {}", short(floor), short(best));
    verdict(floor <= best / 10.0, numbers, "half differences of two independent supersamples, geometric mean")
}
