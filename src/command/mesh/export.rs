//! `ortelius mesh export`: writes one level of a `.pmesh` file as a plain mesh.

use super::load;
use crate::command::Usage;
use crate::command::outputs::{check_apart, check_place};
use anyhow::Result;
use clap::{ArgGroup, Args};
use glam::DVec3;
use ortelius::model::{Attributes, MeshFormat, Model};
use ortelius::paper::progressive_mesh::mesh::{Level, ProgressiveMesh};
use ortelius::paper::progressive_mesh::run::{State, level_for_error};
use std::path::PathBuf;

/// Writes one level as a plain mesh, with its faces in index-buffer order.
#[derive(Args, Debug)]
#[command(group(ArgGroup::new("which").required(true)))]
pub struct ExportArgs {
    /// The file to read
    #[arg(value_name = "FILE.pmesh")]
    file: PathBuf,

    /// The level: the number of applied splits
    #[arg(long, group = "which", value_name = "L", allow_negative_numbers = true)]
    level: Option<u32>,

    /// The coarsest level whose error is at most this, in object units. The error is an estimate of the
    /// deviation, not a bound: it is measured at all vertices and at 77 points of each face (20 if the file was
    /// built with `--effort fast`)
    #[arg(long, group = "which", value_name = "E", allow_negative_numbers = true)]
    error: Option<f32>,

    /// The level with the nearest number of faces
    #[arg(long, group = "which", value_name = "N", value_parser = clap::value_parser!(u32).range(1..), allow_negative_numbers = true)]
    faces: Option<u32>,

    /// The file to write; its folder must exist
    #[arg(short, long, value_name = "OUT.{ply,obj}")]
    output: PathBuf,
}

/// Runs the subcommand. A failure carries [`Usage`], a file's error, or a
/// [`ortelius::paper::progressive_mesh::file::PmeshError`].
pub fn run(args: &ExportArgs) -> Result<()> {
    let format = MeshFormat::of(&args.output)
        .ok_or_else(|| Usage(format!("-o {}: export writes .ply and .obj", args.output.display())))?;
    let output = check_place(&args.output)?;
    check_apart(&output, &args.file)?;
    let mesh = load(&args.file)?.mesh;
    let level = level(args, &mesh)?;
    let model = at_level(&mesh, level, format);
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
        // clap requires one option of the group.
        (None, None, None) => Ok(last),
    }
}

/// The level whose face count is nearest to `faces`; of two equally near levels, the coarser level.
fn nearest(levels: &[Level], faces: u32) -> u32 {
    let distance = |level: &Level| level.faces.abs_diff(faces);
    let nearest = levels.iter().enumerate().min_by_key(|(_, level)| distance(level));
    nearest.map_or(0, |(at, _)| at as u32)
}

/// A level's live faces in index-buffer order, with its live vertices. Positions use as few digits as `format`
/// allows.
fn at_level(mesh: &ProgressiveMesh, level: u32, format: MeshFormat) -> Model {
    let mut state = State::new(mesh);
    state.go_to(mesh, level);
    let live = mesh.levels[level as usize].vertices as usize;
    let vertices = &mesh.vertices;
    let (mut positions, mut wedge_positions) = (Vec::new(), Vec::with_capacity(live));
    for vertex in 0..live {
        let first = vertices.welded[vertex] as usize;
        if first == vertex {
            let stored = vertices.positions[vertex];
            let place = |axis: usize| plain(vertices.centre[axis], stored[axis], format);
            positions.push(DVec3::from_array(std::array::from_fn(place)));
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

/// A coordinate whose offset from the centre rounds to the stored f32. OBJ: the number with the fewest digits, at least
/// six. PLY: the nearest f32. If no OBJ or PLY number satisfies this, the result is the f64 sum. Most of its seventeen
/// digits are noise.
fn plain(centre: f64, stored: f32, format: MeshFormat) -> f64 {
    let sum = centre + f64::from(stored);
    let is_stored = |place: &f64| (place - centre) as f32 == stored;
    let plainest = match format {
        MeshFormat::Ply => Some(f64::from(sum as f32)).filter(is_stored),
        MeshFormat::Obj => {
            (5..17).filter_map(|digits| rounded(sum, digits - lost(sum, stored))).find(is_stored)
        }
    };
    plainest.unwrap_or(sum)
}

/// Number of leading digits that cancel because the sum is smaller than `stored`.
fn lost(sum: f64, stored: f32) -> i32 {
    let digits = (f64::from(stored) / sum).abs().log10();
    if digits.is_finite() { (digits as i32).max(0) } else { 0 }
}

/// Rounds to `digits` digits after the first; to 0 if `digits` is negative.
fn rounded(number: f64, digits: i32) -> Option<f64> {
    match usize::try_from(digits) {
        Ok(digits) => format!("{number:.digits$e}").parse().ok(),
        Err(_) => Some(0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coordinate_is_written_with_the_fewest_digits_that_identify_the_stored_number() {
        // Coordinates as in a text file, each with the centre. These coordinates are recovered exactly.
        for (place, centre) in
            [(0.1, 0.0), (0.1, 3.7), (-12.345678, 5.0), (1e6 + 0.25, 1e6), (7e-20, 0.0), (0.0, 0.1)]
        {
            let stored = (place - centre) as f32;
            assert_eq!(plain(centre, stored, MeshFormat::Obj), place, "about {centre}");
        }
        // Other coordinates at least round to the same f32 of the mesh, in both formats.
        for n in 0..10_000_u32 {
            let stored = f32::from_bits(n.wrapping_mul(0x9E37_79B9));
            for centre in [0.0, -1.0 / 3.0, 1e9] {
                for format in [MeshFormat::Obj, MeshFormat::Ply] {
                    let place = plain(centre, stored, format);
                    let sum = centre + f64::from(stored);
                    assert!(
                        !stored.is_finite() || (place - centre) as f32 == (sum - centre) as f32,
                        "{stored} {centre}"
                    );
                }
            }
        }
        let single = f64::from(1.1_f32);
        assert_eq!(plain(1.0, (single - 1.0) as f32, MeshFormat::Ply), single);
    }

    #[test]
    fn the_nearest_level_is_chosen_and_of_two_the_coarser() {
        let levels: Vec<Level> =
            [4, 6, 6, 10].map(|faces| Level { faces, ..Level::default() }).into_iter().collect();
        let found = |faces| nearest(&levels, faces);
        assert_eq!([0, 4, 5, 6, 8, 9, 99].map(found), [0, 0, 0, 1, 1, 3, 3]);
    }
}
