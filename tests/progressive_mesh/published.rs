//! Published numbers about orders and continuity, checked on the models for which they are stated.

use ortelius::model::{Model, named};
use ortelius::paper::progressive_mesh::cache::{Cache, costs_of, sampled_levels};
use ortelius::paper::progressive_mesh::choices::BuildEffort;
use ortelius::paper::progressive_mesh::order::{OrderOptions, classical, order};
use ortelius::paper::progressive_mesh::run::{Program, level_for_error};
use ortelius::paper::progressive_mesh::simplify::{Collapses, SimplifyOptions, simplify};
use ortelius::reference::distance::{Triangles, compare_surfaces};

const CLOSED: [&str; 5] = ["bunny", "sphere", "torus", "knot", "solid"];

fn collapses(model: &Model, effort: BuildEffort) -> Collapses {
    simplify(model, &SimplifyOptions { effort, ..SimplifyOptions::default() }, &mut |_, _| ()).collapses
}

fn for_batches(options: OrderOptions) -> OrderOptions {
    options.with_cache(Cache::Batches)
}

#[test]
fn our_orders_need_the_transforms_that_are_published() {
    let models = CLOSED.map(|name| named(name).unwrap());
    let simplified = models.each_ref().map(|model| collapses(model, BuildEffort::Best));
    // The published means over all levels are 1.49, 1.79, 1.23 and 1.25 for the FIFO, and 1.81, 2.05, 1.66 and 1.69 for
    // batches. Optimised for batches, births in place need 1.52 and 1.55 there, with wedges as vertices. The bounds
    // leave 0.01 to 0.03 for changes of the simplifier. The 95th percentile over the levels may exceed the mean by 0.2
    // for the tail orders and by 0.05 for the in-place orders (0.06 for the last). With the in-place orders, 6 or 12 %
    // more faces may be drawn than are live.
    for (options, max) in [
        (OrderOptions::TAIL_23, [1.50, 0.20, 1.84, 1.0]),
        (OrderOptions::TAIL_10, [1.82, 0.20, 2.09, 1.0]),
        (OrderOptions::IN_PLACE_23, [1.24, 0.05, 1.69, 1.06]),
        (OrderOptions::IN_PLACE_10, [1.26, 0.05, 1.70, 1.12]),
        (for_batches(OrderOptions::IN_PLACE_23), [1.45, 0.05, 1.53, 1.06]),
        (for_batches(OrderOptions::IN_PLACE_10), [1.47, 0.06, 1.57, 1.12]),
    ] {
        let cost = |(model, collapses): (&Model, &Collapses)| {
            let mesh = order(model, collapses, &options, &mut |_, _| ());
            let program = Program::new(&mesh).unwrap();
            let every_wedge: Vec<u32> = (0..mesh.vertices.welded.len() as u32).collect();
            let shared = if options.weld { &mesh.vertices.welded } else { &every_wedge };
            let fifo = &costs_of(&program, shared, &[Cache::Fifo(16)], &sampled_levels(&mesh, 0, 512))[0];
            let levels = sampled_levels(&mesh, 0, 64);
            let batches = costs_of(&program, shared, &[Cache::Batches], &levels)[0].mean();
            let drawn =
                |&level: &u32| f64::from(program.drawn(level)) / f64::from(mesh.levels[level as usize].faces);
            let all = sampled_levels(&mesh, 100_000, 256);
            let drawn = all.iter().map(drawn).sum::<f64>() / all.len() as f64;
            [fifo.mean(), fifo.exceeded_by(0.05) - fifo.mean(), batches, drawn]
        };
        let costs: Vec<[f64; 4]> = models.iter().zip(&simplified).map(cost).collect();
        let mean: [f64; 4] =
            std::array::from_fn(|n| costs.iter().map(|cost| cost[n]).sum::<f64>() / costs.len() as f64);
        assert!(mean.iter().zip(&max).all(|(mean, max)| mean <= max), "{mean:?}, {max:?} at most: {costs:?}");
    }
}

#[test]
fn one_percent_more_requested_error_removes_a_few_faces_and_no_stated_error_is_below_the_measured_one() {
    for name in ["bunny", "torus", "grid"] {
        let model = named(name).unwrap();
        let collapses = collapses(&model, BuildEffort::Best);
        let levels = classical(&model, &collapses).levels;
        let faces = |error: f32| levels[level_for_error(&levels, error) as usize].faces;
        let error_at =
            |max: usize| levels.iter().rev().find(|level| level.faces as usize <= max).unwrap().error;
        let (mut wanted, last) = (error_at(model.faces.len() * 9 / 10), error_at(1000));
        let (mut steps, mut rests) = (0, 0);
        while wanted * 1.01 <= last {
            let [before, now] = [wanted, wanted * 1.01].map(faces);
            assert!(
                f64::from(before - now) <= 0.025 * f64::from(before),
                "{name} at {wanted}: {before} to {now}"
            );
            (steps, rests, wanted) = (steps + 1, rests + u32::from(before == now), wanted * 1.01);
        }
        assert!(steps > 100 && 50 * rests <= steps, "{name}: {rests} of {steps} steps change nothing");
        let own: Vec<[u32; 3]> = (0..model.faces.len()).map(|face| model.face_positions(face)).collect();
        let own = Triangles { positions: &model.positions, faces: &own };
        for part in [2, 8, 30] {
            let steps = collapses.steps_to(&model, model.faces.len() / part);
            let left: Vec<[u32; 3]> = collapses
                .faces_after(&model, steps)
                .iter()
                .map(|face| face.map(|wedge| model.wedge_positions[wedge as usize]))
                .collect();
            let left = Triangles { positions: &model.positions, faces: &left };
            let found = compare_surfaces(own, left, 20_000, 1).unwrap().hausdorff;
            let stated = collapses.error_after(steps);
            assert!(found <= stated && stated < 2.5 * found, "{name}, 1/{part}: {found}, {stated} stated");
        }
    }
}

/// Level 0 has no faces: every face appears in a split.
#[test]
fn an_order_by_regions_can_begin_with_an_empty_level() {
    let model = named("torus:16").unwrap();
    let mut collapses = collapses(&model, BuildEffort::Fast);
    let left = collapses.faces_after(&model, collapses.errors.len());
    let mut live: Vec<bool> = vec![true; model.faces.len()];
    collapses.faces.items().iter().for_each(|&face| live[face as usize] = false);
    let mut wedges: Vec<u32> = left.iter().flatten().copied().collect();
    wedges.sort_unstable();
    wedges.dedup();
    collapses.wedges.push(wedges.iter().map(|&wedge| [wedge, u32::MAX]));
    collapses.faces.push((0..model.faces.len() as u32).filter(|&face| live[face as usize]));
    collapses.errors.push(1.0);
    let mesh = order(&model, &collapses, &OrderOptions::TAIL_10, &mut |_, _| ());
    assert_eq!((mesh.levels[0].faces, mesh.levels.last().unwrap().faces), (0, model.faces.len() as u32));
}
