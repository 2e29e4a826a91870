//! Errors in one line, exit codes, stdout and stderr.

use super::*;
use std::fs::File;
use std::process::Stdio;

#[test]
fn a_typo_in_a_scene_is_shown_by_line_column_and_caret() {
    let folder = folder();
    write(&folder, "s.toml", &small_scene(SYNTHETIC).replace("tilt_deg", "tlit_deg"));
    let ran = run(&folder, &["render", "s.toml", "-o", "a.png"]);
    assert_eq!(ran.status.code(), Some(1));
    let words = String::from_utf8(ran.stderr).unwrap();
    let lines: Vec<&str> = words.lines().collect();
    assert_eq!(lines.len(), 3, "{words}");
    let line = small_scene(SYNTHETIC).lines().position(|line| line.starts_with("tilt_deg")).unwrap() + 1;
    holds(lines[0], &[&format!("ortelius: s.toml:{line}:1: "), "tlit_deg", "tilt_deg"]);
    assert_eq!(lines[1], format!("{line} | tlit_deg = 30.0"));
    assert_eq!(lines[2].find('^'), lines[1].find("tlit_deg"));
    assert_eq!(names(&folder), ["s.toml"]);
}

#[test]
fn what_the_command_line_names_and_is_not_there_is_usage() {
    let folder = folder();
    for (arguments, words) in [
        (&["earth", "--camera", "nope"][..], &["\"nope\"", "headline"][..]),
        (&["earth", "--path", "nope"], &["\"nope\"", "teleport"]),
        (&["earth", "-D", "cache.gpu_tile=3"], &["-D cache.gpu_tile=3", "nearest is cache.gpu_tiles"]),
        (&["earth", "-D", "cache.gpu_tiles=many"], &["-D cache.gpu_tiles=many"]),
        (&["earth", "-D", "variant.block_log2=5"], &["-D variant.block_log2=5", "0 ..= 4"]),
        (&["erath"], &["\"erath\"", "earth", "ruler"]),
        (&["earth", "--device", "no such device"], &["\"no such device\"", "there are: "]),
        (&["earth", "--device", "77"], &["\"77\"", "there are: "]),
    ] {
        let (code, line) = render_failure(&folder, &[arguments, &["-o", "a.png"]].concat());
        assert_eq!(code, 2, "{line}");
        holds(&line, words);
    }
    assert_eq!(names(&folder), [""; 0]);
}

#[test]
fn a_command_line_that_cannot_be_is_usage() {
    let folder = folder();
    for (arguments, words) in [
        (&["--size", "12", "-o", "a.png"][..], &["--size", "WIDTHxHEIGHT"][..]),
        (&["--size", "0x90", "-o", "a.png"], &["--size", "1 to 16384"]),
        (&["--size", "160x16385", "-o", "a.png"], &["--size", "1 to 16384"]),
        (&["--frames", "0", "-o", "a.png"], &["--frames"]),
        (&["--camera", "low", "--path", "pan", "-o", "a.png"], &["--camera", "--path"]),
        (&["--nonsense"], &["--nonsense"]),
        (&[], &["nothing to write", "-o", "--report", "--explain"]),
        (&["-o", "a.jpg"], &["a.jpg", ".png or .exr"]),
        (&["-o", "png"], &["png", ".png or .exr"]),
        (&["--dump-footprint", "a.png"], &["a.png", ".exr"]),
        (&["--report", "precious.tiles"], &["precious.tiles"]),
        (&["-o", "a.exr", "--dump-footprint", "a.exr"], &["a.exr", "two outputs"]),
        (&["-o", "a.png", "--frames", "3", "--compare-plain"], &["--compare-plain", "--settle"]),
    ] {
        let ran = run(&folder, &[&["render", "earth"], arguments].concat());
        let line = String::from_utf8(ran.stderr).unwrap();
        assert_eq!(ran.status.code(), Some(2), "{line}");
        holds(&line, words);
        assert!(ran.stdout.is_empty());
    }
    assert_eq!(names(&folder), [""; 0]);
}

