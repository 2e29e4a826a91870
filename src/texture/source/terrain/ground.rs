//! The surface cover of a slope, and its colour: snow, glacier ice, rock with strata, scree, dry ground,
//! meadow and forest.
//!
//! Albedo only, without sunlight. Hollows are up to 38 % darker and crests up to 12 % brighter: a hollow sees
//! less sky, and the mesh has no triangles as small as a gully.

use crate::picture::srgb;

/// The inputs of a point's colour, at the indices below. All are smooth, so that finer levels can interpolate them. An
/// array, because interpolation treats all fields alike.
pub type Fields = [f32; FIELDS];
pub const FIELDS: usize = 8;

/// Metres above the sea.
pub const HEIGHT: usize = 0;
/// Slope: rise over run.
pub const STEEP: usize = 1;
/// -1 in a hollow, 1 on a crest.
pub const CREST: usize = 2;
/// Above 0, snow stays.
pub const COLD: usize = 3;
/// Above 0, there is a glacier.
pub const ICE: usize = 4;
/// 0 in the rain shadow, 1 where the monsoon reaches.
pub const WET: usize = 5;
/// Two noises of many octaves, each about -1 ..= 1.
pub const NOISE: usize = 6;

/// Linear light.
pub type Color = [f32; 3];

/// The colours from which the ground's colour is mixed, in linear light.
pub struct Palette {
    snow: Color,
    old_snow: Color,
    ice: Color,
    debris: Color,
    dark_rock: Color,
    pale_rock: Color,
    ochre_rock: Color,
    scree: Color,
    dry: Color,
    pale_dry: Color,
    straw: Color,
    meadow: Color,
    forest: Color,
    field: Color,
    beds: [f32; BEDS],
}

impl Palette {
    pub fn new() -> Palette {
        let color = |bytes: [u8; 3]| bytes.map(|byte| srgb::to_linear_f64(byte) as f32);
        Palette {
            snow: color([240, 243, 248]),
            old_snow: color([216, 224, 235]),
            ice: color([176, 196, 208]),
            debris: color([112, 107, 102]),
            dark_rock: color([57, 55, 57]),
            pale_rock: color([138, 126, 114]),
            ochre_rock: color([158, 130, 92]),
            scree: color([128, 117, 105]),
            dry: color([132, 107, 80]),
            pale_dry: color([172, 150, 118]),
            straw: color([142, 127, 88]),
            meadow: color([110, 113, 64]),
            forest: color([46, 59, 36]),
            field: color([132, 130, 76]),
            beds: beds(),
        }
    }
}

fn mix(from: Color, to: Color, share: f32) -> Color {
    std::array::from_fn(|n| from[n] + (to[n] - from[n]) * share)
}

/// Shares above this count as 1, and shares below 1 - OPAQUE as 0, so that invisible parts are not computed.
const OPAQUE: f32 = 0.996;

/// Like [`mix`]; computes `to` only if its share is visible.
fn mix_with(from: Color, share: f32, to: impl FnOnce() -> Color) -> Color {
    if share > 1.0 - OPAQUE { mix(from, to(), share) } else { from }
}

