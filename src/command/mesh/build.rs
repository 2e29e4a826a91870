//! `ortelius mesh build`: converts a model to a `.pmesh` file.

use super::report::{BuildReport, Laps, Steps};
use crate::command::outputs::{check_apart, check_place, ending};
use crate::command::progress::ProgressLine;
use crate::command::{Usage, named};
use anyhow::{Result, bail};
use clap::Args;
use clap::builder::TypedValueParser;
use ortelius::model::Model;
use ortelius::paper::progressive_mesh::cache::Cache;
use ortelius::paper::progressive_mesh::choices::{BuildEffort, ErrorMetric, FaceOrder};
use ortelius::paper::progressive_mesh::config::DEFAULT_ORDER;
use ortelius::paper::progressive_mesh::encoded::order_and_encode;
use ortelius::paper::progressive_mesh::mesh::Births;
use ortelius::paper::progressive_mesh::order::{Groups, OrderOptions};
use ortelius::paper::progressive_mesh::simplify::{SimplifyOptions, SimplifyReport, simplify};
use std::path::{Path, PathBuf};

/// Simplifies a model to a progressive mesh and writes it, coarsest level first.
#[derive(Args, Debug)]
pub struct BuildArgs {
    /// A .ply, .obj or .glb file (also compressed as .gz), or a model's name
    #[arg(value_name = "IN")]
    input: String,

    /// The file to write; its folder must exist
    #[arg(short, long, value_name = "OUT.pmesh")]
    output: PathBuf,

    /// Wanted number of faces of the coarsest level
    #[arg(long, value_name = "N", default_value_t = SimplifyOptions::default().target_faces, allow_negative_numbers = true)]
    target_faces: usize,

    /// Seed of the random order of collapses with equal cost. 0: order them by position in space
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,

    /// How many passes the simplifier makes
    #[arg(long, value_parser = named(|_: BuildEffort| true), default_value = BuildEffort::Best.name())]
    effort: BuildEffort,

    /// What the error of a level measures
    #[arg(long, value_parser = named(|_: ErrorMetric| true), default_value = ErrorMetric::Geometry.name())]
    metric: ErrorMetric,

    /// Order of the faces
    #[arg(long, value_parser = orders(), default_value = DEFAULT_ORDER.name())]
    order: FaceOrder,

    /// When faces are reordered. N: after each of N equal groups of splits. P%: whenever the number of faces has grown
    /// by P %
    #[arg(long, value_name = "N|P%", value_parser = groups, conflicts_with = "moves_budget")]
    groups: Option<Groups>,

    /// Maximum number of faces that move to another slot per split, on average over all splits. This determines when
    /// faces are reordered. Default without --groups: the number in the order's name; for `paper`, 64 equal groups
    #[arg(long, value_name = "M", value_parser = positive, allow_negative_numbers = true)]
    moves_budget: Option<f64>,

    /// The vertex cache for which the order is optimised. N: a FIFO with N entries (default: 16). `batches`: batches of
    /// at most 32 vertices and 32 triangles, with no reuse between batches. `h100`: the batches of an NVIDIA H100, which
    /// find a vertex again only if its last use is at most 42 indices back. `meshlets`: as `batches`, with 64 vertices
    /// and 126 triangles
    #[arg(long, value_name = "N|batches|h100|meshlets", value_parser = cache, allow_negative_numbers = true)]
    cache: Option<Cache>,

    /// Write the results of cleaning and building, the time of each step and the peak memory, as JSON
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
}

/// The orders that a file can have.
fn orders() -> impl TypedValueParser<Value = FaceOrder> {
    named(|order: FaceOrder| !order.is_baseline())
}

