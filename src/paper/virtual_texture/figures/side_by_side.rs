//! Whole frames of several variants in one view, on one device and one texture. They share the synthesised tiles.

pub use super::cost::{PLAIN, THE_PAPER, UNLISTED};

use super::super::counts::{Requests, TEXELS_PER_PIXEL, of_list};
use super::common::{MIB, SceneView, setting};
use super::cost::{self, FRAME, ON_THE_HOST};
use crate::figure::{Bench, Contender, Row, Setting, Timed};
use crate::frame::Run;
use crate::frame::{DrawList, FrameSlot, Shape, View};
use crate::math::camera::Pose;
use crate::model::mesh::{self, Mesh};
use crate::paper::virtual_texture::config::{Filter, open_texture, source_mesh};
use crate::paper::virtual_texture::fused::Fused;
use crate::paper::virtual_texture::list_passes::Stage3;
use crate::paper::virtual_texture::texturing::PlainBaseline;
use crate::paper::virtual_texture::{
    Again, Compaction, Config, Dedup, Listing, PAPER, RequestDraw, RequestFormat, TileAddress, all_needs,
};
use crate::paper::virtual_texture::{VirtualTexture, VirtualTextureSettings, lacks, texels_per_pixel};
use crate::picture::PixelFormat;
use crate::texture::source::TileSource;
use crate::texture::source::cached::CachedSource;
use crate::vk::{Gpu, PassTime};
use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

/// Name of the paper's frame with own-level tile addresses.
pub const PAPER_NATIVE: &str = "paper, own-level tile addresses";

/// A variant of the whole frame.
pub struct Combination {
    pub name: &'static str,
    pub config: Config,
    /// True if it lists exactly the visible tiles.
    pub exact: bool,
}

impl Combination {
    /// A variant that lists exactly the visible tiles.
    pub const fn exact(name: &'static str, config: Config) -> Combination {
        Combination { name, config, exact: true }
    }

    /// True if it makes an exact list on the device.
    pub fn is_ours(&self) -> bool {
        self.exact && self.config.list == Listing::Device
    }

    /// True if the host makes an exact list from the whole request image.
    pub fn is_read_back(&self) -> bool {
        self.exact && self.config.list != Listing::Device
    }
}

/// Packed triples, own-level tile addresses, and stages 2 and 3 in compute shaders that every device supports.
pub const COMPUTE: Config = Config {
    request_format: Some(RequestFormat::Packed),
    dedup: Dedup::TileMemo,
    compact: Compaction::Append,
    address: TileAddress::OwnLevel,
    ..PAPER
};

/// As [`COMPUTE`], but the texturing draw stores the triples.
pub const ONE_DRAW: Config = Config { request_draw: RequestDraw::Texturing, ..COMPUTE };

/// The frames that figures compare, the paper's first.
pub fn combinations() -> Vec<Combination> {
    let exact = Combination::exact;
    let superset = |name, config| Combination { name, config, exact: false };
    vec![
        exact(THE_PAPER, PAPER),
        exact(PAPER_NATIVE, Config { address: TileAddress::OwnLevel, ..PAPER }),
        exact("compute, tile-memo", COMPUTE),
        exact("compute, test-or", Config { dedup: Dedup::TestOr, ..COMPUTE }),
        exact("compute, runs", Config { dedup: Dedup::Runs, ..COMPUTE }),
        // One draw finds, marks and shows the tiles. Without the depth prepass, "fused" also lists hidden tiles.
        exact("fused, exact", Config { dedup: Dedup::FusedExact, ..COMPUTE }),
        exact(
            "fused, exact, appending",
            Config { dedup: Dedup::FusedExact, compact: Compaction::FusedAppend, ..COMPUTE },
        ),
        superset("fused", Config { dedup: Dedup::Fused, ..COMPUTE }),
        superset(
            "fused, appending",
            Config { dedup: Dedup::Fused, compact: Compaction::FusedAppend, ..COMPUTE },
        ),
        // One draw shows the tiles and stores the triples. Stages 2 and 3 follow.
        exact("one draw, runs", Config { dedup: Dedup::Runs, ..ONE_DRAW }),
        exact("one draw, mark-bytes", Config { dedup: Dedup::MarkBytes, ..ONE_DRAW }),
        // Read-back, the paper's baseline.
        exact("read-back, hash set", Config { list: Listing::HostHash, ..COMPUTE }),
        exact("read-back, bitmap", Config { list: Listing::HostBitmap, ..COMPUTE }),
        exact("one draw, read-back, bitmap", Config { list: Listing::HostBitmap, ..ONE_DRAW }),
    ]
}

