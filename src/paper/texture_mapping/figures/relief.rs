//! tm.26 and tm.map-build: steps, time and error of relief tracing, and the cost of building the maps.

use super::shown::{method, traced_reliefs};
use crate::figure::prelude::*;
use crate::paper::texture_mapping::config::{MapPrecision, ReliefMethod};
use crate::paper::texture_mapping::relief::maps::{DistanceMap, Fan, Holds};
use crate::paper::texture_mapping::relief::pass::{ConeBuild, DistanceBuild, Trace, origin};
use crate::paper::texture_mapping::relief::trace::{MIN_STEP, Traced, Tracer};
use crate::paper::texture_mapping::relief::{Ray, Relief, ReliefKind, reference};
use crate::stats::mean;
use crate::vk::Gpu;
use std::sync::{Arc, Mutex};

const RELIEFS: &[&str] = &["bricks", "pillars", "spikes", "rock"];

pub const RELIEF: Figure = Figure {
    id: "tm.26",
    title: "Relief: Donnelly's and the refined distance map",
    about: "Figure 26 of the thesis: the refined map takes fewer iterations (no number given) and is up to 11 % \
            faster. Parallel rays descend at elevations of 15 to 80 degrees into a relief whose depth is a quarter of \
            its width: `bricks` with deep joints, `pillars`, a stair with `spikes`, and noise (`rock`). Quick runs \
            have 64 texels a side and 16 layers of cells, full ones 128 and 32. There is one ray per pixel: 256 to a \
            row in quick runs on a software device, otherwise 2048. `at centres`: as in Donnelly's method and the \
            paper, a distance holds at the cell's centre, so a step from elsewhere in the cell may pass the surface. \
            `guaranteed`: a distance holds for every point of the cell and every ray, so no step passes the surface. \
            With exact distances, a ray would take no more steps through the refined map than through Donnelly's. With \
            one distance for each cell, single rays may take more: the distance drops at a cell's border, and a ray \
            that a longer step has just brought into the next cell gets the shorter distance. The figure counts these \
            rays. A step is one lookup of the map. The baseline takes 64 linear steps. A search ends with 6 bisections \
            (relaxed cones: 12). A ray is missed if its hit is more than half a texel (the least step) away from the \
            exact hit.",
    scenes: RELIEFS,
    variants: || Traversal::ALL.map(|method| method.name()).to_vec(),
    paper: &["refined, at centres"],
    ours: &["refined, guaranteed"],
    full_only: &[],
    sweep: Some(Sweep {
        name: "elevation, degrees",
        quick: &[15.0, 30.0, 60.0, 80.0],
        full: &[15.0, 30.0, 45.0, 60.0, 70.0, 80.0],
    }),
    show: Show::views(traced_reliefs)
        .variants(|| Traversal::ALL.into_iter().filter_map(Traversal::setting).collect()),
    measure,
    plots: &[Plot::sweep(STEPS), Plot::sweep(GAIN), Plot::sweep(TIME).log_y(), Plot::sweep(MISSED)],
    claims: &[
        Claim::paper(
            "claim 7",
            "fewer-steps",
            "The refined map takes fewer steps than Donnelly's (by at least 1 %).",
            &[Test::ratio_of(STEPS, [DONNELLY_AT_CENTRES, REFINED_AT_CENTRES], AtLeast(1.01))],
        ),
        Claim::paper_timed(
            "claim 7, figure 26",
            "11-percent",
            "In some views the refined map is 11 % faster than Donnelly's (the thesis: \"up to 11 %\").",
            &[Test::ratio_of(TIME, [DONNELLY_AT_CENTRES, REFINED_AT_CENTRES], AtLeast(1.11))],
        )
        .somewhere(),
        Claim::ours(
            "no-more-steps-at-centres",
            "In every view the refined map at centres takes on average no more steps than Donnelly's.",
            &[Test::ratio_of(STEPS, [REFINED_AT_CENTRES, DONNELLY_AT_CENTRES], AtMost(1.0))],
        ),
        Claim::ours(
            "no-more-steps",
            "In every view the guaranteed refined map takes on average at most 0.05 % more steps than Donnelly's.",
            &[Test::ratio(GUARANTEED_STEPS, one(STEPS, "Donnelly, guaranteed"), AtMost(1.0005))],
        ),
        Claim::ours(
            "no-ray-more-steps",
            "No ray takes more steps through a refined map than through Donnelly's. (This holds for exact distances. It \
             fails for maps with one distance for each cell, because the distance drops at the border of two cells.)",
            &[Test::value(every(MORE), Equal(0.0))],
        ),
        Claim::ours(
            "guaranteed-hits",
            "The guaranteed refined map misses at most 1 % of the rays.",
            &[Test::value(one(MISSED, "refined, guaranteed"), AtMost(0.01))],
        ),
        Claim::ours(
            "8-bits",
            "With 8 bits per cell, rounded down, rays take at most 10 % more steps than with f32.",
            &[Test::ratio(one(STEPS, "refined, guaranteed, 8 bits"), GUARANTEED_STEPS, AtMost(1.1))],
        ),
    ],
};

