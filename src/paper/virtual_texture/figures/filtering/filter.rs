//! vt.filter: what each filter costs, and how near it comes to what a pixel covers.

use super::super::common::pixels_of;
use super::{Shown, Variant, detail, of_facts};
use crate::figure::{Axis, Bench, Cell, Claim, Effort, Figure, Finding, Origin, Plot, Row, Table, Value};
use crate::paper::virtual_texture::Filtering;
use crate::paper::virtual_texture::config::source_mesh;
use crate::paper::virtual_texture::reference::picture::{Filter, Texels};
use crate::picture::Picture;
use crate::picture::measures::{Comparison, OUTLIER_BOUND};
use crate::picture::write::Srgb8Picture;
use crate::reference::View;
use crate::stats::Summary;

pub const FILTER: Figure = Figure {
    id: "vt.filter",
    title: "Filters: time, error and noise",
    about: "The paper mixes two levels of a tile (section 4) and leaves anisotropic filtering to the hardware, which cannot \
            cross tiles. Here: its trilinear sample; the nearer level alone; NA such samples along the footprint, inside \
            the tile's border; and single texels chosen by chance through the page table, which need no border (Pharr et \
            al. 2024), 1 to 64 a pixel, also along the footprint. Each picture stands against the f64 picture of the same \
            filter (what the device adds: rounding, and noise) and against the f64 mean of all that a pixel covers (what \
            the filter itself is off by). Pixels beyond the landscape and at its outline count on neither side; their share is told. The time \
            is the texturing pass's. 320 x 180 (quick) or 640 x 360 pixels: an f64 picture takes seconds.",
    scenes: &["earth/oblique", "earth/low"],
    variants: || VARIANTS.iter().map(Variant::name).collect(),
    sweep: None,
    measure,
    plots: &[
        Plot { quantity: AREA_NMSE, x: Axis::Variant, log_x: false, log_y: true, floor: None },
        Plot { quantity: AREA_FLIP, x: Axis::Variant, log_x: false, log_y: false, floor: None },
        Plot { quantity: OWN_NMSE, x: Axis::Variant, log_x: false, log_y: true, floor: None },
        Plot { quantity: TIME, x: Axis::Variant, log_x: false, log_y: true, floor: Some("empty pass") },
    ],
    claims: &[
        Claim {
            id: "anisotropic",
            text: "Each doubling of the samples along the footprint brings the picture nearer to what its pixels cover.",
            from: Origin::Ours,
            check: anisotropic,
        },
        Claim {
            id: "noise",
            text: "The noise of n single texels, 4 to 64, is at most an n-th of one's.",
            from: Origin::Ours,
            check: noise,
        },
        Claim {
            id: "along",
            text: "16 single texels along the footprint, without a border, are nearer to what a pixel covers than the \
                   paper's trilinear sample.",
            from: Origin::Ours,
            check: along,
        },
        Claim {
            id: "one-tap",
            text: "One single texel costs no more time than a trilinear sample.",
            from: Origin::Ours,
            check: one_tap,
        },
    ],
};

const VARIANTS: [Variant; 10] = [
    Variant::new(Filtering::Bilinear, 1, 1),
    Variant::new(Filtering::Trilinear, 1, 1),
    Variant::new(Filtering::Trilinear, 2, 1),
    Variant::new(Filtering::Trilinear, 4, 1),
    Variant::new(Filtering::Trilinear, 8, 1),
    Variant::new(Filtering::Stochastic, 1, 1),
    Variant::new(Filtering::Stochastic, 1, 4),
    Variant::new(Filtering::Stochastic, 1, 16),
    Variant::new(Filtering::Stochastic, 1, 64),
    Variant::new(Filtering::Stochastic, 8, 16),
];

/// Enough for NA = 8.
const BORDER: u32 = 8;

