//! Examines one extreme: compares stage 1 with the f64 reference, every variant's list with the integer reference, and
//! the settled picture with the ruler.

use super::contenders::{ExtremeVariant, Way, base, contenders, is_superset, refused};
use super::scenes::{Expected, Extreme, Landscape, Sight};
use crate::frame::{DrawList, FrameSlot, Shape, Target, View};
use crate::math::pyramid::{Pyramid, TileId};
use crate::paper::virtual_texture::dump::read_reaches;
use crate::paper::virtual_texture::footprint::FootprintPass;
use crate::paper::virtual_texture::list_passes::ListPasses;
use crate::paper::virtual_texture::method::ListAndDraw;
use crate::paper::virtual_texture::reach::neighbours;
use crate::paper::virtual_texture::reference::stage1::{Stage1Check, compare_triples};
use crate::paper::virtual_texture::ruler::Verdicts;
use crate::paper::virtual_texture::streaming::distinct_tiles;
use crate::paper::virtual_texture::tile_pool::{TilePool, TilePoolError};
use crate::paper::virtual_texture::{Config, TileAddress, reference};
use crate::paper::virtual_texture::{VirtualTexture, VirtualTextureError, VirtualTextureSettings};
use crate::picture::PixelFormat;
use crate::picture::write::Srgb8Picture;
use crate::reference::ReferenceView;
use crate::scene::Scene;
use crate::texture::source::ruler::Ruler;
use crate::vk::{self, Gpu};
use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

/// Maximum number of tiles for which a settled picture is made: 170 MB with borders and the next coarser level.
const MAX_SETTLED: usize = 128;

/// The results at one extreme, with one NA.
pub struct Examination {
    pub stage1: Stage1Check,
    /// Number of tiles of the reference, computed from the device's own request image.
    pub tiles: usize,
    /// Tiles among them that no pixel's own triple names: only samples read them.
    pub of_samples: usize,
    /// In the order of [`super::contenders::variants`].
    pub variants: Vec<(String, ListOutcome)>,
    /// The settled picture. `None` if more than 128 tiles are visible, if the paper's variant is refused, or if the
    /// examiner makes no pictures.
    pub settled: Option<Settled>,
    /// A picture of the levels as colours and the tiles as a chequerboard.
    pub picture: Srgb8Picture,
}

/// The result of one variant of stages 2 and 3.
#[derive(Clone, Debug, PartialEq)]
pub enum ListOutcome {
    /// A list that should be exact: its missing tiles, its tiles beyond the reference, its length, and the reference's
    /// length. With level-0 tile addresses a tile has an entry for each of its cells that pixels request.
    Listed { lost: usize, extra: usize, entries: usize, right_entries: usize },
    /// A superset: its missing tiles, its tiles beyond the reference, and repeated entries.
    Superset { lost: usize, beyond: usize, repeated: usize },
    /// Refused by the device, with the reason in one line.
    Refused(String),
}

/// A settled picture of a ruler texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settled {
    /// The level bias. It is above 0 if the caches were too small.
    pub bias: u32,
    /// `None` if coordinates are NaN, because the right texel is then undefined.
    pub verdicts: Option<Verdicts>,
    /// Pixels of the linear-light picture that are not finite.
    pub not_finite: usize,
}

/// The output of stage 1, the input of all variants.
struct Drawn {
    pyramid: Pyramid,
    shape: Shape,
    view: View,
    stage1: FootprintPass,
    triples: Vec<[u32; 3]>,
    /// The sorted tiles.
    visible: Vec<TileId>,
    of_samples: usize,
    distinct_triples: usize,
}

/// The resources that extremes share: pipelines are created once per pyramid.
pub struct Examiner {
    gpu: Gpu,
    /// True if settled pictures are made too.
    pictures: bool,
    /// By NA.
    contenders: HashMap<u32, (Pyramid, Vec<ExtremeVariant>)>,
}

impl Examiner {
    pub fn new(gpu: Gpu) -> Examiner {
        Examiner { gpu, pictures: true, contenders: HashMap::new() }
    }

    /// Creates an examiner of stages 1 to 3, without settled pictures.
    pub fn of_lists(gpu: Gpu) -> Examiner {
        Examiner { pictures: false, ..Examiner::new(gpu) }
    }

