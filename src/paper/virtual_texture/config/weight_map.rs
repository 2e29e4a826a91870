//! The weight map of the filter `"ellipse"` (paper 3, step D): its keys, its table, and the shaders that read it.

use super::Filter;
use crate::math::weight_map::{WeightMap, map_reach};
use crate::paper::virtual_texture::choices::{FilterEdge, Filtering};
use crate::scene::{SceneFault, SceneTable};
use crate::vk::shader::Shader;

/// Rejects keys of a weight map if the filter has none, and invalid values.
pub(super) fn check(filter: &Filter, part: &SceneTable<'_>) -> Result<(), SceneFault> {
    let Some(shape) = filter.weight_map.shape() else {
        return part.reject(&["map_entries", "map_bits", "map_linear"], "weight_map = \"none\"");
    };
    let (entries, bits) = (filter.map_entries, filter.map_bits);
    if !entries.is_power_of_two() {
        return Err(part.fault("map_entries", format!("{entries} is not a power of two")));
    }
    if !matches!(bits, 8 | 16) {
        return Err(part.fault("map_bits", format!("{bits} is neither 8 nor 16")));
    }
    if filter.map_linear && !shape.is_one_dimensional() {
        let what =
            "a two-dimensional map is not interpolated; use weight_map = \"radial\" or \"squared-radius\"";
        return Err(part.fault("map_linear", what));
    }
    Ok(())
}

impl Filter {
    /// The weight map that replaces the kernel's formula.
    pub fn map(&self) -> Option<WeightMap> {
        let shape = self.weight_map.shape().filter(|_| self.kind == Filtering::Ellipse)?;
        Some(WeightMap { shape, entries: self.map_entries, bits: self.map_bits, linear: self.map_linear })
    }

    /// Specialization constants of `weight_map.glsl`.
    pub(super) fn map_constants(&self) -> Option<[(&'static str, u32); 5]> {
        Some(self.map()?.constants(self.map_reach()))
    }

    /// The words of the weight map.
    pub fn map_words(&self) -> Option<Vec<u32>> {
        let [_, alpha] = self.kernel.radius_and_alpha();
        Some(self.map()?.words(alpha, self.map_reach()))
    }

    fn map_reach(&self) -> f64 {
        map_reach(self.edge != FilterEdge::None)
    }

    /// The unlit and the lit form of a shader that filters a surface, with or without the weight map (`form.glsl`).
    pub fn forms(&self, shaders: &'static [Shader; 4]) -> [&'static Shader; 2] {
        let [plain_unlit, plain_lit, map_unlit, map_lit] = shaders;
        if self.map().is_some() { [map_unlit, map_lit] } else { [plain_unlit, plain_lit] }
    }
}
