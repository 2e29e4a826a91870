//! Five methods to transfer a level change to the device's index buffer.

use super::execute::hundredth;
use crate::figure::{Contender, Row};
use crate::paper::progressive_mesh::apply::{Apply, Change, ChangedSlots, Scatter};
use crate::paper::progressive_mesh::run::{DirtyBlocks, IgnoreWrites, Program};
use crate::vk::{Buffer, BufferUse, Cmd, Gpu, IndexType, PassTime};
use std::cell::RefCell;
use std::time::Instant;

pub const WHOLE: &str = "live faces, staged";
pub const RANGES: &str = "touched ranges, staged";
pub const MAPPED: &str = "written where the device reads";
pub const SCATTER: &str = "changed faces, scattered";
pub const DEVICE: &str = "executed on the device";

/// The methods in the report's order.
pub const WAYS: [&str; 5] = [WHOLE, RANGES, MAPPED, SCATTER, DEVICE];

pub const SENT: &str = "bytes sent for each split";
pub const WRONG: &str = "words that are not the host's";
pub const HOST: &str = "host's share of ten frames";
pub const BOTH: &str = "ten frames";

const PASSES: [&str; 2] = ["host", "device"];

/// The first level of the walk, in hundredths of the splits. The walk goes from 45 to 55, one hundredth per
/// frame; with groups that grow by a tenth it meets one or two permutations.
const FIRST: u32 = 45;
const FRAMES: u32 = 10;

/// One method, with its own copy of the index buffer.
pub struct Sender<'a> {
    program: &'a Program,
    way: Way,
    /// The index buffer on the device.
    indices: Buffer,
    /// The index buffer on the host. Unused if the device executes, or if the host writes into `indices`.
    faces: Vec<[u32; 3]>,
    staging: Buffer,
    kept: Vec<[u32; 3]>,
    level: u32,
    /// Bytes sent so far, and the number of splits or collapses.
    sent: [u64; 2],
}

enum Way {
    Whole,
    Ranges(DirtyBlocks),
    Mapped,
    Scatter(Box<Scattering>),
    Device(Box<Apply>),
}

/// The changed faces to scatter, on the host and on the device.
struct Scattering {
    scatter: Scatter,
    changed: ChangedSlots,
    list: Buffer,
}

