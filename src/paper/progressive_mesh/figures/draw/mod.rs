//! pm.draw: the effect of the order of faces on the device's draw time.

use super::orders::{CLASSICAL, IN_PLACE_10, IN_PLACE_23, PAPER, TAIL_23, simplified};
use super::{face_orders, models};
use crate::figure::prelude::*;
use crate::math::camera::Pose;
use crate::math::light::LightColours;
use crate::paper::progressive_mesh::baselines::{OrderBaseline, PreparedBaseline};
use crate::paper::progressive_mesh::cache::{Cache, drawn_faces, live_faces, transforms};
use crate::paper::progressive_mesh::choices::FaceOrder;
use crate::paper::progressive_mesh::config;
use crate::paper::progressive_mesh::mesh::ProgressiveMesh;
use crate::paper::progressive_mesh::order::{OrderOptions, order_or_classical};
use crate::paper::progressive_mesh::ordered;
use crate::paper::progressive_mesh::place::{Bounds, Placement};
use crate::paper::progressive_mesh::stand::Stand;
use crate::paper::progressive_mesh::surface::vertices::MORPH_BAND_LOG2;
use crate::paper::progressive_mesh::surface::vertices::{EXACT_LOG2, VertexBuffer, normals};
use crate::paper::progressive_mesh::technique::surfaces_pipeline;
use crate::picture::PixelFormat;
use crate::scene::Scene;
use crate::vk::shader::SurfaceView;
use crate::vk::shader::progressive_mesh::surface_vert;
use crate::vk::{
    Buffer, BufferUse, Clear, Cmd, ColorTarget, DepthTarget, Feature, Format, Frame, Gpu, GraphicsPipeline,
    Image, ImageInfo, IndexRange, IndexType, IndexedGeometry, Need,
};
use glam::DVec3;

/// The only order whose faces are not those of the level: it draws a separate, discrete mesh.
const DISCRETE: &str = FaceOrder::Discrete.name();

const SHADED: &str = "vertex invocations for each vertex";
const DRAWN: &str = "faces drawn per live face";
/// The index buffer, and one vertex for each invocation.
const FETCHED: &str = "index and vertex bytes fetched per live face";
/// Quantities: the transforms for each vertex that a cache model predicts.
const SIMULATED: [(Cache, &str); 4] = [
    (Cache::Fifo(16), "FIFO-16 transforms for each vertex"),
    (Cache::Batches, "transforms for each vertex in batches of 32 vertices and 32 triangles"),
    (Cache::H100, "transforms for each vertex in an H100's batches"),
    (Cache::Meshlets, "transforms for each vertex in meshlets of 64 vertices and 126 triangles"),
];
const TIME: &str = "draw";
const PER_VERTEX: &str = "draw, per million vertex invocations";

const HEAVY: &str = "heavy vertices";

/// `in-place-23`, optimised for devices that reuse vertices within batches.
const FOR_BATCHES: [(&str, Cache); 3] = [
    ("in-place-23, for batches", Cache::Batches),
    ("in-place-23, for an H100", Cache::H100),
    ("in-place-23, for meshlets", Cache::Meshlets),
];

/// Precondition: in the heavy draw, artificial vertex work takes at least three quarters of the time with
/// tail-23.
const VERTEX_BOUND: &[Test] =
    &[Test::ratio(one(TIME, TAIL_23).scene(HEAVY), one(TIME, TAIL_23).scene("vertices"), AtLeast(4.0))];

/// Name, rounds of artificial work per vertex, and true for the large picture.
const CELLS: [(&str, u32, bool); 3] = [("vertices", 0, false), (HEAVY, 2000, false), ("pixels", 0, true)];

/// Draws of the level per pass: a single draw would be shorter than the clock's resolution.
const DRAWS: usize = 16;

