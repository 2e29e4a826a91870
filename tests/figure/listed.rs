//! Rules for the real figures, and selection by name.

use super::family::{BARS, FAILS, SWEPT};
use ortelius::figure::claim::{At, Bound, Claim, Origin, Pick, Statistic, Test, VariantPick, one};
use ortelius::figure::{Effort, Family, Figure, FigureView, Setting, Show, Views, choose};
use ortelius::paper::virtual_texture::extremes::EXTREMES;
use ortelius::renderer::figures::{FAMILIES, shown};
use ortelius::renderer::sections;
use ortelius::scene::Scene;
use std::collections::BTreeSet;

const MADE: [Family; 2] = [("made", &[&SWEPT, &BARS]), ("more", &[&FAILS])];

fn chosen(names: &[&str]) -> Result<Vec<&'static str>, String> {
    let names: Vec<String> = names.iter().map(|name| name.to_string()).collect();
    match choose(&MADE, &names) {
        Ok(figures) => Ok(figures.iter().map(|figure| figure.id).collect()),
        Err(unknown) => Err(unknown.to_string()),
    }
}

#[test]
fn figures_are_chosen_by_id_and_by_family_each_once_in_order() {
    let all = ["made.swept", "made.bars", "made.fails"];
    assert_eq!(chosen(&[]).unwrap(), all);
    assert_eq!(chosen(&["more", "made"]).unwrap(), all);
    assert_eq!(chosen(&["made.bars", "made.swept", "made.bars"]).unwrap(), all[..2]);
    assert_eq!(chosen(&["more", "made.bars"]).unwrap(), all[1..]);
}

#[test]
fn an_unknown_name_is_reported_with_the_nearest_one() {
    let line = chosen(&["made.bars", "made.swetp"]).unwrap_err();
    assert!(line.contains("\"made.swetp\"") && line.contains("nearest is made.swept"), "{line}");
    let line = chosen(&["mad"]).unwrap_err();
    assert!(line.contains("nearest is made;"), "{line}");
}

#[test]
fn every_figure_has_its_own_id_words_claims_and_scenes_that_exist() {
    let mut ids = BTreeSet::new();
    for (family, figures) in FAMILIES {
        for figure in figures {
            let id = figure.id;
            assert!(ids.insert(id), "{id} is twice in the list");
            assert!(id.starts_with(&format!("{family}.")), "{id} is of family {family}");
            assert!(!figure.title.is_empty() && figure.about.len() > 40, "{id}: what does it answer?");
            assert!(!figure.claims.is_empty(), "{id} claims nothing");
            let claims: BTreeSet<_> = figure.claims.iter().map(|claim| claim.id).collect();
            assert_eq!(claims.len(), figure.claims.len(), "{id}: a duplicate claim id");
            assert!(figure.claims.iter().all(|claim| !claim.text.is_empty()), "{id}: a claim without words");
            assert!(!figure.scenes.is_empty(), "{id} looks at nothing");
            for scene in figure.scenes {
                // Names that are not scenes of a file are described in `about`, or are extremes.
                let extreme = EXTREMES.iter().any(|extreme| extreme.name == *scene);
                if !extreme && !figure.about.contains(&format!("`{scene}`")) {
                    exists(id, scene);
                }
            }
            assert!(figure.full_only.iter().all(|scene| figure.scenes.contains(scene)), "{id}: a lost scene");
            assert!(!figure.cells(Effort::Quick).is_empty(), "{id}: a quick run measures nothing");
            let variants = (figure.variants)();
            let distinct: BTreeSet<_> = variants.iter().collect();
            assert!(!variants.is_empty() && distinct.len() == variants.len(), "{id}: {variants:?}");
            for effort in [Effort::Quick, Effort::Full] {
                let cells = figure.cells(effort);
                let names: BTreeSet<_> = cells.iter().map(ToString::to_string).collect();
                assert_eq!(names.len(), cells.len(), "{id}: a duplicate cell");
            }
        }
    }
}

/// The fault of a figure: a view or a variant that does not open, or neither views nor a reason why there are none.
fn not_shown(figure: &Figure) -> Option<String> {
    let fault = |what: String| Some(format!("{}: {what}", figure.id));
    let (views, settings) = (figure.views(), (figure.show.variants)());
    if let Views::Nothing { why, nearest } = figure.show.views {
        let exists = Scene::embedded(nearest).is_ok() && !why.is_empty() && settings.is_empty();
        return if exists { None } else { fault(format!("{nearest:?} for {why:?}")) };
    }
    let names: BTreeSet<&String> = views.iter().map(|view| &view.name).collect();
    if views.is_empty() || names.len() != views.len() {
        return fault(format!("views {names:?}"));
    }
    let variants = (figure.variants)();
    if let Some(unknown) = settings.iter().find(|setting| !variants.contains(&setting.name)) {
        return fault(format!("no variant {}", unknown.name));
    }
    let distinct: BTreeSet<_> = settings.iter().map(|setting| &setting.changes).collect();
    if distinct.len() != settings.len() {
        return fault(format!("two variants are the same settings: {distinct:?}"));
    }
    for view in &views {
        let scene = match shown::scene_of(view) {
            Ok(scene) => scene,
            Err(error) => return fault(format!("{}: {error}", view.name)),
        };
        let has_eye = |eye: &String| scene.camera(eye).is_ok() || scene.path(eye).is_ok();
        if !view.eye.iter().all(has_eye) {
            return fault(format!("{}: no camera or path {:?}", view.name, view.eye));
        }
        for setting in &settings {
            let changed = scene.with(&shown::for_scene(&setting.changes, &scene));
            if let Err(error) = changed.and_then(|changed| sections::check(&changed)) {
                return fault(format!("{}, {}: {error}", view.name, setting.name));
            }
        }
    }
    None
}

