//! Compares pictures, tile lists and index buffers of all shipped scenes and variants with recorded hashes.
//!
//! They must be bit-identical from commit to commit. After an intended change,
//! `ORTELIUS_GOLDEN=write cargo test --release --test golden` records them again. Without that variable nothing is
//! written, and a missing record fails the test. On a driver other than the recorded one only index buffers are
//! compared. A picture that is recorded only on other processors is not compared.

mod api;
mod cases;
mod store;

use cases::{Case, Paper};
use ortelius::scene::SHIPPED;
use std::sync::Mutex;
use store::{Entry, Hash, Recorded};

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/hashes.txt");

/// The cases of every paper.
fn all() -> impl Iterator<Item = Case> {
    [cases::progressive_mesh(), cases::virtual_texture(), cases::shipped()].into_iter().flatten()
}

/// Batches of cases. A batch runs on one thread, because its cases share orders or tiles that take long to make.
fn batches() -> Vec<Vec<Case>> {
    let mut batches: Vec<Vec<Case>> = Vec::new();
    for case in all() {
        let together = |last: &&mut Vec<Case>| match case.paper {
            Paper::Shipped => false,
            Paper::ProgressiveMesh => last[0].changes.first() == case.changes.first(),
            // At most a quarter of all variants, so that no thread runs a long last batch alone.
            Paper::VirtualTexture => last[0].scene == case.scene && last.len() < 32,
        };
        match batches.last_mut().filter(together) {
            Some(last) => last.push(case),
            None => batches.push(vec![case]),
        }
    }
    batches
}

/// Renders all cases on two threads, each with its own device, because small pictures do not occupy lavapipe's threads.
fn render() -> Recorded {
    let work = Mutex::new(batches().into_iter());
    let next = || work.lock().unwrap().next();
    let worker = || {
        let gpu = api::device();
        let mut entries: Vec<Entry> = Vec::new();
        while let Some(batch) = next() {
            let mut shared = api::Shared::default();
            for case in &batch {
                entries.extend(match case.paper {
                    Paper::VirtualTexture => api::virtual_texture(&gpu, &mut shared, case),
                    Paper::ProgressiveMesh => api::progressive_mesh(&gpu, &mut shared, case),
                    Paper::Shipped => api::shipped(&gpu, case),
                });
            }
        }
        (api::driver(&gpu), entries)
    };
    let (driver, entries) = std::thread::scope(|scope| {
        let other = scope.spawn(worker);
        let (driver, mut entries) = worker();
        entries.extend(other.join().expect("the other thread's panic has been printed").1);
        (driver, entries)
    });
    Recorded { driver, hashes: store::collect(&entries) }
}

#[test]
fn pictures_tile_lists_and_index_buffers_are_those_recorded() {
    let (found, picture) = (render(), store::picture_here());
    if std::env::var("ORTELIUS_GOLDEN").is_ok_and(|mode| mode == "write") {
        let recorded = std::fs::read_to_string(FILE).map(|text| store::read(&text));
        let all = recorded.map_or_else(|_| found.clone(), |old| store::merged(&old, &found, &picture));
        std::fs::write(FILE, store::write(&all)).unwrap();
        println!("{} hashes written to {FILE}", found.hashes.len());
        return;
    }
    let text = std::fs::read_to_string(FILE)
        .unwrap_or_else(|error| panic!("{FILE}: {error}; ORTELIUS_GOLDEN=write records it"));
    let recorded = store::read(&text);
    match recorded.driver == found.driver {
        true => {
            let pictures = recorded.hashes.keys().filter(|(_, what)| *what == picture).count();
            println!("compared {pictures} pictures, and all tile lists and index buffers ({picture})");
        }
        false => {
            let faces = found.hashes.keys().filter(|(_, what)| what == "faces").count();
            println!(
                "compared {faces} index buffers alone: this is {:?}, and {:?} was recorded",
                found.driver, recorded.driver
            );
        }
    }
    let differences = store::differences(&recorded, &found, &picture);
    let first = differences.iter().take(40).map(String::as_str).collect::<Vec<_>>().join("\n");
    assert!(differences.is_empty(), "{} of {} hashes:\n{first}", differences.len(), found.hashes.len());
}

/// The shipped scenes without a case among `cases`.
fn missing(cases: &[Case]) -> Vec<&'static str> {
    let has_case = |name: &str| cases.iter().any(|case| case.scene == name);
    SHIPPED.map(|(name, _)| name).into_iter().filter(|name| !has_case(name)).collect()
}

