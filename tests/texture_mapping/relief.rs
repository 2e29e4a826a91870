//! Relief: maps built on the GPU equal maps built on the CPU to the bit, guaranteed maps never step past the surface,
//! and the GPU's tracers find the hits of the f64 reference.

use ortelius::paper::texture_mapping::relief::maps::{self, DistanceMap, Fan, Holds};
use ortelius::paper::texture_mapping::relief::pass::{ConeBuild, DistanceBuild, Trace, origin};
use ortelius::paper::texture_mapping::relief::shipped::{BRICK_WALL, CLIFF, Shipped};
use ortelius::paper::texture_mapping::relief::trace::{self, MIN_STEP, Traced, Tracer};
use ortelius::paper::texture_mapping::relief::{Ray, Relief, ReliefKind, reference};
use ortelius::vk::{Cmd, Gpu, GpuOptions, Watched};

const SIDE: usize = 32;
const LAYERS: usize = 8;
const COLUMNS: u32 = 96;

fn run(gpu: &Gpu, record: impl FnOnce(&mut Cmd<'_>) -> ortelius::vk::Result<()>) {
    gpu.run_pass("relief", record).unwrap();
}

/// Donnelly's map and the refined map.
fn both(relief: &Relief, holds: Holds) -> [DistanceMap; 2] {
    let fan = Fan::new(relief.depth, holds);
    [false, true].map(|refined| maps::distance_map(relief, LAYERS, &fan, refined))
}

/// Rays from every texel of [`SIDE`] x [`SIDE`] in 64 directions: 16 azimuths at 4 elevations.
fn rays() -> impl Iterator<Item = Ray> {
    rays_of(SIDE)
}

fn rays_of(side: usize) -> impl Iterator<Item = Ray> {
    let directions =
        (0..64u32).map(|n| ([80.0, 60.0, 30.0, 15.0][n as usize % 4], f64::from(n / 4) * 22.5 + 3.1));
    directions.flat_map(move |(elevation, azimuth)| {
        (0..side * side).map(move |at| {
            let texel = [at % side, at / side].map(|c| c as f32 + 0.37);
            Ray::towards(texel, elevation, azimuth)
        })
    })
}

/// A shipped relief with every n-th of its texels along both axes, so that `side` x `side` are left. A mean of texels
/// would be smoother than the relief.
fn thinned(shipped: &Shipped, side: usize) -> Relief {
    let relief = shipped.relief();
    let step = relief.side / side;
    let height = |at: usize| relief.heights[at / side * step * relief.side + at % side * step];
    Relief { side, depth: side as f32 / 4.0, heights: (0..side * side).map(height).collect() }
}

/// For each tracer, the number of steps that start before the first hit and end behind it, over all rays. Only
/// guaranteed steps and steps longer than the least step count.
fn steps_past(relief: &Relief, tracers: &[Tracer<'_>]) -> Vec<usize> {
    let mut past = vec![0; tracers.len()];
    for ray in rays_of(relief.side) {
        let hit = reference::first_hit(relief, &ray);
        for (tracer, past) in tracers.iter().zip(&mut past) {
            trace::traced(relief, tracer, &ray, |from, to, by_map| {
                // Positions in f32, up to 128 texels, have an error of at most 2^-17 texels. At 15 degrees, the error
                // of the distance to a hit is 4 times as large.
                let long = by_map || to - from > 1.01 * MIN_STEP;
                *past += usize::from(long && f64::from(from) < hit && f64::from(to) > hit + 1e-4);
            });
        }
    }
    past
}

#[test]
fn no_step_of_a_guaranteed_map_passes_the_surface_whatever_its_format() {
    let generated = ReliefKind::ALL.map(|kind| (kind.name(), kind.relief(SIDE)));
    let shipped = [("brick-wall", &BRICK_WALL), ("cliff", &CLIFF)];
    let shipped = shipped.map(|(name, relief)| (name, thinned(relief, 2 * SIDE)));
    for (name, relief) in generated.into_iter().chain(shipped) {
        let maps = both(&relief, Holds::Everywhere);
        let formats: Vec<_> =
            maps.iter().flat_map(|map| [8, 16, 32].map(|bits| map.rounded_down(bits))).collect();
        let tracers: Vec<_> = formats.iter().map(|map| Tracer::Distances(map, 32)).collect();
        assert_eq!(steps_past(&relief, &tracers), [0; 6], "{name}");
    }
}

/// Dummer's cones contain no texel, but between texels the surface may reach into a cone. So the tracer tests the end
/// of each step.
#[test]
fn few_steps_of_a_cone_map_pass_the_surface_and_many_of_a_relaxed_one() {
    let past = ReliefKind::ALL.map(|kind| {
        let relief = kind.relief(SIDE);
        let [free, relaxed] = [false, true].map(|relaxed| maps::cone_map(&relief, relaxed));
        steps_past(&relief, &[Tracer::Cones(&free), Tracer::Cones(&relaxed)])
    });
    println!("{past:?} steps of {} rays", rays().count());
    let [few, many] = [0, 1].map(|n| past.iter().map(|past| past[n]).sum::<usize>());
    assert!(few * 100 <= ReliefKind::ALL.len() * rays().count() && many > 10 * few, "{past:?}");
}

/// Shows that the test can fail: for distances that are three times as long, and for the paper's distances, which hold
/// only at the cells' centres.
#[test]
fn steps_of_longer_distances_pass_the_surface() {
    let relief = ReliefKind::Spikes.relief(SIDE);
    let [donnelly, _] = both(&relief, Holds::Everywhere);
    let longer = donnelly.distances.iter().map(|distance| 3.0 * distance).collect();
    let [_, at_centres] = both(&relief, Holds::AtCentres);
    let longer = DistanceMap { distances: longer, ..donnelly };
    let past = steps_past(&relief, &[&longer, &at_centres].map(|map| Tracer::Distances(map, 32)));
    assert!(past.iter().all(|&past| past > 0), "{past:?}");
    for (name, shipped) in [("brick-wall", &BRICK_WALL), ("cliff", &CLIFF)] {
        let relief = thinned(shipped, SIDE);
        let [_, at_centres] = both(&relief, Holds::AtCentres);
        let past = steps_past(&relief, &[Tracer::Distances(&at_centres, 32)]);
        assert!(past[0] > 0, "{name}");
    }
}

#[test]
fn a_refined_distance_is_nowhere_shorter_and_all_rays_together_take_hardly_more_steps() {
    for holds in [Holds::AtCentres, Holds::Everywhere] {
        let mut longer = 0;
        for kind in ReliefKind::ALL {
            let relief = kind.relief(SIDE);
            let [donnelly, refined] = both(&relief, holds);
            for (donnelly, refined) in donnelly.distances.iter().zip(&refined.distances) {
                assert!(refined >= donnelly, "{} {holds:?}", kind.name());
                longer += usize::from(refined > donnelly);
            }
            let steps = |map| {
                rays()
                    .map(|ray| {
                        let tracer = Tracer::Distances(map, 32);
                        u64::from(trace::traced(&relief, &tracer, &ray, |_, _, _| ()).steps)
                    })
                    .sum::<u64>()
            };
            let (before, after) = (steps(&donnelly), steps(&refined));
            // A longer step may end in a cell with a shorter distance, so single rays may take more steps. All rays
            // together take at most 1/2000 more.
            assert!(after * 2000 <= before * 2001, "{} {holds:?}: {after} instead of {before}", kind.name());
        }
        assert!(longer > 0, "{holds:?}: nothing is refined");
    }
}

/// A counterexample to "no ray takes more steps". All numbers can be checked by hand.
///
/// A square well of 7 x 7 cells is 9 texels deep; cells are 1 texel high. A ray descends in the middle, 3 texels from
/// every wall. Layer n holds the heights n to n + 1, so its distance to the floor is n.
///
/// Donnelly's distances are min(3, n). The ray steps from 9 to 6, 3 and 0, and its fourth step ends below the floor.
///
/// The refined distance of layer 6 is longer than 3, because a ray that reaches this layer between the walls is steep:
/// behind it, the top of the well is 2 above the layer. Cells of the top begin 5 cells away. The nearest wall cells
/// that count are beside the middle ones, up to 34 degrees from the wall's normal. At 6 texels in such a direction a
/// point may still be in a wall cell, 6 cos(34) - 1 < 4; at 7 texels it is not. So the horizon's slope is 2/7, and a
/// wall point at 3 texels counts only below a drop of 6/7: the distance is sqrt(9 + 36/49) = 3.12. The second step ends
/// at 2.88, 0.12 lower than Donnelly's, but already in layer 2, whose distance is 2 instead of 3. The third step ends
/// at 0.88 instead of 0, in layer 0, whose distance is 0. Two least steps of 0.5 follow: five steps instead of four.
#[test]
fn a_longer_step_into_a_cell_with_a_shorter_distance_costs_a_ray_one_more_step() {
    let inside = |at: usize| (4..=11).contains(&at);
    let height = |at: usize| if inside(at % 16) && inside(at / 16) { 0 } else { 255 };
    let well = Relief { side: 16, depth: 9.0, heights: (0..256).map(height).collect() };
    let fan = Fan::new(well.depth, Holds::Everywhere);
    let maps = [false, true].map(|refined| maps::distance_map(&well, 9, &fan, refined));
    let ray = Ray { origin: [7.5, 7.5], direction: [0.0, 0.0, -1.0] };
    let heights = maps.each_ref().map(|map| {
        let mut ends = Vec::new();
        let found = trace::traced(&well, &Tracer::Distances(map, 32), &ray, |_, to, _| ends.push(9.0 - to));
        assert_eq!((found.steps as usize, (found.distance - 9.0).abs() < 0.01), (ends.len(), true));
        ends
    });
    let second = 6.0 - (9.0f32 + 36.0 / 49.0).sqrt();
    let expected = [vec![6.0, 3.0, 0.0, -0.5], vec![6.0, second, second - 2.0, second - 2.5, second - 3.0]];
    for (found, expected) in heights.iter().zip(&expected) {
        let near = found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-5);
        assert!(found.len() == expected.len() && near, "{found:?}, not {expected:?}");
    }
    // With the exact distances min(3, height), the refined ray steps to 6, 2.88 and 0, as many steps as Donnelly's.
    let exact = |from: f32| from - 3f32.min(from);
    assert_eq!((exact(exact(6.0)), exact(second)), (0.0, 0.0));
}

#[test]
fn maps_of_the_gpu_equal_those_of_the_cpu_to_the_bit() {
    let gpu = Watched::open(&GpuOptions::default());
    for (kind, holds) in
        ReliefKind::ALL.into_iter().flat_map(|kind| [(kind, Holds::AtCentres), (kind, Holds::Everywhere)])
    {
        let relief = kind.relief(SIDE);
        let fan = Fan::new(relief.depth, holds);
        for refined in [false, true] {
            let build = DistanceBuild::new(&gpu, &relief, LAYERS, &fan, refined).unwrap();
            run(&gpu, |cmd| build.run(cmd));
            let (found, wanted) =
                (build.read(&gpu).unwrap(), maps::distance_map(&relief, LAYERS, &fan, refined));
            let unequal = found.distances.iter().zip(&wanted.distances).position(|(a, b)| a != b);
            let at = unequal.map(|at| (at, found.distances[at], wanted.distances[at]));
            assert_eq!(at, None, "{} {holds:?} refined: {refined}", kind.name());
        }
    }
}

#[test]
fn cones_of_the_gpu_are_those_of_the_cpu_up_to_a_division() {
    let gpu = Watched::open(&GpuOptions::default());
    let relief = ReliefKind::Rock.relief(SIDE);
    let [free, relaxed] = [false, true].map(|relaxed| {
        let build = ConeBuild::new(&gpu, &relief, relaxed).unwrap();
        run(&gpu, |cmd| build.run(cmd));
        (build.read(&gpu).unwrap(), maps::cone_map(&relief, relaxed))
    });
    // A square root has an error of up to 3 ulp, a division 2.5 ulp.
    let far = |(found, wanted): (&f32, &f32)| (found - wanted).abs() > 6.0 * f32::EPSILON * wanted;
    let count =
        |(found, wanted): &(Vec<f32>, Vec<f32>)| found.iter().zip(wanted).filter(|&pair| far(pair)).count();
    assert_eq!(count(&free), 0);
    // If a step inside the solid ends at a texel's border, rounding may choose either side.
    assert!(count(&relaxed) * 100 <= SIDE * SIDE, "{} relaxed cones differ", count(&relaxed));
    let wider = relaxed.1.iter().zip(&free.1);
    assert!(
        wider.clone().all(|(relaxed, free)| relaxed >= free)
            && wider.clone().any(|(relaxed, free)| relaxed > free)
    );
}

/// All rays of one direction, each with the GPU's result.
fn traced(gpu: &Gpu, relief: &Relief, tracer: &Tracer<'_>, elevation: f64) -> Vec<(Ray, Traced)> {
    let direction = Ray::towards([0.0; 2], elevation, 33.0).direction;
    let trace = Trace::new(gpu, relief, tracer, direction, COLUMNS).unwrap();
    run(gpu, |cmd| trace.run(cmd));
    let found = trace.read(gpu).unwrap();
    assert_eq!(found.len(), (COLUMNS * COLUMNS) as usize);
    let ray = |at: usize| {
        let at = at as u32;
        Ray { origin: origin(relief, COLUMNS, [at % COLUMNS, at / COLUMNS]), direction }
    };
    found.into_iter().enumerate().map(|(at, traced)| (ray(at), traced)).collect()
}

/// Height in f64 of a ray's point above the surface.
fn above(relief: &Relief, ray: &Ray, t: f64) -> f64 {
    let [x, y] = [0, 1].map(|n| f64::from(ray.origin[n]) + t * f64::from(ray.direction[n]));
    let [a, b, c, d] = relief.corners(x.floor() as i64, y.floor() as i64).map(f64::from);
    let (fx, fy) = (x - x.floor(), y - y.floor());
    let height = (a * (1.0 - fx) + b * fx) * (1.0 - fy) + (c * (1.0 - fx) + d * fx) * fy;
    f64::from(relief.depth) + t * f64::from(ray.direction[2]) - height
}

/// The number of rays that do not end at a crossing. A crossing is a point below the surface, not before the first hit,
/// with a point above the surface at most one bisected step before it.
fn beside_crossings(relief: &Relief, found: &[(Ray, Traced)], tracer: &Tracer<'_>) -> usize {
    // Positions in f32 have an error of at most 2^-18 texels here. The error of a height is at most this error times
    // the steepest slope, which is the depth.
    let slack = 1e-4;
    let beside = |(ray, traced): &&(Ray, Traced)| {
        let mut step = MIN_STEP;
        trace::traced(relief, tracer, ray, |from, to, _| step = MIN_STEP.max(to - from));
        let halvings = match tracer {
            Tracer::RelaxedCones(_) => trace::RELAXED_HALVINGS,
            _ => trace::HALVINGS,
        };
        let (end, width) = (f64::from(traced.distance), f64::from(step) / f64::from(1 << halvings));
        let is_crossing = above(relief, ray, end) <= slack && above(relief, ray, end - width) >= -slack;
        !is_crossing || end < reference::first_hit(relief, ray) - slack
    };
    found.iter().filter(beside).count()
}

/// The share of rays whose hit is more than the least step from the exact hit.
fn missed(relief: &Relief, found: &[(Ray, Traced)]) -> f64 {
    let far = |(ray, traced): &&(Ray, Traced)| {
        let error = (f64::from(traced.distance) - reference::first_hit(relief, ray)).abs();
        error.is_nan() || error > f64::from(MIN_STEP) + 1e-3
    };
    found.iter().filter(far).count() as f64 / found.len() as f64
}

#[test]
fn tracing_by_distances_on_the_gpu_equals_its_twin_in_every_step() {
    let gpu = Watched::open(&GpuOptions::default());
    for (kind, elevation) in ReliefKind::ALL.into_iter().zip([80.0, 45.0, 30.0, 15.0]) {
        let relief = kind.relief(SIDE);
        let [_, refined] = both(&relief, Holds::Everywhere);
        for bits in [8, 16, 32] {
            let found = traced(&gpu, &relief, &Tracer::Distances(&refined, bits), elevation);
            let map = refined.rounded_down(bits);
            let tracer = Tracer::Distances(&map, 32);
            for (ray, traced) in &found {
                let twin = trace::traced(&relief, &tracer, ray, |_, _, _| ());
                assert_eq!(*traced, twin, "{}, {bits} bits, {ray:?}", kind.name());
            }
            // At grazing angles on rough relief, the least step may jump over a crest that is thinner than the step.
            let missed = missed(&relief, &found);
            assert!(missed <= 0.05, "{}, {bits} bits: {missed} of the rays miss", kind.name());
        }
    }
}

#[test]
fn the_baselines_find_most_hits_of_a_smooth_relief_seen_steeply() {
    let gpu = Watched::open(&GpuOptions::default());
    let relief = ReliefKind::Rock.relief(SIDE);
    let [free, relaxed] = [false, true].map(|relaxed| maps::cone_map(&relief, relaxed));
    for tracer in [Tracer::Linear, Tracer::Cones(&free), Tracer::RelaxedCones(&relaxed)] {
        let missed = missed(&relief, &traced(&gpu, &relief, &tracer, 60.0));
        assert!(missed <= 0.02, "{tracer:.20?}: {missed} of the rays miss");
    }
}

/// A tracer, and two copies with longer and with shorter steps. The difference exceeds the rounding of a division (2.5
/// ulp) and a square root (3 ulp). For linear search, the two copies trace a ray that descends slower or faster
/// instead.
struct Rounded<'a> {
    tracers: [Tracer<'a>; 3],
}

const ROUNDED: [f32; 3] = [1.0, 1.0 - 16.0 * f32::EPSILON, 1.0 + 16.0 * f32::EPSILON];

impl Rounded<'_> {
    /// The twin's results for a ray.
    fn twins(&self, relief: &Relief, ray: &Ray) -> [Traced; 3] {
        [0, 1, 2].map(|n| {
            let [x, y, z] = ray.direction;
            let ray = match self.tracers[n] {
                Tracer::Linear => Ray { direction: [x, y, ROUNDED[n] * z], ..*ray },
                _ => *ray,
            };
            trace::traced(relief, &self.tracers[n], &ray, |_, _, _| ())
        })
    }

    /// Two numbers of rays. The first counts rays whose steps or hit (by more than 1e-3 texels) differ from the twin's
    /// result, although rounding does not change this result. The second counts rays for which rounding changes the
    /// twin's result.
    fn differ(&self, relief: &Relief, found: &[(Ray, Traced)]) -> [usize; 2] {
        let same = |a: &Traced, b: &Traced| a.steps == b.steps && (a.distance - b.distance).abs() <= 1e-3;
        let mut counts = [0; 2];
        for (ray, traced) in found {
            let [twin, others @ ..] = self.twins(relief, ray);
            let decided = others.iter().all(|other| same(other, &twin));
            counts[0] += usize::from(decided && !same(traced, &twin));
            counts[1] += usize::from(!decided);
        }
        counts
    }
}