#[test]
fn every_figure_shows_its_views_and_variants_or_says_why_it_has_no_picture() {
    for figure in FAMILIES.iter().flat_map(|(_, figures)| *figures) {
        assert_eq!(not_shown(figure), None);
    }
    let variants = || vec![Setting::new("single", ["view.width=64"])];
    const EARTH: Show = Show::views(|| vec![FigureView::new("a", "earth/oblique", [""; 0])]);
    let with = |show: Show| not_shown(&Figure { show, ..SWEPT });
    assert_eq!(with(EARTH.variants(variants)), None);
    assert!(with(Show::views(Vec::new)).unwrap().contains("views {}"));
    assert!(with(EARTH.variants(|| vec![Setting::new("triple", [""; 0])])).unwrap().contains("no variant"));
    let wrong = with(EARTH.variants(|| vec![Setting::new("single", ["surface.NAME.filter.kind=none"])]));
    assert!(wrong.unwrap().contains("a, single: "));
    let nowhere = Show::views(|| vec![FigureView::new("a", "earth/nowhere", [""; 0])]);
    assert!(with(nowhere).unwrap().contains("no camera or path"));
    assert!(with(Show::nothing("it computes", "nowhere")).unwrap().contains("\"nowhere\""));
}

/// The first claim of the paper with a test that looks up none of the paper's variants, or a variant that the figure
/// lacks.
fn not_judged_on_the_paper(figure: &Figure) -> Option<String> {
    let variants = (figure.variants)();
    let highlighted = || figure.paper.iter().chain(figure.ours);
    if let Some(unknown) = highlighted().find(|name| !variants.iter().any(|known| known == *name)) {
        return Some(format!("{}: no variant {unknown}", figure.id));
    }
    let is_the_papers = |pick: &Pick| match pick.who {
        VariantPick::One(name) => figure.paper.contains(&name),
        VariantPick::Best(names) | VariantPick::Each(names) => {
            names().iter().all(|name| figure.paper.contains(&&**name))
        }
        VariantPick::Others(but) => figure.paper.iter().any(|name| *name != but),
    };
    let of_the_paper = figure.claims.iter().filter(|claim| claim.from != Origin::Ours);
    let elsewhere =
        |claim: &&Claim| !claim.tests.iter().all(|test| test.term.picks().iter().any(is_the_papers));
    of_the_paper.into_iter().find(elsewhere).map(|claim| format!("{} {}", figure.id, claim.id))
}

#[test]
fn claims_of_a_paper_are_judged_on_the_papers_variants() {
    for figure in FAMILIES.iter().flat_map(|(_, figures)| *figures) {
        assert_eq!(not_judged_on_the_paper(figure), None);
    }
    let with = |paper: &'static [&'static str]| not_judged_on_the_paper(&Figure { paper, ..SWEPT });
    assert_eq!(with(&["single"]), None);
    assert_eq!(with(&[]).unwrap(), "made.swept doubles");
    assert_eq!(with(&["triple"]).unwrap(), "made.swept: no variant triple");
}

/// True if a claim about time takes the least or the largest of its samples. A lucky round would then decide the
/// verdict.
fn selects_without_a_split(claim: &Claim) -> bool {
    let extreme = |pick: &Pick| pick.x == At::Least || pick.part != Statistic::Median;
    claim.timed && claim.tests.iter().chain(claim.given).any(|test| test.term.picks().iter().any(extreme))
}

#[test]
fn no_claim_about_time_selects_a_value_by_the_rounds_that_judge_it() {
    for figure in FAMILIES.iter().flat_map(|(_, figures)| *figures) {
        for claim in figure.claims {
            assert!(!selects_without_a_split(claim), "{} {}", figure.id, claim.id);
        }
    }
    const MIN: &[Test] = &[Test::value(one("time", "a").x(At::Least), Bound::AtMost(1.0))];
    const MAX: &[Test] = &[Test::value(one("time", "a").part(Statistic::Most), Bound::AtMost(1.0))];
    for tests in [MIN, MAX] {
        assert!(selects_without_a_split(&Claim::ours_timed("id", "text", tests)));
        assert!(!selects_without_a_split(&Claim::ours("id", "text", tests)));
    }
}

/// Scenes that figures create: each pixel requests a random tile.
const MADE_BY_FIGURES: [&str; 1] = ["noise"];

/// "SCENE", "SCENE/CAMERA" or "SCENE/PATH" of a shipped scene; an extreme; or a scene that a figure
/// creates.
fn exists(figure: &str, name: &str) {
    let (scene, view) = name.split_once('/').map_or((name, None), |(scene, view)| (scene, Some(view)));
    let extreme = figure == "vt.extremes" && EXTREMES.iter().any(|extreme| extreme.name == name);
    if extreme || MADE_BY_FIGURES.contains(&name) {
        return;
    }
    let scene = Scene::embedded(scene).unwrap_or_else(|error| panic!("{figure}: {name}: {error}"));
    if let Some(view) = view {
        let there = scene.camera(view).is_ok() || scene.path(view).is_ok();
        assert!(there, "{figure}: scene {} has no camera and no path {view:?}", scene.name);
    }
}