/// 0 below -1, 1 above 1, smooth between.
fn step(at: f32) -> f32 {
    let t = (0.5 + 0.5 * at).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Number of beds of rock. The thinnest beds (17 m) repeat after 17 km.
const BEDS: usize = 1 << 10;

/// The brightness of each bed, 0 ..= 1, from the lowest up.
fn beds() -> [f32; BEDS] {
    std::array::from_fn(|n| {
        let mut bits = (n as u32).wrapping_mul(0x9E37_79B1);
        bits = (bits ^ bits >> 15).wrapping_mul(0x7feb_352d);
        bits = (bits ^ bits >> 13).wrapping_mul(0x846c_a68b);
        (bits >> 16) as f32 * (1.0 / 65_535.0)
    })
}

/// Thickness of strata in metres, and their weight in the rock's brightness.
const STRATA: [(f32, f32); 3] = [(170.0, 0.5), (55.0, 0.35), (17.0, 0.3)];

impl Palette {
    /// The colour of a point, in a level with texels of `texel_m`.
    pub fn color(&self, ground: &Fields, texel_m: f32) -> Color {
        let [a, b] = [ground[NOISE], ground[NOISE + 1]];
        let snow = step((ground[COLD] + 1.1 * a - 0.8 * ground[CREST].min(0.0)) * 2.6);
        let ice = step((ground[ICE] + 0.5 * b) * 2.5);
        let under = match (snow > OPAQUE, ice > OPAQUE) {
            (true, _) => self.snow,
            (false, true) => self.glacier(ground),
            (false, false) => mix_with(self.bare(ground, texel_m), ice, || self.glacier(ground)),
        };
        let white = || mix(self.old_snow, self.snow, step(1.2 * b + 0.6 * ground[CREST] + 0.4));
        let color = mix_with(under, snow, white);
        let shade = 1.0 + ground[CREST] * if ground[CREST] < 0.0 { 0.38 } else { 0.12 };
        color.map(|channel| (channel * shade).clamp(0.002, 0.96))
    }

    /// The colour without snow and ice.
    fn bare(&self, ground: &Fields, texel_m: f32) -> Color {
        let [a, b] = [ground[NOISE], ground[NOISE + 1]];
        let rocky = step((ground[STEEP] - 0.78 + 0.30 * b + 0.10 * a) * 4.0);
        let soil = if rocky < OPAQUE { self.soil(ground) } else { self.scree };
        mix_with(soil, rocky, || self.rock(ground, texel_m))
    }

    /// Interpolates smoothly between beds; `at` counts beds from `first`.
    fn bed(&self, at: f32, first: usize) -> f32 {
        // Heights are positive, so truncation equals floor.
        let n = at as usize;
        let t = at - n as f32;
        let [below, above] = [n + first, n + first + 1].map(|n| self.beds[n % BEDS]);
        below + (above - below) * (t * t * (3.0 - 2.0 * t))
    }

    fn rock(&self, ground: &Fields, texel_m: f32) -> Color {
        let [a, b] = [ground[NOISE], ground[NOISE + 1]];
        // Beds dip and wave: noise shifts their height.
        let bed_m = ground[HEIGHT] + 70.0 * a + 40.0 * b;
        let mut bright = 0.38 + 0.55 * b;
        for (n, (thick_m, share)) in STRATA.into_iter().enumerate() {
            let seen = (thick_m * (0.5 / texel_m) - 1.0).clamp(0.0, 1.0);
            if seen > 0.0 {
                bright += seen * share * (self.bed(bed_m * (1.0 / thick_m), 256 * n) - 0.5);
            }
        }
        let rock = mix(self.dark_rock, self.pale_rock, bright.clamp(0.0, 1.0));
        // Everest's Yellow Band, and beds of its colour elsewhere.
        let yellow = 1.0 - ((bed_m - 8300.0) * (1.0 / 170.0)).abs();
        let elsewhere = 1.6 * self.bed(bed_m * (1.0 / 420.0), 900) - 1.15;
        mix(rock, self.ochre_rock, yellow.max(elsewhere).clamp(0.0, 0.7))
    }

    fn soil(&self, ground: &Fields) -> Color {
        let [a, b] = [ground[NOISE], ground[NOISE + 1]];
        let high = (ground[HEIGHT] - 5080.0 + 420.0 * a + 900.0 * (ground[STEEP] - 0.3)) * (1.0 / 330.0);
        let green = step((ground[WET] - 0.5 + 0.22 * a) * 4.0);
        let dry = || mix(self.dry, self.pale_dry, step(1.3 * b - 2.4 * (ground[STEEP] - 0.28)));
        let low = if green > OPAQUE { self.dry } else { dry() };
        let low = mix_with(low, green, || self.green(ground));
        mix_with(low, step(high), || mix(self.scree, self.debris, step(1.5 * a)))
    }

    fn green(&self, ground: &Fields) -> Color {
        let ([a, b], height) = ([ground[NOISE], ground[NOISE + 1]], ground[HEIGHT]);
        let meadow = mix(self.straw, self.meadow, step((4750.0 - height + 800.0 * b) * (1.0 / 400.0)));
        let trees = step((4050.0 - height + 300.0 * a) * (1.0 / 180.0)) * step((a - b + 0.5) * 3.0);
        let farmed = step((2350.0 - height + 500.0 * b) * (1.0 / 300.0)) * step((0.55 - ground[STEEP]) * 6.0);
        let wooded = mix(meadow, self.forest, trees);
        mix_with(wooded, farmed * step((b + 0.1) * 3.0), || mix(self.field, self.straw, step(4.0 * a)))
    }

    /// Clean ice high up, debris-covered ice lower down.
    fn glacier(&self, ground: &Fields) -> Color {
        let [a, b] = [ground[NOISE], ground[NOISE + 1]];
        let clean = step((ground[HEIGHT] - 5350.0) * (1.0 / 350.0) + 1.1 * a - 0.3);
        mix(mix(self.debris, self.scree, step(2.0 * b)), mix(self.ice, self.old_snow, step(2.0 * b)), clean)
    }
}

/// The second-nearest parent of a child along one axis, clamped at the map's edge.
pub fn second_parent(child: usize, last: usize) -> usize {
    if child.is_multiple_of(2) { (child / 2).saturating_sub(1) } else { (child / 2 + 1).min(last) }
}
