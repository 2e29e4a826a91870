//! Finds the modules of the crate that a file names.

use crate::lexer::Token;

/// A path from the crate's root: `crate::texture::source`, or the resolved `super::`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reference {
    /// The segments up to the end of the path or to its generic arguments, at least one. A glob import ends in `*`.
    pub path: Vec<String>,
    pub line: usize,
}

/// `src/scene/source/mod.rs` -> `scene`, `source`. The roots (`src/lib.rs`, `src/main.rs`) have no
/// segments.
pub fn module_path(file: &str) -> Vec<String> {
    let inner = file.strip_prefix("src/").unwrap_or(file).trim_end_matches(".rs");
    let mut path: Vec<String> = inner.split('/').map(str::to_owned).collect();
    if path.last().is_some_and(|last| last == "mod") || path == ["lib"] || path == ["main"] {
        path.pop();
    }
    path
}

/// All references of a file. `ortelius::` counts as `crate::`, because the binary uses it for the library.
pub fn references(file: &str, tokens: &[Token]) -> Vec<Reference> {
    let mut scan = Scan { tokens, references: Vec::new() };
    let outer = module_path(file);
    // Inline modules, with the brace depth at which each ends.
    let mut inline: Vec<(String, usize)> = Vec::new();
    let mut depth = 0;
    let mut at = 0;
    while at < tokens.len() {
        let module: Vec<String> =
            outer.iter().cloned().chain(inline.iter().map(|(name, _)| name.clone())).collect();
        let starts_path = at == 0 || tokens[at - 1].text != "::";
        match tokens[at].text.as_str() {
            "mod" if scan.text(at + 2) == "{" => {
                inline.push((tokens[at + 1].text.clone(), depth));
                at += 1; // the next step counts the brace
            }
            "{" => depth += 1,
            "}" => {
                depth = depth.saturating_sub(1);
                inline.retain(|&(_, opened_at)| opened_at < depth);
            }
            "crate" | "ortelius" if starts_path && scan.text(at + 1) == "::" => {
                scan.tree(&[], at + 2);
            }
            "self" if starts_path && scan.text(at + 1) == "::" => {
                scan.tree(&module, at + 2);
            }
            "super" if starts_path && scan.text(at + 1) == "::" => {
                let mut base = module;
                base.pop();
                let mut next = at + 2;
                while scan.text(next) == "super" {
                    base.pop();
                    next += 2;
                }
                scan.tree(&base, next);
            }
            _ => {}
        }
        at += 1;
    }
    scan.references
}

struct Scan<'a> {
    tokens: &'a [Token],
    references: Vec<Reference>,
}

impl Scan<'_> {
    fn text(&self, at: usize) -> &str {
        self.tokens.get(at).map_or("", |token| &token.text)
    }

    /// A path, or a tree of paths as in `use`, that starts at token `at` below `base`. Returns the next
    /// token.
    fn tree(&mut self, base: &[String], mut at: usize) -> usize {
        let mut path = base.to_vec();
        loop {
            match self.text(at) {
                "{" => {
                    at += 1;
                    while !matches!(self.text(at), "}" | "") {
                        at = match self.text(at) {
                            "," => at + 1,
                            _ => self.tree(&path, at),
                        };
                    }
                    return at + 1;
                }
                "" => return at,
                segment => path.push(segment.to_owned()),
            }
            at += 1;
            if self.text(at) != "::" {
                break;
            }
            at += 1;
            // `Vec::<T>`: the path ends here.
            if self.text(at) == "<" {
                break;
            }
        }
        let line = self.tokens[at - 1].line;
        self.references.push(Reference { path, line });
        if self.text(at) == "as" { at + 2 } else { at }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lexer::tokens;

    fn paths(file: &str, text: &str) -> Vec<String> {
        references(file, &tokens(text)).into_iter().map(|reference| reference.path.join("::")).collect()
    }

    #[test]
    fn a_file_is_a_module() {
        assert_eq!(module_path("src/scene/source/mod.rs"), ["scene", "source"]);
        assert_eq!(module_path("src/renderer.rs"), ["renderer"]);
        assert_eq!(module_path("src/lib.rs"), Vec::<String>::new());
    }

    #[test]
    fn use_trees_are_split_into_paths() {
        let text = "use crate::{math::{self, pyramid::TileId as Id}, scene, vk::*}; fn f() { crate::stats::median() }";
        assert_eq!(
            paths("src/view.rs", text),
            ["math::self", "math::pyramid::TileId", "scene", "vk::*", "stats::median"]
        );
    }

    #[test]
    fn super_is_resolved_from_its_module() {
        assert_eq!(paths("src/paper/a/b.rs", "use super::super::c::d;"), ["paper::c::d"]);
        assert_eq!(paths("src/paper/a/mod.rs", "use super::super::vk;"), ["vk"]);
        assert_eq!(
            paths("src/stats/mod.rs", "use super::vk; mod tests { use super::*; } use super::vk;"),
            ["vk", "stats::*", "vk"]
        );
        assert_eq!(paths("src/stats/mod.rs", "mod a { mod b { use super::super::super::vk; } }"), ["vk"]);
        assert_eq!(paths("src/stats/mod.rs", "pub(super) fn f() { self::g() }"), ["stats::g"]);
    }
}