/// The figure.
pub const DRAW: Figure = Figure {
    id: "pm.draw",
    title: "Shaded vertices and draw time, by the order of faces",
    about: "The figure draws one level of the knot (half of its splits), 16 times for each order of faces that a scene \
            can name (docs/scenes.md), and for `in-place-23` optimised for batches, for an H100 and for meshlets \
            (`mesh build --cache`). Some orders are those that splits and tswaps leave; the others are the baselines' \
            orders for that level. The baselines are random order, reordering by meshoptimizer, the compacted order, a \
            skip list with its degenerate faces, and the coarsest discrete mesh that has at least as many faces as the \
            level (with its own faces and vertices). `vertices` is a picture of 64 x 36. `heavy vertices` is the same \
            with 2000 rounds of two multiplications and a subtraction per vertex: vertices are then the bottleneck of \
            any device, including software devices, and the time follows the shaded vertices. `pixels` is a large, \
            filled picture. The figure counts how often the device runs the vertex shader per vertex of the drawn \
            faces (pipeline statistics), and measures the time of the pass. The paper (headline): the cache alone \
            gains a factor of 2 to 3.5, and the whole draw up to 2 if vertices are the bottleneck. On an NVIDIA H100 \
            the counts equal the model's in all 16 orders that were measured. llvmpipe, a software device, takes 1024 \
            indices at a time and finds repeated ones with a table of 256.",
    scenes: &["vertices", "heavy vertices", "pixels"],
    variants,
    paper: &["paper"],
    ours: &["tail-23"],
    show: Show::views(|| models(&["knot"])).variants(face_orders),
    measure,
    plots: &[Plot::bars(SHADED), Plot::bars(TIME)],
    claims: &[
        Claim::paper(
            "headline",
            "device-counts",
            "The cache alone gains a factor of 2 to 3.5: by this factor the device shades fewer vertices \
             with the paper's order than with the classical order.",
            &[Test::ratio_of(SHADED, [CLASSICAL, PAPER], Within(2.0, 3.5, Better::More))],
        )
        .at(Places::scenes(&["vertices"])),
        Claim::ours(
            "new-orders-device-counts",
            "With tail-23, in-place-23 and in-place-10, the device shades at most half as many \
             vertices as with the classical order.",
            &[
                Test::ratio_of(SHADED, [CLASSICAL, TAIL_23], AtLeast(2.0)),
                Test::ratio_of(SHADED, [CLASSICAL, IN_PLACE_23], AtLeast(2.0)),
                Test::ratio_of(SHADED, [CLASSICAL, IN_PLACE_10], AtLeast(2.0)),
            ],
        )
        .at(Places::scenes(&["vertices"])),
        Claim::ours(
            "for-batches",
            "Optimised for batches, in-place-23 shades fewer vertices than optimised for a FIFO, and at most as many \
             as the faces that meshoptimizer reorders for the level.",
            &[
                Test::ratio_of(SHADED, [FOR_BATCHES[0].0, IN_PLACE_23], Below(1.0)),
                Test::ratio_of(SHADED, [FOR_BATCHES[0].0, FaceOrder::ReOptimised.name()], AtMost(1.0)),
            ],
        )
        .at(Places::scenes(&["vertices"])),
        Claim::paper_timed(
            "headline",
            "vertex-bound-draw",
            "If vertices are the bottleneck, the draw is up to 2 times faster.",
            &[Test::ratio_of(TIME, [CLASSICAL, PAPER], AtLeast(2.0))],
        )
        .at(Places::scenes(&[HEAVY]))
        .given(VERTEX_BOUND),
        Claim::ours_timed(
            "tail-vertex-bound-draw",
            "If vertices are the bottleneck, the draw is at least 2 times faster with tail-23.",
            &[Test::ratio_of(TIME, [CLASSICAL, TAIL_23], AtLeast(2.0))],
        )
        .at(Places::scenes(&[HEAVY]))
        .given(VERTEX_BOUND),
        Claim::ours_timed(
            "time-follows-vertices",
            "If vertices are the bottleneck, the draw time is proportional to the shaded vertices, within 20 \
             %.",
            &[Test::ratio(
                each(PER_VERTEX, others),
                one(PER_VERTEX, TAIL_23),
                Within(0.8, 1.2, Better::Neither),
            )],
        )
        .at(Places::scenes(&[HEAVY]))
        .given(VERTEX_BOUND),
        Claim::ours_timed(
            "pixel-bound-draw",
            "If pixels are the bottleneck, the draw times of tail-23 and the classical order differ by at most 10 %.",
            &[Test::ratio_of(TIME, [CLASSICAL, TAIL_23], Within(0.9, 1.1, Better::Neither))],
        )
        .at(Places::scenes(&["pixels"])),
    ],
    ..Figure::BASE
};

