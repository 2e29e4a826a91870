//! Scenes of progressive meshes.

use crate::{SMALL, load, message};
use ortelius::scene::ModelSource;

/// SMALL with a herd instead of its landscape.
fn herd(line: &str) -> String {
    let start = SMALL.find("[view]").unwrap();
    let text =
        SMALL[start..].replace("latitude_deg = 46.0\nlongitude_deg = 8.0", "east_m = 1.0\nnorth_m = 2.0");
    format!("[progressive_mesh.herd]\nsource = \"bunny\"\nsize_m = 2.0\n{line}\n\n{text}")
}

#[test]
fn a_herd_needs_no_texture_and_has_its_documented_values() {
    let scene = load(herd("")).unwrap();
    assert!(scene.texture.is_none() && scene.mesh.is_none() && scene.governor.is_none());
    let herd = &scene.progressive_meshes["herd"];
    assert_eq!(herd.source, ModelSource::Named("bunny".into()));
    assert_eq!((herd.instances, herd.error_pixels, herd.geomorph), (1, 1.0, false));
    assert_eq!(herd.stands(&scene.paths).len(), 1);
    assert_eq!(scene.pose(0).unwrap().eye, glam::DVec3::new(1.0, 2.0, 300e3));
}

#[test]
fn what_a_herd_cannot_be_is_refused_at_its_key() {
    for (line, expected) in [
        ("instances = 0", "0 is outside 1 ..= 100000"),
        ("instances = 3", "a grid needs area_m"),
        ("error_pixels = -1.0", "-1 is outside 0 ..="),
        ("error_pixels = nan", "NaN is outside"),
        ("order = \"best\"", "unknown variant `best`, expected one of `classical`, `paper`, `ours`"),
        ("order = \"skip-lists\"\napply = \"gpu\"", "executes no splits that a device could apply"),
        ("order = \"discrete\"\ngeomorph = true", "none moves; leave geomorph out"),
        ("layout = \"along\"", "a layout along a path needs path"),
        ("layout = \"along\"\npath = \"up\"", "no path \"up\"; there are down"),
        ("layout = \"scatter\"\nseed = 3\naside_m = 2.0", "a scatter has no aside_m"),
        ("seed = 3", "a grid has no seed"),
        ("east_m = 1e10", "10000000000 is outside"),
        ("\n[governor]\nframe_ms = 0.0", "0 is outside 0.001 ..="),
        ("\n[governor]\nframe_faces = 0", "0 is outside 1 ..="),
        ("\n[governor]\n", "a governor needs a budget"),
        ("\n[cache]\ngpu_tiles = 9", "a scene without a texture has no cache"),
        (
            "\n[mesh]\nkind = \"plane\"\ncolumns = 2\nrows = 2",
            "not both, and this one has [progressive_mesh]",
        ),
        ("\n[texture]\nsource = \"earth\"", "not both, and this one has [progressive_mesh]"),
    ] {
        let error = load(herd(line)).expect_err(line).to_string();
        assert!(error.contains("small.toml:") && error.contains(expected), "{line}: {error}");
    }
    let both = message("[view]", "[progressive_mesh.herd]\nsource = \"bunny\"\nsize_m = 2.0\n\n[view]");
    assert!(both.contains("not both"), "{both}");
    let nothing = load(
        "[view]\nwidth = 9\nheight = 9\ncamera = \"a\"\n[cameras.a]\naltitude_m = 1.0\n\
                        east_m = 0.0\nnorth_m = 0.0\n",
    );
    assert!(nothing.unwrap_err().to_string().contains("nothing to see"));
}
