//! `ortelius mesh verify`: every byte and every level of a `.pmesh` file.

use crate::command::say;
use anyhow::Result;
use clap::Args;
use ortelius::paper::progressive_mesh::mesh::ProgressiveMesh;
use ortelius::paper::progressive_mesh::run::State;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Checks every byte of a .pmesh file against its checksums, that all levels can be reached, and that the way from the
/// coarsest level to the full mesh and back gives the same buffer of faces to the last bit.
#[derive(Args, Debug)]
pub struct VerifyArgs {
    /// The file to check
    #[arg(value_name = "FILE.pmesh")]
    file: PathBuf,
}

/// A file that can be read but is not a complete, valid progressive mesh: exit code 3.
#[derive(Debug, Error)]
#[error("{path}: {what}; build the file again, or fetch it again", path = path.display())]
pub struct Unsound {
    path: PathBuf,
    what: String,
}

/// Runs the subcommand. A failure carries [`Unsound`] or a
/// [`ortelius::paper::progressive_mesh::file::PmeshError`].
pub fn run(args: &VerifyArgs) -> Result<()> {
    let path = &args.file;
    let unsound = |what| Unsound { path: path.clone(), what };
    let loaded = ProgressiveMesh::read(path)?;
    let contents = &loaded.contents;
    if let Some(missing) = contents.missing() {
        return Err(unsound(missing).into());
    }
    let mesh = &loaded.mesh;
    mesh.check().map_err(|flaw| unsound(flaw.to_string()))?;
    goes_up_and_down(path, mesh)?;
    say(format_args!(
        "{}: {} bytes, {} chunks, {} levels of {} to {} faces, all as written; up and down again it is the same",
        path.display(),
        contents.bytes,
        contents.whole.chunks,
        contents.whole.levels,
        mesh.levels[0].faces,
        contents.whole.faces
    ))
}

/// From the coarsest level to the full mesh and back.
fn goes_up_and_down(path: &Path, mesh: &ProgressiveMesh) -> Result<(), Unsound> {
    let base = State::new(mesh);
    let mut state = base.clone();
    state.go_to(mesh, mesh.last_level());
    state.go_to(mesh, 0);
    let differs = state.faces().iter().zip(base.faces()).position(|(after, before)| after != before);
    match differs {
        None => Ok(()),
        Some(slot) => {
            let what = format!("up and down again, slot {slot} shows another face");
            Err(Unsound { path: path.to_owned(), what })
        }
    }
}
