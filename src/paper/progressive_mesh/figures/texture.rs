//! pm.texture: how far a level shifts a texture.

use super::super::choices::ErrorMetric;
use super::super::simplify::{Collapses, SimplifyOptions, simplify};
use super::orders::number;
use super::surfaces::Size;
use super::{metrics, scans};
use crate::figure::prelude::*;
use crate::model::{Model, Raw, clean, mesh};
use glam::{DVec2, DVec3};

pub const TEXTURE: Figure = Figure {
    id: "pm.texture",
    title: "Texture at a wanted error",
    about: "A face interpolates the texture coordinates of its corners. Where the coordinates do not follow the \
            surface evenly, a coarse level shows texels elsewhere than the full mesh does, even if it is nowhere far \
            from the full mesh's surface. The shift is the distance from where a texel is shown to where the full mesh \
            shows it. It is measured at 256 points of each face of the level, by the exact inverse of the full mesh's \
            texture coordinates. Its unit is the wanted error: if that is one pixel, the shift is in pixels. \
            `distances` are the paper's collapses. `appearance` (`metric = \"appearance\"`) counts the shift as an \
            error; it is measured at the same number of faces, and therefore at another wanted error. The shift is \
            also given in diagonals of the model's box. `globe` is an ellipsoid with longitudes and latitudes as \
            coordinates, and `knot` has coordinates along and around its tube. The coordinates of `valley:65` are a \
            vertical projection, so its shift is the vertical distance of the surfaces, which is larger than their \
            distance where faces are steep. `appearance` also counts normals, which on the valley decide which faces \
            remain. A texel that the full mesh does not show, between the triangles of a pole, is left out.",
    scenes: &[GLOBE, "knot", VALLEY],
    variants: || [BY_DISTANCE, AWARE].map(String::from).into(),
    paper: &[BY_DISTANCE],
    ours: &[AWARE],
    full_only: &[],
    sweep: Some(Sweep { name: "faces left, %", quick: &[25.0, 5.0], full: &[50.0, 25.0, 10.0, 5.0, 2.0] }),
    show: Show::views(views).variants(|| metrics([BY_DISTANCE, AWARE])),
    measure,
    plots: &[Plot::sweep(LARGEST).log_x().log_y(), Plot::sweep(SHIFT).log_x().log_y()],
    claims: &[
        Claim::ours(
            "distance-bounds",
            "An error that knows only distances bounds the largest shift of a texture.",
            &[Test::value(one(LARGEST, BY_DISTANCE), AtMost(1.0))],
        ),
        Claim::ours(
            "appearance-bounds",
            "An error that counts the shift bounds the largest shift.",
            &[Test::value(one(LARGEST, AWARE), AtMost(1.0))],
        ),
        Claim::ours(
            "equal-faces",
            "At equal numbers of faces, counting the shift does not raise it.",
            &[Test::ratio_of(SHIFT, [AWARE, BY_DISTANCE], AtMost(1.0))],
        ),
    ],
};

const GLOBE: &str = "globe";
const VALLEY: &str = "valley:65";
const BY_DISTANCE: &str = "distances";
const AWARE: &str = "appearance";

const PIXELS: &str = "shift at 99.9 % of the surface";
const LARGEST: &str = "largest shift";
const MEAN: &str = "mean shift";
const SHIFT: &str = "shift at 99.9 % of the surface, of the model";
const STATED: &str = "stated error";
const FACES: &str = "faces";

/// What a window shows: the knot with a texture. The globe is not a shipped model, and the
/// valley's file has only one metric.
fn views() -> Vec<FigureView> {
    let changes = ["geometry.source=knot", "texture={kind='plain', source='checker'}"];
    vec![FigureView::new("knot", "bunny/near", changes.map(|change| format!("surface.bunny.{change}")))]
}

fn measure(_: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let part = cell.x.context("the sweep has values")? / 100.0;
    let model = if cell.scene == GLOBE { globe() } else { scans::open(&cell.scene)? };
    let texels = UvLookup::of(&model);
    let target_faces = (model.faces.len() as f64 * part) as usize;
    let mut rows = Vec::new();
    for (variant, metric) in [(BY_DISTANCE, ErrorMetric::Geometry), (AWARE, ErrorMetric::Appearance)] {
        let options = SimplifyOptions { target_faces, metric, ..SimplifyOptions::default() };
        let collapses = simplify(&model, &options, &mut |_, _| {}).collapses;
        let steps = collapses.steps_to(&model, target_faces);
        let stated = collapses.error_after(steps);
        let shifts = Shifts::of(&texels, &collapses, steps).context("a face is left")?;
        rows.push(number(variant, PIXELS, "wanted errors", shifts.common / stated));
        rows.push(number(variant, LARGEST, "wanted errors", shifts.largest / stated));
        rows.push(number(variant, MEAN, "wanted errors", shifts.mean / stated));
        let diagonal = Size::of(&model).diagonal;
        rows.push(number(variant, SHIFT, "diagonals", shifts.common / diagonal));
        rows.push(number(variant, STATED, "diagonals", stated / diagonal));
        rows.push(number(variant, FACES, "faces", collapses.faces_after(&model, steps).len() as f64));
    }
    Ok(rows)
}

/// An ellipsoid of 9024 faces; s is the longitude, t the latitude.
fn globe() -> Model {
    let earth = mesh::earth(96, 48);
    let mut raw = Raw { positions: earth.positions, faces: earth.triangles, ..Raw::default() };
    raw.attributes.coordinates = earth.coordinates.iter().map(|st| st.as_vec2().to_array()).collect();
    clean(&raw).0
}

