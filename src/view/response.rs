//! `view --measure`, last part: counts the frames from a key press to the first presented picture that differs.
//!
//! Keys are pressed between frames, while the picture rests, so the first frame after a press counts 1. For a key that
//! arrives while a frame is being drawn, add one frame, because only the next frame handles it.

use egui::{Event, Key, Modifiers};
use std::time::{Duration, Instant};

/// Keys, each pressed in the state that the earlier ones left: help (twice), panels (twice), next overlay, comparison
/// of two variants (twice), next variant, flight.
const KEYS: [Key; 9] = [Key::F1, Key::F1, Key::F2, Key::F2, Key::G, Key::X, Key::X, Key::Space, Key::W];

/// A key is pressed after this many equal pictures in a row. By then, the results of the frames in flight have been
/// drawn.
const STILL: u32 = 6;

/// A key that changes nothing within this number of frames counts as having no effect.
const MAX_FRAMES: u32 = 30;

/// If the picture does not come to rest within this number of frames and this time, the key is pressed anyway, and no
/// frames are counted for it.
const LONGEST_WAIT: (u32, Duration) = (300, Duration::from_secs(60));

/// The effect of a key.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Effect {
    /// Frames from the press to the changed picture.
    Frames(u32),
    /// The same picture in [`MAX_FRAMES`] frames.
    NoChange,
    /// The picture before the press did not rest.
    NeverAtRest,
}

/// The presses so far.
pub struct Response {
    effects: Vec<Effect>,
    /// Frames since the current press.
    since: Option<u32>,
    /// The key to release.
    down: Option<Key>,
    last: Vec<u8>,
    still: u32,
    /// Frames since the last press had its effect, and the time of that effect.
    waited: (u32, Instant),
    longest_wait: (u32, Duration),
}

impl Default for Response {
    fn default() -> Response {
        Response {
            effects: Vec::new(),
            since: None,
            down: None,
            last: Vec::new(),
            still: 0,
            waited: (0, Instant::now()),
            longest_wait: LONGEST_WAIT,
        }
    }
}

impl Response {
    /// The key events of the next frame.
    pub fn events(&mut self) -> Vec<Event> {
        let event = |key, pressed| Event::Key {
            key,
            physical_key: None,
            pressed,
            repeat: false,
            modifiers: Modifiers::NONE,
        };
        if let Some(key) = self.down.filter(|_| self.since.is_none()) {
            self.down = None;
            return vec![event(key, false)];
        }
        match KEYS.get(self.effects.len()) {
            Some(key) if self.presses_next() => {
                if self.still < STILL {
                    self.add(Effect::NeverAtRest);
                } else {
                    self.since = Some(0);
                }
                self.down = Some(*key);
                vec![event(*key, true)]
            }
            _ => Vec::new(),
        }
    }

    /// True if [`Response::events`] returns an event now.
    pub fn has_event(&self) -> bool {
        self.since.is_none() && self.down.is_some() || self.presses_next()
    }

    fn presses_next(&self) -> bool {
        let ((frames, begun), (max, longest)) = (self.waited, self.longest_wait);
        let is_too_long = || frames >= max && begun.elapsed() >= longest;
        self.effects.len() < KEYS.len() && self.since.is_none() && (self.still >= STILL || is_too_long())
    }

    fn add(&mut self, effect: Effect) {
        self.effects.push(effect);
        (self.since, self.still, self.waited) = (None, 0, (0, Instant::now()));
    }

    /// False between a key press and the changed picture. While it is true, the caller must keep the picture still:
    /// only a key may change it.
    pub fn is_at_rest(&self) -> bool {
        self.since.is_none()
    }

    /// Counts a presented frame. `settled`: true if the frame's picture is complete.
    pub fn count_frame(&mut self, picture: &[u8], settled: bool) {
        let same = self.last == picture;
        match &mut self.since {
            None => {
                self.still = if same && settled { self.still + 1 } else { 0 };
                self.waited.0 += 1;
            }
            Some(since) => {
                *since += 1;
                let frames = *since;
                match same {
                    false => self.add(Effect::Frames(frames)),
                    true if frames == MAX_FRAMES => self.add(Effect::NoChange),
                    true => {}
                }
            }
        }
        if !same {
            self.last = picture.to_vec();
        }
    }

    /// The report in one line; `None` until the last key has been counted.
    pub fn report(&self) -> Option<String> {
        if self.effects.len() < KEYS.len() {
            return None;
        }
        let named = KEYS.iter().zip(&self.effects).map(|(key, effect)| match effect {
            Effect::Frames(frames) => format!("{} {frames}", key.name()),
            Effect::NoChange => format!("{} no change within {MAX_FRAMES} frames", key.name()),
            Effect::NeverAtRest => {
                format!("{} not counted, because the picture did not come to rest", key.name())
            }
        });
        let named: Vec<String> = named.collect();
        let frames = self.effects.iter().filter_map(|effect| match effect {
            Effect::Frames(frames) => Some(*frames),
            _ => None,
        });
        let max = frames.max().unwrap_or(0);
        Some(format!("frames from a key press to a changed picture: {}; maximum {max}", named.join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The report for a window whose picture changes `delay` frames after a press.
    fn report(delay: usize) -> String {
        let (mut response, mut presses, mut pending) = (Response::default(), 0u8, Vec::new());
        loop {
            let pressed = |event: &Event| matches!(event, Event::Key { pressed: true, .. });
            if response.events().iter().any(pressed) {
                pending.push(delay);
            }
            pending.iter_mut().for_each(|left| *left -= 1);
            presses += pending.extract_if(.., |left| *left == 0).count() as u8;
            response.count_frame(&[presses], true);
            if let Some(report) = response.report() {
                return report;
            }
        }
    }

    #[test]
    fn frames_are_counted_from_the_press_to_the_first_other_picture() {
        assert!(report(1).ends_with("F1 1, F1 1, F2 1, F2 1, G 1, X 1, X 1, Space 1, W 1; maximum 1"));
        assert!(report(3).ends_with("W 3; maximum 3"), "a slow window is reported");
        let (mut response, picture) = (Response::default(), [7]);
        while response.report().is_none() {
            response.events();
            response.count_frame(&picture, true);
        }
        assert!(response.report().unwrap().contains("G no change within 30 frames"));
    }

    #[test]
    fn a_picture_that_never_rests_ends_the_measurement_too() {
        let mut response = Response { longest_wait: (20, Duration::ZERO), ..Response::default() };
        for n in 0..1000_u32 {
            let has_event = response.has_event();
            assert_eq!(has_event, !response.events().is_empty());
            // After the second key, each picture differs from the one before.
            let picture = if response.effects.len() < 2 { response.effects.len() as u32 } else { n };
            response.count_frame(&picture.to_le_bytes(), true);
        }
        let report = response.report().unwrap();
        let never = "not counted, because the picture did not come to rest";
        assert!(
            report.contains(&format!("F2 {never}")) && report.contains(&format!("W {never}")),
            "{report}"
        );
        assert!(report.contains("F1 no change within 30 frames"), "{report}");
    }

    #[test]
    fn no_key_is_pressed_while_the_picture_changes_or_is_incomplete() {
        let mut response = Response::default();
        for n in 0..50 {
            response.count_frame(&[n], true);
            assert_eq!(response.events(), []);
        }
        for _ in 0..50 {
            response.count_frame(&[0], false);
            assert_eq!(response.events(), []);
        }
    }
}