impl<'a> Sender<'a> {
    /// All methods at the first level of the walk.
    pub fn all(gpu: &Gpu, program: &'a Program) -> anyhow::Result<Vec<Sender<'a>>> {
        let slots = program.faces().len();
        let scattering = Scattering {
            scatter: Scatter::new(gpu, IndexType::U32)?,
            changed: ChangedSlots::new(slots),
            list: gpu.buffer("changed faces", 16 * slots as u64, BufferUse::Storage)?,
        };
        let ways = [
            Way::Whole,
            Way::Ranges(DirtyBlocks::new(slots)),
            Way::Mapped,
            Way::Scatter(Box::new(scattering)),
            Way::Device(Box::new(Apply::new(gpu, program, IndexType::U32)?)),
        ];
        ways.into_iter().map(|way| Sender::new(gpu, program, way)).collect()
    }

    fn new(gpu: &Gpu, program: &'a Program, way: Way) -> anyhow::Result<Sender<'a>> {
        let (mut faces, mut kept) = (program.faces().to_vec(), Vec::new());
        let level = hundredth(program.last_level(), FIRST);
        program.run(&mut faces, 0, level, &mut kept, &mut IgnoreWrites);
        let indices = match way {
            Way::Mapped => {
                let bytes = size_of_val(&*faces) as u64;
                let mut indices =
                    gpu.buffer("mapped indices", bytes, BufferUse::MappedIndices(IndexType::U32))?;
                indices.mapped_mut().copy_from_slice(bytemuck::cast_slice(&faces));
                indices
            }
            _ => {
                gpu.buffer_with("indices", faces.as_flattened(), BufferUse::WritableIndices(IndexType::U32))?
            }
        };
        let staging = gpu.buffer("staging", 16 * faces.len() as u64, BufferUse::Upload)?;
        Ok(Sender { program, way, indices, faces, staging, kept, level, sent: [0; 2] })
    }

    /// Executes a level change, and records its transfer to the device.
    fn go_to(&mut self, cmd: &mut Cmd<'_>, level: u32) -> crate::vk::Result<()> {
        let Sender { program, way, indices, faces, staging, kept, .. } = self;
        let before = std::mem::replace(&mut self.level, level);
        let sent = match way {
            Way::Whole => {
                program.run(faces, before, level, kept, &mut IgnoreWrites);
                let live = &faces[..program.drawn(level) as usize];
                staging.mapped_mut()[..size_of_val(live)].copy_from_slice(bytemuck::cast_slice(live));
                cmd.copy_buffer(staging, 0, indices, 0, size_of_val(live) as u64);
                size_of_val(live) as u64
            }
            Way::Ranges(touched) => {
                program.run(faces, before, level, kept, touched);
                let (words, mut end, mut ranges) = (faces.as_flattened(), 0, Vec::new());
                for range in touched.take() {
                    let bytes: &[u8] = bytemuck::cast_slice(&words[range.clone()]);
                    staging.mapped_mut()[end..end + bytes.len()].copy_from_slice(bytes);
                    ranges.push([end as u64, 4 * range.start as u64, bytes.len() as u64]);
                    end += bytes.len();
                }
                cmd.copy_ranges(staging, indices, &ranges);
                end as u64
            }
            Way::Mapped => {
                let faces: &mut [[u32; 3]] = bytemuck::cast_slice_mut(indices.mapped_mut());
                program.run(faces, before, level, kept, &mut IgnoreWrites);
                0
            }
            Way::Scatter(scattering) => {
                let Scattering { scatter, changed, list } = &mut **scattering;
                program.run(faces, before, level, kept, changed);
                let changes = changed.take(faces);
                let bytes: &[u8] = bytemuck::cast_slice(&changes);
                staging.mapped_mut()[..bytes.len()].copy_from_slice(bytes);
                cmd.copy_buffer(staging, 0, list, 0, bytes.len() as u64);
                cmd.sync();
                scatter.run(cmd, list, changes.len() as u32, indices, 0)?;
                bytes.len() as u64
            }
            Way::Device(apply) => {
                let change = Change { first_slot: 0, from: before, to: level };
                apply.run(cmd, program, indices, &[change])?;
                0
            }
        };
        self.sent[0] += sent;
        self.sent[1] += u64::from(before.abs_diff(level));
        Ok(())
    }

    /// Ten frames up, or ten frames down if the last walk went up.
    fn walk(&mut self, gpu: &Gpu) -> anyhow::Result<Vec<PassTime>> {
        let last = self.program.last_level();
        let mut hundredths: Vec<u32> = (FIRST..=FIRST + FRAMES).collect();
        if self.level != hundredth(last, FIRST) {
            hundredths.reverse();
        }
        let (mut host, mut device) = (0, Some(0));
        for n in &hundredths[1..] {
            let start = Instant::now();
            let mut frame = gpu.frame()?;
            frame.pass("levels", |cmd| self.go_to(cmd, hundredth(last, *n)))?;
            let ticket = frame.submit()?;
            host += start.elapsed().as_nanos() as u64;
            device = ticket.wait()?.iter().fold(device, |sum, pass| Some(sum? + pass.ns?));
        }
        let pass = |label: &str, ns| PassTime { label: label.into(), ns, work: None };
        Ok(vec![pass(PASSES[0], Some(host)), pass(PASSES[1], device)])
    }

    /// The number of words in the device's buffer that differ from a fresh execution.
    fn wrong_words(&self, gpu: &Gpu) -> anyhow::Result<usize> {
        let (mut expected, mut kept) = (self.program.faces().to_vec(), Vec::new());
        self.program.run(&mut expected, 0, self.level, &mut kept, &mut IgnoreWrites);
        let host;
        let bytes = match self.way {
            Way::Mapped => self.indices.mapped(),
            _ => {
                host = read_back(gpu, &self.indices)?;
                host.mapped()
            }
        };
        let words: &[u32] = bytemuck::cast_slice(bytes);
        // Transfers of the live faces do not update the other faces.
        let live = 3 * self.program.drawn(self.level) as usize;
        Ok(words[..live].iter().zip(&expected.as_flattened()[..live]).filter(|(a, b)| a != b).count())
    }
}

fn read_back(gpu: &Gpu, buffer: &Buffer) -> anyhow::Result<Buffer> {
    let host = gpu.buffer("read-back", buffer.bytes(), BufferUse::Readback)?;
    let mut frame = gpu.frame()?;
    frame.pass("read-back", |cmd| {
        cmd.copy_buffer(buffer, 0, &host, 0, buffer.bytes());
        Ok(())
    })?;
    frame.submit()?.wait()?;
    Ok(host)
}

/// The methods in the order of [`WAYS`].
pub fn contenders<'s>(gpu: &'s Gpu, senders: &'s [RefCell<Sender<'_>>]) -> Vec<Contender<'s>> {
    let contender = |(name, sender): (&&str, &'s RefCell<Sender<'_>>)| Contender {
        variant: name.to_string(),
        run: Box::new(move || sender.borrow_mut().walk(gpu)),
    };
    WAYS.iter().zip(senders).map(contender).collect()
}

/// Rows of the bytes sent, and of correctness.
pub fn count_rows(gpu: &Gpu, senders: &[RefCell<Sender<'_>>]) -> anyhow::Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (name, sender) in WAYS.iter().zip(senders) {
        let sender = sender.borrow();
        let [bytes, splits] = sender.sent;
        let wrong = sender.wrong_words(gpu)?;
        rows.push(Row::number(*name, WRONG, "words", wrong as f64));
        rows.push(Row::number(*name, SENT, "bytes", bytes as f64 / splits as f64));
    }
    Ok(rows)
}

/// Rows of times: the host's part, and the total.
pub fn time_rows(timed: &[crate::figure::Timed]) -> Vec<Row> {
    let mut rows = Vec::new();
    for one in timed.iter().filter(|one| WAYS.contains(&&*one.variant)) {
        rows.push(Row::of_rounds(&one.variant, HOST, "ms", one.pass_of_rounds(PASSES[0])));
        rows.push(one.row(BOTH));
    }
    rows
}
