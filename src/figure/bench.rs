//! Tools with which a figure measures: device, effort, interleaved timing, pictures.

use super::{Effort, Row};
use crate::math::splitmix::SplitMix64;
use crate::picture::write::{Srgb8Picture, write_png};
use crate::stats::Summary;
use crate::vk::{self, Cmd, Feature, Frame, Gpu, GpuOptions, Message, Need, PassTime, Work};
use std::cell::RefCell;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Untimed rounds at the start, because drivers compile shaders on first use. The second round counts the work, so that
/// statistics queries slow no timed round.
const WARM_UP: usize = 3;
const COUNTED: usize = 1;
/// The warm-up takes at least this long: a GPU raises its clocks under load.
const WARM_UP_TIME: Duration = Duration::from_millis(200);

/// The order of `count` items in a round: a shuffle that is the same in every run. In a fixed order, the state that an
/// item leaves behind (caches, clocks) would always affect the same next item.
fn order(round: usize, count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    SplitMix64(round as u64).shuffle(&mut order);
    order
}

/// Device, effort and picture folder of a run.
pub struct Bench {
    pub effort: Effort,
    /// Part of a device's name, or its index.
    pub device: Option<String>,
    /// The folder of [`Bench::picture`].
    pub pictures: PathBuf,
    /// Names of the pictures that this cell wrote.
    pub written: Vec<String>,
    /// Opens devices with the validation layer; a validation message fails the cell.
    pub validate: bool,
    /// Devices that this cell opened; with `validate`, kept for their messages.
    opened: RefCell<Vec<Gpu>>,
}

/// One of the workloads that are timed in turn.
pub struct Contender<'a> {
    pub variant: String,
    /// Runs once and returns the time of each pass.
    pub run: Box<dyn FnMut() -> anyhow::Result<Vec<PassTime>> + 'a>,
}

impl<'a> Contender<'a> {
    pub fn new(
        variant: impl Into<String>,
        run: impl FnMut() -> anyhow::Result<Vec<PassTime>> + 'a,
    ) -> Contender<'a> {
        Contender { variant: variant.into(), run: Box::new(run) }
    }

    /// A frame that has only the passes that `record` adds.
    pub fn frame(
        gpu: &'a Gpu,
        variant: impl Into<String>,
        mut record: impl FnMut(&mut Frame<'_>) -> vk::Result<()> + 'a,
    ) -> Contender<'a> {
        Contender::new(variant, move || {
            let mut frame = gpu.frame()?;
            record(&mut frame)?;
            Ok(frame.submit()?.wait()?)
        })
    }

    /// A frame whose only pass is `record`.
    pub fn pass(
        gpu: &'a Gpu,
        variant: impl Into<String>,
        mut record: impl FnMut(&mut Cmd<'_>) -> vk::Result<()> + 'a,
    ) -> Contender<'a> {
        let variant = variant.into();
        let label = variant.clone();
        Contender::new(variant, move || Ok(gpu.run_pass(&label, &mut record)?))
    }

    /// Adds a last pass: the host's time for `work`, which follows the device's passes.
    pub fn and_host<T>(mut self, label: &'a str, mut work: impl FnMut() -> T + 'a) -> Contender<'a> {
        Contender::new(self.variant, move || {
            let mut times = (self.run)()?;
            times.push(PassTime::of_host(label, &mut work));
            Ok(times)
        })
    }
}

/// A contender's times in milliseconds; `None` if the device has no timestamps.
#[derive(Clone, Debug)]
pub struct Timed {
    pub variant: String,
    /// Sum of all passes.
    pub total: Option<Summary>,
    /// Label and time of each pass, in the order of the frame.
    pub passes: Vec<(String, Option<Summary>)>,
    /// Passes of each round. Within a round, all contenders run in turn.
    pub rounds: Vec<Vec<PassTime>>,
    /// One extra run that counts the work of each pass; empty if the device has no pipeline statistics.
    pub counted: Vec<PassTime>,
}

