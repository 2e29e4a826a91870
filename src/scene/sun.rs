//! `[sun]`: the light of a scene.

use super::Scene;
use super::declare::settings;
use crate::math::light::LightColours;
use glam::DVec3;

settings! {
    /// The scene's light, infinitely far away. By default it is in the south-west, 50 degrees high, which lights
    /// slopes that face a camera looking north. Over an ellipsoid, both angles are relative to the ground below the
    /// view's camera.
    pub struct Sun derive(Copy) with DEFAULT {
        /// Clockwise from north.
        azimuth_deg: f64 = 225.0, in -360.0..=360.0, unit "degrees";
        /// Above the horizon.
        elevation_deg: f64 = 50.4, in -90.0..=90.0, unit "degrees";
        /// Linear red, green and blue reflected by a white surface that faces the sun.
        colour: [f64; 3] = [0.75; 3], in 0.0..=1e3;
        /// Linear red, green and blue that a white surface reflects from the sky, whatever its direction.
        sky: [f64; 3] = [0.25; 3], in 0.0..=1e3;
    }
}

impl Scene {
    /// Colours of sun and sky.
    pub fn light_colours(&self) -> LightColours {
        let Sun { colour, sky, .. } = self.sun.unwrap_or(Sun::DEFAULT);
        let linear = |colour: [f64; 3]| colour.map(|channel| channel as f32);
        LightColours { sun: linear(colour), sky: linear(sky) }
    }

    /// Unit vector towards the sun, in world space.
    pub fn sun(&self) -> DVec3 {
        let local = match self.sun {
            None => DVec3::new(-0.45, -0.45, 0.77).normalize(),
            Some(Sun { azimuth_deg, elevation_deg, .. }) => {
                let (sin_azimuth, cos_azimuth) = azimuth_deg.to_radians().sin_cos();
                let (sin_elevation, cos_elevation) = elevation_deg.to_radians().sin_cos();
                DVec3::new(sin_azimuth * cos_elevation, cos_azimuth * cos_elevation, sin_elevation)
            }
        };
        // Over a plane the local frame equals the world's axes, so the vector stays exact.
        let frame = self.cameras[&self.view.camera].place.frame();
        frame.east * local.x + frame.north * local.y + frame.up * local.z
    }
}
