//! The list of comparers, and the check that it is complete.

use std::fs;
use std::path::{Path, PathBuf};

/// A function in a file of the repository.
type Place = (&'static str, &'static str);

/// A function that tests trust to reject wrong results.
struct Comparer {
    judges: &'static str,
    function: Place,
    /// Tests in which it must reject a near miss.
    rejects: &'static [Place],
}

const EARTH: &str = "src/texture/source/earth/tests.rs";
const REFERENCE: &str = "src/paper/virtual_texture/reference/mod.rs";

const PICTURE: &str = "src/picture/error.rs";

const MESH_PICTURES: &str = "tests/progressive_mesh/pictures.rs";

const TRUTH: &str = "tests/virtual_texture/truth.rs";

const COMPARERS: &[Comparer] = &[
    Comparer {
        judges: "pictures",
        function: (PICTURE, "compare"),
        rejects: &[
            (PICTURE, "a_shift_by_one_pixel_is_rejected"),
            (PICTURE, "a_value_that_is_not_finite_is_an_infinite_error_even_against_itself"),
            (PICTURE, "pictures_of_different_shape_are_not_compared"),
        ],
    },
    Comparer {
        judges: "the covariance of a filter's kernel",
        function: ("tests/texture_mapping/kernels.rs", "worst"),
        rejects: &[(
            "tests/texture_mapping/kernels.rs",
            "from_a_minor_axis_of_12_texels_on_the_covariance_is_that_of_the_jacobian_alone",
        )],
    },
    Comparer {
        judges: "a part of a picture",
        function: (PICTURE, "compare_where"),
        rejects: &[(PICTURE, "excluded_pixels_change_nothing_and_included_ones_count")],
    },
    Comparer {
        judges: "the colours of pictures, without alpha",
        function: (PICTURE, "compare_colours"),
        rejects: &[(PICTURE, "a_comparison_of_colours_ignores_alpha")],
    },
    Comparer {
        judges: "a whole picture against a peak of 1",
        function: (PICTURE, "psnr_db"),
        rejects: &[(PICTURE, "psnr_is_of_the_mean_squared_error_against_a_peak_of_one")],
    },
    Comparer {
        judges: "a filter's picture against the f64 reference",
        function: ("src/paper/texture_mapping/agreement.rs", "compare"),
        rejects: &[("tests/texture_mapping/methods.rs", "a_changed_setting_is_not_explained_by_rounding")],
    },
    Comparer {
        judges: "a picture of object-space texturing against the f64 reference",
        function: ("src/paper/texture_mapping/agreement.rs", "compare_fragments"),
        rejects: &[(
            "tests/texture_mapping/object_space.rs",
            "another_spacing_or_a_moved_polygon_is_not_explained_by_rounding",
        )],
    },
    Comparer {
        judges: "grey values in one number",
        function: ("src/paper/texture_mapping/agreement.rs", "nmse"),
        rejects: &[(
            "src/paper/texture_mapping/agreement.rs",
            "nmse_is_relative_to_the_squares_of_the_truth",
        )],
    },
    Comparer {
        judges: "an ellipse filter's Jacobians against f64",
        function: ("tests/texture_mapping/coordinates.rs", "jacobian_errors"),
        rejects: &[(
            "tests/texture_mapping/coordinates.rs",
            "an_ellipse_filters_footprint_has_the_derivatives_of_its_coordinates",
        )],
    },
    Comparer {
        judges: "a filtered relief's pixels against f64",
        function: ("tests/texture_mapping/parallax.rs", "outliers"),
        rejects: &[(
            "tests/texture_mapping/parallax.rs",
            "every_methods_pixels_are_those_of_its_f64_form_and_not_of_another_method",
        )],
    },
    Comparer {
        judges: "a supersampled truth's two halves",
        function: ("src/reference/supersample.rs", "own_nmse_where"),
        rejects: &[(
            "src/reference/supersample.rs",
            "the_truths_own_error_counts_only_pixels_wholly_on_the_surface",
        )],
    },
    Comparer {
        judges: "a supersampled truth's two halves, on whole pixels",
        function: ("src/reference/supersample.rs", "own_nmse"),
        rejects: &[
            ("src/reference/supersample.rs", "the_truths_own_error_counts_only_pixels_wholly_on_the_surface"),
            (
                "src/reference/supersample.rs",
                "more_samples_lower_the_truths_own_error_which_matches_the_true_error",
            ),
        ],
    },
    Comparer {
        judges: "rays through a relief against their twins, where rounding does not decide",
        function: ("tests/texture_mapping/relief.rs", "differ"),
        rejects: &[(
            "tests/texture_mapping/relief.rs",
            "linear_search_and_cones_on_the_gpu_equal_their_twins_up_to_rounding_and_end_at_crossings",
        )],
    },
    Comparer {
        judges: "hits of rays against crossings of the surface",
        function: ("tests/texture_mapping/relief.rs", "beside_crossings"),
        rejects: &[(
            "tests/texture_mapping/relief.rs",
            "linear_search_and_cones_on_the_gpu_equal_their_twins_up_to_rounding_and_end_at_crossings",
        )],
    },
    Comparer {
        judges: "a relief, a ball and a tunnel of a scene against exact rays",
        function: ("tests/renderer/main.rs", "nmse"),
        rejects: &[
            ("tests/renderer/relief.rs", "a_relief_is_near_the_mean_of_exact_rays_and_a_flat_plane_is_not"),
            ("tests/renderer/sphere.rs", "the_ball_is_near_its_truth_and_a_turned_one_is_not"),
            ("tests/renderer/sphere.rs", "the_tunnel_is_near_its_truth_and_a_shifted_one_is_not"),
        ],
    },
    Comparer {
        judges: "the visible difference of two pictures",
        function: ("src/picture/flip.rs", "flip"),
        rejects: &[
            (
                "src/picture/flip.rs",
                "a_changed_pixel_is_found_at_its_place_and_a_stronger_change_counts_more",
            ),
            ("src/picture/flip.rs", "a_value_that_is_not_finite_counts_although_it_encodes_as_black"),
        ],
    },
    Comparer {
        judges: "pictures by all measures at once",
        function: ("src/picture/measures.rs", "measures"),
        rejects: &[("src/picture/measures.rs", "every_measure_is_of_the_same_two_pictures")],
    },
    Comparer {
        judges: "picture files, as `ortelius compare` does",
        function: ("src/command/compare.rs", "run"),
        rejects: &[("tests/cli/compare.rs", "every_measure_of_a_wrong_pixel_is_the_hand_computed_one")],
    },
    Comparer {
        judges: "a picture's worst pixel",
        function: (PICTURE, "worst"),
        rejects: &[(PICTURE, "one_wrong_channel_of_one_pixel_is_found_at_its_place")],
    },
    Comparer {
        judges: "the number of outlier pixels",
        function: (PICTURE, "count_above"),
        rejects: &[(PICTURE, "one_wrong_channel_of_one_pixel_is_found_at_its_place")],
    },
    Comparer {
        judges: "a whole picture in one number",
        function: (PICTURE, "nmse"),
        rejects: &[(PICTURE, "nmse_is_the_squared_error_over_the_squared_truth")],
    },
    Comparer {
        judges: "lists of visible tiles, of all variants",
        function: (REFERENCE, "visible_tiles"),
        rejects: &[("tests/harness/lists.rs", "a_list_with_an_extra_missing_or_wrong_tile_is_rejected")],
    },
    Comparer {
        judges: "lists of triples before conversion to tiles",
        function: (REFERENCE, "distinct_triples"),
        rejects: &[("tests/harness/lists.rs", "different_triples_of_the_same_tile_are_distinguished")],
    },
    Comparer {
        judges: "the level and tile of one pixel",
        function: (REFERENCE, "possible_triples"),
        rejects: &[(REFERENCE, "a_footprint_far_from_a_rounding_border_has_one_outcome_and_near_it_two")],
    },
    Comparer {
        judges: "stage 1 against f64 footprints",
        function: ("src/paper/virtual_texture/reference/stage1.rs", "compare_triples"),
        rejects: &[(TRUTH, "a_tenth_of_a_pixel_is_not_explained")],
    },
    Comparer {
        judges: "stage 1 of several surfaces against f64 footprints",
        function: ("src/paper/virtual_texture/reference/stage1.rs", "compare_surfaces"),
        rejects: &[("tests/renderer/main.rs", "a_texel_behind_another_surface_asks_for_no_tile")],
    },
    Comparer {
        judges: "settled pictures against f64 pictures",
        function: (TRUTH, "settled_beside_truth"),
        rejects: &[(TRUTH, "the_printed_interpolation_is_not_the_f64_picture")],
    },
    Comparer {
        judges: "pictures of progressive meshes against f64 pictures",
        function: (MESH_PICTURES, "beyond_f64"),
        rejects: &[
            (MESH_PICTURES, "a_hundredth_of_the_models_size_is_not_the_f64_picture"),
            (MESH_PICTURES, "a_morphing_vertex_is_drawn_at_its_f64_position"),
        ],
    },
    Comparer {
        judges: "each texel that a settled frame fetches",
        function: ("src/paper/virtual_texture/dump.rs", "ruler_verdicts"),
        rejects: &[
            ("tests/harness/ruler.rs", "a_wrong_bit_in_each_tile_is_detected"),
            ("tests/harness/ruler.rs", "a_wrong_border_is_detected"),
            (
                "tests/harness/ruler.rs",
                "a_wrong_texel_that_only_samples_along_the_footprint_read_is_detected",
            ),
            ("tests/harness/ruler.rs", "a_wrong_coarser_picture_is_detected"),
            ("tests/harness/ruler.rs", "a_tile_of_another_place_is_detected"),
        ],
    },
    Comparer {
        judges: "each texel that a tap of the stochastic filter chose",
        function: ("tests/virtual_texture/filters.rs", "wrong_taps"),
        rejects: &[("tests/virtual_texture/filters.rs", "a_tap_with_a_wrong_bit_is_found")],
    },
    Comparer {
        judges: "pictures of several samples a pixel",
        function: ("tests/virtual_texture/filters.rs", "anisotropic_beyond"),
        rejects: &[(
            "tests/virtual_texture/filters.rs",
            "the_anisotropic_picture_is_not_that_of_half_as_many_samples",
        )],
    },
    Comparer {
        judges: "pictures of the nearer of two levels",
        function: ("tests/virtual_texture/filters.rs", "nearer_level_beyond"),
        rejects: &[(
            "tests/virtual_texture/filters.rs",
            "the_bilinear_picture_is_that_of_the_nearer_level_and_not_of_the_finer_one",
        )],
    },
    Comparer {
        judges: "a simplified surface against the full one",
        function: ("src/reference/distance.rs", "compare_surfaces"),
        rejects: &[
            (
                "src/reference/distance.rs",
                "one_displaced_vertex_shows_in_the_largest_distance_and_hardly_in_the_mean",
            ),
            ("src/reference/distance.rs", "a_missing_part_is_found_from_one_side_only"),
        ],
    },
    Comparer {
        judges: "results of figures against stored ones",
        function: ("src/figure/against.rs", "between"),
        rejects: &[
            ("tests/figure/against.rs", "a_time_changed_only_if_the_spreads_are_disjoint"),
            ("tests/figure/against.rs", "exact_numbers_words_series_and_units_changed_if_unequal"),
        ],
    },
    Comparer {
        judges: "a whole .tiles file",
        function: ("src/texture/tiles/verify.rs", "verify"),
        rejects: &[("tests/tiles.rs", "a_flip_in_any_byte_is_detected_in_its_record")],
    },
    Comparer {
        judges: "tiles read from a file",
        function: ("tests/tiles.rs", "differing"),
        rejects: &[("tests/tiles.rs", "synthetic_tiles_read_back_unchanged")],
    },
    Comparer {
        judges: "levels of a baked file against the means of four",
        function: ("tests/bake/content.rs", "texels_that_are_not_means"),
        rejects: &[("tests/bake/content.rs", "every_level_is_the_mean_of_four_of_the_files_own_texels")],
    },
    Comparer {
        judges: "a baked JPEG against the source `earth`, which is made from the same JPEG",
        function: ("tests/bake/content.rs", "mean_difference"),
        rejects: &[(
            "tests/bake/content.rs",
            "a_jpeg_enlarged_and_averaged_agrees_with_the_area_averaged_earth_source",
        )],
    },
    Comparer {
        judges: "the Earth's tiles against differently cut ones",
        function: ("src/texture/source/checks.rs", "differing_texels"),
        rejects: &[(EARTH, "the_comparison_of_borders_rejects_texels_of_another_place")],
    },
    Comparer {
        judges: "the Earth's levels against the means of four",
        function: (EARTH, "worst_mean"),
        rejects: &[(
            EARTH,
            "the_mean_of_four_is_the_coarser_texel_exactly_if_real_and_within_one_code_if_synthetic",
        )],
    },
    Comparer {
        judges: "the picture of BC1 tiles against that of RGBA8 tiles",
        function: ("tests/cli/tiles.rs", "difference"),
        rejects: &[("tests/cli/tiles.rs", "bc1_tiles_give_nearly_the_same_picture_and_request_the_feature")],
    },
    Comparer {
        judges: "--dump-footprint against the formula in f64",
        function: ("tests/cli/dumps.rs", "disagreements"),
        rejects: &[
            ("tests/cli/dumps.rs", "a_wrong_level_is_found"),
            ("tests/cli/dumps.rs", "a_neighbouring_row_is_found"),
        ],
    },
    Comparer {
        judges: "every call of Vulkan",
        function: ("src/vk/mod.rs", "messages"),
        rejects: &[("tests/device.rs", "a_missing_barrier_is_reported")],
    },
    Comparer {
        judges: "a picture of tiles against paper 3's f64 filters",
        function: ("tests/virtual_texture/texel_filters.rs", "compared"),
        rejects: &[(
            "tests/virtual_texture/texel_filters.rs",
            "another_filter_of_paper_3_is_not_the_picture",
        )],
    },
    Comparer {
        judges: "one pixel against paper 3's f64 filters",
        function: ("tests/virtual_texture/texel_filters.rs", "worst_share"),
        rejects: &[(
            "tests/virtual_texture/texel_filters.rs",
            "another_filter_of_paper_3_is_not_the_picture",
        )],
    },
    Comparer {
        judges: "a picture of a plain texture against paper 3's f64 filters",
        function: ("tests/virtual_texture/texel_filters.rs", "plain_compared"),
        rejects: &[(
            "tests/virtual_texture/ellipse_settings.rs",
            "every_setting_of_the_ellipse_on_a_plain_texture_is_the_f64_filter",
        )],
    },
    Comparer {
        judges: "the pixels of a picture against paper 3's f64 filters",
        function: ("tests/virtual_texture/texel_filters.rs", "compared_with"),
        rejects: &[(
            "tests/virtual_texture/ellipse_settings.rs",
            "another_setting_of_the_ellipse_is_not_the_picture",
        )],
    },
    Comparer {
        judges: "the caches after each frame of streaming",
        function: ("tests/streaming/invariants.rs", "check"),
        rejects: &[
            ("tests/streaming/invariants.rs", "the_check_rejects_a_display_that_differs"),
            ("tests/streaming/invariants.rs", "the_check_rejects_a_tile_in_two_slots"),
        ],
    },
    Comparer {
        judges: "streaming against plain lists",
        function: ("tests/streaming/model.rs", "compare"),
        rejects: &[("tests/streaming/model.rs", "the_comparison_rejects_another_order_of_replacement")],
    },
    Comparer {
        judges: "faces at a level of a progressive mesh against a fresh build",
        function: ("tests/progressive_mesh/run.rs", "difference"),
        rejects: &[("tests/progressive_mesh/run.rs", "a_split_in_another_face_is_not_the_fresh_build")],
    },
    Comparer {
        judges: "levels of real models in every order against fresh builds",
        function: ("tests/progressive_mesh/built.rs", "visit_that_differs"),
        rejects: &[
            ("tests/progressive_mesh/built.rs", "another_permutation_of_vertices_is_another_mesh"),
            ("tests/progressive_mesh/built.rs", "one_level_that_is_wrong_is_found"),
        ],
    },
    Comparer {
        judges: "the first level of a mesh that differs from a fresh build",
        function: ("tests/progressive_mesh/built.rs", "level_that_differs"),
        rejects: &[("tests/progressive_mesh/built.rs", "another_permutation_of_vertices_is_another_mesh")],
    },
    Comparer {
        judges: "pictures of a level in one face order against those in another order",
        function: ("tests/progressive_mesh/baselines.rs", "different_pixels"),
        rejects: &[(
            "tests/progressive_mesh/baselines.rs",
            "every_order_draws_the_faces_and_the_picture_of_the_same_level",
        )],
    },
    Comparer {
        judges: "imports between modules",
        function: ("tests/floors/rules.rs", "objections"),
        rejects: &[
            ("tests/floors/cases.rs", "an_upward_import_is_found"),
            ("tests/floors/cases.rs", "modules_of_one_floor_must_not_import_each_other"),
            ("tests/floors/cases.rs", "papers_must_not_import_each_other"),
            ("tests/floors/cases.rs", "unsafe_code_and_ash_stay_in_vk"),
        ],
    },
    Comparer {
        judges: "dependencies between files",
        function: ("tests/floors/circles.rs", "circles"),
        rejects: &[("tests/floors/cases.rs", "two_files_that_depend_on_each_other_are_a_circle")],
    },
    Comparer {
        judges: "an index buffer of the device against the host's",
        function: ("src/paper/progressive_mesh/figures/change/ways.rs", "different_indices"),
        rejects: &[(
            "src/paper/progressive_mesh/figures/change/ways.rs",
            "a_changed_or_missing_index_is_counted",
        )],
    },
    Comparer {
        judges: "hashes against the recorded ones",
        function: ("tests/golden/store.rs", "differences"),
        rejects: &[("tests/golden/main.rs", "what_differs_is_missing_or_is_new_is_rejected")],
    },
    Comparer {
        judges: "a screenshot against what the window shows",
        function: ("tests/window/main.rs", "differing"),
        rejects: &[("tests/window/main.rs", "one_changed_pixel_is_counted")],
    },
];

