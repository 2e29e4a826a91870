//! tm.18: time of the thesis's anisotropic filter with each form of the coordinates.

use super::coordinates::tilt_and_size;
use super::lab::{Lab, TEXELS, TIME};
use super::methods::{PAPER_BY_LEVEL, THESIS};
use super::shown::tilted_boards;
use crate::figure::prelude::*;
use crate::paper::texture_mapping::method::Coordinates;
use crate::paper::texture_mapping::plane::{Tilt, TiltedPlane};
use crate::picture::error::compare;
use crate::reference::pattern::Pattern;

pub const ANISOTROPIC: Figure = Figure {
    id: "tm.18",
    title: "Anisotropic filtering with each form of the coordinates",
    about: "Figure 18 of the thesis: EWA with incremental ellipse parameters (formula (9)) on modified Heckbert \
            coordinates is 8 % faster than with modified coordinates alone, and 18 % faster than with textbook \
            coordinates (up to 40 % at small tilts). The filter is formula (4) with the axes from the rows of the \
            Jacobian, at the level that the minor axis selects. `textbook` evaluates nine coefficients at the pixel \
            and at its right and lower neighbours. `modified` reads the row's constants at the pixel and reaches the \
            neighbours by additions. `incremental` computes the numerators of the derivatives from the row's \
            constants. All three give the same forward differences. `analytic` (ours) uses the derivatives at the \
            pixel's centre. A plane of 1/f noise fills the picture, tilted by 0 to 80 degrees (`tilt 0`, `tilt 30`, \
            `tilt 60`, `tilt 80`) and rolled by 20. All forms fetch nearly the same texels, and the fetches dominate \
            the time. A plot shows the time with textbook coordinates over each form's time, and as a line the \
            thesis's 1.18.",
    scenes: &["tilt 0", "tilt 30", "tilt 60", "tilt 80"],
    variants: || FORMS.map(|(name, _)| name).into_iter().chain([THESIS]).map(String::from).collect(),
    paper: &[INCREMENTAL],
    sweep: Some(Sweep {
        name: "screen area, 10^6 pixels",
        quick: &[0.02, 0.05],
        full: &[0.1, 0.3, 0.5, 0.7, 0.9],
    }),
    show: Show::views(|| tilted_boards(&[0.0, 30.0, 60.0, 80.0])),
    measure,
    plots: &[Plot::sweep(TIME).floor("empty pass"), Plot::sweep(GAIN).floor(THESIS), Plot::sweep(TEXELS)],
    claims: &[
        Claim::paper_timed(
            "claim 5, figure 18",
            "18-percent",
            "Incremental ellipse parameters are 18 % faster than textbook coordinates.",
            &[Test::ratio_of(TIME, [TEXTBOOK, INCREMENTAL], AtLeast(THESIS_GAIN))],
        ),
        Claim::paper_timed(
            "claim 5, figure 18",
            "8-percent",
            "Incremental ellipse parameters are 8 % faster than modified coordinates alone.",
            &[Test::ratio_of(TIME, [MODIFIED, INCREMENTAL], AtLeast(1.08))],
        ),
        Claim::paper_timed(
            "claim 5, figure 18",
            "40-percent",
            "In some views with small tilts, incremental ellipse parameters are 40 % faster than textbook \
            coordinates (the thesis: \"up to 40 %\").",
            &[Test::ratio_of(TIME, [TEXTBOOK, INCREMENTAL], AtLeast(1.4))],
        )
        .at(Places::scenes(&["tilt 0", "tilt 30"]))
        .somewhere(),
        Claim::ours(
            "same-picture",
            "All forms give the same picture: an NMSE of at most 1e-3 against the analytic derivatives.",
            &[Test::value(each(OFF, others), AtMost(1e-3))],
        ),
    ],
    ..Figure::BASE
};

const GAIN: &str = "time with textbook coordinates over the form's";
const OFF: &str = "NMSE against the analytic derivatives";

/// Incremental parameters are 18 % faster than textbook coordinates.
const THESIS_GAIN: f64 = 1.18;

const TEXTBOOK: &str = "textbook";
const MODIFIED: &str = "modified";
const INCREMENTAL: &str = "incremental";
const ANALYTIC: &str = "analytic";

const FORMS: [(&str, Coordinates); 4] = [
    (ANALYTIC, Coordinates::Analytic),
    (TEXTBOOK, Coordinates::Textbook),
    (MODIFIED, Coordinates::Rows),
    (INCREMENTAL, Coordinates::Incremental),
];

fn others() -> Vec<String> {
    FORMS[1..].iter().map(|(name, _)| name.to_string()).collect()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let (tilt, size) = tilt_and_size(cell)?;
    let plane: TiltedPlane = Tilt { roll_degrees: 20.0, ..Tilt::of(tilt) }.plane(size[1]);
    let lab = Lab::new(&bench.gpu(&[])?, Pattern::PinkNoise, size)?;
    let pass = |(name, form): (&str, Coordinates)| {
        Ok((name.to_string(), lab.pass_by(&PAPER_BY_LEVEL, form, &plane)?))
    };
    let passes = FORMS.map(pass).into_iter().collect::<anyhow::Result<Vec<_>>>()?;
    let mut rows = Vec::new();
    let mut analytic = None;
    for (name, pass) in &passes {
        let shown = lab.show(pass, &plane, 0)?;
        rows.push(Row::number(&**name, TEXELS, "texels", shown.fetched));
        match &analytic {
            None => analytic = Some(shown.picture),
            Some(analytic) => {
                rows.push(Row::number(&**name, OFF, "", compare(&shown.picture, analytic)?.nmse()));
            }
        }
    }
    let timed = lab.times_of(bench, &passes, &[plane])?;
    rows.extend(timed.iter().map(|timed| lab.time_row(timed, 1)));
    rows.push(Row::number(THESIS, GAIN, "", THESIS_GAIN));
    rows.extend(Timed::gains(&timed, TEXTBOOK, GAIN));
    Ok(rows)
}
