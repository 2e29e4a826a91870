//! 10 000 damaged files: an error in one line or a clean model, never a panic; of each fifth model also a mesh at every
//! level.

use super::glb::cube_glb;
use super::pipeline::goes_all_the_way;
use super::*;
use ortelius::model::{Raw, clean};

/// xorshift64*: the same files everywhere.
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33) as usize % end
    }
}

/// What is put in place of a number.
const WORDS: [&str; 12] = [
    "-1",
    "0",
    "3",
    "255",
    "4294967295",
    "4294967296",
    "1e308",
    "-0",
    "nan",
    "inf",
    "1.5",
    "99999999999999999999",
];

/// Does one of six kinds of damage at a random place.
fn damage(file: &mut Vec<u8>, random: &mut Random) {
    let at = random.below(file.len());
    let end = (at + 1 + random.below(16)).min(file.len());
    match random.below(6) {
        0 => file[at] ^= 1 << random.below(8),
        1 => file[at] = random.below(256) as u8,
        2 => file.truncate(at + 1),
        3 => drop(file.drain(at..end)),
        4 => {
            let again = file[at..end].to_vec();
            file.splice(at..at, again);
        }
        _ => {
            // The number at or behind the place, or its four bytes.
            let is_digit = |byte: &u8| byte.is_ascii_digit();
            let word = WORDS[random.below(WORDS.len())];
            match file[at..end].iter().position(is_digit) {
                Some(from) => {
                    let from = at + from;
                    let length = file[from..].iter().position(|byte| !is_digit(byte)).unwrap_or(1);
                    file.splice(from..from + length.max(1), word.bytes());
                }
                None => {
                    let value =
                        [0, 1, 0x7fff_ffff, u32::MAX, f32::NAN.to_bits(), 1e38f32.to_bits()][random.below(6)];
                    let end = (at + 4).min(file.len());
                    file.splice(at..end, value.to_le_bytes());
                }
            }
        }
    }
    if file.is_empty() {
        file.push(b'\n');
    }
}

fn survives(name: &str, original: &[u8], seed: u64) {
    let mut random = Random(seed);
    let (mut models, mut errors, mut levels) = (0, 0, 0);
    for round in 0..2000 {
        let mut file = original.to_vec();
        for _ in 0..=random.below(2) {
            damage(&mut file, &mut random);
        }
        match Model::from_bytes(Path::new(name), &file) {
            Ok((model, report)) => {
                models += 1;
                assert_eq!(report.faces, model.faces.len());
                model.check().unwrap_or_else(|broken| panic!("{name}, round {round}: {broken}"));
                if models % 5 == 0 {
                    levels += goes_all_the_way(&model, &|| format!("{name}, round {round}"));
                }
            }
            Err(error) => {
                errors += 1;
                let error = error.to_string();
                assert!(error.starts_with(name) && error.lines().count() == 1, "{round}: {error}");
            }
        }
    }
    // Damage that is always refused at once would test nothing behind the first check.
    assert!(models >= 60 && errors >= 200, "{name}: {models} models, {errors} errors");
    assert!(levels >= 3 * models / 5, "{name}: {levels} levels of {models} models");
    assert!(!is_limited() || Vec::<u8>::new().try_reserve_exact(MOST_KIB << 10).is_err(), "no limit");
}

/// Address space of a test process that reads damaged files: the program, two stacks, two arenas of the allocator, and
/// less than what one wrong length would reserve.
const MOST_KIB: usize = 512 << 10;
const LIMITED: &str = "ORTELIUS_TEST_LIMITED";

fn is_limited() -> bool {
    std::env::var_os(LIMITED).is_some()
}

