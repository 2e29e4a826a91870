//! `ortelius doctor`: what there is of Vulkan, and whether it works. The self-test runs in a child process, so that a
//! driver that crashes is reported and not suffered.

use clap::Args;
use ortelius::vk::{Error, Feature, GpuOptions, Instance, PhysicalDevice, driver_folders, self_test};
use serde::Serialize;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

#[derive(Args)]
pub struct DoctorArgs {
    /// Print JSON on stdout
    #[arg(long)]
    json: bool,
    /// Part of a device's name, or its index
    #[arg(long, env = "ORTELIUS_DEVICE")]
    device: Option<String>,
    /// Run the self-test in this very process (what the child does)
    #[arg(long, hide = true)]
    self_test: bool,
}

#[derive(Serialize)]
struct Diagnosis {
    /// Version of the loader, or why there is none.
    loader: Result<String, String>,
    layers: Vec<String>,
    /// Driver manifests in the folders that the loader searches.
    drivers: Vec<DriverFolder>,
    devices: Vec<Device>,
    /// "passed", or what went wrong.
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
    features: Vec<(&'static str, bool)>,
}

/// Longest a healthy software driver has taken here is 0.3 s; a driver that hangs must not hang the doctor.
const PATIENCE: Duration = Duration::from_secs(60);

pub fn run(args: &DoctorArgs) -> anyhow::Result<()> {
    if args.self_test {
        let options = GpuOptions { device: args.device.as_deref(), ..GpuOptions::default() };
        self_test::run(&options)?;
        return Ok(());
    }
    let diagnosis = diagnose(args);
    if args.json {
        println!("{}", serde_json::to_string_pretty(&diagnosis)?);
    } else {
        print(&diagnosis);
    }
    match diagnosis.healthy {
        true => Ok(()),
        false => Err(Error::NoDevice { searched: driver_folders().join(", ") }.into()),
    }
}

fn diagnose(args: &DoctorArgs) -> Diagnosis {
    let survey = Instance::survey();
    let (loader, layers, devices) = match survey {
        Ok(survey) => (Ok(dotted(survey.loader_api)), survey.layers, survey.devices),
        Err(error) => (Err(error.to_string()), Vec::new(), Vec::new()),
    };
    let self_test = match devices.is_empty() {
        true => "not run: there is no device".to_string(),
        false => run_child(args.device.as_deref()),
    };
    let healthy = devices.iter().any(PhysicalDevice::usable) && self_test == "passed";
    Diagnosis {
        loader,
        layers,
        drivers: driver_folders().into_iter().map(list_folder).collect(),
        devices: devices.iter().map(describe).collect(),
        self_test,
        healthy,
    }
}

fn dotted((major, minor, patch): (u32, u32, u32)) -> String {
    format!("{major}.{minor}.{patch}")
}

fn describe(device: &PhysicalDevice) -> Device {
    Device {
        name: device.name.clone(),
        kind: device.kind,
        driver: device.driver.clone(),
        vulkan: dotted(device.api),
        usable: device.usable(),
        features: Feature::ALL.iter().map(|f| (f.name(), device.features.contains(f))).collect(),
    }
}

/// Names of the manifests in a folder; a file that the environment names stands for itself.
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

/// The self-test's outcome in words.
fn run_child(device: Option<&str>) -> String {
    let program = match std::env::current_exe() {
        Ok(program) => program,
        Err(error) => return format!("not run: own program not found: {error}"),
    };
    let mut command = Command::new(program);
    command.args(["doctor", "--self-test"]).stdout(Stdio::null()).stderr(Stdio::piped());
    if let Some(device) = device {
        command.args(["--device", device]);
    }
    let mut child = match command.spawn() {
        Ok(child) => child,
        Err(error) => return format!("not run: {error}"),
    };
    let start = Instant::now();
    loop {
        match child.try_wait() {
            Ok(Some(status)) if status.success() => return "passed".into(),
            Ok(Some(status)) => {
                let mut words = String::new();
                if let Some(mut stderr) = child.stderr.take() {
                    use std::io::Read;
                    // What cannot be read is only missing from the words.
                    let _ = stderr.read_to_string(&mut words);
                }
                let last = words.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("").to_string();
                // A signal leaves no exit code: the driver crashed.
                return match status.code() {
                    Some(_) => format!("failed: {last}"),
                    None => format!(
                        "the driver crashed ({status}); update it, or choose another --device. {last}"
                    ),
                };
            }
            Ok(None) if start.elapsed() > PATIENCE => {
                let killed = child.kill();
                return format!("the driver hangs (no answer in {} s; kill: {killed:?})", PATIENCE.as_secs());
            }
            Ok(None) => std::thread::sleep(Duration::from_millis(10)),
            Err(error) => return format!("not known: {error}"),
        }
    }
}

fn print(diagnosis: &Diagnosis) {
    match &diagnosis.loader {
        Ok(version) => println!("loader     Vulkan {version}"),
        Err(error) => println!("loader     {error}"),
    }
    println!("layers     {}", diagnosis.layers.join(", "));
    for folder in &diagnosis.drivers {
        let found = if folder.found.is_empty() { "none".into() } else { folder.found.join(", ") };
        println!("drivers    {}: {found}", folder.searched);
    }
    for (index, device) in diagnosis.devices.iter().enumerate() {
        println!(
            "device {index}   {} ({}), {}, Vulkan {}",
            device.name, device.kind, device.driver, device.vulkan
        );
        for (feature, has) in &device.features {
            println!("           {} {feature}", if *has { "yes" } else { "NO " });
        }
        if !device.usable {
            println!("           not usable: Vulkan 1.3 and scalarBlockLayout are needed");
        }
    }
    println!("self-test  {}", diagnosis.self_test);
}
