//! The methods that are timed: those of scenes, and a copy of all live faces.

use super::{DEVICE, HOST, Meshes};
use crate::figure::{Contender, Setting};
use crate::frame::Run;
use crate::paper::progressive_mesh::ProgressiveMeshes;
use crate::paper::progressive_mesh::choices::{Apply, FaceOrder};
use crate::paper::progressive_mesh::figures::session_of;
use crate::paper::progressive_mesh::run::{IgnoreWrites, Program};
use crate::vk::{Buffer, BufferUse, Gpu, PassTime};
use std::cell::RefCell;
use std::time::Instant;

/// A method and its name.
pub struct WriteMethod {
    pub name: &'static str,
    /// `None` for the copy.
    pub order: Option<FaceOrder>,
    pub by: By,
}

/// How the index buffer is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum By {
    /// As in a scene with this setting.
    Scene(Apply),
    /// A copy of all live faces.
    Copy,
}

const fn of_scene(order: FaceOrder) -> WriteMethod {
    WriteMethod { name: order.name(), order: Some(order), by: By::Scene(Apply::Cpu) }
}

pub const MAPPED: &str = "tail-23, mapped";
pub const ON_DEVICE: &str = "tail-23, on the device";
pub const IN_PLACE_ON_DEVICE: &str = "in-place-23, on the device";
pub const COMPACTED: &str = FaceOrder::Compacted.name();
pub const SKIP_LISTS: &str = FaceOrder::SkipLists.name();
pub const COPY: &str = "copy of the live faces";

/// The methods in the report's order.
pub const WAYS: [WriteMethod; 12] = [
    of_scene(FaceOrder::Classical),
    of_scene(FaceOrder::Tail23),
    WriteMethod { name: MAPPED, order: Some(FaceOrder::Tail23), by: By::Scene(Apply::Mapped) },
    WriteMethod { name: ON_DEVICE, order: Some(FaceOrder::Tail23), by: By::Scene(Apply::Gpu) },
    of_scene(FaceOrder::InPlace23),
    WriteMethod { name: IN_PLACE_ON_DEVICE, order: Some(FaceOrder::InPlace23), by: By::Scene(Apply::Gpu) },
    of_scene(FaceOrder::Random),
    of_scene(FaceOrder::ReOptimised),
    of_scene(FaceOrder::Compacted),
    of_scene(FaceOrder::SkipLists),
    of_scene(FaceOrder::Discrete),
    WriteMethod { name: COPY, order: None, by: By::Copy },
];

/// The methods that are settings of the scene `bunny`.
pub fn settings() -> Vec<Setting> {
    let setting = |way: &WriteMethod| {
        let By::Scene(apply) = way.by else { return None };
        let keys = [("order", way.order?.name()), ("apply", apply.name())];
        Some(Setting::new(way.name, keys.map(|(key, value)| format!("surface.bunny.geometry.{key}={value}"))))
    };
    WAYS.iter().filter_map(setting).collect()
}

/// A method on the device, and the levels of its walk.
pub struct DeviceWalk<'a> {
    pub name: &'static str,
    gpu: &'a Gpu,
    runs: Runs<'a>,
    levels: &'a [u32],
    /// True at the first of `levels`, false at the last.
    up: bool,
}

enum Runs<'a> {
    Scene(Box<Run<ProgressiveMeshes>>),
    Copy(Box<Copying<'a>>),
}

struct Copying<'a> {
    program: &'a Program,
    /// Faces as the index buffer has them.
    packed: Vec<u8>,
    staging: Buffer,
    indices: Buffer,
}