fn variants() -> Vec<String> {
    let orders = FaceOrder::ALL.iter().map(|order| order.name());
    orders.chain(FOR_BATCHES.map(|(name, _)| name)).map(str::to_owned).collect()
}

/// The orders that draw the same faces as tail-23.
fn others() -> Vec<String> {
    variants().into_iter().filter(|variant| ![TAIL_23, DISCRETE].contains(&&**variant)).collect()
}

/// State shared by the draws.
struct Still {
    pipeline: GraphicsPipeline,
    target: Image,
    depth: Image,
    views: Vec<SurfaceView>,
}

/// A level with its faces in one order.
struct Ordered {
    variant: &'static str,
    faces: Vec<[u32; 3]>,
    /// Live faces at the level.
    live_faces: u32,
    vertices: Buffer,
    /// Bytes of one vertex.
    vertex_bytes: f64,
    indices: Buffer,
}

impl Ordered {
    fn new(gpu: &Gpu, Drawn { variant, mesh, faces, level }: Drawn<'_>) -> anyhow::Result<Ordered> {
        let normals = normals(mesh, &live_faces(mesh, mesh.last_level()));
        let vertices = VertexBuffer::new(gpu, "pm.draw: vertices", mesh, &normals, false)?;
        let VertexBuffer::Plain(vertices) = vertices else { unreachable!("nothing moves here") };
        let index = IndexType::of_vertices(mesh.vertices.positions.len());
        let packed = index.packed(faces.as_flattened());
        let indices = gpu.buffer_with("pm.draw: indices", &packed, BufferUse::Indices(index))?;
        let live_faces = mesh.levels[level as usize].faces;
        let vertex_bytes = vertices.bytes() as f64 / mesh.vertices.positions.len() as f64;
        Ok(Ordered { variant, faces, live_faces, vertices, vertex_bytes, indices })
    }

    /// Bytes that a draw with this number of vertex invocations fetches.
    fn fetched_bytes(&self, invocations: f64) -> f64 {
        self.indices.bytes() as f64 + invocations * self.vertex_bytes
    }
}