    /// Runs all variants of one NA on one extreme, at `size` pixels.
    ///
    /// # Errors
    /// Errors such as device lost. What the device does not support is reported as [`ListOutcome::Refused`].
    pub fn examine(&mut self, extreme: &Extreme, size: [u32; 2], na: u32) -> anyhow::Result<Examination> {
        let (sight, config) = (extreme.sight(size)?, base(na));
        let gpu = self.gpu.clone();
        let drawn = draw(&gpu, &sight, &config)?;
        let ready = match self.contenders.remove(&na) {
            Some((pyramid, ready)) if pyramid == sight.pyramid => ready,
            _ => contenders(&gpu, &sight.pyramid, &drawn.stage1, na)?,
        };
        let (_, contenders) = self.contenders.entry(na).or_insert((sight.pyramid, ready));
        let textures = contenders.iter().any(|contender| matches!(contender.way, Ok(Way::WhileTexturing)));
        // A texture that is too large for the device's page table is refused, too.
        let textured = match textures.then(|| Textured::new(&gpu, &sight)) {
            Some(Err(TilePoolError::Vulkan(error))) => Some(Err(refused(error)?)),
            other => other.transpose()?.map(Ok),
        };
        let variants = contenders
            .iter_mut()
            .map(|contender| Ok((contender.name.clone(), outcome(&gpu, &drawn, &textured, contender)?)))
            .collect::<vk::Result<Vec<_>>>()?;
        // The settled picture is made with the paper's variant.
        let papers = contenders.iter().position(|contender| contender.config == config);
        let shown = papers.is_some_and(|at| matches!(variants[at].1, ListOutcome::Listed { .. }));
        let settles = self.pictures && shown && drawn.visible.len() <= MAX_SETTLED;
        Ok(Examination {
            stage1: stage1(extreme, &sight, &drawn, na),
            tiles: drawn.visible.len(),
            of_samples: drawn.of_samples,
            variants,
            settled: settles.then(|| settled(&gpu, extreme, &sight, config)).transpose()?,
            picture: false_colours(&drawn.triples, size),
        })
    }
}

fn draw(gpu: &Gpu, sight: &Sight, config: &Config) -> vk::Result<Drawn> {
    let pyramid = sight.pyramid;
    let stage1 = FootprintPass::new(gpu, &pyramid, config, sight.size)?;
    // The exact fused draws also need the position-only vertices.
    let shape = Shape::with_depth_alone(gpu, &sight.mesh)?;
    let view = View::new(&sight.pose, sight.size);
    gpu.run_pass("footprint", |cmd| stage1.draw(cmd, &DrawList::new([&shape], view, 0)))?;
    let (triples, reaches): (Vec<_>, Vec<_>) = read_reaches(gpu, &stage1, &pyramid)?.into_iter().unzip();
    let own = reference::visible_tiles(&triples, &pyramid).len();
    let pairs = triples.iter().zip(&reaches);
    let beside = pairs.flat_map(|(&triple, &reach)| neighbours(&pyramid, triple, reach));
    let requested: Vec<[u32; 3]> = triples.iter().copied().chain(beside).collect();
    let visible: Vec<TileId> = reference::visible_tiles(&requested, &pyramid).into_iter().collect();
    let distinct_triples = reference::distinct_triples(&requested, &pyramid).len();
    let of_samples = visible.len() - own;
    Ok(Drawn { pyramid, shape, view, stage1, triples, visible, of_samples, distinct_triples })
}

