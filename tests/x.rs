//! The script `./x`, in a fake system of a few files, with tools that only record their calls.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::Command;

const LOADER: &str = "usr/lib/x86_64-linux-gnu/libvulkan.so.1";
const DRIVER: &str = "usr/share/vulkan/icd.d/some_icd.json";
const LAYER: &str = "usr/share/vulkan/explicit_layer.d/VkLayer_khronos_validation.json";

/// Libraries that a window under a virtual display opens at run time; Xvfb itself is a tool.
const WINDOW: [&str; 4] = [
    "usr/lib/x86_64-linux-gnu/libX11-xcb.so.1",
    "usr/lib/x86_64-linux-gnu/libXcursor.so.1",
    "usr/lib/x86_64-linux-gnu/libXi.so.6",
    "usr/lib/x86_64-linux-gnu/libxkbcommon-x11.so.0",
];
const WINDOW_PACKAGES: &str = "xvfb libx11-xcb1 libxcursor1 libxi6 libxkbcommon-x11-0";

struct System {
    folder: tempfile::TempDir,
    environment: Vec<(String, String)>,
}

struct Outcome {
    code: i32,
    /// The tools' calls, one a line; and in `said` the output of the tools and `./x`.
    calls: Vec<String>,
    said: String,
}

impl System {
    /// A system with `files`, a user (0: root), and no package manager.
    fn new(files: &[&str], user: u32) -> Self {
        let system = Self { folder: tempfile::tempdir().unwrap(), environment: Vec::new() };
        fs::create_dir(system.path("bin")).unwrap();
        for tool in ["sh", "dirname", "tr", "sed", "grep", "env", "cat", "touch", "mkdir", "chmod"] {
            let real =
                ["/bin", "/usr/bin"].iter().map(|folder| Path::new(folder).join(tool)).find(|p| p.exists());
            symlink(real.unwrap_or_else(|| panic!("no {tool}")), system.path("bin").join(tool)).unwrap();
        }
        for file in files {
            system.touch(file);
        }
        system.tool("cargo", "");
        system.tool("c++", "");
        system.tool("id", &format!("echo {user}; exit"));
        system
    }

    /// The same system with a virtual display.
    fn with_display(self) -> Self {
        self.tool("Xvfb", "");
        WINDOW.iter().for_each(|file| self.touch(file));
        self
    }

    fn path(&self, within: &str) -> PathBuf {
        self.folder.path().join(within)
    }

    fn touch(&self, file: &str) {
        fs::create_dir_all(self.path(file).parent().unwrap()).unwrap();
        fs::write(self.path(file), "").unwrap();
    }

    /// A tool that runs `script` and then records its call in the file `calls`.
    fn tool(&self, name: &str, script: &str) {
        let calls = self.path("calls");
        let text = format!("#!/bin/sh\n{script}\necho \"{name} $*\" >> '{}'\n", calls.display());
        fs::write(self.path("bin").join(name), text).unwrap();
        fs::set_permissions(self.path("bin").join(name), fs::Permissions::from_mode(0o755)).unwrap();
    }

    /// A package manager that installs everything at any request.
    fn manager(&self, name: &str) {
        let mut script = String::new();
        for file in [LOADER, DRIVER, LAYER].into_iter().chain(WINDOW) {
            let file = self.path(file);
            script +=
                &format!("mkdir -p '{}'; touch '{}'\n", file.parent().unwrap().display(), file.display());
        }
        let server = self.path("bin/Xvfb");
        script += &format!("cat > '{0}' </dev/null; chmod +x '{0}'\n", server.display());
        self.tool(name, &format!("case \"$*\" in update) ;; *) {script} ;; esac"));
    }

    fn with(mut self, name: &str, value: &str) -> Self {
        self.environment.push((name.to_owned(), value.to_owned()));
        self
    }

