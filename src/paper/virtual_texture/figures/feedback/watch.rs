//! Draws stage 1 for successive poses; lists the exact tiles of each frame, and the tiles of every subsampling.

use super::super::common::{ViewSession, own_level_tiles};
use crate::frame::{DrawList, View};
use crate::math::camera::Pose;
use crate::math::pyramid::TileId;
use crate::paper::virtual_texture::TileAddress;
use crate::paper::virtual_texture::feedback::{Feedback, MAX_LOG2, Samples};
use crate::paper::virtual_texture::read_back::{HostCopy, HostList, HostPass};
use std::cell::RefCell;
use std::collections::BTreeMap;

/// n of the subsamplings: one pixel of 2^n.
pub const SUBSAMPLINGS: [u32; 7] = [2, 3, 4, 5, 6, 7, MAX_LOG2];

/// A subsampling's name, such as `1/64`.
pub fn name(n: u32) -> String {
    format!("1/{}", 1 << n)
}

/// A session that runs only stage 1, and the lists from its request image.
pub struct Watch {
    pub opened: ViewSession,
    pub copy: HostCopy,
    pub host: RefCell<HostList>,
    /// One for each of [`SUBSAMPLINGS`].
    pub subsamplings: Vec<Subsampling>,
}

pub struct Subsampling {
    pub n: u32,
    pub feedback: Feedback,
    pub samples: Samples,
}

impl Watch {
    /// # Errors
    /// Out of memory.
    pub fn new(opened: ViewSession) -> anyhow::Result<Watch> {
        let session = &opened.session;
        let (gpu, size) = (&session.gpu, session.technique.settings.size);
        let format = opened.stage1().format;
        let pyramid = &session.technique.source.pyramid();
        let subsampling = |n| {
            let feedback = Feedback::new(gpu, format, n)?;
            Ok(Subsampling { n, samples: feedback.samples(gpu, size)?, feedback })
        };
        Ok(Watch {
            copy: HostCopy::new(gpu, size, format)?,
            host: RefCell::new(HostList::new(HostPass::Bitmap, pyramid, format, TileAddress::OwnLevel)?),
            subsamplings: SUBSAMPLINGS.into_iter().map(subsampling).collect::<crate::vk::Result<_>>()?,
            opened,
        })
    }

    /// Draws stage 1 from `pose`; returns the exact list, with the number of pixels of each tile.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn look(&mut self, pose: &Pose) -> anyhow::Result<BTreeMap<TileId, u64>> {
        let session = &self.opened.session;
        let stage1 = self.opened.stage1();
        let seen = DrawList::new(&session.technique.shapes, View::new(pose, session.size()), 0);
        let mut frame = session.gpu.frame()?;
        frame.pass("footprint", |cmd| stage1.draw(cmd, &seen))?;
        frame.pass("copy request image", |cmd| self.copy.run(cmd, &stage1.requests))?;
        frame.submit()?.wait()?;
        let coverage = self.host.borrow().coverage(&self.copy.words());
        Ok(coverage
            .into_iter()
            .map(|([level, row, column], pixels)| (TileId { level, row, column }, pixels))
            .collect())
    }

    /// The sorted tiles that each of [`SUBSAMPLINGS`] samples from the picture that [`Watch::look`] drew.
    /// `frame_number` selects the sampled pixel of each block of 2^n pixels. Empty for subsamplings with n below
    /// `min`.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn sample(&mut self, frame_number: u64, min: u32) -> anyhow::Result<Vec<Vec<TileId>>> {
        let requests = &self.opened.stage1().requests;
        let taken = |subsampling: &&Subsampling| subsampling.n >= min;
        let mut frame = self.opened.session.gpu.frame()?;
        frame.pass("gather", |cmd| {
            let mut all = self.subsamplings.iter().filter(taken);
            all.try_for_each(|s| s.feedback.run(cmd, requests, &s.samples, frame_number))
        })?;
        frame.pass("feedback read-back", |cmd| {
            self.subsamplings.iter().filter(taken).for_each(|s| s.samples.read_back(cmd));
        })?;
        frame.submit()?.wait()?;
        let mut seen = Vec::new();
        for subsampling in &self.subsamplings {
            seen.push(match taken(&subsampling) {
                true => own_level_tiles(&self.host.borrow_mut().list(&subsampling.samples.words())),
                false => Vec::new(),
            });
        }
        Ok(seen)
    }
}