impl<'a> DeviceWalk<'a> {
    /// A method at the first of `levels`.
    pub fn open(
        gpu: &'a Gpu,
        named: &WriteMethod,
        meshes: &'a Meshes,
        levels: &'a [u32],
    ) -> anyhow::Result<DeviceWalk<'a>> {
        let runs = match named.by {
            By::Scene(apply) => {
                let order = named.order.expect("a scene has an order");
                let mesh = &meshes.in_order(order).mesh;
                // Nothing is drawn.
                Runs::Scene(Box::new(session_of(gpu, mesh, [64, 36], |surface| {
                    (surface.order, surface.apply, surface.instances) = (order, apply, 1);
                })?))
            }
            By::Copy => {
                let program = &meshes.tail.program;
                let index = program.index_type();
                let packed = index.packed(program.faces().as_flattened());
                let staging = gpu.buffer("staging", packed.len() as u64, BufferUse::Upload)?;
                let indices = gpu.buffer("indices", packed.len() as u64, BufferUse::Indices(index))?;
                Runs::Copy(Box::new(Copying { program, packed, staging, indices }))
            }
        };
        let mut way = DeviceWalk { name: named.name, gpu, runs, levels, up: true };
        way.go_to(levels[0])?;
        Ok(way)
    }

    pub fn contender(way: &'a RefCell<DeviceWalk<'a>>) -> Contender<'a> {
        let name = way.borrow().name;
        Contender::new(name, move || Ok(way.borrow_mut().walk()?.0))
    }

    /// Bytes that the host uploads for one walk up and down, after the slices have been allocated.
    pub fn sent(&mut self) -> anyhow::Result<u64> {
        // The first walk up and down allocates the slices.
        self.walk()?;
        self.walk()?;
        Ok(self.walk()?.1 + self.walk()?.1)
    }

    /// Number of indices in the device's buffer that differ from those of a fresh execution on the host; `None` for a
    /// baseline, whose faces have another order.
    pub fn wrong(&mut self) -> anyhow::Result<Option<usize>> {
        let Runs::Scene(session) = &mut self.runs else { return Ok(None) };
        session.drain()?;
        let surface = &session.technique.surfaces[0];
        if surface.settings.order.is_baseline() {
            return Ok(None);
        }
        let (_, level) = surface.instances().next().expect("one instance");
        let (program, mut expected) = (&surface.program, surface.program.faces().to_vec());
        program.run(&mut expected, 0, level, &mut Vec::new(), &mut IgnoreWrites);
        let packed = program.index_type().packed(expected.as_flattened());
        let face_bytes = program.index_type().triangle_bytes();
        let expected = &packed[..face_bytes as usize * program.drawn(level) as usize];
        let indices = &surface.indices;
        let found: Vec<u8> = match surface.settings.apply {
            Apply::Mapped => indices.mapped().to_vec(),
            Apply::Cpu | Apply::Gpu => self.gpu.read_buffer(indices)?,
        };
        let first = (face_bytes * u64::from(surface.first_face(0))) as usize;
        Ok(Some(different_indices(&found[first..], expected, program.index_type().bytes() as usize)))
    }

    /// Walks through all levels, alternately up and down. Returns the host and device time of each change,
    /// and the bytes sent.
    fn walk(&mut self) -> anyhow::Result<(Vec<PassTime>, u64)> {
        let mut levels = self.levels.to_vec();
        if !self.up {
            levels.reverse();
        }
        self.up = !self.up;
        let (mut passes, mut sent) = (Vec::new(), 0);
        for &level in &levels[1..] {
            let (host, device, bytes) = self.go_to(level)?;
            sent += bytes;
            passes.extend([PassTime::new(HOST, Some(host)), PassTime::new(DEVICE, device)]);
        }
        Ok((passes, sent))
    }

    /// Changes the level. Returns the host's and the device's time in nanoseconds, and the bytes sent.
    fn go_to(&mut self, to: u32) -> anyhow::Result<(u64, Option<u64>, u64)> {
        let start = Instant::now();
        let nanoseconds = || start.elapsed().as_nanos() as u64;
        let sum = |passes: &[PassTime]| passes.iter().map(|pass| pass.ns).sum::<Option<u64>>();
        match &mut self.runs {
            Runs::Scene(session) => {
                session.change_level(0, to)?;
                let host = nanoseconds();
                session.drain()?;
                let record = session.records.take().pop().expect("the frame that was drained");
                Ok((host, sum(&record.passes), record.change.upload_bytes))
            }
            Runs::Copy(copying) => {
                let Copying { program, packed, staging, indices } = &mut **copying;
                let bytes = program.index_type().triangle_bytes() as usize * program.drawn(to) as usize;
                staging.mapped_mut()[..bytes].copy_from_slice(&packed[..bytes]);
                let mut frame = self.gpu.frame()?;
                frame.pass("levels", |cmd| cmd.copy_buffer(staging, 0, indices, 0, bytes as u64))?;
                let ticket = frame.submit()?;
                Ok((nanoseconds(), sum(&ticket.wait()?), bytes as u64))
            }
        }
    }
}

/// Number of indices in `expected`, of `bytes` bytes each, that are missing in `found` or differ there.
fn different_indices(found: &[u8], expected: &[u8], bytes: usize) -> usize {
    let pairs = found.chunks_exact(bytes).zip(expected.chunks_exact(bytes));
    expected.len() / bytes - pairs.filter(|(a, b)| a == b).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_changed_or_missing_index_is_counted() {
        let expected = [1, 0, 2, 0, 3, 0];
        assert_eq!(different_indices(&[1, 0, 2, 0, 3, 0, 9, 9], &expected, 2), 0);
        assert_eq!(different_indices(&[1, 0, 2, 1, 3, 0], &expected, 2), 1);
        assert_eq!(different_indices(&[1, 0], &expected, 2), 2);
    }
}
