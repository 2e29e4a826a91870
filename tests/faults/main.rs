//! Each Vulkan call of some small runs fails in turn, with out of memory or device lost. The layer in `layer.rs`
//! injects the fault. If the run needs the call, it must print one line, end with the exit code of the fault and leave
//! no file. Otherwise it must succeed and write the same files.
//!
//! `./x test` lets every call of the small runs fail. With ORTELIUS_FAULTS=all, every call of every shipped scene fails
//! too, which takes some hours; with ORTELIUS_FAULTS=N, N calls of each scene, evenly spaced.

mod resize;
#[cfg(all(target_os = "linux", feature = "window"))]
mod window;

use ortelius::scene::SHIPPED;
use rayon::prelude::*;
use std::ffi::{OsStr, OsString};
use std::fmt::Display;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::LazyLock;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Timeout of a run. A run takes half a second; on a machine that was compiling, it took 10 s.
const PATIENCE: Duration = Duration::from_secs(120);

/// The layer and its manifest.
static LAYER: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let library = folder.path().join("libfault.so");
    let cargo = PathBuf::from(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/faults/layer.rs");
    let mut rustc = Command::new(cargo.with_file_name("rustc"));
    rustc.args(["--edition", "2024", "-O", "--crate-type", "cdylib", "-o"]).arg(&library).arg(source);
    let made = rustc.output().unwrap_or_else(|error| panic!("{rustc:?}: {error}"));
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let manifest = serde_json::json!({"file_format_version": "1.1.2", "layer": {
        "name": "VK_LAYER_ORTELIUS_fault", "type": "GLOBAL", "library_path": library, "api_version": "1.3.0",
        "implementation_version": "1", "description": "lets one call fail"
    }});
    std::fs::write(folder.path().join("VkLayer_fault.json"), manifest.to_string()).unwrap();
    folder
});

/// The result of a run.
#[derive(Clone, Debug, Default)]
struct Ended {
    /// `None` after a signal or a timeout.
    code: Option<i32>,
    stderr: String,
    /// The remaining files with their bytes. Reports and films contain times, so only their names count.
    files: Vec<(String, Vec<u8>)>,
    /// The calls that failed. For an undisturbed run: all calls that may fail.
    calls: Vec<String>,
}

/// Loads the fault layer into a program, in addition to the layers that the program finds anyway.
fn load_layer(command: &mut Command) {
    let mut paths = OsString::from(LAYER.path());
    let replaces = std::env::var_os("VK_LAYER_PATH").is_some();
    let name = if replaces { "VK_LAYER_PATH" } else { "VK_ADD_LAYER_PATH" };
    let others = std::env::var_os(name);
    paths.extend(others.iter().flat_map(|others| [OsStr::new(":"), others.as_os_str()]));
    command.env(name, paths).env("VK_INSTANCE_LAYERS", "VK_LAYER_ORTELIUS_fault");
    // Mesa's layer that orders the devices crashes if a call of its own fails.
    command.env("NODEVICE_SELECT", "1");
}

/// Runs the program with one failing call. `call` is the call's number, or a name for the first call of that name, or 0
/// for none.
fn run(arguments: &[&str], kind: &str, call: impl Display) -> Ended {
    run_with(&[], arguments, kind, call)
}

/// As [`run`], on a device without the features of the list `masked`.
fn run_without(masked: &str, arguments: &[&str], kind: &str, call: impl Display) -> Ended {
    run_with(&[("ORTELIUS_MASK", masked)], arguments, kind, call)
}

