//! Every setting of the scene, live, from the generated list of keys with their documentation.

use super::action::Action;
use egui::{ComboBox, DragValue, Response, TextEdit, Ui};
use ortelius::renderer::sections::LANGUAGES;
use ortelius::scene::{self, Key, KeyAt, Kind, Scene};
use std::collections::HashMap;

/// What is being typed, until it is taken.
pub struct Settings {
    keys: Vec<KeyAt>,
    numbers: HashMap<String, f64>,
    texts: HashMap<String, String>,
    /// Only keys that hold this are shown.
    filter: String,
}

/// A key of one scene.
struct Entry<'a> {
    /// `surface.land.filter.kind`
    dotted: String,
    key: &'a Key,
    value: Option<&'a toml::Value>,
}

impl Settings {
    pub fn new() -> Settings {
        let mut keys = scene::keys(LANGUAGES);
        // The eye has its own panel; the window has its own size.
        keys.retain(|at| !["cameras.", "paths.", "view."].iter().any(|own| at.dotted.starts_with(own)));
        Settings { keys, numbers: HashMap::new(), texts: HashMap::new(), filter: String::new() }
    }

    /// Shows them; what the user changed.
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

/// A declared key in a scene: once for each surface that has such a table.
fn entries<'a>(at: &'a KeyAt, scene: &'a Scene) -> Vec<Entry<'a>> {
    let entry = |dotted: String| {
        let path: Vec<&str> = dotted.split('.').collect();
        let value = scene.value(&path).or(at.key.default.as_ref());
        let table = &path[..path.len() - 1];
        // A texture that is shared is set where it is stated.
        let is_table =
            table[0] != "surface" || table.len() == 2 || scene.value(table).is_none_or(toml::Value::is_table);
        let of_kind = at.kind.is_none() || at.kind == scene.word(&[table, &["kind"]].concat());
        let is_leaf = !matches!(at.key.kind, Kind::Table | Kind::TableOrText);
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
            Kind::Choice(values) => values.iter().map(|(name, about)| format!("\n{name}: {about}")).collect(),
            _ => String::new(),
        };
        format!("{}{unit}{values}", self.key.about)
    }

    /// The widget of its kind; a change is pushed once it is made.
    fn widget(
        &self,
        ui: &mut Ui,
        numbers: &mut HashMap<String, f64>,
        texts: &mut HashMap<String, String>,
        changed: &mut Vec<Action>,
    ) -> Response {
        let mut set = |value: String| changed.push(Action::Set(self.dotted.clone(), value));
        match &self.key.kind {
            Kind::Choice(values) => {
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
            Kind::Truth => {
                let mut now = self.value.and_then(|value| value.as_bool()).unwrap_or(false);
                let response = ui.checkbox(&mut now, "");
                if response.changed() {
                    set(now.to_string());
                }
                response
            }
            Kind::Whole | Kind::Number if self.number().is_some() => {
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
            Kind::Whole => format!("{}", number.round()),
            _ => format!("{number:?}"),
        }
    }

    fn number_widget(&self, ui: &mut Ui, typed: &mut f64) -> Response {
        if typed.is_nan() {
            *typed = self.number().unwrap_or_default();
        }
        let bound = |n: usize| self.key.least_and_most.as_ref().and_then(|bounds| bounds[n].as_f64());
        let (least, most) = (bound(0).unwrap_or(f64::MIN), bound(1).unwrap_or(f64::MAX));
        let whole = matches!(self.key.kind, Kind::Whole);
        let speed = if whole { 1.0f64 } else { 0.01 }.max(typed.abs() * 0.005);
        let widget =
            DragValue::new(typed).range(least..=most).speed(speed).suffix(format!(" {}", self.key.unit));
        ui.add(if whole { widget.fixed_decimals(0) } else { widget })
    }
}
