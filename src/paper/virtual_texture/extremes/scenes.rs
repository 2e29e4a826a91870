//! The extremes: what each draws, from which camera, and the risk that it tests.

use super::shapes;
use crate::math::camera::Pose;
use crate::math::pyramid::{Pyramid, TileId};
use crate::model::mesh::{Mesh, SourceMesh, gpu_mesh};
use crate::paper::virtual_texture::config::{source_mesh, texture};
use crate::scene::{Scene, SceneError};

/// An extreme input that the pipeline must handle.
pub struct Extreme {
    pub name: &'static str,
    /// The risk that it tests.
    pub stresses: &'static str,
    /// The size in pixels.
    pub size: [u32; 2],
    /// A shipped scene.
    pub scene: &'static str,
    /// Changes of the scene's keys, as for `-D`.
    pub changes: &'static [&'static str],
    /// What is drawn.
    pub landscape: Landscape,
    pub expected: Expected,
}

/// What an extreme draws.
#[derive(Clone, Copy)]
pub enum Landscape {
    /// The scene's mesh from the scene's camera.
    Scene,
    /// A synthetic mesh, seen from `shapes::eye`.
    Made(fn(&Pyramid, [u32; 2]) -> SourceMesh),
    /// `shapes::noise`: the tile of each pixel is known without rasterising.
    Noise,
}

/// The expected result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expected {
    /// Every variant finds the reference's tiles.
    Equal,
    /// As `Equal`, with this number of tiles.
    Tiles(usize),
    /// As `Equal`, with as many tiles as pixels.
    TileEachPixel,
    /// Some coordinates are NaN: the lists are exact, but the right texel is undefined.
    NoTexels,
    /// At least one variant exceeds the device's limits and is refused.
    Refused,
}

/// An extreme, ready to draw.
pub struct Sight {
    /// The size in pixels.
    pub size: [u32; 2],
    pub pyramid: Pyramid,
    pub pose: Pose,
    pub source: SourceMesh,
    pub mesh: Mesh,
}

/// The size of most extremes, in pixels.
pub const SIZE: [u32; 2] = [640, 360];

const fn plain(
    name: &'static str,
    stresses: &'static str,
    scene: &'static str,
    changes: &'static [&'static str],
) -> Extreme {
    Extreme {
        name,
        stresses,
        size: SIZE,
        scene,
        changes,
        landscape: Landscape::Scene,
        expected: Expected::Equal,
    }
}

