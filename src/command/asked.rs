//! What a `render` is asked for: a scene and options, or an earlier run with options that override its own.

use super::Usage;
use anyhow::bail;
use clap::Args;
use ortelius::math::camera::Pose;
use ortelius::picture::Target;
use ortelius::renderer::report::RunSection;
use ortelius::renderer::sections;
use ortelius::scene::Scene;
use ortelius::scene::camera::{Camera, Place};
use std::io::Read;
use std::path::Path;

/// Which scene, and where the eye is.
#[derive(Args)]
pub struct SceneArgs {
    /// A scene file, the name of a shipped scene (earth, globe, pole, antimeridian, plane, ruler, bunny, herd, valley), or the
    /// report of an earlier render, which is rendered again; options then override the report's
    pub scene: String,
    /// Pixels, WIDTHxHEIGHT; the scene's own otherwise
    #[arg(long, value_parser = parse_size)]
    size: Option<[u32; 2]>,
    /// One of the scene's cameras
    #[arg(long, conflicts_with = "path")]
    camera: Option<String>,
    /// One of the scene's paths
    #[arg(long)]
    path: Option<String>,
    /// Budgets count tiles and faces instead of time: the same frames on every run
    #[arg(long)]
    deterministic: bool,
    /// Override a key of the scene: -D variant.keying=native
    #[arg(short = 'D', value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    #[command(flatten)]
    eye: EyeArgs,
}

/// A camera of the command line: what it leaves out is that of --camera, or of the scene's view.
#[derive(Args, Clone, Copy, PartialEq)]
pub struct EyeArgs {
    /// Geodetic latitude of the eye in degrees
    #[arg(long, value_name = "DEGREES", conflicts_with = "path", allow_negative_numbers = true)]
    lat: Option<f64>,
    /// Its longitude in degrees
    #[arg(long, value_name = "DEGREES", conflicts_with = "path", allow_negative_numbers = true)]
    lon: Option<f64>,
    /// Its height above the ellipsoid or the plane
    #[arg(long, value_name = "METRES", conflicts_with = "path", allow_negative_numbers = true)]
    alt: Option<f64>,
    /// Clockwise from north: what is up in the picture when the eye looks straight down
    #[arg(long, value_name = "DEGREES", conflicts_with = "path", allow_negative_numbers = true)]
    heading: Option<f64>,
    /// 0 looks straight down, 90 to the horizontal
    #[arg(long, value_name = "DEGREES", conflicts_with = "path", allow_negative_numbers = true)]
    tilt: Option<f64>,
}

/// A scene, and which frames of it.
#[derive(Args)]
pub struct RunArgs {
    #[command(flatten)]
    pub of: SceneArgs,
    /// Render so many frames; without it: until nothing is missing
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..), allow_negative_numbers = true)]
    frames: Option<u32>,
    /// After --frames, go on from the last pose until nothing is missing
    #[arg(long)]
    settle: bool,
    /// Settle every frame of a sequence before the next: each picture is complete
    #[arg(long)]
    settle_each: bool,
}

pub(super) fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let parsed = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    match parsed {
        Some(size @ [1..=16384, 1..=16384]) => Ok(size),
        _ => Err("a size is WIDTHxHEIGHT in pixels, 1 to 16384 each, as in 1920x1080".into()),
    }
}

/// A scene, and what is rendered of it.
pub struct Asked {
    pub scene: Scene,
    pub run: RunSection,
}

impl Asked {
    /// `target`: what the picture's file keeps, where one is written.
    ///
    /// # Errors
    /// The scene's or the report's, and a camera or path that the scene does not have.
    pub fn of(args: &RunArgs, target: Option<Target>) -> anyhow::Result<Asked> {
        let Asked { scene, run } = Asked::of_scene(&args.of)?;
        let run = RunSection {
            frames: args.frames.or(run.frames),
            settle: args.settle || run.settle,
            settle_each: args.settle_each || run.settle_each,
            linear: target.map_or(run.linear, |target| target == Target::Linear32),
            ..run
        };
        Ok(Asked { scene, run })
    }

    /// A scene and its eye alone; frames are those of an earlier run.
    ///
    /// # Errors
    /// As [`Asked::of`].
    pub fn of_scene(args: &SceneArgs) -> anyhow::Result<Asked> {
        let (scene, earlier) = match is_report(&args.scene) {
            true => earlier(args)?,
            false => {
                let scene = sections::load(&args.scene, &args.overrides)?;
                let run = RunSection::settled(&scene);
                (scene, run)
            }
        };
        let (camera, path) = match (&args.camera, &args.path) {
            (None, None) => (earlier.camera.clone(), earlier.path.clone()),
            given => (given.0.clone(), given.1.clone()),
        };
        let run = RunSection {
            camera,
            path,
            deterministic: args.deterministic || earlier.deterministic,
            size: args.size.unwrap_or(earlier.size),
            ..earlier
        };
        args.eye.placed(Asked { scene, run })
    }

