//! A paper outside the crate: a surface, a setting, a technique, a figure and a claim in fewer than 60 lines, without a
//! change in `scene`, `frame`, `figure` or `vk`.

mod fog;

use ortelius::figure::{Bench, Cell, Effort, Machine, Row, Table, TableRecord, Value, Verdict};
use ortelius::frame::{Run, Target};
use ortelius::renderer::sections::LANGUAGES;
use ortelius::scene::Scene;
use std::path::Path;

const SCENE: &str = "
[surface.haze.geometry]
kind = \"fog\"
density = 0.25

[view]
width = 8
height = 4
camera = \"c\"

[cameras.c]
east_m = 0.0
north_m = 0.0
altitude_m = 1.0
";

fn scene(text: &str) -> Scene {
    Scene::from_text(Path::new("haze.toml"), text.into()).unwrap()
}

#[test]
fn a_paper_in_less_than_sixty_lines_is_a_surface_a_setting_a_figure_and_a_claim() {
    let code = |line: &&str| !line.trim().is_empty() && !line.trim_start().starts_with("//");
    let lines = include_str!("fog.rs").lines().filter(code).count();
    assert!(lines < 60, "{lines} lines");

    let languages = [LANGUAGES, &[&fog::LANGUAGE]].concat();
    scene(SCENE).check(&languages).unwrap();
    // Without the paper's declaration the same scene is rejected. A setting outside its range is rejected.
    assert!(scene(SCENE).check(LANGUAGES).unwrap_err().to_string().contains("fog"));
    let wrong = scene(&SCENE.replace("0.25", "1.25")).check(&languages).unwrap_err().to_string();
    assert!(wrong.contains("haze.toml:4:11") && wrong.contains("0 ..= 1"), "{wrong}");

    let gpu = ortelius::vk::Watched::open(&Default::default());
    let target = Target::new(&gpu, [8, 4], ortelius::picture::PixelFormat::Linear32).unwrap();
    let mut run = Run::new(gpu.clone(), fog::Fog::of(&scene(SCENE)), target);
    run.settle(&scene(SCENE).pose(0).unwrap()).unwrap();
    let picture = run.picture_bytes().unwrap();
    let red: f32 = bytemuck::pod_read_unaligned(&picture[..4]);
    assert_eq!((red, run.records.len()), (0.25, 1));
    // A loop of frames does not keep every record.
    (0..200).for_each(|_| run.frame(&scene(SCENE).pose(0).unwrap()).unwrap());
    run.drain().unwrap();
    assert_eq!(run.records.len(), 120);

    let folder = tempfile::tempdir().unwrap();
    let cell = Cell { scene: "haze".into(), x: None };
    let mut bench = Bench::new(Effort::Quick, None, folder.path().to_owned());
    let rows = (fog::FIGURES[0].measure)(&mut bench, &cell).unwrap();
    let check = |rows: Vec<Row>| {
        let record = |row| TableRecord { scene: "haze".into(), x: None, row };
        let machine = Machine {
            device: "none".into(),
            device_kind: "cpu".into(),
            driver: "none".into(),
            vulkan: "1.3".into(),
            processor: "none".into(),
            cores: 1,
            commit: "none".into(),
            date: "2026-11-22".into(),
        };
        let table = Table { machine, records: rows.into_iter().map(record).collect(), lost: Vec::new() };
        fog::FIGURES[0].claims[0].judge(&table).verdict
    };
    assert_eq!(check(rows), Verdict::Reproduced);
    let thick = Row::new("fog", "density", "", Value::Number(0.75));
    assert_eq!(check(vec![thick]), Verdict::NotReproduced);
}
