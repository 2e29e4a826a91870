//! `ortelius mesh info`: describes the content of a `.pmesh` file.

use super::load;
use crate::command::say;
use anyhow::Result;
use clap::Args;
use ortelius::header::JsonFormat;
use ortelius::paper::progressive_mesh::cache::{Cache, LevelCosts, costs_of, sampled_levels};
use ortelius::paper::progressive_mesh::choices::ErrorMetric;
use ortelius::paper::progressive_mesh::file::{Contents, Extent, version};
use ortelius::paper::progressive_mesh::mesh::{Births, Level, ProgressiveMesh};
use ortelius::paper::progressive_mesh::run::Program;
use ortelius::stats::mean;
use serde::Serialize;
use std::path::PathBuf;

/// Prints levels with their errors, sizes by content, and what the face order costs: transforms per vertex with a
/// vertex cache and in batches, and drawn faces per live face. An error is an estimate of a level's deviation: usually
/// too high, but not a bound.
#[derive(Args, Debug)]
pub struct InfoArgs {
    /// The file to describe
    #[arg(value_name = "FILE.pmesh")]
    file: PathBuf,

    /// Print JSON on stdout
    #[arg(long)]
    json: bool,
}

/// In version 1 of this JSON, the key `version` held the version of the .pmesh format. In version 2, one of the sizes
/// had another name.
const FORMAT: JsonFormat = JsonFormat::new("ortelius-mesh-info", 3);

/// All printed data, in one shape for both outputs.
#[derive(Serialize)]
struct Info {
    pmesh_version: u32,
    births_in_place: bool,
    bytes: u64,
    /// True if the end of the file is missing. Then the fields after `whole` describe the existing part.
    cut: bool,
    /// As the header states it.
    whole: Parts,
    chunks: u32,
    /// Number of levels, including level 0.
    levels: usize,
    coarsest: LevelInfo,
    finest: LevelInfo,
    /// Explains the levels' errors.
    errors_are: &'static str,
    /// The name of the [`ErrorMetric`] with which the errors were measured; `None` if the file does not record it.
    metric: Option<&'static str>,
    attributes: Vec<&'static str>,
    permutations: usize,
    moved_faces_per_split: f64,
    /// Statistics over the levels, for a FIFO cache of 16 entries.
    transforms_per_vertex: Transforms,
    /// The same for batches of 32 vertices and 32 triangles. In both, wedges at one position count as one vertex.
    transforms_per_vertex_in_batches: Transforms,
    /// A mean over the same levels: more than 1 if unborn faces are drawn.
    drawn_faces_per_live_face: f64,
    sizes: Vec<Size>,
    /// Without positions, attributes and header.
    bytes_per_split: f64,
}

#[derive(Serialize)]
struct Parts {
    chunks: u32,
    levels: u32,
    vertices: u32,
    faces: u32,
}

#[derive(Serialize)]
struct LevelInfo {
    vertices: u32,
    faces: u32,
    error: f32,
}

#[derive(Serialize)]
struct Transforms {
    levels_measured: usize,
    mean: f64,
    p95: f64,
    worst: f64,
}

#[derive(Serialize)]
struct Size {
    content: &'static str,
    bytes: f64,
    bytes_per_split: f64,
}

/// Runs the subcommand. A failure carries a [`ortelius::paper::progressive_mesh::file::PmeshError`].
pub fn run(args: &InfoArgs) -> Result<()> {
    let loaded = load(&args.file)?;
    let info = Info::of(&loaded.mesh, &loaded.contents);
    if args.json {
        return say(serde_json::to_string_pretty(&FORMAT.head(&info))?);
    }
    info.lines().iter().try_for_each(say)
}

