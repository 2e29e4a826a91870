//! The panels beside the picture: times, streaming, draws, and all settings.

use super::action::{Action, KEYS, MOVES};
use super::compared;
use super::inspector;
use super::job;
use super::passes;
use super::settings::SettingsPanel;
use super::shown::PanelInput;
use super::stage::{HISTORY, Stage};
use super::streamed::{self, rows};
use egui::{
    Align2, CollapsingHeader, Color32, Grid, Label, Mesh, Pos2, Rect, RichText, ScrollArea, Sense, Slider,
    Stroke, Ui, Vec2, vec2,
};
use ortelius::frame::Technique;
use ortelius::renderer::Record;
use ortelius::scene::camera::GroundPoint;
use ortelius::vk::PassTime;
use std::time::{Duration, Instant};

/// The state of the panels. All other data come from the stage.
pub struct Panels {
    pub open: bool,
    pub help: bool,
    pub profiler: bool,
    settings: SettingsPanel,
    status: Option<Status>,
}

/// The last message of the status line.
struct Status {
    text: String,
    is_error: bool,
    since: Instant,
}

/// Time for which the status line shows a message, and for which it shows an error.
const MESSAGE: Duration = Duration::from_secs(4);
const ERROR: Duration = Duration::from_secs(20);

/// Initial width of the panels, in points.
const WIDTH: f32 = 330.0;

/// Space around the status line, and its least width, in points.
const MARGIN: f32 = 8.0;
const MIN_STATUS: f32 = 100.0;

impl Panels {
    pub fn new(open: bool) -> Panels {
        Panels { open, help: false, profiler: false, settings: SettingsPanel::new(), status: None }
    }

    /// True if a panel lists the passes.
    pub fn shows_passes(&self) -> bool {
        self.open || self.profiler
    }

    /// Shows a message in the status line for some seconds.
    pub fn show_message(&mut self, text: String, is_error: bool) {
        self.status = Some(Status { text, is_error, since: Instant::now() });
    }

    pub fn has_message(&self) -> bool {
        self.status.is_some()
    }

    /// Hides the message.
    pub fn hide_message(&mut self) {
        self.status = None;
    }

    /// Lays out all open panels; returns the requested actions.
    pub fn show(&mut self, ui: &mut Ui, shown: &PanelInput<'_>) -> Vec<Action> {
        let mut actions = Vec::new();
        if let Some((texture, about)) = &shown.judged {
            let all = Rect::from_min_max(Pos2::ZERO, egui::pos2(1.0, 1.0));
            ui.painter().image(texture.id(), ui.ctx().content_rect(), all, Color32::WHITE);
            let area = egui::Area::new("judged".into()).anchor(Align2::CENTER_TOP, vec2(0.0, 8.0));
            area.interactable(false).fade_in(false).show(ui.ctx(), |ui| {
                egui::Frame::popup(ui.style()).show(ui, |ui| ui.label(about));
            });
        }
        for ends in shown.outline.windows(2) {
            if let [Some(from), Some(to)] = *ends {
                ui.painter().line_segment([from, to], Stroke::new(2.0, Color32::YELLOW));
            }
        }
        labels(ui, shown);
        if self.open {
            let side = egui::Panel::right("panels").default_size(WIDTH).resizable(true);
            side.show(ui, |ui| {
                // Without this, the panel would be as wide as its content, which changes from frame to frame.
                let scrolled = ScrollArea::vertical().auto_shrink([false, true]);
                scrolled.show(ui, |ui| actions = self.sections(ui, shown));
            });
        }
        if self.help {
            help(ui);
        }
        let records = &shown.stage.renderer.records;
        if self.profiler && !records.is_empty() {
            let window =
                egui::Window::new("profiler").anchor(Align2::LEFT_TOP, vec2(8.0, 8.0)).collapsible(false);
            window.show(ui.ctx(), |ui| times(ui, shown));
        }
        if let Some(found) = shown.found {
            inspector::show(ui, shown.stage, found);
        }
        self.status_line(ui, shown);
        actions
    }

