//! The work of a `render`: a scene and options, or an earlier run with options that override its own.

use super::Usage;
use super::device::DeviceArgs;
use super::progress::ProgressLine;
use anyhow::bail;
use clap::Args;
use ortelius::figure::FigureView;
use ortelius::file::cache_folder;
use ortelius::math::camera::Pose;
use ortelius::picture::PixelFormat;
use ortelius::renderer::figures::shown;
use ortelius::renderer::report::RunSection;
use ortelius::renderer::{auto, sections};
use ortelius::scene::camera::{Camera, GroundPoint};
use ortelius::scene::{Scene, SceneError};
use std::io::Read;
use std::path::Path;

/// The scene and the camera.
#[derive(Args, Clone)]
pub struct SceneArgs {
    /// A scene file, or a shipped scene: earth, globe, pole, antimeridian, plane, ruler, bunny, herd, valley,
    /// plane-tilt, sphere, tunnel, zone-plate, relief-brick, relief-rock. Or a figure (`ortelius list`): `view` shows
    /// all of its views, other commands show the first view. Or a report: its run is repeated, and options override the
    /// settings of the run
    pub scene: String,
    /// Size of the picture in pixels, as WIDTHxHEIGHT; default: the scene's size
    #[arg(long, value_parser = parse_size)]
    size: Option<[u32; 2]>,
    /// Use this camera of the scene
    #[arg(long, conflicts_with = "path")]
    camera: Option<String>,
    /// Follow this path of the scene
    #[arg(long)]
    path: Option<String>,
    /// Count budgets in tiles and faces instead of time, so that every run renders the same frames
    #[arg(long)]
    deterministic: bool,
    /// Override a key of the scene, for example -D variant.address=own-level
    #[arg(short = 'D', value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    #[command(flatten)]
    eye: EyeArgs,
}

/// A camera on the command line. Missing values come from --camera, or from the scene's view.
#[derive(Args, Clone, Copy, Default, PartialEq)]
pub struct EyeArgs {
    /// Latitude of the camera (geodetic)
    #[arg(long, value_name = "DEGREES", conflicts_with = "path", allow_negative_numbers = true)]
    lat: Option<f64>,
    /// Longitude of the camera (geodetic)
    #[arg(long, value_name = "DEGREES", conflicts_with = "path", allow_negative_numbers = true)]
    lon: Option<f64>,
    /// Height of the camera above the ellipsoid or the plane
    #[arg(long, value_name = "METRES", conflicts_with = "path", allow_negative_numbers = true)]
    alt: Option<f64>,
    /// Heading of the camera, clockwise from north. If the camera looks straight down: the direction that is up in the
    /// picture
    #[arg(long, value_name = "DEGREES", conflicts_with = "path", allow_negative_numbers = true)]
    heading: Option<f64>,
    /// Tilt of the camera: 0 is straight down, 90 horizontal
    #[arg(long, value_name = "DEGREES", conflicts_with = "path", allow_negative_numbers = true)]
    tilt: Option<f64>,
}

/// A scene and the frames to render.
#[derive(Args)]
pub struct RunArgs {
    #[command(flatten)]
    pub of: SceneArgs,
    /// Render this many frames. Default: the frames of the path, if there is one; then until no tile is missing
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..), allow_negative_numbers = true)]
    frames: Option<u32>,
    /// After --frames, continue at the last pose until no tile is missing
    #[arg(long)]
    settle: bool,
    /// Render each frame of a path until no tile is missing, before the next frame begins
    #[arg(long)]
    settle_each: bool,
}

pub(super) fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let parsed = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    match parsed {
        Some(size @ [1..=16384, 1..=16384]) => Ok(size),
        _ => Err("expected WIDTHxHEIGHT in pixels, 1 to 16384 each, for example 1920x1080".into()),
    }
}

/// A scene and its render settings.
pub struct RunRequest {
    pub scene: Scene,
    pub run: RunSection,
}

