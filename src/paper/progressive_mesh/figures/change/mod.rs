//! pm.change: the cost of a level change for each method: bytes, and time of device and host.

mod ways;
mod written;

use super::models;
use super::orders::{CLASSICAL, Executable, IN_PLACE_23, TAIL_23, simplified};
use crate::figure::prelude::*;
use crate::paper::progressive_mesh::choices::FaceOrder;
use crate::paper::progressive_mesh::ordered;
use crate::vk::PassTime;
use std::cell::RefCell;
use ways::{COMPACTED, COPY, DeviceWalk, MAPPED, ON_DEVICE, SKIP_LISTS, WAYS};
use written::Written;

/// The figure.
pub const CHANGE: Figure = Figure {
    id: "pm.change",
    title: "Cost of a level change, by method",
    about: "One instance of `bunny` (3674 faces) or of `torus:96` (36 864) changes its level: by one split, by 1 % and \
            by 10 % of all splits, and by all of them at once. With our methods the host executes the splits (and the \
            tswaps, if the order has them). If constructing the level from the faces of the full mesh writes fewer \
            bytes, the host constructs it instead. The written blocks of 128 indices are uploaded (classical; tail; in \
            place) or copied into the buffers from which the device draws (mapped). There is one such buffer for each \
            frame in flight, so each block is copied twice. In a third method the device executes the splits, or \
            constructs the level, by the same rule. The baselines draw the same levels. The faces in random order or \
            reordered by meshoptimizer are uploaded as a whole. The compacted order is made by a pass of shaders. With \
            skip lists (each has 0.707 of the faces of the next finer list) a change writes corners, including those \
            of degenerate faces, or copies another list as a whole. The discrete meshes are all in the buffer already. \
            A copy of all live faces is shown for comparison. Written bytes are those that a change writes into the \
            index buffer, including faces that become live; they are counted on the way up through all levels and \
            back, as the mean and the worst change. Sent bytes are those that the host uploads or copies for a change \
            in the middle of the range: whole blocks, and all faces if they need a larger or smaller part of the index \
            buffer. Times are means of up to five single changes up and down in the middle of the range: the host's \
            time until the frame is submitted, the time of the device's passes, and their sum. Only one in several \
            hundred splits is followed by tswaps, and these may move all faces. So the mean shows the cost of a walk, \
            and the worst change shows the cost of a single frame.",
    scenes: &["bunny", "torus:96"],
    variants,
    ours: &["tail-23"],
    sweep: Some(Sweep { name: "step, % of all splits (at least one)", quick: &STEPS, full: &STEPS }),
    show: Show::views(|| models(&["bunny", "torus:96"])).variants(ways::settings),
    measure,
    plots: &[
        Plot::sweep(WRITTEN).log_x().log_y(),
        Plot::sweep(WORST).log_x().log_y(),
        Plot::sweep(DEVICE).log_x().log_y(),
        Plot::sweep(HOST).log_x().log_y(),
    ],
    claims: &[
        Claim::ours(
            "exact",
            "With every method that executes splits, the device's index buffer equals the host's bit for bit.",
            &[Test::value(every(WRONG), Equal(0.0))],
        ),
        Claim::ours(
            "moves",
            "With 23 moved faces per split, a split writes on average at most 138 bytes (23 faces of 6 bytes) more \
             than without tswaps. With births in place it also writes at most 3 corners of unborn faces, 6 bytes more.",
            &[
                Test::difference_of(WRITTEN, [TAIL_23, CLASSICAL], AtMost(138.0)),
                Test::difference_of(WRITTEN, [IN_PLACE_23, CLASSICAL], AtMost(144.0)),
            ],
        )
        .at(SINGLE),
        Claim::ours(
            "copies-of-lists",
            "On the way down, skip lists with a ratio of r = 0.707 copy 2 / (1 - r) - 2 = 4.8 faces per split, within \
             10 %, because all lists except the finest are copied when their levels are reached.",
            &[Test::value(one(COPIED[1], SKIP_LISTS), Within(4.32, 5.28, Better::Neither))],
        )
        .at(SINGLE),
        Claim::ours(
            "lists-write-less",
            "On a walk through all levels by single splits, skip lists write less than tail-23 and \
             in-place-23.",
            &Test::ratios_of(WRITTEN, [[SKIP_LISTS, TAIL_23], [SKIP_LISTS, IN_PLACE_23]], Below(1.0)),
        )
        .at(SINGLE),
        Claim::ours(
            "small-steps",
            "For steps of up to 1 % of all splits, tail-23 and in-place-23 write less than a copy of all \
             live faces.",
            &Test::ratios_of(WRITTEN, [[TAIL_23, COPY], [IN_PLACE_23, COPY]], Below(1.0)),
        )
        .at(Places::ALL.x(0.0, 1.0)),
        Claim::ours(
            "one-copy",
            "For steps of any size, tail-23 and in-place-23 write at most 1.1 times a copy of all live faces, in the \
             mean and in the worst change.",
            &[
                Test::ratio_of(WRITTEN, [TAIL_23, COPY], AtMost(1.1)),
                Test::ratio_of(WRITTEN, [IN_PLACE_23, COPY], AtMost(1.1)),
                Test::ratio_of(WORST, [TAIL_23, COPY], AtMost(1.1)),
                Test::ratio_of(WORST, [IN_PLACE_23, COPY], AtMost(1.1)),
            ],
        ),
        Claim::ours(
            "worst-split",
            "With every method, the worst split writes at most 1 % more than a copy of all live faces.",
            &[Test::ratio(each(WORST, baselines_of_a_copy), one(WORST, COPY), AtMost(1.01))],
        )
        .at(SINGLE),
        Claim::ours_timed(
            "compaction-looks-at-all",
            "A compaction visits all faces for every change: one split takes the device at least half as \
             long as all splits.",
            &[Test::ratio(
                one(DEVICE, COMPACTED).x(At::X(ONE)),
                one(DEVICE, COMPACTED).x(At::X(ALL)),
                AtLeast(0.5),
            )],
        ),
        Claim::ours_timed(
            "less-than-a-copy",
            "For a change of 1 % in tail-23, host and device together take less time than a copy of all live faces, \
             if tail-23 uses the best of its three methods.",
            &[Test::ratio(
                one(BOTH, COPY),
                best(BOTH, || [TAIL_23, MAPPED, ON_DEVICE].map(String::from).into()),
                Above(1.0),
            )],
        )
        .at(Places::ALL.x(1.0, 1.0)),
    ],
    ..Figure::BASE
};

