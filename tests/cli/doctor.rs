//! `ortelius doctor`.

use super::*;
use serde_json::Value;

fn doctor(folder: &TempDir, driver: &str) -> (i32, Value, String) {
    let ran = ortelius(folder, &["doctor", "--json"]).env("VK_DRIVER_FILES", driver).output().unwrap();
    let words = String::from_utf8(ran.stderr).unwrap();
    let found = serde_json::from_slice(&ran.stdout).expect("JSON");
    (ran.status.code().expect("an exit code, no signal"), found, words)
}

fn manifest(folder: &TempDir, library: &str) -> String {
    let text = format!(
        r#"{{"file_format_version": "1.0.0", "ICD": {{"library_path": "{library}", "api_version": "1.3.0"}}}}"#
    );
    write(folder, "driver.json", &text);
    folder.path().join("driver.json").display().to_string()
}

#[test]
fn a_healthy_machine_passes_and_is_described() {
    let folder = folder();
    let ran = run(&folder, &["doctor"]);
    assert_eq!(ran.status.code(), Some(0));
    let words = String::from_utf8(ran.stdout).unwrap();
    holds(&words, &["loader     Vulkan 1.", "device 0 ", "yes geometryShader", "self-test  passed"]);
    holds(&words, &["variant.dedup = \"", "variant.compact = \""]);
    let ran = run(&folder, &["doctor", "--json"]);
    assert_eq!(ran.status.code(), Some(0));
    let found: Value = serde_json::from_slice(&ran.stdout).unwrap();
    assert_eq!((&found["format"], &found["version"]), (&"ortelius-doctor".into(), &1.into()));
    assert_eq!(found["self_test"], "passed");
    assert_eq!(found["healthy"], true);
    assert_eq!(found["error"], Value::Null);
    assert!(found["loader"].as_str().unwrap().starts_with("1."));
    let device = &found["devices"][0];
    assert_eq!(device["usable"], true);
    for feature in ["geometryShader", "logicOp", "textureCompressionBC"] {
        assert!(device["features"][feature].is_boolean(), "{feature}");
    }
}

#[test]
fn no_driver_is_exit_2_and_the_searched_places_are_listed() {
    let folder = folder();
    let (code, found, words) = doctor(&folder, "/nonexistent/driver.json");
    assert_eq!(code, 2, "{words}");
    assert_eq!(words.lines().count(), 1, "{words}");
    holds(&words, &["/nonexistent/driver.json"]);
    assert_eq!(found["healthy"], false);
    assert_eq!(found["drivers"][0]["searched"], "/nonexistent/driver.json (from VK_DRIVER_FILES)");
    assert_eq!(found["drivers"][0]["found"], Value::Array(Vec::new()));
    holds(found["error"].as_str().unwrap(), &["no Vulkan driver", "/nonexistent/driver.json"]);
}

#[test]
fn a_driver_without_its_library_is_not_a_driver() {
    let folder = folder();
    let driver = manifest(&folder, "/nonexistent/libdriver.so");
    let (code, found, words) = doctor(&folder, &driver);
    assert_eq!(code, 2, "{words}");
    assert_eq!(found["drivers"][0]["found"][0], driver.as_str(), "the manifest itself is there");
    assert_eq!(found["healthy"], false);
}

#[test]
fn a_crashing_driver_is_reported_and_does_not_crash_the_doctor() {
    let folder = folder();
    // CXX names the compiler, as for the build.
    write(&folder, "crash.cpp", "#include <cstdlib>\nstruct S { S() { abort(); } } s;\n");
    let compiler = std::env::var("CXX").unwrap_or_else(|_| "c++".into());
    let mut command = Command::new(&compiler);
    command.current_dir(&folder).args(["-shared", "-fPIC", "-o", "libcrash.so", "crash.cpp"]);
    assert!(command.status().unwrap().success(), "{compiler}");
    let driver = manifest(&folder, &folder.path().join("libcrash.so").display().to_string());
    let (code, found, words) = doctor(&folder, &driver);
    assert_eq!(code, 1, "{words}");
    assert_eq!(words.lines().count(), 1, "{words}");
    holds(&words, &["the driver crashed", "SIGABRT", "VK_DRIVER_FILES"]);
    holds(found["self_test"].as_str().unwrap(), &["the driver crashed"]);
    assert_eq!(found["healthy"], false);
}

#[test]
fn an_absent_device_is_a_usage_error() {
    let folder = folder();
    let ran = run(&folder, &["doctor", "--device", "no such device"]);
    assert_eq!(ran.status.code(), Some(2));
    holds(&String::from_utf8(ran.stderr).unwrap(), &["\"no such device\"", "available: "]);
}
