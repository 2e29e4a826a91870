//! Shared by this paper's figures: scenes by name, sessions on the run's device, single passes to be timed.

use crate::figure::prelude::*;
use crate::frame::Run;
use crate::math::camera::Pose;
use crate::math::pyramid::TileId;
use crate::model::mesh;
use crate::paper::virtual_texture::config::{open_texture, papers_scene, source_mesh};
use crate::paper::virtual_texture::footprint::FootprintPass;
use crate::paper::virtual_texture::{Config, PAPER, VirtualTexture, VirtualTextureSettings, needs};
use crate::picture::PixelFormat;
use crate::scene::Scene;
use crate::scene::path::CameraPath;

/// A border that contains the paper's 16 samples. As in the paper, a pixel then needs the tile of its triple alone: no
/// sample lies in a neighbouring tile.
const PAPERS_BORDER: &str = "surface.land.texture.border=16";

/// The changes of a shipped scene that [`SceneView::find`] makes.
pub const PAPERS: &[&str] = &["surface.land.filter={}", PAPERS_BORDER];

/// One sample per pixel, as `one_sample_scene`.
pub const ONE_SAMPLE: &[&str] = &["surface.land.filter={max_anisotropy=1}"];

/// The changes that give a scene NA = `na`, and its tiles a border of `border` texels.
pub fn sampled(na: u32, border: u32) -> [String; 2] {
    [format!("surface.land.filter.max_anisotropy={na}"), format!("surface.land.texture.border={border}")]
}

/// The changes that give a scene of one sample NA = `na`, with a border that contains the samples: none if `na` is 1.
pub fn samples(na: u32) -> Vec<String> {
    if na == 1 { Vec::new() } else { sampled(na, na).into() }
}

/// The keys of `[variant]` in which `config` differs from the paper's variant, as a setting.
pub fn setting(name: impl Into<String>, config: &Config) -> Setting {
    let keys = |of: &Config| {
        [
            format!("request_draw={}", of.request_draw.name()),
            format!("dedup={}", of.dedup.name()),
            format!("block_log2={}", of.block_log2),
            format!("memo={}", of.memo),
            format!("address={}", of.address.name()),
            format!("compact={}", of.compact.name()),
            format!("compact_block_log2={}", of.compact_block_log2),
            format!("list={}", of.list.name()),
            format!("feedback_log2={}", of.feedback_log2),
        ]
    };
    let differing = keys(config).into_iter().zip(keys(&PAPER)).filter(|(own, papers)| own != papers);
    Setting::new(name, differing.map(|(own, _)| format!("variant.{own}")))
}

/// A shipped scene, and one of its cameras (`earth/oblique`) or paths (`earth/pan`). The scene is changed to the
/// paper's filter and to tiles with a border of 16 texels.
pub struct SceneView {
    pub scene: Scene,
    /// The camera's pose, or the path's first one.
    pub pose: Pose,
    pub path: Option<CameraPath>,
}

/// A session with the camera of a view.
pub struct ViewSession {
    pub session: Run<VirtualTexture>,
    pub scene: Scene,
    pub pose: Pose,
    pub path: Option<CameraPath>,
}

impl SceneView {
    /// # Errors
    /// No shipped scene, path or camera has this name.
    pub fn find(name: &str) -> anyhow::Result<SceneView> {
        let (scene, eye) = name.split_once('/').with_context(|| format!("{name:?}: not SCENE/CAMERA"))?;
        let scene = papers_scene(scene)?.with(&[PAPERS_BORDER.into()])?;
        let path = scene.paths.get(eye).cloned();
        let pose = match &path {
            Some(path) => path.pose(0),
            None => scene.camera(eye)?.pose(),
        };
        Ok(SceneView { scene, pose, path })
    }

    /// A session of `size` pixels with its own `Gpu` on the run's device; `change` edits the settings last. No frame
    /// is drawn yet: use [`ViewSession::look`] if only lists are needed, [`ViewSession::settle`] for pictures.
    ///
    /// # Errors
    /// The device lacks a feature; the texture cannot be opened.
    pub fn open(
        self,
        bench: &Bench,
        size: [u32; 2],
        change: impl FnOnce(&mut VirtualTextureSettings),
    ) -> anyhow::Result<ViewSession> {
        let SceneView { scene, pose, path } = self;
        let mut settings = VirtualTextureSettings::of_scene(&scene, PixelFormat::Srgb8)?;
        settings.size = size;
        change(&mut settings);
        let source = open_texture(&scene)?;
        let gpu = bench.gpu(&needs(&settings.config, source.format()))?;
        let mesh = mesh::gpu_mesh(&source_mesh(&scene)?);
        Ok(ViewSession { session: VirtualTexture::run(gpu, source, &mesh, settings)?, scene, pose, path })
    }
}

impl ViewSession {
    /// The stage 1 of a variant that is not fused.
    pub fn stage1(&self) -> &FootprintPass {
        self.session.technique.stage1().expect("a staged variant")
    }

    /// Draws one frame and waits for it. The request image and the lists then belong to the pose, but the tiles may
    /// not be resident yet.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn look(&mut self) -> anyhow::Result<()> {
        self.session.frame(&self.pose)?;
        Ok(self.session.drain()?)
    }

    /// Draws frames until every visible tile is resident; returns their number.
    ///
    /// # Errors
    /// As [`Run<VirtualTexture>::settle`].
    pub fn settle(&mut self) -> anyhow::Result<u64> {
        let frames = self.session.settle(&self.pose)?;
        self.session.drain()?;
        Ok(frames)
    }
}

/// Triples of own-level tile addresses as sorted tiles. Repeats are kept.
pub fn own_level_tiles(triples: &[[u32; 3]]) -> Vec<TileId> {
    let tile = |&[level, row, column]: &[u32; 3]| TileId { level, row, column };
    let mut tiles: Vec<TileId> = triples.iter().map(tile).collect();
    tiles.sort_unstable();
    tiles
}

/// Bytes of a MiB.
pub const MIB: f64 = 1_048_576.0;

/// Size of a 16:9 picture with this many rows, a value of a sweep.
pub fn pixels_of(rows: f64) -> [u32; 2] {
    [(rows * 16.0 / 9.0).round() as u32, rows as u32]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::virtual_texture::config::one_sample_scene;

    #[test]
    fn windows_show_the_scenes_that_figures_measure() {
        let changed = |changes: &[&str]| {
            let changes: Vec<String> = changes.iter().map(|change| (*change).to_owned()).collect();
            Scene::embedded("earth").unwrap().with(&changes).unwrap()
        };
        assert_eq!(changed(PAPERS), SceneView::find("earth/oblique").unwrap().scene);
        assert_eq!(changed(ONE_SAMPLE), one_sample_scene("earth").unwrap());
        assert_ne!(changed(PAPERS), changed(ONE_SAMPLE));
    }

    #[test]
    fn a_setting_states_what_differs_from_the_paper() {
        assert!(setting("paper", &PAPER).changes.is_empty());
        let own = Config { memo: !PAPER.memo, block_log2: 1, ..PAPER };
        let changes =
            [format!("variant.block_log2={}", own.block_log2), format!("variant.memo={}", own.memo)];
        assert_eq!(setting("own", &own).changes, changes);
    }
}