    fn sections(&mut self, ui: &mut Ui, shown: &PanelInput<'_>) -> Vec<Action> {
        let mut actions = Vec::new();
        let records = &shown.stage.renderer.records;
        if shown.stage.views.len() > 1 {
            section(ui, "views", true, |ui| compared::views(ui, shown, &mut actions));
        }
        section(ui, "variants", true, |ui| compared::variants(ui, shown, &mut actions));
        let trades = shown.trade.is_some() || shown.stage.renderer.technique.meshes.is_some();
        section(ui, "trade", trades, |ui| compared::trade(ui, shown, &mut actions));
        section(ui, "overlays", false, |ui| compared::overlays(ui, shown, &mut actions));
        if let Some(last) = records.last() {
            section(ui, "passes", true, |ui| times(ui, shown));
            if let Some(texture) = &shown.stage.renderer.technique.texture {
                section(ui, "tiles", true, |ui| streamed::tiles(ui, last, texture));
                section(ui, "page table", false, |ui| streamed::page_table(ui, texture));
                section(ui, "caches", false, |ui| streamed::caches(ui, texture));
            }
            if last.meshes.is_some() {
                section(ui, "progressive meshes", true, |ui| streamed::meshes(ui, last, shown.stage));
            }
        }
        section(ui, "eye", true, |ui| eye(ui, shown, &mut actions));
        section(ui, "memory", false, |ui| memory(ui, shown.stage));
        let changed = section(ui, "settings", false, |ui| self.settings.show(ui, &shown.stage.scene));
        actions.extend(changed.into_iter().flatten());
        actions
    }

    fn status_line(&mut self, ui: &mut Ui, shown: &PanelInput<'_>) {
        let mut line = None;
        if let Some(Status { text, is_error, since }) = &self.status {
            let left = if *is_error { ERROR } else { MESSAGE }.saturating_sub(since.elapsed());
            match left.is_zero() {
                true => self.status = None,
                false => {
                    ui.ctx().request_repaint_after(left);
                    line = Some((text.clone(), *is_error));
                }
            }
        }
        let recording = shown.film.map(|(done, all)| {
            ui.ctx().request_repaint_after(job::POLL_INTERVAL);
            (format!("recording: {done} of {all} frames"), false)
        });
        let line = line.or(recording);
        let Some((text, is_error)) = line else { return };
        let colour = if is_error { Color32::from_rgb(255, 140, 120) } else { Color32::WHITE };
        let width = (ui.available_width() - 2.0 * MARGIN).max(MIN_STATUS);
        let area = egui::Area::new("status".into()).anchor(Align2::LEFT_BOTTOM, vec2(MARGIN, -MARGIN));
        area.show(ui.ctx(), |ui| {
            // Without this call, egui would keep the width of the last message.
            ui.set_max_width(width);
            let label = Label::new(RichText::new(text).color(colour));
            // A message is cut to one line, so that it hides little of the picture. Errors are not cut.
            let label = if is_error { label } else { label.truncate() };
            egui::Frame::popup(ui.style()).show(ui, |ui| ui.add(label));
        });
    }
}

/// Shows a section that can be collapsed. A section out of view is replaced by empty space of its last height, because
/// contents take most of a layout's time. If a widget has the focus, all sections are laid out: a widget that is
/// skipped loses the focus.
fn section<R>(ui: &mut Ui, name: &str, is_open: bool, content: impl FnOnce(&mut Ui) -> R) -> Option<R> {
    let header = CollapsingHeader::new(name).default_open(is_open);
    let shown = header.show(ui, |ui| {
        let (id, at) = (ui.id().with("last height"), ui.cursor().min);
        let last: Option<f32> = ui.data(|data| data.get_temp(id));
        let has_focus = ui.memory(|memory| memory.focused().is_some());
        let is_hidden = |height: &f32| !ui.is_rect_visible(Rect::from_min_size(at, vec2(1.0, *height)));
        if let Some(height) = last.filter(|height| !has_focus && is_hidden(height)) {
            ui.allocate_space(vec2(0.0, height));
            return None;
        }
        let shown = ui.scope(content);
        ui.data_mut(|data| data.insert_temp(id, shown.response.rect.height()));
        Some(shown.inner)
    });
    shown.body_returned.flatten()
}

