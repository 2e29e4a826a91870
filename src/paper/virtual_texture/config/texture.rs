//! A surface's virtual texture: its keys in a scene, and its source of tiles.

use crate::math::pyramid::{Pyramid, PyramidError};
use crate::model::mesh::SourceMesh;
use crate::paper::virtual_texture::disk::{Disk, FaultyDisk};
use crate::scene::{Choice, Scene, SceneError, SceneFault, SceneTable, Surface, choices, settings};
use crate::texture::source::earth::{Earth, EarthError};
use crate::texture::source::encoded::Encoded;
use crate::texture::source::ruler::Ruler;
use crate::texture::source::terrain::Terrain;
use crate::texture::source::{TileFormat, TileSource};
use crate::texture::tiles::{TileFile, TileFileError};
use std::path::PathBuf;
use std::sync::Arc;
use thiserror::Error;

/// The texture's `kind`.
pub const KIND: &str = "virtual";

choices! {
    /// Where the texels come from.
    pub enum TextureSource {
        /// Real imagery of the Earth. Finer levels are synthetic (and labelled as synthetic), and generated on the fly.
        Earth = "earth",
        /// Every texel is a hash of its level and position. Generated on the fly.
        Ruler = "ruler",
        /// A square of ground around Mount Everest: the texture for the model `valley`. It is synthetic (and labelled
        /// as synthetic), and generated on the fly.
        Terrain = "terrain",
        /// A `.tiles` file (`ortelius bake`).
        File = "file",
    }
}

impl Choice for TileFormat {
    const ALL: &'static [TileFormat] = &[TileFormat::Rgba8, TileFormat::Bc1];
    fn name(self) -> &'static str {
        match self {
            TileFormat::Rgba8 => "rgba8",
            TileFormat::Bc1 => "bc1",
        }
    }
    fn about(self) -> &'static str {
        match self {
            TileFormat::Rgba8 => "four bytes per texel",
            TileFormat::Bc1 => "an eighth of the memory, no alpha; the border must be a multiple of 4",
        }
    }
}

settings! {
    /// A texture of up to 2^20 texels a side, of which only the visible tiles are in memory (paper 1).
    pub struct VirtualTextureSource kind "virtual" {
        /// Where the texels come from.
        source: TextureSource;
        /// The file's path: relative to the scene file, or with `-D` to the working directory. Required for `"file"`.
        path: Option<PathBuf> = None;
        /// Level 0 has 2^m x 2^n texels, at most 2^20 x 2^20; this is m. Required except for `"file"`, which states
        /// its size.
        width_log2: Option<u32> = None;
        /// n of level 0's 2^m x 2^n texels. The earth has n = m - 1.
        height_log2: Option<u32> = None;
        /// Payload of a tile: a power of two. A file has its own.
        tile_size: u32 = 512, in 16..=1024, unit "texels a side";
        /// Width of the border around each tile, which repeats texels of the neighbouring tiles. Bilinear and
        /// trilinear samples need 2. Filters that read further look up the neighbouring tile. A file has its own.
        border: u32 = 4, unit "texels";
        /// Number of coarsest levels that are always in video memory (the paper's L'). By default the fewest
        /// possible. A file has its own.
        resident_levels: Option<u32> = None;
        /// Format of generated tiles. A file has its own.
        format: TileFormat = TileFormat::Rgba8;
    }
    check check;
}

fn check(texture: &VirtualTextureSource, part: &SceneTable<'_>) -> Result<(), SceneFault> {
    let fault = |key, what: &str| Err(part.fault(key, what));
    match (texture.source, &texture.path) {
        (TextureSource::File, None) => return fault("path", "the source \"file\" needs a path"),
        (TextureSource::File, Some(_)) if part.states("format") => {
            return fault("format", "a file has its own format; bake it with --format");
        }
        (TextureSource::File, Some(_)) => {}
        (_, Some(_)) => return fault("path", "only the source \"file\" has a path"),
        (TextureSource::Ruler, None) if texture.format == TileFormat::Bc1 => {
            return fault("format", "the ruler is exact texel by texel, but bc1 is lossy; choose \"rgba8\"");
        }
        (_, None) => {}
    }
    if texture.format == TileFormat::Bc1 && !texture.border.is_multiple_of(4) {
        let what =
            "bc1 uses blocks of 4 x 4 texels on both levels of a tile, so the border must be a multiple of 4";
        return fault("border", what);
    }
    match (texture.width_log2, texture.height_log2) {
        (Some(_), Some(_)) => {}
        (None, None) if texture.source == TextureSource::File => {}
        (None, _) => return fault("width_log2", "is missing"),
        (_, None) => return fault("height_log2", "is missing"),
    }
    if !texture.tile_size.is_power_of_two() {
        let what = format!("a tile side of {} texels is not a power of two", texture.tile_size);
        return fault("tile_size", &what);
    }
    texture.pyramid().map(drop).map_err(|error| {
        let key = match error {
            PyramidError::Size(..) => "width_log2",
            PyramidError::Tile(..) => "tile_size",
            PyramidError::Border(_) => "border",
            PyramidError::Resident { .. } => "resident_levels",
        };
        part.fault(key, error.to_string())
    })
}

impl VirtualTextureSource {
    /// The pyramid that the scene states; `None` if only the file states its size.
    ///
    /// # Errors
    /// [`PyramidError`], possible only if a field was changed after the scene was checked.
    pub fn pyramid(&self) -> Result<Option<Pyramid>, PyramidError> {
        let (Some(width_log2), Some(height_log2)) = (self.width_log2, self.height_log2) else {
            return Ok(None);
        };
        let tile_log2 = self.tile_size.max(1).ilog2();
        Pyramid::new(width_log2, height_log2, tile_log2, self.border, self.resident_levels).map(Some)
    }
}

