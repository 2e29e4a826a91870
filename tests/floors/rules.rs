//! The floors, and the imports that each file must not have.

use crate::lexer::{Token, tokens};
use crate::paths::{Reference, module_path, references};

/// Top modules and their floors (src/lib.rs). New modules must be added.
const FLOORS: [(&str, u32); 16] = [
    // Plain data, no GPU.
    ("file", 0),
    ("header", 0),
    ("math", 0),
    ("picture", 0),
    ("stats", 0),
    // Independent of each other, except that the reference uses the data types of `model`.
    ("vk", 1),
    ("model", 1),
    ("texture", 1),
    ("reference", 1),
    // Contents of pictures, frames, and measurement.
    ("scene", 2),
    ("frame", 2),
    ("figure", 2),
    // One subfolder for each paper.
    ("paper", 3),
    ("renderer", 4),
    ("view", 5),
    // Only in the binary; the library has no such module.
    ("command", 5),
];

fn floor(module: &str) -> Option<u32> {
    FLOORS.iter().find(|(name, _)| *name == module).map(|&(_, floor)| floor)
}

/// The roots of the library and of the binary may name every module.
fn is_root(file: &str) -> bool {
    matches!(file, "src/lib.rs" | "src/main.rs")
}

/// Why a file of module `from` must not name `to`; both are paths from the root.
fn objection(from: &[String], to: &[String]) -> Option<String> {
    let target = to[0].as_str();
    if target == "*" {
        return Some("imports the whole crate; name what is used".to_owned());
    }
    let here = from[0].as_str();
    let Some(above) = floor(target) else {
        return Some(format!("names {target}, which has no floor; add it to tests/floors/rules.rs"));
    };
    let Some(below) = floor(here) else {
        return Some(format!("{here} has no floor; add it to tests/floors/rules.rs"));
    };
    if target == "command" && here != "command" {
        return Some("the library must not import its command line".to_owned());
    }
    if target == "vk" && from.iter().any(|segment| segment == "reference") {
        return Some("a reference must not use the GPU".to_owned());
    }
    if here == target {
        let (paper, other) = (from.get(1), to.get(1));
        let strange = here == "paper" && paper.is_some() && paper != other;
        return strange.then(|| format!("papers must not import each other: {}", to.join("::")));
    }
    if above > below {
        return Some(format!("{here} (floor {below}) names {target} (floor {above})"));
    }
    let neighbours = match (here, target) {
        ("reference", "model") => true, // its data types
        ("command", "view") => true,    // `ortelius view` opens it
        _ => below == 0 || above < below,
    };
    (!neighbours).then(|| format!("{here} and {target} (floor {below}) must not import each other"))
}

/// `unsafe`, `ash` and `#[path]` where they are forbidden. Applies to any file, also outside `src`.
pub fn forbidden_words(file: &str, tokens: &[Token]) -> Vec<String> {
    let in_vk = module_path(file).first().is_some_and(|first| first == "vk");
    let word = |at: usize| tokens.get(at).map_or("", |token| token.text.as_str());
    let reason = |at: usize| match word(at) {
        "unsafe" if !in_vk => Some("unsafe code outside src/vk"),
        "ash" if !in_vk => Some("ash outside src/vk"),
        "path" if word(at.wrapping_sub(1)) == "[" && word(at.wrapping_sub(2)) == "#" => {
            Some("#[path] hides a module from this check")
        }
        _ => None,
    };
    (0..tokens.len())
        .filter_map(|at| reason(at).map(|reason| format!("{file}:{}: {reason}", tokens[at].line)))
        .collect()
}

/// All violations of a file of `src`.
pub fn objections(file: &str, text: &str) -> Vec<String> {
    let tokens = tokens(text);
    let mut found = forbidden_words(file, &tokens);
    if file == "src/lib.rs"
        && tokens.windows(2).any(|pair| pair[0].text == "mod" && pair[1].text == "command")
    {
        found.push(format!("{file}: the library must not import its command line"));
    }
    let from = module_path(file);
    if !is_root(file) {
        let bad = |reference: &Reference| {
            objection(&from, &reference.path).map(|reason| format!("{file}:{}: {reason}", reference.line))
        };
        found.extend(references(file, &tokens).iter().filter_map(bad));
    }
    found
}

/// The number of a file's references to other top modules.
pub fn crossings(file: &str, text: &str) -> usize {
    let from = module_path(file);
    references(file, &tokens(text))
        .iter()
        .filter(|reference| Some(&reference.path[0]) != from.first())
        .count()
}