impl SceneArgs {
    /// What to add to a command without outputs.
    ///
    /// # Errors
    /// Errors of the scene. Without this check, the user would see them only after adding an output.
    pub(super) fn nothing_to_write(&self) -> anyhow::Result<String> {
        let args = self.of_figure()?;
        let name = match is_report(&args.scene) {
            true => earlier(&args)?.0.name,
            false => sections::load(&args.scene, &args.overrides)?.name,
        };
        Ok(format!("nothing to write: add -o {name}.png, --report, a dump, or --explain"))
    }

    /// If a figure is named: its views, each as a shipped scene with the view's changes and its camera or path. The
    /// camera of the command line applies to the first view only.
    ///
    /// # Errors
    /// The figure has no picture.
    pub(super) fn views(&self) -> anyhow::Result<Vec<(String, SceneArgs)>> {
        let Some(figure) = shown::find(&self.scene) else { return Ok(Vec::new()) };
        if let Some(words) = figure.without_picture() {
            bail!(Usage(words));
        }
        let others = SceneArgs { camera: None, path: None, eye: EyeArgs::default(), ..self.clone() };
        let of = |(n, view): (usize, FigureView)| {
            let args = if n == 0 { self } else { &others };
            Ok((view.name.clone(), args.of_view(&view)?))
        };
        figure.views().into_iter().enumerate().map(of).collect()
    }

    /// If a figure is named: its first view.
    fn of_figure(&self) -> anyhow::Result<SceneArgs> {
        let first = self.views()?.into_iter().next();
        Ok(first.map_or_else(|| self.clone(), |(_, view)| view))
    }

    fn of_view(&self, view: &FigureView) -> anyhow::Result<SceneArgs> {
        let scene = Scene::embedded(&view.scene)?;
        let own = |is_path| view.eye.clone().filter(|eye| scene.paths.contains_key(eye) == is_path);
        let [camera, path] = match (&self.camera, &self.path) {
            (None, None) => [false, true].map(own),
            (camera, path) => [camera.clone(), path.clone()],
        };
        let changes = shown::for_scene(&view.changes, &scene);
        let overrides = changes.iter().chain(&self.overrides).cloned().collect();
        Ok(SceneArgs { scene: view.scene.clone(), camera, path, overrides, ..self.clone() })
    }
}

impl RunRequest {
    /// `target`: the format of the picture, if one is written.
    ///
    /// # Errors
    /// Errors of the scene or the report, and a camera or path that the scene does not have.
    pub fn of(
        args: &RunArgs,
        device: &DeviceArgs,
        target: Option<PixelFormat>,
    ) -> anyhow::Result<RunRequest> {
        let RunRequest { scene, run } = RunRequest::of_scene(&args.of, device)?;
        let run = RunSection {
            frames: args.frames.or(run.frames),
            settle: args.settle || run.settle,
            settle_each: args.settle_each || run.settle_each,
            linear: target.map_or(run.linear, |target| target == PixelFormat::Linear32),
            ..run
        };
        Ok(RunRequest { scene, run })
    }

    /// A request without options for frames. If the scene is a report, the frames are the frames of the report's run.
    ///
    /// # Errors
    /// As [`RunRequest::of`].
    pub fn of_scene(args: &SceneArgs, device: &DeviceArgs) -> anyhow::Result<RunRequest> {
        let args = &args.of_figure()?;
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
        args.eye.placed(RunRequest { scene, run })?.filtered(device)
    }

    /// Chooses the filter of a surface whose filter is "auto", for the first frame's pose.
    fn filtered(self, device: &DeviceArgs) -> anyhow::Result<RunRequest> {
        let Some(wanted) = auto::wanted(&self.scene) else { return Ok(self) };
        let place = auto::Place {
            pose: *self.poses()?.first().expect("there is at least one pose"),
            size: self.run.size,
            device: device.device.as_deref(),
            cache: cache_folder("fronts"),
        };
        let bar = ProgressLine::counting("filters");
        let auto::Chosen { scene, words } =
            auto::choose(&self.scene, wanted, &place, |done, all| bar.set(done, all))?;
        drop(bar);
        tracing::info!("{words}");
        let RunSection { name, folder, scene: text, .. } = RunSection::settled(&scene);
        Ok(RunRequest { scene, run: RunSection { name, folder, scene: text, ..self.run } })
    }

