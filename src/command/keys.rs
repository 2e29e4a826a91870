//! `ortelius keys`: lists every key of scene files, from the declarations.

use super::{Usage, say};
use anyhow::bail;
use clap::Args;
use ortelius::math::nearest::nearest;
use ortelius::renderer::sections::LANGUAGES;
use ortelius::scene::{self, markdown, schema};

#[derive(Args)]
pub struct KeysArgs {
    /// List only keys that start with this, for example `surface.NAME.texture` or `cache`. If no key starts with this,
    /// list the keys that contain it
    #[arg(default_value = "")]
    prefix: String,
    /// Print docs/scenes.md
    #[arg(long, conflicts_with_all = ["prefix", "json_schema"])]
    markdown: bool,
    /// Print docs/scene.schema.json, a JSON Schema for editors
    #[arg(long, conflicts_with = "prefix")]
    json_schema: bool,
}

pub fn run(args: &KeysArgs) -> anyhow::Result<()> {
    if args.markdown {
        return say(markdown::markdown(LANGUAGES).trim_end());
    }
    if args.json_schema {
        return say(format_args!("{:#}", schema::schema(LANGUAGES)));
    }
    let all = scene::keys(LANGUAGES);
    let starts = |key: &str| key.starts_with(&args.prefix);
    let contains = |key: &str| key.contains(&args.prefix);
    let fits: &dyn Fn(&str) -> bool =
        if all.iter().any(|at| starts(&at.dotted)) { &starts } else { &contains };
    let mut found = all.iter().filter(|at| fits(&at.dotted)).peekable();
    if found.peek().is_none() {
        let near = nearest(&args.prefix, all.iter().map(|at| &*at.dotted)).unwrap_or_default();
        bail!(Usage(format!("no key of scenes contains {:?}; nearest is {near}", args.prefix)));
    }
    found.try_for_each(|at| say(markdown::lines(at)))
}