impl Bench {
    /// The tools for one cell, without validation.
    pub fn new(effort: Effort, device: Option<String>, pictures: PathBuf) -> Bench {
        Bench { effort, device, pictures, written: Vec::new(), validate: false, opened: RefCell::default() }
    }

    /// Opens the run's device with all features that it has, because figures compare variants. The features
    /// of `needs` are required.
    ///
    /// # Errors
    /// As [`Gpu::new`]. If the device lacks a feature, the figure reports [`Value::Missing`].
    pub fn gpu(&self, needs: &[Need]) -> vk::Result<Gpu> {
        let (device, validate) = (self.device.as_deref(), self.validate);
        let options = GpuOptions { device, validate, needs, wishes: &Feature::ALL, ..GpuOptions::default() };
        let gpu = Gpu::new(&options)?;
        gpu.require_drawing()?;
        if self.validate {
            self.opened.borrow_mut().push(gpu.clone());
        }
        Ok(gpu)
    }

    /// Opens the run's device with those features of `needs` that it offers.
    ///
    /// # Errors
    /// As [`Gpu::new`].
    pub fn gpu_with_offered(&self, needs: &[Need]) -> vk::Result<Gpu> {
        let offered = self.gpu(&[])?.physical().features.clone();
        let granted: Vec<Need> =
            needs.iter().filter(|need| offered.contains(&need.feature)).copied().collect();
        self.gpu(&granted)
    }

    /// Validation messages of this cell's devices so far; empty without validation.
    pub fn messages(&self) -> Vec<Message> {
        self.opened.borrow().iter().flat_map(Gpu::messages).collect()
    }

    /// `quick` or `full`, by the effort.
    pub fn effort_of<T>(&self, quick: T, full: T) -> T {
        match self.effort {
            Effort::Quick => quick,
            Effort::Full => full,
        }
    }

    /// A size for measuring times: by the effort on a software device, always `full` on a GPU, which takes no longer for
    /// a small picture than for an empty pass.
    pub fn timed_size<T>(&self, gpu: &Gpu, quick: T, full: T) -> T {
        if gpu.physical().is_software() { self.effort_of(quick, full) } else { full }
    }

    /// Calls `of` for each of `count` items in every round, in another order each time, and returns the results
    /// of each item.
    ///
    /// # Errors
    /// The first error of `of`.
    pub fn in_turn<T>(
        rounds: usize,
        count: usize,
        mut of: impl FnMut(usize) -> anyhow::Result<T>,
    ) -> anyhow::Result<Vec<Vec<T>>> {
        let mut found: Vec<Vec<T>> = (0..count).map(|_| Vec::new()).collect();
        for at in (0..rounds).flat_map(|round| order(round, count)) {
            found[at].push(of(at)?);
        }
        Ok(found)
    }

    /// Number of timed runs of each contender, without warm-up.
    pub fn runs(&self) -> usize {
        match self.effort {
            // The best of several variants is judged on half of the rounds; a 95 % confidence interval
            // needs 6.
            Effort::Quick => 12,
            Effort::Full => 30,
        }
    }

