//! The resources of a pass, as the panel of passes shows them under the pointer.

use egui::{Grid, Ui};
use ortelius::vk::{PassResources, Used};

/// Name, bytes, content and access of each resource of the pass `label`. Equal resources share a row.
pub fn resources(ui: &mut Ui, passes: &[PassResources], label: &str) {
    Grid::new("resources").num_columns(4).show(ui, |ui| {
        for [name, bytes, content, access] in rows(passes, label) {
            ui.label(name);
            ui.monospace(bytes);
            ui.label(content);
            ui.label(access);
            ui.end_row();
        }
    });
}

fn rows(passes: &[PassResources], label: &str) -> Vec<[String; 4]> {
    let Some(pass) = passes.iter().find(|pass| pass.label == label) else { return Vec::new() };
    let mut counted: Vec<(&Used, usize)> = Vec::new();
    for used in &pass.resources {
        match counted.iter_mut().find(|(known, _)| *known == used) {
            Some((_, count)) => *count += 1,
            None => counted.push((used, 1)),
        }
    }
    let row = |(used, count): (&Used, usize)| {
        let name = if count > 1 { format!("{count} x {}", used.name) } else { used.name.clone() };
        [name, format!("{} B", used.bytes), used.content.clone(), used.access.about().to_owned()]
    };
    counted.into_iter().map(row).collect()
}