#[test]
fn an_output_in_no_folder_or_over_what_is_no_file_is_refused_before_rendering() {
    let folder = folder();
    std::fs::create_dir(folder.path().join("d.png")).unwrap();
    std::os::unix::fs::symlink("nowhere", folder.path().join("l.png")).unwrap();
    for (output, words) in [
        ("missing/a.png", &["missing/a.png", "no folder missing", "create it"][..]),
        ("d.png", &["d.png", "is a folder"]),
        ("l.png", &["l.png", "link"]),
    ] {
        let (code, line) = render_failure(&folder, &["earth", "-o", output]);
        assert_eq!(code, 1, "{line}");
        holds(&line, words);
    }
    // A rename over it would replace the device itself.
    let (code, line) = render_failure(&folder, &["earth", "--report", "/dev/null"]);
    assert_eq!(code, 1, "{line}");
    holds(&line, &["/dev/null", "regular file"]);
    assert_eq!(names(&folder), ["d.png", "l.png"]);
}

#[test]
fn what_a_scene_of_meshes_has_not_is_refused_and_a_model_that_is_not_there_is_named() {
    let folder = folder();
    for option in ["--dump-visible=a.csv", "--dump-footprint=a.exr", "--compare-plain"] {
        let (code, line) = render_failure(&folder, &["bunny", "-o", "a.png", option]);
        assert_eq!(code, 2, "{line}");
        holds(&line, &[option.split('=').next().unwrap(), "scene bunny has no virtual texture"]);
    }
    for (source, words) in [
        (
            "rabbit",
            &["surface.bunny.geometry.source", "no model is called so", "\"rabbit\"", "bunny, sphere"][..],
        ),
        ("dragon", &["surface.bunny.geometry.source", "dragon is not here: run `ortelius fetch dragon`"]),
        ("a.ply", &["surface.bunny.geometry.source", "a.ply"]),
        ("a.pmesh", &["surface.bunny.geometry.source", "a.pmesh"]),
    ] {
        let change = format!("surface.bunny.geometry.source={source}");
        let mut render = ortelius(&folder, &["render", "bunny", "-o", "a.png", "-D", &change]);
        let (code, line) = failure(render.env("XDG_DATA_HOME", folder.path()));
        assert_eq!(code, 1, "{line}");
        holds(&line, words);
    }
    let (_, line) = failure(&mut ortelius(&folder, &["trade", "bunny"]));
    holds(&line, &["scene bunny has no surface with a virtual texture"]);
    assert_eq!(names(&folder), [""; 0]);
}

#[test]
fn a_scene_of_meshes_is_rendered_explained_and_reported() {
    let folder = folder();
    let arguments = [
        "render",
        "herd",
        "--size",
        "64x36",
        "--frames",
        "2",
        "-o",
        "a.png",
        "--report",
        "r.json",
        "--explain",
    ];
    let ran = run(&folder, &arguments);
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let explained = String::from_utf8(ran.stdout).unwrap();
    holds(
        &explained,
        &["pass       levels: herd", "pass       surfaces: herd", "memory     herd: indices: 384000 bytes"],
    );
    // Not 500 full meshes: 64 faces each until they are seen.
    holds(
        &explained,
        &["instances  herd: 500 of 64 to 3674 faces at 1806 levels; each ", "12 bytes for each live face"],
    );
    assert!(!explained.contains("feature") && !explained.contains("needs"), "{explained}");
    let report: serde_json::Value = serde_json::from_str(&crate::read(&folder, "r.json")).unwrap();
    assert_eq!(report["frames"].as_array().unwrap().len(), 2);
    assert_eq!(report["surfaces"]["herd"]["levels"].as_array().unwrap().len(), 500);
    assert_eq!(report["surfaces"]["herd"]["faces"], 3674);
    let bytes = |what: &str| report["surfaces"]["herd"]["memory_bytes"][what].as_f64().unwrap();
    let live = 12.0 * bytes("live_faces_of_an_instance");
    assert!(bytes("state_of_an_instance") < 400.0, "{report}");
    assert!(live <= bytes("host_indices_of_an_instance"), "{report}");
    assert!(bytes("device_indices_of_an_instance") < 4.0 * live, "{report}");
    let on_the_device = ["render", "bunny", "--explain", "-D", "surface.bunny.geometry.apply=gpu"];
    let explained = String::from_utf8(run(&folder, &on_the_device).stdout).unwrap();
    holds(&explained, &["memory     bunny: splits and permutations: "]);
}

