//! `ortelius list`: lists figures, and with -v or by name also their claims.

use super::{Usage, say};
use clap::Args;
use ortelius::figure::{Effort, Figure, choose};
use ortelius::header::JsonFormat;
use ortelius::renderer::figures::FAMILIES;
use serde_json::json;

/// In version 1, this JSON was only the list of figures.
const FORMAT: JsonFormat = JsonFormat::new("ortelius-figures", 2);

#[derive(Args)]
pub struct ListArgs {
    /// Figures (pm.order) or families (pm) to show in full; default: all figures, with claims only if -v is given
    #[arg(value_name = "FIGURE|FAMILY")]
    figures: Vec<String>,
    /// Print JSON on stdout
    #[arg(long)]
    json: bool,
}

/// `verbose`: prints claims even if no figure was named.
pub fn run(args: &ListArgs, verbose: bool) -> anyhow::Result<()> {
    let chosen = choose(&FAMILIES, &args.figures).map_err(|unknown| Usage(unknown.to_string()))?;
    let of = |figures: &[&'static Figure]| -> Vec<&Figure> {
        figures.iter().copied().filter(|figure| chosen.iter().any(|one| one.id == figure.id)).collect()
    };
    let families = FAMILIES.iter().map(|(family, figures)| (*family, of(figures)));
    let families = families.filter(|(_, figures)| !figures.is_empty());
    if args.json {
        let all = families.flat_map(|(family, figures)| {
            figures.into_iter().map(move |figure| described(family, figure)).collect::<Vec<_>>()
        });
        let list = FORMAT.head(json!({ "figures": all.collect::<Vec<_>>() }));
        return say(serde_json::to_string_pretty(&list)?);
    }
    for (family, figures) in families {
        let plural = if figures.len() == 1 { "" } else { "s" };
        say(format_args!("{family}: {} figure{plural}", figures.len()))?;
        figures
            .into_iter()
            .try_for_each(|figure| print_figure(figure, verbose || !args.figures.is_empty()))?;
    }
    Ok(())
}

/// Prints a figure in two lines; if `whole`, also its description, what a quick run leaves out, and its claims.
fn print_figure(figure: &Figure, whole: bool) -> anyhow::Result<()> {
    let cells = |effort| figure.cells(effort).len();
    say(format_args!("  {:16} {}", figure.id, figure.title))?;
    say(format_args!(
        "  {:16} {} variants, {} claims, {} cells (full: {})",
        "",
        (figure.variants)().len(),
        figure.claims.len(),
        cells(Effort::Quick),
        cells(Effort::Full)
    ))?;
    if !whole {
        return Ok(());
    }
    let about = figure.about.split_whitespace().collect::<Vec<_>>().join(" ");
    say(format_args!("    {about}"))?;
    say(format_args!("    A quick run leaves out {}.", figure.quick_leaves_out()))?;
    match figure.without_picture() {
        Some(words) => say(format_args!("    `ortelius view`: {words}."))?,
        None => {
            let views: Vec<String> = figure.views().into_iter().map(|view| view.name).collect();
            say(format_args!("    `ortelius view {}` shows {}.", figure.id, views.join("; ")))?;
        }
    }
    figure
        .claims
        .iter()
        .try_for_each(|claim| say(format_args!("    - {} ({}): {}", claim.id, claim.from, claim.text)))
}

fn described(family: &str, figure: &Figure) -> serde_json::Value {
    let claims: Vec<_> = figure
        .claims
        .iter()
        .map(|claim| json!({"id": claim.id, "text": claim.text, "from": claim.from.to_string()}))
        .collect();
    json!({
        "id": figure.id,
        "family": family,
        "title": figure.title,
        "about": figure.about,
        "scenes": figure.scenes,
        "variants": (figure.variants)(),
        "views": figure.views().into_iter().map(|view| view.name).collect::<Vec<_>>(),
        "without_picture": figure.without_picture(),
        "quick_leaves_out": figure.quick_leaves_out(),
        "sweep": figure.sweep.map(|s| json!({"name": s.name, "quick": s.quick, "full": s.full})),
        "claims": claims,
    })
}
