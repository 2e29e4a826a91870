//! `ortelius list`: every figure, and what it claims.

use super::say;
use clap::Args;
use ortelius::figure::{Effort, Figure, Origin};
use ortelius::paper::FAMILIES;
use serde_json::json;

#[derive(Args)]
pub struct ListArgs {
    /// Print JSON on stdout
    #[arg(long)]
    json: bool,
}

pub fn run(args: &ListArgs) -> anyhow::Result<()> {
    let figures = || FAMILIES.iter().flat_map(|(family, figures)| figures.iter().map(move |f| (*family, *f)));
    if args.json {
        let all: Vec<_> = figures().map(|(family, figure)| described(family, figure)).collect();
        return say(serde_json::to_string_pretty(&all)?);
    }
    for (family, figures) in FAMILIES {
        say(format_args!("{family}: {} figures", figures.len()))?;
        for figure in figures {
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
        }
    }
    Ok(())
}

fn origin(from: Origin) -> String {
    match from {
        Origin::Paper(section) => format!("paper, {section}"),
        Origin::Ours => "ours".into(),
    }
}

fn described(family: &str, figure: &Figure) -> serde_json::Value {
    let claims: Vec<_> = figure
        .claims
        .iter()
        .map(|claim| json!({"id": claim.id, "text": claim.text, "from": origin(claim.from)}))
        .collect();
    json!({
        "id": figure.id,
        "family": family,
        "title": figure.title,
        "about": figure.about,
        "scenes": figure.scenes,
        "variants": (figure.variants)(),
        "sweep": figure.sweep.map(|s| json!({"name": s.name, "quick": s.quick, "full": s.full})),
        "claims": claims,
    })
}