#[test]
fn no_driver_is_exit_2_and_says_where_it_was_looked_for() {
    let folder = folder();
    let mut command = ortelius(&folder, &["render", "earth", "-o", "a.png"]);
    let (code, line) = failure(command.env("VK_DRIVER_FILES", "/nonexistent/driver.json"));
    assert_eq!(code, 2, "{line}");
    holds(&line, &["/nonexistent/driver.json (from VK_DRIVER_FILES)", "Mesa", "ortelius doctor"]);
}

#[test]
fn no_validation_layer_is_exit_2_and_says_what_to_install() {
    let folder = folder();
    let mut command = ortelius(&folder, &["render", "earth", "-o", "a.png", "--validate"]);
    let (code, line) = failure(command.env("VK_LAYER_PATH", folder.path()));
    assert_eq!(code, 2, "{line}");
    holds(&line, &["VK_LAYER_KHRONOS_validation", "--validate"]);
}

#[test]
fn more_tiles_than_the_device_has_layers_names_the_key_and_the_limit() {
    let folder = folder();
    let (code, line) = render_failure(&folder, &["earth", "-o", "a.png", "-D", "cache.gpu_tiles=65536"]);
    assert_eq!(code, 1, "{line}");
    holds(&line, &["cache.gpu_tiles", "65536", "the device takes", "lower it"]);
}

#[test]
fn a_texture_file_that_is_not_there_or_not_one_is_named() {
    let folder = folder();
    write(&folder, "s.toml", &small_scene("source = \"file\"\npath = \"t.tiles\""));
    let (code, line) = render_failure(&folder, &["s.toml", "-o", "a.png"]);
    assert_eq!(code, 1, "{line}");
    holds(&line, &["scene s.toml", "t.tiles", "cannot be opened", "No such file"]);
    write(&folder, "t.tiles", &"no tiles ".repeat(1000));
    let (code, line) = render_failure(&folder, &["s.toml", "-o", "a.png"]);
    assert_eq!(code, 3, "{line}");
    holds(&line, &["scene s.toml", "t.tiles", "not a .tiles file"]);
}

#[test]
fn a_full_disk_leaves_nothing_half_written_and_an_older_picture_as_it_was() {
    let folder = folder();
    for output in [["-o", "a.png"], ["-o", "a.exr"], ["--dump-footprint", "a.exr"], ["--report", "a.json"]] {
        let name = output[1];
        write(&folder, name, "older");
        // The limit on a file's size (512 bytes) stands for a full disk: it needs no root. SIGXFSZ ignored, write(2)
        // fails with EFBIG where it would with ENOSPC.
        let mut command = Command::new("sh");
        command.current_dir(&folder).args(["-c", "ulimit -f 1; trap '' XFSZ; exec \"$@\"", "sh"]);
        command.args([env!("CARGO_BIN_EXE_ortelius"), "render", "earth", "--size", "160x90"]).args(output);
        let (code, line) = failure(&mut command);
        assert_eq!(code, 1, "{line}");
        holds(&line, &[name, "cannot write", "File too large"]);
        assert_eq!(read(&folder, name), "older");
        assert_eq!(names(&folder), [name]);
        std::fs::remove_file(folder.path().join(name)).unwrap();
    }
}

#[test]
fn stdout_that_is_full_is_an_error_and_a_reader_that_has_enough_is_none() {
    let folder = folder();
    let explain = ["render", "earth", "--size", "16x16", "--explain"];
    let full = File::options().write(true).open("/dev/full").unwrap();
    let ran = ortelius(&folder, &explain).stdout(full).stderr(Stdio::piped()).output().unwrap();
    let words = String::from_utf8(ran.stderr).unwrap();
    assert_eq!(ran.status.code(), Some(1), "{words}");
    holds(words.lines().last().unwrap(), &["ortelius: stdout: cannot write", "No space"]);
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let ran = ortelius(&folder, &explain).stdout(writer).stderr(Stdio::piped()).output().unwrap();
    assert_eq!(ran.status.code(), Some(0), "{}", String::from_utf8_lossy(&ran.stderr));
}

#[test]
fn stderr_that_is_full_changes_no_exit_code() {
    let folder = folder();
    let full = || File::options().write(true).open("/dev/full").unwrap();
    let mut command = ortelius(&folder, &["render", "earth", "--camera", "nope", "-o", "a.png"]);
    assert_eq!(command.stderr(full()).status().unwrap().code(), Some(2));
    let mut command = ortelius(&folder, &["render", "earth", "--size", "16x16", "-o", "a.png"]);
    assert_eq!(command.stderr(full()).status().unwrap().code(), Some(0));
    assert_eq!(names(&folder), ["a.png"]);
}