    /// The camera that the first frame sees through.
    ///
    /// # Errors
    /// A name that the scene does not have.
    pub fn camera(&self) -> anyhow::Result<Camera> {
        let name = self.run.camera.as_ref().unwrap_or(&self.scene.view.camera);
        Ok(*self.scene.camera(name)?)
    }

    /// Whether the run ends with frames until nothing is missing.
    pub fn settles(&self) -> bool {
        self.run.settle || self.run.frames.is_none()
    }

    /// What the picture is kept in.
    pub fn target(&self) -> Target {
        if self.run.linear { Target::Linear32 } else { Target::Srgb8 }
    }

    /// The name of the camera or path.
    pub fn eye(&self) -> &str {
        self.run.path.as_deref().or(self.run.camera.as_deref()).unwrap_or_default()
    }

    /// The run's poses in order.
    ///
    /// # Errors
    /// A name that the scene does not have.
    pub fn poses(&self) -> anyhow::Result<Vec<Pose>> {
        if self.run.path.is_some() {
            let path = self.scene.path(self.eye())?;
            let frames = self.run.frames.unwrap_or(path.frames);
            return Ok((0..frames).map(|frame| path.pose(frame)).collect());
        }
        let pose = self.scene.camera(self.eye())?.pose();
        Ok(vec![pose; self.run.frames.unwrap_or(1) as usize])
    }
}

impl EyeArgs {
    /// The name that a camera of the command line has in the scene.
    const NAME: &str = "asked";

    /// What is asked for, seen from here where the command line says so.
    fn placed(&self, asked: Asked) -> anyhow::Result<Asked> {
        let EyeArgs { lat, lon, alt, heading, tilt } = *self;
        if [lat, lon, alt, heading, tilt].iter().all(Option::is_none) {
            return Ok(asked);
        }
        let like = asked.camera()?;
        let place = match like.place {
            Place::Planet { latitude_deg, longitude_deg } => Place::Planet {
                latitude_deg: lat.unwrap_or(latitude_deg),
                longitude_deg: lon.unwrap_or(longitude_deg),
            },
            Place::Plane { .. } if lat.is_some() || lon.is_some() => {
                let (scene, name) = (&asked.scene.name, &asked.scene.view.camera);
                bail!(Usage(format!(
                    "--lat, --lon: scene {scene} lies on a plane; set -D cameras.{name}.east_m and north_m"
                )));
            }
            plane => plane,
        };
        let camera = Camera {
            place,
            altitude_m: alt.unwrap_or(like.altitude_m),
            heading_deg: heading.unwrap_or(like.heading_deg),
            tilt_deg: tilt.unwrap_or(like.tilt_deg),
            ..like
        };
        let changes = [camera.to_change(EyeArgs::NAME), format!("view.camera={}", EyeArgs::NAME)];
        let scene = asked.scene.with(&changes)?;
        let RunSection { name, folder, scene: text, .. } = RunSection::settled(&scene);
        let camera = Some(EyeArgs::NAME.to_owned());
        Ok(Asked { scene, run: RunSection { name, folder, scene: text, camera, path: None, ..asked.run } })
    }
}

/// By the name's ending, or by a first byte with which no scene begins.
fn is_report(scene: &str) -> bool {
    let begins_so = || {
        let mut first = [0];
        let read = ortelius::file::open(Path::new(scene)).and_then(|mut file| file.read_exact(&mut first));
        read.is_ok() && first == *b"{"
    };
    Path::new(scene).extension().is_some_and(|ending| ending == "json") || begins_so()
}

/// The scene and the run of a report, with the changes of this command line.
fn earlier(args: &SceneArgs) -> anyhow::Result<(Scene, RunSection)> {
    let run = RunSection::read(Path::new(&args.scene))?;
    let scene = run.scene(&args.scene)?.with(&args.overrides)?;
    sections::check(&scene)?;
    let mut now = RunSection::settled(&scene);
    // What -D changes of the view counts more than what the earlier run took from it.
    let changed = |keys: [&str; 2]| keys.iter().any(|key| scene.changed(&["view", key]));
    if !changed(["camera", "path"]) {
        (now.camera, now.path) = (run.camera, run.path);
    }
    if !changed(["width", "height"]) {
        now.size = run.size;
    }
    let RunSection { frames, settle, settle_each, deterministic, linear, .. } = run;
    Ok((scene, RunSection { frames, settle, settle_each, deterministic, linear, ..now }))
}
