//! Limits the length of functions: a function longer than a screen has steps that deserve names.

use crate::lexer::{Token, tokens};

/// Lines between a body's braces, comments and blank lines included.
pub const MAX_LINES: usize = 60;

/// A function of a file and the lines of its body.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Function {
    pub name: String,
    /// Of its `fn`, from 1.
    pub line: usize,
    pub body_lines: usize,
}

/// All functions with a body, including inner functions and tests.
pub fn functions(text: &str) -> Vec<Function> {
    let tokens = tokens(text);
    let starts = (0..tokens.len()).filter(|&at| tokens[at].text == "fn");
    starts.filter_map(|at| function(&tokens, at)).collect()
}

/// The function whose `fn` is token `at`; `None` for a type (`fn(u32)`) or a declaration without a body.
fn function(tokens: &[Token], at: usize) -> Option<Function> {
    let name = tokens.get(at + 1).filter(|token| token.text != "(")?;
    // Depth of parentheses and brackets: the `;` of `[u8; 4]` does not end a signature.
    let mut depth = 0;
    let open = (at..tokens.len()).find(|&at| {
        match tokens[at].text.as_str() {
            "(" | "[" => depth += 1,
            ")" | "]" => depth -= 1,
            _ => {}
        }
        depth == 0 && matches!(tokens[at].text.as_str(), "{" | ";")
    })?;
    if tokens[open].text == ";" {
        return None;
    }
    let close = closing(tokens, open)?;
    let body_lines = (tokens[close].line - tokens[open].line).saturating_sub(1);
    Some(Function { name: name.text.clone(), line: tokens[at].line, body_lines })
}

fn closing(tokens: &[Token], open: usize) -> Option<usize> {
    let mut depth = 0;
    (open..tokens.len()).find(|&at| {
        match tokens[at].text.as_str() {
            "{" => depth += 1,
            "}" => depth -= 1,
            _ => {}
        }
        depth == 0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lengths(text: &str) -> Vec<(String, usize)> {
        functions(text).into_iter().map(|function| (function.name, function.body_lines)).collect()
    }

    #[test]
    fn the_lines_between_the_braces_count() {
        assert_eq!(lengths("fn a() {}"), [("a".into(), 0)]);
        assert_eq!(lengths("fn a() {\n    b();\n\n    // why\n}"), [("a".into(), 3)]);
        let long = format!("fn a() {{\n{}}}", "b();\n".repeat(61));
        assert_eq!(lengths(&long), [("a".into(), MAX_LINES + 1)]);
    }

    #[test]
    fn signatures_inner_functions_and_literals_are_parsed() {
        let text = "fn a(\n    x: [u8; 4],\n) -> [u8; 4]\nwhere\n    A: B,\n{\n    x\n}";
        assert_eq!(lengths(text), [("a".into(), 1)]);
        assert_eq!(
            lengths("fn a() {\n    fn b() {\n        \"}\";\n    }\n}"),
            [("a".into(), 3), ("b".into(), 1)]
        );
        assert_eq!(lengths("trait T {\n    fn a();\n    fn b() {\n        c\n    }\n}"), [("b".into(), 1)]);
        assert_eq!(lengths("struct S {\n    f: fn(u32) -> u32,\n}"), []);
    }
}