/// Functions named like a comparer that compare nothing.
const NOT_COMPARERS: &[(Place, &str)] = &[
    (("src/figure/claim.rs", "difference"), "states a claim's test; src/figure/judge evaluates it"),
    (("src/figure/claim.rs", "difference_of"), "states a claim's test; src/figure/judge evaluates it"),
    (("src/paper/virtual_texture/compare.rs", "compare_plain"), "measures times, which no test asserts"),
    (
        ("src/paper/texture_mapping/coordinates/reference.rs", "differences"),
        "gives derivatives by (9), the difference of two coordinates",
    ),
    (("tests/harness/ruler.rs", "verdicts"), "calls ruler_verdicts"),
];

/// Parts of names that indicate a comparison. A function whose name contains one of them must be in one of the two
/// lists. This applies to public functions in src/, and to all functions in tests/ except the tests themselves.
const TELLING: [&str; 10] = [
    "compare",
    "count_above",
    "differ",
    "mismatch",
    "nmse",
    "outlier",
    "verdict",
    "verify",
    "violation",
    "worst",
];

fn text(file: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{file}: {error}"))
}

/// Functions that a file defines: (name, is public, is a test that runs).
fn functions(text: &str) -> Vec<(String, bool, bool)> {
    let mut found = Vec::new();
    let (mut test, mut ignored) = (false, false);
    for line in text.lines().map(str::trim_start) {
        let words: Vec<&str> = line.split(|c: char| !(c.is_alphanumeric() || c == '_')).collect();
        let defines = words.iter().position(|&word| word == "fn");
        if line.starts_with("#[") {
            test |= line.starts_with("#[test]");
            ignored |= line.starts_with("#[ignore");
        } else if let Some(at) = defines
            && !line.starts_with("//")
            && let Some(name) = words.get(at + 1).filter(|name| !name.is_empty())
        {
            found.push(((*name).to_owned(), line.starts_with("pub"), test && !ignored));
            (test, ignored) = (false, false);
        } else if !line.starts_with("//") && !line.is_empty() {
            (test, ignored) = (false, false);
        }
    }
    found
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let paths = entries.map(|entry| entry.unwrap().path());
    paths
        .flat_map(|path| if path.is_dir() { sources(&path) } else { vec![path] })
        .filter(|path| path.extension().is_some_and(|extension| extension == "rs"))
        .collect()
}

