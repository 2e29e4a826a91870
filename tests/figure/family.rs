//! Made-up figures.

use ortelius::figure::claim::{
    Bound::Above, Bound::AtLeast, Bound::AtMost, Bound::Below, Bound::Equal, Claim, Places, Test, every, one,
};
use ortelius::figure::{Bench, Cell, Figure, LeftOut, Plot, Row, Sweep, Value};
use ortelius::picture::write::Srgb8Picture;
use ortelius::stats::Summary;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// Exact numbers along a sweep, a picture, and a claim of each verdict.
pub const SWEPT: Figure = Figure {
    id: "made.swept",
    title: "Numbers along a sweep",
    about: "What doubles doubles. The paper says so in section 1.",
    scenes: &["earth/oblique", "globe"],
    variants: || vec!["single".into(), "double".into()],
    sweep: Some(Sweep { name: "side, texels", quick: &[1.0, 2.5, 1e6], full: &[1.0, 2.0, 3.0, 4.0] }),
    measure: swept,
    plots: &[Plot::sweep("size").log_x().log_y().floor("empty pass")],
    claims: &[
        Claim::paper(
            "section 1",
            "doubles",
            "double is twice single",
            &[Test::ratio(one("size", "double"), one("size", "single"), Equal(2.0))],
        ),
        Claim::ours("partly", "some are small", &[Test::value(one("size", "single"), AtMost(1.0))]),
        Claim::ours(
            "fails",
            "all are <small> & \"sound\"",
            &[Test::value(one("size", "double"), Below(0.0))],
        ),
        Claim::paper("section 5", "unknown", "a GPU is fast", &[Test::value(every("size"), Above(0.0))])
            .given(&[Test::value(one("size", "single"), Above(1e9))]),
    ],
    ..Figure::BASE
};

/// Times with spread, a variant that does not run here, text, and a series.
pub const BARS: Figure = Figure {
    id: "made.bars",
    title: "Times of variants",
    about: "Bars with spreads.",
    scenes: &["plane"],
    variants: || ["fast", "slow", "absent", "worded"].map(String::from).to_vec(),
    paper: &["slow"],
    ours: &["fast"],
    measure: bars,
    plots: &[Plot::bars("time").floor("empty pass"), Plot::curves("error", "time since the cut, ms").log_y()],
    claims: &[Claim::ours(
        "faster",
        "fast is faster",
        &[Test::ratio(one("time", "slow"), one("time", "fast"), Above(1.0))],
    )],
    ..Figure::BASE
};

/// As many variants as the largest real figure, with long names, along a sweep and as bars.
pub const MANY: Figure = Figure {
    id: "made.many",
    title: "Many variants along many resolutions",
    about: "What does stage 2 cost, and how does it grow with the picture? The paper (section 2.2) states that blocks of \
            8 x 8 pixels with a memo are the best choice, and gives no numbers.\n\nA second paragraph: the time of an \
            empty pass is the floor.",
    scenes: &["earth/oblique", "globe"],
    variants: || {
        let of_block = |p| ["memo", "no memo", "compute"].map(|kind| format!("geometry, p = {p}, {kind}"));
        (0..6).flat_map(of_block).collect()
    },
    sweep: Some(Sweep {
        name: "texels a side",
        quick: &[4096.0, 16384.0, 65536.0, 262144.0, 1048576.0],
        full: &[1.0],
    }),
    measure: many,
    plots: &[Plot::sweep("dedup").log_x().log_y().floor("empty pass"), Plot::bars("points emitted").log_y()],
    claims: &[Claim::ours(
        "grows",
        "the time of every variant grows with the side of the texture, and none is below a millisecond",
        &[Test::value(every("dedup"), AtLeast(1.0))],
    )],
    ..Figure::BASE
};

/// Crashes in the second of its three cells, as a driver does.
pub const DIES: Figure = Figure {
    id: "made.dies",
    title: "A figure that crashes the driver",
    about: "One of three cells kills the process.",
    scenes: &["earth", "globe", "plane"],
    variants: || vec!["only".into()],
    measure: |_, cell| match &*cell.scene {
        "globe" => std::process::abort(),
        _ => Ok(vec![number("only", "size", 1.0)]),
    },
    claims: &[Claim::ours("whole", "all cells are there", &[Test::value(every("size"), Equal(1.0))])],
    ..Figure::BASE
};

/// Fails in one cell and panics in another.
pub const FAILS: Figure = Figure {
    id: "made.fails",
    title: "A figure with failing cells",
    about: "Two of three cells fail.",
    scenes: &["earth", "globe", "plane"],
    variants: || vec!["only".into()],
    measure: |_, cell| match &*cell.scene {
        "earth" => anyhow::bail!("the disk is on fire"),
        "globe" => panic!("left {} right {}", 1, 2),
        _ => Ok(vec![number("only", "size", 1.0)]),
    },
    claims: &[Claim::ours("holds", "it holds", &[Test::value(every("size"), Equal(1.0))])],
    ..Figure::BASE
};