const AREA_NMSE: &str = "NMSE against what pixels cover";
const AREA_FLIP: &str = "FLIP against what pixels cover";
const AREA_PSNR: &str = "PSNR against what pixels cover";
const OWN_NMSE: &str = "NMSE against the same filter in f64";
const OWN_OUTLIERS: &str = "pixels off by more than 5/256 from the same filter in f64";
const EXCUSED: &str = "pixels beyond the landscape or at its outline, left out";
const TIME: &str = "texturing";

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let size = pixels_of(if bench.effort == Effort::Quick { 180.0 } else { 360.0 });
    let mut sessions = Vec::new();
    for max_anisotropy in [1, 2, 4, 8] {
        sessions.push((max_anisotropy, Shown::settle(bench, &cell.scene, size, BORDER, max_anisotropy)?));
    }
    let truths = Truths::new(&sessions[0].1)?;
    let mut rows = Vec::new();
    for variant in &VARIANTS {
        let (_, shown) =
            sessions.iter_mut().find(|(na, _)| *na == variant.max_anisotropy).expect("one for each NA");
        let picture = truths.inside(shown.picture(variant)?);
        let own = Comparison::of(&picture, truths.own(variant))?.measures(OUTLIER_BOUND);
        let area = Comparison::of(&picture, &truths.area)?.measures(OUTLIER_BOUND);
        for (quantity, unit, number) in [
            (AREA_NMSE, "", area.nmse),
            (AREA_FLIP, "", area.flip_mean),
            (AREA_PSNR, "dB", area.psnr_db),
            (OWN_NMSE, "", own.nmse),
            (OWN_OUTLIERS, "pixels", own.outliers as f64),
        ] {
            rows.push(Row::new(variant.name(), quantity, unit, Value::Number(number)));
        }
        show(bench, cell, &variant.name(), &picture)?;
    }
    let excused = truths.inside.iter().filter(|inside| !**inside).count();
    let share = Value::Number(100.0 * excused as f64 / truths.inside.len() as f64);
    rows.push(Row::new("what pixels cover", EXCUSED, "% of the pixels", share));
    show(bench, cell, "what pixels cover", &truths.area)?;
    let contenders = VARIANTS.iter().map(|variant| {
        let (_, shown) =
            sessions.iter().find(|(na, _)| *na == variant.max_anisotropy).expect("one for each NA");
        shown.contender(variant)
    });
    let contenders = contenders.collect::<anyhow::Result<Vec<_>>>()?;
    let timed = bench.interleave(&sessions[0].1.opened.session.gpu, contenders)?;
    rows.extend(timed.iter().map(|timed| timed.row(TIME)));
    Ok(rows)
}

/// The whole picture small, and its middle enlarged.
fn show(bench: &mut Bench, cell: &Cell, name: &str, picture: &Picture) -> anyhow::Result<()> {
    let name = format!("vt.filter-{}-{}", cell.scene.replace('/', "-"), name.replace(' ', "-"));
    if name.ends_with("what-pixels-cover") {
        bench.picture(&format!("{name}-whole"), &Srgb8Picture::from(picture))?;
    }
    bench.picture(&name, &detail(picture, [picture.width / 2, picture.height / 2], 4))
}

/// The f64 pictures of one view.
struct Truths {
    area: Picture,
    /// Bilinear, and NA = 1, 2, 4, 8.
    nearer_level: Picture,
    samples: Vec<(u32, Picture)>,
    /// Pixels that the landscape covers wholly, as far as their neighbours tell.
    inside: Vec<bool>,
}

impl Truths {
    fn new(shown: &Shown) -> anyhow::Result<Truths> {
        let (session, pose) = (&shown.opened.session, &shown.opened.pose);
        let [width, height] = session.technique.settings.size;
        let mesh = source_mesh(&shown.opened.scene)?;
        let view = View::new(&mesh, &pose.world_to_clip(width, height), pose.eye, [width, height]);
        let covered: Vec<bool> = view.samples().iter().map(Option::is_some).collect();
        let at = |x: u32, y: u32| covered[(y * width + x) as usize];
        let around = |n: u32| {
            let (x, y) = (n % width, n / width);
            let [left, top] = [x.saturating_sub(1), y.saturating_sub(1)];
            let [right, bottom] = [(x + 1).min(width - 1), (y + 1).min(height - 1)];
            (top..=bottom).all(|y| (left..=right).all(|x| at(x, y)))
        };
        let inside: Vec<bool> = (0..width * height).map(around).collect();
        let texels = Texels::new(&*session.technique.source);
        let picture =
            |filter| -> anyhow::Result<Picture> { Ok(blacken(texels.picture(&view, filter)?, &inside)) };
        let samples = [1, 2, 4, 8].map(|most| Ok((most, picture(Filter::Samples(most))?)));
        Ok(Truths {
            area: picture(Filter::Area)?,
            nearer_level: picture(Filter::NearerLevel)?,
            samples: samples.into_iter().collect::<anyhow::Result<_>>()?,
            inside,
        })
    }

    fn inside(&self, picture: Picture) -> Picture {
        blacken(picture, &self.inside)
    }

    fn own(&self, variant: &Variant) -> &Picture {
        let samples = self.samples.iter().find(|(most, _)| *most == variant.max_anisotropy);
        match variant.filter {
            Filtering::Bilinear => &self.nearer_level,
            _ => &samples.expect("one for each NA").1,
        }
    }
}

/// Black where the landscape's outline passes: neither side of a comparison counts there.
fn blacken(mut picture: Picture, inside: &[bool]) -> Picture {
    for (pixel, _) in picture.rgba.iter_mut().zip(inside).filter(|(_, inside)| !**inside) {
        *pixel = [0.0, 0.0, 0.0, 1.0];
    }
    picture
}

