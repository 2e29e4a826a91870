//! `ortelius doctor`: shows the Vulkan installation and tests it. The self-test runs in a child process, so that a
//! crashing driver is reported and does not end the program.

use super::say;
use clap::Args;
use ortelius::header::JsonFormat;
use ortelius::paper::virtual_texture::PAPER;
use ortelius::vk::{Error, Feature, GpuOptions, Instance, PhysicalDevice, driver_folders, self_test};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::Read;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

#[derive(Args)]
pub struct DoctorArgs {
    /// Print JSON on stdout
    #[arg(long)]
    json: bool,
    /// Use this device: a part of its name, or its index
    #[arg(long, env = "ORTELIUS_DEVICE")]
    device: Option<String>,
    /// Run the self-test in this process (used for the child)
    #[arg(long, hide = true)]
    self_test: bool,
}

const FORMAT: JsonFormat = JsonFormat::new("ortelius-doctor", 1);

#[derive(Default, Serialize)]
struct Diagnosis {
    /// Version of the loader; `None` if it does not answer.
    loader: Option<String>,
    /// The error of the loader or the drivers.
    error: Option<String>,
    layers: Vec<String>,
    /// Driver manifests in the folders searched by the loader.
    drivers: Vec<DriverFolder>,
    devices: Vec<Device>,
    /// "passed" and what was not tested, or the error.
    self_test: String,
    healthy: bool,
}

#[derive(Serialize)]
struct DriverFolder {
    searched: String,
    found: Vec<String>,
}

#[derive(Serialize)]
struct Device {
    name: String,
    kind: &'static str,
    driver: String,
    vulkan: String,
    usable: bool,
    features: BTreeMap<&'static str, bool>,
    /// The `variant` of scenes that do not name one.
    default_variant: BTreeMap<&'static str, &'static str>,
}

/// The faults that the doctor found.
#[derive(Debug, thiserror::Error)]
#[error("{what}")]
pub struct DoctorFailed {
    what: String,
    pub exit_code: u8,
}

/// Result of the self-test.
struct SelfTest {
    /// As [`Diagnosis::self_test`].
    words: String,
    /// Exit code of the child, if any.
    exit_code: Option<u8>,
    /// True if the driver crashes or hangs, so that this process must not load it.
    deadly: bool,
}

/// A hanging driver must not block the doctor. A working software driver took at most 0.3 s.
const PATIENCE: Duration = Duration::from_secs(60);

pub fn run(args: &DoctorArgs) -> anyhow::Result<()> {
    if args.self_test {
        let options = GpuOptions { device: args.device.as_deref(), ..GpuOptions::default() };
        let passed = self_test::run(&options)?;
        // The parent appends this line to its result.
        return match passed.lacks {
            None => Ok(()),
            Some(feature) => {
                say(format_args!("transform feedback not tested: the device lacks {}", feature.name()))
            }
        };
    }
    let (diagnosis, verdict) = diagnose(args);
    if args.json {
        say(serde_json::to_string_pretty(&FORMAT.head(&diagnosis))?)?;
    } else {
        print(&diagnosis)?;
    }
    verdict
}

/// Collects the diagnosis, and the error with which the program ends if something is wrong.
fn diagnose(args: &DoctorArgs) -> (Diagnosis, anyhow::Result<()>) {
    // Run the child first. It makes the same queries of loader and drivers as this process, so a driver that crashes or
    // hangs does so there.
    let test = run_child(args.device.as_deref());
    let mut diagnosis = Diagnosis {
        drivers: driver_folders().into_iter().map(list_folder).collect(),
        self_test: test.words.clone(),
        ..Diagnosis::default()
    };
    let survey = match test.deadly {
        true => Err(anyhow::Error::new(DoctorFailed { what: test.words, exit_code: 1 })),
        false => Instance::survey().map_err(anyhow::Error::new),
    };
    let verdict = survey.and_then(|survey| {
        diagnosis.loader = Some(dotted(survey.loader_api));
        diagnosis.layers = survey.layers;
        diagnosis.devices = survey.devices.iter().map(describe).collect();
        match test.exit_code {
            _ if survey.devices.is_empty() => {
                diagnosis.self_test = "not run: there is no device".into();
                Err(Error::NoDevice { searched: driver_folders().join(", ") }.into())
            }
            Some(0) => Ok(()),
            code => {
                Err(DoctorFailed { what: diagnosis.self_test.clone(), exit_code: code.unwrap_or(1) }.into())
            }
        }
    });
    diagnosis.healthy = verdict.is_ok();
    diagnosis.error = verdict.as_ref().err().map(ToString::to_string);
    (diagnosis, verdict)
}

fn dotted((major, minor, patch): (u32, u32, u32)) -> String {
    format!("{major}.{minor}.{patch}")
}

fn describe(device: &PhysicalDevice) -> Device {
    let mut variant = PAPER;
    variant.fall_back(|_| false, |feature| device.features.contains(&feature));
    Device {
        name: device.name.clone(),
        kind: device.kind,
        driver: device.driver.clone(),
        vulkan: dotted(device.api),
        usable: device.usable(),
        features: Feature::ALL.iter().map(|f| (f.name(), device.features.contains(f))).collect(),
        default_variant: [("dedup", variant.dedup.name()), ("compact", variant.compact.name())].into(),
    }
}

