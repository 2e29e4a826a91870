//! Models by name: shipped scans and generated models.

use super::{Model, clean, generate, obj, terrain};
use std::ops::RangeInclusive;

/// The shipped models, each with at least 3000 faces. All are closed except the height fields `grid`, `everest` and
/// `valley`.
pub const NAMES: [&str; 8] = ["bunny", "sphere", "torus", "knot", "solid", "grid", "everest", "valley"];

/// The Stanford bunny with 3674 faces (scenes/bunny.NOTICE).
const BUNNY: &[u8] = include_bytes!("../../scenes/bunny.obj");

/// A model by name. `NAME:SIZE` selects the size of a generated model, in the unit of its generator function.
/// `None` for a name that is not in [`NAMES`], or an unsupported size.
pub fn named(name: &str) -> Option<Model> {
    let (name, size) = match name.split_once(':') {
        Some((name, size)) => (name, Some(size.parse::<u32>().ok()?)),
        None => (name, None),
    };
    match (GENERATED.iter().find(|model| model.name == name), size) {
        (Some(model), size) => {
            let size = size.unwrap_or(model.usual);
            model.has(size).then(|| (model.generate)(size))
        }
        (None, None) if name == "bunny" => Some(bunny()),
        (None, None) if name == "everest" => Some(terrain::everest()),
        _ => None,
    }
}

/// The error text for `NAME:SIZE` if NAME exists but not in this size; lists the supported sizes.
pub(super) fn wrong_size(name: &str) -> Option<String> {
    let (name, size) = name.split_once(':')?;
    if let Some(Generated { sizes, powers, .. }) = GENERATED.iter().find(|model| model.name == name) {
        let (min, max) = (sizes.start(), sizes.end());
        let which = if *powers { "a power of two" } else { "a number" };
        return Some(format!("{name} has no size {size:?}; sizes: {which} from {min} to {max}"));
    }
    NAMES.contains(&name).then(|| format!("{name} has only one size; omit :{size}"))
}

/// A model that is generated in a requested size.
struct Generated {
    name: &'static str,
    usual: u32,
    sizes: RangeInclusive<u32>,
    /// True if only powers of two are supported.
    powers: bool,
    generate: fn(u32) -> Model,
}

impl Generated {
    const fn new(
        name: &'static str,
        usual: u32,
        sizes: RangeInclusive<u32>,
        generate: fn(u32) -> Model,
    ) -> Generated {
        Generated { name, usual, sizes, powers: false, generate }
    }

    fn has(&self, size: u32) -> bool {
        self.sizes.contains(&size) && (!self.powers || size.is_power_of_two())
    }
}

const GENERATED: [Generated; 6] = [
    Generated::new("sphere", 20, 1..=1 << 9, generate::sphere),
    Generated::new("torus", 48, 3..=1 << 11, generate::torus),
    Generated::new("knot", 24, 3..=1 << 9, generate::knot),
    Generated { powers: true, ..Generated::new("solid", 16, 4..=1 << 12, generate::solid) },
    Generated::new("grid", 65, 2..=1 << 11, |side| generate::grid(side, 0)),
    Generated::new("valley", 321, 3..=(1 << 10) + 1, terrain::valley),
];

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
    fn every_shipped_model_satisfies_the_invariants_and_is_closed_except_height_fields() {
        for name in NAMES {
            let model = named(name).unwrap();
            model.check().unwrap_or_else(|broken| panic!("{name}: {broken}"));
            let topology = model.topology();
            assert_eq!(
                topology.is_closed(),
                !["grid", "everest", "valley"].contains(&name),
                "{name}: {topology:?}"
            );
            assert!(model.faces.len() >= 3000 && topology.components == 1, "{name}: {topology:?}");
        }
        assert_eq!(named("bunny").unwrap().faces.len(), 3674);
        assert_eq!(named("solid").unwrap().faces.len(), 16_384);
        let everest = named("everest").unwrap();
        let summit = everest.positions.iter().max_by(|a, b| a.z.total_cmp(&b.z)).unwrap();
        assert_eq!((summit.to_array(), everest.faces.len()), ([0.0, 0.0, 8752.0], 32_768));
    }

    #[test]
    fn sizes_are_accepted_and_unsupported_ones_are_refused() {
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
        let message = |name| wrong_size(name).unwrap();
        assert_eq!(message("sphere:99999"), "sphere has no size \"99999\"; sizes: a number from 1 to 512");
        assert_eq!(message("solid:12"), "solid has no size \"12\"; sizes: a power of two from 4 to 4096");
        assert_eq!(message("bunny:3"), "bunny has only one size; omit :3");
        assert_eq!((wrong_size("none:3"), wrong_size("sphere")), (None, None));
    }
}
