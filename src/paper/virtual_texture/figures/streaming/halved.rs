//! vt.cache: a session with half of the slots that the path needs.

use super::{Route, linear, session, show_beside};
use crate::figure::{Bench, Cell, Row};
use crate::frame::Run;
use crate::paper::virtual_texture::config::open_texture;
use crate::paper::virtual_texture::{TextureFrameRecord, VirtualTexture};
use crate::picture::PixelFormat;
use crate::texture::source::cached::CachedSource;

pub(super) const HALVED: &str = "a session, N1 = half of the largest visible set";
pub(super) const BIASED: &str = "frames with a level bias";
pub(super) const MAX_BIAS: &str = "largest bias";
pub(super) const AT_REST: &str = "copies in 20 frames at rest";
pub(super) const TO_REST: &str = "frames until at rest";
pub(super) const DIFFERING: &str = "bytes that differ between two pictures at rest";
pub(super) const MISREPORTED: &str = "frames whose report of the bias is wrong";

/// The session must settle within this many frames at the path's end. The remaining tiles need far fewer.
pub(super) const LAST_STAYS: usize = 100;

/// Frames at rest between two pictures.
const REST: usize = 20;

/// Runs the path with N1 = `largest` / 2 and the usual budgets, then rests at its end. The session is set up as in
/// `render`, with loader threads and the Earth's imagery. Budgets count tiles, so that every run is the same.
pub(super) fn halved(
    bench: &mut Bench,
    cell: &Cell,
    size: [u32; 2],
    step: u32,
    largest: usize,
) -> anyhow::Result<Vec<Row>> {
    let route = Route::find(&cell.scene, &["surface.land.texture.tile_size=256".into()])?;
    let source = CachedSource::new(open_texture(&route.scene)?);
    let open = |gpu_tiles: u32| {
        session(bench, &route.scene, source.clone(), size, |settings| {
            settings.target = PixelFormat::Srgb8;
            settings.streaming.gpu_tiles = gpu_tiles;
            settings.streaming.host_tiles = 2 * gpu_tiles;
            settings.streaming.upload_tiles_per_frame = 8;
            settings.streaming.load_tiles_per_frame = 8;
            settings.streaming.deterministic = true;
        })
    };
    let slots = (largest / 2).max(1) as u32;
    let mut half = open(slots)?;
    for frame in (0..route.path.frames).step_by(step as usize) {
        half.frame(&route.path.pose(frame))?;
    }
    half.drain()?;
    let moving = half.records.len();
    let end = route.path.pose(route.path.frames - 1);
    let (to_rest, at_rest, pictures) = rest(&mut half, |session| Ok(session.frame(&end)?))?;
    let differing = pictures[0].iter().zip(&pictures[1]).filter(|(a, b)| a != b).count();
    let mut whole = open(2 * largest as u32)?;
    whole.settle(&end)?;
    let name = format!("vt.cache-{}-half", cell.scene.replace('/', "-"));
    let shown = linear(pictures[1].clone(), size);
    show_beside(bench, &name, &shown, &whole.linear_picture()?)?;
    let records = &half.records[..moving];
    let biased = records.iter().filter(|record| record.streaming.bias > 0).count();
    let max_bias = records.iter().map(|record| record.streaming.bias).max().unwrap_or(0);
    let wrong = misreported(&half.records, slots);
    let row = |quantity, unit, value: f64| Row::number(HALVED, quantity, unit, value);
    Ok(vec![
        row(BIASED, "% of frames", 100.0 * biased as f64 / records.len() as f64),
        row(MAX_BIAS, "levels", f64::from(max_bias)),
        row("bias at rest", "levels", f64::from(half.technique.bias())),
        row(MISREPORTED, "frames", wrong as f64),
        row("frames of the path", "frames", records.len() as f64),
        row(TO_REST, "frames", to_rest as f64),
        row(AT_REST, "tiles", at_rest as f64),
        row(DIFFERING, "bytes", differing as f64),
    ])
}

/// Draws frames from one pose. Returns the number of frames until the session was settled (at most [`LAST_STAYS`]), the
/// number of tiles copied in the following [`REST`] frames, and the pictures before and after those frames.
fn rest(
    session: &mut Run<VirtualTexture>,
    mut frame: impl FnMut(&mut Run<VirtualTexture>) -> anyhow::Result<()>,
) -> anyhow::Result<(usize, usize, [Vec<u8>; 2])> {
    let mut to_rest = 0;
    while to_rest < LAST_STAYS {
        frame(session)?;
        to_rest += 1;
        if session.settled() {
            break;
        }
    }
    let before = session.picture_bytes()?;
    let first = session.records.len();
    for _ in 0..REST {
        frame(session)?;
    }
    let after = session.picture_bytes()?;
    let copied = session.records[first..].iter().map(|record| record.streaming.uploads).sum();
    Ok((to_rest, copied, [before, after]))
}

/// Number of frames with a wrong report. A correct report has three properties. `oversubscribed` is true exactly if the
/// streamed list has more tiles than there are slots. `bias` is above 0 exactly if `oversubscribed` or `bias_held` is
/// true. `wanted` is at most the number of slots.
fn misreported(records: &[TextureFrameRecord], slots: u32) -> usize {
    let wrong = |record: &&TextureFrameRecord| {
        let Some(list_of) = record.list_of else { return false };
        let listed =
            records.iter().find(|other| other.index == list_of).map_or(0, |other| other.visible.len());
        let (over, report) = (listed > slots as usize, &record.streaming);
        let biased = over || report.bias_held;
        report.oversubscribed != over || (report.bias > 0) != biased || report.wanted > slots as usize
    };
    records.iter().filter(wrong).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::pyramid::TileId;
    use crate::paper::virtual_texture::streaming::StreamingCounts;

    #[test]
    fn a_missing_or_unnecessary_bias_is_misreported() {
        let visible: Vec<TileId> = (0..5).map(|column| TileId { level: 0, row: 0, column }).collect();
        let record = |index, list_of, bias, oversubscribed, wanted| TextureFrameRecord {
            index,
            streaming: StreamingCounts { bias, oversubscribed, wanted, ..StreamingCounts::default() },
            list_of,
            passes: Vec::new(),
            host_list: std::time::Duration::ZERO,
            triples: visible.len(),
            visible: visible.clone(),
            expected: Vec::new(),
            overflowed: false,
        };
        let found = |slots, bias, reported, wanted| {
            misreported(&[record(0, None, 0, false, 0), record(1, Some(0), bias, reported, wanted)], slots)
        };
        assert_eq!([found(4, 1, true, 3), found(5, 0, false, 5)], [0, 0]);
        assert_eq!([found(4, 1, false, 3), found(4, 0, true, 3), found(4, 1, true, 5)], [1, 1, 1]);
        assert_eq!([found(5, 1, true, 3), found(5, 1, false, 3)], [1, 1]);
        let mut held = record(1, Some(0), 1, false, 3);
        held.streaming.bias_held = true;
        assert_eq!(misreported(&[record(0, None, 0, false, 0), held], 5), 0, "the bias falls late");
    }
}