    /// Runs `./x` from another folder, without a terminal.
    fn run(&self, arguments: &[&str]) -> Outcome {
        let output = Command::new(Path::new(env!("CARGO_MANIFEST_DIR")).join("x"))
            .args(arguments)
            .current_dir(self.folder.path())
            .env_clear()
            .env("PATH", self.path("bin"))
            .env("HOME", self.folder.path())
            .env("ORTELIUS_SYSROOT", self.folder.path())
            .envs(self.environment.iter().map(|(name, value)| (name, value)))
            .stdin(std::process::Stdio::null())
            .output()
            .unwrap();
        let calls = fs::read_to_string(self.path("calls")).unwrap_or_default();
        let said =
            String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
        let code = output.status.code().unwrap_or_else(|| panic!("ended by a signal: {said}"));
        Outcome { code, calls: calls.lines().map(str::to_owned).collect(), said }
    }
}

impl Outcome {
    #[track_caller]
    fn called(&self, expected: &[&str]) {
        let expected: Vec<String> = expected.iter().map(|&call| call.to_owned()).collect();
        assert_eq!((self.code, &self.calls), (0, &expected), "{}", self.said);
    }

    #[track_caller]
    fn refused(&self, words: &str) {
        assert!(self.code == 2 && self.said.contains(words), "{} {}", self.code, self.said);
        assert!(!self.calls.iter().any(|call| call.starts_with("cargo")), "{:?}", self.calls);
    }
}

#[test]
fn the_rest_of_the_arguments_goes_to_cargo() {
    let all = || System::new(&[LOADER, DRIVER, LAYER], 1000).with_display();
    all().run(&["demo"]).called(&["cargo run --release -- demo"]);
    all().run(&["demo", "--size", "640x360"]).called(&["cargo run --release -- demo --size 640x360"]);
    all().run(&["-y", "demo", "--no-install", "-o", "-y"]).called(&["cargo run --release -- demo -o -y"]);
    all()
        .run(&["test", "--test", "floors", "--", "--nocapture"])
        .called(&["cargo test --release --no-fail-fast --test floors -- --nocapture"]);
    all().run(&["test", "--help"]).called(&["cargo test --release --no-fail-fast --help"]);
}

#[test]
fn without_a_command_the_usage_is_shown() {
    System::new(&[], 0).run(&[]).refused("usage: ./x demo");
    System::new(&[], 0).run(&["build"]).refused("usage: ./x demo");
    let help = System::new(&[], 0).run(&["--help"]);
    assert!(help.code == 0 && help.said.contains("usage: ./x demo"), "{}", help.said);
}

#[test]
fn an_existing_driver_is_never_touched() {
    for file in [DRIVER, "etc/vulkan/icd.d/nvidia_icd.json", "usr/local/share/vulkan/icd.d/a.json"] {
        let system = System::new(&[LOADER, file], 0);
        system.manager("apt-get");
        system.run(&["demo"]).called(&["cargo run --release -- demo"]);
    }
}

#[test]
fn root_installs_what_is_missing_and_no_more() {
    let with_window = format!("vulkan-validationlayers {WINDOW_PACKAGES}");
    let cases: [(&[&str], &str, &str); 5] = [
        (&[], "demo", "libvulkan1 mesa-vulkan-drivers"),
        (&[LOADER], "demo", "mesa-vulkan-drivers"),
        (&[DRIVER], "demo", "libvulkan1"),
        (&[LOADER, DRIVER], "test", &with_window),
        (&[LOADER, DRIVER, LAYER], "test", WINDOW_PACKAGES),
    ];
    for (files, command, packages) in cases {
        let system = System::new(files, 0);
        system.manager("apt-get");
        let install = format!("apt-get install -y --no-install-recommends {packages}");
        let cargo = if command == "demo" {
            "cargo run --release -- demo"
        } else {
            "cargo test --release --no-fail-fast"
        };
        let outcome = system.run(&[command]);
        outcome.called(&["apt-get update", &install, cargo]);
        assert!(
            outcome.said.contains(&format!("installing: apt-get update && {install}")),
            "{}",
            outcome.said
        );
    }
}

