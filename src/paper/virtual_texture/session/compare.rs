//! `--compare-plain`: what the paper's whole frame costs beside the same mesh with one plain texture, in one process.

use super::super::{pipeline::Finished, surface, texturing::Plain};
use super::{Session, SessionError};
use crate::math::camera::Pose;
use crate::stats::{Summary, median};
use crate::vk::PassTime;

/// Runs of each, after the warm-up.
const RUNS: usize = 30;
/// First uses compile on software drivers.
const WARM_UP: usize = 3;

/// Both frames' times, interleaved so that drift hits both alike.
#[derive(Clone, Debug)]
pub struct PlainComparison {
    /// Nanoseconds of GPU time.
    pub settled: Summary,
    /// Median of each pass of the settled frame.
    pub settled_passes: Vec<(String, f64)>,
    pub plain: Summary,
    pub empty_pass: Summary,
    /// Width and height of the plain texture.
    pub plain_size: [u32; 2],
    /// Settled over plain, of each turn.
    pub ratio: Summary,
}

fn total(passes: &[PassTime]) -> Option<f64> {
    passes.iter().map(|pass| pass.ns.map(|ns| ns as f64)).sum()
}

impl Session {
    /// Draws `pose` once more and waits for it and for its list: the frame after [`Session::settle`], with nothing to
    /// copy. [`Session::drain`] must have come before.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn again(&mut self, pose: &Pose) -> Result<Finished, SessionError> {
        // No copies: all tiles are resident, and the display table stands.
        self.pipeline.gather(&self.gpu, 0, |_| (Vec::new(), ()))?;
        let view = surface::view(pose, self.settings.size, self.bias);
        let mut frame = self.gpu.frame()?;
        self.pipeline.record(&mut frame, 0, &view, &self.target)?;
        self.pipeline.submitted(0, frame.submit()?);
        Ok(self.pipeline.finish(&self.gpu, 0)?.expect("the frame was just submitted"))
    }

    /// Measures the settled frame from `pose` against the plain one. `None` where the device keeps no time.
    ///
    /// # Errors
    /// Device lost, out of memory, a plain texture that cannot be read.
    pub fn compare_plain(&mut self, pose: &Pose) -> Result<Option<PlainComparison>, SessionError> {
        self.drain()?;
        let plain = Plain::new(&self.gpu, &*self.source, &self.target)?;
        let view = surface::view(pose, self.settings.size, self.bias);
        let (mut settled, mut plain_ns, mut empty) = (Vec::new(), Vec::new(), Vec::new());
        let mut passes: Vec<(String, Vec<f64>)> = Vec::new();
        for run in 0..WARM_UP + RUNS {
            let frame_times = self.again(pose)?.times;
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
        let summary = |times: &[f64]| Summary::of(times).expect("every run was timed");
        // The plain frame overwrote the picture: draw it again.
        self.frame(pose)?;
        self.drain()?;
        let ratio = Summary::of_pairs(&settled, &plain_ns, |settled, plain| settled / plain);
        Ok(ratio.map(|ratio| PlainComparison {
            settled: summary(&settled),
            settled_passes: passes
                .into_iter()
                .filter_map(|(label, times)| Some((label, median(&times)?)))
                .collect(),
            plain: summary(&plain_ns),
            empty_pass: summary(&empty),
            plain_size: plain.size(),
            ratio,
        }))
    }
}
