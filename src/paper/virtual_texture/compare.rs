//! `--compare-plain`: the GPU time of the whole frame, relative to the same mesh with one plain texture. The command
//! line sets the scene's filter to one trilinear sample per pixel, the filter of the plain texture.

use super::config::Filter;
use super::technique::{VirtualTexture, VirtualTextureError};
use super::texturing::PlainBaseline;
use crate::frame::{FrameSlot, Run, Target, View};
use crate::math::camera::Pose;
use crate::stats::{Summary, median};
use crate::vk::{Gpu, PassTime};
use serde::Serialize;
use std::time::{Duration, Instant};

/// Runs of each frame, after the warm-up.
const RUNS: usize = 30;
/// Software drivers compile shaders on first use.
const WARM_UP: usize = 3;

/// The times of the settled frame and of the plain frame, interleaved so that drift affects both alike. The plain frame
/// takes one trilinear sample per pixel. The settled frame has the scene's filter, which `--compare-plain` also sets to
/// one trilinear sample.
#[derive(Clone, Debug, Serialize)]
pub struct PlainComparison {
    /// Time of the settled frame divided by the time of the same mesh with one plain texture, per run.
    pub settled_over_plain: Summary,
    /// GPU time.
    pub settled_frame_ns: Summary,
    /// Median of each pass of the settled frame.
    pub settled_passes_ns: Vec<(String, f64)>,
    pub plain_frame_ns: Summary,
    /// Width and height of the plain texture.
    pub plain_texture: [u32; 2],
    pub empty_pass_ns: Summary,
}

fn total(passes: &[PassTime]) -> Option<f64> {
    passes.iter().map(|pass| pass.ns.map(|ns| ns as f64)).sum()
}

/// A settled frame, drawn once more.
pub struct Again {
    /// The visible-tile list: triples (q, i, j) in the grid of the variant's tile addresses, in the order in which the
    /// method lists them.
    pub triples: Vec<[u32; 3]>,
    pub times: Vec<PassTime>,
    /// The host's time to get or make the list.
    pub host_time: Duration,
}

impl Run<VirtualTexture> {
    /// Draws the settled frame at `pose` once more, without copies, and waits for the frame and its list.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn again(&mut self, pose: &Pose) -> Result<Again, VirtualTextureError> {
        self.drain()?;
        let view = View::new(pose, self.size());
        let (gpu, target) = (self.gpu.clone(), self.target().clone());
        self.technique.again(&gpu, &view, &target)
    }

    /// Times the settled frame from `pose` and the plain frame. `None` if the device has no timestamps.
    ///
    /// # Errors
    /// Device lost, out of memory, a plain texture that cannot be read.
    pub fn compare_plain(&mut self, pose: &Pose) -> Result<Option<PlainComparison>, VirtualTextureError> {
        self.drain()?;
        let view = View::new(pose, self.size());
        let (gpu, target) = (self.gpu.clone(), self.target().clone());
        self.technique.compare_plain(&gpu, &view, &target)
    }
}

impl VirtualTexture {
    /// As [`Run::again`], while no frame is in flight.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn again(&mut self, gpu: &Gpu, view: &View, target: &Target) -> Result<Again, VirtualTextureError> {
        let view = View { frame: 0, ..*view };
        // No copies: all tiles are resident, and the page table is complete.
        self.without_copies(gpu, FrameSlot::FIRST)?;
        let mut frame = gpu.frame()?;
        self.record_frame(&mut frame, &view, target)?;
        let times = frame.submit()?.wait()?;
        let start = Instant::now();
        let (triples, _) = self.method.collect(gpu, FrameSlot::FIRST)?;
        Ok(Again { triples, times, host_time: start.elapsed() })
    }

    /// As [`Run::compare_plain`], while no frame is in flight. Afterwards the target holds the settled picture again.
    ///
    /// # Errors
    /// Device lost, out of memory, a plain texture that cannot be read.
    pub fn compare_plain(
        &mut self,
        gpu: &Gpu,
        view: &View,
        target: &Target,
    ) -> Result<Option<PlainComparison>, VirtualTextureError> {
        let plain = PlainBaseline::new(gpu, &*self.source, &target.color, &Filter::ONE_SAMPLE)?;
        let (mut settled, mut plain_ns, mut empty) = (Vec::new(), Vec::new(), Vec::new());
        let mut passes: Vec<(String, Vec<f64>)> = Vec::new();
        for run in 0..WARM_UP + RUNS {
            let frame_times = self.again(gpu, view, target)?.times;
            let plain_times =
                gpu.run_pass("plain", |cmd| plain.draw(cmd, &self.seen(*view), &target.color))?;
            let empty_times = gpu.run_pass("empty", |_| Ok(()))?;
            let (Some(a), Some(b), Some(c)) = (total(&frame_times), total(&plain_times), total(&empty_times))
            else {
                return Ok(None);
            };
            if run < WARM_UP {
                continue;
            }
            settled.push(a);
            plain_ns.push(b);
            empty.push(c);
            passes.resize_with(frame_times.len(), Default::default);
            for ((label, times), pass) in passes.iter_mut().zip(frame_times) {
                *label = pass.label;
                times.extend(pass.ns.map(|ns| ns as f64));
            }
        }
        // The plain frame overwrote the picture: draw it again.
        self.again(gpu, view, target)?;
        let summary = |times: &[f64]| Summary::of(times).expect("every run was timed");
        let ratio = Summary::of_pairs(&settled, &plain_ns, |settled, plain| settled / plain);
        Ok(ratio.map(|ratio| PlainComparison {
            settled_over_plain: ratio,
            settled_frame_ns: summary(&settled),
            settled_passes_ns: passes
                .into_iter()
                .filter_map(|(label, times)| Some((label, median(&times)?)))
                .collect(),
            plain_frame_ns: summary(&plain_ns),
            plain_texture: plain.size(),
            empty_pass_ns: summary(&empty),
        }))
    }
}
