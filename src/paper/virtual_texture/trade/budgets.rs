//! Upload and load budgets (section 3). These budgets change how soon a frame settles, but not the settled frame. So
//! budgets are not points of the Pareto front. With each budget, a session settles from empty caches, and its settled
//! picture is compared with that of the scene's own setting.

use super::{SweepResources, TradeSweep};
use crate::figure::{Bench, Budgeted, Contender};
use crate::frame::Run;
use crate::paper::virtual_texture::config::texture;
use crate::paper::virtual_texture::{VirtualTexture, VirtualTextureSettings};
use crate::picture::PixelFormat;
use std::time::Instant;

/// Upload budgets in milliseconds per frame, with all tiles in memory.
const UPLOAD_MS: [f64; 4] = [0.5, 1.0, 2.0, 4.0];
/// Load budgets in milliseconds per frame. With each of them, the tiles are synthesised or read again.
const LOAD_MS: [f64; 3] = [2.0, 8.0, 32.0];

/// For each budget: the change of the scene, and true if tiles are read again.
fn changes() -> Vec<(String, bool)> {
    let uploads = UPLOAD_MS.map(|ms| (format!("cache.upload_budget_ms={ms}"), false));
    uploads.into_iter().chain(LOAD_MS.map(|ms| (format!("cache.load_budget_ms={ms}"), true))).collect()
}

struct Settled {
    change: String,
    session: Run<VirtualTexture>,
    frames: u64,
    wall_ms: f64,
    differing_bytes: usize,
}

/// Runs each budget from empty caches to the settled frame, and compares its picture with `picture`.
///
/// # Errors
/// Device lost, out of memory, tiles that do not arrive.
pub(super) fn measure(
    bench: &Bench,
    stage: &SweepResources<'_>,
    picture: &[u8],
) -> anyhow::Result<Vec<Budgeted>> {
    let mut rows = Vec::new();
    // Each session has its own tile pool, so only TOGETHER of them run at once.
    for together in changes().chunks(super::TOGETHER) {
        let settled = together.iter().map(|(change, anew)| settle(stage, change, *anew, picture));
        let mut settled = settled.collect::<anyhow::Result<Vec<_>>>()?;
        let contenders = settled.iter_mut().map(|Settled { change, session, .. }| Contender {
            variant: change.clone(),
            run: Box::new(move || Ok(session.again(&stage.sweep.pose)?.times)),
        });
        let timed = bench.interleave(&stage.gpu, contenders.collect())?;
        for (Settled { change, frames, wall_ms, differing_bytes, .. }, timed) in
            settled.into_iter().zip(&timed)
        {
            let change = vec![change];
            rows.push(Budgeted { changes: change, frames, wall_ms, differing_bytes, ms: timed.total });
        }
    }
    Ok(rows)
}

fn settle(stage: &SweepResources<'_>, change: &str, anew: bool, picture: &[u8]) -> anyhow::Result<Settled> {
    let TradeSweep { scene, pose, size, .. } = stage.sweep;
    let scene = scene.with(&[change.to_string()])?;
    let texture = texture(&scene)?;
    let source = &stage.sources[&(texture.border, texture.format)];
    if anew {
        source.forget();
    }
    let settings = VirtualTextureSettings {
        size: *size,
        ..VirtualTextureSettings::of_scene(&scene, PixelFormat::Srgb8)?
    };
    let mut session = VirtualTexture::run(stage.gpu.clone(), source.clone(), &stage.mesh, settings)?;
    let begun = Instant::now();
    let frames = session.settle_within_budgets(pose)?;
    let wall_ms = begun.elapsed().as_secs_f64() * 1e3;
    session.drain()?;
    session.again(pose)?;
    let settled = session.picture_bytes()?;
    let differing_bytes = settled.iter().zip(picture).filter(|(a, b)| a != b).count();
    Ok(Settled { change: change.to_string(), session, frames, wall_ms, differing_bytes })
}
