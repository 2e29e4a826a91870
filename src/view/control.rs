//! Converts keyboard and pointer input to camera motion and actions.

use super::action::{Action, DIGITS, KEYS};
use super::eye::Eye;
use egui::{Context, Event, InputState, Key, PointerButton, Pos2};
use glam::{DVec2, DVec3};

/// Flight speed, in camera heights per second.
const SPEED: f64 = 1.0;
/// Shift multiplies the speed by this factor; Ctrl divides it.
const FASTER: f64 = 4.0;
/// Zoom per egui point of scrolling. One notch is 50 points: it reduces the height by 15 %.
const WHEEL: f64 = 0.0033;
/// Largest distance at which the pointer grabs the divider, in points.
const GRASP: f32 = 6.0;

/// What the pointer drags until its release. Each position is the pointer's position in the last frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hold {
    /// Drags the ground.
    Ground(Pos2),
    /// Orbits about the ground point in the middle of the picture.
    View(Pos2),
    Divider,
}

/// The window's geometry, for pointer input.
pub struct Pane {
    /// Pixels.
    pub size: [u32; 2],
    pub pixels_per_point: f32,
    /// The divider's position as a share of the width; `None` without a divider.
    pub divider: Option<f32>,
}

impl Pane {
    fn pixel(&self, at: Pos2) -> DVec2 {
        DVec2::new(f64::from(at.x), f64::from(at.y)) * f64::from(self.pixels_per_point)
    }

    fn points_wide(&self) -> f32 {
        self.size[0] as f32 / self.pixels_per_point
    }
}

/// The actions of the keys pressed since the last frame. Empty while a text field has the focus.
pub fn actions(context: &Context, events: &[Event]) -> Vec<Action> {
    if context.egui_wants_keyboard_input() {
        return Vec::new();
    }
    let mut down = context.input(|input| input.keys_down.clone());
    // Each press carries its own modifiers. In a slow frame, Ctrl may already be released again.
    let pressed = |event: &Event| match event {
        // egui marks repeats only during layout.
        Event::Key { key, pressed: true, modifiers, .. } => {
            down.insert(*key).then(|| action(*key, modifiers.command)).flatten()
        }
        Event::Key { key, pressed: false, .. } => {
            down.remove(key);
            None
        }
        Event::WindowFocused(false) => {
            down.clear();
            None
        }
        _ => None,
    };
    events.iter().filter_map(pressed).collect()
}

fn action(key: Key, command: bool) -> Option<Action> {
    match DIGITS.iter().position(|digit| *digit == key) {
        Some(n) if command => Some(Action::Save(n)),
        Some(n) => Some(Action::Recall(n)),
        None if command => None,
        None => KEYS.iter().find(|(own, ..)| *own == key).map(|(.., action)| action.clone()),
    }
}

/// Moves the camera or the divider. Returns the divider's new position if it moved. `seconds` is the time
/// since the last frame.
pub fn steer(
    context: &Context,
    eye: &mut Eye,
    hold: &mut Option<Hold>,
    pane: &Pane,
    seconds: f64,
) -> Option<f32> {
    let (keyboard, pointer) = (!context.egui_wants_keyboard_input(), !context.egui_wants_pointer_input());
    context.input(|input| {
        if keyboard {
            fly(input, eye, seconds);
        }
        let at = input.pointer.latest_pos()?;
        if pointer {
            zoom(input, eye, at, pane);
        }
        if pointer && input.pointer.any_pressed() && hold.is_none() {
            // In a slow frame, motion may follow the press within the same frame.
            *hold = Some(grasped(input, input.pointer.press_origin().unwrap_or(at), pane));
        }
        let mut divider = None;
        match hold {
            Some(Hold::Ground(before)) if *before != at => {
                eye.drag(pane.pixel(*before), pane.pixel(at), pane.size);
                *before = at;
            }
            Some(Hold::View(before)) if *before != at => {
                eye.turn(pane.pixel(at) - pane.pixel(*before), pane.size);
                *before = at;
            }
            Some(Hold::Divider) => divider = Some((at.x / pane.points_wide()).clamp(0.0, 1.0)),
            _ => {}
        }
        if !input.pointer.any_down() {
            *hold = None;
        }
        if pointer && input.pointer.button_double_clicked(PointerButton::Primary) {
            eye.fly_to_pixel(pane.pixel(at), pane.size);
        }
        divider
    })
}