/// Leaves one of its three cells out.
pub const LEAVES: Figure = Figure {
    id: "made.leaves",
    title: "A figure with a scene that is not fetched",
    about: "One of three cells is left out.",
    measure: |_, cell| match &*cell.scene {
        "globe" => Err(LeftOut("the globe is not fetched".into()).into()),
        _ => Ok(vec![number("only", "size", 1.0)]),
    },
    ..DIES
};

/// Only full runs have the scene that is left out.
pub const LARGE: Figure = Figure {
    id: "made.large",
    full_only: &["globe"],
    claims: &[
        Claim::ours("whole", "all cells are there", ONE),
        Claim::ours("globe", "the large scene is there", ONE).at(Places::scenes(&["globe"])),
    ],
    ..LEAVES
};

const ONE: &[Test] = &[Test::value(every("size"), Equal(1.0))];

/// Environment variable that tells a process how many cells of [`SLOW`] to measure; in the next cell it waits to be
/// killed.
pub const MEASURES: &str = "ORTELIUS_TEST_MEASURES";

fn wait_for_the_kill_after_enough_cells() {
    static MEASURED: AtomicUsize = AtomicUsize::new(0);
    let max = std::env::var(MEASURES).map_or(usize::MAX, |text| text.parse().expect("a number"));
    while MEASURED.load(Ordering::Relaxed) >= max {
        std::thread::sleep(Duration::from_secs(1));
    }
    MEASURED.fetch_add(1, Ordering::Relaxed);
}

/// Many short cells, for runs that are killed.
pub const SLOW: Figure = Figure {
    id: "made.slow",
    title: "Many cells",
    about: "Each takes a moment.",
    scenes: &["a", "b", "c", "d"],
    variants: || vec!["only".into()],
    sweep: Some(Sweep { name: "n", quick: &[0.1, 0.2, 0.3, 0.4, 0.5, 0.6], full: &[1.0] }),
    measure: |bench, cell| {
        wait_for_the_kill_after_enough_cells();
        picture(bench, &format!("made.slow-{}-{}", cell.scene, cell.x.unwrap_or(0.0)))?;
        Ok(vec![number("only", "third", cell.x.unwrap_or(0.0) / 3.0)])
    },
    claims: &[Claim::ours("holds", "it holds", &[Test::value(every("third"), AtMost(1.0))])],
    ..Figure::BASE
};

fn number(variant: &str, quantity: &str, value: f64) -> Row {
    Row::new(variant, quantity, "texels", Value::Number(value))
}

fn picture(bench: &mut Bench, name: &str) -> anyhow::Result<()> {
    bench.picture(name, &Srgb8Picture { width: 2, height: 1, rgba: vec![255, 0, 0, 255, 0, 0, 255, 255] })
}

fn swept(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let x = cell.x.expect("a sweep");
    if x == 1.0 {
        picture(bench, &format!("made.swept-{}", cell.scene.replace('/', "-")))?;
    }
    Ok(vec![
        number("single", "size", x / 3.0),
        number("double", "size", x * 2.0 / 3.0),
        number("empty pass", "size", 0.25),
        number("single", "distance", f64::INFINITY),
        number("double", "distance", f64::NAN),
    ])
}

fn bars(_: &mut Bench, _: &Cell) -> anyhow::Result<Vec<Row>> {
    let time = |variant: &str, samples: &[f64]| {
        Row::new(variant, "time", "ms", Value::Summary(Summary::of(samples).expect("samples")))
    };
    Ok(vec![
        time("fast", &[1.0, 1.1, 1.2]),
        time("slow", &[3.0, 4.0, 5.5]),
        time("empty pass", &[0.1, 0.1, 0.1]),
        Row::new("absent", "time", "ms", Value::Missing("no geometry shader".into())),
        Row::new("worded", "time", "ms", Value::Text("too small to tell".into())),
        Row::new("fast", "error", "", Value::Series(vec![[0.0, 1.0], [10.0, 0.1], [20.0, 0.01]])),
        Row::new("slow", "error", "", Value::Series(vec![[0.0, 1.0], [10.0, 0.5], [20.0, 0.2]])),
    ])
}

fn many(_: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let x = cell.x.expect("a sweep");
    let mut rows = Vec::new();
    for (n, name) in (MANY.variants)().into_iter().enumerate() {
        let time = 0.02 * x.powf(0.3 + 0.02 * n as f64);
        let samples = [time * 0.9, time, time * (1.1 + 0.05 * n as f64)];
        rows.push(Row::new(&*name, "dedup", "ms", Value::Summary(Summary::of(&samples).expect("samples"))));
        let value = if n == 4 {
            Value::Missing("the device lacks geometryShader".into())
        } else {
            Value::Number((x * 3.0).powf(1.0 + n as f64 / 40.0).round())
        };
        rows.push(Row::new(name, "points emitted", "points", value));
    }
    rows.push(Row::new("empty pass", "dedup", "ms", Value::Number(0.1)));
    Ok(rows)
}
