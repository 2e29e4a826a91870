//! The report as one self-contained page, with style, plots and pictures.

mod glossary;
mod pictures;
mod tables;
mod trade;

use super::machine::short_commit;
use super::plot::{self, Drawn};
use super::words::human;
use super::{
    CellOutcome, Changes, ClaimResult, Effort, Figure, FigureResult, Machine, Results, Store, Verdict,
};
use glossary::GLOSSARY;
use minijinja::{Environment, HtmlEscape, Value, syntax::SyntaxConfig, value::Serde};
use pictures::PagePicture;
use serde::Serialize;
use tables::TableView;

/// Values of the template.
#[derive(Serialize)]
struct Page<'a> {
    style: String,
    version: &'a str,
    effort: &'static str,
    machines: Vec<MachineView<'a>>,
    commits: Vec<&'a str>,
    counts: Vec<Count>,
    figures: Vec<FigureView<'a>>,
    changes: Option<ChangesView<'a>>,
    failed: usize,
    /// True if the verdicts follow the rules of the program that measured the figures, not today's rules.
    old_verdicts: bool,
    glossary: &'static [(&'static str, &'static str)],
}

#[derive(Serialize)]
struct MachineView<'a> {
    #[serde(flatten)]
    machine: &'a Machine,
    software: bool,
}

/// The number of claims with this verdict.
#[derive(Serialize)]
struct Count {
    name: &'static str,
    class: &'static str,
    count: usize,
}

/// Differences from stored results.
#[derive(Serialize)]
struct ChangesView<'a> {
    #[serde(flatten)]
    changes: &'a Changes,
    /// Ratios of the values, as text.
    ratios: Vec<String>,
}

impl ChangesView<'_> {
    fn of(changes: &Changes) -> ChangesView<'_> {
        let text = |ratio: Option<f64>| ratio.map(|ratio| format!("{}x", human(ratio))).unwrap_or_default();
        ChangesView { changes, ratios: changes.values.iter().map(|value| text(value.ratio)).collect() }
    }
}

#[derive(Serialize)]
struct FigureView<'a> {
    id: &'a str,
    title: &'a str,
    about: Vec<&'a str>,
    /// What a quick run left out.
    left_out: Option<String>,
    claims: Vec<ClaimView<'a>>,
    plots: Vec<PlotView>,
    tables: Vec<TableView>,
    pictures: Vec<PagePicture>,
    /// Pictures of the run that are not in the page.
    pictures_elsewhere: usize,
    /// CSV and JSON of the figure are next to the page.
    has_data: bool,
    failures: Vec<[String; 2]>,
    /// Cells that the run left out, with the reason.
    left_out_cells: Vec<(String, &'a str)>,
    absent: usize,
    cells: usize,
}

#[derive(Serialize)]
struct ClaimView<'a> {
    id: &'a str,
    text: &'a str,
    from: &'a str,
    verdict: &'static str,
    class: &'static str,
    numbers: &'a str,
    why: &'a str,
}

#[derive(Serialize)]
struct PlotView {
    name: String,
    title: String,
    svg: String,
}

const STYLES: [&str; 2] = [include_str!("../plot/plot.css"), include_str!("page.css")];

const TEMPLATE: &str = include_str!("page.html");

/// The CSS class of a verdict.
fn class(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Reproduced | Verdict::BetterThanStated | Verdict::HoldsHere => "yes",
        Verdict::InPart | Verdict::InPartHere => "part",
        Verdict::NotReproduced | Verdict::NotHere => "no",
        Verdict::Undecided | Verdict::NotMeasurable | Verdict::NotMeasured => "open",
    }
}

/// The files next to a page.
#[derive(Clone, Copy)]
pub enum Beside<'a> {
    /// The run's folder, with the figures' data and pictures.
    Run(&'a Store),
    /// Only `results.json` is available.
    Nothing,
}

