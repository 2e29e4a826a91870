//! `--compare-plain`: what the paper's whole frame costs beside the same mesh with one plain texture, in one process.

use super::{RenderError, Renderer};
use crate::math::camera::Pose;
use crate::paper::virtual_texture::{surface, texturing::Plain};
use crate::vk::PassTime;

/// Runs of each, after the warm-up.
const RUNS: usize = 30;
/// First uses compile on software drivers.
const WARM_UP: usize = 3;

/// Nanoseconds of GPU time over the runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    pub median_ns: f64,
    pub p5_ns: f64,
    pub p95_ns: f64,
    pub runs: usize,
}

/// Both frames' times, interleaved so that drift hits both alike.
#[derive(Clone, Debug)]
pub struct PlainComparison {
    pub settled: Spread,
    /// Median of each pass of the settled frame.
    pub settled_passes: Vec<(String, f64)>,
    pub plain: Spread,
    pub empty_pass: Spread,
    /// Width and height of the plain texture.
    pub plain_size: [u32; 2],
    pub ratio: f64,
}

impl Spread {
    fn of(times_ns: &[f64]) -> Spread {
        use crate::stats::{median, percentile};
        Spread {
            median_ns: median(times_ns),
            p5_ns: percentile(times_ns, 5.0),
            p95_ns: percentile(times_ns, 95.0),
            runs: times_ns.len(),
        }
    }
}

fn total(passes: &[PassTime]) -> Option<f64> {
    passes.iter().map(|pass| pass.ns.map(|ns| ns as f64)).sum()
}

impl Renderer {
    /// Measures the settled frame from `pose` against the plain one. `None` where the device keeps no time.
    ///
    /// # Errors
    /// Device lost, out of memory, a plain texture that cannot be read.
    pub fn compare_plain(&mut self, pose: &Pose) -> Result<Option<PlainComparison>, RenderError> {
        self.drain()?;
        let plain = Plain::new(&self.gpu, &*self.source, &self.target)?;
        let view = surface::view(pose, self.settings.size, self.bias);
        let (mut settled, mut plain_ns, mut empty) = (Vec::new(), Vec::new(), Vec::new());
        let mut passes: Vec<(String, Vec<f64>)> = Vec::new();
        for run in 0..WARM_UP + RUNS {
            // No copies: all tiles are resident, and the display table stands.
            self.pipeline.gather(&self.gpu, 0, |_| (Vec::new(), ()))?;
            let mut frame = self.gpu.frame()?;
            self.pipeline.record(&mut frame, 0, &view, &self.target)?;
            let frame_times = frame.submit()?.wait()?;
            let mut frame = self.gpu.frame()?;
            frame.pass("plain", |cmd| plain.draw(cmd, &self.pipeline.surface, &view, &self.target))?;
            let plain_times = frame.submit()?.wait()?;
            let mut frame = self.gpu.frame()?;
            frame.pass("empty", |_| Ok(()))?;
            let empty_times = frame.submit()?.wait()?;
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
        let (settled, plain_spread) = (Spread::of(&settled), Spread::of(&plain_ns));
        // The plain frame overwrote the picture: draw it again.
        self.frame(pose)?;
        self.drain()?;
        Ok(Some(PlainComparison {
            settled,
            settled_passes: passes.iter().map(|(l, t)| (l.clone(), crate::stats::median(t))).collect(),
            plain: plain_spread,
            empty_pass: Spread::of(&empty),
            plain_size: plain.size(),
            ratio: settled.median_ns / plain_spread.median_ns,
        }))
    }
}
