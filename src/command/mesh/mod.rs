//! `ortelius mesh`: builds, describes, exports and checks `.pmesh` files.

mod build;
mod export;
mod info;
mod report;
mod verify;

use anyhow::Result;
use clap::{Args, Subcommand};
use ortelius::paper::progressive_mesh::file::LoadedFile;
use ortelius::paper::progressive_mesh::mesh::ProgressiveMesh;
use std::path::Path;

pub use verify::InvalidMeshFile;

/// Builds, describes, exports and checks progressive meshes (.pmesh).
#[derive(Args)]
pub struct MeshArgs {
    #[command(subcommand)]
    command: MeshCommand,
}

#[derive(Subcommand)]
enum MeshCommand {
    /// Simplify a model to a progressive mesh, with a face order for the vertex cache at every level
    Build(build::BuildArgs),
    /// Show levels, sizes, errors, and what drawing costs with the order
    Info(info::InfoArgs),
    /// Write one level as a plain mesh
    Export(export::ExportArgs),
    /// Check every byte and every level, and that refining to the full mesh and back changes nothing
    Verify(verify::MeshVerifyArgs),
}

/// Runs the subcommand. A failure names the file; for a corrupt file it carries a
/// [`ortelius::paper::progressive_mesh::file::PmeshError`] or an [`InvalidMeshFile`].
pub fn run(args: &MeshArgs) -> Result<()> {
    match &args.command {
        MeshCommand::Build(args) => build::run(args),
        MeshCommand::Info(args) => info::run(args),
        MeshCommand::Export(args) => export::run(args),
        MeshCommand::Verify(args) => verify::run(args),
    }
}

/// Reads a file that can be executed; warns if its end is missing.
fn load(path: &Path) -> Result<LoadedFile> {
    let loaded = ProgressiveMesh::read(path)?;
    loaded.mesh.check().map_err(|flaw| InvalidMeshFile::new(path, flaw.to_string()))?;
    if let Some(missing) = loaded.contents.missing() {
        tracing::warn!("{}: {missing}", path.display());
    }
    Ok(loaded)
}
