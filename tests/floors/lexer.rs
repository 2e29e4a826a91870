//! Splits Rust text into identifiers and punctuation. Comments and literals are left out, because they contain no
//! imports.

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Token {
    /// A name, `::`, or one character.
    pub text: String,
    /// From 1.
    pub line: usize,
}

fn is_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The text still to be read.
struct Rest<'a> {
    text: &'a str,
    line: usize,
}

impl<'a> Rest<'a> {
    /// Advances by `bytes` and returns the skipped text.
    fn take(&mut self, bytes: usize) -> &'a str {
        let (taken, rest) = self.text.split_at(bytes.min(self.text.len()));
        self.line += taken.matches('\n').count();
        self.text = rest;
        taken
    }

    /// Advances past the next `end`, or to the end of the text.
    fn take_past(&mut self, end: &str) {
        self.take(self.text.find(end).map_or(self.text.len(), |at| at + end.len()));
    }

    fn block_comment(&mut self) {
        self.take(2);
        let mut depth = 1;
        while depth > 0 && !self.text.is_empty() {
            if self.text.starts_with("/*") {
                depth += 1;
                self.take(2);
            } else if self.text.starts_with("*/") {
                depth -= 1;
                self.take(2);
            } else {
                self.character();
            }
        }
    }

    fn character(&mut self) {
        let length = self.text.chars().next().map_or(0, char::len_utf8);
        self.take(length);
    }

    /// Starts at the opening quote; `\` escapes the next character.
    fn quoted(&mut self, quote: char) {
        self.character();
        while let Some(c) = self.text.chars().next() {
            self.character();
            match c {
                '\\' => self.character(),
                c if c == quote => return,
                _ => {}
            }
        }
    }

    /// `r"..."`, `br#"..."#` and so on. Returns false, without reading, if there is none.
    fn raw_string(&mut self) -> bool {
        let prefix = ["br", "cr", "r"].into_iter().find(|prefix| self.text.starts_with(prefix));
        let Some(after) = prefix.map(|prefix| &self.text[prefix.len()..]) else { return false };
        let hashes = after.len() - after.trim_start_matches('#').len();
        if !after[hashes..].starts_with('"') {
            return false;
        }
        self.take(self.text.len() - after.len() + hashes + 1);
        self.take_past(&format!("\"{}", "#".repeat(hashes)));
        true
    }

    /// A character literal, or only the apostrophe of a lifetime.
    fn apostrophe(&mut self) {
        let mut following = self.text[1..].chars();
        let (first, second) = (following.next(), following.next());
        if first == Some('\\') || second == Some('\'') {
            self.quoted('\'');
        } else {
            self.take(1);
        }
    }
}

pub fn tokens(text: &str) -> Vec<Token> {
    let mut rest = Rest { text, line: 1 };
    let mut tokens = Vec::new();
    while let Some(c) = rest.text.chars().next() {
        let line = rest.line;
        if rest.text.starts_with("//") {
            rest.take_past("\n");
        } else if rest.text.starts_with("/*") {
            rest.block_comment();
        } else if c == '"' {
            rest.quoted('"');
        } else if c == '\'' {
            rest.apostrophe();
        } else if rest.text.starts_with("r#") && rest.text[2..].starts_with(is_name) {
            rest.take(2); // a raw name; the name follows
        } else if rest.raw_string() || c.is_whitespace() {
            // `raw_string` has consumed it.
            if c.is_whitespace() {
                rest.character();
            }
        } else if is_name(c) {
            let length = rest.text.find(|c| !is_name(c)).unwrap_or(rest.text.len());
            tokens.push(Token { text: rest.take(length).to_owned(), line });
        } else if rest.text.starts_with("::") {
            tokens.push(Token { text: rest.take(2).to_owned(), line });
        } else {
            tokens.push(Token { text: rest.take(c.len_utf8()).to_owned(), line });
        }
    }
    tokens
}

#[cfg(test)]
mod tests {
    fn words(text: &str) -> Vec<String> {
        super::tokens(text).into_iter().map(|token| token.text).collect()
    }

    #[test]
    fn comments_and_literals_contain_no_names() {
        let text = r####"
            // unsafe
            /* unsafe /* nested */ unsafe */
            let a = "unsafe \" unsafe"; let b = r#"un"safe"#; let c = b"unsafe"; let d = br"unsafe";
            let e = '"'; let f = '\''; let g = '\u{1F600}';
            fn h<'unsafe_like>(x: &'unsafe_like str) {}
            real
        "####;
        let words = words(text);
        assert!(!words.iter().any(|word| word == "unsafe" || word == "safe"), "{words:?}");
        assert_eq!(words.last().unwrap(), "real");
        assert_eq!(words.iter().filter(|word| *word == "unsafe_like").count(), 2);
    }

    #[test]
    fn a_name_after_a_literal_is_found() {
        for text in [
            "'\"' unsafe '\"'",
            "\"\\\\\" unsafe",
            "r\"\\\" unsafe",
            "/* \" */ unsafe",
            "r#unsafe",
            "br\"x\"unsafe",
        ] {
            assert!(words(text).contains(&"unsafe".to_owned()), "{text}: {:?}", words(text));
        }
    }

    #[test]
    fn lines_are_counted_through_literals() {
        let tokens = super::tokens("a\n\"x\ny\"\n/*\n*/ b");
        assert_eq!(tokens.iter().find(|token| token.text == "b").unwrap().line, 5);
    }
}