const STEPS: [f64; 4] = [ONE, 1.0, 10.0, ALL];
/// A step of a single split: this percentage is less than one split of the largest mesh.
const ONE: f64 = 0.001;
const ALL: f64 = 100.0;
const SINGLE: Places = Places::ALL.x(0.0, ONE);

const WRITTEN: &str = "bytes written for a change";
const WORST: &str = "bytes written for the worst change";
const WRONG: &str = "indices that are not the host's";
const SENT: &str = "bytes sent for a change";
const COPIED: [&str; 2] =
    ["faces of lists copied for each split up", "faces of lists copied for each split down"];
const DEVICE: &str = "device, a change";
const HOST: &str = "host, a change";
const BOTH: &str = "host and device, a change";

fn variants() -> Vec<String> {
    WAYS.iter().map(|way| way.name.to_string()).collect()
}

fn baselines_of_a_copy() -> Vec<String> {
    variants().into_iter().filter(|name| name != COPY).collect()
}

/// The number of splits in a step.
fn splits(last: u32, percent: f64) -> u32 {
    ((f64::from(last) * percent / 100.0) as u32).max(1)
}

/// The levels of up to five steps in the middle of the range.
fn middle(last: u32, step: u32) -> Vec<u32> {
    let steps = (last / step).clamp(1, 5);
    let first = (last - steps * step) / 2;
    (0..=steps).map(|n| first + n * step).collect()
}

/// A model in each order of the comparison.
struct Meshes {
    classical: Executable,
    tail: Executable,
    in_place: Executable,
}

impl Meshes {
    fn of(name: &str) -> anyhow::Result<Meshes> {
        let (model, collapses) = simplified(name)?;
        let of = |order| Executable::new(ordered(&model, &collapses, order));
        Ok(Meshes {
            classical: of(FaceOrder::Classical)?,
            tail: of(FaceOrder::Tail23)?,
            in_place: of(FaceOrder::InPlace23)?,
        })
    }

