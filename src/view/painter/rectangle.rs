//! Rectangles of whole pixels.

use ortelius::vk::TargetPart;

/// Pixels from `at` to before `end`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rectangle {
    pub at: [u32; 2],
    pub end: [u32; 2],
}

impl Rectangle {
    pub fn size(&self) -> [u32; 2] {
        [0, 1].map(|axis| self.end[axis] - self.at[axis])
    }

    /// In pixels.
    pub fn area(&self) -> u64 {
        self.size().into_iter().map(u64::from).product()
    }

    pub fn part(&self) -> TargetPart {
        (self.at, self.size())
    }

    pub fn contains(&self, other: &Rectangle) -> bool {
        self.within(other) == Some(*other)
    }

    pub fn overlaps(&self, other: &Rectangle) -> bool {
        self.within(other).is_some()
    }

    /// The intersection; `None` if it is empty.
    pub fn within(&self, other: &Rectangle) -> Option<Rectangle> {
        let at = [0, 1].map(|axis| self.at[axis].max(other.at[axis]));
        let end = [0, 1].map(|axis| self.end[axis].min(other.end[axis]));
        (0..2).all(|axis| at[axis] < end[axis]).then_some(Rectangle { at, end })
    }

    /// The smallest rectangle that holds both rectangles.
    pub fn with(&self, other: &Rectangle) -> Rectangle {
        Rectangle {
            at: [0, 1].map(|axis| self.at[axis].min(other.at[axis])),
            end: [0, 1].map(|axis| self.end[axis].max(other.end[axis])),
        }
    }

    /// At most four disjoint rectangles that hold the pixels of this rectangle outside `hole`.
    pub fn without(&self, hole: &Rectangle) -> Vec<Rectangle> {
        let Some(hole) = self.within(hole) else { return vec![*self] };
        let ([left, top], [right, bottom]) = (self.at, self.end);
        let around = [
            Rectangle { at: [left, top], end: [right, hole.at[1]] },
            Rectangle { at: [left, hole.at[1]], end: [hole.at[0], hole.end[1]] },
            Rectangle { at: [hole.end[0], hole.at[1]], end: [right, hole.end[1]] },
            Rectangle { at: [left, hole.end[1]], end: [right, bottom] },
        ];
        around.into_iter().filter(|part| part.area() > 0).collect()
    }
}

/// Disjoint rectangles that hold all `parts`. Two rectangles become one if they overlap, or if their union has at most
/// `slack` additional pixels.
pub fn disjoint(parts: impl IntoIterator<Item = Rectangle>, slack: u64) -> Vec<Rectangle> {
    let mut found: Vec<Rectangle> = Vec::new();
    for mut next in parts {
        // The union with one rectangle may overlap another.
        let joins = |next: &Rectangle, other: &Rectangle| {
            other.overlaps(next) || other.with(next).area() <= other.area() + next.area() + slack
        };
        while let Some(n) = found.iter().position(|other| joins(&next, other)) {
            next = next.with(&found.swap_remove(n));
        }
        found.push(next);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle(at: [u32; 2], size: [u32; 2]) -> Rectangle {
        Rectangle { at, end: [0, 1].map(|axis| at[axis] + size[axis]) }
    }

    fn holds(rectangle: &Rectangle, at: [u32; 2]) -> bool {
        (0..2).all(|axis| (rectangle.at[axis]..rectangle.end[axis]).contains(&at[axis]))
    }

    #[test]
    fn every_pixel_is_held_once_and_distant_rectangles_stay_apart() {
        // Two chains of overlapping rectangles. Only the last link of the second chain overlaps the first chain.
        let parts = [
            rectangle([60, 0], [20, 50]),
            rectangle([0, 40], [9, 5]),
            rectangle([0, 0], [10, 4]),
            rectangle([4, 2], [10, 4]),
            rectangle([20, 0], [8, 8]),
            rectangle([12, 5], [9, 2]),
            rectangle([82, 0], [3, 3]),
        ];
        for (slack, expected) in [(0, vec![9, 45, 28 * 8, 20 * 50]), (250, vec![45, 28 * 8, 25 * 50])] {
            let found = disjoint(parts, slack);
            for at in (0..50).flat_map(|y| (0..90).map(move |x| [x, y])) {
                let count = found.iter().filter(|found| holds(found, at)).count();
                assert!(count <= 1, "{at:?} is held {count} times");
                assert!(count == 1 || !parts.iter().any(|part| holds(part, at)), "{at:?} is missing");
            }
            let mut pixels: Vec<u64> = found.iter().map(Rectangle::area).collect();
            pixels.sort_unstable();
            assert_eq!(pixels, expected, "slack of {slack} pixels");
        }
    }

    #[test]
    fn the_parts_around_a_hole_are_the_other_pixels() {
        let whole = rectangle([2, 3], [8, 7]);
        for hole in [
            rectangle([4, 5], [2, 2]),
            rectangle([0, 0], [5, 5]),
            rectangle([2, 3], [8, 7]),
            rectangle([6, 0], [9, 30]),
            rectangle([20, 3], [4, 4]),
        ] {
            let parts = whole.without(&hole);
            for at in (0..30).flat_map(|y| (0..30).map(move |x| [x, y])) {
                let expected = usize::from(holds(&whole, at) && !holds(&hole, at));
                assert_eq!(parts.iter().filter(|part| holds(part, at)).count(), expected, "{at:?} {hole:?}");
            }
        }
    }
}