/// Runs the subcommand. A failure names the file.
pub fn run(args: &BuildArgs) -> Result<()> {
    // A build may take minutes, so invalid arguments are reported first.
    let (output, report) = (check(args)?, args.report.as_deref().map(check_place).transpose()?);
    if report.as_ref() == Some(&output) {
        bail!(Usage(format!(
            "--report {}: this is the output file of the mesh; choose another name",
            output.display()
        )));
    }
    for written in [Some(&output), report.as_ref()].into_iter().flatten() {
        check_apart(written, Path::new(&args.input))?;
    }
    let mut laps = Laps::start();
    let (model, cleaned) = Model::open(&args.input)?;
    cleaned.to_string().lines().for_each(|line| tracing::info!("{line}"));
    check_moves(args, model.faces.len())?;
    let load = laps.lap();
    let bar = ProgressLine::counting("faces");
    let BuildArgs { target_faces, seed, effort, metric, .. } = *args;
    let options = SimplifyOptions { target_faces, seed, effort, metric };
    let simplified = simplify(&model, &options, &mut phase(&bar, "simplify"));
    let simplify = laps.lap();
    let options = options_of(args);
    let (encoded, order) = {
        let (mut show, mut order) = (phase(&bar, "order"), None);
        let mut progress = |done, all| {
            show(done, all);
            if done == all {
                // The encoder still works on the last levels.
                order.get_or_insert_with(|| laps.lap());
            }
        };
        (order_and_encode(&model, &simplified.collapses, options.as_ref(), &mut progress), order)
    };
    drop(bar);
    encoded.write(&output)?;
    let contents = encoded.contents;
    if let Some(path) = report {
        let order = order.expect("the last call of `progress` has two equal numbers");
        let steps = Steps::of([load, simplify, order, laps.lap()]);
        BuildReport::new(&cleaned, &simplified.report, &contents, steps).write(&path)?;
    }
    log_report(&simplified.report);
    tracing::info!(
        "{}: {} bytes, {} levels, {:.2} bytes per split without positions, attributes and header",
        args.output.display(),
        contents.bytes,
        contents.whole.levels,
        contents.bytes_per_split(&encoded.mesh)
    );
    Ok(())
}

/// Refuses options that the order ignores, and paths where no `.pmesh` file can be written. Returns the output path.
fn check(args: &BuildArgs) -> Result<PathBuf> {
    let given = [
        ("--groups", args.groups.is_some()),
        ("--moves-budget", args.moves_budget.is_some()),
        ("--cache", args.cache.is_some()),
    ];
    if let (FaceOrder::Classical, Some((option, _))) = (args.order, given.iter().find(|(_, given)| *given)) {
        bail!(Usage(format!(
            "{option} has no effect with --order classical, in which no face moves; omit it"
        )));
    }
    let in_place = OrderOptions::of(args.order).is_some_and(|options| options.births == Births::InPlace);
    let batches = BATCHES.iter().find(|(_, cache)| args.cache == Some(*cache));
    if let (false, Some((name, _))) = (in_place, batches) {
        bail!(Usage(format!(
            "--cache {name}: --order {} is optimised for a FIFO only; name its entries, or use in-place-23 or in-place-10",
            args.order.name()
        )));
    }
    let path = &args.output;
    if !ending(path).eq_ignore_ascii_case("pmesh") {
        bail!(Usage(format!("-o {}: the name must end in .pmesh", path.display())));
    }
    check_place(path)
}

/// Logs the results, and how often each rule of the simplifier had to be broken.
fn log_report(report: &SimplifyReport) {
    let allowed = [
        (report.components, "connected components disappear"),
        (report.closed_holes, "collapses close a hole of three edges"),
        (report.pinches, "collapses join two sheets at an edge"),
        (report.flips, "collapses rotate a face by more than 75 degrees, or leave it without area"),
        (report.crossing, "collapses ignore borders and seams"),
    ];
    for (count, what) in allowed.iter().filter(|(count, _)| *count > 0) {
        tracing::info!("{count} {what}");
    }
    let SimplifyReport { faces, target_faces, .. } = report;
    match report.shortfall {
        None => tracing::info!("coarsest level: {faces} faces (target: at most {target_faces})"),
        Some(why) => tracing::warn!("coarsest level: {faces} faces instead of {target_faces}: {why}"),
    }
}

