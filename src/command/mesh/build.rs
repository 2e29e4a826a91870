//! `ortelius mesh build`: a model becomes a `.pmesh` file.

use super::report::{BuildReport, Laps, Steps};
use crate::command::Usage;
use crate::command::outputs::{check_apart, check_place, ending};
use anyhow::{Result, bail};
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use indicatif::{ProgressBar, ProgressStyle};
use ortelius::model::Model;
use ortelius::paper::progressive_mesh::choices::FaceOrder;
use ortelius::paper::progressive_mesh::config::DEFAULT_ORDER;
use ortelius::paper::progressive_mesh::mesh::ProgressiveMesh;
use ortelius::paper::progressive_mesh::order::{Groups, OrderOptions, classical, order};
use ortelius::paper::progressive_mesh::simplify::{Collapses, Report, SimplifyOptions, simplify};
use std::path::{Path, PathBuf};

/// Simplifies a model to a progressive mesh and writes it, coarsest level first.
#[derive(Args, Debug)]
pub struct BuildArgs {
    /// A .ply, .obj or .glb file (also packed as .gz), or a model's name
    #[arg(value_name = "IN")]
    input: String,

    /// The file to write; its folder must exist
    #[arg(short, long, value_name = "OUT.pmesh")]
    output: PathBuf,

    /// Faces of the coarsest level
    #[arg(long, value_name = "N", default_value_t = SimplifyOptions::default().target_faces, allow_negative_numbers = true)]
    target_faces: usize,

    /// Decides by lot which of collapses that cost the same comes first; 0: where they stand in space
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,

    /// How faces are ordered
    #[arg(long, value_parser = orders(), default_value = DEFAULT_ORDER.name())]
    order: FaceOrder,

    /// Where the order is renewed: N equal groups of splits, or P%: whenever so many faces more are there
    #[arg(long, value_name = "N|P%", value_parser = groups, conflicts_with = "moves_budget")]
    groups: Option<Groups>,

    /// Faces that may change their slots for each split; decides the groups (23 where neither is said)
    #[arg(long, value_name = "M", value_parser = positive, allow_negative_numbers = true)]
    moves_budget: Option<f64>,

    /// Entries of the vertex cache that the order is for, first in, first out
    /// (16 where nothing is said)
    #[arg(long, value_name = "ENTRIES", value_parser = clap::value_parser!(u32).range(4..=1024), allow_negative_numbers = true)]
    cache: Option<u32>,

    /// Write what was cleaned and reached, each step's time and the most memory taken, as JSON
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
}

/// The orders that a file can have, by their names everywhere.
fn orders() -> impl TypedValueParser<Value = FaceOrder> {
    let named = |order: FaceOrder| PossibleValue::new(order.name()).help(order.about());
    let names = FaceOrder::ALL.iter().copied().filter(|order| !order.is_rival()).map(named);
    let order = |name: String| FaceOrder::ALL.iter().copied().find(|order| order.name() == name);
    PossibleValuesParser::new(names).try_map(move |name| order(name).ok_or("no order has this name"))
}

/// Runs the subcommand. A failure names the file.
pub fn run(args: &BuildArgs) -> Result<()> {
    // A build may take minutes: what cannot be is told before.
    let (output, report) = (check(args)?, args.report.as_deref().map(check_place).transpose()?);
    if report.as_ref() == Some(&output) {
        bail!(Usage(format!("--report {}: that is the mesh's own name; give it another", output.display())));
    }
    for written in [Some(&output), report.as_ref()].into_iter().flatten() {
        check_apart(written, Path::new(&args.input))?;
    }
    let mut laps = Laps::start();
    let (model, cleaned) = Model::open(&args.input)?;
    cleaned.to_string().lines().for_each(|line| tracing::info!("{line}"));
    check_moves(args, model.faces.len())?;
    let load = laps.lap();
    let bar = Bar::new();
    let options = SimplifyOptions { target_faces: args.target_faces, seed: args.seed };
    let simplified = simplify(&model, &options, &mut bar.phase("simplify"));
    let simplify = laps.lap();
    let mesh = ordered(options_of(args), &model, &simplified.collapses, &bar);
    bar.0.finish_and_clear();
    let order = laps.lap();
    let contents = mesh.write(&output)?;
    if let Some(path) = report {
        let steps = Steps::of([load, simplify, order, laps.lap()]);
        BuildReport::new(&cleaned, &simplified.report, &contents, steps).write(&path)?;
    }
    told(&simplified.report);
    tracing::info!(
        "{}: {} bytes, {} levels, {:.2} bytes a split but for positions, attributes and header",
        args.output.display(),
        contents.bytes,
        contents.whole.levels,
        contents.bytes_per_split(&mesh)
    );
    Ok(())
}