/// As [`run`], with more environment variables.
fn run_with(environment: &[(&str, &str)], arguments: &[&str], kind: &str, call: impl Display) -> Ended {
    let (folder, log) = (tempfile::tempdir().unwrap(), tempfile::NamedTempFile::new().unwrap());
    let mut command = Command::new(env!("CARGO_BIN_EXE_ortelius"));
    command.current_dir(&folder).args(arguments).env_remove("ORTELIUS_VALIDATE").env("ORTELIUS_CACHE", "");
    load_layer(&mut command);
    command.env("ORTELIUS_FAULT", format!("{kind}:{call}")).env("ORTELIUS_FAULT_LOG", log.path());
    command.envs(environment.iter().copied());
    let mut stderr = tempfile::tempfile().unwrap();
    let mut child = command.stdout(Stdio::null()).stderr(File::try_clone(&stderr).unwrap()).spawn().unwrap();
    let started = Instant::now();
    while child.try_wait().unwrap().is_none() && started.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(5));
    }
    // The run has ended, or hangs and is killed: its status is then a signal.
    child.kill().unwrap();
    let status = child.wait().unwrap();
    let mut ended = Ended { code: status.code(), files: files(folder.path()), ..Ended::default() };
    std::io::Seek::rewind(&mut stderr).unwrap();
    stderr.read_to_string(&mut ended.stderr).unwrap();
    ended.calls = std::fs::read_to_string(log.path()).unwrap().lines().map(String::from).collect();
    ended
}

/// The files of a folder and of the folders in it, without the bytes of reports and films.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let of = |path: PathBuf| {
        if path.is_dir() {
            return files(&path);
        }
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let is_read = !name.ends_with(".json") && !name.ends_with(".mp4");
        vec![(name, if is_read { std::fs::read(&path).unwrap() } else { Vec::new() })]
    };
    let entries = std::fs::read_dir(folder).unwrap();
    let mut found: Vec<_> = entries.flat_map(|entry| of(entry.unwrap().path())).collect();
    found.sort();
    found
}

/// What is wrong with the result of a run in which a call failed; `None` if it is as required.
fn complaint(ended: &Ended, undisturbed: &Ended, kind: &str) -> Option<String> {
    let expected = if kind == "lost" { 4 } else { 1 };
    // The device is closed after the files are written.
    let is_at_the_end = ended.calls.first().is_some_and(|call| call == "vkDeviceWaitIdle");
    let is_complete = is_at_the_end && ended.files == undisturbed.files;
    let lines: Vec<&str> = ended.stderr.lines().filter(|line| !line.starts_with(" INFO ")).collect();
    match ended.code {
        None => Some("a crash, or a hang".into()),
        Some(0) if ended.files == undisturbed.files => None,
        Some(0) => Some("exit code 0, and other files".into()),
        Some(code) if code != expected => Some(format!("exit code {code} instead of {expected}")),
        Some(_) if !(ended.files.is_empty() || is_complete) => Some("output files are left".into()),
        Some(_) if lines.len() != 1 || !lines[0].starts_with("ortelius: ") => Some("not one line".into()),
        Some(_) => None,
    }
}

/// The first renders a virtual texture; the second has progressive meshes in all ways that call Vulkan differently; the
/// third is the self-test.
const SMALL_RUNS: [&str; 3] = [
    "render ruler --size 16x9 --deterministic -o a.png --report a.json -D surface.land.geometry.columns=32 \
     -D surface.land.geometry.rows=16 -D surface.land.texture.width_log2=14 -D surface.land.texture.height_log2=13 \
     -D surface.land.texture.tile_size=64 -D cache.gpu_tiles=24 -D cache.host_tiles=24",
    "render bunny --size 16x9 -o a.png -D surface.bunny.geometry.source=sphere:3 -D surface.bunny.geometry.apply=gpu \
     -D surface.b={geometry={kind='progressive-mesh',source='sphere:3',size_m=1.0,apply='mapped'}} \
     -D surface.c={geometry={kind='progressive-mesh',source='sphere:3',size_m=1.0,order='compacted'}} \
     -D surface.d={geometry={kind='progressive-mesh',source='sphere:3',size_m=1.0,order='skip-lists'}} \
     -D surface.e={geometry={kind='progressive-mesh',source='sphere:3',size_m=1.0,order='discrete'}} \
     -D surface.f={geometry={kind='progressive-mesh',source='sphere:3',size_m=1.0,order='re-optimised'}}",
    "doctor",
];