pub const MAP_BUILD: Figure = Figure {
    id: "tm.map-build",
    title: "Relief: the cost of building the maps",
    about: "The figure shows the time to build each map on the device, for reliefs of 16 to 128 texels a side (quick: \
            to 32) with a quarter as many layers. The thesis gives no times. The reliefs are `bricks` and `rock`. \
            Building the refined map finds the horizon in each of 64 sectors of directions, up to 32 texels away, once \
            per column of cells. It then tests the neighbourhood of each cell against these horizons. For the \
            guaranteed map, the search of a sector covers every cell that a ray of this sector may cross. The bytes \
            are for 8 bits per cell; 16 and 32 bits take twice and four times as many. A cone map has one value per \
            texel.",
    scenes: &["bricks", "rock"],
    variants: || Build::ALL.map(|build| build.name()).to_vec(),
    paper: &["refined, at centres"],
    ours: &["refined, guaranteed"],
    full_only: &[],
    sweep: Some(Sweep { name: "texels a side", quick: &[16.0, 32.0], full: &[16.0, 32.0, 64.0, 128.0] }),
    show: Show::nothing("it times the building of distance maps", "relief-rock"),
    measure: measure_builds,
    plots: &[Plot::sweep(BUILD).log_x().log_y(), Plot::sweep(BYTES).log_x().log_y()],
    claims: &[Claim::ours_timed(
        "refined-price",
        "Building the refined map (at centres) takes at most 4 times as long as building Donnelly's.",
        &[Test::ratio_of(BUILD, [REFINED_AT_CENTRES, DONNELLY_AT_CENTRES], AtMost(4.0))],
    )],
};

const STEPS: &str = "steps per ray";
const GAIN: &str = "Donnelly's steps over the refined map's";
const MORE: &str = "rays with more steps than by Donnelly's map";
const TIME: &str = "tracing";
const MISSED: &str = "share of rays missed";
const BUILD: &str = "construction";
const BYTES: &str = "bytes with 8 bits a cell";

const DONNELLY_AT_CENTRES: &str = "Donnelly, at centres";
const REFINED_AT_CENTRES: &str = "refined, at centres";

const GUARANTEED_STEPS: Pick = one(STEPS, "refined, guaranteed");

/// A map to build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Build {
    Distances(Holds, bool),
    Cones { relaxed: bool },
}

impl Build {
    const ALL: [Build; 6] = [
        Build::Distances(Holds::AtCentres, false),
        Build::Distances(Holds::AtCentres, true),
        Build::Distances(Holds::Everywhere, false),
        Build::Distances(Holds::Everywhere, true),
        Build::Cones { relaxed: false },
        Build::Cones { relaxed: true },
    ];

    fn name(self) -> String {
        match self {
            Build::Distances(holds, refined) => {
                let map = if refined { "refined" } else { "Donnelly" };
                format!("{map}, {}", if holds == Holds::AtCentres { "at centres" } else { "guaranteed" })
            }
            Build::Cones { relaxed: false } => "cone map".into(),
            Build::Cones { relaxed: true } => "relaxed cone map".into(),
        }
    }
}

/// A tracer of the figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Traversal {
    Linear,
    Map(Build),
    /// The guaranteed refined map with this many bits per cell.
    Quantised(u32),
}

const REFINED: Build = Build::Distances(Holds::Everywhere, true);