/// The page of a `results.json`, without pictures, and the ids of its figures that are not in `known`. The page shows
/// the verdicts of the file.
///
/// # Errors
/// Only for a wrong template.
pub fn of_results(results: &Results, known: &[&'static Figure]) -> anyhow::Result<(String, Vec<String>)> {
    let of = |result: &FigureResult| known.iter().copied().find(|figure| figure.id == result.id);
    let (here, gone): (Vec<_>, Vec<_>) =
        results.figures.iter().cloned().partition(|result| of(result).is_some());
    let figures: Vec<&Figure> = here.iter().filter_map(of).collect();
    let results = Results { figures: here, ..results.clone() };
    let page = html(&figures, &results, &plots(&figures, &results), Beside::Nothing, None)?;
    Ok((page, gone.into_iter().map(|result| result.id).collect()))
}

/// The page of `results`, with the plots of each figure.
///
/// # Errors
/// A picture that a result names but that cannot be read.
pub fn html(
    figures: &[&Figure],
    results: &Results,
    plots: &[Vec<Drawn>],
    beside: Beside<'_>,
    changes: Option<&Changes>,
) -> anyhow::Result<String> {
    let mut views = Vec::new();
    for ((figure, result), drawn) in figures.iter().zip(&results.figures).zip(plots) {
        assert_eq!(figure.id, result.id, "results are in the order of their figures");
        let left_out = (results.effort == Effort::Quick).then(|| figure.quick_leaves_out());
        views.push(FigureView { left_out, ..figure_view(figure, result, drawn, beside)? });
    }
    let mut commits: Vec<&str> = results.machines.iter().map(|machine| &*machine.commit).collect();
    commits.dedup();
    let page = Page {
        style: STYLES.concat(),
        version: &results.program_version,
        effort: results.effort.name(),
        machines: results
            .machines
            .iter()
            .map(|machine| MachineView { machine, software: machine.is_software() })
            .collect(),
        commits,
        counts: results
            .counts()
            .map(|(verdict, count)| Count { name: verdict.name(), class: class(verdict), count })
            .collect(),
        changes: changes.map(ChangesView::of),
        old_verdicts: !results.has_rounds(),
        failed: views.iter().map(|view| view.failures.len()).sum(),
        figures: views,
        glossary: GLOSSARY,
    };
    filled("page.html", TEMPLATE, page)
}

/// Fills a template. The ending of `name` turns escaping on.
fn filled(name: &str, template: &str, values: impl Serialize) -> anyhow::Result<String> {
    let mut environment = Environment::new();
    environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?);
    environment.add_filter("code", code);
    environment.add_filter("short", short_commit);
    environment.add_template(name, template)?;
    Ok(environment.get_template(name)?.render(Serde(values))?)
}

/// The text before a pair of backticks, the text between the backticks, and the text after them.
fn pair(text: &str) -> Option<[&str; 3]> {
    let (before, from) = text.split_once('`')?;
    let (word, after) = from.split_once('`')?;
    Some([before, word, after])
}

/// Text as HTML, with `backticks` as code; an unpaired backtick is kept.
fn code(text: &str) -> Value {
    let escaped = HtmlEscape(text).to_string();
    let mut html = String::new();
    let mut rest = &*escaped;
    while let Some([before, word, after]) = pair(rest) {
        html.push_str(&format!("{before}<code>{word}</code>"));
        rest = after;
    }
    Value::from_safe_string(html + rest)
}

fn figure_view<'a>(
    figure: &'a Figure,
    result: &'a FigureResult,
    drawn: &[Drawn],
    beside: Beside<'_>,
) -> anyhow::Result<FigureView<'a>> {
    let failure = |cell: &super::CellRows| match &cell.outcome {
        CellOutcome::Failed(error) | CellOutcome::Crashed(error) => {
            Some([cell.cell.to_string(), error.clone()])
        }
        _ => None,
    };
    let left_out = |cell: &'a super::CellRows| match &cell.outcome {
        CellOutcome::LeftOut(why) => Some((cell.cell.to_string(), &**why)),
        _ => None,
    };
    let plot = |drawn: &Drawn| PlotView {
        name: drawn.name.clone(),
        title: drawn.title.clone(),
        svg: drawn.svg.clone(),
    };
    let mut pictures = Vec::new();
    let names: Vec<&String> = result.cells.iter().flat_map(|cell| &cell.pictures).collect();
    if let Beside::Run(store) = beside {
        for file in &names {
            pictures.push(pictures::shown(&store.pictures(), file)?);
        }
    }
    Ok(FigureView {
        id: figure.id,
        title: figure.title,
        about: figure.about.split("\n\n").map(str::trim).collect(),
        left_out: None,
        claims: result.claims.iter().map(claim_view).collect(),
        plots: drawn.iter().map(plot).collect(),
        tables: tables::of(figure, result),
        pictures_elsewhere: names.len() - pictures.len(),
        pictures,
        has_data: matches!(beside, Beside::Run(_)),
        failures: result.cells.iter().filter_map(failure).collect(),
        left_out_cells: result.cells.iter().filter_map(left_out).collect(),
        absent: result.cells.iter().filter(|cell| cell.outcome == CellOutcome::Absent).count(),
        cells: result.cells.len(),
    })
}

fn claim_view(claim: &ClaimResult) -> ClaimView<'_> {
    let finding = &claim.finding;
    ClaimView {
        id: &claim.id,
        text: &claim.text,
        from: &claim.from,
        verdict: finding.verdict.name(),
        class: class(finding.verdict),
        numbers: &finding.numbers,
        why: &finding.why,
    }
}

/// Plots of each figure, in order.
pub fn plots(figures: &[&Figure], results: &Results) -> Vec<Vec<Drawn>> {
    let both = figures.iter().zip(&results.figures);
    both.map(|(figure, result)| plot::draw(figure, result, &results.machines)).collect()
}

#[cfg(test)]
mod tests {
    use super::code;

    #[test]
    fn words_in_backticks_are_code_and_all_is_escaped() {
        let html = |text| code(text).to_string();
        assert_eq!(html("a `b` & `c<d>`"), "a <code>b</code> &amp; <code>c&lt;d&gt;</code>");
        assert_eq!(html("one ` alone, `two`"), "one <code> alone, </code>two`");
        assert_eq!((html(""), html("`")), (String::new(), "`".to_string()));
    }
}
