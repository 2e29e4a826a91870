//! The panel with all settings of the scene, built from the generated list of keys and their documentation.

use super::action::Action;
use egui::{ComboBox, DragValue, Response, TextEdit, Ui};
use ortelius::renderer::sections::LANGUAGES;
use ortelius::scene::{self, KeyAt, KeyDeclaration, Scene, ValueKind};
use std::collections::HashMap;

/// The declared keys, and the unfinished input of each field.
pub struct SettingsPanel {
    keys: Vec<KeyAt>,
    numbers: HashMap<String, f64>,
    texts: HashMap<String, String>,
    /// Only keys that contain this text are shown.
    filter: String,
}

/// A key of the scene.
struct Entry<'a> {
    /// For example `surface.land.filter.kind`.
    dotted: String,
    key: &'a KeyDeclaration,
    value: Option<&'a toml::Value>,
}

impl SettingsPanel {
    pub fn new() -> SettingsPanel {
        let mut keys = scene::keys(LANGUAGES);
        // The camera has a panel of its own, and the window determines the size.
        keys.retain(|at| !["cameras.", "paths.", "view."].iter().any(|own| at.dotted.starts_with(own)));
        SettingsPanel { keys, numbers: HashMap::new(), texts: HashMap::new(), filter: String::new() }
    }

    /// Shows the settings. Returns the user's changes.
    pub fn show(&mut self, ui: &mut Ui, scene: &Scene) -> Vec<Action> {
        ui.add(TextEdit::singleline(&mut self.filter).hint_text("filter"));
        let entries: Vec<Entry<'_>> = self
            .keys
            .iter()
            .flat_map(|at| entries(at, scene))
            .filter(|one| one.dotted.contains(&self.filter))
            .collect();
        let (numbers, texts) = (&mut self.numbers, &mut self.texts);
        let mut changed = Vec::new();
        let mut section = "";
        for entry in &entries {
            let (table, name) = entry.dotted.rsplit_once('.').unwrap_or_default();
            if table != section {
                ui.separator();
                ui.strong(table);
                section = table;
            }
            ui.horizontal(|ui| {
                let shown = ui.label(name).union(entry.widget(ui, numbers, texts, &mut changed));
                shown.on_hover_text(entry.about());
            });
        }
        changed
    }
}

/// The entries of a declared key: for a key of surfaces, one for each surface whose kind has the key.
fn entries<'a>(at: &'a KeyAt, scene: &'a Scene) -> Vec<Entry<'a>> {
    let entry = |dotted: String| {
        let path: Vec<&str> = dotted.split('.').collect();
        let value = scene.value(&path).or(at.key.default.as_ref());
        let table = &path[..path.len() - 1];
        // A texture that several surfaces share is edited at the surface that declares it.
        let is_table =
            table[0] != "surface" || table.len() == 2 || scene.value(table).is_none_or(toml::Value::is_table);
        let of_kind = at.kind.is_none() || at.kind == scene.word(&[table, &["kind"]].concat());
        let is_leaf = !matches!(at.key.kind, ValueKind::Table | ValueKind::TableOrText);
        (is_table && of_kind && is_leaf).then(|| Entry { dotted: dotted.clone(), key: &at.key, value })
    };
    match at.dotted.contains(".NAME.") {
        true => scene.surfaces.keys().filter_map(|name| entry(at.dotted.replace("NAME", name))).collect(),
        false => entry(at.dotted.clone()).into_iter().collect(),
    }
}

