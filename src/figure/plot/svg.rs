//! The shapes of plots. Colours are CSS classes, so that one drawing serves light and dark pages.

use std::fmt::Write as _;

/// Width of a drawing in its own units; on a phone of 390 points a unit is about 0.8 points.
pub const WIDTH: f64 = 440.0;

/// Average width of a letter of size 13 in the widest common font (DejaVu Sans).
const LETTER: f64 = 7.8;

/// Line spacing of wrapped text.
pub const LINE: f64 = 16.0;

/// Number of hues; further lines are dashed.
pub const HUES: usize = 8;

/// `plot.css`, for stand-alone files.
const STYLE: &str = include_str!("plot.css");

/// An SVG under construction; y points down.
#[derive(Default)]
pub struct Svg {
    body: String,
}

/// Which point of a text is at the given position.
#[derive(Clone, Copy)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Estimated width of a text, more often too large than too small.
pub fn width_of(text: &str) -> f64 {
    text.chars().count() as f64 * LETTER
}

/// The text, cut to at most `room` units.
pub fn shortened(text: &str, room: f64) -> String {
    let max = (room / LETTER).max(2.0) as usize;
    match text.chars().count() > max {
        true => text.chars().take(max - 1).chain(['…']).collect(),
        false => text.to_string(),
    }
}

/// The text in lines of at most `room` units, split between words; a longer word is split anywhere.
pub fn wrapped(text: &str, room: f64) -> Vec<String> {
    let max = (room / LETTER).max(2.0) as usize;
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let line = lines.last_mut().expect("there is a first line");
        match (line.is_empty(), line.chars().count() + 1 + word.chars().count() <= max) {
            (true, _) => line.push_str(word),
            (false, true) => line.extend([" ", word]),
            (false, false) => lines.push(word.to_string()),
        }
        while let Some((at, _)) = lines.last().and_then(|line| line.char_indices().nth(max)) {
            let rest = lines.last_mut().map(|line| line.split_off(at));
            lines.extend(rest);
        }
    }
    lines
}

/// Cuts names to at most `room`. If two names would be equal after their ends are cut, their middles are cut instead.
pub fn cut_apart(names: &[&str], room: f64) -> Vec<String> {
    let ends: Vec<String> = names.iter().map(|name| shortened(name, room)).collect();
    let middle = |name: &str| {
        let (all, max) = (name.chars().count(), (room / LETTER).max(2.0) as usize);
        let head = (max - 1) / 2;
        let tail = max - 1 - head;
        name.chars().take(head).chain(['…']).chain(name.chars().skip(all - tail)).collect()
    };
    let alike =
        |at: usize| (0..names.len()).any(|other| names[other] != names[at] && ends[other] == ends[at]);
    let of = |at: usize| if alike(at) { middle(names[at]) } else { ends[at].clone() };
    (0..names.len()).map(of).collect()
}

impl Svg {
    fn push(&mut self, text: std::fmt::Arguments<'_>) {
        self.body.write_fmt(text).expect("writing to a string cannot fail");
        self.body.push('\n');
    }

    pub fn text(&mut self, [x, y]: [f64; 2], anchor: Anchor, class: &str, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let text = escaped(text);
        self.push(format_args!(
            r#"<text x="{x:.1}" y="{y:.1}" text-anchor="{anchor}" class="{class}">{text}</text>"#
        ));
    }

    /// Lines below each other, the first at `y`; returns the position of a next line.
    pub fn lines(&mut self, [x, mut y]: [f64; 2], anchor: Anchor, class: &str, lines: &[String]) -> f64 {
        for line in lines {
            self.text([x, y], anchor, class, line);
            y += LINE;
        }
        y
    }

    pub fn line(&mut self, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2], class: &str) {
        self.push(format_args!(
            r#"<line x1="{x1:.1}" y1="{y1:.1}" x2="{x2:.1}" y2="{y2:.1}" class="{class}"/>"#
        ));
    }

    pub fn polyline(&mut self, points: &[[f64; 2]], class: &str) {
        let points: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        self.push(format_args!(r#"<polyline points="{}" class="{class}"/>"#, points.join(" ")));
    }

    /// A bar; `tooltip` appears on hover.
    pub fn bar(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], class: &str, tooltip: &str) {
        let tooltip = escaped(tooltip);
        self.push(format_args!(
            r#"<rect x="{x:.1}" y="{y:.1}" width="{width:.1}" height="{height:.1}" class="{class}"><title>{tooltip}</title></rect>"#
        ));
    }

    /// A mark of one of four forms.
    pub fn mark(&mut self, [x, y]: [f64; 2], form: usize, class: &str, tooltip: &str) {
        let tooltip = escaped(tooltip);
        let path = match form % 4 {
            0 => format!("M{:.1},{y:.1}a3.5,3.5 0 1 0 7,0a3.5,3.5 0 1 0 -7,0", x - 3.5),
            1 => format!("M{:.1},{:.1}h6v6h-6z", x - 3.0, y - 3.0),
            2 => format!("M{x:.1},{:.1}l4,7h-8z", y - 4.2),
            _ => format!("M{x:.1},{:.1}l4,4l-4,4l-4,-4z", y - 4.0),
        };
        self.push(format_args!(r#"<path d="{path}" class="{class}"><title>{tooltip}</title></path>"#));
    }

    /// The drawing for a page that has the style. `described`: text for screen readers.
    pub fn inline(&self, height: f64, described: &str) -> String {
        let (described, body) = (escaped(described), &self.body);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height:.0}\" class=\"plot\" role=\"img\" \
             aria-label=\"{described}\">\n{body}</svg>\n"
        )
    }
}

/// A stand-alone file from the output of [`Svg::inline`].
pub fn file(inline: &str) -> String {
    inline.replacen(
        ">\n",
        &format!(">\n<style>\n{STYLE}</style>\n<rect class=\"paper\" width=\"100%\" height=\"100%\"/>\n"),
        1,
    )
}

#[cfg(test)]
mod tests {
    use super::{LETTER, cut_apart, wrapped};

    #[test]
    fn a_text_is_split_between_words_and_nothing_is_lost() {
        let lines = |text| wrapped(text, 10.0 * LETTER);
        assert_eq!(lines("ten letter"), ["ten letter"]);
        assert_eq!(lines("ten letters"), ["ten", "letters"]);
        assert_eq!(lines("a wordwithoutaspace b"), ["a", "wordwithou", "taspace b"]);
        assert_eq!(lines(""), [""]);
    }

    #[test]
    fn names_with_equal_starts_are_cut_in_the_middle_and_others_at_the_end() {
        let names = ["feedback, blocks of 1 x 1", "feedback, blocks of 2 x 2", "a longer name than has room"];
        let cut = cut_apart(&names, 12.0 * LETTER);
        assert_eq!(cut, ["feedb… 1 x 1", "feedb… 2 x 2", "a longer na…"]);
        assert_eq!(cut_apart(&names[..1], 12.0 * LETTER), ["feedback, b…"]);
        // The same name in two groups.
        assert_eq!(cut_apart(&["one", "one"], 12.0 * LETTER), ["one", "one"]);
    }
}
