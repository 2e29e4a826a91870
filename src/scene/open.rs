//! From a scene's `[texture]` to tiles.

use super::{Scene, Texture, TextureSource};
use crate::math::pyramid::PyramidError;
use crate::texture::source::earth::{Earth, EarthError};
use crate::texture::source::encoded::Encoded;
use crate::texture::source::{
    TileFormat, TileSource,
    disk::{Disk, FaultyDisk},
    ruler::Ruler,
};
use crate::texture::tiles::{TileFile, TileFileError};
use std::sync::Arc;
use thiserror::Error;

/// A texture that is not to be had.
#[derive(Debug, Error)]
pub enum TextureError {
    #[error(
        "scene {0} has no landscape, it shows progressive meshes; name a scene with [texture] and [mesh]"
    )]
    Absent(String),
    #[error(transparent)]
    Pyramid(#[from] PyramidError),
    #[error(transparent)]
    Earth(#[from] EarthError),
    #[error(transparent)]
    File(#[from] TileFileError),
    #[error("texture.source: a synthetic texture needs width_log2 and height_log2")]
    Size,
    #[error(
        "{path}: the file has {found}, the scene states {stated}; correct the scene, or leave the key out"
    )]
    Differs { path: String, found: String, stated: String },
}

impl Scene {
    /// The landscape's texture as the scene describes it.
    ///
    /// # Errors
    /// [`TextureError::Absent`].
    pub fn texture(&self) -> Result<&Texture, TextureError> {
        self.texture.as_ref().ok_or_else(|| TextureError::Absent(self.name.clone()))
    }

    /// As [`Scene::texture`], to change it.
    ///
    /// # Errors
    /// [`TextureError::Absent`].
    pub fn texture_mut(&mut self) -> Result<&mut Texture, TextureError> {
        self.texture.as_mut().ok_or_else(|| TextureError::Absent(self.name.clone()))
    }

    /// Opens the texture, with the disk faults that the scene injects. Synthetic sources need no file.
    ///
    /// # Errors
    /// [`TextureError`] names the key or the file.
    pub fn open_texture(&self) -> Result<Arc<dyn TileSource>, TextureError> {
        let source = self.open_healthy_texture()?;
        Ok(match self.disk == Disk::default() {
            true => source,
            false => Arc::new(FaultyDisk::new(source, self.disk.clone())),
        })
    }

    fn open_healthy_texture(&self) -> Result<Arc<dyn TileSource>, TextureError> {
        let texture = self.texture()?;
        let stated = texture.pyramid()?;
        match &texture.source {
            TextureSource::Earth => {
                let earth = Arc::new(Earth::new(stated.ok_or(TextureError::Size)?)?);
                Ok(match texture.format {
                    TileFormat::Rgba8 => earth,
                    TileFormat::Bc1 => Arc::new(Encoded::new(earth)),
                })
            }
            TextureSource::Ruler => Ok(Arc::new(Ruler::new(stated.ok_or(TextureError::Size)?))),
            TextureSource::File(path) => {
                let file = TileFile::open(path)?;
                let found = file.pyramid();
                match texture.size_log2 {
                    Some(stated) if stated != [found.width_log2(), found.height_log2()] => {
                        Err(TextureError::Differs {
                            path: path.display().to_string(),
                            found: format!("2^{} x 2^{} texels", found.width_log2(), found.height_log2()),
                            stated: format!("2^{} x 2^{}", stated[0], stated[1]),
                        })
                    }
                    _ => Ok(Arc::new(file)),
                }
            }
        }
    }
}
