//! The paper's frame: uploads, stage 1, 2, 3, read-back, texturing, over one mesh and one texture. Where the variant is
//! fused, one draw stands for stages 1 and 2 and for texturing.
//!
//! The list of frame n is used in frame n + [`FRAMES_IN_FLIGHT`]: the host never waits for a frame that it has
//! just handed over.

use super::{
    Config, fade::FadeIn, footprint::Footprint, fused::Fused, lister::Listed, lister::Lister,
    resident::Resident, resident::ResidentError, resident::Uploads, streaming::Uploader, surface::Surface,
    texturing::Texturing,
};
use crate::math::pyramid::TileId;
use crate::model::mesh::Mesh;
use crate::texture::source::TileSource;
use crate::vk::shader::View;
use crate::vk::{FRAMES_IN_FLIGHT, Frame, Gpu, Image, PassTime, Result, Ticket};
use std::time::{Duration, Instant};

/// Everything that a frame of paper 1 needs on the device.
pub struct Pipeline {
    drawing: Drawing,
    /// Stages 2 and 3, or what stands for them.
    pub lister: Lister,
    pub resident: Resident,
    pub surface: Surface,
    fade: FadeIn,
    flights: Vec<Flight>,
}

/// How the picture comes about.
enum Drawing {
    /// Stage 1 and, after the list, texturing from `U1`.
    Staged(Box<Footprint>, Texturing),
    Fused(Box<Fused>),
}

/// What each frame in flight has for itself.
struct Flight {
    listed: Listed,
    uploads: Uploads,
    ticket: Option<Ticket>,
}

/// What a frame found out, once it has ended.
pub struct Finished {
    /// `U3`: (q, i, j) in the keying's grid, in the order of whoever made it.
    pub triples: Vec<[u32; 3]>,
    /// `U3` was too short, and stage 3 ran twice.
    pub overflowed: bool,
    pub times: Vec<PassTime>,
    /// The host's time to get or make the list.
    pub host_time: Duration,
}

/// A frame's copies into video memory, as [`super::streaming::Streaming`] asks for them.
struct Copies<'a>(&'a mut Uploads);

impl Uploader for Copies<'_> {
    fn upload(&mut self, slot: u32, _: TileId, bytes: &[u8]) -> bool {
        self.0.tile(slot, bytes)
    }
}

impl Drawing {
    fn stage1(&self) -> Option<&Footprint> {
        match self {
            Drawing::Staged(stage1, _) => Some(stage1),
            Drawing::Fused(_) => None,
        }
    }
}

impl Pipeline {
    /// `gpu_tiles` is N1; `most_uploads` bounds the tiles copied in one frame.
    ///
    /// # Errors
    /// A format, a limit or memory that the device lacks; `G1` that cannot be read.
    pub fn new(
        gpu: &Gpu,
        source: &dyn TileSource,
        mesh: &Mesh,
        config: &Config,
        target: &Image,
        [gpu_tiles, most_uploads]: [u32; 2],
    ) -> std::result::Result<Pipeline, ResidentError> {
        let pyramid = source.pyramid();
        let resident = Resident::new(gpu, source, gpu_tiles)?;
        let drawing = if config.fused() {
            Drawing::Fused(Box::new(Fused::new(gpu, &pyramid, config, &resident, target)?))
        } else {
            let stage1 = Footprint::new(gpu, &pyramid, config, target.info().size)?;
            let format = target.info().format;
            let texturing = Texturing::new(gpu, &pyramid, config, &stage1, &resident, format)?;
            Drawing::Staged(Box::new(stage1), texturing)
        };
        let lister = Lister::new(gpu, &pyramid, config, drawing.stage1())?;
        let flights = (0..FRAMES_IN_FLIGHT)
            .map(|_| {
                Ok(Flight {
                    listed: lister.listed(gpu, drawing.stage1())?,
                    uploads: resident.uploads(gpu, most_uploads)?,
                    ticket: None,
                })
            })
            .collect::<Result<_>>()?;
        Ok(Pipeline {
            surface: match config.draws_depth_alone() {
                true => Surface::with_positions(gpu, mesh)?,
                false => Surface::new(gpu, mesh)?,
            },
            fade: FadeIn::new(config.fade_in_frames),
            drawing,
            lister,
            resident,
            flights,
        })
    }

