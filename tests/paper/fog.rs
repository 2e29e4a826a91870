use ortelius::figure::claim::{Bound, Claim, Test, one};
use ortelius::figure::{Cell, Figure, Row, Value};
use ortelius::frame::{Allocations, FrameSlot, Progress, Stalled, Target, Technique, View};
use ortelius::scene::{Language, Scene, TableDeclaration, settings};
use ortelius::vk::{Clear, ColorTarget, Error, Frame, Gpu, Need, PassTime};

settings! {
    /// Uniform haze.
    pub struct Fog kind "fog" {
        /// The brightness of the haze.
        density: f64, in 0.0..=1.0;
    }
}

pub const LANGUAGE: Language =
    Language { tables: &[TableDeclaration::of::<Fog>(&["surface", "*", "geometry"])], check: |_| Ok(()) };

impl Fog {
    pub fn of(scene: &Scene) -> Fog {
        scene.read(&["surface", "haze", "geometry"]).unwrap()
    }
}

#[derive(Debug)]
pub struct Lost;
#[rustfmt::skip]
impl From<Error> for Lost { fn from(_: Error) -> Lost { Lost } }
#[rustfmt::skip]
impl From<Stalled> for Lost { fn from(_: Stalled) -> Lost { Lost } }

#[rustfmt::skip]
impl Technique for Fog {
    type Record = ();
    type Error = Lost;
    fn needs(&self) -> Vec<Need> { Vec::new() }
    fn passes(&self) -> Vec<&'static str> { vec!["fog"] }
    fn retire(&mut self, _: &Gpu, _: FrameSlot, _: Vec<PassTime>) -> Result<(), Lost> { Ok(()) }
    fn prepare(&mut self, _: &Gpu, _: &View) -> Result<(), Lost> { Ok(()) }
    fn record(&mut self, frame: &mut Frame<'_>, view: &View, target: &Target) -> Result<(), Lost> {
        let color = ColorTarget { image: &target.color, clear: Clear::Float([self.density as f32; 4]) };
        Ok(frame.pass("fog", |cmd| cmd.render(view.size, &[color], None, |_| Ok(())))?)
    }
    fn resize(&mut self, _: &Gpu, _: &Target) -> Result<(), Lost> { Ok(()) }
    fn progress(&self) -> Progress { Progress::Settled }
    fn memory(&self) -> Allocations { Allocations::new() }
}

pub const FIGURES: &[&Figure] = &[&Figure {
    id: "fog.density",
    title: "Density of the fog",
    about: "The share of light that the fog hides.",
    scenes: &["haze"],
    variants: || vec!["fog".into()],
    measure: |_, _: &Cell| Ok(vec![Row::new("fog", "density", "", Value::Number(0.25))]),
    claims: &[Claim::ours(
        "thin",
        "fog hides less than half",
        &[Test::value(one("density", "fog"), Bound::Below(0.5))],
    )],
    ..Figure::BASE
}];