impl Traversal {
    const ALL: [Traversal; 9] = [
        Traversal::Linear,
        Traversal::Map(Build::ALL[0]),
        Traversal::Map(Build::ALL[1]),
        Traversal::Map(Build::ALL[2]),
        Traversal::Map(Build::ALL[3]),
        Traversal::Quantised(16),
        Traversal::Quantised(8),
        Traversal::Map(Build::ALL[4]),
        Traversal::Map(Build::ALL[5]),
    ];

    fn name(self) -> String {
        match self {
            Traversal::Linear => "linear and binary search".into(),
            Traversal::Map(build) => build.name(),
            Traversal::Quantised(bits) => format!("{}, {bits} bits", REFINED.name()),
        }
    }

    /// The keys of a scene that select it. `None` for distances that hold only at the centres of cells.
    fn setting(self) -> Option<Setting> {
        let tracer = match self {
            Traversal::Linear => ReliefMethod::TraceLinear,
            Traversal::Map(Build::Distances(Holds::AtCentres, _)) => return None,
            Traversal::Map(Build::Distances(_, false)) => ReliefMethod::TraceDonnelly,
            Traversal::Map(Build::Distances(_, true)) | Traversal::Quantised(_) => ReliefMethod::Trace,
            Traversal::Map(Build::Cones { relaxed: false }) => ReliefMethod::TraceCones,
            Traversal::Map(Build::Cones { relaxed: true }) => ReliefMethod::TraceRelaxedCones,
        };
        let precision = MapPrecision::ALL.iter().find(|own| self == Traversal::Quantised(own.bits()));
        let precision = precision.map(|own| format!("surface.NAME.relief.map_precision={}", own.name()));
        Some(Setting::new(self.name(), [method(tracer)].into_iter().chain(precision)))
    }
}

fn relief_of(scene: &str, side: usize) -> anyhow::Result<Relief> {
    let kind = ReliefKind::ALL.into_iter().find(|kind| kind.name() == scene);
    Ok(kind.with_context(|| format!("no relief {scene:?}"))?.relief(side))
}

/// The maps of a relief: the distance maps in the order of [`Build::ALL`], the cone map, and the relaxed cone map.
struct Maps {
    distances: Vec<DistanceMap>,
    cones: [Vec<f32>; 2],
}

/// The maps of the relief that was measured last, with its scene and its side. Consecutive cells of the figure need the
/// same maps.
static LAST: Mutex<Option<(String, usize, Arc<Maps>)>> = Mutex::new(None);

fn maps(gpu: &Gpu, scene: &str, relief: &Relief, layers: usize) -> anyhow::Result<Arc<Maps>> {
    let mut last = LAST.lock().expect("no panic while maps are built");
    if let Some((of, side, maps)) = &*last
        && (&**of, *side) == (scene, relief.side)
    {
        return Ok(maps.clone());
    }
    let maps = Arc::new(built(gpu, relief, layers)?);
    *last = Some((scene.to_string(), relief.side, maps.clone()));
    Ok(maps)
}

