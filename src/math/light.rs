//! The one light of a scene.

/// Linear light that a white surface reflects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightColours {
    /// Where it faces the sun; elsewhere less, by Lambert's cosine.
    pub sun: [f32; 3],
    /// Everywhere beside.
    pub sky: [f32; 3],
}

impl Default for LightColours {
    fn default() -> LightColours {
        LightColours { sun: [0.75; 3], sky: [0.25; 3] }
    }
}

impl LightColours {
    /// As light.glsl is specialized with.
    pub fn constants(&self) -> [(&'static str, u32); 6] {
        let ([r, g, b], [sky_r, sky_g, sky_b]) = (self.sun.map(f32::to_bits), self.sky.map(f32::to_bits));
        [("SUN_R", r), ("SUN_G", g), ("SUN_B", b), ("SKY_R", sky_r), ("SKY_G", sky_g), ("SKY_B", sky_b)]
    }
}