/// Each run, with the largest number of its calls that are made to fail.
fn runs() -> Vec<(String, usize)> {
    let mut runs: Vec<(String, usize)> = SMALL_RUNS.map(|run| (run.to_owned(), usize::MAX)).into();
    let max = match std::env::var("ORTELIUS_FAULTS").as_deref() {
        Err(_) => return runs,
        Ok("all") => usize::MAX,
        Ok(number) => number.parse().expect("ORTELIUS_FAULTS=N or ORTELIUS_FAULTS=all"),
    };
    let of_scene = |name: &str| format!("render {name} --size 64x36 --deterministic -o a.png");
    runs.extend(SHIPPED.iter().map(|(name, _)| (of_scene(name), max)));
    runs
}

fn sweep(kind: &str) {
    for (shown, max) in runs() {
        let arguments: Vec<&str> = shown.split_ascii_whitespace().collect();
        let undisturbed = run(&arguments, kind, 0);
        assert_eq!(undisturbed.code, Some(0), "{shown}: {}", undisturbed.stderr);
        let count = undisturbed.calls.len();
        let taken = count.min(max);
        // A run uses one processor for most of its time.
        let numbers = (0..taken).into_par_iter().map(|n| 1 + n * count / taken);
        let has_failed = |number: &usize| {
            let ended = run(&arguments, kind, number);
            // A run with fewer frames than the undisturbed one does not reach the last calls.
            let Some(call) = ended.calls.first() else { return false };
            if let Some(complaint) = complaint(&ended, &undisturbed, kind) {
                panic!("{shown}: {kind} at {call}, call {number}: {complaint}: {}", ended.stderr);
            }
            true
        };
        let failed = numbers.filter(has_failed).count();
        println!("{shown}: {kind}: {failed} of {count} calls failed");
        assert!(
            failed > 0 && 4 * failed >= 3 * taken,
            "{shown}: only {failed} of {taken} calls were reached"
        );
    }
}

#[test]
fn host_out_of_memory_is_reported_in_one_line_at_every_call() {
    sweep("host");
}

#[test]
fn device_out_of_memory_is_reported_in_one_line_at_every_call() {
    sweep("device");
}

#[test]
fn a_lost_device_is_one_line_and_exit_code_4_at_every_call() {
    sweep("lost");
}

/// The files are complete before the device is closed, and they remain.
#[test]
fn a_device_lost_while_it_is_closed_is_one_line_and_exit_code_4() {
    let render = ["render", "ruler", "--size", "64x36", "-o", "a.png"];
    let undisturbed = run(&render, "lost", 0);
    let ended = run(&render, "lost", "vkDeviceWaitIdle");
    assert_eq!(
        (ended.code, &*ended.calls),
        (Some(4), &["vkDeviceWaitIdle".to_string()][..]),
        "{}",
        ended.stderr
    );
    assert_eq!(complaint(&ended, &undisturbed, "lost"), None, "{}", ended.stderr);
    assert_eq!(ended.files, undisturbed.files);
    assert_eq!(run(&render, "host", "vkDeviceWaitIdle").code, Some(1));
}

/// All exact variants render the same picture.
#[test]
fn if_the_device_lacks_a_feature_an_unnamed_variant_is_replaced_and_a_named_one_is_refused() {
    let render = |masked: &str, more: &[&str]| {
        let own = ["render", "earth", "--size", "64x36", "--deterministic", "-o", "a.png"];
        run_without(masked, &[&own, more].concat(), "host", 0)
    };
    let whole = render("", &[]);
    assert_eq!((whole.code, whole.stderr.contains("WARN")), (Some(0), false), "{}", whole.stderr);
    let all = "geometryShader,logicOp,transformFeedback";
    for (masked, variants) in [
        ("geometryShader", &["dedup", "compact"][..]),
        ("logicOp", &["dedup"]),
        ("transformFeedback", &["compact"]),
        (all, &["dedup", "compact"]),
    ] {
        let ended = render(masked, &[]);
        assert_eq!((ended.code, &ended.files), (Some(0), &whole.files), "{masked}: {}", ended.stderr);
        let warnings: Vec<&str> = ended.stderr.lines().filter(|line| line.contains("WARN")).collect();
        let [line] = warnings[..] else { panic!("{masked}: {warnings:?}") };
        assert!(line.contains(masked.split(',').next().unwrap()), "{line}");
        for (key, value) in [("dedup", "runs"), ("compact", "append")] {
            let is_named = line.contains(&format!("variant.{key} defaults to {value:?}"));
            assert_eq!(is_named, variants.contains(&key), "{masked}: {line}");
        }
        // A variant that the scene names, even the default, is refused.
        let named = [["-D", "variant.dedup=geometry"], ["-D", "variant.compact=transform-feedback"]].concat();
        let refused = render(masked, &named);
        let line = refused.stderr.lines().find(|line| line.starts_with("ortelius: ")).unwrap_or("");
        assert_eq!((refused.code, refused.files.len()), (Some(1), 0), "{masked}: {}", refused.stderr);
        assert!(line.contains("this device lacks") && line.contains("does not need it"), "{line}");
        // A named variant that does not need the missing features is not replaced.
        let other = render(masked, &["-D", "variant.dedup=tile-memo", "-D", "variant.compact=ordered"]);
        assert_eq!((other.code, other.files), (Some(0), whole.files.clone()), "{masked}: {}", other.stderr);
        assert!(!other.stderr.contains("WARN"), "{masked}: {}", other.stderr);
    }
}

