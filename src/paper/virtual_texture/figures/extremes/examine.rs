//! One extreme: stage 1 against the f64 reference, every variant's list against the integer reference, and the
//! settled picture against the ruler.

use super::super::stage1::{Stage1Check, compare_triples};
use super::contenders::{Contender, Way, contenders, is_superset, refused};
use super::scenes::{Expected, Extreme, Landscape, Sight};
use crate::frame::{Seen, Shape, Slot, View};
use crate::math::pyramid::{Pyramid, TileId};
use crate::paper::virtual_texture::footprint::Footprint;
use crate::paper::virtual_texture::fused::Fused;
use crate::paper::virtual_texture::lister::{Lister, Stage3};
use crate::paper::virtual_texture::resident::{Resident, ResidentError};
use crate::paper::virtual_texture::ruler::Verdicts;
use crate::paper::virtual_texture::streaming::distinct_tiles;
use crate::paper::virtual_texture::{Config, Keying, PAPER, reference};
use crate::paper::virtual_texture::{Settings, VirtualTexture, VirtualTextureError, read_u1};
use crate::picture::Target;
use crate::picture::write::Srgb8Picture;
use crate::reference::View as ReferenceView;
use crate::scene::Scene;
use crate::texture::source::ruler::Ruler;
use crate::vk::{self, Format, Gpu, Image, ImageInfo};
use std::collections::BTreeSet;
use std::sync::Arc;

/// The most tiles that a settled picture is made for: with borders and the next coarser level 170 MB.
const MOST_SETTLED: usize = 128;

/// What happened at one extreme.
pub struct Examination {
    pub stage1: Stage1Check,
    /// Of the reference, from the device's own `U1`.
    pub tiles: usize,
    /// In order of [`super::contenders::variants`].
    pub variants: Vec<(String, Outcome)>,
    /// The settled picture; `None` where so many tiles are not resident at once.
    pub settled: Option<Settled>,
    /// Levels as colours, tiles as a chequerboard.
    pub picture: Srgb8Picture,
}

/// What a variant of stages 2 and 3 made of it.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// Tiles of the reference that the list lacks, tiles that it has beyond them, the list's length, and how long it
    /// is in the reference: with the paper's keying a tile stands there for each of its cells.
    Listed { lost: usize, extra: usize, entries: usize, right_entries: usize },
    /// A list that may have tiles beyond the reference's: how many it lacks and has beyond, and how many entries repeat
    /// another one.
    Superset { lost: usize, beyond: usize, repeated: usize },
    /// The device cannot, in one line that says what and why.
    Refused(String),
}

/// A settled picture of a ruler texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settled {
    /// Levels that the caches were too small for.
    pub bias: u32,
    /// `None` where coordinates are no numbers, so that no texel is the right one.
    pub verdicts: Option<Verdicts>,
    /// Pixels of the picture in linear light that hold no number.
    pub not_finite: usize,
}

/// Stage 1 as all variants get it.
struct Drawn {
    pyramid: Pyramid,
    shape: Shape,
    view: View,
    stage1: Footprint,
    triples: Vec<[u32; 3]>,
    /// Sorted.
    visible: Vec<TileId>,
    distinct_triples: usize,
}

/// Opens what several extremes can share: pipelines are made once for all of one pyramid.
pub struct Examiner {
    gpu: Gpu,
    /// Whether settled pictures are made, too.
    pictures: bool,
    contenders: Option<(Pyramid, Vec<Contender>)>,
}

impl Examiner {
    pub fn new(gpu: Gpu) -> Examiner {
        Examiner { gpu, pictures: true, contenders: None }
    }

    /// One that never textures: of stages 1 to 3 alone.
    pub fn of_lists(gpu: Gpu) -> Examiner {
        Examiner { pictures: false, ..Examiner::new(gpu) }
    }

