//! `ortelius mesh verify`: checks every byte and every level of a `.pmesh` file.

use crate::command::say;
use anyhow::Result;
use clap::Args;
use ortelius::paper::progressive_mesh::mesh::ProgressiveMesh;
use ortelius::paper::progressive_mesh::run::{IgnoreWrites, Program, State};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Checks every byte of a .pmesh file against its checksums. Also checks that all levels can be reached, and that going
/// from the coarsest level to the full mesh and back restores the same face buffer bit by bit.
#[derive(Args, Debug)]
pub struct MeshVerifyArgs {
    /// The file to check
    #[arg(value_name = "FILE.pmesh")]
    file: PathBuf,
}

/// A file that can be read but is not a complete, valid progressive mesh: exit code 3.
#[derive(Debug, Error)]
#[error("{path}: {what}; build the file again, or fetch it again", path = path.display())]
pub struct InvalidMeshFile {
    path: PathBuf,
    what: String,
}

impl InvalidMeshFile {
    pub(super) fn new(path: &Path, what: String) -> InvalidMeshFile {
        InvalidMeshFile { path: path.to_owned(), what }
    }
}

/// Runs the subcommand. A failure carries [`InvalidMeshFile`] or a
/// [`ortelius::paper::progressive_mesh::file::PmeshError`].
pub fn run(args: &MeshVerifyArgs) -> Result<()> {
    let path = &args.file;
    let unsound = |what| InvalidMeshFile::new(path, what);
    let loaded = ProgressiveMesh::read(path)?;
    let contents = &loaded.contents;
    if let Some(missing) = contents.missing() {
        return Err(unsound(missing).into());
    }
    let mesh = &loaded.mesh;
    let program = Program::new(mesh).map_err(|flaw| unsound(flaw.to_string()))?;
    goes_up_and_down(mesh, &program).map_err(unsound)?;
    say(format_args!(
        "{}: {} bytes, {} chunks, {} levels of {} to {} faces, all intact; refining and coarsening restores level 0",
        path.display(),
        contents.bytes,
        contents.whole.chunks,
        contents.whole.levels,
        mesh.levels[0].faces,
        contents.whole.faces
    ))
}

/// Goes from the coarsest level to the full mesh and back.
fn goes_up_and_down(mesh: &ProgressiveMesh, program: &Program) -> Result<(), String> {
    let mut state = State::new(mesh);
    state.go_to(mesh, mesh.last_level());
    state.go_to(mesh, 0);
    let mut faces = program.faces().to_vec();
    for [from, to] in [[0, mesh.last_level()], [mesh.last_level(), 0]] {
        program.run(&mut faces, from, to, &mut Vec::new(), &mut IgnoreWrites);
    }
    for (after, before) in [(state.faces(), &mesh.faces[..]), (&faces, program.faces())] {
        if let Some(slot) = after.iter().zip(before).position(|(after, before)| after != before) {
            return Err(format!("after refining to the full mesh and back, slot {slot} holds another face"));
        }
    }
    Ok(())
}