pub const EXTREMES: &[Extreme] = &[
    plain(
        "tilt-89.9",
        "Footprints from less than a texel to the whole texture in one picture",
        "plane",
        &["view.camera=grazing", "cameras.grazing.tilt_deg=89.9"],
    ),
    plain(
        "tilt-89.99",
        "Footprints a thousand times as long as wide",
        "plane",
        &["view.camera=grazing", "cameras.grazing.tilt_deg=89.99"],
    ),
    plain(
        "tilt-89.999",
        "The horizon in the picture's middle, with the plane's far edge less than a pixel away",
        "plane",
        &["view.camera=grazing", "cameras.grazing.tilt_deg=89.999"],
    ),
    plain(
        "pole",
        "All columns of the first row of tiles meet in a point of the picture",
        "pole",
        &["view.camera=above"],
    ),
    plain("south-pole", "t = 1 exactly, on the axis in the picture's middle", "pole", &["view.camera=south"]),
    plain(
        "antimeridian",
        "s = 1 next to s = 0: the last column of tiles next to the first",
        "antimeridian",
        &["view.camera=oblique"],
    ),
    plain(
        "corners",
        "s = 1 and t = 1: a row has wT tiles, so tile floor(wT s) = wT does not exist, and the paper's min gives \
         the last one",
        "plane",
        &[],
    )
    .landscape(Landscape::Made(shapes::corners)),
    plain("zero-derivatives", "dmax = 0 and dmin = 0: log2(0), 0 / 0, dmax / 0", "plane", &[])
    .landscape(Landscape::Made(shapes::points)),
    plain("not-finite", "NaN, infinite and huge coordinates beside ordinary ones", "plane", &[])
    .landscape(Landscape::Made(shapes::not_finite))
    .expecting(Expected::NoTexels),
    plain(
        "every-level",
        "All 11 bits of one texel of the tile mask, for a pyramid of 11 streamed levels",
        "plane",
        &[
            "surface.land.texture.width_log2=14",
            "surface.land.texture.height_log2=14",
            "surface.land.texture.tile_size=16",
        ],
    )
    .landscape(Landscape::Made(shapes::every_level)),
    plain(
        "one-pixel",
        "A picture smaller than a pixel quad, a block and a workgroup",
        "earth",
        &["view.camera=headline", "cameras.headline.magnification=100.0"],
    )
    .sized([1, 1]),
    plain(
        "16384x64",
        "The widest picture on most devices: clip coordinates have their largest rounding errors",
        "earth",
        &["view.camera=oblique", "cameras.oblique.vertical_fov_deg=0.3"],
    )
    .sized([16384, 64]),
    plain(
        "1-m",
        "1 m above a vertex of the Earth: 2^-15 texels per pixel, six triangles in the picture",
        "earth",
        &["view.camera=headline", "cameras.headline={latitude_deg=0.0,longitude_deg=0.0,altitude_m=1.0}"],
    ),
    plain(
        "10^8-m",
        "100 000 km away: the Earth is 40 pixels high",
        "globe",
        &["view.camera=far", "surface.land.geometry.columns=194", "surface.land.geometry.rows=97"],
    ),
    plain(
        "2^20-texels",
        "The largest texture: one texel is 38 m, and s as an f32 has steps of 1/16 texel",
        "earth",
        &["view.camera=low", "surface.land.texture.width_log2=20", "surface.land.texture.height_log2=19"],
    ),
    plain(
        "2^20-fine-tiles",
        "8 million tiles in level 0: a tile mask of 32 MiB for a picture of 0.2 million pixels",
        "earth",
        &[
            "view.camera=low",
            "surface.land.texture.width_log2=20",
            "surface.land.texture.height_log2=19",
            "surface.land.texture.tile_size=256",
        ],
    ),
    plain(
        "2^20-finest-tiles",
        "65536 x 65536 tiles in level 0 and 17 streamed levels: a tile mask larger than any device's images",
        "plane",
        &[
            "surface.land.texture.width_log2=20",
            "surface.land.texture.height_log2=20",
            "surface.land.texture.tile_size=16",
        ],
    )
    .expecting(Expected::Refused),
    plain(
        "empty",
        "A picture that shows only the sky",
        "earth",
        &["view.camera=headline", "cameras.headline.tilt_deg=180.0"],
    )
    .expecting(Expected::Tiles(0)),
    plain(
        "one-tile",
        "Every pixel ORs the same bit",
        "plane",
        &["view.camera=nadir", "cameras.nadir={east_m=22784.0,north_m=14080.0,altitude_m=100.0}"],
    )
    .expecting(Expected::Tiles(1)),
    plain(
        "noise",
        "A different tile in each pixel: 2^20 distinct requests, 16 times the list's initial capacity",
        "plane",
        &["surface.land.texture.width_log2=20", "surface.land.texture.height_log2=19"],
    )
    .sized([1024, 1024])
    .landscape(Landscape::Noise)
    .expecting(Expected::TileEachPixel),
];

impl Extreme {
    const fn landscape(self, landscape: Landscape) -> Extreme {
        Extreme { landscape, ..self }
    }

    const fn sized(self, size: [u32; 2]) -> Extreme {
        Extreme { size, ..self }
    }

    const fn expecting(self, expected: Expected) -> Extreme {
        Extreme { expected, ..self }
    }

    pub fn find(name: &str) -> Option<&'static Extreme> {
        EXTREMES.iter().find(|extreme| extreme.name == name)
    }

    /// True if NA matters. The footprints of [`Landscape::Noise`] are square.
    pub fn elongates(&self) -> bool {
        !matches!(self.landscape, Landscape::Noise)
    }

    /// Prepares the extreme at `size` pixels.
    ///
    /// # Errors
    /// The scene does not accept a change.
    pub fn sight(&self, size: [u32; 2]) -> Result<Sight, SceneError> {
        let changes: Vec<String> = self.changes.iter().map(|&change| change.to_owned()).collect();
        let scene = Scene::load_with(self.scene, &changes)?;
        let pyramid =
            texture(&scene).expect("a textured surface").pyramid().expect("checked").expect("no file");
        let (pose, source) = match self.landscape {
            Landscape::Scene => (scene.pose(0)?, source_mesh(&scene).expect("checked")),
            Landscape::Made(make) => (shapes::eye(), make(&pyramid, size)),
            Landscape::Noise => (shapes::eye(), shapes::noise(&pyramid, size)),
        };
        Ok(Sight { size, pyramid, pose, mesh: gpu_mesh(&source), source })
    }

    /// The triple of pixel number `pixel`, counted row by row, of [`Landscape::Noise`].
    pub fn noise_triple(pyramid: &Pyramid, pixel: u64) -> [u32; 3] {
        let TileId { level, row, column } = shapes::noise_tile(pyramid, pixel);
        [level, row << level, column << level]
    }
}
