//! The program's exit codes. The library's errors have none; this module maps errors to codes.

use super::Usage;
use super::doctor::DoctorFailed;
use super::mesh::InvalidMeshFile;
use super::render::Unreadable;
use super::verify::Damaged;
use ortelius::paper::progressive_mesh::file::{FileFlaw, PmeshError};
use ortelius::paper::progressive_mesh::{LoadError, SurfaceError};
use ortelius::paper::virtual_texture::VirtualTextureError;
use ortelius::paper::virtual_texture::config::TextureError;
use ortelius::paper::virtual_texture::tile_pool::TilePoolError;
use ortelius::renderer::RenderError;
use ortelius::scene::SceneError;
use ortelius::texture::bake::{BakeError, SourceError};
use ortelius::texture::source::TileError;
use ortelius::texture::tiles::TileFileError;
use ortelius::vk;
use std::error::Error;

/// All errors without a code of their own.
const ERROR: u8 = 1;
const USAGE_OR_NO_DRIVER: u8 = 2;
const DATA_CORRUPT: u8 = 3;
pub const DEVICE_LOST: u8 = 4;

/// The first cause that has its own code determines the exit code.
pub fn exit_code(error: &anyhow::Error) -> u8 {
    error.chain().find_map(code_of).unwrap_or(ERROR)
}