/// The combinations as settings of a scene.
pub fn settings(combinations: &[Combination]) -> Vec<Setting> {
    combinations.iter().map(|combination| setting(combination.name, &combination.config)).collect()
}

/// Sessions of all combinations that the device can run.
pub struct SideBySide {
    pub gpu: Gpu,
    pub pose: Pose,
    pub source: Arc<CachedSource>,
    mesh: Mesh,
    /// Baselines without a list that are timed too: [`PLAIN`], [`UNLISTED`].
    floors: &'static [&'static str],
    pub sessions: Vec<(String, Run<VirtualTexture>)>,
    /// The variants that do not run here, and why.
    pub missing: Vec<(String, String)>,
}

impl SideBySide {
    /// Settled sessions of `combinations` at `size` pixels. `floors` names the baselines that are timed with them
    /// ([`PLAIN`], [`UNLISTED`]). `change` edits the settings last; it must not change the variant.
    ///
    /// # Errors
    /// No device, a scene or texture that is not available, out of memory.
    pub fn settled(
        bench: &Bench,
        place: SceneView,
        size: [u32; 2],
        (combinations, floors): (&[Combination], &'static [&'static str]),
        change: impl Fn(&mut VirtualTextureSettings),
    ) -> anyhow::Result<SideBySide> {
        let SceneView { scene, pose, .. } = place;
        let gpu = bench.gpu_with_offered(&all_needs())?;
        let source = CachedSource::new(open_texture(&scene)?);
        let mesh = mesh::gpu_mesh(&source_mesh(&scene)?);
        let open = |config: Config| -> anyhow::Result<Run<VirtualTexture>> {
            let mut settings = VirtualTextureSettings::of_scene(&scene, PixelFormat::Srgb8)?;
            (settings.size, settings.config) = (size, config);
            // Settling is not timed: upload as many tiles per frame as staging memory allows.
            settings.streaming.deterministic = true;
            settings.streaming.upload_tiles_per_frame = 32;
            settings.streaming.load_tiles_per_frame = 32;
            change(&mut settings);
            let mut session = VirtualTexture::run(gpu.clone(), source.clone(), &mesh, settings)?;
            session.settle(&pose)?;
            session.drain()?;
            Ok(session)
        };
        let (mut sessions, mut missing) = (Vec::new(), Vec::new());
        for Combination { name, config, .. } in combinations {
            match lacks(&gpu, config, &source.pyramid(), source.format()) {
                Some(why) => missing.push((name.to_string(), why)),
                None => sessions.push((name.to_string(), open(*config)?)),
            }
        }
        Ok(SideBySide { gpu, pose, source, mesh, floors, sessions, missing })
    }

    /// The times, the lists and the counts of all variants: the rows "frame" and each pass, in milliseconds, then the
    /// rows of `lists` and `counts`.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn rows(&mut self, bench: &Bench) -> anyhow::Result<Vec<Row>> {
        let (timed, counts) = (self.times(bench)?, self.counts()?);
        let times = timed.iter().flat_map(|of| cost::rows(of, &timed)).chain(self.missing_rows(FRAME));
        Ok(times.chain(self.lists()).chain(counts).collect())
    }

    /// Times all frames and the floors in turn.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn times(&mut self, bench: &Bench) -> anyhow::Result<Vec<Timed>> {
        let gpu = self.gpu.clone();
        bench.interleave(&gpu, self.contenders()?)
    }

    /// A row of `quantity` for each variant that does not run here.
    pub fn missing_rows(&self, quantity: &str) -> impl Iterator<Item = Row> {
        self.missing.iter().map(move |(name, why)| Row::missing(&**name, quantity, &**why))
    }

    /// A new session with the settings of session number `at`, settled at `pose` from empty caches.
    ///
    /// # Errors
    /// As [`SideBySide::settled`].
    pub fn afresh(&self, at: usize, pose: &Pose) -> anyhow::Result<Run<VirtualTexture>> {
        let settings = self.sessions[at].1.technique.settings.clone();
        let mut session = VirtualTexture::run(self.gpu.clone(), self.source.clone(), &self.mesh, settings)?;
        session.settle(pose)?;
        session.drain()?;
        Ok(session)
    }

    /// A contender for each session and each floor, which draws its settled frame once more.
    ///
    /// # Errors
    /// Out of memory.
    pub fn contenders(&mut self) -> anyhow::Result<Vec<Contender<'_>>> {
        let (gpu, pose) = (&self.gpu, self.pose);
        let mut contenders: Vec<Contender> = Vec::new();
        if self.floors.contains(&PLAIN)
            && let Some((_, session)) = self.sessions.first()
        {
            contenders.push(plain_frame(gpu, session, &self.mesh, &pose)?);
        }
        // The unlisted frame uses the tiles of the first session of a fused variant; this is safe because they take
        // turns.
        let mut unlisted = self.floors.contains(&UNLISTED);
        for (name, session) in &mut self.sessions {
            let session = Rc::new(RefCell::new(session));
            if session.borrow().technique.settings.config.fused() && std::mem::take(&mut unlisted) {
                contenders.push(unlisted_frame(gpu, session.clone(), &pose)?);
            }
            contenders.push(Contender::new(&**name, move || {
                let Again { mut times, host_time, .. } = session.borrow_mut().again(&pose)?;
                times.push(PassTime::new(ON_THE_HOST, Some(host_time.as_nanos() as u64)));
                Ok(times)
            }));
        }
        Ok(contenders)
    }

    /// Rows "list length" and "visible tiles" of each session's last frame.
    fn lists(&self) -> Vec<Row> {
        let mut rows = Vec::new();
        for (name, session) in &self.sessions {
            let Some(record) = session.records.last() else { continue };
            let count = |quantity, count: usize, unit| Row::number(&**name, quantity, unit, count as f64);
            rows.push(count("list length", record.triples, "triples"));
            rows.push(count("visible tiles", record.visible.len(), "tiles"));
        }
        rows
    }

    /// A row [`TEXELS_PER_PIXEL`] for each session.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn texels(&mut self) -> anyhow::Result<Vec<Row>> {
        let of = |(name, session): &mut (String, Run<VirtualTexture>)| {
            let filter = session.technique.settings.config.filter;
            let texels = texels_per_pixel(&session.texels_fetched(&filter)?);
            Ok(Row::number(&**name, TEXELS_PER_PIXEL, "texels", texels))
        };
        self.sessions.iter_mut().map(of).collect()
    }

    /// [`SideBySide::texels`], and the counts of each session's list.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn counts(&mut self) -> anyhow::Result<Vec<Row>> {
        let (mut rows, pyramid) = (self.texels()?, self.source.pyramid());
        for (name, session) in &mut self.sessions {
            let triples = session.requests()?;
            let VirtualTexture { settings, .. } = &session.technique;
            let requests = Requests { triples: &triples, size: settings.size, pyramid: &pyramid };
            rows.extend(of_list(&self.gpu, (name, &settings.config), &requests, session.technique.stage1())?);
        }
        Ok(rows)
    }
}

