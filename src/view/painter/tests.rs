//! The layer of the panels: partial redraws must equal whole ones, bit for bit.

use super::super::laid_out::stage;
use super::super::panels::Panels;
use super::super::path::Player;
use super::super::shown::PanelInput;
use super::super::stage::Stage;
use super::*;
use egui::{Align2, Color32, FontId, FullOutput, Pos2, RawInput, Rect, Vec2, pos2, vec2};
use ortelius::scene::camera::Camera;
use ortelius::vk::{Feature, GpuOptions, Watched};

/// Lays out the panels and draws them twice: first only the parts that differ from the last layout, then all of them.
struct Twice<'a> {
    gpu: &'a Watched,
    context: Context,
    painter: Painter,
    target: Image,
}

impl Twice<'_> {
    fn new(gpu: &Watched, size: [u32; 2]) -> Twice<'_> {
        let context = Context::default();
        context.all_styles_mut(|style| style.animation_time = 0.0);
        let target = gpu.image("target", ImageInfo::target(size, Format::Rgba8)).unwrap();
        Twice { context, painter: Painter::new(gpu, Format::Rgba8, true).unwrap(), target, gpu }
    }

    fn lay_out(&self, show: impl FnMut(&mut egui::Ui)) -> FullOutput {
        let size = Vec2::from(self.target.info().size.map(|pixels| pixels as f32));
        let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, size));
        self.context.run_ui(RawInput { screen_rect, ..RawInput::default() }, show)
    }

    /// Draws the panels over a picture of one colour. Returns the layer and the target.
    fn draw(&mut self) -> [Vec<u8>; 2] {
        let color = ColorTarget { image: &self.target, clear: Clear::Float([0.3, 0.5, 0.7, 1.0]) };
        let mut frame = self.gpu.frame().unwrap();
        frame.pass("picture", |cmd| cmd.render(self.target.info().size, &[color], None, |_| Ok(()))).unwrap();
        frame.pass("panels", |cmd| self.painter.draw(cmd, &self.target)).unwrap();
        frame.submit().unwrap().wait().unwrap();
        self.painter.drawn(&TexturesDelta::default());
        let layer = &self.painter.painting.as_ref().unwrap().layer;
        [layer, &self.target].map(|image| self.gpu.read_image(image).unwrap())
    }

    /// Returns the number of pixels that are drawn again because the layout differs from the last one.
    fn step(&mut self, name: &str, show: impl FnMut(&mut egui::Ui)) -> u64 {
        let (output, size) = (self.lay_out(show), self.target.info().size);
        let shown = (&output.textures_delta, output.shapes.clone());
        self.painter.prepare(&self.context, shown, size, 1.0).unwrap();
        let painting = self.painter.painting.as_ref().unwrap();
        let redrawn = painting.redrawn.iter().map(Rectangle::area).sum();
        let copied = painting.pieces.opaque.clone();
        let parts = self.draw();
        // The second time without copies, as in a window whose images do not take them.
        (self.painter.is_rebuilt, self.painter.copies) = (true, false);
        let shown = (&TexturesDelta::default(), output.shapes);
        self.painter.prepare(&self.context, shown, size, 1.0).unwrap();
        let whole = self.draw();
        self.painter.copies = true;
        for ((part, whole), image) in parts.iter().zip(&whole).zip(["layer", "window"]) {
            let differs = part.chunks(4).zip(whole.chunks(4)).position(|(part, whole)| part != whole);
            let at = differs.map(|n| [n % size[0] as usize, n / size[0] as usize]);
            assert!(at.is_none(), "{name}: the {image} differs at {at:?}");
        }
        // Every pixel that is copied instead of blended must be opaque.
        for rectangle in copied {
            for y in rectangle.at[1]..rectangle.end[1] {
                let [from, to] = [rectangle.at[0], rectangle.end[0]].map(|x| 4 * (y * size[0] + x) as usize);
                assert!(whole[0][from..to].chunks(4).all(|texel| texel[3] == 255), "{name}: row {y}");
                assert_eq!(whole[0][from..to], whole[1][from..to], "{name}: row {y}");
            }
        }
        redrawn
    }
}

fn show(panels: &mut Panels, ui: &mut egui::Ui, stage: &Stage, camera: &Camera) {
    let player = Player::new(&stage.scene);
    drop(panels.show(ui, &PanelInput::of(stage, camera, &player)));
}

#[test]
fn a_layout_drawn_where_it_differs_equals_one_drawn_whole() {
    let gpu = Watched::open(&GpuOptions { wishes: &Feature::ALL, ..GpuOptions::default() });
    let (mut stage, size) = (stage(&gpu), [500, 1000]);
    let start = *stage.scene.cameras.values().next().unwrap();
    let (mut twice, mut panels) = (Twice::new(&gpu, size), Panels::new(true));
    let whole = u64::from(size[0] * size[1]);
    for step in 0..14 {
        let camera = Camera { altitude_m: 3e5 * f64::from(1 + step), ..start };
        stage.renderer.frame(&camera.pose()).unwrap();
        stage.renderer.drain().unwrap();
        (panels.help, panels.profiler) = (step == 6, matches!(step, 7 | 8));
        panels.open = step != 10;
        match step {
            5 => panels.show_message("a message over the picture".to_owned(), false),
            9 => panels.hide_message(),
            _ => {}
        }
        let redrawn = twice.step(&format!("step {step}"), |ui| show(&mut panels, ui, &stage, &camera));
        let panel = &twice.painter.painting.as_ref().unwrap().pieces.opaque;
        assert_eq!(panel.iter().map(Rectangle::area).max(), panels.open.then_some(329 * 1000), "step {step}");
        // The first layouts measure sizes and upload glyphs.
        if matches!(step, 3 | 4 | 13) {
            assert!(0 < redrawn && redrawn < 329 * 1000 / 2, "step {step} draws {redrawn} pixels again");
        }
        assert!(redrawn == whole || step > 0);
    }
    let camera = Camera { altitude_m: 3e5 * 14.0, ..start };
    assert_eq!(twice.step("the same", |ui| show(&mut panels, ui, &stage, &camera)), 0);
}

#[test]
fn shapes_that_move_change_order_or_vanish_leave_nothing_behind() {
    let gpu = Watched::open(&GpuOptions { wishes: &Feature::ALL, ..GpuOptions::default() });
    let mut twice = Twice::new(&gpu, [200, 120]);
    let square = |at: f32, colour| (Rect::from_min_size(pos2(at, at), vec2(30.5, 20.25)), colour);
    let (a, b, c) = (square(10.0, 200), square(25.0, 100), square(140.0, 50));
    let layouts = [
        vec![a, b, c],
        vec![b, a, c],
        vec![a, b, square(64.5, 70), c],
        vec![a, c, c],
        vec![c, a],
        vec![],
        vec![b, b, a],
    ];
    for (n, layout) in layouts.iter().enumerate() {
        let redrawn = twice.step(&format!("layout {n}"), |ui| {
            for (rect, colour) in layout {
                let colour = Color32::from_rgba_unmultiplied(*colour, 90, 30, 140);
                ui.painter().rect_filled(*rect, 3.0, colour);
                ui.painter().circle_filled(rect.right_bottom(), 9.3, colour);
                let font = FontId::proportional(11.0);
                ui.painter().text(rect.center(), Align2::CENTER_CENTER, "Öy", font, Color32::WHITE);
            }
        });
        assert!(n < 2 || redrawn < 200 * 120 / 2, "layout {n} draws {redrawn} pixels again");
    }
}
