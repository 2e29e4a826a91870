//! vt.resolution, vt.tile-size and vt.texture-size: how the frame scales with the sizes of the picture, of the tiles
//! and of the texture.

use super::common::{MIB, PAPERS, SceneView, pixels_of};
use super::cost::{FRAME, LIST};
use super::side_by_side::{Combination, SideBySide, THE_PAPER, combinations, device_mib, settings};
use crate::figure::prelude::*;
use crate::texture::source::TileSource;
use std::collections::BTreeMap;

/// The variant with one empty pass: the lower bound of all times.
const EMPTY: &str = "empty pass";

/// The variants of these figures.
const SIZES: Figure = Figure {
    variants: || [names(), vec![EMPTY.to_owned()]].concat(),
    paper: &[THE_PAPER],
    ours: &["fused, exact"],
    ..Figure::BASE
};

pub const RESOLUTION: Figure = Figure {
    id: "vt.resolution",
    title: "Cost by the size of the picture",
    about: "The cost of the settled frame and of its list of tiles, with the paper's NA = 16, for 16:9 pictures of 360 \
            to 720 (quick) or 2160 rows. The paper measures 1920 x 1080 only and does not say how its stages scale. \
            Stage 2 reads every pixel once, so the time of a variant should grow at most as fast as the number of \
            pixels.",
    scenes: &["earth/oblique", "globe/africa"],
    sweep: Some(Sweep {
        name: "picture height, pixels",
        quick: &[360.0, 540.0, 720.0],
        full: &[360.0, 540.0, 720.0, 1080.0, 1440.0, 2160.0],
    }),
    show: Show::scenes(PAPERS).variants(|| settings(&contenders())),
    measure: |bench, cell| {
        let rows = cell.x.expect("a sweep");
        let place = SceneView::find(&cell.scene)?;
        measure(bench, place, rows, 192)
    },
    plots: &[
        Plot::sweep(FRAME).log_x().log_y().floor(EMPTY),
        Plot::sweep(LIST).log_x().log_y().floor(EMPTY),
        Plot::sweep("visible tiles").log_x().log_y().floor(EMPTY),
    ],
    claims: &[
        Claim::ours_timed(
            "linear",
            "From the smallest to the largest picture, the time of the paper's stages 2 and 3 grows by at most 1.25 times \
             the factor by which the number of pixels grows.",
            &[Test::growth(one(LIST, THE_PAPER), 2.0, AtMost(1.25))],
        ),
        Claim::ours(
            "tiles",
            "The number of visible tiles grows no faster than the number of pixels.",
            &[Test::growth(one("visible tiles", THE_PAPER), 2.0, AtMost(1.0))],
        ),
    ],
    ..SIZES
};

pub const TILE_SIZE: Figure = Figure {
    id: "vt.tile-size",
    title: "The choice of the tile size",
    about: "The figure shows the same picture with tiles of 64 (quick: 128) to 1024 texels a side. Small tiles make \
            the list and the tables long and spend a larger share on borders; with large tiles, more invisible texels \
            are loaded. The working set is the memory of the visible tiles, all of which must be uploaded once. The \
            paper uses 512 and gives no reason. Pictures have 960 x 540 (quick) or 1920 x 1080 pixels; the border is \
            always 16 texels, as the paper's NA = 16 needs.",
    scenes: &["earth/oblique"],
    sweep: Some(Sweep {
        name: "tile side, texels",
        quick: &[128.0, 256.0, 512.0, 1024.0],
        full: &[64.0, 128.0, 256.0, 512.0, 1024.0],
    }),
    show: Show::views(|| swept(&TILE_SIZE, "tiles of", |side| vec![tile_size(side)]))
        .variants(|| settings(&contenders())),
    measure: measure_tile_size,
    plots: &[
        Plot::sweep(WORKING_SET).log_x().log_y().floor(EMPTY),
        Plot::sweep("visible tiles").log_x().log_y().floor(EMPTY),
        Plot::sweep(FRAME).log_x().log_y().floor(EMPTY),
        Plot::sweep("tile mask").log_x().log_y().floor(EMPTY),
    ],
    claims: &[Claim::ours(
        "512",
        "The paper's tiles of 512 texels need at most twice the working set of the best size.",
        &[Test::ratio(
            one(WORKING_SET, THE_PAPER).x(At::X(512.0)),
            one(WORKING_SET, THE_PAPER).x(At::Least),
            AtMost(2.0),
        )],
    )],
    ..SIZES
};

