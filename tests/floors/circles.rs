//! Circles between files: a file that depends on itself through any number of other files.
//!
//! The rule: a file depends on the files that define the names it uses.
//! - `mod child;` is not a dependency. A `pub use` is a dependency only if the file's own code uses the name. A file
//!   that imports the name depends on the file that defines it.
//! - A parent whose code uses a child's item depends on the child. A child's use of its parents' items does not
//!   count: `mod.rs` holds the vocabulary that its children share.
//! - Test code (`#[cfg(test)]`) does not count.

use crate::lexer::{Token, tokens};
use crate::paths::module_path;
use std::collections::{BTreeMap, BTreeSet};

/// A source file: its path within the repository, and its text.
pub type Source = (String, String);

/// For each file: the files that it depends on, with the names used from each.
type Edges = BTreeMap<String, BTreeMap<String, BTreeSet<String>>>;

/// The circles of a source tree, with the names that cause each.
pub fn circles(sources: &[Source]) -> Vec<String> {
    let edges = edges(sources);
    let reached: BTreeMap<&String, BTreeSet<&String>> =
        edges.keys().map(|file| (file, reachable(&edges, file))).collect();
    let circle_of = |file: &String| -> BTreeSet<&String> {
        reached[file].iter().copied().filter(|other| reached[*other].contains(file)).collect()
    };
    let circles: BTreeSet<BTreeSet<&String>> = edges.keys().map(circle_of).collect();
    circles.iter().filter(|circle| circle.len() > 1).map(|circle| described(&edges, circle)).collect()
}

/// The number of dependencies: pairs of a file and another file that it depends on.
pub fn dependencies(sources: &[Source]) -> usize {
    edges(sources).values().map(BTreeMap::len).sum()
}

fn described(edges: &Edges, circle: &BTreeSet<&String>) -> String {
    let mut lines = vec![format!("a circle of {} files:", circle.len())];
    for &from in circle {
        for (to, names) in edges[from].iter().filter(|(to, _)| circle.contains(to)) {
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            lines.push(format!("  {from} -> {to}: {}", names.join(", ")));
        }
    }
    lines.join("\n")
}

fn reachable<'a>(edges: &'a Edges, from: &'a String) -> BTreeSet<&'a String> {
    let mut reached = BTreeSet::new();
    let mut open = vec![from];
    while let Some(file) = open.pop() {
        open.extend(edges[file].keys().filter(|&next| reached.insert(next)));
    }
    reached
}

fn edges(sources: &[Source]) -> Edges {
    let files: Vec<File> = sources.iter().map(|(path, text)| File::read(path, text)).collect();
    // Nothing imports from src/main.rs; the other root, src/lib.rs, re-exports the facade.
    let imported = files.iter().filter(|file| file.path != "src/main.rs");
    let tree = Tree { files: imported.map(|file| (&file.module[..], file)).collect() };
    let of = |file: &File| {
        let mut targets: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for path in file
            .imports
            .iter()
            .filter(|import| !import.passed_on)
            .map(|import| &import.path)
            .chain(&file.code)
        {
            if let Some((target, name)) = tree.definition(path, 0)
                && !file.module.starts_with(&target.module)
            {
                targets.entry(target.path.clone()).or_default().insert(name.to_owned());
            }
        }
        (file.path.clone(), targets)
    };
    files.iter().map(of).collect()
}

/// All files by module path.
struct Tree<'a> {
    files: BTreeMap<&'a [String], &'a File>,
}

impl<'a> Tree<'a> {
    /// The file that defines the item of a path from the root, and the item's name; `None` if no file of
    /// the tree defines it.
    fn definition<'p>(&self, path: &'p [String], depth: usize) -> Option<(&'a File, &'p str)>
    where
        'a: 'p,
    {
        let inside = (0..=path.len()).rev().find(|&length| self.files.contains_key(&path[..length]))?;
        let file = self.files[&path[..inside]];
        let Some(name) = path.get(inside) else { return Some((file, "the module")) };
        let import = file.imports.iter().find(|import| import.local == *name);
        match import {
            // At most 16 steps: a longer chain is a re-export circle, which does not compile.
            Some(import) if depth < 16 && !file.items.contains(name) => {
                self.definition(&import.path, depth + 1)
            }
            _ => Some((file, name)),
        }
    }
}

/// A name that a file imports.
struct Import {
    /// From the root.
    path: Vec<String>,
    /// The local name; `*` for a glob.
    local: String,
    passed_on: bool,
}

/// Imports, used names and definitions of a file.
struct File {
    path: String,
    module: Vec<String>,
    imports: Vec<Import>,
    /// Paths in the code, from the root.
    code: Vec<Vec<String>>,
    items: BTreeSet<String>,
}

impl File {
    fn read(path: &str, text: &str) -> File {
        let tokens = without_tests(&tokens(text));
        let words: Vec<&str> = tokens.iter().map(|token| token.text.as_str()).collect();
        let named_behind = |keywords: &[&str]| -> BTreeSet<String> {
            words
                .windows(2)
                .filter(|pair| keywords.contains(&pair[0]))
                .map(|pair| pair[1].to_owned())
                .collect()
        };
        let module = module_path(path);
        let (declarations, code) = split(&words);
        let scope = Scope { module: &module, children: named_behind(&["mod"]) };
        let mut imports = Vec::new();
        for declaration in declarations {
            let public = declaration[0] == "pub";
            let start = declaration.iter().position(|word| *word == "use").map_or(0, |at| at + 1);
            let mut leaves = Vec::new();
            leaves_of(&declaration[start..], &[], &mut leaves);
            for (path, local) in leaves {
                let passed_on = public && !code.contains(&local.as_str());
                imports.extend(scope.rooted(&path, &[]).map(|path| Import { path, local, passed_on }));
            }
        }
        let code = paths_of(&code).iter().filter_map(|path| scope.rooted(path, &imports)).collect();
        let items = named_behind(&["struct", "enum", "union", "trait", "type", "fn", "const", "static"]);
        File { path: path.to_owned(), imports, code, items, module }
    }
}

