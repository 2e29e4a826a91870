//! Panel sections with a selection: one or two variants, a point of the Pareto front, an overlay.

use super::action::{Action, CompareMode};
use super::overlay::Overlay;
use super::shown::{Front, PanelInput};
use egui::{DragValue, Slider, Ui};

pub fn variants(ui: &mut Ui, shown: &PanelInput<'_>, actions: &mut Vec<Action>) {
    let stage = shown.stage;
    let second = stage.second.as_ref().map(|second| second.variant);
    for (n, variant) in stage.variants().iter().enumerate() {
        ui.horizontal(|ui| {
            let beside = ui.selectable_label(second == Some(n), "right");
            if beside.on_hover_text("show this variant on the right").clicked() {
                actions.push(Action::ShowBeside(n));
            }
            let name = ui.selectable_label(n == stage.variant(), &variant.name);
            if name.on_hover_text(variant.changes.join("\n")).clicked() {
                actions.push(Action::Show(n));
            }
        });
    }
    ui.horizontal(|ui| {
        if ui.selectable_label(second.is_some(), "side by side").clicked() {
            actions.push(Action::Compare);
        }
        let others = CompareMode::ALL.iter().filter(|_| second.is_some());
        for (comparison, name) in others {
            if ui.selectable_label(shown.comparison == *comparison, *name).clicked() {
                actions.push(Action::Comparison(*comparison));
            }
        }
    });
}

/// A slider along the Pareto front, and the governor's budgets.
pub fn trade(ui: &mut Ui, shown: &PanelInput<'_>, actions: &mut Vec<Action>) {
    match shown.trade {
        Some(Front { front, measure, at }) if !front.is_empty() => {
            let mut now = at.unwrap_or(0);
            ui.label(format!(
                "{} Pareto-optimal settings, from the smallest error to the shortest time",
                front.len()
            ));
            if ui.add(Slider::new(&mut now, 0..=front.len() - 1).show_value(false)).changed() {
                actions.push(Action::Trade(now));
            }
            let setting = &front[now];
            ui.label(&setting.name);
            ui.monospace(format!(
                "{measure} {:.3e}, {:.2} ms when measured",
                setting.error, setting.ms.median
            ));
        }
        _ => {
            ui.label("run `ortelius trade SCENE -o DIR`, then `ortelius view SCENE --trade DIR/trade.json`");
        }
    }
    if shown.stage.renderer.technique.meshes.is_some() {
        ui.separator();
        governor(ui, shown, ("frame_ms", " ms", 0.05), actions);
        governor(ui, shown, ("frame_faces", " faces", 500.0), actions);
    }
}

/// One budget of the governor, as a number to drag. Dragging by one point (egui's unit of length) changes the number by
/// `step` or by 1 %, whichever is more. 0 means no budget.
fn governor(
    ui: &mut Ui,
    shown: &PanelInput<'_>,
    (key, unit, step): (&str, &str, f64),
    actions: &mut Vec<Action>,
) {
    let value = shown.stage.scene.value(&["governor", key]);
    let now = value.and_then(|value| value.as_float().or(value.as_integer().map(|whole| whole as f64)));
    let now = now.unwrap_or(0.0);
    ui.horizontal(|ui| {
        ui.label(format!("governor's {key}"));
        let id = ui.id().with(key);
        let mut wanted = ui.data(|data| data.get_temp(id)).unwrap_or(now);
        let text = |n: f64| if n == 0.0 { "none".to_owned() } else { format!("{n:.2}{unit}") };
        let field = DragValue::new(&mut wanted).range(0.0..=1e9).speed(step.max(0.01 * now));
        let field = ui.add(field.custom_formatter(|n, _| text(n)));
        if field.dragged() || field.has_focus() {
            ui.data_mut(|data| data.insert_temp(id, wanted));
        } else {
            ui.data_mut(|data| data.remove::<f64>(id));
        }
        if (field.drag_stopped() || field.lost_focus()) && wanted != now {
            let key = format!("governor.{key}");
            actions.push(match wanted {
                0.0 => Action::Reset(key),
                _ if unit == " ms" => Action::Set(key, format!("{wanted:?}")),
                _ => Action::Set(key, format!("{:.0}", wanted.ceil())),
            });
        }
    });
}

pub fn overlays(ui: &mut Ui, shown: &PanelInput<'_>, actions: &mut Vec<Action>) {
    for overlay in Overlay::ALL.into_iter().filter(|overlay| overlay.applies(shown.stage)) {
        let ([name, about], chosen) = (overlay.about(), shown.overlay == Some(overlay));
        if ui.selectable_label(chosen, name).on_hover_text(about).clicked() {
            actions.push(Action::Overlay((!chosen).then_some(overlay)));
        }
    }
}

/// The list of views; the shown one is marked.
pub fn views(ui: &mut Ui, shown: &PanelInput<'_>, actions: &mut Vec<Action>) {
    let [now, _] = shown.stage.view();
    for (n, view) in shown.stage.views.iter().enumerate() {
        if ui.selectable_label(n == now, &view.name).on_hover_text(&view.scene.name).clicked() {
            actions.push(Action::View(n));
        }
    }
}