    /// Stage 1; a fused variant has none.
    pub fn stage1(&self) -> Option<&Footprint> {
        self.drawing.stage1()
    }

    /// Waits for the frame that used place `flight` last, and takes what it found out.
    ///
    /// # Errors
    /// Device lost.
    pub fn finish(&mut self, gpu: &Gpu, flight: usize) -> Result<Option<Finished>> {
        let flight = &mut self.flights[flight];
        let Some(ticket) = flight.ticket.take() else { return Ok(None) };
        let times = ticket.wait()?;
        let start = Instant::now();
        let (triples, overflowed) = self.lister.collect(gpu, &mut flight.listed)?;
        Ok(Some(Finished { triples, overflowed, times, host_time: start.elapsed() }))
    }

    /// Gathers this frame's copies: `gather` gets the uploader, and returns the changes of the display table with
    /// whatever else it has to say.
    ///
    /// # Errors
    /// Out of memory.
    pub fn gather<T>(
        &mut self,
        gpu: &Gpu,
        flight: usize,
        gather: impl FnOnce(&mut dyn Uploader) -> (Vec<(TileId, Option<u32>)>, T),
    ) -> Result<T> {
        let uploads = &mut self.flights[flight].uploads;
        uploads.clear();
        let (display, rest) = gather(&mut Copies(uploads));
        uploads.show(gpu, &mut self.resident.display, &self.fade.cells(&display))?;
        Ok(rest)
    }

    /// Records the frame's passes; hand the frame's ticket to [`Pipeline::submitted`].
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(&self, frame: &mut Frame<'_>, flight: usize, view: &View, target: &Image) -> Result<()> {
        let Flight { listed, uploads, .. } = &self.flights[flight];
        frame.pass("upload", |cmd| {
            self.resident.copy(cmd, uploads);
            Ok(())
        })?;
        let Pipeline { resident, surface, .. } = self;
        match &self.drawing {
            Drawing::Staged(stage1, texturing) => {
                frame.pass("footprint", |cmd| stage1.draw(cmd, surface, view))?;
                self.lister.record(frame, Some(&stage1.u1), listed)?;
                frame.pass("texturing", |cmd| texturing.draw(cmd, stage1, resident, surface, view, target))
            }
            Drawing::Fused(fused) => {
                let into = listed.on_the_device().expect("a fused variant's list is the device's");
                frame.pass("fused", |cmd| fused.draw(cmd, resident, surface, into, view, target))?;
                self.lister.record(frame, None, listed)
            }
        }
    }

    /// Labels of the frame's passes, in order.
    pub fn passes(&self) -> Vec<&'static str> {
        let (before, after): (&[_], &[_]) = match self.drawing {
            Drawing::Staged(..) => (&["upload", "footprint"], &["texturing"]),
            Drawing::Fused(_) => (&["upload", "fused"], &[]),
        };
        before.iter().copied().chain(self.lister.passes()).chain(after.iter().copied()).collect()
    }

    /// Whether every tile that has arrived is shown in full.
    pub fn faded_in(&self) -> bool {
        self.fade.settled()
    }

    /// Remembers the frame that was recorded for place `flight`.
    pub fn submitted(&mut self, flight: usize, ticket: Ticket) {
        self.flights[flight].ticket = Some(ticket);
    }

    /// (name, bytes) of everything that this paper's frame needs, the target apart; on the device where the name
    /// does not say otherwise.
    pub fn memory(&self) -> Vec<(&'static str, u64)> {
        let [j1, g1, h1] = self.resident.bytes();
        let mut memory = match &self.drawing {
            Drawing::Staged(stage1, _) => vec![("U1", stage1.u1.bytes()), ("depth", stage1.depth.bytes())],
            Drawing::Fused(fused) => vec![("depth", fused.bytes())],
        };
        // Each frame in flight has the same.
        let lists = self.flights[0].listed.memory();
        memory.extend(lists.into_iter().map(|(name, bytes)| (name, FRAMES_IN_FLIGHT as u64 * bytes)));
        memory.extend([
            ("staging on the host", self.flights.iter().map(|f| f.uploads.bytes()).sum()),
            ("J1", j1),
            ("G1", g1),
            ("H1", h1),
            ("mesh", self.surface.bytes()),
        ]);
        memory
    }
}
