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
fn unknown_names_on_the_command_line_are_usage_errors() {
    let folder = folder();
    for (arguments, words) in [
        (&["earth", "--camera", "nope"][..], &["\"nope\"", "headline"][..]),
        (&["earth", "--path", "nope"], &["\"nope\"", "teleport"]),
        (&["earth", "-D", "cache.gpu_tile=3"], &["-D cache.gpu_tile=3", "nearest is cache.gpu_tiles"]),
        (&["earth", "-D", "cache.gpu_tiles=many"], &["-D cache.gpu_tiles=many"]),
        (&["earth", "-D", "variant.block_log2=5"], &["-D variant.block_log2=5", "0 ..= 4"]),
        (&["erath"], &["\"erath\"", "earth", "ruler"]),
        (&["earth", "--device", "no such device"], &["\"no such device\"", "available: "]),
        (&["earth", "--device", "77"], &["\"77\"", "available: "]),
    ] {
        let (code, line) = render_failure(&folder, &[arguments, &["-o", "a.png"]].concat());
        assert_eq!(code, 2, "{line}");
        holds(&line, words);
    }
    assert_eq!(names(&folder), [""; 0]);
}

#[test]
fn an_invalid_command_line_is_a_usage_error() {
    let folder = folder();
    for (arguments, words) in [
        (&["--size", "12", "-o", "a.png"][..], &["--size", "WIDTHxHEIGHT"][..]),
        (&["--size", "0x90", "-o", "a.png"], &["--size", "1 to 16384"]),
        (&["--size", "160x16385", "-o", "a.png"], &["--size", "1 to 16384"]),
        (&["--frames", "0", "-o", "a.png"], &["--frames"]),
        (&["--camera", "low", "--path", "pan", "-o", "a.png"], &["--camera", "--path"]),
        (&["--nonsense"], &["--nonsense"]),
        (&[], &["nothing to write", "-o earth.png", "--report", "--explain"]),
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
fn a_wrong_scene_or_key_is_reported_before_a_missing_output() {
    let folder = folder();
    for (arguments, word) in [(&["nosuch"][..], "nosuch"), (&["earth", "-Dview.widht=3"], "view.width")] {
        let (_, line) = render_failure(&folder, arguments);
        assert!(line.contains(word) && !line.contains("nothing to write"), "{line}");
    }
}

#[test]
fn an_output_without_a_folder_or_over_a_non_file_is_rejected_before_rendering() {
    let folder = folder();
    std::fs::create_dir(folder.path().join("d.png")).unwrap();
    std::os::unix::fs::symlink("nowhere", folder.path().join("l.png")).unwrap();
    for (output, words) in [
        ("missing/a.png", &["missing/a.png", "folder missing does not exist", "create it"][..]),
        ("d.png", &["d.png", "is a folder"]),
        ("l.png", &["l.png", "link"]),
    ] {
        let (code, line) = render_failure(&folder, &["earth", "-o", output]);
        assert_eq!(code, 1, "{line}");
        holds(&line, words);
    }
    // A rename would replace the device node itself.
    let (code, line) = render_failure(&folder, &["earth", "--report", "/dev/null"]);
    assert_eq!(code, 1, "{line}");
    holds(&line, &["/dev/null", "regular file"]);
    assert_eq!(names(&folder), ["d.png", "l.png"]);
}

#[test]
fn options_that_meshes_lack_are_rejected_and_a_missing_model_is_named() {
    let folder = folder();
    for option in ["--dump-visible=a.csv", "--dump-footprint=a.exr", "--compare-plain"] {
        let (code, line) = render_failure(&folder, &["bunny", "-o", "a.png", option]);
        assert_eq!(code, 2, "{line}");
        holds(&line, &[option.split('=').next().unwrap(), "scene bunny has no virtual texture"]);
    }
    for (source, words) in [
        (
            "rabbit",
            &[
                "surface.bunny.geometry.source",
                "neither a file nor the name of a model",
                "\"rabbit\"",
                "bunny, sphere",
            ][..],
        ),
        (
            "dragon",
            &["surface.bunny.geometry.source", "dragon has not been fetched; run `ortelius fetch dragon`"],
        ),
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
    holds(&line, &["scene bunny: nothing to vary"]);
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
        &["pass       levels: herd", "pass       surfaces: herd", "memory     herd: indices: 192000 bytes"],
    );
    // Instances are not 500 full meshes: each has 64 faces until it is visible.
    holds(
        &explained,
        &["instances  herd: 500 with 64 to 3674 faces at 1806 levels; each has ", "6 bytes per live face"],
    );
    assert!(!explained.contains("feature") && !explained.contains("needs"), "{explained}");
    let report: serde_json::Value = serde_json::from_str(&crate::read(&folder, "r.json")).unwrap();
    assert_eq!(report["frames"].as_array().unwrap().len(), 2);
    assert_eq!(report["surfaces"]["herd"]["levels"].as_array().unwrap().len(), 500);
    assert_eq!(report["surfaces"]["herd"]["faces"], 3674);
    let bytes = |what: &str| report["surfaces"]["herd"]["memory_bytes"][what].as_f64().unwrap();
    let live = 6.0 * bytes("live_faces_of_an_instance");
    assert!(bytes("state_of_an_instance") < 400.0, "{report}");
    assert!(live <= bytes("host_indices_of_an_instance"), "{report}");
    assert!(bytes("device_indices_of_an_instance") < 4.0 * live, "{report}");
    let on_the_device = ["render", "bunny", "--explain", "-D", "surface.bunny.geometry.apply=gpu"];
    let explained = String::from_utf8(run(&folder, &on_the_device).stdout).unwrap();
    holds(&explained, &["memory     bunny: splits and permutations: "]);
}

#[test]
fn no_driver_is_exit_2_and_lists_the_searched_places() {
    let folder = folder();
    let mut command = ortelius(&folder, &["render", "earth", "-o", "a.png"]);
    let (code, line) = failure(command.env("VK_DRIVER_FILES", "/nonexistent/driver.json"));
    assert_eq!(code, 2, "{line}");
    holds(&line, &["/nonexistent/driver.json (from VK_DRIVER_FILES)", "Mesa", "ortelius doctor"]);
}

#[test]
fn no_validation_layer_is_exit_2_and_names_the_layer() {
    let folder = folder();
    let mut command = ortelius(&folder, &["render", "earth", "-o", "a.png", "--validate"]);
    let (code, line) = failure(command.env("VK_LAYER_PATH", folder.path()));
    assert_eq!(code, 2, "{line}");
    holds(&line, &["VK_LAYER_KHRONOS_validation", "--validate"]);
}

#[test]
fn more_tiles_than_device_layers_names_the_key_and_the_limit() {
    let folder = folder();
    let (code, line) = render_failure(&folder, &["earth", "-o", "a.png", "-D", "cache.gpu_tiles=65536"]);
    assert_eq!(code, 1, "{line}");
    holds(&line, &["cache.gpu_tiles", "65536", "this device supports", "lower cache.gpu_tiles"]);
}

#[test]
fn a_missing_or_invalid_texture_file_is_named() {
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
fn a_full_disk_leaves_no_partial_file_and_keeps_an_older_picture() {
    let folder = folder();
    for output in [["-o", "a.png"], ["-o", "a.exr"], ["--dump-footprint", "a.exr"], ["--report", "a.json"]] {
        let name = output[1];
        write(&folder, name, "older");
        // The first file goes to a device that is always full. A limit on file sizes would also affect drivers
        // that keep device memory in memory files.
        let arguments = [&["render", "earth", "--size", "160x90"][..], &output].concat();
        let (code, line) = failure(&mut ortelius_writing_to("/dev/full", name, &folder, &arguments));
        assert_eq!(code, 1, "{line}");
        holds(&line, &[name, "cannot write", "No space left"]);
        assert_eq!(read(&folder, name), "older");
        assert_eq!(names(&folder), [name]);
        std::fs::remove_file(folder.path().join(name)).unwrap();
    }
}

#[test]
fn a_full_stdout_is_an_error_and_a_closed_pipe_is_not() {
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
fn a_full_stderr_does_not_change_the_exit_code() {
    let folder = folder();
    let full = || File::options().write(true).open("/dev/full").unwrap();
    let mut command = ortelius(&folder, &["render", "earth", "--camera", "nope", "-o", "a.png"]);
    assert_eq!(command.stderr(full()).status().unwrap().code(), Some(2));
    let mut command = ortelius(&folder, &["render", "earth", "--size", "16x16", "-o", "a.png"]);
    assert_eq!(command.stderr(full()).status().unwrap().code(), Some(0));
    assert_eq!(names(&folder), ["a.png"]);
}

#[test]
fn quiet_is_silent_and_text_in_a_file_has_no_colours() {
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

#[test]
fn unreadable_tiles_are_counted_and_strict_exits_with_3() {
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
fn a_sequence_reports_its_single_picture_and_can_settle_each_frame() {
    let folder = folder();
    let orbit = ["render", "bunny", "--size", "32x18", "--path", "orbit", "--frames", "3", "-o"];
    let words = |name: &str| String::from_utf8(run(&folder, &[&orbit[..], &[name]].concat()).stderr).unwrap();
    assert!(words("a.png").contains("the picture shows the last pose"));
    assert!(!words("b{frame}.png").contains("the last pose"));
    let rendered = |more: &[&str]| {
        let usual = ["earth", "--size", "32x18", "--path", "teleport", "--deterministic"];
        crate::rendered(&folder, &[&usual, more].concat());
    };
    rendered(&["--frames", "2", "-o", "first{frame}.png"]);
    rendered(&["--frames", "2", "--settle-each", "-o", "each{frame}.png", "--report", "each.json"]);
    holds(&crate::read(&folder, "each.json"), &["\"settle_each\": true"]);
    let shown = |name: &str| picture(&folder.path().join(name));
    for frame in 0..2 {
        let alone = format!("alone{frame}.png");
        rendered(&["--frames", &(frame + 1).to_string(), "--settle", "-o", &alone]);
        assert!(shown(&format!("each0000{frame}.png")) == shown(&alone), "frame {frame}");
        assert!(shown(&format!("first0000{frame}.png")) != shown(&alone), "frame {frame} needs no tiles");
    }
}

#[test]
fn control_characters_of_a_name_are_not_printed() {
    let folder = folder();
    let (_, line) = failure(&mut ortelius(&folder, &["render", "no\u{1b}[31mred.toml", "-o", "a.png"]));
    assert!(line.contains(r"no\u{1b}[31mred.toml"), "{line:?}");
}

/// Nobody writes into the pipe, so reading it would wait for ever. /dev/null comes first, because reading it never
/// waits.
#[test]
fn an_input_that_is_not_a_regular_file_is_refused_by_every_command() {
    let folder = folder();
    let (pipe, _other_end) = std::io::pipe().unwrap();
    let pipe = format!("/proc/{}/fd/{}", std::process::id(), std::os::fd::AsRawFd::as_raw_fd(&pipe));
    let mut commands = vec![
        "render in.toml -o a.png",
        "render in.json -o a.png",
        "compare in.png in.png",
        "bake in.png -o a.tiles",
        "verify in.tiles",
        "mesh build in.ply -o a.pmesh",
        "mesh info in.pmesh",
        "page in.json",
        "reproduce vt --against in.json",
        "trade earth --against in.json",
    ];
    if cfg!(feature = "window") {
        commands.push("view earth --trade in.json");
    }
    for target in ["/dev/null", &pipe] {
        for name in ["in.toml", "in.json", "in.png", "in.tiles", "in.ply", "in.pmesh"] {
            // Removes the link to the first target.
            let _absent = std::fs::remove_file(folder.path().join(name));
            std::os::unix::fs::symlink(target, folder.path().join(name)).unwrap();
        }
        for command in &commands {
            let arguments: Vec<&str> = command.split(' ').collect();
            let (_, line) = failure(&mut ortelius(&folder, &arguments));
            assert!(line.contains("not a regular file"), "{command}, {target}: {line}");
        }
    }
    assert_eq!(names(&folder).len(), 6, "{:?}", names(&folder));
}
