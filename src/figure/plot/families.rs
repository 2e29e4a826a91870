//! A chart of single points, one for each variant. A family of variants has one colour and one form. The points of the
//! front are numbered, and a list below the legend has their names. The tooltip of a mark names every point under it.

use super::lines::{Along, Field, Line, draw_floor};
use super::svg::{Anchor, Svg, WIDTH, cut_apart, width_of};
use super::{Chart, Point};
use crate::figure::words::tick;

/// Height of the plotted field.
const FIELD: f64 = 340.0;

/// Hues of families. The last hue of [`super::svg::HUES`] is the front's.
const HUES: usize = 7;
const FRONT: usize = 7;

/// Half the side of a mark.
const MARK: f64 = 4.0;

/// A variant's only point.
struct Spot<'a> {
    line: &'a Line,
    at: [f64; 2],
    family: usize,
    /// Position on the front, from 1; `None` off the front.
    number: Option<usize>,
}

/// The hue and the form of a family.
fn marked(family: usize) -> (usize, usize) {
    (family % HUES, (family + 2 * (family / HUES)) % 4)
}

/// Lines of one point are marks; longer lines are fronts. `family` names the family of a variant. `variants` are all
/// variants of the figure, so that a family has the same mark in every chart.
pub fn draw(
    chart: &Chart,
    along: &Along,
    lines: &[Line],
    floor: Option<&Line>,
    (family, variants): (fn(&str) -> &'static str, &[String]),
) -> Option<String> {
    let all: Vec<(f64, Point)> =
        lines.iter().chain(floor).flat_map(|line| line.points.iter().copied()).collect();
    let mut svg = Svg::default();
    let field = Field::draw(&mut svg, chart, along, &all, FIELD)?;
    if let Some(floor) = floor {
        draw_floor(&mut svg, &field, floor);
    }
    let fronts: Vec<&Line> = lines.iter().filter(|line| line.points.len() > 1).collect();
    for front in &fronts {
        let points: Vec<[f64; 2]> = front.points.iter().filter_map(|point| field.place(point)).collect();
        svg.polyline(&points, &format!("curve s{FRONT}"));
    }
    let mut families: Vec<&str> = Vec::new();
    for name in variants.iter().map(|name| family(name)) {
        if !families.contains(&name) {
            families.push(name);
        }
    }
    let number_of = |name: &str| families.iter().position(|known| *known == family(name)).unwrap_or_default();
    let mut spots = spots(lines, &fronts, &field, number_of);
    // Marks of the front are drawn last, on top.
    spots.sort_by_key(|spot| spot.number);
    for spot in &spots {
        let (hue, form) = marked(spot.family);
        svg.mark(spot.at, form, &format!("f{hue}"), &tooltip(spot, &spots, chart));
    }
    number(&mut svg, &spots, &field);
    let front = fronts.first().map(|line| &*line.name);
    let shown = families.iter().enumerate().filter(|(n, _)| spots.iter().any(|spot| spot.family == *n));
    let shown: Vec<(usize, &str)> = shown.map(|(number, name)| (number, *name)).collect();
    let end = legend(&mut svg, &shown, front, field.bottom + 56.0);
    let end = members(&mut svg, &spots, front, end + 14.0);
    Some(svg.inline(end, &chart.title))
}

fn spots<'a>(
    lines: &'a [Line],
    fronts: &[&Line],
    field: &Field,
    family: impl Fn(&str) -> usize,
) -> Vec<Spot<'a>> {
    let members = || fronts.iter().flat_map(|front| &front.points);
    let mut found = Vec::new();
    for line in lines {
        let [point] = &line.points[..] else { continue };
        let Some(at) = field.place(point) else { continue };
        let number = members().position(|member| member == point).map(|at| at + 1);
        found.push(Spot { line, at, family: family(&line.name), number });
    }
    found
}

/// A line for each point under the mark, the mark's own first.
fn tooltip(spot: &Spot<'_>, spots: &[Spot<'_>], chart: &Chart) -> String {
    let near = |other: &&Spot<'_>| {
        let apart = [0, 1].map(|n| (other.at[n] - spot.at[n]).abs());
        other.line.name != spot.line.name && apart[0].max(apart[1]) <= MARK
    };
    let described = |spot: &Spot<'_>| {
        let (x, point) = &spot.line.points[0];
        format!("{} at {}", point.described(&spot.line.name, &chart.unit), tick(*x))
    };
    let all = std::iter::once(spot).chain(spots.iter().filter(near));
    all.map(described).collect::<Vec<_>>().join("\n")
}

