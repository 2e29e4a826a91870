//! The panels of streamed data: tiles, page table, caches, and levels of meshes.

use super::stage::Stage;
use egui::{Color32, Grid, Rect, Sense, Ui, Vec2, vec2};
use ortelius::math::pyramid::TileId;
use ortelius::paper::virtual_texture::VirtualTexture;
use ortelius::renderer::Record;

pub fn rows<const N: usize>(ui: &mut Ui, id: &str, rows: [(&str, String); N]) {
    Grid::new(id).num_columns(2).show(ui, |ui| {
        for (name, value) in rows {
            ui.label(name);
            ui.monospace(value);
            ui.end_row();
        }
    });
}

pub fn tiles(ui: &mut Ui, last: &Record, texture: &VirtualTexture) {
    let Some(record) = &last.texture else { return };
    let streaming = &record.streaming;
    let slots = texture.streaming.config().gpu_tiles;
    let resident = (0..slots).filter(|slot| texture.streaming.gpu_tile(*slot).is_some()).count();
    rows(
        ui,
        "tiles",
        [
            ("visible", record.visible.len().to_string()),
            ("wanted", streaming.wanted.to_string()),
            ("resident", format!("{resident} of {slots}")),
            ("queued", streaming.pending.to_string()),
            ("hits, misses", format!("{}, {}", streaming.hits, streaming.misses)),
            ("loads, uploads", format!("{}, {}", streaming.loads, streaming.uploads)),
            ("uploaded", format!("{:.2} MB", streaming.upload_bytes as f64 / 1e6)),
            (
                "evictions, device and host",
                format!("{}, {}", streaming.gpu_evictions, streaming.host_evictions),
            ),
            ("level bias", streaming.bias.to_string()),
            ("unreadable", streaming.failures.len().to_string()),
        ],
    );
    levels(ui, &record.visible);
}

/// The hue of a level, as in present.frag.
fn level_colour(level: u32) -> Color32 {
    let hue = (level as f32 * 0.618_034).fract();
    egui::ecolor::HsvaGamma { h: hue, s: 0.65, v: 0.9, a: 1.0 }.into()
}

/// The number of visible tiles of each level, finest level first.
fn levels(ui: &mut Ui, visible: &[TileId]) {
    let coarsest = visible.iter().map(|tile| tile.level).max().unwrap_or(0);
    ui.horizontal_wrapped(|ui| {
        for level in 0..=coarsest {
            let count = visible.iter().filter(|tile| tile.level == level).count();
            if count > 0 {
                ui.colored_label(level_colour(level), format!("level {level}: {count}"));
            }
        }
    });
}

/// The cells of the page table by level: how many show their own tile, or a coarser one.
pub fn page_table(ui: &mut Ui, texture: &VirtualTexture) {
    Grid::new("page table").num_columns(5).show(ui, |ui| {
        for name in ["cells that show", "own tile", "1 coarser", "2", "3 or more"] {
            ui.label(name);
        }
        ui.end_row();
        for (level, counts) in (0..).zip(texture.resident.cells_by_level()) {
            ui.colored_label(level_colour(level), format!("level {level}"));
            for count in counts {
                ui.monospace(count.to_string());
            }
            ui.end_row();
        }
    });
}

/// The slots of both caches in order, coloured by the level of their tiles; the darker, the longer unused.
pub fn caches(ui: &mut Ui, texture: &VirtualTexture) {
    let streaming = &texture.streaming;
    let config = streaming.config();
    let gpu = (0..config.gpu_tiles).map(|slot| (streaming.gpu_tile(slot), streaming.gpu_age(slot)));
    let host = (0..config.host_tiles).map(|slot| (streaming.host_tile(slot), streaming.host_age(slot)));
    cache(ui, "tile pool (device)", &gpu.collect::<Vec<_>>());
    cache(ui, "tile cache (host)", &host.collect::<Vec<_>>());
}

/// One cache: the tile of each slot, and the frames since its last use.
fn cache(ui: &mut Ui, name: &str, slots: &[(Option<TileId>, Option<u64>)]) {
    ui.label(name);
    let side = 7.0;
    let columns = ((ui.available_width() / side) as usize).max(1);
    let size = vec2(side * columns as f32, side * slots.len().div_ceil(columns) as f32);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    let cell = |n: usize| {
        let at = rect.min + vec2(side * (n % columns) as f32, side * (n / columns) as f32);
        Rect::from_min_size(at, Vec2::splat(side - 1.0))
    };
    for (n, (tile, age)) in slots.iter().enumerate() {
        // Half as bright after 15 frames, a third after 255.
        let bright = 4.0 / (4.0 + (1.0 + age.unwrap_or(0) as f32).log2());
        let colour =
            tile.map_or(Color32::from_gray(45), |tile| level_colour(tile.level).gamma_multiply(bright));
        ui.painter().rect_filled(cell(n), 0.0, colour);
    }
    let under = response.hover_pos().and_then(|at| (0..slots.len()).find(|n| cell(*n).contains(at)));
    if let Some(slot) = under {
        let (tile, age) = slots[slot];
        let Some(TileId { level, row, column, .. }) = tile else {
            response.on_hover_text(format!("slot {slot}: free"));
            return;
        };
        let used = match age {
            Some(0) => "used in this frame".to_owned(),
            Some(frames) => format!("last used {frames} frames ago"),
            None => "waits for its texels".to_owned(),
        };
        response.on_hover_text(format!("slot {slot}: level {level}, row {row}, column {column}; {used}"));
    }
}

pub fn meshes(ui: &mut Ui, last: &Record, stage: &Stage) {
    let Some(record) = &last.meshes else { return };
    let change = &record.change;
    rows(
        ui,
        "meshes",
        [
            ("instances seen", change.instances_seen.to_string()),
            ("faces", change.faces.to_string()),
            ("vertices", change.vertices.to_string()),
            ("splits, collapses", format!("{}, {}", change.splits, change.collapses)),
            ("written", format!("{:.1} kB", change.upload_bytes as f64 / 1e3)),
            ("host", format!("{:.3} ms", record.host.as_secs_f64() * 1e3)),
            ("governor's factor", format!("{:.3}", record.error_factor)),
        ],
    );
    for surface in stage.renderer.technique.meshes.iter().flat_map(|meshes| &meshes.surfaces) {
        let full = surface.program.last_level();
        let levels: Vec<u32> = surface.instances().map(|(_, level)| level).collect();
        let (min, max) = (levels.iter().min().unwrap_or(&0), levels.iter().max().unwrap_or(&0));
        ui.label(format!("{}: {} instances at levels {min} … {max} of {full}", surface.name, levels.len()));
    }
}
