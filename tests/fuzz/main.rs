//! Damaged files of every format: a reader must return an error message or valid content, without a panic and in
//! bounded memory.
//!
//! `corpus/KIND/` holds the originals, and inputs that once broke a reader. Each is replayed; then 2,000 damaged copies
//! of each kind (6,000 of PLY) are read, the same in every run. ORTELIUS_FUZZ=N takes N times as many, and
//! ORTELIUS_FUZZ_SEED=N others.

mod damage;
mod kinds;

use damage::{Random, damage};
use kinds::{KINDS, Kind};
use std::path::Path;
use std::process::Command;

/// Address space of a process that reads damaged files: enough for the program, some stacks and two allocator arenas,
/// but less than a single wrong length would reserve.
const MAX_KIB: usize = 512 << 10;
const LIMITED: &str = "ORTELIUS_TEST_LIMITED";

/// Runs a kind's cases in a child process with limited memory; the child calls this function too.
fn cases_of(name: &str) {
    if std::env::var_os(LIMITED).is_some() {
        assert!(Vec::<u8>::new().try_reserve_exact(MAX_KIB << 10).is_err(), "no limit");
        return read_all(KINDS.iter().find(|kind| kind.name == name).expect("a kind"));
    }
    let mut command = Command::new("sh");
    command.args(["-c", &format!("ulimit -v {MAX_KIB} && exec \"$0\" \"$@\"")]);
    command.arg(std::env::current_exe().unwrap()).args(["--exact", name, "--test-threads=1"]);
    // Each thread has its own arena.
    let ran = command.env(LIMITED, "1").env("RAYON_NUM_THREADS", "2").output().unwrap();
    let said = [ran.stdout, ran.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    assert!(ran.status.success() && said.contains("1 passed"), "{said}");
}

/// The random numbers of a kind. Any bit of the seed changes most of them.
fn random_of(name: &str, seed: u64) -> Random {
    let of_name = 1 + name.bytes().map(u64::from).sum::<u64>();
    Random(of_name.wrapping_add(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15)).max(1))
}

#[test]
fn another_seed_gives_other_cases_and_the_same_seed_the_same() {
    let cases = |seed| {
        let mut random = random_of("tiff", seed);
        [(); 16].map(|()| random.below(1 << 20))
    };
    assert_eq!(cases(20_261_123), cases(20_261_123));
    let other: Vec<_> = [0, 1, 20_261_123, 20_261_124].map(cases).into();
    for (n, a) in other.iter().enumerate() {
        let equal = |b: &[usize; 16]| std::iter::zip(a, b).filter(|(a, b)| a == b).count();
        assert!(other[..n].iter().all(|b| equal(b) < 2), "{other:?}");
    }
}

fn read_all(kind: &Kind) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/corpus").join(kind.name);
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let work = tempfile::tempdir().unwrap();
    let seed =
        std::env::var("ORTELIUS_FUZZ_SEED").map_or(0, |seed| seed.parse().expect("ORTELIUS_FUZZ_SEED=N"));
    println!("ORTELIUS_FUZZ_SEED={seed}");
    let mut random = random_of(kind.name, seed);
    let (mut read, mut refused) = (0, 0);
    let mut read_file = |path: &Path, shown: &dyn Fn() -> String| match (kind.read)(path) {
        Ok(()) => read += 1,
        Err(error) => {
            refused += 1;
            // The program escapes control characters; the library's messages keep them.
            assert!(!error.is_empty() && error.len() < 2000, "{}: {error:?}", shown());
        }
    };
    paths.iter().for_each(|path| read_file(path, &|| path.display().to_string()));
    let times = std::env::var("ORTELIUS_FUZZ").map_or(1, |times| times.parse().expect("ORTELIUS_FUZZ=N"));
    let cases = kind.cases * times;
    for case in 0..cases {
        let original = &paths[random.below(paths.len())];
        let mut bytes = std::fs::read(original).unwrap();
        for _ in 0..=random.below(3) {
            damage(&mut bytes, &mut random);
        }
        // Otherwise the checksums would reject most damage before the reader sees it.
        if random.below(8) != 0 {
            (kind.reseal)(&mut bytes);
        }
        let path = work.path().join(original.file_name().unwrap());
        std::fs::write(&path, &bytes).unwrap();
        read_file(&path, &|| format!("case {case}, of {}", original.display()));
    }
    println!("{}: {read} read, {refused} refused", kind.name);
    // A test in which damage is always rejected at once, or never detected, would prove nothing.
    let max = cases + paths.len();
    assert!(read > max / 200 && refused > max / 200, "{}: {read} read, {refused} refused", kind.name);
}

macro_rules! tests {
    ($($name:ident)*) => {
        $(#[test]
        fn $name() {
            cases_of(stringify!($name));
        })*

        #[test]
        fn every_kind_has_a_test() {
            assert_eq!(KINDS.map(|kind| kind.name), [$(stringify!($name)),*]);
        }
    };
}

tests!(scene tiles pmesh ply obj glb tiff png results);