/// The order options of the arguments; `None` for the classical order.
fn options_of(args: &BuildArgs) -> Option<OrderOptions> {
    let mut options = OrderOptions::of(args.order)?;
    match (args.groups, args.moves_budget) {
        // Regions are reordered in turn only with a budget of moved faces.
        (Some(groups), _) => options = OrderOptions { groups, regions: 1, ..options },
        (None, Some(moves)) if args.order == FaceOrder::Paper => options.groups = Groups::Budget(moves),
        (None, Some(moves)) => options = options.with_moves(moves),
        (None, None) => {}
    }
    let cache = args.cache.unwrap_or(options.cache);
    Some(options.with_cache(cache))
}

/// Limit of face moves over all levels. This number of moves takes 2 GB of memory.
const MAX_MOVES: f64 = 1e8;

/// Refuses an order that would not fit in memory.
fn check_moves(args: &BuildArgs, faces: usize) -> Result<()> {
    let groups = options_of(args).map(|options| options.groups);
    let moves = groups.map_or(0.0, |groups| groups.moved_faces(args.target_faces, faces));
    let option = if args.groups.is_some() { "--groups" } else { "--moves-budget" };
    if moves > MAX_MOVES {
        bail!(Usage(format!(
            "{option}: up to {moves:.1e} faces would change their slots over all levels of {faces} faces, \
             but the limit is {MAX_MOVES:.0e}; request fewer (default: 23 per split)"
        )));
    }
    Ok(())
}

/// Parses `64`, or `10%`.
fn groups(text: &str) -> Result<Groups, String> {
    match text.strip_suffix('%') {
        Some(percent) => Ok(Groups::Geometric(1.0 + positive(percent)? / 100.0)),
        None => match text.parse() {
            Ok(count) if count > 0 => Ok(Groups::Uniform(count)),
            _ => Err("expected a number of groups, or a growth such as 10%".into()),
        },
    }
}

/// The caches that are no FIFO, as the command line names them.
const BATCHES: [(&str, Cache); 3] =
    [("batches", Cache::Batches), ("h100", Cache::H100), ("meshlets", Cache::Meshlets)];

/// Parses a number of FIFO entries or a name of [`BATCHES`].
fn cache(text: &str) -> Result<Cache, String> {
    if let Some((_, known)) = BATCHES.iter().find(|(name, _)| *name == text) {
        return Ok(*known);
    }
    match text.parse() {
        Ok(entries @ 4..=1024) => Ok(Cache::Fifo(entries)),
        _ => Err("expected 4 to 1024 entries of a FIFO, `batches`, `h100` or `meshlets`".into()),
    }
}

fn positive(text: &str) -> Result<f64, String> {
    // With much less, the ratio 1 + P/100 rounds to 1, and no group would end.
    let usable = |number: &f64| number.is_finite() && *number >= 1e-6;
    text.parse().ok().filter(usable).ok_or_else(|| "expected a number above 0".into())
}

/// Progress callback of a step: faces done, and all faces.
fn phase<'a>(bar: &'a ProgressLine, name: &str) -> impl FnMut(usize, usize) + use<'a> {
    bar.phase(name, None);
    |done, all| bar.set(done, all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cache_is_a_number_of_entries_or_a_kind_of_batch() {
        assert_eq!(cache("4"), Ok(Cache::Fifo(4)));
        assert_eq!(cache("1024"), Ok(Cache::Fifo(1024)));
        assert_eq!(cache("batches"), Ok(Cache::Batches));
        assert_eq!(cache("h100"), Ok(Cache::H100));
        assert_eq!(cache("meshlets"), Ok(Cache::Meshlets));
        for wrong in ["", "3", "1025", "-16", "16.0", "Batches", "meshlet"] {
            assert!(cache(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn groups_are_a_number_or_a_growth() {
        assert_eq!(groups("64"), Ok(Groups::Uniform(64)));
        assert_eq!(groups("10%"), Ok(Groups::Geometric(1.1)));
        for wrong in ["0", "-3", "", "%", "0%", "-1%", "inf%", "NaN%", "1e-300%", "ten"] {
            assert!(groups(wrong).is_err(), "{wrong}");
        }
    }
}
