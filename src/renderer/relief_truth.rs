//! The rays of a pixel to a relief below a plane, in f64. Only the origin and the direction of a ray are rounded to
//! f32.

use crate::paper::texture_mapping::relief::reference::first_hit;
use crate::paper::texture_mapping::relief::{Ray, Relief};
use crate::reference::ReferenceView;
use glam::DVec3;

/// A relief below a square plane, seen from one position. Lengths are in texels of the relief; the centre of texel (i,
/// j) is at (i, j).
pub struct Below {
    relief: Relief,
    eye: DVec3,
}

/// Where a ray meets the relief.
pub struct Hit {
    /// Texture coordinate.
    pub at: [f64; 2],
    /// Points east, north and up; not normalised.
    pub normal: DVec3,
}

impl Below {
    /// `eye` is in world space, in metres; the plane has a side of `size_m`.
    pub fn new(relief: Relief, size_m: f64, eye: DVec3) -> Below {
        let (side, eye) = (relief.side as f64, eye / size_m);
        let middle = 0.5 * side - 0.5;
        Below { relief, eye: DVec3::new(middle + side * eye.x, middle - side * eye.y, side * eye.z) }
    }

    /// The hits of `rays x rays` evenly spaced rays through a pixel; rays beside the plane have none.
    pub fn hits(&self, plane: &ReferenceView, [x, y]: [u32; 2], rays: u32) -> Vec<Hit> {
        let within = |n: u32| (f64::from(n) + 0.5) / f64::from(rays);
        let places =
            (0..rays * rays).map(|n| [f64::from(x) + within(n % rays), f64::from(y) + within(n / rays)]);
        places.filter_map(|[x, y]| self.hit(plane.coordinate(x, y)?)).collect()
    }

    /// The hit of the ray through a point of the plane; `None` if the ray does not descend.
    fn hit(&self, coordinate: [f64; 2]) -> Option<Hit> {
        let side = self.relief.side as f64;
        let [x, y] = coordinate.map(|c| c * side - 0.5);
        let direction = (DVec3::new(x, y, 0.0) - self.eye).normalize();
        let ray = Ray { origin: [x as f32, y as f32], direction: direction.as_vec3().to_array() };
        if direction.z >= 0.0 {
            return None;
        }
        let distance = first_hit(&self.relief, &ray);
        let [x, y] = [x + distance * direction.x, y + distance * direction.y];
        // Slopes over two texels, as the scene's light uses them: a bilinear surface has an edge at each texel.
        let east = 0.5 * (self.height(x + 1.0, y) - self.height(x - 1.0, y));
        let south = 0.5 * (self.height(x, y + 1.0) - self.height(x, y - 1.0));
        let at = [x, y].map(|c| (c + 0.5) / side);
        Some(Hit { at, normal: DVec3::new(-east, south, 1.0) })
    }

    /// Bilinear height above the floor.
    fn height(&self, x: f64, y: f64) -> f64 {
        let [a, b, c, d] = self.relief.corners(x.floor() as i64, y.floor() as i64).map(f64::from);
        let (fx, fy) = (x - x.floor(), y - y.floor());
        (a * (1.0 - fx) + b * fx) * (1.0 - fy) + (c * (1.0 - fx) + d * fx) * fy
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Heights rise by one code for each texel to the east; the jump is at column 0.
    fn ramp() -> Below {
        let side = 64;
        let heights = (0..side * side).map(|n| (n % side) as u8).collect();
        // The depth of 63.75 texels is 255 codes, so a code is a quarter of a texel high.
        let relief = Relief { side, depth: 63.75, heights };
        Below::new(relief, 4.0, DVec3::new(0.0, 0.0, 8.0))
    }

    #[test]
    fn a_vertical_ray_meets_the_height_below_its_point_and_the_slope_tilts_the_normal_west() {
        let hit = ramp().hit([0.5, 0.5]).unwrap();
        // The camera is above the middle.
        assert!((hit.at[0] - 0.5).abs() < 1e-6 && (hit.at[1] - 0.5).abs() < 1e-6, "{:?}", hit.at);
        assert!((hit.normal - DVec3::new(-0.25, 0.0, 1.0)).length() < 1e-6, "{}", hit.normal);
    }

    #[test]
    fn an_oblique_ray_goes_on_to_the_point_where_it_is_as_high_as_the_relief() {
        let below = ramp();
        // The eye is 8 m above the middle, and the ray meets the plane 1 m east of it. So the ray moves an eighth of a
        // texel to the east for each texel down.
        let hit = below.hit([0.75, 0.5]).unwrap();
        let x = hit.at[0] * 64.0 - 0.5;
        // x = 47.5 + down/8, and x/4 = 63.75 - down.
        let down = (63.75 - 47.5 / 4.0) / (1.0 + 1.0 / 32.0);
        assert!((x - (47.5 + down / 8.0)).abs() < 1e-4, "{x}");
        assert!(below.hit([2.0, 0.5]).is_some(), "the relief repeats beyond the plane");
        let under = Below::new(below.relief.clone(), 4.0, DVec3::new(0.0, 0.0, -1.0));
        assert!(under.hit([0.5, 0.5]).is_none());
    }
}
