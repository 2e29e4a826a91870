//! The light of a scene.

/// Linear light reflected by a white surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightColours {
    /// Where the surface faces the sun; scaled by Lambert's cosine elsewhere.
    pub sun: [f32; 3],
    /// Ambient light, added everywhere.
    pub sky: [f32; 3],
}

impl Default for LightColours {
    fn default() -> LightColours {
        LightColours { sun: [0.75; 3], sky: [0.25; 3] }
    }
}

impl LightColours {
    /// Specialization constants of light.glsl.
    pub fn constants(&self) -> [(&'static str, u32); 6] {
        let ([r, g, b], [sky_r, sky_g, sky_b]) = (self.sun.map(f32::to_bits), self.sky.map(f32::to_bits));
        [("SUN_R", r), ("SUN_G", g), ("SUN_B", b), ("SKY_R", sky_r), ("SKY_G", sky_g), ("SKY_B", sky_b)]
    }
}
