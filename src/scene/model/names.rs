//! Models by name: the shipped scans and the generated ones.

use super::{Model, clean, generate, obj, terrain};

/// The shipped models, each of at least 3000 faces. All but the height fields `grid` and `everest` are closed.
pub const NAMES: [&str; 7] = ["bunny", "sphere", "torus", "knot", "solid", "grid", "everest"];

/// The Stanford bunny with 3674 faces (scenes/bunny.NOTICE).
const BUNNY: &[u8] = include_bytes!("../../../scenes/bunny.obj");

/// A model by name; `NAME:SIZE` gives a generated one another size, as its function in [`generate`] takes it. `None`
/// for a name that is not among [`NAMES`], and for a size that it cannot have.
pub fn named(name: &str) -> Option<Model> {
    let (name, size) = match name.split_once(':') {
        Some((name, size)) => (name, Some(size.parse::<u32>().ok()?)),
        None => (name, None),
    };
    let fits = |usual: u32, sizes: std::ops::RangeInclusive<u32>| {
        Some(size.unwrap_or(usual)).filter(|size| sizes.contains(size))
    };
    Some(match name {
        "bunny" if size.is_none() => bunny(),
        "everest" if size.is_none() => terrain::everest(),
        "sphere" => generate::sphere(fits(20, 1..=1 << 9)?),
        "torus" => generate::torus(fits(48, 3..=1 << 11)?),
        "knot" => generate::knot(fits(24, 3..=1 << 9)?),
        "solid" => generate::solid(fits(16, 4..=1 << 12).filter(|detail| detail.is_power_of_two())?),
        "grid" => generate::grid(fits(65, 2..=1 << 11)?, 0),
        _ => return None,
    })
}

fn bunny() -> Model {
    let raw = obj::read(BUNNY).expect("the shipped file is read by a test");
    let (model, report) = clean(&raw);
    assert_eq!(report.changes(), [""; 0], "the shipped bunny is clean");
    model
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shipped_model_holds_what_models_promise_and_is_closed_but_height_fields() {
        for name in NAMES {
            let model = named(name).unwrap();
            model.check().unwrap_or_else(|broken| panic!("{name}: {broken}"));
            let topology = model.topology();
            assert_eq!(topology.is_closed(), !["grid", "everest"].contains(&name), "{name}: {topology:?}");
            assert!(model.faces.len() >= 3000 && topology.components == 1, "{name}: {topology:?}");
        }
        assert_eq!(named("bunny").unwrap().faces.len(), 3674);
        assert_eq!(named("solid").unwrap().faces.len(), 16_384);
        let everest = named("everest").unwrap();
        let summit = everest.positions.iter().max_by(|a, b| a.z.total_cmp(&b.z)).unwrap();
        assert_eq!((summit.to_array(), everest.faces.len()), ([0.0, 0.0, 8752.0], 32_768));
    }

    #[test]
    fn sizes_are_taken_and_wrong_ones_are_no_name() {
        assert_eq!(named("sphere:3").unwrap().faces.len(), 180);
        assert_eq!(named("grid:5").unwrap().faces.len(), 32);
        for name in [
            "bunny:3",
            "sphere:0",
            "solid:12",
            "solid:2",
            "grid:1",
            "grid:99999",
            "torus:",
            "knot:-1",
            "none",
        ] {
            assert!(named(name).is_none(), "{name}");
        }
    }
}