/// Names of the manifests in a folder. If the environment names a manifest file instead, its path.
fn list_folder(searched: String) -> DriverFolder {
    let path = searched.split(" (from").next().unwrap_or(&searched);
    let mut found: Vec<String> = match std::fs::read_dir(path) {
        Ok(entries) => entries
            .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
            .filter(|name| name.ends_with(".json"))
            .collect(),
        Err(_) if std::path::Path::new(path).is_file() => vec![path.to_string()],
        Err(_) => Vec::new(),
    };
    found.sort();
    DriverFolder { searched, found }
}

fn run_child(device: Option<&str>) -> SelfTest {
    let ended = |words: String, exit_code, deadly| SelfTest { words, exit_code, deadly };
    let program = match std::env::current_exe() {
        Ok(program) => program,
        Err(error) => {
            return ended(format!("not run: cannot find this program's own file: {error}"), None, false);
        }
    };
    let mut command = Command::new(program);
    command.args(["doctor", "--self-test"]).stdout(Stdio::piped()).stderr(Stdio::piped());
    if let Some(device) = device {
        command.args(["--device", device]);
    }
    let mut child = match command.spawn() {
        Ok(child) => child,
        Err(error) => return ended(format!("not run: {error}"), None, false),
    };
    // Read concurrently: a full pipe would block the child.
    let (stdout, stderr) = (child.stdout.take(), child.stderr.take());
    let untested = std::thread::spawn(move || read_all(stdout));
    let words = std::thread::spawn(move || read_all(stderr));
    let start = Instant::now();
    loop {
        match child.try_wait() {
            Ok(Some(status)) if status.success() => {
                let untested = last_line(untested);
                let passed =
                    if untested.is_empty() { "passed".into() } else { format!("passed; {untested}") };
                return ended(passed, Some(0), false);
            }
            Ok(Some(status)) => {
                let last = last_line(words);
                // No exit code means a signal: the driver crashed.
                return match status.code() {
                    Some(code) => ended(format!("failed: {last}"), u8::try_from(code).ok(), false),
                    None => {
                        let advice = "update it, or select another with VK_DRIVER_FILES";
                        ended(format!("the driver crashed ({status}); {advice}. {last}"), None, true)
                    }
                };
            }
            Ok(None) if start.elapsed() > PATIENCE => {
                return ended(stopped(&mut child), None, true);
            }
            Ok(None) => std::thread::sleep(Duration::from_millis(10)),
            Err(error) => return ended(format!("unknown: {error}"), None, true),
        }
    }
}

/// Stops the child that did not answer.
fn stopped(child: &mut Child) -> String {
    let seconds = PATIENCE.as_secs();
    let outcome = match child.kill().and_then(|()| child.wait()) {
        Ok(_) => "the test was stopped".to_owned(),
        Err(error) => format!("the test could not be stopped: {error}"),
    };
    format!("the driver hangs: no answer in {seconds} s; {outcome}")
}

/// Everything that the child wrote to a pipe.
fn read_all(pipe: Option<impl Read>) -> Vec<u8> {
    let mut words = Vec::new();
    if let Some(mut pipe) = pipe {
        // If reading fails, the message lacks this text; the diagnosis is the same.
        let _ = pipe.read_to_end(&mut words);
    }
    words
}

/// The child's last line, without the program's name in front.
fn last_line(words: std::thread::JoinHandle<Vec<u8>>) -> String {
    let words = words.join().unwrap_or_default();
    let words = String::from_utf8_lossy(&words);
    let last = words.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("");
    last.trim_start_matches("ortelius: ").to_string()
}

fn print(diagnosis: &Diagnosis) -> anyhow::Result<()> {
    match &diagnosis.loader {
        Some(version) => say(format_args!("loader     Vulkan {version}"))?,
        None => say("loader     no answer")?,
    }
    say(format_args!("layers     {}", diagnosis.layers.join(", ")))?;
    for folder in &diagnosis.drivers {
        let found = if folder.found.is_empty() { "none".into() } else { folder.found.join(", ") };
        say(format_args!("drivers    {}: {found}", folder.searched))?;
    }
    for (index, device) in diagnosis.devices.iter().enumerate() {
        let Device { name, kind, driver, vulkan, .. } = device;
        say(format_args!("device {index}   {name} ({kind}), {driver}, Vulkan {vulkan}"))?;
        for (feature, has) in &device.features {
            say(format_args!("           {} {feature}", if *has { "yes" } else { "NO " }))?;
        }
        for (key, value) in &device.default_variant {
            say(format_args!("           variant.{key} = {value:?} by default"))?;
        }
        if !device.usable {
            say("           not usable: Vulkan 1.3 and scalarBlockLayout are required")?;
        }
    }
    say(format_args!("self-test  {}", diagnosis.self_test))
}