    /// Runs all contenders in turn, [`Bench::runs`] times, in another order each time, so that drift, other load and
    /// the preceding contender affect all equally. Adds a contender "empty pass".
    ///
    /// # Errors
    /// The first error of a contender.
    pub fn interleave<'a>(&self, gpu: &'a Gpu, contenders: Vec<Contender<'a>>) -> anyhow::Result<Vec<Timed>> {
        self.interleave_until(gpu, contenders, 1, |_| true)
    }

    /// The whole time of each contender of [`Bench::interleave`], as rows of `quantity`.
    ///
    /// # Errors
    /// The first error of a contender.
    pub fn times<'a>(
        &self,
        gpu: &'a Gpu,
        contenders: impl IntoIterator<Item = Contender<'a>>,
        quantity: &str,
    ) -> anyhow::Result<Vec<Row>> {
        let timed = self.interleave(gpu, contenders.into_iter().collect())?;
        Ok(timed.iter().map(|one| one.row(quantity)).collect())
    }

    /// As [`Bench::interleave`], then repeats all runs until `enough` returns true, or until there are `max` times as
    /// many runs.
    ///
    /// # Errors
    /// The first error of a contender.
    pub fn interleave_until<'a>(
        &self,
        gpu: &'a Gpu,
        mut contenders: Vec<Contender<'a>>,
        max: usize,
        enough: impl Fn(&[Timed]) -> bool,
    ) -> anyhow::Result<Vec<Timed>> {
        contenders.push(Contender::new("empty pass", || Ok(gpu.run_pass("empty pass", |_| ())?)));
        let count = contenders.len();
        let mut samples: Vec<Vec<Vec<PassTime>>> = vec![Vec::new(); count];
        let mut counted: Vec<Vec<PassTime>> = vec![Vec::new(); count];
        let start = Instant::now();
        for round in 0.. {
            let counts = round == COUNTED && gpu.has(Feature::PipelineStatistics);
            gpu.count_work(counts);
            let warm = round >= WARM_UP && (start.elapsed() >= WARM_UP_TIME || !samples[0].is_empty());
            for at in order(round, count) {
                let passes = (contenders[at].run)()?;
                if counts {
                    counted[at] = passes;
                } else if warm {
                    samples[at].push(passes);
                }
            }
            let runs = samples[0].len();
            if runs > 0 && runs.is_multiple_of(self.runs()) {
                let timed: Vec<Timed> = contenders
                    .iter()
                    .zip(&samples)
                    .zip(&counted)
                    .map(|((c, runs), counted)| Timed {
                        counted: counted.clone(),
                        ..Timed::of(&c.variant, runs.clone())
                    })
                    .collect();
                if runs >= max * self.runs() || enough(&timed) {
                    return Ok(timed);
                }
            }
        }
        unreachable!("the last run returns")
    }

    /// Writes a picture of the cell as `name`.png. Names are unique in the whole run: start them with the
    /// figure's id.
    ///
    /// # Errors
    /// I/O errors.
    pub fn picture(&mut self, name: &str, picture: &Srgb8Picture) -> anyhow::Result<()> {
        let file = format!("{name}.png");
        write_png(&self.pictures.join(&file), picture)?;
        self.written.push(file);
        Ok(())
    }
}

/// Milliseconds; `None` if the device has no timestamps.
fn milliseconds(ns: Option<u64>) -> Option<f64> {
    Some(ns? as f64 / 1e6)
}

fn summary(samples: Option<Vec<f64>>) -> Option<Summary> {
    Summary::of(&samples?)
}

impl Timed {
    /// Summarises the passes of each round.
    pub fn of(variant: &str, rounds: Vec<Vec<PassTime>>) -> Timed {
        let mut timed = Timed {
            variant: variant.to_string(),
            total: None,
            passes: Vec::new(),
            rounds,
            counted: Vec::new(),
        };
        timed.total = summary(timed.total_of_rounds());
        let labels = timed.rounds.first().into_iter().flatten().map(|pass| pass.label.clone());
        let of_pass = |(n, label): (usize, String)| {
            let samples = timed.rounds.iter().map(|round| milliseconds(round.get(n)?.ns)).collect();
            (label, summary(samples))
        };
        timed.passes = labels.enumerate().map(of_pass).collect();
        timed
    }

    /// Milliseconds of all passes in each round.
    pub fn total_of_rounds(&self) -> Option<Vec<f64>> {
        let total = |round: &Vec<PassTime>| round.iter().map(|pass| milliseconds(pass.ns)).sum();
        self.rounds.iter().map(total).collect()
    }

