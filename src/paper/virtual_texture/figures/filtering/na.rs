//! vt.na: the cost of NA, the largest number of samples along a footprint, at any tilt.

use super::super::common::{MIB, ONE_SAMPLE, SceneView, sampled};
use super::super::cost::{self, FRAME, LIST};
use super::super::side_by_side::{Combination, SideBySide};
use super::super::streaming::Route;
use super::{Shown, Variant};
use crate::figure;
use crate::figure::prelude::*;
use crate::paper::virtual_texture::config::Filter;
use crate::paper::virtual_texture::streaming::replay::{Replacement, replay, steps};
use crate::paper::virtual_texture::{Config, Filtering, PAPER};
use crate::picture::error::compare;
use crate::reference::filter::SAMPLER_ERROR;
use crate::texture::source::TileFormat;

pub const NA: Figure = Figure {
    id: "vt.na",
    title: "Samples along a footprint: visible set, list, cache and seams",
    about: "Section 2.1 lowers a pixel's level by log2 of nA, the number of samples along its footprint. nA is at most \
            NA, the hardware's limit, which is 16 on today's GPUs. Figures of the list and of the frame have NA = 16; \
            figures of streaming, feedback and extreme inputs have NA = 1. This figure shows what NA changes, against \
            the camera's tilt: the visible tiles (mean over the path), the memory of the largest visible set, the \
            times of stages 2 and 3 and of the settled frame, the texels that a covered pixel fetches (counted by an \
            instrumented shader), and the tiles copied per frame with an LRU cache of twice the largest visible set. \
            Tiles have a border of 4 texels. Samples beyond it are looked up in the neighbouring tile, which stage 1 \
            then requests. With a border of 16 no sample lies beyond it. Seams are the largest difference of a pixel \
            between these two borders, on white noise. Pictures of 320 x 180 pixels with tiles of 128 texels (quick), or of 640 x 360 with tiles of 256, show as many tiles as 1280 x 720 with \
            the paper's 512.",
    scenes: &["earth/pan", "plane/pan"],
    variants: || NAS.map(|(name, _)| name).into_iter().chain([WITHIN]).map(str::to_owned).collect(),
    paper: &[LARGEST],
    sweep: Some(Sweep {
        name: "tilt, degrees",
        quick: &[0.0, 80.0],
        full: &[0.0, 30.0, 45.0, 60.0, 70.0, 75.0, 80.0, 85.0],
    }),
    show: Show::views(views).variants(settings),
    measure,
    plots: &[
        Plot::sweep(VISIBLE).log_y(),
        Plot::sweep(WORKING_SET).log_y(),
        Plot::sweep(TRAFFIC),
        Plot::sweep(LIST).log_y().floor("empty pass"),
        Plot::sweep(FRAME).log_y().floor("empty pass"),
        Plot::sweep(SEAMS),
    ],
    claims: &[
        Claim::ours(
            "seams",
            "A border of 4 texels shows no seams for any NA: no pixel is off by more than 3/256.",
            &[Test::value(every(SEAMS), AtMost(SAMPLER_ERROR))],
        ),
        Claim::ours(
            "facing",
            "Facing the earth, NA = 2 lists at least twice as many tiles as NA = 1, because nA is rounded up: a \
             footprint that is hardly longer than wide takes two samples of the next finer level. More samples change \
             nothing.",
            &[
                Test::ratio_of(VISIBLE, ["NA 2", "NA 1"], AtLeast(2.0)),
                Test::ratio_of(VISIBLE, [LARGEST, "NA 2"], Equal(1.0)),
            ],
        )
        .at(Places::scenes(&["earth/pan"]).x(0.0, 0.0)),
        Claim::ours(
            "tilted",
            "At a tilt of 80 degrees NA = 16 needs at least twice the tiles of NA = 1.",
            &[Test::ratio_of(VISIBLE, [LARGEST, "NA 1"], AtLeast(2.0))],
        )
        .at(Places::ALL.x(80.0, 80.0)),
        Claim::ours(
            "border",
            "Facing the surface, a border of 16 texels needs more memory than one of 4 with neighbouring tiles.",
            &[Test::ratio_of(WORKING_SET, [WITHIN, LARGEST], Above(1.0))],
        )
        .at(Places::ALL.x(0.0, 0.0)),
    ],
    ..Figure::BASE
};

const NAS: [(&str, u32); 5] = [("NA 1", 1), ("NA 2", 2), ("NA 4", 4), ("NA 8", 8), (LARGEST, 16)];
const LARGEST: &str = "NA 16";
/// The camera of each scene's path.
const CAMERAS: [(&str, &str); 2] = [("earth/pan", "headline"), ("plane/pan", "tilted")];
/// The borders in texels. Samples reach beyond the narrow one, but not beyond the wide one.
const BORDERS: [u32; 2] = [4, 16];

const WITHIN: &str = "NA 16, border 16";
const VISIBLE: &str = "visible tiles";
const WORKING_SET: &str = "largest working set";
const TRAFFIC: &str = "tiles copied per frame";
const SEAMS: &str = "seams";

/// The view of a cell.
struct View {
    name: String,
    changes: Vec<String>,
    size: [u32; 2],
    /// Every `step`-th frame of the path is measured.
    step: u32,
}

impl View {
    fn of(bench: &Bench, cell: &Cell) -> anyhow::Result<View> {
        let camera = CAMERAS.iter().find(|(name, _)| *name == cell.scene).context("a scene of the figure")?.1;
        let tilt = cell.x.context("a sweep")?;
        let (size, tile, step) = bench.effort_of(([320, 180], 128, 16), ([640, 360], 256, 2));
        Ok(View { name: cell.scene.clone(), changes: changes(camera, tilt, tile), size, step })
    }