pub const TEXTURE_SIZE: Figure = Figure {
    id: "vt.texture-size",
    title: "Cost by the size of the texture",
    about: "The figure shows device memory and time of the same picture with textures of 2^12 x 2^11 to 2^20 x 2^19 \
            texels. The request image and the tile pool do not depend on the texture's size; the tile mask and the \
            page table take about 4 bytes for each tile of level 0. The paper (abstract and introduction) claims \
            textures of the order of 10^6 x 10^6 texels in real time. The filter has the paper's NA = 16. Pictures \
            have 960 x 540 (quick) or 1920 x 1080 pixels; tiles have 512 texels a side, and the tile pool has 96 \
            tiles.",
    scenes: &["earth/oblique"],
    sweep: Some(Sweep {
        name: "log2 of the texture's width in texels",
        quick: &[12.0, 16.0, 18.0, 20.0],
        full: &[12.0, 13.0, 14.0, 15.0, 16.0, 17.0, 18.0, 19.0, 20.0],
    }),
    show: Show::views(|| swept(&TEXTURE_SIZE, "width_log2", texture_size)).variants(|| settings(&contenders())),
    measure: measure_texture_size,
    plots: &[
        Plot::sweep(FRAME).log_y().floor(EMPTY),
        Plot::sweep(MEMORY).log_y().floor(EMPTY),
        Plot::sweep("tile mask").log_y().floor(EMPTY),
        Plot::sweep("page table").log_y().floor(EMPTY),
    ],
    claims: &[
        Claim::paper_timed(
            "introduction",
            "10^6",
            "Textures of the order of 10^6 x 10^6 texels are shown in real time (here: a texture of 2^20 x 2^19 texels \
             at 30 frames a second).",
            &[Test::value(one(FRAME, THE_PAPER), AtMost(1e3 / 30.0))],
        )
        .at(LARGEST),
        Claim::ours_timed(
            "our-10^6",
            "The fastest exact variant shows a texture of 2^20 x 2^19 texels at 30 frames a second.",
            &[Test::value(best(FRAME, names), AtMost(1e3 / 30.0))],
        )
        .at(LARGEST),
        Claim::ours(
            "memory",
            "At 2^20 x 2^19 texels a frame needs at most 1 GiB of device memory, the memory of the paper's GTX 285.",
            &[Test::value(one(MEMORY, THE_PAPER), AtMost(1024.0))],
        )
        .at(LARGEST),
        Claim::ours_timed(
            "flat",
            "A texture 16 times as large (2^20 against 2^18) makes the fastest frame at most a quarter slower.",
            &[Test::ratio(
                best(FRAME, names).x(At::X(20.0)),
                best(FRAME, names).x(At::X(18.0)),
                AtMost(1.25),
            )],
        ),
    ],
    ..SIZES
};

/// Quantity: MiB of the visible tiles as stored, with borders and the next coarser levels.
const WORKING_SET: &str = "working set";

/// Quantity: MiB of device memory in total.
const MEMORY: &str = "memory";

const LARGEST: Places = Places::ALL.x(20.0, 20.0);

/// The variants that make an exact list on the device.
fn contenders() -> Vec<Combination> {
    combinations().into_iter().filter(Combination::is_ours).collect()
}

fn names() -> Vec<String> {
    contenders().iter().map(|combination| combination.name.to_string()).collect()
}

/// Picture height in pixels of the figures that do not sweep it.
fn pixel_rows(bench: &Bench) -> f64 {
    bench.effort_of(540.0, 1080.0)
}

/// Times, lists and memory of all combinations. `tiles` is the number of slots of both caches (N1 and N2).
fn measure(bench: &mut Bench, place: SceneView, pixel_rows: f64, tiles: u32) -> anyhow::Result<Vec<Row>> {
    let mut frames =
        SideBySide::settled(bench, place, pixels_of(pixel_rows), (&contenders(), &[]), |settings| {
            (settings.streaming.gpu_tiles, settings.streaming.host_tiles) = (tiles, tiles);
        })?;
    let mut rows = frames.rows(bench)?;
    let tile_mib = frames.source.format().tile_bytes(&frames.source.pyramid()) as f64 / MIB;
    for (name, session) in &frames.sessions {
        let row = |quantity: &str, unit, number| Row::number(&**name, quantity, unit, number);
        let visible = session.records.last().map_or(0, |record| record.visible.len());
        rows.push(row(WORKING_SET, "MiB", visible as f64 * tile_mib));
        rows.push(row("level bias", "levels", f64::from(session.technique.bias())));
        let memory: BTreeMap<_, _> = session.memory().into_iter().collect();
        rows.push(row(MEMORY, "MiB", device_mib(session)));
        for object in
            ["request image", "tile mask", "visible-tile list", "page table", "tile pool", "resident levels"]
        {
            let bytes = memory.get(object).copied().unwrap_or(0);
            rows.push(row(object, "MiB", bytes as f64 / MIB));
        }
    }
    Ok(rows)
}

fn tile_size(side: u32) -> String {
    format!("surface.land.texture.tile_size={side}")
}

fn texture_size(width_log2: u32) -> Vec<String> {
    let sizes = [("width", width_log2), ("height", width_log2 - 1)];
    sizes.map(|(side, log2)| format!("surface.land.texture.{side}_log2={log2}")).into()
}

/// The figure's views for the window: its scenes at each value of the quick sweep.
fn swept(figure: &Figure, what: &str, changes: fn(u32) -> Vec<String>) -> Vec<FigureView> {
    let values = || figure.values(Effort::Quick).into_iter().flatten();
    let view = |scene: &str, value: f64| {
        let papers = PAPERS.iter().map(|change| (*change).to_owned());
        FigureView::new(format!("{scene}, {what} {value}"), scene, papers.chain(changes(value as u32)))
    };
    figure.scenes.iter().flat_map(|scene| values().map(move |value| view(scene, value))).collect()
}

fn measure_tile_size(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let side = cell.x.expect("a sweep") as u32;
    let mut place = SceneView::find(&cell.scene)?;
    place.scene = place.scene.with(&[tile_size(side)])?;
    let pixel_rows = pixel_rows(bench);
    // If a tile has a quarter of the area, up to four times as many are visible. Common devices have at
    // least 2048 array layers (Vulkan guarantees 256).
    let max = if pixel_rows > 540.0 { 192 } else { 96 };
    let tiles = max * 512 * 512 / (side * side);
    measure(bench, place, pixel_rows, tiles.clamp(64, 2000))
}

fn measure_texture_size(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let width_log2 = cell.x.expect("a sweep") as u32;
    let mut place = SceneView::find(&cell.scene)?;
    place.scene = place.scene.with(&texture_size(width_log2))?;
    let pixel_rows = pixel_rows(bench);
    measure(bench, place, pixel_rows, 96)
}