    /// Runs everything on one extreme, at `size` pixels.
    ///
    /// # Errors
    /// Device lost and the like. What the device cannot do is an [`Outcome::Refused`].
    pub fn examine(&mut self, extreme: &Extreme, size: [u32; 2]) -> anyhow::Result<Examination> {
        let sight = extreme.sight(size)?;
        let gpu = self.gpu.clone();
        let drawn = draw(&gpu, &sight)?;
        let ready = match self.contenders.take() {
            Some((pyramid, ready)) if pyramid == sight.pyramid => ready,
            _ => contenders(&gpu, &sight.pyramid, &drawn.stage1)?,
        };
        let (_, contenders) = self.contenders.insert((sight.pyramid, ready));
        let fused = contenders.iter().any(|contender| matches!(contender.way, Ok(Way::Fused)));
        let textured = fused.then(|| Textured::new(&gpu, &sight)).transpose()?;
        let variants = contenders
            .iter_mut()
            .map(|contender| {
                Ok((contender.name.clone(), outcome(&gpu, &drawn, textured.as_ref(), contender)?))
            })
            .collect::<vk::Result<Vec<_>>>()?;
        // The settled picture is the paper's variant's.
        let papers = contenders.iter().position(|contender| contender.config == PAPER);
        let shown = papers.is_some_and(|at| matches!(variants[at].1, Outcome::Listed { .. }));
        let settles = self.pictures && shown && drawn.visible.len() <= MOST_SETTLED;
        Ok(Examination {
            stage1: stage1(extreme, &sight, &drawn),
            tiles: drawn.visible.len(),
            variants,
            settled: settles.then(|| settled(&gpu, extreme, &sight)).transpose()?,
            picture: false_colours(&drawn.triples, size),
        })
    }
}

fn draw(gpu: &Gpu, sight: &Sight) -> vk::Result<Drawn> {
    let pyramid = sight.pyramid;
    let stage1 = Footprint::new(gpu, &pyramid, &PAPER, sight.size)?;
    // Fused draws want the positions, too.
    let shape = Shape::with_depth_alone(gpu, &sight.mesh)?;
    let mut frame = gpu.frame()?;
    let view = View::new(&sight.pose, sight.size);
    frame.pass("footprint", |cmd| stage1.draw(cmd, &Seen::new([&shape], view, 0)))?;
    frame.submit()?.wait()?;
    let triples = read_u1(gpu, &stage1, &pyramid)?;
    let visible = reference::visible_tiles(&triples, &pyramid).into_iter().collect();
    let distinct_triples = reference::distinct_triples(&triples, &pyramid).len();
    Ok(Drawn { pyramid, shape, view, stage1, triples, visible, distinct_triples })
}

fn stage1(extreme: &Extreme, sight: &Sight, drawn: &Drawn) -> Stage1Check {
    if let Landscape::Noise = extreme.landscape {
        // No triple is near the border of a decision: none may differ.
        let wrong = drawn.triples.iter().enumerate().filter_map(|(pixel, &found)| {
            let right = Extreme::noise_triple(&sight.pyramid, pixel as u64);
            (found != right).then(|| format!("pixel {pixel}: {found:?}, not {right:?}"))
        });
        let unexplained: Vec<String> = wrong.collect();
        return Stage1Check { pixels: drawn.triples.len(), differing: unexplained.len(), unexplained };
    }
    let [width, height] = sight.size;
    let clip = sight.pose.world_to_clip(width, height);
    let view = ReferenceView::new(&sight.source, &clip, sight.pose.eye, sight.size);
    compare_triples(&drawn.triples, &view, &sight.source, &sight.pyramid)
}

/// What fused draws texture with: tiles of `G1` alone, for whatever is resident, the list is the same.
struct Textured {
    resident: Resident,
    target: Image,
}

impl Textured {
    fn new(gpu: &Gpu, sight: &Sight) -> Result<Textured, ResidentError> {
        let resident = Resident::new(gpu, &Ruler::new(sight.pyramid), 1)?;
        let target = gpu.image("picture", ImageInfo::target(sight.size, Format::Rgba8Srgb))?;
        Ok(Textured { resident, target })
    }
}

/// A variant's list, or the line that says why there is none.
fn outcome(
    gpu: &Gpu,
    drawn: &Drawn,
    textured: Option<&Textured>,
    contender: &mut Contender,
) -> vk::Result<Outcome> {
    let list = match &mut contender.way {
        Ok(Way::OverU1(lister)) => list(gpu, drawn, lister),
        Ok(Way::Fused) => {
            let textured = textured.expect("made where a variant draws for itself");
            fused_list(gpu, drawn, textured, &contender.config)
        }
        Err(line) => return Ok(Outcome::Refused(line.clone())),
    };
    match list {
        Ok(triples) => Ok(compared(drawn, &triples, &contender.config)),
        Err(error) => Ok(Outcome::Refused(refused(error)?)),
    }
}

