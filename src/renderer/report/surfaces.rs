//! The report of frames of progressive meshes.

use super::{Manifest, PassReport};
use crate::paper::progressive_mesh::session::{FrameRecord, Session, Surface};
use crate::scene::ProgressiveSurface;
use crate::vk::PassTime;
use serde::Serialize;
use std::collections::BTreeMap;

/// The whole file. Times in nanoseconds, memory in bytes.
#[derive(Clone, Debug, Serialize)]
pub struct SurfacesReport {
    pub device: String,
    pub device_kind: &'static str,
    pub driver: String,
    pub vulkan: String,
    pub scene: String,
    pub camera: String,
    pub picture_width: u32,
    pub picture_height: u32,
    pub surfaces: BTreeMap<String, SurfaceReport>,
    /// In video memory.
    pub memory_bytes: BTreeMap<String, u64>,
    pub frames: Vec<SurfacesFrame>,
    pub manifest: Manifest,
}

/// One surface.
#[derive(Clone, Debug, Serialize)]
pub struct SurfaceReport {
    /// As the scene has it.
    pub settings: ProgressiveSurface,
    /// Of the full mesh.
    pub faces: u32,
    pub vertices: u32,
    /// n: the number of splits from M0 to the full mesh.
    pub splits: u32,
    /// Main memory that all instances share, and that they have of their own, together.
    pub shared_host_bytes: usize,
    pub instances_host_bytes: usize,
    /// Levels of the instances in the last frame that they were seen in.
    pub levels: Vec<u32>,
}

/// One frame, all surfaces together.
#[derive(Clone, Debug, Serialize)]
pub struct SurfacesFrame {
    pub frame: u64,
    pub passes: Vec<PassReport>,
    /// The host's time for levels and their copies.
    pub host_ns: u64,
    pub instances_seen: usize,
    pub faces: u64,
    /// Live vertices of the instances that are seen.
    pub vertices: u64,
    pub splits: u64,
    pub collapses: u64,
    pub upload_bytes: u64,
    /// The governor's factor on all wanted errors; 1 without one.
    pub error_factor: f64,
}

impl From<&FrameRecord> for SurfacesFrame {
    fn from(record: &FrameRecord) -> Self {
        let change = &record.change;
        SurfacesFrame {
            frame: record.index,
            passes: record
                .passes
                .iter()
                .map(|PassTime { label, ns }| PassReport { label: label.clone(), ns: *ns })
                .collect(),
            host_ns: record.host.as_nanos() as u64,
            instances_seen: change.instances_seen,
            faces: change.faces,
            vertices: change.vertices,
            splits: change.splits,
            collapses: change.collapses,
            upload_bytes: change.upload_bytes,
            error_factor: record.error_factor,
        }
    }
}

impl From<&Surface> for SurfaceReport {
    fn from(surface: &Surface) -> Self {
        let full = surface.program.levels().last().expect("there is at least level 0");
        let [shared_host_bytes, instances_host_bytes] = surface.host_bytes();
        SurfaceReport {
            settings: surface.settings.clone(),
            faces: full.faces,
            vertices: full.vertices,
            splits: surface.program.last_level(),
            shared_host_bytes,
            instances_host_bytes,
            levels: surface.instances().map(|(_, level)| level).collect(),
        }
    }
}

impl SurfacesReport {
    /// Of all frames so far. `scene` and `camera` are the names that the user gave.
    pub fn of(session: &Session, scene: &str, camera: &str) -> SurfacesReport {
        let physical = session.gpu.physical();
        let (major, minor, patch) = physical.api;
        let surface = |surface: &Surface| (surface.name.clone(), SurfaceReport::from(surface));
        SurfacesReport {
            device: physical.name.clone(),
            device_kind: physical.kind,
            driver: physical.driver.clone(),
            vulkan: format!("{major}.{minor}.{patch}"),
            scene: scene.to_owned(),
            camera: camera.to_owned(),
            picture_width: session.settings.size[0],
            picture_height: session.settings.size[1],
            surfaces: session.surfaces.iter().map(surface).collect(),
            memory_bytes: session.memory().into_iter().collect(),
            frames: session.records.iter().map(SurfacesFrame::from).collect(),
            manifest: Manifest::of_this_process(),
        }
    }
}