#[test]
fn each_system_has_its_own_packages() {
    for (manager, install) in [
        (
            "dnf",
            "dnf install -y vulkan-loader mesa-vulkan-drivers vulkan-validation-layers xorg-x11-server-Xvfb \
             libX11-xcb libXcursor libXi libxkbcommon-x11",
        ),
        (
            "pacman",
            "pacman -Sy --needed --noconfirm vulkan-icd-loader vulkan-swrast vulkan-validation-layers \
             xorg-server-xvfb libx11 libxcursor libxi libxkbcommon-x11",
        ),
        (
            "apk",
            "apk add vulkan-loader mesa-vulkan-swrast vulkan-validation-layers xvfb libx11 libxcursor libxi \
             libxkbcommon xkeyboard-config setxkbmap",
        ),
    ] {
        let system = System::new(&[], 0);
        system.manager(manager);
        system.run(&["test"]).called(&[install, "cargo test --release --no-fail-fast"]);
    }
    System::new(&[], 0).run(&["demo"]).refused("no package manager known here");
}

#[test]
fn no_install_prints_the_command_and_stops() {
    let system = System::new(&[LOADER], 0);
    system.manager("apt-get");
    let outcome = system.run(&["demo", "--no-install"]);
    outcome.refused("apt-get update && apt-get install -y --no-install-recommends mesa-vulkan-drivers");
    assert_eq!(outcome.calls, [""; 0]);
}

#[test]
fn a_user_without_a_terminal_does_not_become_root_unasked() {
    let system = System::new(&[LOADER], 1000);
    system.manager("apt-get");
    system.run(&["demo"]).refused("no sudo here; run as root: apt-get update && ");
    system.tool("sudo", "");
    let outcome = system.run(&["demo"]);
    outcome.refused("give -y, or run as root: apt-get update && ");
    assert_eq!(outcome.calls, [""; 0]);
}

#[test]
fn sudo_is_used_after_consent_or_in_ci() {
    let sudo = "shift; \"$@\"";
    let calls = [
        "apt-get update",
        "sudo apt-get update",
        "apt-get install -y --no-install-recommends mesa-vulkan-drivers",
        "sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends mesa-vulkan-drivers",
        "cargo run --release -- demo",
    ];
    for (arguments, ci) in [(&["demo", "-y"][..], "false"), (&["demo"], "true")] {
        let system = System::new(&[LOADER], 1000).with("CI", ci);
        system.manager("apt-get");
        system.tool("sudo", sudo);
        system.run(arguments).called(&calls);
    }
}

#[test]
fn an_update_that_fails_does_not_stop_the_install() {
    let system = System::new(&[LOADER], 0);
    let driver = system.path(DRIVER);
    let folder = driver.parent().unwrap().display();
    let install = format!("mkdir -p '{folder}'; touch '{}'", driver.display());
    system.tool("apt-get", &format!("case $1 in update) exit 100 ;; *) {install} ;; esac"));
    let outcome = system.run(&["demo"]);
    outcome.called(&[
        "apt-get install -y --no-install-recommends mesa-vulkan-drivers",
        "cargo run --release -- demo",
    ]);
    assert!(outcome.said.contains("'apt-get update' failed; trying to install anyway"));
}

#[test]
fn an_install_that_fails_or_installs_nothing_is_an_error() {
    let system = System::new(&[LOADER], 0);
    system.tool("apt-get", "case $1 in install) exit 100 ;; esac");
    system.run(&["demo"]).refused("mesa-vulkan-drivers' failed");
    system.tool("apt-get", "");
    system.run(&["demo"]).refused("still missing after 'apt-get install");
}