    fn with(&self, na: u32, border: u32) -> anyhow::Result<Route> {
        Route::find(&self.name, &[&self.changes[..], &sampled(na, border)].concat())
    }

    fn place(&self, na: u32, border: u32) -> anyhow::Result<SceneView> {
        let Route { scene, path } = self.with(na, border)?;
        Ok(SceneView { scene, pose: path.pose(0), path: Some(path) })
    }
}

/// The scene with a camera's tilt and tiles of `tile` texels.
fn changes(camera: &str, tilt: f64, tile: u32) -> Vec<String> {
    vec![
        format!("cameras.{camera}.tilt_deg={tilt}"),
        format!("cameras.{camera}.magnification=1.0"),
        "surface.land.texture.source=ruler".into(),
        format!("surface.land.texture.tile_size={tile}"),
        "cache.gpu_tiles=1024".into(),
        "cache.host_tiles=1024".into(),
        // Settling is not timed.
        "cache.upload_tiles_per_frame=64".into(),
        "variant.dedup=tile-memo".into(),
        "variant.compact=append".into(),
        "variant.address=own-level".into(),
    ]
}

/// The figure's views for the window: both paths with the tilts and the tiles of a quick run.
fn views() -> Vec<figure::FigureView> {
    let tilts = || NA.sweep.into_iter().flat_map(|sweep| sweep.quick);
    let view = |(scene, camera): (&str, &str), tilt: f64| {
        let one_sample = ONE_SAMPLE.iter().map(|change| (*change).to_owned());
        figure::FigureView::new(
            format!("{scene}, tilt {tilt}"),
            scene,
            one_sample.chain(changes(camera, tilt, 128)),
        )
    };
    CAMERAS.into_iter().flat_map(|camera| tilts().map(move |tilt| view(camera, *tilt))).collect()
}

/// The variants as settings of a scene.
fn settings() -> Vec<Setting> {
    let narrow = NAS.map(|(name, na)| (name, sampled(na, BORDERS[0])));
    let all = narrow.into_iter().chain([(WITHIN, sampled(16, BORDERS[1]))]);
    all.map(|(name, changes)| Setting::new(name, changes)).collect()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let view = View::of(bench, cell)?;
    let mut rows = Vec::new();
    for (name, na) in NAS {
        rows.extend(along_the_path(bench, &view, name, na, BORDERS[0])?);
        rows.push(Row::number(name, SEAMS, "linear light", seams(bench, &view, na)?));
    }
    rows.extend(along_the_path(bench, &view, WITHIN, 16, BORDERS[1])?);
    rows.extend(times(bench, &view)?);
    Ok(rows)
}

/// Counts of the path's lists, and of the tiles that a cache copies for them.
fn along_the_path(
    bench: &Bench,
    view: &View,
    variant: &str,
    na: u32,
    border: u32,
) -> anyhow::Result<Vec<Row>> {
    let route = view.with(na, border)?;
    let pyramid = route.pyramid()?;
    let records = route.records(bench, view.size, view.step, 0)?;
    let lists: Vec<_> = records.into_iter().map(|record| record.visible).collect();
    let mean = |total: usize| total as f64 / lists.len() as f64;
    let largest = lists.iter().map(Vec::len).max().context("a path has frames")?;
    let slots = (2 * largest).max(1) as u32;
    let replayed =
        replay(&steps(&lists, slots, pyramid.first_resident_level()), slots, Replacement::LeastRecentlyShown);
    // The first frame fills the cache.
    let copied: usize = replayed.iter().skip(1).map(|frame| frame.faults).sum();
    let tile_mib = TileFormat::Rgba8.tile_bytes(&pyramid) as f64 / MIB;
    let row = |quantity, unit, number| Row::number(variant, quantity, unit, number);
    Ok(vec![
        row(VISIBLE, "tiles", mean(lists.iter().map(Vec::len).sum())),
        row(WORKING_SET, "MiB", largest as f64 * tile_mib),
        match lists.len() {
            1 => Row::missing(variant, TRAFFIC, "the path has one frame, which fills the cache"),
            frames => row(TRAFFIC, "tiles", copied as f64 / (frames - 1) as f64),
        },
    ])
}

/// The largest difference between the pictures with the narrow and with the wide border.
fn seams(bench: &Bench, view: &View, na: u32) -> anyhow::Result<f64> {
    let picture = |border| {
        let mut shown = Shown::of(bench, view.place(na, border)?, view.size)?;
        shown.picture(&Variant::new(Filtering::Trilinear, na, 1))
    };
    Ok(compare(&picture(BORDERS[0])?, &picture(BORDERS[1])?)?.largest())
}

/// Times of the settled frames, measured in turn.
fn times(bench: &Bench, view: &View) -> anyhow::Result<Vec<Row>> {
    let combination = |(name, max_anisotropy)| {
        Combination::exact(name, Config { filter: Filter { max_anisotropy, ..PAPER.filter }, ..PAPER })
    };
    let combinations = NAS.map(combination);
    let place = view.place(1, BORDERS[0])?;
    let mut frames = SideBySide::settled(bench, place, view.size, (&combinations, &[]), |_| ())?;
    let timed = frames.times(bench)?;
    let texels = frames.texels()?;
    let times = timed.iter().flat_map(|of| [Some(of.row(FRAME)), cost::list_row(of, &timed)]).flatten();
    Ok(times.chain(frames.missing_rows(FRAME)).chain(texels).collect())
}