/// Refuses what says nothing to the order, and a place where no `.pmesh` file can be written; returns the place.
fn check(args: &BuildArgs) -> Result<PathBuf> {
    let given = [
        ("--groups", args.groups.is_some()),
        ("--moves-budget", args.moves_budget.is_some()),
        ("--cache", args.cache.is_some()),
    ];
    if let (FaceOrder::Classical, Some((option, _))) = (args.order, given.iter().find(|(_, given)| *given)) {
        bail!(Usage(format!(
            "{option} says nothing to --order classical, in which no face moves; leave it out"
        )));
    }
    let path = &args.output;
    if !ending(path).eq_ignore_ascii_case("pmesh") {
        bail!(Usage(format!("-o {}: the name must end in .pmesh", path.display())));
    }
    check_place(path)
}

/// What was reached, and what had to be allowed for it.
fn told(report: &Report) {
    let allowed = [
        (report.components, "components vanish as a whole"),
        (report.closed_holes, "collapses close a hole of three edges"),
        (report.pinches, "collapses make two sheets share an edge"),
        (report.flips, "collapses turn a face by more than 75 degrees, or leave it without area"),
        (report.crossing, "collapses no longer hold borders and seams"),
    ];
    for (count, what) in allowed.iter().filter(|(count, _)| *count > 0) {
        tracing::info!("{count} {what}");
    }
    let Report { faces, target_faces, .. } = report;
    match report.shortfall {
        None => tracing::info!("coarsest level: {faces} faces (at most {target_faces} wanted)"),
        Some(why) => tracing::warn!("coarsest level: {faces} faces instead of {target_faces}: {why}"),
    }
}

/// What the arguments say of the order; none: the classical one.
fn options_of(args: &BuildArgs) -> Option<OrderOptions> {
    let mut options = match (args.order, args.moves_budget) {
        (FaceOrder::Ours | FaceOrder::OursFewMoves, Some(moves)) => OrderOptions::of_moves(moves),
        (order, _) => OrderOptions::of(order)?,
    };
    options.groups = args.groups.or(args.moves_budget.map(Groups::Budget)).unwrap_or(options.groups);
    options.cache_entries = args.cache.unwrap_or(options.cache_entries);
    Some(options)
}

/// Moved faces that an order has at most: 2 GB of memory.
const MOST_MOVES: f64 = 1e8;

/// Refuses an order that would not fit the memory.
fn check_moves(args: &BuildArgs, faces: usize) -> Result<()> {
    let groups = options_of(args).map(|options| options.groups);
    let moves = groups.map_or(0.0, |groups| groups.moved_faces(args.target_faces, faces));
    let option = if args.groups.is_some() { "--groups" } else { "--moves-budget" };
    if moves > MOST_MOVES {
        bail!(Usage(format!(
            "{option}: up to {moves:.1e} faces would change their slots on the way through all levels of {faces} faces, \
             and {MOST_MOVES:.0e} is the most; ask for fewer (23 for each split where nothing is said)"
        )));
    }
    Ok(())
}

fn ordered(
    options: Option<OrderOptions>,
    model: &Model,
    collapses: &Collapses,
    bar: &Bar,
) -> ProgressiveMesh {
    match options {
        None => classical(model, collapses),
        Some(options) => order(model, collapses, &options, &mut bar.phase("order")),
    }
}

/// `64`, or `10%`.
fn groups(text: &str) -> Result<Groups, String> {
    match text.strip_suffix('%') {
        Some(percent) => Ok(Groups::Geometric(1.0 + positive(percent)? / 100.0)),
        None => match text.parse() {
            Ok(count) if count > 0 => Ok(Groups::Uniform(count)),
            _ => Err("a number of groups, or a growth such as 10%".into()),
        },
    }
}

fn positive(text: &str) -> Result<f64, String> {
    // Below, a ratio of faces is 1 in f64, and no group ends.
    let usable = |number: &f64| number.is_finite() && *number >= 1e-6;
    text.parse().ok().filter(usable).ok_or_else(|| "a number above 0".into())
}

/// A bar on stderr; hidden where that is no terminal.
struct Bar(ProgressBar);

impl Bar {
    fn new() -> Bar {
        let bar = ProgressBar::no_length();
        let template = "{msg:>8} {wide_bar} {pos}/{len} faces {eta} left";
        // The template is ours; a wrong one shows the default style.
        bar.set_style(
            ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()),
        );
        Bar(bar)
    }

    /// What a step tells its progress to: faces done, and all.
    fn phase(&self, name: &'static str) -> impl FnMut(usize, usize) + '_ {
        self.0.reset();
        self.0.set_message(name);
        |done, all| {
            self.0.set_length(all as u64);
            self.0.set_position(done as u64);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_a_number_or_a_growth() {
        assert_eq!(groups("64"), Ok(Groups::Uniform(64)));
        assert_eq!(groups("10%"), Ok(Groups::Geometric(1.1)));
        for wrong in ["0", "-3", "", "%", "0%", "-1%", "inf%", "NaN%", "1e-300%", "ten"] {
            assert!(groups(wrong).is_err(), "{wrong}");
        }
    }
}
