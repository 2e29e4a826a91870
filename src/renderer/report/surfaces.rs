//! The report's section on progressive meshes.

use crate::paper::progressive_mesh::config::ProgressiveSurface;
use crate::paper::progressive_mesh::file::Extent;
use crate::paper::progressive_mesh::{MeshFrameRecord, MeshOnDevice, SurfaceMemory};
use serde::Serialize;

/// One surface.
#[derive(Clone, Debug, Serialize)]
pub struct SurfaceReport {
    /// Settings as in the scene.
    pub settings: ProgressiveSurface,
    /// Faces of the full mesh.
    pub faces: u32,
    pub vertices: u32,
    /// The number of splits from level 0 to the full mesh.
    pub splits: u32,
    /// The complete extent of a truncated `.pmesh` file; null if the file is complete.
    pub cut_from: Option<Extent>,
    pub memory_bytes: InstanceBytes,
    /// Levels of the instances, each from the last frame in which it was visible.
    pub levels: Vec<u32>,
}

/// Memory shared by all instances, and memory of a single instance (the mean over all instances at their levels).
#[derive(Clone, Debug, Serialize)]
pub struct InstanceBytes {
    /// Main memory shared by all: splits and permutations, level 0.
    pub shared_host: usize,
    /// Video memory shared by all: vertices, and splits and permutations if the device executes them.
    pub shared_device: u64,
    /// Placement, level, slice, and dirty flags.
    pub state_of_an_instance: f64,
    /// An instance's slice of the index buffer, 6 or 12 bytes per face: in main memory (0 if the device executes the
    /// splits) and in video memory.
    pub host_indices_of_an_instance: f64,
    pub device_indices_of_an_instance: f64,
    /// Number of live faces in a slice. This number times 6 or 12 bytes is the minimum size of a slice.
    pub live_faces_of_an_instance: f64,
}

/// One frame, all surfaces together.
#[derive(Clone, Debug, Serialize)]
pub struct SurfacesFrame {
    /// Host time for culling, choosing and executing level changes, and copying the results to mapped memory.
    pub host_ns: u64,
    pub instances_seen: usize,
    pub faces: u64,
    /// Live vertices of the visible instances.
    pub vertices: u64,
    pub splits: u64,
    pub collapses: u64,
    /// Bytes uploaded for meshes. Uploads of the virtual texture are counted in its own part of the frame.
    pub mesh_upload_bytes: u64,
    /// The governor's factor on all target errors; 1 without a governor.
    pub error_factor: f64,
}

impl From<&MeshFrameRecord> for SurfacesFrame {
    fn from(record: &MeshFrameRecord) -> Self {
        let change = &record.change;
        SurfacesFrame {
            host_ns: record.host.as_nanos() as u64,
            instances_seen: change.instances_seen,
            faces: change.faces,
            vertices: change.vertices,
            splits: change.splits,
            collapses: change.collapses,
            mesh_upload_bytes: change.upload_bytes,
            error_factor: record.error_factor,
        }
    }
}

impl From<&MeshOnDevice> for SurfaceReport {
    fn from(surface: &MeshOnDevice) -> Self {
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
