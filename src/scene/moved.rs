//! Keys and values of older versions, with their replacements. An old file or `-D` is rejected with the new
//! key.

use toml::{Table, Value};

/// Old key and new key. `N` is the same name in both, `NAME` the name of a surface; `*` matches any key.
const MOVED: [(&str, &str); 11] = [
    ("texture.*", "surface.NAME.texture.*"),
    ("mesh.*", "surface.NAME.geometry.*"),
    ("progressive_mesh.N.*", "surface.N.geometry.*"),
    ("variant.filter", "surface.NAME.filter.kind"),
    ("variant.max_anisotropy", "surface.NAME.filter.max_anisotropy"),
    ("variant.samples", "surface.NAME.filter.samples"),
    ("variant.interpolation", "surface.NAME.filter.interpolation"),
    ("variant.keying", "variant.address"),
    ("variant.u1", "variant.request_format"),
    ("surface.N.geometry.octaves_per_frame", "surface.N.geometry.pixels_per_second"),
    ("surface.N.geometry.pixels_per_frame", "surface.N.geometry.pixels_per_second"),
];

/// Old value of a setting, the new value, and the words between them in the message.
const RENAMED: [(&str, &str, &str); 4] = [
    ("ours", "tail-23", "is now"),
    ("ours-few-moves", "tail-10", "is now"),
    ("coherent", "in-place-23", "was removed; this order moves as many faces and transforms fewer vertices:"),
    (
        "coherent-few-moves",
        "in-place-10",
        "was removed; this order moves as many faces and transforms fewer vertices:",
    ),
];

/// The message for an old value, if its replacement is among `names`.
pub(super) fn value(old: &str, names: impl IntoIterator<Item = &'static str>) -> Option<String> {
    let (_, new, what) = RENAMED.iter().find(|(known, ..)| *known == old)?;
    names.into_iter().any(|name| name == *new).then(|| format!("{old:?} {what} {new:?}"))
}

/// The new key of an old key or section.
pub(super) fn now(key: &[&str]) -> Option<String> {
    MOVED.iter().find_map(|(old, new)| {
        let (mut named, mut rest) = (None, None);
        let old: Vec<&str> = old.split('.').collect();
        for (part, old) in key.iter().zip(&old) {
            match *old {
                "N" => named = Some(*part),
                "*" => rest = Some(*part),
                _ if old == part => {}
                _ => return None,
            }
        }
        // If only some keys of a section have moved, the section itself has not moved.
        if key.len() < old.len() && old.last() != Some(&"*") {
            return None;
        }
        let part = |part: &str| match part {
            "N" => named.unwrap_or("NAME").to_owned(),
            "*" => rest.unwrap_or("*").to_owned(),
            part => part.to_owned(),
        };
        let new = new.split('.').map(part).collect::<Vec<_>>().join(".");
        Some(new.trim_end_matches(".*").to_owned())
    })
}

/// The message; names the surface if the scene has only one.
pub(super) fn message(key: &[&str], now: &str, scene: &Table) -> String {
    let surfaces = scene.get("surface").and_then(Value::as_table);
    let mut names = surfaces.into_iter().flat_map(Table::keys);
    let now = match (names.next(), names.next()) {
        (Some(only), None) => now.replace("NAME", only),
        _ => now.to_owned(),
    };
    let kind = match key[0] {
        "variant" if key.get(1) == Some(&"keying") => {
            "; \"paper\" is \"level-0\", \"native\" is \"own-level\""
        }
        "texture" => "; its kind is \"virtual\"",
        "mesh" => "; the kind \"earth\" is now \"ellipsoid\"",
        "progressive_mesh" => "; its kind is \"progressive-mesh\"",
        "surface" => {
            "; for example, 2.58 pixels per second is 0.043 pixels per frame at 60 frames per second, or 1/16 octave \
             per frame at an error of one pixel"
        }
        _ => "",
    };
    format!("{} is now {now}{kind}", key.join("."))
}

/// The first old key of a scene: `(key, new key)`.
pub(super) fn first_in<'a>(scene: &'a Table) -> Option<(Vec<&'a str>, String)> {
    let inner = |section| {
        let table = scene.get(section).and_then(Value::as_table);
        table.into_iter().flat_map(Table::keys).map(move |key| vec![section, key.as_str()])
    };
    let sections = scene.keys().map(|section| vec![section.as_str()]);
    let geometry = |(name, surface): (&'a String, &'a Value)| {
        let table = surface.get("geometry").and_then(Value::as_table);
        table
            .into_iter()
            .flat_map(Table::keys)
            .map(move |key| vec!["surface", name.as_str(), "geometry", key.as_str()])
    };
    let surfaces = scene.get("surface").and_then(Value::as_table);
    let geometries = surfaces.into_iter().flatten().flat_map(geometry);
    let mut all = inner("progressive_mesh").chain(sections).chain(inner("variant")).chain(geometries);
    all.find_map(|key| now(&key).map(|now| (key, now)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_old_value_is_reported_only_for_settings_that_have_the_new_value() {
        assert_eq!(value("ours", ["tail-23"]).as_deref(), Some("\"ours\" is now \"tail-23\""));
        assert_eq!([value("ours", ["cpu"]), value("best", ["tail-23"])], [None, None]);
    }

    #[test]
    fn an_old_key_has_one_new_key_and_a_new_key_has_no_newer_one() {
        let now = |key: &str| now(&key.split('.').collect::<Vec<_>>());
        for (old, new) in [
            ("texture", "surface.NAME.texture"),
            ("texture.border", "surface.NAME.texture.border"),
            ("mesh.kind", "surface.NAME.geometry.kind"),
            ("progressive_mesh", "surface.NAME.geometry"),
            ("progressive_mesh.herd.order", "surface.herd.geometry.order"),
            ("variant.filter", "surface.NAME.filter.kind"),
            ("variant.keying", "variant.address"),
            ("surface.herd.geometry.octaves_per_frame", "surface.herd.geometry.pixels_per_second"),
            ("surface.herd.geometry.pixels_per_frame", "surface.herd.geometry.pixels_per_second"),
        ] {
            assert_eq!(now(old).as_deref(), Some(new));
        }
        for key in [
            "variant",
            "variant.dedup",
            "view.width",
            "surface.land.texture",
            "surface.land.geometry",
            "mash",
        ] {
            assert_eq!(now(key), None, "{key}");
        }
    }

    #[test]
    fn an_old_key_of_a_surface_is_found_in_a_scene() {
        let scene: Table = "[surface.herd.geometry]\ngeomorph = true\noctaves_per_frame = 1".parse().unwrap();
        let (key, now) = first_in(&scene).unwrap();
        assert_eq!(key.join("."), "surface.herd.geometry.octaves_per_frame");
        assert!(
            message(&key, &now, &scene)
                .contains("is now surface.herd.geometry.pixels_per_second; for example")
        );
        let today: Table = "[surface.herd.geometry]\npixels_per_second = 1".parse().unwrap();
        assert!(first_in(&today).is_none());
    }
}
