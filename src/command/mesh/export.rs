//! `ortelius mesh export`: one level of a `.pmesh` file as a plain mesh.

use super::load;
use crate::command::Usage;
use crate::command::outputs::check_place;
use anyhow::Result;
use clap::{ArgGroup, Args};
use glam::DVec3;
use ortelius::paper::progressive_mesh::mesh::{Level, ProgressiveMesh};
use ortelius::paper::progressive_mesh::run::{State, level_for_error};
use ortelius::scene::model::{Attributes, Format, Model};
use std::path::PathBuf;

/// Writes one level as a plain mesh, its faces in the order of the index buffer.
#[derive(Args, Debug)]
#[command(group(ArgGroup::new("which").required(true)))]
pub struct ExportArgs {
    /// The file to read
    #[arg(value_name = "FILE.pmesh")]
    file: PathBuf,

    /// The level: how many splits are applied
    #[arg(long, group = "which", value_name = "L")]
    level: Option<u32>,

    /// The coarsest level whose error is at most so much, in object units: an estimate from above of its deviation
    /// (two samples a face and all vertices are measured), no bound
    #[arg(long, group = "which", value_name = "E", allow_negative_numbers = true)]
    error: Option<f32>,

    /// The level whose number of faces is nearest
    #[arg(long, group = "which", value_name = "N")]
    faces: Option<u32>,

    /// The file to write; its folder must exist
    #[arg(short, long, value_name = "OUT.{ply,obj}")]
    output: PathBuf,
}

/// Runs the subcommand. A failure carries [`Usage`], a file's error, or a
/// [`ortelius::paper::progressive_mesh::file::PmeshError`].
pub fn run(args: &ExportArgs) -> Result<()> {
    let format = Format::of(&args.output)
        .ok_or_else(|| Usage(format!("-o {}: export writes .ply and .obj", args.output.display())))?;
    let output = check_place(&args.output)?;
    let mesh = load(&args.file)?.mesh;
    let level = level(args, &mesh)?;
    let model = at_level(&mesh, level);
    model.write(&output, format)?;
    let Level { vertices, faces, error } = mesh.levels[level as usize];
    tracing::info!(
        "{}: level {level} of {}, {vertices} vertices, {faces} faces, error {error}",
        args.output.display(),
        mesh.last_level()
    );
    Ok(())
}

fn level(args: &ExportArgs, mesh: &ProgressiveMesh) -> Result<u32, Usage> {
    let last = mesh.last_level();
    match (args.level, args.error, args.faces) {
        (Some(level), ..) if level > last => {
            Err(Usage(format!("--level {level}: {} has levels 0 to {last}", args.file.display())))
        }
        (Some(level), ..) => Ok(level),
        (_, Some(error), _) if error >= 0.0 => Ok(level_for_error(&mesh.levels, error)),
        (_, Some(error), _) => Err(Usage(format!("--error {error}: it must be 0 or more"))),
        (.., Some(faces)) => Ok(nearest(&mesh.levels, faces)),
        // The group is required.
        (None, None, None) => Ok(last),
    }
}

/// The level whose faces are nearest to so many, the coarser of two.
fn nearest(levels: &[Level], faces: u32) -> u32 {
    let distance = |level: &Level| level.faces.abs_diff(faces);
    let nearest = levels.iter().enumerate().min_by_key(|(_, level)| distance(level));
    nearest.map_or(0, |(at, _)| at as u32)
}

/// A level's live faces in the order of the buffer, with the vertices that are live.
fn at_level(mesh: &ProgressiveMesh, level: u32) -> Model {
    let mut state = State::new(mesh);
    state.go_to(mesh, level);
    let live = mesh.levels[level as usize].vertices as usize;
    let vertices = &mesh.vertices;
    let (mut positions, mut wedge_positions) = (Vec::new(), Vec::with_capacity(live));
    for vertex in 0..live {
        let first = vertices.welded[vertex] as usize;
        if first == vertex {
            positions.push(vertices.centre + DVec3::from(vertices.positions[vertex].map(f64::from)));
            wedge_positions.push(positions.len() as u32 - 1);
        } else {
            wedge_positions.push(wedge_positions[first]);
        }
    }
    let attributes = &vertices.attributes;
    Model {
        positions,
        wedge_positions,
        attributes: Attributes {
            normals: attributes.normals.iter().take(live).copied().collect(),
            coordinates: attributes.coordinates.iter().take(live).copied().collect(),
            colors: attributes.colors.iter().take(live).copied().collect(),
        },
        faces: state.live(mesh).to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_level_is_taken_and_of_two_the_coarser() {
        let levels: Vec<Level> =
            [4, 6, 6, 10].map(|faces| Level { faces, ..Level::default() }).into_iter().collect();
        let found = |faces| nearest(&levels, faces);
        assert_eq!([0, 4, 5, 6, 8, 9, 99].map(found), [0, 0, 0, 1, 1, 3, 3]);
    }
}