#[test]
fn every_comparer_has_a_test_in_which_it_must_reject() {
    for Comparer { judges, function: (file, name), rejects } in COMPARERS {
        let defined = functions(&text(file)).iter().any(|(function, ..)| function == name);
        assert!(defined, "{file} has no {name}, which judges {judges}");
        assert!(!rejects.is_empty(), "{name} judges {judges}, and no test shows that it rejects");
        for (file, test) in *rejects {
            let runs = functions(&text(file)).iter().any(|(function, _, runs)| function == test && *runs);
            assert!(runs, "{file} has no test {test} that runs: nothing shows that {name} rejects");
        }
    }
}

#[test]
fn every_function_that_is_named_like_a_comparer_is_listed() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let listed: Vec<Place> =
        COMPARERS.iter().map(|c| c.function).chain(NOT_COMPARERS.iter().map(|&(place, _)| place)).collect();
    let mut missing = Vec::new();
    for path in sources(&root.join("src")).into_iter().chain(sources(&root.join("tests"))) {
        let file = path.strip_prefix(root).unwrap().to_string_lossy().replace('\\', "/");
        for (name, public, is_test) in functions(&text(&file)) {
            let judges = TELLING.iter().any(|part| name.contains(part)) && !is_test;
            let reachable = public || file.starts_with("tests/");
            if judges && reachable && !listed.contains(&(&*file, &*name)) {
                missing.push(format!("{file}: {name}"));
            }
        }
    }
    assert!(
        missing.is_empty(),
        "list these in tests/harness/registry.rs, with a test that rejects: {missing:#?}"
    );
}

#[test]
fn every_entry_names_an_existing_function() {
    for ((file, name), _) in NOT_COMPARERS {
        assert!(functions(&text(file)).iter().any(|(function, ..)| function == name), "{file} has no {name}");
    }
}

#[test]
fn tests_functions_and_ignored_tests_are_distinguished() {
    let text = "
        pub fn outer() {}
        #[test]
        #[should_panic]
        fn runs() { let f = 1; }
        #[test]
        #[ignore]
        fn sleeps() {}
        // fn commented() {}
        let x = 1; fn inner<T>() {}
    ";
    let expected =
        [("outer", true, false), ("runs", false, true), ("sleeps", false, false), ("inner", false, false)];
    assert_eq!(functions(text), expected.map(|(name, public, runs)| (name.to_owned(), public, runs)));
}