fn built(gpu: &Gpu, relief: &Relief, layers: usize) -> anyhow::Result<Maps> {
    let (mut distances, mut cones) = (Vec::new(), [Vec::new(), Vec::new()]);
    for build in Build::ALL {
        match build {
            Build::Distances(holds, refined) => {
                let own = DistanceBuild::new(gpu, relief, layers, &Fan::new(relief.depth, holds), refined)?;
                gpu.run_pass("relief", |cmd| own.run(cmd))?;
                distances.push(own.read(gpu)?);
            }
            Build::Cones { relaxed } => {
                let own = ConeBuild::new(gpu, relief, relaxed)?;
                gpu.run_pass("relief", |cmd| own.run(cmd))?;
                cones[usize::from(relaxed)] = own.read(gpu)?;
            }
        }
    }
    Ok(Maps { distances, cones })
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let elevation = cell.x.context("a sweep")?;
    let (side, layers) = bench.effort_of((64, 16), (128, 32));
    let relief = relief_of(&cell.scene, side)?;
    let gpu = bench.gpu(&[])?;
    let columns = bench.timed_size(&gpu, 256, 2048);
    let maps = maps(&gpu, &cell.scene, &relief, layers)?;
    let Maps { distances, cones } = &*maps;
    let direction = Ray::towards([0.0; 2], elevation, 33.0).direction;
    let map_of = |build| &distances[Build::ALL.iter().position(|b| *b == build).expect("one of ALL")];
    let traces = Traversal::ALL.map(|method| {
        let tracer = match method {
            Traversal::Linear => Tracer::Linear,
            Traversal::Map(Build::Cones { relaxed: false }) => Tracer::Cones(&cones[0]),
            Traversal::Map(Build::Cones { relaxed: true }) => Tracer::RelaxedCones(&cones[1]),
            Traversal::Map(build) => Tracer::Distances(map_of(build), 32),
            Traversal::Quantised(bits) => Tracer::Distances(map_of(REFINED), bits),
        };
        Ok((method, Trace::new(&gpu, &relief, &tracer, direction, columns)?))
    });
    let traces = traces.into_iter().collect::<anyhow::Result<Vec<(Traversal, Trace)>>>()?;
    let contenders =
        traces.iter().map(|(method, trace)| Contender::pass(&gpu, method.name(), |cmd| trace.run(cmd)));
    let mut rows = bench.times(&gpu, contenders, TIME)?;
    let hits = exact_hits(&relief, direction, columns);
    let mut donnelly = Vec::new();
    for (method, trace) in &traces {
        let found = trace.read(&gpu)?;
        rows.push(Row::number(method.name(), STEPS, "steps", mean_steps(&found)));
        rows.push(Row::number(method.name(), MISSED, "", missed(&found, &hits)));
        match method {
            Traversal::Map(Build::Distances(_, false)) => donnelly = found,
            // In `Traversal::ALL`, each refined map follows Donnelly's map with the same `Holds`.
            Traversal::Map(Build::Distances(_, true)) => rows.extend(gain(&method.name(), &found, &donnelly)),
            _ => {}
        }
    }
    Ok(rows)
}

fn mean_steps(found: &[Traced]) -> f64 {
    mean(found.iter().map(|ray| f64::from(ray.steps)))
}

/// Compares the steps through a refined map with the steps through Donnelly's map, ray by ray.
fn gain(name: &str, refined: &[Traced], donnelly: &[Traced]) -> [Row; 2] {
    assert_eq!(refined.len(), donnelly.len(), "rays");
    let more = refined.iter().zip(donnelly).filter(|(refined, donnelly)| refined.steps > donnelly.steps);
    [
        Row::number(name, GAIN, "x", mean_steps(donnelly) / mean_steps(refined)),
        Row::number(name, MORE, "rays", more.count() as f64),
    ]
}

/// (Index of a ray, its exact distance) for a grid of 64 x 64 rays.
fn exact_hits(relief: &Relief, direction: [f32; 3], columns: u32) -> Vec<(usize, f64)> {
    let stride = columns / 64;
    let hit = |n: u32| {
        let at = [n % 64, n / 64].map(|c| c * stride + stride / 2);
        let ray = Ray { origin: origin(relief, columns, at), direction };
        ((at[1] * columns + at[0]) as usize, reference::first_hit(relief, &ray))
    };
    (0..64 * 64).map(hit).collect()
}

fn missed(found: &[Traced], hits: &[(usize, f64)]) -> f64 {
    let far = |&&(at, hit): &&(usize, f64)| {
        let error = (f64::from(found[at].distance) - hit).abs();
        error.is_nan() || error > f64::from(MIN_STEP) + 1e-3
    };
    hits.iter().filter(far).count() as f64 / hits.len() as f64
}

fn measure_builds(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let side = cell.x.context("a sweep")? as usize;
    let (layers, relief) = (side / 4, relief_of(&cell.scene, side)?);
    let gpu = bench.gpu(&[])?;
    let (mut rows, mut contenders) = (Vec::new(), Vec::new());
    for build in Build::ALL {
        let cells = match build {
            Build::Distances(holds, refined) => {
                let own = DistanceBuild::new(&gpu, &relief, layers, &Fan::new(relief.depth, holds), refined)?;
                contenders.push(Contender::pass(&gpu, build.name(), move |cmd| own.run(cmd)));
                side * side * layers
            }
            Build::Cones { relaxed } => {
                let own = ConeBuild::new(&gpu, &relief, relaxed)?;
                contenders.push(Contender::pass(&gpu, build.name(), move |cmd| own.run(cmd)));
                side * side
            }
        };
        rows.push(Row::number(build.name(), BYTES, "bytes", cells as f64));
    }
    rows.extend(bench.times(&gpu, contenders, BUILD)?.into_iter().filter(|row| row.variant != "empty pass"));
    Ok(rows)
}
