//! The memory of a surface, in bytes and as text.

use super::MeshOnDevice;
use super::levels::InstanceLevels;
use super::mapped::Mapped;

/// Bytes of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SurfaceMemory {
    pub instances: usize,
    /// Live faces of all instances at their levels (a count, not bytes).
    pub live_faces: u64,
    /// Main memory that the instances share: the program and level 0.
    pub shared_host: usize,
    /// Shared video memory: vertices, and the program if the device executes.
    pub shared_device: u64,
    /// Main memory of all instances without faces: placements, levels, slices, dirty flags.
    pub state: usize,
    /// Main memory of the instances' slices, if the host executes; for a baseline, of its faces and lists.
    pub host_indices: usize,
    /// Video memory of the instances' slices.
    pub device_indices: u64,
}

impl MeshOnDevice {
    /// Name and bytes of the video memory that level changes on the device need.
    pub(in crate::paper::progressive_mesh) fn program_bytes(&self) -> Option<(&'static str, u64)> {
        match &self.levels {
            InstanceLevels::Host(_) => None,
            InstanceLevels::Device(resident) => Some(("splits and permutations", resident.shared_bytes())),
            InstanceLevels::Baseline(baselines) => {
                baselines.shared_bytes().map(|bytes| ("faces by rank", bytes))
            }
        }
    }

    /// The number of instances and the memory of one instance, as text.
    pub fn of_an_instance(&self) -> String {
        let memory = self.memory();
        let [min, max] =
            [0, self.program.last_level()].map(|level| self.program.levels()[level as usize].faces);
        let state = memory.state.div_ceil(memory.instances);
        let face = self.program.index_type().triangle_bytes();
        let (places, faces, baseline) = match &self.levels {
            InstanceLevels::Host(_) if self.mapped.is_some() => {
                ("in main and in mapped memory of each frame in flight", "live", None)
            }
            InstanceLevels::Host(_) => ("in main and in video memory", "live", None),
            InstanceLevels::Device(_) => ("in video memory", "live", None),
            InstanceLevels::Baseline(baselines) => ("in video memory", "drawn", Some(baselines.adds())),
        };
        let own = format!(
            "{}: {} with {min} to {max} faces at {} levels; each has {state} bytes of state and, {places}, \
             {face} bytes per {faces} face",
            self.name,
            memory.instances,
            self.program.levels().len()
        );
        baseline.map_or(own.clone(), |adds| format!("{own}; {adds}"))
    }

    /// Bytes of the index buffer, or of the index buffers of all frames in flight.
    pub(in crate::paper::progressive_mesh) fn index_bytes(&self) -> u64 {
        self.mapped.as_ref().map_or(self.indices.bytes(), Mapped::bytes)
    }

    /// The memory of the surface: shared by its instances, and of all instances together.
    pub fn memory(&self) -> SurfaceMemory {
        let [state, host_indices] = self.levels.host_bytes();
        SurfaceMemory {
            instances: self.members.len(),
            live_faces: (0..self.members.len()).map(|n| u64::from(self.live(n))).sum(),
            shared_host: self.program.bytes(),
            shared_device: self.vertices.bytes() + self.program_bytes().map_or(0, |(_, bytes)| bytes),
            state: size_of_val(&*self.members) + state,
            host_indices,
            device_indices: self.index_bytes(),
        }
    }
}
