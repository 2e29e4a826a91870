//! `view --measure`, last part: counts the frames from a key press to the first presented picture that differs.
//!
//! Keys are pressed between frames, while the picture rests, so the first frame after a press counts 1. For a key that
//! arrives while a frame is being drawn, add one frame, because only the next frame handles it.

use egui::{Event, Key, Modifiers};

/// Keys, each pressed in the state that the earlier ones left: help (twice), panels (twice), next overlay, comparison
/// of two variants (twice), next variant, flight.
const KEYS: [Key; 9] = [Key::F1, Key::F1, Key::F2, Key::F2, Key::G, Key::X, Key::X, Key::Space, Key::W];

/// A key is pressed after this many equal pictures in a row. By then, the results of the frames in flight have been
/// drawn.
const STILL: u32 = 6;

/// A key that changes nothing within this number of frames counts as having no effect.
const MOST: u32 = 30;

/// The presses so far.
#[derive(Default)]
pub struct Response {
    /// For each key, the frames from the press to the changed picture; `None` if the picture did not change.
    frames: Vec<Option<u32>>,
    /// Frames since the current press.
    since: Option<u32>,
    /// The key to release.
    down: Option<Key>,
    last: Vec<u8>,
    still: u32,
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
        match KEYS.get(self.frames.len()) {
            Some(key) if self.since.is_none() && self.still >= STILL => {
                (self.since, self.down) = (Some(0), Some(*key));
                vec![event(*key, true)]
            }
            _ => Vec::new(),
        }
    }

    /// True unless a press waits for its changed picture. While true, nothing but a key may change the picture.
    pub fn rests(&self) -> bool {
        self.since.is_none()
    }

    /// Counts a presented frame. `settled`: true if the frame's picture is complete.
    pub fn see(&mut self, picture: &[u8], settled: bool) {
        let same = self.last == picture;
        match &mut self.since {
            None => self.still = if same && settled { self.still + 1 } else { 0 },
            Some(since) => {
                *since += 1;
                if !same || *since == MOST {
                    self.frames.push((!same).then_some(*since));
                    (self.since, self.still) = (None, 0);
                }
            }
        }
        if !same {
            self.last = picture.to_vec();
        }
    }

    /// The report in one line; `None` until the last key has been counted.
    pub fn report(&self) -> Option<String> {
        if self.frames.len() < KEYS.len() {
            return None;
        }
        let named = KEYS.iter().zip(&self.frames).map(|(key, frames)| match frames {
            Some(frames) => format!("{} {frames}", key.name()),
            None => format!("{} no change", key.name()),
        });
        let most = self.frames.iter().flatten().max().copied().unwrap_or(0);
        let named: Vec<String> = named.collect();
        Some(format!("frames from a key press to a changed picture: {}; most {most}", named.join(", ")))
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
            response.see(&[presses], true);
            if let Some(report) = response.report() {
                return report;
            }
        }
    }

    #[test]
    fn frames_are_counted_from_the_press_to_the_first_other_picture() {
        assert!(report(1).ends_with("F1 1, F1 1, F2 1, F2 1, G 1, X 1, X 1, Space 1, W 1; most 1"));
        assert!(report(3).ends_with("W 3; most 3"), "a slow window is reported");
        let (mut response, picture) = (Response::default(), [7]);
        while response.report().is_none() {
            response.events();
            response.see(&picture, true);
        }
        assert!(response.report().unwrap().contains("G no change"));
    }

    #[test]
    fn no_key_is_pressed_while_the_picture_changes_or_is_incomplete() {
        let mut response = Response::default();
        for n in 0..50 {
            response.see(&[n], true);
            assert_eq!(response.events(), []);
        }
        for _ in 0..50 {
            response.see(&[0], false);
            assert_eq!(response.events(), []);
        }
    }
}
