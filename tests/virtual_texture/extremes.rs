//! Every extreme of vt.extremes: the lists are exact, differences in stage 1 are explained, and the settled picture is
//! right.

use crate::device;
use ortelius::paper::virtual_texture::extremes::{EXTREMES, Examiner, Extreme, ListOutcome};
use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;
use std::time::Instant;

/// The figure's sizes, halved to save time. Sizes that are themselves extreme are not halved.
fn size(extreme: &Extreme) -> [u32; 2] {
    match extreme.size {
        [width, height] if width.min(height) > 64 => [width / 2, height / 2],
        size => size,
    }
}

#[test]
fn nothing_is_lost_invented_or_unexplained_at_any_extreme() {
    let gpu = device();
    let mut examiner = Examiner::new(gpu.clone());
    // By NA.
    let (mut faults, mut never_ran) = (Vec::new(), BTreeMap::<u32, BTreeSet<String>>::new());
    let all = EXTREMES.iter().flat_map(|extreme| [(extreme, 1), (extreme, 16)]);
    for (extreme, na) in all.filter(|(extreme, na)| *na == 1 || extreme.elongates()) {
        let begun = Instant::now();
        let examined = examiner.examine(extreme, size(extreme), na).unwrap();
        println!(
            "{}, NA {na}: {:.1} s, {} tiles, {} of samples, {} pixels differ, {:?}",
            extreme.name,
            begun.elapsed().as_secs_f64(),
            examined.tiles,
            examined.of_samples,
            examined.stage1.differing,
            examined.settled,
        );
        faults.extend(examined.fault(extreme).map(|fault| format!("{}, NA {na}: {fault}", extreme.name)));
        let refused = |(name, outcome): &(String, ListOutcome)| match outcome {
            ListOutcome::Refused(line) => {
                println!("  {name}: {line}");
                Some(name.clone())
            }
            ListOutcome::Listed { .. } | ListOutcome::Superset { .. } => None,
        };
        let refused: BTreeSet<String> = examined.variants.iter().filter_map(refused).collect();
        let never = never_ran.entry(na).or_insert_with(|| refused.clone());
        *never = &*never & &refused;
    }
    assert!(faults.is_empty(), "{faults:#?}");
    // Each variant must run at some extreme. A variant that rejects every extreme would count as exact everywhere.
    assert_eq!(never_ran, [1, 16].map(|na| (na, BTreeSet::new())).into());
}

/// Pictures with partial workgroups at their edges, small enough to run in three tests.
#[test]
fn the_edges_of_groups_are_exact() {
    let gpu = device();
    if let Ok(lanes) = std::env::var(LANES) {
        assert_eq!(
            gpu.physical().subgroup_size.to_string(),
            lanes,
            "the driver uses the requested vector width"
        );
    }
    let mut examiner = Examiner::of_lists(gpu.clone());
    for (name, size) in [
        ("noise", [67, 41]),
        ("noise", [64, 64]),
        ("one-pixel", [1, 1]),
        ("corners", [97, 61]),
        ("not-finite", [65, 33]),
        ("pole", [130, 70]),
    ] {
        let extreme = Extreme::find(name).unwrap();
        let fault = examiner.examine(extreme, size, 1).unwrap().fault(extreme);
        assert_eq!(fault, None, "{name} at {size:?}");
    }
}

/// Set in a child process: the expected number of invocations of a subgroup.
const LANES: &str = "ORTELIUS_TEST_LANES";

/// A process has one vector width, so 4 lanes run in a child of this binary. 16 lanes are not possible here: Mesa 22.3
/// crashes when it compiles stage 1's fragment shader for them.
#[test]
fn the_edges_of_groups_are_exact_with_subgroups_of_4() {
    let gpu = device();
    if gpu.physical().kind != "cpu" {
        // A GPU's subgroup size is fixed.
        return;
    }
    let ran = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "extremes::the_edges_of_groups_are_exact"])
        .env("LP_NATIVE_VECTOR_WIDTH", "128")
        .env(LANES, "4")
        .output()
        .unwrap();
    let words = String::from_utf8_lossy(&ran.stdout);
    assert!(ran.status.success() && words.contains("1 passed"), "{words}");
}