fn compared(drawn: &Drawn, triples: &[[u32; 3]], config: &Config) -> Outcome {
    let found = distinct_tiles(triples, config.keying, drawn.pyramid.first_resident_level());
    let without = |tiles: &[TileId], others: &[TileId]| {
        tiles.iter().filter(|tile| others.binary_search(tile).is_err()).count()
    };
    let (lost, extra) = (without(&drawn.visible, &found), without(&found, &drawn.visible));
    if is_superset(config) {
        let distinct: BTreeSet<_> = triples.iter().collect();
        return Outcome::Superset { lost, beyond: extra, repeated: triples.len() - distinct.len() };
    }
    let right_entries = match config.keying {
        Keying::Paper => drawn.distinct_triples,
        Keying::Native => drawn.visible.len(),
    };
    Outcome::Listed { lost, extra, entries: triples.len(), right_entries }
}

/// The list of a variant from the `U1` that was drawn.
fn list(gpu: &Gpu, drawn: &Drawn, lister: &mut Lister) -> vk::Result<Vec<[u32; 3]>> {
    lister.renew(gpu, &drawn.stage1)?;
    let mut frame = gpu.frame()?;
    lister.record(&mut frame, &drawn.stage1.u1, Slot::FIRST)?;
    frame.submit()?.wait()?;
    Ok(lister.collect(gpu, Slot::FIRST)?.0)
}

/// The list of a variant that draws for itself.
fn fused_list(gpu: &Gpu, drawn: &Drawn, textured: &Textured, config: &Config) -> vk::Result<Vec<[u32; 3]>> {
    let Textured { resident, target } = textured;
    let fused = Fused::new(gpu, &drawn.pyramid, config, resident, (target.info().format, None))?;
    let mut stage3 = Stage3::new(gpu, &drawn.pyramid, config)?;
    let seen = Seen::new([&drawn.shape], drawn.view, 0);
    let (room, images) = (stage3.room(Slot::FIRST), (target, &*drawn.stage1.depth));
    let mut frame = gpu.frame()?;
    frame.pass("fused", |cmd| fused.draw(cmd, resident, &seen, room, images))?;
    stage3.record(&mut frame, Slot::FIRST)?;
    frame.submit()?.wait()?;
    Ok(stage3.collect(gpu, Slot::FIRST)?.0)
}

/// The whole frame on a ruler texture, until nothing is missing.
fn settled(gpu: &Gpu, extreme: &Extreme, sight: &Sight) -> Result<Settled, VirtualTextureError> {
    let scene = Scene::embedded("ruler").expect("shipped");
    let mut settings = Settings::of_scene(&scene, Target::Linear32).expect("shipped");
    settings.size = sight.size;
    settings.streaming.gpu_tiles = MOST_SETTLED as u32;
    let source = Arc::new(Ruler::new(sight.pyramid));
    let mut session = VirtualTexture::run(gpu.clone(), source, &sight.mesh, settings)?;
    session.settle(&sight.pose)?;
    let judged = extreme.expected != Expected::NoTexels;
    let floats = session.picture_bytes()?;
    let finite =
        |pixel: &[u8]| pixel.chunks_exact(4).all(|c| bytemuck::pod_read_unaligned::<f32>(c).is_finite());
    Ok(Settled {
        bias: session.technique.bias(),
        verdicts: judged.then(|| session.ruler_verdicts()).transpose()?,
        not_finite: floats.chunks_exact(16).filter(|pixel| !finite(pixel)).count(),
    })
}

/// A hue for each level, from red (0) on; neighbouring tiles lighter and darker; black without landscape.
fn false_colours(triples: &[[u32; 3]], [width, height]: [u32; 2]) -> Srgb8Picture {
    const HUES: [[u32; 3]; 8] = [
        [214, 66, 54],
        [233, 141, 44],
        [226, 204, 66],
        [116, 178, 72],
        [52, 160, 152],
        [62, 116, 196],
        [120, 82, 180],
        [186, 84, 150],
    ];
    let colour = |&[q, i, j]: &[u32; 3]| {
        if q == u32::MAX {
            return [0, 0, 0, 255];
        }
        let even = ((i >> q.min(31)) + (j >> q.min(31))).is_multiple_of(2);
        let light = if even { 100 } else { 72 };
        let [r, g, b] = HUES[q as usize % HUES.len()].map(|c| (c * light / 100) as u8);
        [r, g, b, 255]
    };
    Srgb8Picture { width, height, rgba: triples.iter().flat_map(colour).collect() }
}