impl Entry<'_> {
    fn about(&self) -> String {
        let unit = if self.key.unit.is_empty() { String::new() } else { format!(" [{}]", self.key.unit) };
        let values = match &self.key.kind {
            ValueKind::Choice(values) => {
                values.iter().map(|(name, about)| format!("\n{name}: {about}")).collect()
            }
            _ => String::new(),
        };
        format!("{}{unit}{values}", self.key.about)
    }

    /// Shows the widget for the key's type. A completed edit is added to `changed`.
    fn widget(
        &self,
        ui: &mut Ui,
        numbers: &mut HashMap<String, f64>,
        texts: &mut HashMap<String, String>,
        changed: &mut Vec<Action>,
    ) -> Response {
        let mut set = |value: String| changed.push(Action::Set(self.dotted.clone(), value));
        match &self.key.kind {
            ValueKind::Choice(values) => {
                let now = self.value.and_then(|value| value.as_str()).unwrap_or("auto");
                let shown = ComboBox::from_id_salt(&self.dotted).selected_text(now).show_ui(ui, |ui| {
                    for (name, about) in values {
                        if ui.selectable_label(*name == now, *name).on_hover_text(*about).clicked() {
                            set((*name).to_owned());
                        }
                    }
                });
                shown.response
            }
            ValueKind::Truth => {
                let mut now = self.value.and_then(|value| value.as_bool()).unwrap_or(false);
                let response = ui.checkbox(&mut now, "");
                if response.changed() {
                    set(now.to_string());
                }
                response
            }
            ValueKind::Whole | ValueKind::Number if self.number().is_some() => {
                let typed = numbers.entry(self.dotted.clone()).or_insert(f64::NAN);
                let response = self.number_widget(ui, typed);
                if response.drag_stopped() || response.lost_focus() {
                    if Some(*typed) != self.number() {
                        set(self.number_text(*typed));
                    }
                } else if !response.dragged() && !response.has_focus() {
                    *typed = self.number().unwrap_or_default();
                }
                response
            }
            _ => {
                let now = self.value.map_or_else(|| "auto".to_owned(), |value| value.to_string());
                let typed = texts.entry(self.dotted.clone()).or_insert_with(|| now.clone());
                let response = ui.add(TextEdit::singleline(typed).desired_width(140.0));
                if response.lost_focus() && *typed != now {
                    set(typed.clone());
                } else if !response.has_focus() {
                    *typed = now;
                }
                response
            }
        }
    }

    fn number(&self) -> Option<f64> {
        let value = self.value?;
        value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64))
    }

    fn number_text(&self, number: f64) -> String {
        match self.key.kind {
            ValueKind::Whole => format!("{}", number.round()),
            _ => format!("{number:?}"),
        }
    }

    fn number_widget(&self, ui: &mut Ui, typed: &mut f64) -> Response {
        if typed.is_nan() {
            *typed = self.number().unwrap_or_default();
        }
        let bound = |n: usize| self.key.min_and_max.as_ref().and_then(|bounds| bounds[n].as_f64());
        let (min, max) = (bound(0).unwrap_or(f64::MIN), bound(1).unwrap_or(f64::MAX));
        let whole = matches!(self.key.kind, ValueKind::Whole);
        let speed = if whole { 1.0f64 } else { 0.01 }.max(typed.abs() * 0.005);
        let widget =
            DragValue::new(typed).range(min..=max).speed(speed).suffix(format!(" {}", self.key.unit));
        ui.add(if whole { widget.fixed_decimals(0) } else { widget })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Context, Event, Modifiers, PointerButton, Pos2, RawInput, Rect, Vec2};

    /// Lays out the settings in a tall window and applies these events.
    fn shown(
        settings: &mut SettingsPanel,
        context: &Context,
        scene: &Scene,
        events: Vec<Event>,
    ) -> Vec<Action> {
        let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, Vec2::new(400.0, 4000.0)));
        let mut actions = Vec::new();
        let input = RawInput { screen_rect, events, ..RawInput::default() };
        let _drawn = context.run_ui(input, |ui| actions = settings.show(ui, scene));
        actions
    }

    #[test]
    fn a_surfaces_keys_are_those_of_its_kinds() {
        let scene = Scene::embedded("valley").unwrap();
        let settings = SettingsPanel::new();
        let names: Vec<String> =
            settings.keys.iter().flat_map(|at| entries(at, &scene)).map(|entry| entry.dotted).collect();
        for key in
            ["surface.land.filter.kind", "surface.herd.geometry.order", "variant.dedup", "cache.gpu_tiles"]
        {
            assert!(names.iter().any(|name| name == key), "{key} in {names:#?}");
        }
        // Not listed: a key of planes, a key of the view, and a table.
        for key in ["surface.land.geometry.width_m", "view.width", "surface.land.texture"] {
            assert!(!names.iter().any(|name| name == key), "{key}");
        }
    }

    #[test]
    fn a_click_on_a_checkbox_sets_its_key() {
        let scene = Scene::embedded("herd").unwrap();
        let (context, mut settings) = (Context::default(), SettingsPanel::new());
        settings.filter = "geomorph".to_owned();
        assert_eq!(shown(&mut settings, &context, &scene, Vec::new()), []);
        let mut found = Vec::new();
        // The position of the checkbox is unknown, so the points of a grid are clicked in turn.
        for (x, y) in (0..40).flat_map(|row| (5..30).map(move |column| (10 * column, 5 * row))) {
            let pos = Pos2::new(x as f32, y as f32);
            let button = |pressed| {
                let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
                Event::PointerButton { pos, button, pressed, modifiers }
            };
            shown(&mut settings, &context, &scene, vec![Event::PointerMoved(pos), button(true)]);
            found.extend(shown(&mut settings, &context, &scene, vec![button(false)]));
            if !found.is_empty() {
                break;
            }
        }
        let now = scene.value(&["surface", "herd", "geometry", "geomorph"]).and_then(toml::Value::as_bool);
        let turned = (!now.unwrap_or(false)).to_string();
        assert_eq!(found, [Action::Set("surface.herd.geometry.geomorph".to_owned(), turned)]);
    }
}
