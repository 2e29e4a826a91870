//! The effect of filters and borders on the picture: [`seams`] at tiles' edges, [`filter`] in the whole picture,
//! [`na`] at any tilt.

pub mod filter;
pub mod na;
pub mod seams;

use super::common::{SceneView, ViewSession};
use crate::figure::{Bench, Contender, Setting};
use crate::frame::{DrawList, Run, View};
use crate::paper::virtual_texture::VirtualTexture;
use crate::paper::virtual_texture::config::Filter;
use crate::paper::virtual_texture::texturing::Texturing;
use crate::paper::virtual_texture::{Config, Filtering};
use crate::picture::Picture;
use crate::picture::PixelFormat;
use crate::picture::write::Srgb8Picture;
use crate::vk::Frame;

/// A filter with its settings.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Variant {
    filter: Filtering,
    max_anisotropy: u32,
    taps: u32,
}

impl Variant {
    const fn new(filter: Filtering, max_anisotropy: u32, taps: u32) -> Variant {
        Variant { filter, max_anisotropy, taps }
    }

    fn name(&self) -> String {
        let along = match self.max_anisotropy {
            1 => String::new(),
            max => format!(" along NA {max}"),
        };
        match (self.filter, self.taps) {
            (Filtering::Bilinear, _) => format!("bilinear{along}"),
            (Filtering::Trilinear, _) if self.max_anisotropy > 1 => {
                format!("anisotropic {}", self.max_anisotropy)
            }
            (Filtering::Trilinear, _) => "trilinear".into(),
            (Filtering::Stochastic, 1) => format!("1 tap{along}"),
            (Filtering::Stochastic, taps) => format!("{taps} taps{along}"),
            (kind, _) => format!("{}{along}", kind.name()),
        }
    }

    /// As settings of a scene.
    fn setting(&self, border: u32) -> Setting {
        let (kind, max) = (self.filter.name(), self.max_anisotropy);
        let taps = if self.filter.is_random() { format!(", samples={}", self.taps) } else { String::new() };
        let filter = format!("surface.land.filter={{kind='{kind}', max_anisotropy={max}{taps}}}");
        Setting::new(self.name(), [filter, format!("surface.land.texture.border={border}")])
    }
}

/// A settled session; its tiles can be shown with any filter of the same `max_anisotropy`.
struct Shown {
    opened: ViewSession,
}

impl Shown {
    /// # Errors
    /// The device lacks a feature; tiles do not arrive; the visible set does not fit.
    fn settle(
        bench: &Bench,
        scene: &str,
        size: [u32; 2],
        border: u32,
        max_anisotropy: u32,
    ) -> anyhow::Result<Shown> {
        let mut place = SceneView::find(scene)?;
        place.scene = place.scene.with(&[
            format!("surface.land.texture.border={border}"),
            format!("surface.land.filter.max_anisotropy={max_anisotropy}"),
        ])?;
        Shown::of(bench, place, size)
    }

    /// # Errors
    /// As [`Shown::settle`].
    fn of(bench: &Bench, place: SceneView, size: [u32; 2]) -> anyhow::Result<Shown> {
        let name = place.scene.name.clone();
        let mut opened = place.open(bench, size, |settings| {
            settings.target = PixelFormat::Linear32;
            // Settling is not timed, so the budgets do not limit it.
            settings.streaming.upload_tiles_per_frame = 64;
            settings.streaming.upload_budget_ms = 1e3;
            settings.streaming.load_budget_ms = 1e3;
        })?;
        opened.settle()?;
        let bias = opened.session.technique.bias();
        anyhow::ensure!(
            bias == 0,
            "{name}: the visible tiles exceed cache.gpu_tiles, and the picture is {bias} levels too coarse"
        );
        Ok(Shown { opened })
    }

    fn texturing(&self, variant: &Variant) -> anyhow::Result<Texturing> {
        let Run { gpu, technique: VirtualTexture { source, resident, settings, .. }, .. } =
            &self.opened.session;
        let filter = Filter { kind: variant.filter, samples: variant.taps, ..settings.config.filter };
        let config = Config { filter, ..settings.config };
        assert_eq!(
            config.filter.max_anisotropy, variant.max_anisotropy,
            "the session's max_anisotropy, on which its tiles depend"
        );
        let format = self.opened.session.target().color.info().format;
        Ok(Texturing::new(gpu, &source.pyramid(), &config, self.opened.stage1(), resident, (format, None))?)
    }

    fn record(&self, frame: &mut Frame<'_>, texturing: &Texturing, seed: u32) -> crate::vk::Result<()> {
        let Run { technique: VirtualTexture { resident, shapes, .. }, .. } = &self.opened.session;
        let target = self.opened.session.target();
        let view = View { noise: seed.into(), ..View::new(&self.opened.pose, target.size()) };
        let seen = DrawList::new(shapes, view, 0);
        let stage1 = self.opened.stage1();
        frame.pass("texturing", |cmd| texturing.draw(cmd, stage1, resident, &seen, &target.color))
    }

    /// The settled picture in linear light.
    fn picture(&mut self, variant: &Variant) -> anyhow::Result<Picture> {
        let texturing = self.texturing(variant)?;
        let mut frame = self.opened.session.gpu.frame()?;
        self.record(&mut frame, &texturing, 0)?;
        frame.submit()?.wait()?;
        Ok(self.opened.session.linear_picture()?)
    }

    /// A contender that draws the settled picture; its noise differs from run to run.
    fn contender<'a>(&'a self, variant: &Variant) -> anyhow::Result<Contender<'a>> {
        let texturing = self.texturing(variant)?;
        let mut seed = 0;
        Ok(Contender::frame(&self.opened.session.gpu, variant.name(), move |frame| {
            self.record(frame, &texturing, seed)?;
            seed += 1;
            Ok(())
        }))
    }
}

/// The part of a picture around a pixel, enlarged `zoom` times.
fn detail(picture: &Picture, [x, y]: [u32; 2], zoom: u32) -> Srgb8Picture {
    let [width, height] = [96.min(picture.width), 64.min(picture.height)];
    let left = x.saturating_sub(width / 2).min(picture.width - width);
    let top = y.saturating_sub(height / 2).min(picture.height - height);
    let size = [width * zoom, height * zoom];
    let pixel = |n: u32| picture.at(left + n % size[0] / zoom, top + n / size[0] / zoom);
    Srgb8Picture::from(&Picture::new(size[0], size[1], (0..size[0] * size[1]).map(pixel).collect()))
}