/// `None` for errors without a special code.
fn code_of(cause: &(dyn Error + 'static)) -> Option<u8> {
    let usage = cause.is::<Usage>().then_some(USAGE_OR_NO_DRIVER);
    let damaged = (cause.is::<Damaged>() || cause.is::<InvalidMeshFile>() || cause.is::<Unreadable>())
        .then_some(DATA_CORRUPT);
    #[cfg(feature = "window")]
    let usage = usage.or(cause.is::<crate::view::NoDisplay>().then_some(USAGE_OR_NO_DRIVER));
    usage
        .or(damaged)
        .or_else(|| cause.downcast_ref().map(|failed: &DoctorFailed| failed.exit_code))
        .or_else(|| cause.downcast_ref().and_then(vulkan))
        .or_else(|| cause.downcast_ref().and_then(render))
        .or_else(|| cause.downcast_ref().and_then(scene))
        .or_else(|| cause.downcast_ref().and_then(texture))
        .or_else(|| cause.downcast_ref().and_then(tile_file))
        .or_else(|| cause.downcast_ref().and_then(bake))
        .or_else(|| cause.downcast_ref().and_then(bake_source))
        .or_else(|| cause.downcast_ref().and_then(pmesh))
}

fn vulkan(error: &vk::Error) -> Option<u8> {
    match error {
        vk::Error::Loader(_)
        | vk::Error::NoDevice { .. }
        | vk::Error::DeviceChoice { .. }
        | vk::Error::NoValidationLayer => Some(USAGE_OR_NO_DRIVER),
        vk::Error::DeviceLost { .. } => Some(DEVICE_LOST),
        _ => None,
    }
}

/// The variants of [`RenderError`] are transparent, so the chain of causes skips them.
fn render(error: &RenderError) -> Option<u8> {
    match error {
        RenderError::Vulkan(error) | RenderError::Surface(SurfaceError::Vulkan(error)) => vulkan(error),
        RenderError::Texture(error) => texture(error),
        RenderError::VirtualTexture(error) => virtual_texture(error),
        RenderError::Scene(error) | RenderError::Load(LoadError::Scene(error)) => scene(error),
        RenderError::Load(LoadError::Pmesh { error, .. }) => pmesh(error),
        _ => None,
    }
}

fn virtual_texture(error: &VirtualTextureError) -> Option<u8> {
    match error {
        VirtualTextureError::Vulkan(error) | VirtualTextureError::TilePool(TilePoolError::Vulkan(error)) => {
            vulkan(error)
        }
        // The resident mip tail is in the same file as the tiles, so a read error there means damage.
        VirtualTextureError::TilePool(TilePoolError::Source(_)) => Some(DATA_CORRUPT),
        _ => None,
    }
}

/// An unknown name on the command line is a usage error; a mistake inside a file is an ordinary error.
fn scene(error: &SceneError) -> Option<u8> {
    match error {
        SceneError::Unknown { .. }
        | SceneError::Override { .. }
        | SceneError::Camera { .. }
        | SceneError::Path { .. } => Some(USAGE_OR_NO_DRIVER),
        SceneError::Read { .. } | SceneError::Write(_) | SceneError::Content { .. } => None,
    }
}

fn texture(error: &TextureError) -> Option<u8> {
    match error {
        TextureError::Scene(error) => scene(error),
        TextureError::File { error, .. } => tile_file(error),
        _ => None,
    }
}

fn tile_file(error: &TileFileError) -> Option<u8> {
    error.is_damage().then_some(DATA_CORRUPT)
}

fn bake(error: &BakeError) -> Option<u8> {
    match error {
        BakeError::Source(error) => bake_source(error),
        BakeError::Settings(_) => Some(USAGE_OR_NO_DRIVER),
        BakeError::Tile(TileError::Checksum { .. }) => Some(DATA_CORRUPT),
        BakeError::Unreadable(error) => tile_file(error),
        _ => None,
    }
}

fn bake_source(error: &SourceError) -> Option<u8> {
    match error {
        SourceError::Synthetic(_) => Some(USAGE_OR_NO_DRIVER),
        SourceError::Damaged { .. } => Some(DATA_CORRUPT),
        _ => None,
    }
}

fn pmesh(error: &PmeshError) -> Option<u8> {
    match error {
        PmeshError::Read { .. } | PmeshError::Flaw { flaw: FileFlaw::Version(_), .. } => None,
        PmeshError::Flaw { .. } => Some(DATA_CORRUPT),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ortelius::frame::{STALL, Stalled};
    use ortelius::math::pyramid::TileId;
    use std::io;

    fn lost() -> vk::Error {
        vk::Error::DeviceLost { call: "vkQueueSubmit2", object: "graphics queue".into() }
    }

    fn no_device() -> vk::Error {
        vk::Error::NoDevice { searched: "/etc/vulkan/icd.d".into() }
    }

    fn refused() -> io::Error {
        io::Error::from(io::ErrorKind::PermissionDenied)
    }

    fn flawed(flaw: FileFlaw) -> PmeshError {
        PmeshError::Flaw { path: "a.pmesh".into(), flaw }
    }

    fn not_tiles() -> TileFileError {
        TileFileError::NotTiles { path: "a.tiles".into() }
    }

    fn checksum() -> TileError {
        let tile = TileId { level: 0, row: 0, column: 0 };
        TileError::Checksum { path: "a.tiles".into(), tile, offset: 0 }
    }

    /// Pairs of similar errors that have different exit codes; every code occurs.
    fn cases() -> Vec<(u8, anyhow::Error)> {
        let path = || "a.tiles".into();
        let out_of_memory = vk::Error::OutOfMemory { object: "tile pool".into(), reason: "full".into() };
        let resident = |error| RenderError::VirtualTexture(VirtualTextureError::TilePool(error));
        let load = |error| RenderError::Load(LoadError::Pmesh { place: "s.toml:1:1".into(), error });
        vec![
            (1, anyhow::anyhow!("something else")),
            (1, refused().into()),
            (1, out_of_memory.into()),
            (2, no_device().into()),
            (2, vk::Error::NoValidationLayer.into()),
            (4, lost().into()),
            (2, Usage("--size".into()).into()),
            (2, SceneError::Unknown { name: "erath".into(), shipped: "earth".into() }.into()),
            (1, SceneError::Read { path: "s.toml".into(), source: refused() }.into()),
            (1, RenderError::MeasuredBudget.into()),
            (4, RenderError::Vulkan(lost()).into()),
            (4, RenderError::Surface(SurfaceError::Vulkan(lost())).into()),
            (4, RenderError::VirtualTexture(VirtualTextureError::Vulkan(lost())).into()),
            (
                1,
                RenderError::VirtualTexture(VirtualTextureError::Stalled(Stalled {
                    pending: 1,
                    waited: STALL,
                }))
                .into(),
            ),
            (4, resident(TilePoolError::Vulkan(lost())).into()),
            (3, resident(TilePoolError::Source(checksum())).into()),
            (
                3,
                RenderError::Texture(TextureError::File { place: "s.toml:1:1".into(), error: not_tiles() })
                    .into(),
            ),
            (1, RenderError::Texture(TextureError::Absent("s".into())).into()),
            (3, load(flawed(FileFlaw::NotPmesh)).into()),
            (1, load(flawed(FileFlaw::Version(9))).into()),
            (3, not_tiles().into()),
            (3, TileFileError::Index { path: path() }.into()),
            (1, TileFileError::Open { path: path(), source: refused() }.into()),
            (1, TileFileError::Version { path: path(), found: 9, expected: 1 }.into()),
            (3, BakeError::Source(SourceError::Damaged { path: path(), reason: "cut".into() }).into()),
            (1, BakeError::Source(SourceError::Changed { path: path() }).into()),
            (2, SourceError::Synthetic("earth:99".into()).into()),
            (2, BakeError::Settings("--border".into()).into()),
            (3, BakeError::Tile(checksum()).into()),
            (3, BakeError::Unreadable(not_tiles()).into()),
            (1, BakeError::Busy { path: path() }.into()),
            (3, flawed(FileFlaw::Longer(1)).into()),
            (1, PmeshError::Read { path: "a.pmesh".into(), source: refused() }.into()),
        ]
    }

    #[test]
    fn each_error_has_its_exit_code_and_a_context_does_not_change_it() {
        for (code, error) in cases() {
            assert_eq!(exit_code(&error), code, "{error:#}");
            let error = error.context("scene s.toml");
            assert_eq!(exit_code(&error), code, "{error:#}");
        }
    }
}