    /// The camera of the first frame.
    ///
    /// # Errors
    /// A camera that the scene does not have.
    pub fn camera(&self) -> anyhow::Result<Camera> {
        let name = self.run.camera.as_ref().unwrap_or(&self.scene.view.camera);
        Ok(*self.scene.camera(name)?)
    }

    /// True if the run ends by rendering frames until nothing is missing.
    pub fn settles(&self) -> bool {
        self.run.settle || self.run.frames.is_none()
    }

    /// The format of the picture.
    pub fn target(&self) -> PixelFormat {
        if self.run.linear { PixelFormat::Linear32 } else { PixelFormat::Srgb8 }
    }

    /// The name of the camera or path.
    pub fn eye(&self) -> &str {
        self.run.path.as_deref().or(self.run.camera.as_deref()).unwrap_or_default()
    }

    /// The run's poses in order.
    ///
    /// # Errors
    /// A camera or path that the scene does not have.
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
    /// Name of the command line's camera in the scene.
    const NAME: &str = "asked";

    /// Applies the command line's camera, if there is one.
    fn placed(&self, request: RunRequest) -> anyhow::Result<RunRequest> {
        let EyeArgs { lat, lon, alt, heading, tilt } = *self;
        if [lat, lon, alt, heading, tilt].iter().all(Option::is_none) {
            return Ok(request);
        }
        let like = request.camera()?;
        let place = match like.place {
            GroundPoint::Planet { latitude_deg, longitude_deg } => GroundPoint::Planet {
                latitude_deg: lat.unwrap_or(latitude_deg),
                longitude_deg: lon.unwrap_or(longitude_deg),
            },
            GroundPoint::Plane { .. } if lat.is_some() || lon.is_some() => {
                let (scene, name) = (&request.scene.name, &request.scene.view.camera);
                bail!(Usage(format!(
                    "--lat, --lon: the ground of scene {scene} is a plane; set -D cameras.{name}.east_m and north_m"
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
        let scene = request.scene.with(&changes).map_err(EyeArgs::named)?;
        let RunSection { name, folder, scene: text, .. } = RunSection::settled(&scene);
        let camera = Some(EyeArgs::NAME.to_owned());
        Ok(RunRequest {
            scene,
            run: RunSection { name, folder, scene: text, camera, path: None, ..request.run },
        })
    }

    /// Rewords an error of the command line's camera: it names the options instead of the scene's keys.
    fn named(error: SceneError) -> anyhow::Error {
        let options = [
            ("latitude_deg", "--lat"),
            ("longitude_deg", "--lon"),
            ("altitude_m", "--alt"),
            ("heading_deg", "--heading"),
            ("tilt_deg", "--tilt"),
        ];
        let SceneError::Override { what, .. } = &error else { return error.into() };
        let of = |(key, option): (&str, &str)| {
            let what = what.strip_prefix(&format!("cameras.{}.{key}: ", EyeArgs::NAME))?;
            Some(Usage(format!("{option}: {what}")))
        };
        options.into_iter().find_map(of).map_or_else(|| error.into(), Into::into)
    }
}

/// True for a report: a file name that ends in `.json`, or a first byte of `{`, with which no scene starts.
fn is_report(scene: &str) -> bool {
    let begins_so = || {
        let mut first = [0];
        let read = ortelius::file::open(Path::new(scene)).and_then(|mut file| file.read_exact(&mut first));
        read.is_ok() && first == *b"{"
    };
    Path::new(scene).extension().is_some_and(|ending| ending == "json") || begins_so()
}

/// The scene and the run of a report, with the overrides of this command line.
fn earlier(args: &SceneArgs) -> anyhow::Result<(Scene, RunSection)> {
    let run = RunSection::read(Path::new(&args.scene))?;
    let scene = run.scene(&args.scene)?.with(&args.overrides)?;
    sections::check(&scene)?;
    let mut now = RunSection::settled(&scene);
    // Overrides of the view take precedence over the earlier run.
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
