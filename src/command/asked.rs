//! What a `render` is asked for: a scene and options, or an earlier run with options that override its own.

use clap::Args;
use ortelius::math::camera::Pose;
use ortelius::picture::Target;
use ortelius::renderer::report::RunSection;
use ortelius::renderer::sections;
use ortelius::scene::Scene;
use std::io::Read;
use std::path::Path;

#[derive(Args)]
pub struct RunArgs {
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
    /// Render so many frames; without it: until nothing is missing
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..), allow_negative_numbers = true)]
    frames: Option<u32>,
    /// After --frames, go on from the last pose until nothing is missing
    #[arg(long)]
    settle: bool,
    /// Settle every frame of a sequence before the next: each picture is complete
    #[arg(long)]
    settle_each: bool,
    /// Budgets count tiles and faces instead of time: the same frames on every run
    #[arg(long)]
    deterministic: bool,
    /// Override a key of the scene: -D variant.keying=native
    #[arg(short = 'D', value_name = "KEY=VALUE")]
    overrides: Vec<String>,
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
            frames: args.frames.or(earlier.frames),
            settle: args.settle || earlier.settle,
            settle_each: args.settle_each || earlier.settle_each,
            deterministic: args.deterministic || earlier.deterministic,
            size: args.size.unwrap_or(earlier.size),
            linear: target.map_or(earlier.linear, |target| target == Target::Linear32),
            ..earlier
        };
        Ok(Asked { scene, run })
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
fn earlier(args: &RunArgs) -> anyhow::Result<(Scene, RunSection)> {
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