#[test]
fn files_named_from_outside_are_respected() {
    let elsewhere = System::new(&[LOADER, "opt/my icd.json"], 0);
    let named = elsewhere.path("opt/my icd.json").display().to_string();
    for name in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES", "VK_ADD_DRIVER_FILES"] {
        let system = System::new(&[LOADER], 0).with(name, &format!("/nowhere.json:{named}"));
        system.manager("apt-get");
        system.run(&["demo"]).called(&["cargo run --release -- demo"]);
    }
    // The loader would ignore the packages that we install.
    let system = System::new(&[LOADER], 0).with("VK_DRIVER_FILES", "/nowhere.json");
    system.manager("apt-get");
    let outcome = system.run(&["demo"]);
    outcome.refused("VK_DRIVER_FILES (VK_ICD_FILENAMES) = /nowhere.json names no file here");
    assert_eq!(outcome.calls, [""; 0]);
}

#[test]
fn tools_that_cargo_needs_are_named() {
    for (tool, words) in [("cargo", "no cargo: install Rust"), ("c++", "no C++ compiler (c++)")] {
        let system = System::new(&[LOADER, DRIVER], 0);
        fs::remove_file(system.path("bin").join(tool)).unwrap();
        system.run(&["demo"]).refused(words);
    }
    System::new(&[LOADER, DRIVER], 0)
        .with("CXX", "my-c++ -O1")
        .run(&["demo"])
        .refused("no C++ compiler (my-c++");
}

#[test]
fn tests_without_a_browser_are_allowed_with_a_notice_but_not_in_ci() {
    let system = |browser: bool, ci: &str| {
        let system = System::new(&[LOADER, DRIVER, LAYER], 1000).with_display().with("CI", ci);
        system.tool("cargo", "echo \"allowed: ${ORTELIUS_ALLOW_NO_BROWSER-no}\"");
        if browser {
            system.tool("chromium", "");
        }
        system.run(&["test"]).said
    };
    let without = system(false, "");
    assert!(without.contains("no Chromium here") && without.contains("allowed: 1"), "{without}");
    for (browser, ci) in [(true, ""), (true, "true"), (false, "true")] {
        let said = system(browser, ci);
        assert!(!said.contains("Chromium") && said.contains("allowed: no"), "{said}");
    }
}

/// `.ci/nightly`, with scripts in place of `.ci/run` and `.ci/bare-machine`: they record their environment, and one
/// fails.
#[test]
fn the_nightly_checks_all_run_and_name_what_failed() {
    let folder = tempfile::tempdir().unwrap();
    let path = |within: &str| folder.path().join(within);
    fs::create_dir(path(".ci")).unwrap();
    symlink(Path::new(env!("CARGO_MANIFEST_DIR")).join(".ci/nightly"), path(".ci/nightly")).unwrap();
    // A file that this process writes cannot be executed while another thread's child still has it open.
    let written = r#"for script in run bare-machine; do
cat > .ci/$script <<'END'
#!/bin/sh
echo "${0##*/} $*: $ORTELIUS_FAULTS $ORTELIUS_FUZZ $ORTELIUS_FUZZ_SEED $ORTELIUS_DEBIAN13" >> calls
[ "$1" != 12 ]
END
chmod +x .ci/$script
done"#;
    let mut shell = Command::new("sh");
    assert!(shell.args(["-c", written]).current_dir(&folder).status().unwrap().success());
    let mut nightly = Command::new(path(".ci/nightly"));
    let ran = nightly.env("ORTELIUS_FUZZ_SEED", "7").output().unwrap();
    let said = String::from_utf8_lossy(&ran.stdout);
    let calls = fs::read_to_string(path("calls")).unwrap();
    assert_eq!(calls, "run : all 100 7 1\nbare-machine 12: all 100 7 1\nbare-machine 13: all 100 7 1\n");
    assert!(ran.status.code() == Some(1) && said.ends_with("failed: .ci/bare-machine 12\n"), "{said}");
    // Without a seed, the date.
    let ran = Command::new(path(".ci/nightly")).env_remove("ORTELIUS_FUZZ_SEED").output().unwrap();
    let said = String::from_utf8_lossy(&ran.stdout).into_owned();
    let seed = said.lines().next().unwrap().strip_prefix("ORTELIUS_FUZZ_SEED=").unwrap();
    assert!(seed.len() == 8 && seed.parse::<u32>().is_ok_and(|date| date > 20_260_000), "{said}");
}