impl Settled {
    /// Pixels that show a wrong texel, or none where there should be one.
    pub fn wrong(&self) -> u64 {
        self.verdicts.map_or(0, |verdicts| verdicts.wrong + verdicts.not_resident)
    }
}

impl Examination {
    /// What is wrong: a tile lost or invented, a pixel unexplained, a texel that is not the right one, or that what
    /// was known before did not come true.
    pub fn fault(&self, extreme: &Extreme) -> Option<String> {
        let unexplained = &self.stage1.unexplained;
        if let Some(first) = unexplained.first() {
            return Some(format!("stage 1: {} pixels unexplained, as {first}", unexplained.len()));
        }
        for (name, outcome) in &self.variants {
            match outcome {
                Outcome::Refused(_) => {}
                &Outcome::Listed { lost: 0, extra: 0, entries, right_entries }
                    if entries == right_entries => {}
                Outcome::Superset { lost: 0, repeated: 0, .. } => {}
                other => return Some(format!("{name}: {other:?}")),
            }
        }
        if let Some(settled) = self.settled.filter(|settled| settled.wrong() + settled.not_finite as u64 > 0)
        {
            return Some(format!("{settled:?}"));
        }
        let refused = || self.variants.iter().any(|(_, outcome)| matches!(outcome, Outcome::Refused(_)));
        match extreme.expected {
            Expected::Tiles(tiles) if tiles != self.tiles => {
                Some(format!("{} tiles, not {tiles}", self.tiles))
            }
            Expected::TileEachPixel if self.tiles != self.stage1.pixels => {
                Some(format!("{} tiles in {} pixels", self.tiles, self.stage1.pixels))
            }
            Expected::Refused if !refused() => Some("no variant refused it".into()),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn examination(outcome: Outcome) -> Examination {
        Examination {
            stage1: Stage1Check { pixels: 4, ..Stage1Check::default() },
            tiles: 3,
            variants: vec![("variant".into(), outcome)],
            settled: Some(Settled { bias: 0, verdicts: None, not_finite: 0 }),
            picture: false_colours(&[[0, 0, 0]], [1, 1]),
        }
    }

    fn of(name: &str, examination: &Examination) -> Option<String> {
        examination.fault(Extreme::find(name).unwrap())
    }

    #[test]
    fn whatever_is_wrong_is_a_fault_and_nothing_else_is() {
        let listed = |lost, extra, entries| Outcome::Listed { lost, extra, entries, right_entries: 9 };
        assert_eq!(of("pole", &examination(listed(0, 0, 9))), None);
        let superset = |lost, beyond, repeated| Outcome::Superset { lost, beyond, repeated };
        assert_eq!(of("pole", &examination(superset(0, 3, 0))), None);
        for wrong in
            [listed(1, 0, 9), listed(0, 1, 9), listed(0, 0, 10), superset(1, 3, 0), superset(0, 3, 1)]
        {
            assert!(of("pole", &examination(wrong.clone())).is_some(), "{wrong:?}");
        }
        let mut unexplained = examination(listed(0, 0, 9));
        unexplained.stage1.unexplained.push("a pixel".into());
        assert!(of("pole", &unexplained).is_some());
        let mut wrong = examination(listed(0, 0, 9));
        wrong.settled = Some(Settled { bias: 0, verdicts: None, not_finite: 1 });
        assert!(of("pole", &wrong).is_some());
        let verdicts = Some(Verdicts { covered: 4, wrong: 1, ..Verdicts::default() });
        wrong.settled = Some(Settled { bias: 0, verdicts, not_finite: 0 });
        assert!(of("pole", &wrong).is_some());
        // 3 tiles in 4 pixels.
        assert!(of("one-tile", &examination(listed(0, 0, 9))).is_some());
        assert!(of("noise", &examination(listed(0, 0, 9))).is_some());
        assert!(of("2^20-finest-tiles", &examination(listed(0, 0, 9))).is_some(), "nobody refused");
        assert_eq!(of("2^20-finest-tiles", &examination(Outcome::Refused("a reason".into()))), None);
    }
}