/// Scenes have variants for a device that lacks these features.
#[test]
fn a_device_without_geometry_shaders_or_transform_feedback_is_healthy_for_the_doctor() {
    let doctor = |masked: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_ortelius"));
        load_layer(command.args(["doctor", "--json"]).env("ORTELIUS_CACHE", ""));
        let ran = command.env("ORTELIUS_FAULT", "host:0").env("ORTELIUS_MASK", masked).output().unwrap();
        let found: serde_json::Value = serde_json::from_slice(&ran.stdout).unwrap();
        let words = found["self_test"].as_str().unwrap().to_owned();
        (ran.status.code(), found["healthy"] == true, words)
    };
    assert_eq!(doctor("logicOp"), (Some(0), true, "passed".into()));
    for masked in ["geometryShader", "transformFeedback"] {
        let (code, healthy, words) = doctor(masked);
        assert_eq!((code, healthy), (Some(0), true), "{masked}: {words}");
        let untested = format!("passed; transform feedback not tested: the device lacks {masked}");
        assert!(words.starts_with(&untested), "{words}");
    }
}

#[test]
fn a_figure_whose_device_is_lost_ends_with_exit_code_4() {
    let reproduce = ["reproduce", "vt.address", "--partition", "1/3", "-o", "out"];
    let ended = run(&reproduce, "lost", "vkQueueSubmit2:3");
    let last = ended.stderr.lines().last().unwrap_or("");
    assert_eq!(ended.code, Some(4), "{}", ended.stderr);
    assert!(last.contains("2 of 2 cells failed, the device was lost in vt.address"), "{last}");
}

/// Memory that was allocated but not bound is freed: the allocator reports no leak.
#[test]
fn memory_that_cannot_be_bound_is_one_line_and_no_leak() {
    let render = ["render", "ruler", "--size", "64x36", "-o", "a.png"];
    let undisturbed = run(&render, "device", 0);
    for call in ["vkBindBufferMemory", "vkBindImageMemory"] {
        let ended = run(&render, "device", call);
        assert_eq!((ended.code, &*ended.calls), (Some(1), &[call.to_string()][..]), "{}", ended.stderr);
        assert_eq!(complaint(&ended, &undisturbed, "device"), None, "{}", ended.stderr);
    }
}

/// A bake runs on the host alone: no call can fail.
#[test]
fn a_bake_calls_no_vulkan() {
    let ended = run(&["bake", "earth:6", "-o", "a.tiles", "--tile", "16"], "host", 0);
    assert_eq!((ended.code, ended.calls.len(), ended.files.len()), (Some(0), 0, 1), "{}", ended.stderr);
}