/// A number of several variants in each scene, as words, and what `holds` of them.
fn scenes(
    table: &Table,
    quantity: &str,
    of: &[Variant],
    holds: impl Fn(&[f64]) -> bool,
) -> (Vec<bool>, String) {
    let (mut facts, mut words) = (Vec::new(), Vec::new());
    for scene in FILTER.scenes {
        let numbers: Option<Vec<f64>> =
            of.iter().map(|v| table.number(scene, None, &v.name(), quantity)).collect();
        let Some(numbers) = numbers else { continue };
        facts.push(holds(&numbers));
        let each = of.iter().zip(&numbers).map(|(v, number)| format!("{} {number:.3e}", v.name()));
        words.push(format!("{scene}: {}", each.collect::<Vec<_>>().join(", ")));
    }
    (facts, words.join("; "))
}

fn anisotropic(table: &Table) -> Finding {
    let (facts, words) =
        scenes(table, AREA_NMSE, &VARIANTS[1..5], |nmse| nmse.windows(2).all(|pair| pair[1] < pair[0]));
    of_facts(&facts, words, "NMSE against the f64 mean of the footprint, from one sample to eight")
}

fn noise(table: &Table) -> Finding {
    // 1, 4, 16, 64.
    let in_proportion =
        |nmse: &[f64]| nmse.iter().zip([1.0, 4.0, 16.0, 64.0]).all(|(n, taps)| n * taps <= nmse[0]);
    let (facts, words) = scenes(table, OWN_NMSE, &VARIANTS[5..9], in_proportion);
    of_facts(
        &facts,
        words,
        "NMSE against the f64 trilinear picture, which is their mean; each beside that of one texel",
    )
}

fn along(table: &Table) -> Finding {
    let (facts, words) = scenes(table, AREA_NMSE, &[VARIANTS[1], VARIANTS[9]], |nmse| nmse[1] < nmse[0]);
    of_facts(&facts, words, "noise included; NMSE against the f64 mean of the footprint")
}

fn one_tap(table: &Table) -> Finding {
    let summary = |scene: &str, variant: &Variant| match table.value(scene, None, &variant.name(), TIME) {
        Some(Value::Summary(summary)) => Some(*summary),
        _ => None,
    };
    let pairs: Vec<(&str, Summary, Summary)> = FILTER
        .scenes
        .iter()
        .filter_map(|scene| Some((*scene, summary(scene, &VARIANTS[5])?, summary(scene, &VARIANTS[1])?)))
        .collect();
    let words = pairs.iter().map(|(scene, tap, trilinear)| {
        format!(
            "{scene}: {:.2} ms against {:.2} ms, {:.2}x",
            tap.median,
            trilinear.median,
            tap.median / trilinear.median
        )
    });
    let words = words.collect::<Vec<_>>().join("; ");
    // Medians, unless the ranges p5 to p95 overlap: then neither is the dearer one.
    let within = |tap: &Summary, t: &Summary| tap.p5 <= t.p95 && t.p5 <= tap.p95;
    let facts: Vec<bool> = pairs.iter().map(|(_, tap, t)| tap.median <= t.median || within(tap, t)).collect();
    let count =
        |holds: &dyn Fn(&Summary, &Summary) -> bool| pairs.iter().filter(|(_, a, b)| holds(a, b)).count();
    let why = format!(
        "medians of the texturing pass: the tap is cheaper in {} of {} scenes, dearer in {}, and in {} the ranges p5 to p95 \
         overlap, which counts as equal",
        count(&|tap, t| !within(tap, t) && tap.median < t.median),
        pairs.len(),
        count(&|tap, t| !within(tap, t) && tap.median > t.median),
        count(&within)
    );
    of_facts(&facts, words, &why)
}

#[cfg(test)]
mod tests {
    use super::super::super::judge::tests::table;
    use super::*;
    use crate::figure::Verdict;

    #[test]
    fn one_taps_reason_is_what_its_numbers_say() {
        let [tap, trilinear] = [VARIANTS[5].name(), VARIANTS[1].name()];
        let found = |ms| {
            let rows = FILTER
                .scenes
                .iter()
                .flat_map(|scene| [(*scene, None, &*tap, TIME, ms), (*scene, None, &*trilinear, TIME, 1.0)]);
            one_tap(&table("cpu", &rows.collect::<Vec<_>>()))
        };
        for (ms, verdict, words) in [
            (0.5, Verdict::Reproduced, "cheaper in 2 of 2 scenes, dearer in 0, and in 0"),
            (1.01, Verdict::Reproduced, "cheaper in 0 of 2 scenes, dearer in 0, and in 2"),
            (2.0, Verdict::NotReproduced, "cheaper in 0 of 2 scenes, dearer in 2, and in 0"),
        ] {
            let finding = found(ms);
            assert_eq!(finding.verdict, verdict);
            assert!(finding.why.contains(words), "{}", finding.why);
        }
    }
}
