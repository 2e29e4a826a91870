//! Made-up figures.

use ortelius::figure::{
    Axis, Bench, Cell, Claim, Figure, Finding, Origin, Plot, Row, Sweep, Table, Value, Verdict,
};
use ortelius::picture::write::Srgb8Picture;
use ortelius::stats::Summary;
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
    plots: &[Plot { quantity: "size", x: Axis::Sweep, log_x: true, log_y: true, floor: Some("empty pass") }],
    claims: &[
        Claim {
            id: "doubles",
            text: "double is twice single",
            from: Origin::Paper("section 1"),
            check: doubles,
        },
        Claim { id: "partly", text: "some are small", from: Origin::Ours, check: |_| found(Verdict::InPart) },
        Claim {
            id: "fails",
            text: "all are <small> & \"sound\"",
            from: Origin::Ours,
            check: |_| found(Verdict::NotReproduced),
        },
        Claim {
            id: "unknown",
            text: "a GPU is fast",
            from: Origin::Paper("section 5"),
            check: |_| found(Verdict::NotMeasurable),
        },
    ],
};

/// Times with a spread, a variant that does not run here, words, and a series.
pub const BARS: Figure = Figure {
    id: "made.bars",
    title: "Times of variants",
    about: "Bars with spreads.",
    scenes: &["plane"],
    variants: || ["fast", "slow", "absent", "worded"].map(String::from).to_vec(),
    sweep: None,
    measure: bars,
    plots: &[
        Plot { quantity: "time", x: Axis::Variant, log_x: false, log_y: false, floor: Some("empty pass") },
        Plot {
            quantity: "error",
            x: Axis::Series("time since the cut, ms"),
            log_x: false,
            log_y: true,
            floor: None,
        },
    ],
    claims: &[Claim {
        id: "faster",
        text: "fast is faster",
        from: Origin::Ours,
        check: |_| found(Verdict::Reproduced),
    }],
};

/// As many variants as the real figures have at most, with long names, along a sweep and as bars.
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
    plots: &[
        Plot { quantity: "dedup", x: Axis::Sweep, log_x: true, log_y: true, floor: Some("empty pass") },
        Plot { quantity: "points emitted", x: Axis::Variant, log_x: false, log_y: true, floor: None },
    ],
    claims: &[Claim {
        id: "grows",
        text: "the time of every variant grows with the side of the texture, and none is below an empty pass",
        from: Origin::Ours,
        check: |_| {
            Finding::new(
                Verdict::InPart,
                "18 variants: 0.31 to 84.3 ms at 2^20, the empty pass takes 0.10 ms",
                "all but two grow; the bound was all, and both exceptions are within their spreads",
            )
        },
    }],
};

/// Dies in the second of its three cells, as a driver does.
pub const DIES: Figure = Figure {
    id: "made.dies",
    title: "A figure that crashes the driver",
    about: "One of three cells takes the process along.",
    scenes: &["earth", "globe", "plane"],
    variants: || vec!["only".into()],
    sweep: None,
    measure: |_, cell| match &*cell.scene {
        "globe" => std::process::abort(),
        _ => Ok(vec![number("only", "size", 1.0)]),
    },
    plots: &[],
    claims: &[Claim {
        id: "whole",
        text: "all cells are there",
        from: Origin::Ours,
        check: |table| match table.missing {
            0 => found(Verdict::Reproduced),
            _ => Finding::new(Verdict::NotMeasurable, "", "it takes all cells"),
        },
    }],
};

/// Fails in one of its cells, and panics in another.
pub const FAILS: Figure = Figure {
    id: "made.fails",
    title: "A figure with trouble",
    about: "Two of three cells fail.",
    scenes: &["earth", "globe", "plane"],
    variants: || vec!["only".into()],
    sweep: None,
    measure: |_, cell| match &*cell.scene {
        "earth" => anyhow::bail!("the disk is on fire"),
        "globe" => panic!("left {} right {}", 1, 2),
        _ => Ok(vec![number("only", "size", 1.0)]),
    },
    plots: &[],
    claims: &[Claim {
        id: "holds",
        text: "it holds",
        from: Origin::Ours,
        check: |_| found(Verdict::Reproduced),
    }],
};

/// Many short cells, for runs that are killed.
pub const SLOW: Figure = Figure {
    id: "made.slow",
    title: "Many cells",
    about: "Each takes a moment.",
    scenes: &["a", "b", "c", "d"],
    variants: || vec!["only".into()],
    sweep: Some(Sweep { name: "n", quick: &[0.1, 0.2, 0.3, 0.4, 0.5, 0.6], full: &[1.0] }),
    measure: |bench, cell| {
        std::thread::sleep(Duration::from_millis(10));
        picture(bench, &format!("made.slow-{}-{}", cell.scene, cell.x.unwrap_or(0.0)))?;
        Ok(vec![number("only", "third", cell.x.unwrap_or(0.0) / 3.0)])
    },
    plots: &[],
    claims: &[Claim {
        id: "holds",
        text: "it holds",
        from: Origin::Ours,
        check: |_| found(Verdict::Reproduced),
    }],
};

fn found(verdict: Verdict) -> Finding {
    Finding::new(verdict, "1 of 2", "the bound is 1")
}

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

fn doubles(table: &Table) -> Finding {
    let ratios: Vec<f64> = table
        .of("size")
        .filter(|r| r.row.variant == "single")
        .filter_map(|r| Some(table.number(&r.scene, r.x, "double", "size")? / r.row.value.number()?))
        .collect();
    let worst = ratios.iter().copied().fold(2.0, f64::min);
    let verdict = if worst == 2.0 { Verdict::Reproduced } else { Verdict::NotReproduced };
    Finding::new(verdict, format!("ratio {worst} in {} cells", ratios.len()), "2 exactly")
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