/// Runs the program with a vector width in bits; without one, Mesa's own (128 on ARM and without AVX). Later runs find
/// the shaders of earlier ones in `cache`.
fn with_vectors(cache: &TempDir, width: Option<&str>, arguments: &str) -> (Option<i32>, String) {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_ortelius"));
    command.current_dir(&folder).args(arguments.split(' ')).env("MESA_SHADER_CACHE_DIR", cache.path());
    command
        .env_remove("MESA_SHADER_CACHE_DISABLE")
        .env_remove("LP_NATIVE_VECTOR_WIDTH")
        .env("ORTELIUS_CACHE", "");
    if let Some(width) = width {
        command.env("LP_NATIVE_VECTOR_WIDTH", width);
    }
    let ran = command.output().unwrap();
    (ran.status.code(), String::from_utf8_lossy(&ran.stderr).into_owned())
}

/// Mesa's shader cache does not distinguish widths: code for 256 bits writes beyond the buffers of a run with 128 bits.
#[test]
fn every_scene_renders_with_vectors_of_128_and_256_bits_after_a_run_with_mesas_own() {
    let cache = tempfile::tempdir().unwrap();
    let globe = "render globe --size 64x36 -o a.png";
    let (code, words) = with_vectors(&cache, None, globe);
    assert_eq!(code, Some(0), "{words}");
    SHIPPED.par_iter().flat_map(|(scene, _)| [("128", scene), ("256", scene)]).for_each(|(width, scene)| {
        let (code, words) = with_vectors(&cache, Some(width), &globe.replace("globe", scene));
        assert_eq!(code, Some(0), "{scene} at {width} bits: {words}");
        let is_heeded = !words.contains("llvmpipe") || words.contains(&format!("{width} bits"));
        assert!(is_heeded && !words.contains("WARN"), "{scene}: {words}");
    });
}

/// tests/window has the same test for `view`.
#[test]
fn vectors_of_512_bits_are_refused_by_every_command_that_draws() {
    let cache = tempfile::tempdir().unwrap();
    for command in [
        "render globe --size 160x90 -o a.png",
        "doctor",
        "reproduce vt.address --partition 1/3 -o out",
        "trade earth --size 64x36 --knobs level-bias",
    ] {
        let (code, words) = with_vectors(&cache, Some("512"), command);
        let lines: Vec<&str> = words.lines().filter(|line| !line.starts_with(" INFO ")).collect();
        let is_refused =
            code == Some(1) && lines.len() == 1 && lines[0].contains("unset LP_NATIVE_VECTOR_WIDTH");
        assert!(is_refused || !words.contains("llvmpipe"), "{command}: {code:?}: {words}");
    }
}

#[test]
fn every_wrong_result_is_rejected() {
    let file = |bytes: &[u8]| vec![("a.png".to_string(), bytes.to_vec())];
    let undisturbed = Ended { code: Some(0), files: file(b"whole"), ..Ended::default() };
    let line = " INFO a device\nortelius: no memory".to_string();
    let right = Ended { code: Some(1), stderr: line.clone(), ..Ended::default() };
    let found = |ended: &Ended| complaint(ended, &undisturbed, "host");
    assert_eq!(found(&right), None);
    let at_the_end = vec!["vkDeviceWaitIdle".to_string()];
    let closing = Ended { files: file(b"whole"), calls: at_the_end.clone(), ..right.clone() };
    assert_eq!(found(&closing), None);
    assert_eq!(found(&undisturbed), None);
    assert_eq!(complaint(&Ended { code: Some(4), ..right.clone() }, &undisturbed, "lost"), None);
    for (wrong, why) in [
        (Ended { code: None, ..right.clone() }, "a crash"),
        (Ended { code: Some(4), ..right.clone() }, "exit code 4"),
        (Ended { code: Some(101), ..right.clone() }, "exit code 101"),
        (Ended { files: file(b"wh"), ..right.clone() }, "are left"),
        (Ended { files: file(b"wh"), ..undisturbed.clone() }, "other files"),
        (Ended { files: file(b"whole"), ..right.clone() }, "are left"),
        (Ended { files: file(b"wh"), calls: at_the_end.clone(), ..right.clone() }, "are left"),
        (Ended { stderr: format!("{line}\n WARN leak detected"), ..right.clone() }, "not one line"),
        (Ended { stderr: String::new(), ..right.clone() }, "not one line"),
    ] {
        assert!(found(&wrong).is_some_and(|found| found.contains(why)), "{why}: {wrong:?}");
    }
}