/// Removes each item after `#[cfg(test)]`.
fn without_tests(tokens: &[Token]) -> Vec<Token> {
    const MARK: [&str; 7] = ["#", "[", "cfg", "(", "test", ")", "]"];
    let mut kept = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        let marked =
            MARK.iter().enumerate().all(|(i, word)| tokens.get(at + i).is_some_and(|t| t.text == *word));
        if !marked {
            kept.push(tokens[at].clone());
            at += 1;
            continue;
        }
        let mut depth = 0;
        for token in &tokens[at..] {
            at += 1;
            match token.text.as_str() {
                "{" => depth += 1,
                "}" => depth -= 1,
                _ => {}
            }
            if depth == 0 && matches!(token.text.as_str(), "}" | ";") {
                break;
            }
        }
    }
    kept
}

/// The `use` declarations, from `pub` or `use` up to the `;`, and all other words.
fn split<'w>(words: &[&'w str]) -> (Vec<Vec<&'w str>>, Vec<&'w str>) {
    let (mut declarations, mut code) = (Vec::new(), Vec::new());
    let mut at = 0;
    while at < words.len() {
        // `use<'a>` is a capture.
        if words[at] == "use" && words.get(at + 1) != Some(&"<") {
            let length = words[at..].iter().position(|word| *word == ";").unwrap_or(words.len() - at);
            let mut declaration = words[at..at + length].to_vec();
            // `pub use`, `pub(crate) use`, `pub(in a::b) use`.
            let before =
                &code[code.iter().rposition(|word| matches!(*word, ";" | "}" | "]")).map_or(0, |i| i + 1)..];
            if before.contains(&"pub") {
                declaration.insert(0, "pub");
            }
            declarations.push(declaration);
            at += length;
        }
        code.extend(words.get(at));
        at += 1;
    }
    (declarations, code)
}

/// The paths of a `use` tree, each with its local name.
fn leaves_of(tree: &[&str], base: &[String], leaves: &mut Vec<(Vec<String>, String)>) {
    let mut path = base.to_vec();
    let mut rest = tree;
    while let [first, after @ ..] = rest {
        match (*first, after) {
            ("{", inner) => {
                for branch in branches(&inner[..inner.len() - 1]) {
                    leaves_of(branch, &path, leaves);
                }
                return;
            }
            ("::", _) => {}
            ("as", [name, ..]) => {
                leaves.push((path, (*name).to_owned()));
                return;
            }
            ("self", []) if !path.is_empty() => {}
            (segment, _) => path.push(segment.to_owned()),
        }
        rest = after;
    }
    leaves.extend(path.last().cloned().map(|local| (path, local)));
}

/// Splits at commas outside inner braces.
fn branches<'t, 'w>(tree: &'t [&'w str]) -> Vec<&'t [&'w str]> {
    let mut depth = 0;
    let outer_comma = |word: &&str| {
        match *word {
            "{" => depth += 1,
            "}" => depth -= 1,
            _ => {}
        }
        *word == "," && depth == 0
    };
    tree.split(outer_comma).filter(|branch| !branch.is_empty()).collect()
}

/// All paths of at least two segments in the code.
fn paths_of(code: &[&str]) -> Vec<Vec<String>> {
    let is_name = |at: usize| {
        code.get(at).is_some_and(|word| word.starts_with(|c: char| c.is_alphabetic() || c == '_'))
    };
    let follows = |at: usize| code.get(at) == Some(&"::") && is_name(at + 1);
    let starts = |at: usize| at == 0 || !matches!(code[at - 1], "::" | ".");
    let path_at = |at: usize| {
        let further = (at..).step_by(2).skip(1).take_while(|&next| follows(next - 1));
        std::iter::once(at).chain(further).map(|at| code[at].to_owned()).collect()
    };
    (0..code.len()).filter(|&at| is_name(at) && starts(at) && follows(at + 1)).map(path_at).collect()
}

/// The base of a file's paths.
struct Scope<'a> {
    module: &'a [String],
    /// Modules that the file declares.
    children: BTreeSet<String>,
}

impl Scope<'_> {
    /// A path of the file, from the crate root; `None` for a path of another crate or the prelude.
    fn rooted(&self, path: &[String], imports: &[Import]) -> Option<Vec<String>> {
        let (first, rest) = path.split_first()?;
        let supers = path.iter().take_while(|segment| *segment == "super").count();
        match first.as_str() {
            "crate" | "ortelius" => Some(rest.to_vec()),
            "self" => Some([self.module, rest].concat()),
            "super" => {
                let base = self.module.len().checked_sub(supers)?;
                Some([&self.module[..base], &path[supers..]].concat())
            }
            _ if self.children.contains(first) => Some([self.module, path].concat()),
            _ => {
                let import = imports.iter().find(|import| import.local == *first)?;
                Some([&import.path[..], rest].concat())
            }
        }
    }
}