impl Still {
    fn draw(&self, cmd: &mut Cmd<'_>, ordered: &Ordered) -> crate::vk::Result<()> {
        let color = ColorTarget { image: &self.target, clear: Clear::Float([0.0, 0.0, 0.0, 1.0]) };
        let depth = DepthTarget { image: &self.depth, clear: true };
        let count = 3 * ordered.faces.len() as u32;
        let slices: Vec<_> =
            self.views.iter().map(|&push| IndexRange { push, first_index: 0, count }).collect();
        cmd.render(self.target.info().size, &[color], Some(depth), |render| {
            let geometry = IndexedGeometry { vertices: Some(&ordered.vertices), indices: &ordered.indices };
            render.draw_slices(&self.pipeline, &[], geometry, &slices)
        })
    }
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let (_, work, large) =
        *CELLS.iter().find(|(name, ..)| *name == cell.scene).context("no such cell of pm.draw")?;
    let need = Need {
        feature: Feature::PipelineStatistics,
        pass: "surfaces",
        without: "choose another --device: this figure counts what the device shades",
    };
    let gpu = bench.gpu(&[need])?;
    let (orders, bounds) = orders(|drawn| Ordered::new(&gpu, drawn))?;
    let size = match (large, bench.effort) {
        (false, _) => [64, 36],
        (true, Effort::Quick) => [640, 360],
        (true, Effort::Full) => [1920, 1080],
    };
    let still = Still {
        pipeline: surfaces_pipeline(
            &gpu,
            &surface_vert::SHADER,
            PixelFormat::Srgb8,
            (work, LightColours::default()),
        )?,
        target: gpu.image("picture", ImageInfo::target(size, Format::Rgba8Srgb))?,
        depth: gpu.image("depth", ImageInfo::target(size, Format::Depth32Float))?,
        views: views(&place(&bounds)?, size),
    };
    let (mut rows, mut invocations) = (Vec::new(), Vec::new());
    for ordered in &orders {
        let shaded = counted(&gpu, &still, ordered)? as f64;
        invocations.push(shaded);
        let simulated = SIMULATED.map(|(cache, _)| transforms(cache, &ordered.faces));
        let mut row =
            |quantity, unit, number| rows.push(Row::number(ordered.variant, quantity, unit, number));
        let live_faces = f64::from(ordered.live_faces);
        row(SHADED, "", shaded / (simulated[0].vertices * DRAWS as u64) as f64);
        for ((_, quantity), simulated) in SIMULATED.iter().zip(&simulated) {
            row(quantity, "", simulated.per_vertex());
        }
        row(DRAWN, "", ordered.faces.len() as f64 / live_faces);
        row(FETCHED, "bytes", ordered.fetched_bytes(shaded / DRAWS as f64) / live_faces);
    }
    let contenders = orders.iter().map(|ordered| {
        let draw = |frame: &mut Frame<'_>| frame.pass(TIME, |cmd| still.draw(cmd, ordered));
        Contender::frame(&gpu, ordered.variant, draw)
    });
    let timed = bench.interleave(&gpu, contenders.collect())?;
    for (timed, shaded) in timed.iter().zip(invocations) {
        let each = timed.total_of_rounds().map(|rounds| rounds.iter().map(|ms| 1e6 * ms / shaded).collect());
        rows.extend([timed.row(TIME), Row::of_rounds(&timed.variant, PER_VERTEX, "ms", each)]);
    }
    Ok(rows)
}

/// A variant, its mesh, and the faces that it draws.
struct Drawn<'a> {
    variant: &'static str,
    mesh: &'a ProgressiveMesh,
    faces: Vec<[u32; 3]>,
    level: u32,
}

