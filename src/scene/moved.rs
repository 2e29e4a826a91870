//! Keys of scene files before `[surface.NAME]`, and where each is now: an old file or `-D` is refused with the new key.

use toml::{Table, Value};

/// Old key and new one. `N` is a name that both have, `NAME` the name of a surface; `*` is any key.
const MOVED: [(&str, &str); 7] = [
    ("texture.*", "surface.NAME.texture.*"),
    ("mesh.*", "surface.NAME.geometry.*"),
    ("progressive_mesh.N.*", "surface.N.geometry.*"),
    ("variant.filter", "surface.NAME.filter.kind"),
    ("variant.max_anisotropy", "surface.NAME.filter.max_anisotropy"),
    ("variant.samples", "surface.NAME.filter.samples"),
    ("variant.interpolation", "surface.NAME.filter.interpolation"),
];

/// The new key of an old one, or of an old section.
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
        // [variant] itself is not moved.
        if key.len() < old.len() && old[0] == "variant" {
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

/// The message: with the surface's name where the scene has only one.
pub(super) fn told(key: &[&str], now: &str, scene: &Table) -> String {
    let surfaces = scene.get("surface").and_then(Value::as_table);
    let mut names = surfaces.into_iter().flat_map(Table::keys);
    let now = match (names.next(), names.next()) {
        (Some(only), None) => now.replace("NAME", only),
        _ => now.to_owned(),
    };
    let kind = match key[0] {
        "texture" => "; its kind is \"virtual\"",
        "mesh" => "; the kind \"earth\" is now \"ellipsoid\"",
        "progressive_mesh" => "; its kind is \"progressive-mesh\"",
        _ => "",
    };
    format!("{} is now {now}{kind}", key.join("."))
}

/// The first old key of a scene, as `(key, new key)`.
pub(super) fn first_in(scene: &Table) -> Option<(Vec<&str>, String)> {
    let inner = |section| {
        let table = scene.get(section).and_then(Value::as_table);
        table.into_iter().flat_map(Table::keys).map(move |key| vec![section, key.as_str()])
    };
    let sections = scene.keys().map(|section| vec![section.as_str()]);
    let mut all = inner("progressive_mesh").chain(sections).chain(inner("variant"));
    all.find_map(|key| now(&key).map(|now| (key, now)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_old_key_has_one_new_key_and_a_new_one_none() {
        let now = |key: &str| now(&key.split('.').collect::<Vec<_>>());
        for (old, new) in [
            ("texture", "surface.NAME.texture"),
            ("texture.border", "surface.NAME.texture.border"),
            ("mesh.kind", "surface.NAME.geometry.kind"),
            ("progressive_mesh", "surface.NAME.geometry"),
            ("progressive_mesh.herd.order", "surface.herd.geometry.order"),
            ("variant.filter", "surface.NAME.filter.kind"),
        ] {
            assert_eq!(now(old).as_deref(), Some(new));
        }
        for key in ["variant", "variant.dedup", "view.width", "surface.land.texture", "mash"] {
            assert_eq!(now(key), None, "{key}");
        }
    }
}