    /// Milliseconds of a pass in each round; `None` if a round has no such pass, or the device no timestamps.
    pub fn pass_of_rounds(&self, label: &str) -> Option<Vec<f64>> {
        let of = |round: &Vec<PassTime>| milliseconds(round.iter().find(|pass| pass.label == label)?.ns);
        self.rounds.iter().map(of).collect()
    }

    /// Work of all passes with these labels in one run; `None` if not counted.
    pub fn work(&self, labels: &[&str]) -> Option<Work> {
        let passes = self.counted.iter().filter(|pass| labels.contains(&&*pass.label));
        let works: Vec<Work> = passes.filter_map(|pass| pass.work).collect();
        (!works.is_empty()).then(|| works.into_iter().sum())
    }

    /// Work of all passes in one run.
    pub fn total_work(&self) -> Option<Work> {
        let labels: Vec<&str> = self.counted.iter().map(|pass| &*pass.label).collect();
        self.work(&labels)
    }

    /// The whole contender's time as a row.
    pub fn row(&self, quantity: &str) -> Row {
        let row = Row::of_rounds(&self.variant, quantity, "ms", self.total_of_rounds());
        Row { work: self.total_work(), ..row }
    }

    /// The time of each pass as a row, by its label.
    pub fn pass_rows(&self) -> impl Iterator<Item = Row> {
        let of = |label: &String| Row {
            work: self.work(&[label]),
            ..Row::of_rounds(&self.variant, label, "ms", self.pass_of_rounds(label))
        };
        self.passes.iter().filter(|(_, summary)| summary.is_some()).map(move |(label, _)| of(label))
    }

    /// The time of contender `base` over the time of every other contender of `timed`, by round.
    pub fn gains(timed: &[Timed], base: &str, quantity: &str) -> Vec<Row> {
        let of_base = timed.iter().find(|one| one.variant == base).and_then(Timed::total_of_rounds);
        let gain = |one: &Timed| {
            let rounds = of_base.iter().flatten().zip(one.total_of_rounds()?);
            // A device with coarse timestamps may report 0.
            Some(rounds.map(|(base, own)| base / own).filter(|gain| gain.is_finite()).collect())
        };
        let others = timed.iter().filter(|one| one.variant != base && one.variant != "empty pass");
        others.map(|one| Row::of_rounds(&one.variant, quantity, "", gain(one))).collect()
    }

    /// A pass's time in milliseconds.
    pub fn pass(&self, label: &str) -> Option<Summary> {
        self.passes.iter().find(|(l, _)| l == label).and_then(|(_, summary)| *summary)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn each_round_has_every_item_once_and_an_item_runs_after_different_ones() {
        let orders: Vec<Vec<usize>> = (0..12).map(|round| order(round, 5)).collect();
        let mut before: [BTreeSet<usize>; 5] = Default::default();
        for order in &orders {
            assert_eq!(BTreeSet::from_iter(order).len(), 5);
            order.windows(2).for_each(|pair| _ = before[pair[1]].insert(pair[0]));
        }
        assert!(before.iter().all(|before| before.len() >= 3), "{before:?}");
        assert_eq!([order(3, 1), order(3, 0)], [vec![0], vec![]]);
    }

    #[test]
    fn a_gain_is_the_ratio_of_the_times_of_two_contenders_in_one_round() {
        let timed = |name: &str, ns: [u64; 3]| {
            let pass = |ns| vec![PassTime { label: "p".into(), ns: Some(ns), work: None }];
            Timed::of(name, ns.map(pass).to_vec())
        };
        let all = [timed("a", [10, 20, 30]), timed("b", [5, 5, 0]), timed("empty pass", [1; 3])];
        let rows = Timed::gains(&all, "a", "gain");
        let found: Vec<_> = rows.iter().map(|row| (&*row.variant, &row.rounds[..])).collect();
        assert_eq!(found, [("b", &[2.0, 4.0][..])]);
    }
}
