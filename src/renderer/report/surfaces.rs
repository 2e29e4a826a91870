//! The report's part about progressive meshes.

use crate::paper::progressive_mesh::config::ProgressiveSurface;
use crate::paper::progressive_mesh::file::Extent;
use crate::paper::progressive_mesh::{FrameRecord, Surface, SurfaceMemory};
use serde::Serialize;

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
    /// What the surface's `.pmesh` file holds when whole; null where its end is not missing.
    pub cut_from: Option<Extent>,
    pub memory_bytes: InstanceBytes,
    /// Levels of the instances in the last frame that they were seen in.
    pub levels: Vec<u32>,
}

/// What the instances share, and what one of them has of its own: the mean of all, at their levels.
#[derive(Clone, Debug, Serialize)]
pub struct InstanceBytes {
    /// Main memory of all: splits and permutations, level 0.
    pub shared_host: usize,
    /// Video memory of all: vertices, and splits and permutations where the device executes.
    pub shared_device: u64,
    /// Place, level, slice, marks of what was touched.
    pub state_of_an_instance: f64,
    /// Its slice of the index buffer, 12 bytes a face, in main memory (none where the device executes) and in video memory.
    pub host_indices_of_an_instance: f64,
    pub device_indices_of_an_instance: f64,
    /// The live faces that these slices hold: at 12 bytes each they would take no less.
    pub live_faces_of_an_instance: f64,
}

/// One frame, all surfaces together.
#[derive(Clone, Debug, Serialize)]
pub struct SurfacesFrame {
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
        SurfaceReport {
            settings: surface.settings.clone(),
            faces: full.faces,
            vertices: full.vertices,
            splits: surface.program.last_level(),
            cut_from: surface.cut_from,
            memory_bytes: InstanceBytes::from(surface.memory()),
            levels: surface.instances().map(|(_, level)| level).collect(),
        }
    }
}

impl From<SurfaceMemory> for InstanceBytes {
    fn from(memory: SurfaceMemory) -> Self {
        let of_one = |bytes: u64| bytes as f64 / memory.instances as f64;
        InstanceBytes {
            shared_host: memory.shared_host,
            shared_device: memory.shared_device,
            state_of_an_instance: of_one(memory.state as u64),
            host_indices_of_an_instance: of_one(memory.host_indices as u64),
            device_indices_of_an_instance: of_one(memory.device_indices),
            live_faces_of_an_instance: of_one(memory.live_faces),
        }
    }
}