/// The two tests below once more, in a process that gets no more memory.
#[test]
#[cfg(unix)]
fn damaged_files_take_bounded_memory() {
    let script = format!("ulimit -v {MOST_KIB} && exec \"$0\" \"$@\"");
    let mut command = std::process::Command::new("sh");
    command.args(["-c", &script]).arg(std::env::current_exe().unwrap());
    command
        .args(["model::mutated::damaged", "--skip", "bounded_memory", "--test-threads=1"])
        .env(LIMITED, "1");
    let ran = command.output().unwrap();
    let said = String::from_utf8_lossy(&ran.stdout);
    assert!(
        ran.status.success() && said.contains("2 passed"),
        "{said}{}",
        String::from_utf8_lossy(&ran.stderr)
    );
}

#[test]
fn damaged_text_is_an_error_or_a_clean_model() {
    survives("a.obj", CUBE.as_bytes(), 1);
    let mut ascii =
        b"ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n\
                      element face 12\nproperty list uchar int vertex_indices\nend_header\n"
            .to_vec();
    let cube = cube();
    cube.positions.iter().for_each(|p| ascii.extend(format!("{} {} {}\n", p.x, p.y, p.z).bytes()));
    for face in 0..12 {
        let [a, b, c] = cube.face_positions(face);
        ascii.extend(format!("3 {a} {b} {c}\n").bytes());
    }
    survives("ascii.ply", &ascii, 2);
}

#[test]
fn damaged_bytes_are_an_error_or_a_clean_model() {
    let binary = written(&cube(), Format::Ply);
    survives("little.ply", &binary, 3);
    survives("big.ply", &big_endian(&binary), 4);
    survives("a.glb", &cube_glb(r#"{"children":[1],"translation":[10,0,0]},{"mesh":0,"scale":[-2,1,1]}"#), 5);
}

/// Faces at random over few places: hardly an edge has two faces, hardly a position one fan.
#[test]
fn a_model_can_be_made_of_any_soup_of_faces() {
    let mut random = Random(6);
    let mut counts = [0; 5];
    for round in 0..3000 {
        let mut soup = Raw::default();
        let vertices = 3 + random.below(12);
        for _ in 0..vertices {
            let place = std::array::from_fn(|_| random.below(3) as f64);
            soup.positions.push(glam::DVec3::from_array(place));
            soup.attributes.coordinates.push([random.below(2) as f32, 0.0]);
        }
        for _ in 0..random.below(40) {
            soup.faces.push(std::array::from_fn(|_| random.below(vertices) as u32));
        }
        let (model, report) = clean(&soup);
        model.check().unwrap_or_else(|broken| panic!("round {round}: {broken}"));
        for (count, there) in counts.iter_mut().zip([
            report.reversed_faces,
            report.folded_faces,
            report.turned_faces,
            report.non_manifold_edges,
            report.topology.seam_edges,
        ]) {
            *count += usize::from(there > 0);
        }
        // What is clean stays as it is, also where several of its positions are at one place.
        let places = model.wedge_positions.iter().map(|&position| model.positions[position as usize]);
        let again = Raw {
            positions: places.collect(),
            attributes: model.attributes.clone(),
            faces: model.faces.clone(),
        };
        assert!(clean(&again).0 == model, "round {round}");
    }
    // Each of them happens.
    assert!(counts.iter().all(|count| *count > 100), "{counts:?}");
}

/// The cube's binary PLY (24 vertices of 8 floats, 12 faces of a byte and 3 ints) in the other order.
fn big_endian(little: &[u8]) -> Vec<u8> {
    let body = little.len() - 24 * 32 - 12 * 13;
    let header = String::from_utf8(little[..body].to_vec()).unwrap();
    let mut big = header.replace("little", "big").into_bytes();
    let (vertices, faces) = little[body..].split_at(24 * 32);
    vertices.chunks(4).for_each(|value| big.extend(value.iter().rev()));
    for face in faces.chunks(13) {
        big.push(face[0]);
        face[1..].chunks(4).for_each(|value| big.extend(value.iter().rev()));
    }
    assert_eq!(read("big.ply", &big), read("little.ply", little));
    big
}