/// Level, row and column of each visible tile, white on black.
fn labels(ui: &Ui, shown: &PanelInput<'_>) {
    let points = ui.ctx().pixels_per_point();
    for label in super::labels::without_overlaps(shown.labels, points) {
        let [level, row, column] = label.tile;
        let (text, font) = (format!("{level}: {row} {column}"), egui::FontId::monospace(10.0));
        let at = Pos2::from(label.at) / points;
        for (offset, colour) in [(vec2(1.0, 1.0), Color32::BLACK), (Vec2::ZERO, Color32::WHITE)] {
            ui.painter().text(at + offset, Align2::CENTER_CENTER, &text, font.clone(), colour);
        }
    }
}

fn help(ui: &mut Ui) {
    egui::Window::new("keys").anchor(Align2::LEFT_TOP, vec2(8.0, 8.0)).collapsible(false).show(
        ui.ctx(),
        |ui| {
            Grid::new("keys").show(ui, |ui| {
                let keys = KEYS.iter().map(|(key, about, _)| (key.name(), *about));
                for (key, about) in keys.chain(MOVES) {
                    ui.monospace(key);
                    ui.label(about);
                    ui.end_row();
                }
            });
        },
    );
}

fn total_ms(passes: &[PassTime]) -> Option<f64> {
    Some(passes.iter().map(|pass| pass.ns).sum::<Option<u64>>()? as f64 / 1e6)
}

/// Frame times of recent frames as bars, and the passes of the last frame. Under the pointer: the surfaces that a
/// pass serves, and its resources.
fn times(ui: &mut Ui, shown: &PanelInput<'_>) {
    let records: &[Record] = &shown.stage.renderer.records;
    let Some(last) = records.last() else { return };
    let Some(total) = total_ms(&last.passes) else {
        ui.label("this device has no timestamps");
        return;
    };
    ui.label(format!("{total:.2} ms on the device"));
    let history: Vec<f64> = records.iter().filter_map(|record| total_ms(&record.passes)).collect();
    let max = history.iter().copied().fold(1e-3, f64::max);
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), 40.0), Sense::hover());
    let step = rect.width() / HISTORY as f32;
    // One shape of two triangles for each bar. A rectangle with smoothed edges has ten.
    let mut bars = Mesh::default();
    for (n, ms) in history.iter().enumerate() {
        let high = rect.height() * (ms / max) as f32;
        let left = rect.right() - step * (history.len() - n) as f32;
        let bar = Rect::from_min_size(egui::pos2(left, rect.bottom() - high), vec2(step.max(1.0), high));
        bars.add_colored_rect(bar, Color32::from_rgb(90, 150, 210));
    }
    ui.painter().add(bars);
    Grid::new("passes").num_columns(3).show(ui, |ui| {
        for pass in &last.passes {
            let ms = pass.ns.unwrap_or_default() as f64 / 1e6;
            ui.label(&pass.label).on_hover_ui(|ui| {
                ui.label(serves(shown.stage, &pass.label));
                passes::resources(ui, shown.resources, &pass.label);
            });
            ui.monospace(format!("{ms:8.3} ms"));
            let (rect, _) = ui.allocate_exact_size(vec2(90.0, 10.0), Sense::hover());
            let share = if total > 0.0 { (ms / total) as f32 } else { 0.0 };
            let bar = Rect::from_min_size(rect.min, vec2(rect.width() * share, rect.height()));
            ui.painter().rect_filled(bar, 0.0, Color32::from_rgb(220, 160, 60));
            ui.end_row();
        }
    });
}

/// The surfaces that a pass serves, and the device features that it needs.
fn serves(stage: &Stage, pass: &str) -> String {
    let technique = &stage.renderer.technique;
    let of_pass = technique.passes_by_surface().into_iter().find(|(name, _)| *name == pass);
    let surfaces = of_pass.map_or("all surfaces".to_owned(), |(_, surfaces)| surfaces.join(", "));
    let needs = technique.needs();
    let features = needs.iter().filter(|need| need.pass == pass).map(|need| need.feature.name());
    let features = features.collect::<Vec<_>>().join(", ");
    if features.is_empty() { surfaces } else { format!("{surfaces}; needs {features}") }
}