impl Info {
    fn of(mesh: &ProgressiveMesh, contents: &Contents) -> Info {
        // Each split is a level; on a seam it adds several vertices.
        let splits = f64::from(mesh.last_level().max(1));
        // The paper's mean is over all levels. For 100 000 faces that takes some seconds; larger meshes are sampled at
        // 256 levels.
        let levels = sampled_levels(mesh, 100_000, 256);
        let program = Program::new(mesh).unwrap_or_else(|flaw| panic!("a checked mesh: {flaw}"));
        let caches = [Cache::Fifo(16), Cache::Batches];
        let costs = costs_of(&program, &mesh.vertices.welded, &caches, &levels);
        // Level 0 can be empty.
        let drawn = |&level: &u32| {
            let live = mesh.levels[level as usize].faces;
            (live > 0).then(|| f64::from(program.drawn(level)) / f64::from(live))
        };
        let attributes = &mesh.vertices.attributes;
        let attributes = [
            ("normals", attributes.normals.len()),
            ("coordinates", attributes.coordinates.len()),
            ("colors", attributes.colors.len()),
        ];
        let size = |content, bytes: f64| Size { content, bytes, bytes_per_split: bytes / splits };
        let named = contents.sizes.named().map(|(content, bits)| size(content, bits / 8.0));
        Info {
            pmesh_version: version(mesh),
            births_in_place: mesh.births == Births::InPlace,
            bytes: contents.bytes,
            cut: contents.is_cut(),
            whole: contents.whole.into(),
            chunks: contents.read.chunks,
            levels: mesh.levels.len(),
            coarsest: mesh.levels[0].into(),
            finest: mesh.levels[mesh.levels.len() - 1].into(),
            errors_are: "in object units; estimates of the deviation from the finest level: usually too high, but not \
                         upper bounds",
            metric: mesh.metric.map(ErrorMetric::name),
            attributes: attributes.iter().filter(|(_, count)| *count > 0).map(|(name, _)| *name).collect(),
            permutations: mesh.swaps.levels.len(),
            moved_faces_per_split: mesh.swaps.cycles.items().len() as f64 / splits,
            transforms_per_vertex: (&costs[0]).into(),
            transforms_per_vertex_in_batches: (&costs[1]).into(),
            drawn_faces_per_live_face: mean(levels.iter().filter_map(drawn)),
            sizes: named
                .into_iter()
                .chain([size("headers of file and chunks", contents.frame_bytes)])
                .collect(),
            bytes_per_split: contents.bytes_per_split(mesh),
        }
    }

    fn lines(&self) -> Vec<String> {
        let level = |level: &LevelInfo| {
            format!("{} vertices, {} faces, error {}", level.vertices, level.faces, level.error)
        };
        let attributes = match &self.attributes[..] {
            [] => "none".to_owned(),
            names => names.join(", "),
        };
        let transforms = |label: &str, costs: &Transforms, cache: &str| {
            format!(
                "{label:13} {:.3} per vertex on average over {} levels (p95 {:.3}, worst {:.3}); {cache}",
                costs.mean, costs.levels_measured, costs.p95, costs.worst
            )
        };
        let mut lines = vec![
            format!(
                "file          version {}, {} bytes, {} chunks",
                self.pmesh_version, self.bytes, self.chunks
            ),
            format!("levels        {}", self.levels),
            format!("coarsest      {}", level(&self.coarsest)),
            format!("finest        {}", level(&self.finest)),
            format!("errors        {}", self.errors_are),
            format!("metric        {}", self.metric.unwrap_or("not recorded")),
            format!("attributes    {attributes}"),
            format!(
                "tswaps        in {} levels, {:.2} faces moved per split; new faces {}",
                self.permutations,
                self.moved_faces_per_split,
                if self.births_in_place { "in place" } else { "at the tail" }
            ),
            format!("drawn         {:.3} faces for each live face", self.drawn_faces_per_live_face),
            transforms("transforms", &self.transforms_per_vertex, "FIFO of 16"),
            transforms("in batches", &self.transforms_per_vertex_in_batches, "32 vertices and 32 triangles"),
        ];
        lines.push("content                   bytes  per split".to_owned());
        lines.extend(
            self.sizes.iter().map(|size| {
                format!("  {:18} {:10.0} {:10.2}", size.content, size.bytes, size.bytes_per_split)
            }),
        );
        lines.push(format!(
            "without positions, attributes and header: {:.2} bytes per split",
            self.bytes_per_split
        ));
        lines
    }
}

impl From<&LevelCosts> for Transforms {
    fn from(costs: &LevelCosts) -> Self {
        Self {
            levels_measured: costs.levels.len(),
            mean: costs.mean(),
            p95: costs.exceeded_by(0.05),
            worst: costs.exceeded_by(0.0),
        }
    }
}

impl From<Level> for LevelInfo {
    fn from(Level { vertices, faces, error }: Level) -> Self {
        Self { vertices, faces, error }
    }
}

impl From<Extent> for Parts {
    fn from(Extent { chunks, levels, vertices, faces }: Extent) -> Self {
        Self { chunks, levels, vertices, faces }
    }
}
