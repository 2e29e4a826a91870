//! Shows the values of the pixel under the magnifier, and a drawing of its footprint in the texture.

use super::probe::{Face, ProbedEllipse, ProbedPixel, Texel};
use super::screen::{LENS, lens_at};
use super::stage::Stage;
use egui::{Align2, Color32, Grid, Pos2, Sense, Stroke, Ui, pos2, vec2};
use glam::DVec2;
use ortelius::picture::srgb;

/// Side of the footprint drawing, in points.
const SIDE: f32 = 96.0;

/// Shows the values and the drawing below the magnifier.
pub fn show(ui: &mut Ui, stage: &Stage, found: &ProbedPixel) {
    let points = ui.ctx().pixels_per_point();
    let at = found.at.map(|at| at as i32);
    let [left, top] = lens_at(at, stage.renderer.size());
    // The values start at the magnifier's edge near the pointer and extend away from the pointer.
    let (corner, side) = match left < at[0] {
        true => (Align2::RIGHT_TOP, left + LENS as i32),
        false => (Align2::LEFT_TOP, left),
    };
    let below = pos2(side as f32, (top + LENS as i32 + 4) as f32) / points;
    let area = egui::Area::new("pixel".into()).pivot(corner).fixed_pos(below).fade_in(false);
    area.interactable(false).show(ui.ctx(), |ui| {
        egui::Frame::popup(ui.style()).show(ui, |ui| {
            Grid::new("pixel").num_columns(2).min_row_height(0.0).show(ui, |ui| {
                for (name, value) in rows(stage, found) {
                    ui.label(name);
                    ui.monospace(value);
                    ui.end_row();
                }
            });
            if let Some((ellipse, texel, size)) = footprint(stage, found) {
                draw(ui, &ellipse, texel, size);
            }
        });
    });
}

type Row = (&'static str, String);

/// The inspector's values in one line: `name value; …`.
pub fn line(stage: &Stage, found: &ProbedPixel) -> String {
    let parts = rows(stage, found).into_iter().map(|(name, value)| format!("{name} {value}"));
    parts.collect::<Vec<_>>().join("; ")
}

fn rows(stage: &Stage, found: &ProbedPixel) -> Vec<Row> {
    let mut rows = colour(found);
    rows.extend(found.face.iter().flat_map(face));
    rows.extend(found.texel.iter().flat_map(place));
    rows.extend(footprint(stage, found).map(|(ellipse, texel, _)| axes(&ellipse, texel)));
    rows
}

/// The footprint ellipse, its position in the texture, and the texture's size in texels of level 0.
fn footprint<'f>(stage: &Stage, found: &'f ProbedPixel) -> Option<(ProbedEllipse, &'f Texel, [u32; 2])> {
    let size = stage.renderer.technique.texture.as_ref()?.source.pyramid().level_size(0);
    let texel = found.texel.as_ref()?;
    Some((texel.ellipse(size)?, texel, size))
}

fn colour(found: &ProbedPixel) -> Vec<Row> {
    let [r, g, b] = found.srgb;
    let [x, y] = found.at;
    let linear = found.srgb.map(|code| format!("{:.4}", srgb::to_linear_f64(code))).join(" ");
    let distance = match found.distance_m {
        Some(metres) if metres < 1e4 => format!("{metres:.3} m"),
        Some(metres) => format!("{:.3} km", metres / 1e3),
        None => "background".to_owned(),
    };
    vec![
        ("pixel", format!("{x}, {y}")),
        ("sRGB", format!("{r} {g} {b}")),
        ("linear", linear),
        ("view depth", distance),
    ]
}

fn face(face: &Face) -> [Row; 2] {
    let Face { instance, face, level, misses } = *face;
    let misses = match misses {
        Some(misses) => format!("{misses} vertices missed the cache"),
        None => "cache misses are counted while the camera rests".to_owned(),
    };
    [
        ("instance, face", format!("{instance}, {face}")),
        ("collapses below", format!("level {level}; {misses}")),
    ]
}

fn place(texel: &Texel) -> [Row; 3] {
    let ([level, row, column], [s, t]) = (texel.tile, texel.coordinates);
    [
        ("s, t", format!("{s:.7} {t:.7}")),
        ("tile wanted", format!("level {level}, row {row}, column {column}")),
        ("level shown", texel.shown_level.to_string()),
    ]
}

fn axes(ellipse: &ProbedEllipse, texel: &Texel) -> Row {
    let scale = (-f64::from(texel.tile[0])).exp2();
    let [major, minor] = ellipse.axes_texels.map(|axis| axis * scale);
    ("footprint", format!("{major:.2} x {minor:.2} texels, {:.1}:1", major / minor))
}

/// Draws the texel grid of the wanted level around the pixel, and the ellipse that the pixel's disc covers.
fn draw(ui: &mut Ui, ellipse: &ProbedEllipse, texel: &Texel, size: [u32; 2]) {
    let scale = (-f64::from(texel.tile[0])).exp2();
    let (rect, _) = ui.allocate_exact_size(vec2(SIDE, SIDE), Sense::hover());
    let painter = ui.painter_at(rect);
    // The drawing shows 4 to 32 texels. Longer ellipses are clipped.
    let across = (1.5 * ellipse.axes_texels[0] * scale).clamp(4.0, 32.0);
    let to_points = f64::from(SIDE) / across;
    let at = DVec2::from(texel.coordinates.map(f64::from)) * DVec2::from(size.map(f64::from)) * scale;
    let within = at - at.floor();
    let grid = Stroke::new(1.0, Color32::from_gray(80));
    for line in -17..=17 {
        let [x, y] = [within.x, within.y].map(|within| ((f64::from(line) - within) * to_points) as f32);
        painter.vline(rect.center().x + x, rect.y_range(), grid);
        painter.hline(rect.x_range(), rect.center().y + y, grid);
    }
    let on_rim = |step: u32| -> Pos2 {
        let (sin, cos) = (f64::from(step) / 48.0 * std::f64::consts::TAU).sin_cos();
        let texels = ellipse.jacobian * DVec2::new(cos, sin) * 0.5 * scale * to_points;
        rect.center() + vec2(texels.x as f32, texels.y as f32)
    };
    let rim: Vec<Pos2> = (0..=48).map(on_rim).collect();
    painter.add(egui::Shape::line(rim, Stroke::new(2.0, Color32::from_rgb(255, 184, 26))));
}