/// Calls `of` with the knot's middle level in the order of each variant. Returns the results, and the knot's bounds.
fn orders<T>(of: impl Fn(Drawn<'_>) -> anyhow::Result<T>) -> anyhow::Result<(Vec<T>, Bounds)> {
    let (model, collapses) = simplified("knot")?;
    let plain = ordered(&model, &collapses, FaceOrder::Classical);
    let level = plain.last_level() / 2;
    let live = live_faces(&plain, level);
    let every_vertex: Vec<u32> = (0..plain.vertices.positions.len() as u32).collect();
    let of_order = |order: FaceOrder| match OrderBaseline::of(order) {
        Some(baseline) => {
            let faces = PreparedBaseline::new(&plain, baseline, every_vertex.clone()).drawn(level, &live);
            of(Drawn { variant: order.name(), mesh: &plain, faces, level })
        }
        None => {
            let mesh = ordered(&model, &collapses, order);
            let faces = drawn_faces(&mesh, level);
            of(Drawn { variant: order.name(), mesh: &mesh, faces, level })
        }
    };
    let for_batches = FOR_BATCHES.iter().map(|&(name, cache)| {
        let options = OrderOptions::IN_PLACE_23.with_cache(cache);
        let mesh = order_or_classical(&model, &collapses, Some(&options), &mut |_, _| {});
        let faces = drawn_faces(&mesh, level);
        of(Drawn { variant: name, mesh: &mesh, faces, level })
    });
    let orders = FaceOrder::ALL.iter().copied().map(of_order).chain(for_batches);
    Ok((orders.collect::<anyhow::Result<_>>()?, Bounds::of(&plain.vertices.positions)))
}

/// The placement of a model of one metre on the ground, and the direction towards the sun.
fn place(bounds: &Bounds) -> anyhow::Result<(Placement, DVec3)> {
    let scene = Scene::embedded("bunny")?;
    let surface = config::surface(&scene, "bunny")?;
    Ok((Placement::new(&surface, bounds, &Stand::on_plane(DVec3::ZERO, 0.0)), scene.sun()))
}

/// 16 views of the whole level at a distance at which it fills the picture's height. Each is slightly nearer
/// than the one before, so that the depth test rejects no draw.
fn views((place, sun): &(Placement, DVec3), size: [u32; 2]) -> Vec<SurfaceView> {
    let view = |n: usize| {
        let pose = Pose {
            eye: place.centre - DVec3::Y * (place.radius * (2.0 - 1e-3 * n as f64)),
            right: DVec3::X,
            up: DVec3::Z,
            forward: DVec3::Y,
            vertical_fov_rad: 1.0,
            near_m: 0.01,
            height_m: f64::INFINITY,
        };
        SurfaceView {
            object_to_clip: place.object_to_clip(&pose, size).as_mat4().to_cols_array_2d(),
            sun: (place.rotation.transpose() * *sun).as_vec3().to_array(),
            wanted_log2: EXACT_LOG2,
            band_log2: MORPH_BAND_LOG2,
        }
    };
    (0..DRAWS).map(view).collect()
}

/// The number of vertex shader invocations.
fn counted(gpu: &Gpu, still: &Still, ordered: &Ordered) -> anyhow::Result<u64> {
    gpu.count_work(true);
    let passes = gpu.run_pass("count", |cmd| still.draw(cmd, ordered))?;
    gpu.count_work(false);
    Ok(passes[0].work.context("the frame was counted")?.vertex_invocations)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::{CellOutcome, Results};
    use flate2::read::GzDecoder;
    use std::io::Read;

    #[test]
    fn the_model_of_an_h100_gives_the_invocations_that_the_device_counted() {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/results/h100.json");
        let measured = Results::parse(&std::fs::read_to_string(file).unwrap()).unwrap();
        let figure = measured.figures.iter().find(|figure| figure.id == DRAW.id).unwrap();
        let CellOutcome::Rows(rows) = &figure.cells[0].outcome else { panic!("the cell was not measured") };
        let of = |variant: &str| rows.iter().find(|row| row.variant == variant && row.quantity == SHADED);
        // The lists that the device drew: later versions of the simplifier make other ones.
        let lists = std::fs::File::open(concat!(env!("CARGO_MANIFEST_DIR"), "/results/h100-pm-draw.txt.gz"));
        let mut text = String::new();
        GzDecoder::new(lists.unwrap()).read_to_string(&mut text).unwrap();
        let mut compared = 0;
        for line in text.lines() {
            let (variant, indices) = line.split_once('\t').unwrap();
            let indices: Vec<u32> = indices.split(' ').map(|index| index.parse().unwrap()).collect();
            let (faces, []) = indices.as_chunks::<3>() else {
                panic!("{variant}: a face without three corners")
            };
            let Some(measured) = of(variant).and_then(|row| row.value.number()) else { continue };
            let model = transforms(Cache::H100, faces).per_vertex();
            assert!((measured - model).abs() < 1e-9, "{variant}: {measured}, not {model}");
            compared += 1;
        }
        assert_eq!(compared, 16);
    }
}