    /// The mesh in an order. Baselines and other orders begin with the classical one.
    fn in_order(&self, order: FaceOrder) -> &Executable {
        match order {
            FaceOrder::Tail23 => &self.tail,
            FaceOrder::InPlace23 => &self.in_place,
            _ => &self.classical,
        }
    }
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let meshes = Meshes::of(&cell.scene)?;
    let last = meshes.tail.mesh.last_level();
    let step = splits(last, cell.x.expect("the sweep has values"));
    let mut rows = written_rows(&meshes, step);
    let levels = middle(last, step);
    let gpu = bench.gpu(&[])?;
    let mut ways = Vec::new();
    for way in &WAYS {
        let mut way = DeviceWalk::open(&gpu, way, &meshes, &levels)?;
        let sent = way.sent()? as f64 / (2 * (levels.len() - 1)) as f64;
        rows.push(Row::number(way.name, SENT, "bytes", sent));
        rows.extend(way.wrong()?.map(|wrong| Row::number(way.name, WRONG, "indices", wrong as f64)));
        ways.push(RefCell::new(way));
    }
    let timed = bench.interleave(&gpu, ways.iter().map(DeviceWalk::contender).collect())?;
    rows.extend(timed.iter().flat_map(time_rows));
    Ok(rows)
}

fn written_rows(meshes: &Meshes, step: u32) -> Vec<Row> {
    let mut rows = Vec::new();
    for way in &WAYS {
        let Written { bytes, changes, worst, copied } = written::walk(way, meshes, step);
        let mut row = |quantity: &str, unit: &str, number: f64| {
            rows.push(Row::number(way.name, quantity, unit, number));
        };
        row(WRITTEN, "bytes", bytes as f64 / changes as f64);
        row(WORST, "bytes", worst as f64);
        if step == 1 && way.order == Some(FaceOrder::SkipLists) {
            let splits = f64::from(meshes.classical.mesh.last_level());
            let lists = COPIED.into_iter().zip(copied);
            lists.for_each(|(name, faces)| row(name, "faces", faces as f64 / splits));
        }
    }
    rows
}

/// The mean over the single changes of each round.
fn time_rows(timed: &Timed) -> Vec<Row> {
    let of = |labels: &[&str]| -> Option<Vec<f64>> {
        let mean = |round: &Vec<PassTime>| {
            let passes = round.iter().filter(|pass| labels.contains(&&*pass.label));
            let sum: Option<u64> = passes.map(|pass| pass.ns).sum();
            // A change has a host part and a device pass.
            Some(sum? as f64 / 1e6 / (round.len() as f64 / 2.0))
        };
        timed.rounds.iter().map(mean).collect()
    };
    let rows = [(HOST, of(&[HOST])), (DEVICE, of(&[DEVICE])), (BOTH, of(&[HOST, DEVICE]))];
    let timed_rows = rows.into_iter().filter(|(_, rounds)| rounds.is_some());
    timed_rows.map(|(quantity, rounds)| Row::of_rounds(&timed.variant, quantity, "ms", rounds)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::Value;

    #[test]
    fn steps_are_one_split_at_least_and_lie_in_the_middle() {
        assert_eq!([ONE, 1.0, 10.0, ALL].map(|x| splits(1805, x)), [1, 18, 180, 1805]);
        assert_eq!(middle(1805, 1805), [0, 1805]);
        assert_eq!(middle(1000, 10), [475, 485, 495, 505, 515, 525]);
        assert_eq!(middle(1000, 300), [50, 350, 650, 950]);
    }

    #[test]
    fn times_are_means_over_a_round_and_the_sum_adds_host_and_device() {
        let pass = |label: &str, ms: u64| PassTime::new(label, Some(ms * 1_000_000));
        let round = |ms: u64| vec![pass(HOST, ms), pass(DEVICE, 10), pass(HOST, ms + 1), pass(DEVICE, 20)];
        let rows = time_rows(&Timed::of("tail-23", vec![round(1), round(3)]));
        let of = |quantity: &str| match &rows.iter().find(|row| row.quantity == quantity).unwrap().value {
            Value::Summary(summary) => (summary.count, summary.min, summary.max),
            value => panic!("{value:?}"),
        };
        assert_eq!([of(HOST), of(DEVICE), of(BOTH)], [(2, 1.5, 3.5), (2, 15.0, 15.0), (2, 16.5, 18.5)]);
    }
}
