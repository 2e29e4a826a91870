//! Keys and pointer become moves of the eye, and actions.

use super::action::{Action, DIGITS, KEYS};
use super::eye::Eye;
use egui::{Context, InputState, Key, PointerButton, Pos2};
use glam::{DVec2, DVec3};

/// How far flying goes in a second, in heights.
const SPEED: f64 = 1.0;
/// By what Shift multiplies it, and Ctrl divides it.
const FASTER: f64 = 4.0;
/// A notch of the wheel, 50 points as egui counts them, takes a sixth of the height.
const WHEEL: f64 = 0.0033;
/// So many points from the divider still grab it.
const GRASP: f32 = 6.0;

/// What a press of the pointer has hold of until it is released, and where the pointer was in the last frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hold {
    /// To move it.
    Ground(Pos2),
    /// To turn about its middle.
    View(Pos2),
    Divider,
}

/// The window as the pointer sees it.
pub struct Pane {
    /// Pixels.
    pub size: [u32; 2],
    pub pixels_per_point: f32,
    /// Where the divider is, as a share of the width, where there is one.
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

/// Actions of keys pressed in this frame, unless a text is being typed.
pub fn actions(context: &Context) -> Vec<Action> {
    if context.egui_wants_keyboard_input() {
        return Vec::new();
    }
    context.input(|input| {
        let pressed = KEYS.iter().filter(|(key, ..)| input.key_pressed(*key) && !input.modifiers.command);
        let digits = DIGITS.iter().enumerate().filter(|(_, key)| input.key_pressed(**key));
        let bookmark = |(n, _)| if input.modifiers.command { Action::Save(n) } else { Action::Recall(n) };
        pressed.map(|(.., action)| action.clone()).chain(digits.map(bookmark)).collect()
    })
}

/// Moves the eye, or the divider, whose new place is returned. `seconds` since the last frame.
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
            // A slow frame may hold the press and moves behind it.
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
        let step_m = SPEED * seconds * eye.camera.altitude_m * faster / slower;
        // Up and down the height changes by a factor, so that it never reaches the ground.
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