/// The inverse of a model's texture coordinates: where it shows a texel. Faces are listed by the cells of a grid over
/// the coordinates.
struct UvLookup<'a> {
    model: &'a Model,
    low: DVec2,
    cell: DVec2,
    side: usize,
    cells: Vec<Vec<u32>>,
}

impl UvLookup<'_> {
    fn of(model: &Model) -> UvLookup<'_> {
        let coordinates = model.attributes.coordinates.iter().map(|st| DVec2::from(st.map(f64::from)));
        let low = coordinates.clone().fold(DVec2::MAX, DVec2::min);
        let high = coordinates.fold(DVec2::MIN, DVec2::max);
        let side = (model.faces.len() as f64).sqrt() as usize + 1;
        let cell = (high - low) / side as f64;
        let mut texels = UvLookup { model, low, cell, side, cells: vec![Vec::new(); side * side] };
        for face in 0..model.faces.len() {
            let corners = texels.corners(face as u32);
            let [first, last] = [DVec2::min, DVec2::max]
                .map(|min| texels.cell_of(min(min(corners[0], corners[1]), corners[2])));
            for row in first[1]..=last[1] {
                for column in first[0]..=last[0] {
                    texels.cells[row * side + column].push(face as u32);
                }
            }
        }
        texels
    }

    fn texel(&self, wedge: u32) -> DVec2 {
        DVec2::from(self.model.attributes.coordinates[wedge as usize].map(f64::from))
    }

    fn point(&self, wedge: u32) -> DVec3 {
        self.model.positions[self.model.wedge_positions[wedge as usize] as usize]
    }

    fn corners(&self, face: u32) -> [DVec2; 3] {
        self.model.faces[face as usize].map(|wedge| self.texel(wedge))
    }

    fn cell_of(&self, texel: DVec2) -> [usize; 2] {
        ((texel - self.low) / self.cell).to_array().map(|at| (at as usize).min(self.side - 1))
    }

    /// Where the model shows a texel; `None` if no face does.
    fn place(&self, texel: DVec2) -> Option<DVec3> {
        let [column, row] = self.cell_of(texel);
        self.cells[row * self.side + column].iter().find_map(|&face| {
            let [a, b, c] = self.corners(face);
            let (ab, ac, at) = (b - a, c - a, texel - a);
            let area = ab.perp_dot(ac);
            let (v, w) = (at.perp_dot(ac) / area, ab.perp_dot(at) / area);
            // A texel on an edge belongs to both faces.
            let within = [1.0 - v - w, v, w].iter().all(|weight| *weight >= -1e-9);
            let [a, b, c] = self.model.faces[face as usize].map(|wedge| self.point(wedge));
            within.then(|| a + (b - a) * v + (c - a) * w)
        })
    }
}

/// Distances from where texels are shown to where the model shows them, in object units.
#[derive(Debug)]
struct Shifts {
    mean: f64,
    /// The shift that 99.9 % of the level's surface does not exceed.
    common: f64,
    largest: f64,
}

/// Each side of a face is divided into this many parts; a face has `PARTS`^2 sample points.
const PARTS: u32 = 16;

impl Shifts {
    /// The shifts of the level after `steps` collapses; `None` if no face shows a texel of the model.
    fn of(texels: &UvLookup, collapses: &Collapses, steps: usize) -> Option<Shifts> {
        let mut shifts = Vec::new();
        for wedges in collapses.faces_after(texels.model, steps) {
            let [a, b, c] = wedges.map(|wedge| texels.point(wedge));
            let [d, e, f] = wedges.map(|wedge| texels.texel(wedge));
            let area = (b - a).cross(c - a).length();
            for [v, w] in thirds() {
                let shown = a + (b - a) * v + (c - a) * w;
                if let Some(place) = texels.place(d + (e - d) * v + (f - d) * w) {
                    shifts.push((shown.distance(place), area));
                }
            }
        }
        shifts.sort_by(|x, y| x.0.total_cmp(&y.0));
        let whole: f64 = shifts.iter().map(|(_, area)| area).sum();
        let mut before = 0.0;
        let common = shifts.iter().find(|(_, area)| {
            before += area;
            before >= 0.999 * whole
        })?;
        Some(Shifts {
            mean: shifts.iter().map(|(shift, area)| shift * area).sum::<f64>() / whole,
            common: common.0,
            largest: shifts.last()?.0,
        })
    }
}

/// The centres of a triangle's `PARTS`^2 equal parts, as weights of its second and third corner.
fn thirds() -> impl Iterator<Item = [f64; 2]> {
    let at = |n: u32, thirds: u32| f64::from(3 * n + thirds) / f64::from(3 * PARTS);
    (0..PARTS).flat_map(move |i| {
        (0..PARTS - i).flat_map(move |j| {
            let upward = [at(i, 1), at(j, 1)];
            let downward = (i + j + 1 < PARTS).then_some([at(i, 2), at(j, 2)]);
            std::iter::once(upward).chain(downward)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_full_model_shifts_nothing_and_a_moved_texel_is_found() {
        assert_eq!(thirds().count() as u32, PARTS * PARTS);
        let model = globe();
        let texels = UvLookup::of(&model);
        let whole = Shifts::of(&texels, &Collapses::default(), 0).unwrap();
        assert!(whole.largest < 1.0, "{whole:?} of 6 378 137 m");
        // A twentieth of a turn at the equator, on the model's chords.
        let [here, there] = [0.5, 0.55].map(|s| texels.place(DVec2::new(s, 0.5)).unwrap());
        let chord = 2.0 * 6_378_137.0 * (std::f64::consts::PI / 20.0).sin();
        assert!((here.distance(there) / chord - 1.0).abs() < 1e-2, "{here} {there}");
    }
}
