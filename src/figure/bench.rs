//! What a figure measures with.

use super::{Effort, Row};
use crate::picture::write::{Srgb8Picture, write_png};
use crate::stats::Summary;
use crate::vk::{Feature, Gpu, GpuOptions, Message, Need, PassTime};
use std::cell::RefCell;
use std::path::PathBuf;

/// First uses compile on software drivers.
const WARM_UP: usize = 2;

/// Device, effort and folder of a run.
pub struct Bench {
    pub effort: Effort,
    /// Part of a device's name, or its index.
    pub device: Option<String>,
    /// Where [`Bench::picture`] writes.
    pub pictures: PathBuf,
    /// Files that this cell wrote there.
    pub written: Vec<String>,
    /// Devices are opened with the validation layer, and a message of it fails the cell.
    pub validate: bool,
    /// Devices that this cell opened, kept for their messages where `validate`.
    opened: RefCell<Vec<Gpu>>,
}

/// One of the things that are timed in turn.
pub struct Contender<'a> {
    pub variant: String,
    /// Runs it once, and tells the time of each of its passes.
    pub run: Box<dyn FnMut() -> anyhow::Result<Vec<PassTime>> + 'a>,
}

/// A contender's times in milliseconds; `None` where the device keeps no time.
#[derive(Clone, Debug)]
pub struct Timed {
    pub variant: String,
    /// All passes together.
    pub total: Option<Summary>,
    /// In order of the frame.
    pub passes: Vec<(String, Option<Summary>)>,
    /// Each round's passes. Round n of one contender ran beside round n of the others of its run.
    pub rounds: Vec<Vec<PassTime>>,
}

impl Bench {
    /// Of one cell, with no validation.
    pub fn new(effort: Effort, device: Option<String>, pictures: PathBuf) -> Bench {
        Bench { effort, device, pictures, written: Vec::new(), validate: false, opened: RefCell::default() }
    }

    /// Opens the run's device with what `needs` names, and with what else it has: figures compare variants.
    ///
    /// # Errors
    /// As [`Gpu::new`]; a feature that the device lacks is [`Value::Missing`]'s case.
    pub fn gpu(&self, needs: &[Need]) -> crate::vk::Result<Gpu> {
        let (device, validate) = (self.device.as_deref(), self.validate);
        let options = GpuOptions { device, validate, needs, wishes: &Feature::ALL, ..GpuOptions::default() };
        let gpu = Gpu::new(&options)?;
        if self.validate {
            self.opened.borrow_mut().push(gpu.clone());
        }
        Ok(gpu)
    }

    /// What the validation layer has said so far of this cell's devices; none where it is off.
    pub fn messages(&self) -> Vec<Message> {
        self.opened.borrow().iter().flat_map(Gpu::messages).collect()
    }

    /// Timed runs of each contender, warm-up apart.
    pub fn runs(&self) -> usize {
        match self.effort {
            // Of the best of several half are judged, and 6 are the least that have a 95 % confidence interval.
            Effort::Quick => 12,
            Effort::Full => 30,
        }
    }