/// A texture that cannot be opened.
#[derive(Debug, Error)]
pub enum TextureError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error("scene {0} has no surface with a virtual texture; name a scene that has one")]
    Absent(String),
    #[error("surface.{0}: its geometry must be an ellipsoid, a plane or a cylinder")]
    Geometry(String),
    #[error(transparent)]
    Pyramid(#[from] PyramidError),
    #[error(transparent)]
    Earth(#[from] EarthError),
    #[error(
        "{place}: the scene states 2^{} x 2^{} texels, but {} has 2^{} x 2^{}; correct the scene, or leave the keys out",
        stated[0], stated[1], file.display(), found[0], found[1]
    )]
    Differs { place: String, file: PathBuf, stated: [u32; 2], found: [u32; 2] },
    #[error("{place}: {error}")]
    File { place: String, error: TileFileError },
}

/// The surface whose table has the scene's virtual texture. Other surfaces may share it.
///
/// # Errors
/// A second virtual texture.
pub fn owner(scene: &Scene) -> Result<Option<&Surface>, SceneError> {
    let own = |surface: &&Surface| {
        surface.texture.as_ref() == Some(&surface.name) && scene.texture_kind(surface) == Some(KIND)
    };
    let mut owners = scene.surfaces.values().filter(own);
    let first = owners.next();
    match (first, owners.next()) {
        (Some(first), Some(second)) => {
            let what = format!(
                "a scene has one virtual texture, and {0} has one already; share it (texture = {0:?}), or choose \
                 kind = \"plain\"",
                first.name
            );
            Err(scene.fault(&["surface", &second.name, "texture", "kind"], what))
        }
        _ => Ok(first),
    }
}

fn needed(scene: &Scene) -> Result<&Surface, TextureError> {
    owner(scene)?.ok_or_else(|| TextureError::Absent(scene.name.clone()))
}

/// The settings of the scene's virtual texture.
///
/// # Errors
/// [`TextureError::Absent`]; an invalid table.
pub fn texture(scene: &Scene) -> Result<VirtualTextureSource, TextureError> {
    Ok(scene.read(&["surface", &needed(scene)?.name, "texture"])?)
}

/// The triangles of the surface that has the virtual texture.
///
/// # Errors
/// [`TextureError::Absent`]; a geometry that is not a grid.
pub fn source_mesh(scene: &Scene) -> Result<SourceMesh, TextureError> {
    let surface = needed(scene)?;
    surface.grid().ok_or_else(|| TextureError::Geometry(surface.name.clone()))
}

/// Opens the scene's virtual texture, with the injected faults of its `[disk]`. Synthetic sources need no file.
///
/// # Errors
/// [`TextureError`] names the key or the file.
pub fn open_texture(scene: &Scene) -> Result<Arc<dyn TileSource>, TextureError> {
    let source = open_healthy(scene)?;
    let disk: Disk = scene.read(&["disk"])?;
    Ok(match disk == Disk::DEFAULT {
        true => source,
        false => Arc::new(FaultyDisk::new(source, disk)),
    })
}

fn open_healthy(scene: &Scene) -> Result<Arc<dyn TileSource>, TextureError> {
    let texture = texture(scene)?;
    let pyramid = texture.pyramid()?;
    let stated = || pyramid.expect("checked: a generated texture states its size");
    let key = |name| ["surface", &needed(scene).expect("it was just read").name, "texture", name];
    Ok(match (texture.source, &texture.path) {
        (TextureSource::Earth, _) => generated(Arc::new(Earth::new(stated())?), texture.format),
        (TextureSource::Terrain, _) => {
            let terrain = Terrain::new(stated())
                .map_err(|error| scene.fault(&key("height_log2"), error.to_string()))?;
            generated(Arc::new(terrain), texture.format)
        }
        (TextureSource::Ruler, _) => Arc::new(Ruler::new(stated())),
        (TextureSource::File, path) => {
            let path = path.as_ref().expect("checked: a file has a path");
            let file = TileFile::open(path)
                .map_err(|error| TextureError::File { place: scene.place(&key("path")), error })?;
            let size = |pyramid: &Pyramid| [pyramid.width_log2(), pyramid.height_log2()];
            let found = size(&file.pyramid());
            if let Some(stated) = pyramid.as_ref().map(size).filter(|stated| *stated != found) {
                let place = scene.place(&key("width_log2"));
                return Err(TextureError::Differs { place, file: path.clone(), stated, found });
            }
            let own = file.pyramid();
            for (name, own) in [
                ("tile_size", own.tile_size()),
                ("border", own.border_texels()),
                ("resident_levels", own.resident_levels()),
            ] {
                let stated = scene.value(&key(name)).and_then(toml::Value::as_integer);
                if let Some(stated) = stated.filter(|stated| *stated != i64::from(own)) {
                    let place = scene.place(&key(name));
                    tracing::warn!("{place}: {stated} is not used, because {} has {own}", path.display());
                }
            }
            Arc::new(file)
        }
    })
}

/// Tiles generated on the fly, in the format of the scene.
fn generated(source: Arc<dyn TileSource>, format: TileFormat) -> Arc<dyn TileSource> {
    match format {
        TileFormat::Rgba8 => source,
        TileFormat::Bc1 => Arc::new(Encoded::new(source)),
    }
}