fn eye(ui: &mut Ui, shown: &PanelInput<'_>, actions: &mut Vec<Action>) {
    let camera = shown.camera;
    let place = match camera.place {
        GroundPoint::Planet { latitude_deg, longitude_deg } => {
            format!("{latitude_deg:.6}° {longitude_deg:.6}°")
        }
        GroundPoint::Plane { east_m, north_m } => format!("{east_m:.2} m east, {north_m:.2} m north"),
    };
    let (heading, tilt) = (camera.heading_deg, camera.tilt_deg);
    let looks = format!("{heading:.1}°, {tilt:.1}°");
    rows(
        ui,
        "eye",
        [("over", place), ("height", format!("{:.2} m", camera.altitude_m)), ("heading, tilt", looks)],
    );
    ui.horizontal_wrapped(|ui| {
        for (name, camera) in &shown.stage.scene.cameras {
            if ui.button(name).clicked() {
                actions.push(Action::FlyTo(*camera));
            }
        }
        if ui.button("copy as TOML").clicked() {
            actions.push(Action::CopyCamera);
        }
    });
    ui.horizontal_wrapped(|ui| {
        for name in shown.stage.scene.paths.keys() {
            if ui.selectable_label(shown.player.path() == Some(name), name).clicked() {
                actions.push(Action::ChoosePath(name.clone()));
            }
        }
    });
    if let Some((frame, frames)) = shown.player.place() {
        let mut at = frame;
        if ui.add(Slider::new(&mut at, 0.0..=frames).fixed_decimals(0).text("frame")).changed() {
            actions.push(Action::Seek(at));
        }
        ui.horizontal(|ui| {
            if ui.button(if shown.player.is_playing() { "pause" } else { "play" }).clicked() {
                actions.push(if shown.player.is_playing() { Action::Pause } else { Action::Play });
            }
            if ui.button("record").clicked() {
                actions.push(Action::Record);
            }
        });
    }
}

fn memory(ui: &mut Ui, stage: &Stage) {
    Grid::new("memory").num_columns(2).show(ui, |ui| {
        for (name, bytes) in stage.renderer.memory() {
            ui.label(name);
            ui.monospace(format!("{:.2} MB", bytes as f64 / 1e6));
            ui.end_row();
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Context, RawInput};

    /// Three sections, each 200 points high, in a window of 300 points that is scrolled by `offset` points. Returns
    /// which sections were laid out, and the height of all.
    fn laid_out(context: &Context, offset: f32) -> ([bool; 3], f32) {
        let (mut is_laid_out, mut height) = ([false; 3], 0.0);
        let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, vec2(200.0, 300.0)));
        let input = RawInput { screen_rect, ..RawInput::default() };
        let _drawn = context.run_ui(input, |ui| {
            let shown = ScrollArea::vertical().vertical_scroll_offset(offset).show(ui, |ui| {
                for (name, is_laid_out) in ["a", "b", "c"].into_iter().zip(&mut is_laid_out) {
                    let content = |ui: &mut Ui| ui.allocate_space(vec2(9.0, 200.0));
                    *is_laid_out = section(ui, name, true, content).is_some();
                }
            });
            height = shown.content_size.y;
        });
        (is_laid_out, height)
    }

    #[test]
    fn a_section_out_of_view_keeps_its_height_and_returns_when_scrolled_to() {
        let context = Context::default();
        context.all_styles_mut(|style| style.animation_time = 0.0);
        let (first, height) = laid_out(&context, 0.0);
        assert_eq!(first, [true; 3], "no height is known");
        assert_eq!(laid_out(&context, 0.0), ([true, true, false], height));
        assert_eq!(laid_out(&context, height - 300.0), ([false, true, true], height));
        assert_eq!(laid_out(&context, 0.0), ([true, true, false], height));
    }
}