#[test]
fn every_shipped_scene_has_a_case() {
    assert_eq!(missing(&all().collect::<Vec<_>>()), [""; 0]);
    assert_eq!(missing(&cases::progressive_mesh()).len(), SHIPPED.len() - 2);
}

fn recorded(driver: &str, hashes: &[(&str, &str, &[u8])]) -> Recorded {
    let entries: Vec<Entry> = hashes
        .iter()
        .map(|&(name, what, bytes)| Entry {
            name: name.to_owned(),
            hashes: vec![(what.to_owned(), Hash::of_bytes(bytes))],
        })
        .collect();
    Recorded { driver: driver.to_owned(), hashes: store::collect(&entries) }
}

#[test]
fn what_differs_is_missing_or_is_new_is_rejected() {
    let old =
        recorded("a, 1", &[("bunny/near/paper", "picture@A", b"1"), ("bunny/near/paper", "faces", b"2")]);
    assert_eq!(store::read(&store::write(&old)), old);
    assert!(store::differences(&old, &old, "picture@A").is_empty());
    let rejected =
        |hashes: &[_], driver| store::differences(&old, &recorded(driver, hashes), "picture@A").len();
    let (picture, faces) =
        (("bunny/near/paper", "picture@A", b"1" as &[u8]), ("bunny/near/paper", "faces", b"2" as &[u8]));
    let (other_picture, other_faces) =
        ((picture.0, picture.1, b"3" as &[u8]), (faces.0, faces.1, b"3" as &[u8]));
    assert_eq!(rejected(&[other_picture, faces], "a, 1"), 1);
    assert_eq!(rejected(&[faces], "a, 1"), 1);
    assert_eq!(rejected(&[picture, faces, ("bunny/far/paper", "picture@A", b"1")], "a, 1"), 1);
    // On another driver the picture may differ, but not the index buffer. Nothing may be missing.
    assert_eq!(rejected(&[other_picture, faces], "a, 2"), 0);
    assert_eq!(rejected(&[picture, other_faces], "a, 2"), 1);
    assert_eq!(rejected(&[picture], "a, 2"), 1);
}

#[test]
fn a_processor_has_pictures_of_its_own() {
    let entry = |processor, bytes| {
        [("bunny/near/paper", processor, bytes), ("bunny/near/paper", "faces", b"2" as &[u8])]
    };
    let (a, b) = ("picture@A", "picture@B");
    let old = recorded("a, 1", &entry(a, b"1"));
    // Nothing is recorded for B yet, so only its index buffers are compared.
    let on_b = recorded("a, 1", &entry(b, b"7"));
    assert!(store::differences(&old, &on_b, b).is_empty());
    assert_eq!(
        store::differences(&old, &recorded("a, 1", &[("bunny/near/paper", "faces", b"3")]), b).len(),
        1
    );
    let both = store::merged(&old, &on_b, b);
    assert_eq!(both.hashes.len(), 3);
    assert_eq!(store::differences(&both, &recorded("a, 1", &entry(b, b"8")), b).len(), 1);
    // A's new case `far` is not recorded for B, and is no difference on B. A case recorded for neither is a difference.
    let far = ("bunny/far/paper", b as &str, b"5" as &[u8]);
    let with_far = store::merged(
        &both,
        &recorded("a, 1", &[&entry(a, b"1")[..], &[("bunny/far/paper", a, b"4")]].concat()),
        a,
    );
    let here = recorded("a, 1", &[&entry(b, b"7")[..], &[far]].concat());
    assert!(store::differences(&with_far, &here, b).is_empty());
    assert_eq!(store::differences(&both, &here, b).len(), 1);
    // A's picture stays recorded if B's did not change, and is dropped if B's changed.
    assert_eq!(store::merged(&both, &on_b, b), both);
    assert_eq!(store::merged(&both, &recorded("a, 1", &entry(b, b"8")), b).hashes.len(), 2);
    // A's picture is dropped, too, if the index buffer changed and B had no picture.
    let other_faces = [("bunny/near/paper", b, b"7" as &[u8]), ("bunny/near/paper", "faces", b"3")];
    let merged = store::merged(&old, &recorded("a, 1", &other_faces), b);
    assert_eq!(merged, recorded("a, 1", &other_faces));
}