/// Writes the numbers of the front's points next to their marks: at the nearest place that covers no mark and no other
/// number.
fn number(svg: &mut Svg, spots: &[Spot<'_>], field: &Field) {
    let around = |[x, y]: [f64; 2], across: f64, up: f64| {
        [x - across / 2.0, y - up / 2.0, x + across / 2.0, y + up / 2.0]
    };
    let mut taken: Vec<[f64; 4]> = spots.iter().map(|spot| around(spot.at, 2.0 * MARK, 2.0 * MARK)).collect();
    let mut numbered: Vec<_> = spots.iter().filter_map(|spot| Some((spot.number?, spot.at))).collect();
    numbered.dedup();
    for (number, [x, y]) in numbered {
        let text = number.to_string();
        let places: Vec<[f64; 2]> = [10.0, 18.0, 28.0, 40.0]
            .into_iter()
            .flat_map(|away| {
                // Up and to the right first.
                (0..8).map(move |eighth| {
                    let (sin, cos) = f64::to_radians(45.0 * f64::from(eighth) - 45.0).sin_cos();
                    [x + away * cos, y + away * sin]
                })
            })
            .collect();
        let of = |at: [f64; 2]| around(at, width_of(&text), 12.0);
        let free = |at: &&[f64; 2]| {
            let [x0, y0, x1, y1] = of(**at);
            let apart = |t: &[f64; 4]| x1 <= t[0] || t[2] <= x0 || y1 <= t[1] || t[3] <= y0;
            let inside = field.left <= x0 && x1 <= field.right && field.top <= y0 && y1 <= field.bottom;
            inside && taken.iter().all(apart)
        };
        let place = *places.iter().find(free).unwrap_or(&places[0]);
        if (place[0] - x).hypot(place[1] - y) > 12.0 {
            svg.line([x, y], place, "rule");
        }
        svg.text([place[0], place[1] + 4.5], Anchor::Middle, "name", &text);
        taken.push(of(place));
    }
}

/// Draws the families, and the front's line, in as many rows as needed; returns the bottom.
fn legend(svg: &mut Svg, families: &[(usize, &str)], front: Option<&str>, top: f64) -> f64 {
    let (mut x, mut y) = (0.0, top);
    let marks = families.iter().map(|(number, name)| (Some(*number), *name));
    for (number, name) in marks.chain(front.map(|name| (None, name))) {
        let room = 14.0 + width_of(name) + 10.0;
        if x > 0.0 && x + room > WIDTH {
            (x, y) = (0.0, y + 19.0);
        }
        match number.map(marked) {
            Some((hue, form)) => svg.mark([x + 5.0, y], form, &format!("f{hue}"), name),
            None => svg.line([x, y], [x + 10.0, y], &format!("curve s{FRONT}")),
        }
        svg.text([x + 14.0, y + 4.5], Anchor::Start, "name", name);
        x += room;
    }
    y + 12.0
}

/// Lists the points of the front by their numbers; returns the bottom.
fn members(svg: &mut Svg, spots: &[Spot<'_>], front: Option<&str>, top: f64) -> f64 {
    let members: Vec<&Spot<'_>> = spots.iter().filter(|spot| spot.number.is_some()).collect();
    let (Some(front), false) = (front, members.is_empty()) else { return top - 14.0 };
    svg.text([0.0, top + 4.5], Anchor::Start, "faint", &format!("{front}:"));
    let (mut x, mut y) = (0.0, top + 19.0);
    let names: Vec<&str> = members.iter().map(|spot| &*spot.line.name).collect();
    for (spot, name) in members.iter().zip(cut_apart(&names, WIDTH - 30.0)) {
        let text = format!("{} {name}", spot.number.unwrap_or_default());
        let room = width_of(&text) + 12.0;
        if x > 0.0 && x + room > WIDTH {
            (x, y) = (0.0, y + 19.0);
        }
        svg.text([x, y + 4.5], Anchor::Start, &format!("name{}", spot.line.highlight), &text);
        x += room;
    }
    y + 12.0
}

#[cfg(test)]
mod tests {
    use super::super::lines::points_and_front;
    use super::*;

    #[test]
    fn families_have_distinct_marks() {
        let marks: std::collections::BTreeSet<_> = (0..2 * HUES).map(marked).collect();
        assert_eq!(marks.len(), 2 * HUES);
    }

    /// The chart of these points with a front.
    fn drawn(points: &[(&str, [f64; 2])], front: &[[f64; 2]]) -> String {
        let (chart, along, lines) = points_and_front(points, ("front", front));
        let family = |name: &str| match name {
            "absent" => "absent family",
            _ if name.starts_with("our") => "ours",
            _ => "others",
        };
        let variants: Vec<String> =
            ["absent"].into_iter().chain(points.iter().map(|(name, _)| *name)).map(String::from).collect();
        draw(&chart, &along, &lines, None, (family, &variants)).unwrap()
    }

    #[test]
    fn points_of_the_front_are_numbered_and_listed_and_every_mark_names_its_points() {
        let points = [("our a", [1.0, 1.0]), ("our b", [10.0, 0.1]), ("c", [10.0, 0.1]), ("d", [5.0, 0.9])];
        let svg = drawn(&points, &[[1.0, 1.0], [10.0, 0.1]]);
        for listed in [">1 our a<", ">2 our b<", ">2 c<", ">1<", ">2<", ">ours<", ">others<", ">front<"] {
            assert!(svg.contains(listed), "no {listed} in {svg}");
        }
        assert!(!svg.contains("3 d") && svg.contains("<title>d: 0.9 at 5</title>"), "{svg}");
        assert!(svg.contains("<title>our b: 0.1 at 10\nc: 0.1 at 10</title>"), "{svg}");
        assert!(!svg.contains("absent family"), "{svg}");
        // One number for two points in one place; the axes' numbers have another class.
        assert_eq!(svg.matches("class=\"name\">2<").count(), 1, "{svg}");
    }

    #[test]
    fn numbers_of_near_points_are_apart() {
        let points =
            [("a", [7.30, 0.0054]), ("b", [7.31, 0.0049]), ("c", [7.44, 0.0044]), ("d", [99.0, 1e-5])];
        let svg = drawn(&points, &points.map(|(_, at)| at));
        let place = |number: &str| {
            let text =
                svg.lines().find(|line| line.ends_with(&format!("class=\"name\">{number}</text>"))).unwrap();
            let number = |key: &str| text.split(key).nth(1).unwrap().split('"').next().unwrap();
            ["x=\"", " y=\""].map(|key| number(key).parse::<f64>().unwrap())
        };
        let places = ["1", "2", "3"].map(place);
        for (n, m) in [(0, 1), (0, 2), (1, 2)] {
            let [dx, dy] = [0, 1].map(|c| (places[n][c] - places[m][c]).abs());
            assert!(dx >= 7.0 || dy >= 12.0, "{places:?}");
        }
    }
}