#[test]
fn linear_search_and_cones_on_the_gpu_equal_their_twins_up_to_rounding_and_end_at_crossings() {
    let gpu = Watched::open(&GpuOptions::default());
    for (kind, elevation) in
        ReliefKind::ALL.into_iter().flat_map(|kind| [75.0, 45.0, 20.0].map(|elevation| (kind, elevation)))
    {
        let relief = kind.relief(SIDE);
        let cones = [false, true].map(|relaxed| {
            let cones = maps::cone_map(&relief, relaxed);
            ROUNDED.map(|factor| cones.iter().map(|cone| factor * cone).collect::<Vec<_>>())
        });
        let all = [
            Rounded { tracers: [Tracer::Linear; 3] },
            Rounded { tracers: cones[0].each_ref().map(|cones| Tracer::Cones(cones)) },
            Rounded { tracers: cones[1].each_ref().map(|cones| Tracer::RelaxedCones(cones)) },
        ];
        let found = all.each_ref().map(|rounded| traced(&gpu, &relief, &rounded.tracers[0], elevation));
        for (name, (rounded, found)) in
            ["linear", "cones", "relaxed cones"].iter().zip(all.iter().zip(&found))
        {
            let [wrong, undecided] = rounded.differ(&relief, found);
            let beside = beside_crossings(&relief, found, &rounded.tracers[0]);
            let of = format!("{} at {elevation} by {name}", kind.name());
            println!("{of}: {wrong} differ, {undecided} undecided, {beside} beside a crossing");
            // The last step of linear search ends exactly on the floor.
            let max = if matches!(rounded.tracers[0], Tracer::Linear) { 90 } else { 10 };
            assert!(wrong == 0 && undecided * 100 <= found.len() * max && beside == 0, "{of}");
        }
        // The comparison rejects the results of another tracer, and hits that are half a texel further along the ray.
        let others = [all[1].differ(&relief, &found[0])[0], all[2].differ(&relief, &found[1])[0]];
        assert!(others.iter().all(|&count| count * 10 > found[0].len()), "{}: {others:?}", kind.name());
        let further = |(ray, traced): &(Ray, Traced)| {
            (*ray, Traced { distance: traced.distance + 0.5, ..traced.clone() })
        };
        let further: Vec<_> = found[0].iter().map(further).collect();
        assert!(beside_crossings(&relief, &further, &Tracer::Linear) * 2 > further.len(), "{}", kind.name());
    }
}
