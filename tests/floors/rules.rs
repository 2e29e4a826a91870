//! The floors, and what each file may not do.

use crate::lexer::{Token, tokens};
use crate::paths::{Reference, module_path, references};

/// Top modules and their floors (src/lib.rs). A new one must be entered here.
const FLOORS: [(&str, u32); 16] = [
    // Plain data, no GPU.
    ("file", 0),
    ("header", 0),
    ("math", 0),
    ("picture", 0),
    ("stats", 0),
    // Worlds that do not know each other, and the truth.
    ("vk", 1),
    ("model", 1),
    ("texture", 1),
    ("reference", 1),
    // What is shown, how frames are made, what is measured.
    ("scene", 2),
    ("frame", 2),
    ("figure", 2),
    // Folders below it: one a paper.
    ("paper", 3),
    ("renderer", 4),
    ("view", 5),
    // The binary alone; the library has no such module.
    ("command", 5),
];

fn floor(module: &str) -> Option<u32> {
    FLOORS.iter().find(|(name, _)| *name == module).map(|&(_, floor)| floor)
}

/// The library's root may name all its modules, and the binary's files all but each other's insides.
fn is_root(file: &str) -> bool {
    matches!(file, "src/lib.rs" | "src/main.rs")
}

/// Why a file of module `from` may not name `to`; both are paths from the root.
fn objection(from: &[String], to: &[String]) -> Option<String> {
    let target = to[0].as_str();
    if target == "*" {
        return Some("takes in the whole crate; name what is used".to_owned());
    }
    let here = from[0].as_str();
    let Some(above) = floor(target) else {
        return Some(format!("names {target}, which stands on no floor; enter it in tests/floors/rules.rs"));
    };
    let Some(below) = floor(here) else {
        return Some(format!("{here} stands on no floor; enter it in tests/floors/rules.rs"));
    };
    if target == "command" && here != "command" {
        return Some("the library does not know its command line".to_owned());
    }
    if target == "vk" && from.iter().any(|segment| segment == "reference") {
        return Some("a reference never looks at the GPU".to_owned());
    }
    if here == target {
        let (paper, other) = (from.get(1), to.get(1));
        let strange = here == "paper" && paper.is_some() && paper != other;
        return strange.then(|| format!("papers do not name each other: {}", to.join("::")));
    }
    if above > below {
        return Some(format!("{here} (floor {below}) names {target} (floor {above})"));
    }
    let neighbours = match (here, target) {
        ("reference", "model") => true, // its data types
        ("command", "view") => true,    // `ortelius view` opens it
        _ => below == 0 || above < below,
    };
    (!neighbours).then(|| format!("{here} and {target} (floor {below}) do not know each other"))
}

/// `unsafe`, `ash` and `#[path]` where they may not be. For any file, not only those of `src`.
pub fn forbidden_words(file: &str, tokens: &[Token]) -> Vec<String> {
    let in_vk = module_path(file).first().is_some_and(|first| first == "vk");
    let word = |at: usize| tokens.get(at).map_or("", |token| token.text.as_str());
    let reason = |at: usize| match word(at) {
        "unsafe" if !in_vk => Some("unsafe code outside src/vk"),
        "ash" if !in_vk => Some("ash outside src/vk"),
        "path" if word(at.wrapping_sub(1)) == "[" && word(at.wrapping_sub(2)) == "#" => {
            Some("a module elsewhere than its name says escapes the floors")
        }
        _ => None,
    };
    (0..tokens.len())
        .filter_map(|at| reason(at).map(|reason| format!("{file}:{}: {reason}", tokens[at].line)))
        .collect()
}

/// Everything that a file of `src` does against the floors.
pub fn objections(file: &str, text: &str) -> Vec<String> {
    let tokens = tokens(text);
    let mut found = forbidden_words(file, &tokens);
    if file == "src/lib.rs"
        && tokens.windows(2).any(|pair| pair[0].text == "mod" && pair[1].text == "command")
    {
        found.push(format!("{file}: the library does not know its command line"));
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

/// How many of a file's references lead to another top module.
pub fn crossings(file: &str, text: &str) -> usize {
    let from = module_path(file);
    references(file, &tokens(text))
        .iter()
        .filter(|reference| Some(&reference.path[0]) != from.first())
        .count()
}