fn stage1(extreme: &Extreme, sight: &Sight, drawn: &Drawn, na: u32) -> Stage1Check {
    if let Landscape::Noise = extreme.landscape {
        // No sample is near the border of a tile or level, so all triples must be equal.
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
    compare_triples(&drawn.triples, &view, &sight.source, &sight.pyramid, na)
}

/// Resources for draws that texture. Only the resident tail is present, because the list does not depend on other
/// tiles.
struct Textured {
    resident: TilePool,
    target: Target,
}

impl Textured {
    fn new(gpu: &Gpu, sight: &Sight) -> Result<Textured, TilePoolError> {
        let resident = TilePool::new(gpu, &Ruler::new(sight.pyramid), 1)?;
        let target = Target::new(gpu, sight.size, PixelFormat::Srgb8)?;
        Ok(Textured { resident, target })
    }
}

/// A variant's list, or the reason why it is refused.
fn outcome(
    gpu: &Gpu,
    drawn: &Drawn,
    textured: &Option<Result<Textured, String>>,
    contender: &mut ExtremeVariant,
) -> vk::Result<ListOutcome> {
    let list = match &mut contender.way {
        Ok(Way::OverRequests(list_passes)) => list(gpu, drawn, list_passes),
        Ok(Way::WhileTexturing) => match textured.as_ref().expect("created if a variant textures") {
            Ok(textured) => list_while_texturing(gpu, drawn, textured, &contender.config),
            Err(line) => return Ok(ListOutcome::Refused(line.clone())),
        },
        Err(line) => return Ok(ListOutcome::Refused(line.clone())),
    };
    match list {
        Ok(triples) => Ok(compared(drawn, &triples, &contender.config)),
        Err(error) => Ok(ListOutcome::Refused(refused(error)?)),
    }
}

fn compared(drawn: &Drawn, triples: &[[u32; 3]], config: &Config) -> ListOutcome {
    let found = distinct_tiles(triples, config.address, drawn.pyramid.first_resident_level());
    let without = |tiles: &[TileId], others: &[TileId]| {
        tiles.iter().filter(|tile| others.binary_search(tile).is_err()).count()
    };
    let (lost, extra) = (without(&drawn.visible, &found), without(&found, &drawn.visible));
    if is_superset(config) {
        let distinct: BTreeSet<_> = triples.iter().collect();
        return ListOutcome::Superset { lost, beyond: extra, repeated: triples.len() - distinct.len() };
    }
    let right_entries = match config.address {
        TileAddress::Level0 => drawn.distinct_triples,
        TileAddress::OwnLevel => drawn.visible.len(),
    };
    ListOutcome::Listed { lost, extra, entries: triples.len(), right_entries }
}

/// The list of a variant from the common request image.
fn list(gpu: &Gpu, drawn: &Drawn, list_passes: &mut ListPasses) -> vk::Result<Vec<[u32; 3]>> {
    list_passes.renew(gpu, &drawn.stage1)?;
    let mut frame = gpu.frame()?;
    list_passes.record(&mut frame, &drawn.stage1.requests, FrameSlot::FIRST)?;
    frame.submit()?.wait()?;
    Ok(list_passes.collect(gpu, FrameSlot::FIRST)?.0)
}

/// The list of a variant that makes it in, or after, the draw that textures.
fn list_while_texturing(
    gpu: &Gpu,
    drawn: &Drawn,
    Textured { resident, target }: &Textured,
    config: &Config,
) -> vk::Result<Vec<[u32; 3]>> {
    let mut method = ListAndDraw::new(gpu, &drawn.pyramid, config, resident, target, None)?;
    let seen = DrawList::new([&drawn.shape], drawn.view, 0);
    let mut frame = gpu.frame()?;
    method.record(&mut frame, resident, &seen, target)?;
    frame.submit()?.wait()?;
    Ok(method.collect(gpu, FrameSlot::FIRST)?.0)
}

/// Draws the whole frame on a ruler texture until no tile is missing.
fn settled(
    gpu: &Gpu,
    extreme: &Extreme,
    sight: &Sight,
    config: Config,
) -> Result<Settled, VirtualTextureError> {
    let scene = Scene::embedded("ruler").expect("shipped");
    let mut settings = VirtualTextureSettings::of_scene(&scene, PixelFormat::Linear32).expect("shipped");
    (settings.size, settings.config) = (sight.size, config);
    settings.streaming.gpu_tiles = MAX_SETTLED as u32;
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

/// A picture with a hue for each level (red for level 0). Neighbouring tiles differ in lightness; pixels without
/// the textured surface are black.
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
    /// Pixels with a wrong or missing texel.
    pub fn wrong(&self) -> u64 {
        self.verdicts.map_or(0, |verdicts| verdicts.wrong + verdicts.not_resident)
    }
}

impl Examination {
    /// The first failure, if any: a lost or additional tile, an unexplained pixel, a wrong texel, or a result other
    /// than the extreme's `expected`.
    pub fn fault(&self, extreme: &Extreme) -> Option<String> {
        let unexplained = &self.stage1.unexplained;
        if let Some(first) = unexplained.first() {
            return Some(format!("stage 1: {} pixels unexplained, such as {first}", unexplained.len()));
        }
        for (name, outcome) in &self.variants {
            match outcome {
                ListOutcome::Refused(_) => {}
                &ListOutcome::Listed { lost: 0, extra: 0, entries, right_entries }
                    if entries == right_entries => {}
                ListOutcome::Superset { lost: 0, repeated: 0, .. } => {}
                other => return Some(format!("{name}: {other:?}")),
            }
        }
        if let Some(settled) = self.settled.filter(|settled| settled.wrong() + settled.not_finite as u64 > 0)
        {
            return Some(format!("{settled:?}"));
        }
        let refused = || self.variants.iter().any(|(_, outcome)| matches!(outcome, ListOutcome::Refused(_)));
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

    fn examination(outcome: ListOutcome) -> Examination {
        Examination {
            stage1: Stage1Check { pixels: 4, ..Stage1Check::default() },
            tiles: 3,
            of_samples: 0,
            variants: vec![("variant".into(), outcome)],
            settled: Some(Settled { bias: 0, verdicts: None, not_finite: 0 }),
            picture: false_colours(&[[0, 0, 0]], [1, 1]),
        }
    }

    fn of(name: &str, examination: &Examination) -> Option<String> {
        examination.fault(Extreme::find(name).unwrap())
    }

    #[test]
    fn exactly_the_wrong_results_are_faults() {
        let listed = |lost, extra, entries| ListOutcome::Listed { lost, extra, entries, right_entries: 9 };
        assert_eq!(of("pole", &examination(listed(0, 0, 9))), None);
        let superset = |lost, beyond, repeated| ListOutcome::Superset { lost, beyond, repeated };
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
        assert!(of("2^20-finest-tiles", &examination(listed(0, 0, 9))).is_some(), "no variant refused");
        assert_eq!(of("2^20-finest-tiles", &examination(ListOutcome::Refused("a reason".into()))), None);
    }
}