fn grasped(input: &InputState, at: Pos2, pane: &Pane) -> Hold {
    match pane.divider {
        Some(share) if (share * pane.points_wide() - at.x).abs() < GRASP => Hold::Divider,
        _ if input.pointer.button_pressed(PointerButton::Primary) => Hold::Ground(at),
        _ => Hold::View(at),
    }
}

fn fly(input: &InputState, eye: &mut Eye, seconds: f64) {
    let held = |key| if input.key_down(key) { 1.0 } else { 0.0 };
    let direction =
        DVec3::new(held(Key::D) - held(Key::A), held(Key::W) - held(Key::S), held(Key::E) - held(Key::Q));
    if direction != DVec3::ZERO {
        let faster = if input.modifiers.shift { FASTER } else { 1.0 };
        let slower = if input.modifiers.ctrl { FASTER } else { 1.0 };
        let step_m = SPEED * seconds * eye.height_m() * faster / slower;
        // Q and E scale the height exponentially, so the camera never reaches the ground.
        let up_m = eye.camera.altitude_m * ((direction.z * step_m / eye.camera.altitude_m).exp() - 1.0);
        eye.go(DVec3::new(direction.x * step_m, direction.y * step_m, up_m));
    }
}

fn zoom(input: &InputState, eye: &mut Eye, at: Pos2, pane: &Pane) {
    let wheel = f64::from(input.smooth_scroll_delta.y) * WHEEL;
    let factor = (-wheel).exp() / f64::from(input.zoom_delta());
    if factor != 1.0 {
        eye.zoom(factor, pane.pixel(at), pane.size);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Modifiers, RawInput};
    use ortelius::scene::Scene;

    const SIZE: [u32; 2] = [640, 360];
    const AT: Pos2 = Pos2::new(400.0, 150.0);

    /// Passes these events to egui without any panel, then moves the camera.
    fn steered(context: &Context, eye: &mut Eye, time: f64, events: Vec<Event>) {
        let pane = Pane { size: SIZE, pixels_per_point: 1.0, divider: None };
        let raw = RawInput { time: Some(time), events, ..RawInput::default() };
        drop(context.run_ui(raw, |_| ()));
        steer(context, eye, &mut None, &pane, 0.01);
    }

    fn click() -> Vec<Event> {
        let button = |pressed| Event::PointerButton {
            pos: AT,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        };
        vec![Event::PointerMoved(AT), button(true), button(false)]
    }

    fn eye() -> Eye {
        let scene = Scene::embedded("globe").unwrap();
        Eye::new(scene.cameras["africa"])
    }

    /// The ground point under a position.
    fn under(eye: &Eye, at: Pos2) -> DVec3 {
        eye.ground_at(DVec2::new(f64::from(at.x), f64::from(at.y)), SIZE).unwrap()
    }

    #[test]
    fn a_double_click_flies_to_its_point_and_two_slow_clicks_do_not() {
        let start = eye();
        for (pause_s, flies) in [(0.1, true), (2.0, false)] {
            let (context, mut eye) = (Context::default(), eye());
            steered(&context, &mut eye, 1.0, click());
            assert!(!eye.is_under_way());
            steered(&context, &mut eye, 1.0 + pause_s, click());
            assert_eq!(eye.is_under_way(), flies);
            eye.advance(1e3);
            if !flies {
                assert_eq!(eye.camera, start.camera);
                continue;
            }
            let middle = under(&eye, Pos2::new(320.0, 180.0));
            assert!((eye.camera.altitude_m * 4.0 / start.camera.altitude_m - 1.0).abs() < 1e-9);
            // The camera looks along the ellipsoid's normal, so only rounding is left.
            assert!(middle.distance(under(&start, AT)) < 1.0, "{middle}");
        }
    }

    #[test]
    fn a_pinch_changes_the_height_and_holds_the_ground_under_the_pointer() {
        let (context, mut eye) = (Context::default(), eye());
        let (held, before) = (under(&eye, AT), eye.camera.altitude_m);
        steered(&context, &mut eye, 1.0, vec![Event::PointerMoved(AT), Event::Zoom(1.25)]);
        assert!((before / eye.camera.altitude_m - 1.25).abs() < 1e-6, "{}", eye.camera.altitude_m);
        // The tolerance is a hundredth of the height, because the ellipsoid is not a sphere. The tests of `eye.rs` use
        // the same tolerance for drags.
        assert!(held.distance(under(&eye, AT)) < 0.01 * before);
        steered(&context, &mut eye, 1.1, vec![Event::Zoom(0.8)]);
        assert!((eye.camera.altitude_m / before - 1.0).abs() < 1e-6, "back: {}", eye.camera.altitude_m);
    }
}
