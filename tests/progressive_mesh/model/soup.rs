//! Random faces over few positions.

use super::super::made::Random;
use ortelius::model::{Raw, clean};

/// In a soup almost no edge has two faces, and at almost every position the faces form more than one fan.
#[test]
fn cleaning_accepts_any_soup_of_faces() {
    let mut random = Random(6);
    let mut counts = [0; 5];
    for round in 0..3000 {
        let mut soup = Raw::default();
        let vertices = 3 + random.below(12);
        for _ in 0..vertices {
            let place = std::array::from_fn(|_| random.below(3) as f64);
            soup.positions.push(glam::DVec3::from_array(place));
            soup.attributes.coordinates.push([random.below(2) as f32, 0.0]);
        }
        for _ in 0..random.below(40) {
            soup.faces.push(std::array::from_fn(|_| random.below(vertices) as u32));
        }
        let (model, report) = clean(&soup);
        model.check().unwrap_or_else(|broken| panic!("round {round}: {broken}"));
        for (count, there) in counts.iter_mut().zip([
            report.reversed_faces,
            report.folded_faces,
            report.turned_faces,
            report.non_manifold_edges,
            report.topology.seam_edges,
        ]) {
            *count += usize::from(there > 0);
        }
        // Cleaning is idempotent, even if several positions coincide.
        let places = model.wedge_positions.iter().map(|&position| model.positions[position as usize]);
        let again = Raw {
            positions: places.collect(),
            attributes: model.attributes.clone(),
            faces: model.faces.clone(),
        };
        assert!(clean(&again).0 == model, "round {round}");
    }
    // Every kind of repair occurs.
    assert!(counts.iter().all(|count| *count > 100), "{counts:?}");
}