    /// Runs all contenders in turn, [`Bench::runs`] times; each round begins with another one, so that drift and
    /// neighbours hit all alike. A contender "empty pass" is added.
    ///
    /// # Errors
    /// The first contender's.
    pub fn interleave<'a>(&self, gpu: &'a Gpu, contenders: Vec<Contender<'a>>) -> anyhow::Result<Vec<Timed>> {
        self.interleave_until(gpu, contenders, 1, |_| true)
    }

    /// As [`Bench::interleave`], and as many runs again, up to `most` times, until it is `enough`.
    ///
    /// # Errors
    /// The first contender's.
    pub fn interleave_until<'a>(
        &self,
        gpu: &'a Gpu,
        mut contenders: Vec<Contender<'a>>,
        most: usize,
        enough: impl Fn(&[Timed]) -> bool,
    ) -> anyhow::Result<Vec<Timed>> {
        contenders.push(Contender {
            variant: "empty pass".into(),
            run: Box::new(|| {
                let mut frame = gpu.frame()?;
                frame.pass("empty pass", |_| Ok(()))?;
                Ok(frame.submit()?.wait()?)
            }),
        });
        let count = contenders.len();
        let mut samples: Vec<Vec<Vec<PassTime>>> = vec![Vec::new(); count];
        for round in 0.. {
            for turn in 0..count {
                let at = (turn + round) % count;
                let times = (contenders[at].run)()?;
                if round >= WARM_UP {
                    samples[at].push(times);
                }
            }
            let runs = samples[0].len();
            if runs > 0 && runs.is_multiple_of(self.runs()) {
                let timed: Vec<Timed> = contenders
                    .iter()
                    .zip(&samples)
                    .map(|(c, runs)| Timed::of(&c.variant, runs.clone()))
                    .collect();
                if runs >= most * self.runs() || enough(&timed) {
                    return Ok(timed);
                }
            }
        }
        unreachable!("rounds end with the last run")
    }

    /// Writes a picture of the cell as `name`.png; names are unique in the whole run: begin with the figure's id.
    ///
    /// # Errors
    /// The disk's.
    pub fn picture(&mut self, name: &str, picture: &Srgb8Picture) -> anyhow::Result<()> {
        let file = format!("{name}.png");
        write_png(&self.pictures.join(&file), picture)?;
        self.written.push(file);
        Ok(())
    }
}

/// Milliseconds; `None` where the device keeps no time.
fn milliseconds(ns: Option<u64>) -> Option<f64> {
    Some(ns? as f64 / 1e6)
}

fn summary(samples: Option<Vec<f64>>) -> Option<Summary> {
    Summary::of(&samples?)
}

impl Timed {
    /// From each round's passes.
    pub fn of(variant: &str, rounds: Vec<Vec<PassTime>>) -> Timed {
        let mut timed = Timed { variant: variant.to_string(), total: None, passes: Vec::new(), rounds };
        timed.total = summary(timed.total_of_rounds());
        let labels = timed.rounds.first().into_iter().flatten().map(|pass| pass.label.clone());
        let of_pass = |(n, label): (usize, String)| {
            let samples = timed.rounds.iter().map(|round| milliseconds(round[n].ns)).collect();
            (label, summary(samples))
        };
        timed.passes = labels.enumerate().map(of_pass).collect();
        timed
    }

    /// Milliseconds of all passes together in each round.
    pub fn total_of_rounds(&self) -> Option<Vec<f64>> {
        let total = |round: &Vec<PassTime>| round.iter().map(|pass| milliseconds(pass.ns)).sum();
        self.rounds.iter().map(total).collect()
    }

    /// Milliseconds of a pass in each round; `None` where the contender has no such pass.
    pub fn pass_of_rounds(&self, label: &str) -> Option<Vec<f64>> {
        let of = |round: &Vec<PassTime>| milliseconds(round.iter().find(|pass| pass.label == label)?.ns);
        self.rounds.iter().map(of).collect()
    }

    /// The whole contender's time as a row.
    pub fn row(&self, quantity: &str) -> Row {
        Row::of_rounds(&self.variant, quantity, "ms", self.total_of_rounds())
    }

    /// The time of each pass as a row, by its label.
    pub fn pass_rows(&self) -> impl Iterator<Item = Row> {
        let of = |label: &String| Row::of_rounds(&self.variant, label, "ms", self.pass_of_rounds(label));
        self.passes.iter().filter(|(_, summary)| summary.is_some()).map(move |(label, _)| of(label))
    }

    /// A pass's time in milliseconds.
    pub fn pass(&self, label: &str) -> Option<Summary> {
        self.passes.iter().find(|(l, _)| l == label).and_then(|(_, summary)| *summary)
    }
}