/// A session's device memory, in MiB.
pub fn device_mib(session: &Run<VirtualTexture>) -> f64 {
    let memory = session.memory();
    let on_device = memory.iter().filter(|(object, _)| !object.contains("host"));
    on_device.map(|(_, bytes)| *bytes as f64 / MIB).sum()
}

/// The plain frame, drawn into a picture of its own.
fn plain_frame<'a>(
    gpu: &'a Gpu,
    session: &Run<VirtualTexture>,
    mesh: &Mesh,
    pose: &Pose,
) -> anyhow::Result<Contender<'a>> {
    let target = gpu.image("plain picture", *session.target().color.info())?;
    let plain = PlainBaseline::new(gpu, &*session.technique.source, &target, &Filter::ONE_SAMPLE)?;
    let shape = Shape::new(gpu, mesh)?;
    let view = View::new(pose, session.size());
    Ok(Contender::frame(gpu, PLAIN, move |frame| {
        frame.pass("plain", |cmd| plain.draw(cmd, &DrawList::new([&shape], view, 0), &target))
    }))
}

/// The frame of a fused session without its list, drawn into the session's picture.
fn unlisted_frame<'a>(
    gpu: &'a Gpu,
    session: Rc<RefCell<&'a mut Run<VirtualTexture>>>,
    pose: &Pose,
) -> anyhow::Result<Contender<'a>> {
    let of = session.borrow();
    let VirtualTexture { settings, source, resident, .. } = &of.technique;
    let (config, pyramid) = (&settings.config, source.pyramid());
    let draw = Fused::unlisted(gpu, &pyramid, config, resident, (of.target().color.info().format, None))?;
    // The shader declares a list, so one is bound. This draw never writes it.
    let unwritten = Stage3::new(gpu, &pyramid, config)?;
    let view = View::new(pose, of.size());
    drop(of);
    Ok(Contender::frame(gpu, UNLISTED, move |frame| {
        let session = session.borrow();
        let (texture, target) = (&session.technique, session.target());
        let (seen, images) = (texture.seen(view), (&*target.color, &*target.depth));
        let list = unwritten.list(FrameSlot::FIRST);
        frame.pass("upload", |_| ())?;
        frame.pass("fused", |cmd| draw.draw(cmd, &texture.resident, &seen, list, images))
    }))
}