#[test]
fn quiet_is_silent_and_words_in_a_file_have_no_colours() {
    let folder = folder();
    let usual = ["render", "earth", "--size", "160x90", "-o", "a.png"];
    let words = |more: &[&str]| {
        let ran = run(&folder, &[&usual, more].concat());
        assert!(ran.status.success());
        assert_eq!(ran.stdout, b"", "stdout is for data");
        String::from_utf8(ran.stderr).unwrap()
    };
    assert_eq!(words(&["-q"]), "");
    let (said, more) = (words(&[]), words(&["-vv"]));
    holds(&said, &["INFO", "settled"]);
    assert!(more.lines().count() >= said.lines().count(), "{more}");
    assert!(!said.contains('\u{1b}') && !more.contains('\u{1b}'), "{said}{more}");
}

/// Wherever the device is lost, the program ends in one line with its own exit code, and does not hang.
#[test]
fn a_lost_device_is_exit_code_4_wherever_it_is_noticed() {
    let folder = folder();
    write(&folder, "scene.toml", &small_scene(SYNTHETIC));
    for lost in ["vkQueueSubmit2", "vkQueueSubmit2:7", "vkWaitSemaphores:5"] {
        let mut command = ortelius(&folder, &["render", "scene.toml", "-o", "picture.png"]);
        let (code, line) = failure(command.env("ORTELIUS_LOSE_DEVICE", lost));
        assert_eq!(code, 4, "{lost}: {line}");
        let call = lost.split(':').next().unwrap();
        holds(&line, &["device lost", call, "--validate"]);
        assert!(!names(&folder).contains(&"picture.png".to_owned()), "{lost}: no half-made picture");
    }
}

#[test]
fn tiles_that_cannot_be_read_are_counted_and_strict_exits_with_3() {
    let folder = folder();
    let broken = ["render", "earth", "--size", "64x36", "-o", "a.png", "-D", "disk.fails_share=1"];
    let ran = run(&folder, &broken);
    let words = String::from_utf8_lossy(&ran.stderr).into_owned();
    assert!(ran.status.success() && words.contains("tiles could not be read"), "{words}");
    let strict = run(&folder, &[&broken[..], &["--strict"]].concat());
    let words = String::from_utf8_lossy(&strict.stderr).into_owned();
    let last = words.lines().last().unwrap_or_default();
    assert!(last.starts_with("ortelius: ") && last.contains("tiles could not be read"), "{words}");
    assert_eq!(strict.status.code(), Some(3));
    let whole = run(&folder, &["render", "earth", "--size", "64x36", "-o", "a.png", "--strict"]);
    assert!(whole.status.success(), "{}", String::from_utf8_lossy(&whole.stderr));
}

#[test]
fn a_sequence_says_that_one_picture_is_written_and_settles_each_frame_if_asked() {
    let folder = folder();
    let orbit = ["render", "bunny", "--size", "32x18", "--path", "orbit", "--frames", "3", "-o"];
    let words = |name: &str| String::from_utf8(run(&folder, &[&orbit[..], &[name]].concat()).stderr).unwrap();
    assert!(words("a.png").contains("the picture is that of the last pose"));
    assert!(!words("b{frame}.png").contains("the last pose"));
    let each = ["render", "earth", "--size", "64x36", "--path", "pan", "--frames", "3", "--settle-each"];
    let ran = run(&folder, &[&each[..], &["-o", "c.png", "--report", "c.json"]].concat());
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let report: serde_json::Value = serde_json::from_str(&crate::read(&folder, "c.json")).unwrap();
    // Nothing is missing in the last frame of each pose, and more than three frames were rendered.
    assert!(report["frames"].as_array().unwrap().len() > 3 && report["run"]["settle_each"] == true);
}

#[test]
fn control_characters_of_a_name_do_not_reach_the_terminal() {
    let folder = folder();
    let (_, line) = failure(&mut ortelius(&folder, &["render", "no\u{1b}[31mred.toml", "-o", "a.png"]));
    assert!(line.contains(r"no\u{1b}[31mred.toml"), "{line:?}");
}
