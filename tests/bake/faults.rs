//! Kills, full disks, invalid input, limited memory.

use super::pictures::{dotted, write_png, write_tall_tiff, write_tiff_strips, write_tiff_tiles};
use super::*;
use ortelius::texture::bake::{BakeSettings, SourceName};
use ortelius::texture::source::TileFormat;
use ortelius::texture::tiles::TileFile;
use std::process::{Child, Stdio};
use std::time::Duration;

/// Pseudo-random numbers, the same in every run (Marsaglia's xorshift, 64 bits).
struct Random(u64);

impl Random {
    fn below(&mut self, limit: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % limit
    }
}

/// Kills a bake (SIGKILL) when its journal has this length. Returns whether it was still running.
fn kill_at(mut child: Child, journal: &Path, bytes: u64) -> bool {
    while child.try_wait().unwrap().is_none() && length(journal) < bytes {
        std::thread::sleep(Duration::from_micros(100));
    }
    let was_running = child.try_wait().unwrap().is_none();
    // An error means that it has just ended.
    let _ = child.kill();
    child.wait().unwrap();
    was_running
}

fn length(file: &Path) -> u64 {
    fs::metadata(file).map_or(0, |file| file.len())
}

#[test]
fn a_bake_killed_at_20_random_moments_resumes_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("a.png");
    write_png(&source, &dotted(1500, 1000));
    let settings = ["--tile", "64"];
    let expected = baked(&source, &folder.path().join("undisturbed.tiles"), &settings);
    let mut random = Random(0x0123_4567_89AB_CDEF);
    let (mut kills, mut with_work_done, mut bakes) = (0, 0, 0);
    // Each killed bake is restarted and killed again, until one finishes before its kill. Then a new bake
    // begins.
    while kills < 20 {
        let output = folder.path().join(format!("killed{bakes}.tiles"));
        let journal = beside(&output, ".journal");
        while !output.exists() && kills < 20 {
            let mut command = bake_command(&source, &output, &settings);
            // The next kill comes after fewer than 300 more of about 880 journal entries, each of 24 bytes.
            let end = length(&journal) + 24 * random.below(300);
            let child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
            kills += usize::from(kill_at(child, &journal, end));
            with_work_done += usize::from(length(&journal) > 32);
        }
        let finished = if output.exists() && leftovers(&output).is_empty() {
            fs::read(&output).unwrap()
        } else {
            baked(&source, &output, &settings)
        };
        let verified = ortelius().arg("verify").arg(&output).output().unwrap();
        assert!(verified.status.success(), "{}", String::from_utf8_lossy(&verified.stdout));
        assert!(finished == expected, "bake {bakes}");
        bakes += 1;
    }
    println!("{kills} kills, {with_work_done} with work done, of {bakes} bakes");
    assert!(with_work_done >= 5, "only {with_work_done} of {kills} kills came after the first job");
}

#[test]
fn a_full_disk_is_one_line_and_the_same_command_resumes_when_there_is_room() {
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("a.png");
    write_png(&source, &dotted(1500, 1000));
    let settings = ["--tile", "64"];
    let expected = baked(&source, &folder.path().join("undisturbed.tiles"), &settings);
    // A limit on the file size simulates a full disk without root: with SIGXFSZ ignored, write(2) fails with EFBIG
    // instead of ENOSPC. The limits are in units of 512 bytes. Almost nothing fits the first. Most of the scratch file
    // (11 MB) fits the second. Everything except the output (16 MB) fits the third.
    for units in [1, 20_000, 26_000] {
        let output = folder.path().join(format!("full{units}.tiles"));
        let limited = Command::new("sh")
            .arg("-c")
            .arg(format!("ulimit -f {units}; trap '' XFSZ; exec \"$@\""))
            .arg("sh")
            .arg(env!("CARGO_BIN_EXE_ortelius"))
            .arg("bake")
            .arg(&source)
            .arg("-o")
            .arg(&output)
            .args(settings)
            .output()
            .unwrap();
        let (code, line) = failure(&limited);
        assert_eq!(code, 1, "{line}");
        assert!(line.contains("disk full") && line.contains("the bake resumes"), "{line}");
        assert!(line.contains(&format!("full{units}.tiles.")), "{line}");
        assert!(!output.exists());
        assert!(baked(&source, &output, &settings) == expected, "limit {units}");
    }
}

#[test]
fn a_truncated_source_is_one_line_with_its_path_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let picture = dotted(300, 170);
    write_png(&path("whole.png"), &picture);
    write_tiff_tiles(&path("whole.tif"), &picture, true, 64);
    write_tiff_strips(&path("strips.tif"), &picture, tiff::encoder::Compression::Lzw, 16);
    fs::write(path("whole.jpg"), &include_bytes!("../../scenes/bmng.jpg")[..]).unwrap();
    for (name, settings) in [
        ("whole.png", ["--tile", "32"]),
        ("whole.tif", ["--tile", "32"]),
        ("strips.tif", ["--tile", "32"]),
        ("whole.jpg", ["--tile", "512"]),
    ] {
        let whole = fs::read(path(name)).unwrap();
        for length in [whole.len() / 3, whole.len() / 2, whole.len() - 3] {
            let cut = path(&format!("cut-{length}-{name}"));
            fs::write(&cut, &whole[..length]).unwrap();
            let output = path("out.tiles");
            let (code, line) = failure(&bake(&cut, &output, &settings));
            assert_eq!(code, 3, "{name} cut to {length}: {line}");
            assert!(line.contains(&cut.display().to_string()), "{line}");
            assert!(!output.exists() && leftovers(&output).is_empty(), "{name} cut to {length}");
        }
    }
}

#[test]
fn invalid_bakes_are_rejected_in_one_line_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    write_png(&path("good.png"), &dotted(64, 64));
    fs::write(path("text.png"), "no picture").unwrap();
    fs::write(path("empty.png"), "").unwrap();
    let deep = std::io::BufWriter::new(fs::File::create(path("deep.png")).unwrap());
    let mut encoder = png::Encoder::new(deep, 64, 64);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.write_header().unwrap().write_image_data(&[7; 64 * 64 * 6]).unwrap();
    let deep = fs::File::create(path("deep.tif")).unwrap();
    tiff::encoder::TiffEncoder::new(deep)
        .unwrap()
        .write_image::<tiff::encoder::colortype::Gray16>(64, 64, &[300; 64 * 64])
        .unwrap();
    let out = path("out.tiles");
    let tile = ["--tile", "32"];
    let failed = |source: &str, output: &Path, settings: &[&str], expected: (i32, &str)| {
        let (code, line) = failure(&bake(&path(source), output, settings));
        assert!(code == expected.0 && line.contains(expected.1), "{source} {settings:?}: {code}: {line}");
        assert!(!output.is_file() && leftovers(output).is_empty(), "{source} {settings:?}: {line}");
    };
    for (source, output, expected) in [
        ("missing.png", &out, "No such file"),
        ("", &out, "not a regular file"),
        ("text.png", &out, "neither PNG, JPEG nor TIFF"),
        ("empty.png", &out, "neither PNG, JPEG nor TIFF"),
        ("deep.png", &out, "16 bits per sample: magick IN -depth 8 OUT"),
        ("deep.tif", &out, "Gray(16)"),
        ("good.png", &path("no/folder/out.tiles"), "folder does not exist"),
        ("good.png", &path(""), "it is a folder"),
    ] {
        failed(source, output, &tile, (1, expected));
    }
    let outside = "a tile of 2^7 texels a side is outside 2^4 .. 2^6, for a texture of 2^6 x 2^6 texels";
    for (settings, expected) in [
        (&["--tile", "48"][..], "--tile 48: the side of a tile is a power of two"),
        (&["--tile", "128"], outside),
        (&["--tile", "32", "--border", "17"], "a border of 17"),
        (&["--tile", "32", "--border", "2", "--format", "bc1"], "multiple of 4"),
        (&["--tile", "32", "--resident-levels", "2"], "resident levels"),
    ] {
        failed("good.png", &out, settings, (2, expected));
    }
    assert!(!path("no").exists());
    for wrong in ["earth:25", "ruler:"] {
        assert_eq!(failure(&bake(Path::new(wrong), &out, &tile)).0, 2);
    }
    let ruler = bake(Path::new("ruler:6"), &out, &["--tile", "32", "--format", "bc1"]);
    let (code, line) = failure(&ruler);
    assert!(code == 2 && line.contains("hashes"), "{code}: {line}");
}

/// The file appears by rename, which would replace the link or the device.
#[test]
fn a_link_stays_a_link_and_a_device_is_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let forced = |output: &str| bake(&path("a.png"), &path(output), &["--tile", "32", "--force"]);
    write_png(&path("a.png"), &dotted(64, 64));
    fs::write(path("target.tiles"), "precious").unwrap();
    std::os::unix::fs::symlink("target.tiles", path("link.tiles")).unwrap();
    assert!(forced("link.tiles").status.success());
    assert!(path("link.tiles").is_symlink() && TileFile::open(&path("target.tiles")).is_ok());
    std::os::unix::fs::symlink("nowhere.tiles", path("loose.tiles")).unwrap();
    assert!(failure(&forced("loose.tiles")).1.contains("dangling link"));
    // A socket represents all special files: it can be created without privileges.
    let _listens = std::os::unix::net::UnixListener::bind(path("socket.tiles")).unwrap();
    let (_, line) = failure(&forced("socket.tiles"));
    assert!(line.contains("not a regular file") && !path("socket.tiles").is_file(), "{line}");
}

#[test]
fn an_output_is_replaced_only_by_force() {
    let folder = tempfile::tempdir().unwrap();
    let (source, output) = (folder.path().join("a.png"), folder.path().join("a.tiles"));
    write_png(&source, &dotted(64, 64));
    fs::write(&output, "precious").unwrap();
    let (code, line) = failure(&bake(&source, &output, &["--tile", "32"]));
    assert!(code == 1 && line.contains("--force"), "{line}");
    assert_eq!(fs::read(&output).unwrap(), b"precious");
    assert_eq!(leftovers(&output), Vec::<String>::new());
    let forced = baked(&source, &output, &["--tile", "32", "--force"]);
    assert!(TileFile::open(&output).is_ok() && forced.len() > 8);
}

#[test]
fn unfinished_work_of_another_source_is_rejected_and_dropped_by_force() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    write_png(&path("a.png"), &dotted(600, 500));
    write_png(&path("b.png"), &dotted(601, 500));
    let output = path("out.tiles");
    let full = Command::new("sh")
        .args([
            "-c",
            "ulimit -f 3000; trap '' XFSZ; exec \"$@\"",
            "sh",
            env!("CARGO_BIN_EXE_ortelius"),
            "bake",
        ])
        .arg(path("a.png"))
        .arg("-o")
        .arg(&output)
        .args(["--tile", "64"])
        .output()
        .unwrap();
    assert_eq!(failure(&full).0, 1);
    let work = leftovers(&output);
    assert!(work.contains(&".journal".to_string()));
    for (source, settings) in [("b.png", ["--tile", "64"]), ("a.png", ["--tile", "32"])] {
        let (code, line) = failure(&bake(&path(source), &output, &settings));
        assert!(code == 1 && line.contains("unfinished bake") && line.contains("--force"), "{line}");
        assert_eq!(leftovers(&output), work);
    }
    let expected = baked(&path("b.png"), &path("b.tiles"), &["--tile", "64"]);
    assert!(baked(&path("b.png"), &output, &["--tile", "64", "--force"]) == expected);
}

#[test]
fn a_bake_of_a_picture_larger_than_its_memory_stays_under_the_stated_bound() {
    let folder = tempfile::tempdir().unwrap();
    let (source, output) = (folder.path().join("tall.tif"), folder.path().join("tall.tiles"));
    // 188 MiB as RGBA8, enlarged in width from 1500 to 2048.
    write_tall_tiff(&source, 1500, 32_768);
    let bound = stated(&bake(&source, &output, &["--dry-run"]), "memory bytes");
    assert!(bound < 100 << 20, "the bound, {bound}, is too large to test a picture of 188 MiB");
    let mut child = bake_command(&source, &output, &[]).stderr(Stdio::null()).spawn().unwrap();
    // The kernel's high-water mark never falls, so the last sample is the peak of all but the last 2 ms.
    let mut peak = 0;
    while child.try_wait().unwrap().is_none() {
        peak = peak_bytes(child.id()).unwrap_or(peak);
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(child.wait().unwrap().success());
    println!("peak {peak} of at most {bound} bytes");
    assert!(peak > 8 << 20, "{peak} bytes are too few to be a measurement");
    assert!(peak <= bound, "{peak} bytes, stated at most {bound}");
    assert!(TileFile::open(&output).is_ok());
}

/// The peak resident memory of a process (VmHWM).
fn peak_bytes(process: u32) -> Option<u64> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kib| kib * 1024)
}

#[test]
fn sources_with_random_damage_give_errors_or_pictures_and_never_a_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let picture = dotted(40, 36);
    write_png(&path("a.png"), &picture);
    write_tiff_tiles(&path("a.tif"), &picture, false, 16);
    write_tiff_tiles(&path("b.tif"), &picture, true, 64);
    write_tiff_strips(&path("c.tif"), &picture, tiff::encoder::Compression::Lzw, 5);
    write_tiff_strips(&path("d.tif"), &picture, tiff::encoder::Compression::Packbits, 36);
    let mut random = Random(0xFEDC_BA98_7654_3210);
    let (mut refused, mut done) = (0, 0);
    for name in ["a.png", "a.tif", "b.tif", "c.tif", "d.tif"] {
        let whole = fs::read(path(name)).unwrap();
        for _ in 0..300 {
            let mut damaged = whole.clone();
            for _ in 0..=random.below(4) {
                // Half of the damage is in the first or last 200 bytes, which hold sizes and offsets.
                let length = damaged.len() as u64;
                let at = match random.below(4) {
                    0 => random.below(length.min(200)),
                    1 => length - 1 - random.below(length.min(200)),
                    _ => random.below(length),
                };
                damaged[at as usize] = [0, 1, 0x7F, 0xFF, random.below(256) as u8][random.below(5) as usize];
            }
            fs::write(path("damaged"), &damaged).unwrap();
            let settings = BakeSettings {
                source: SourceName::Picture(path("damaged")),
                output: path("out.tiles"),
                tile_side: 16,
                border_texels: 4,
                format: TileFormat::Rgba8,
                resident_levels: None,
                force: true,
            };
            // Sizes that damage has made huge are not baked: this test is about reading the header.
            let small = ortelius::texture::bake::plan(&settings)
                .is_ok_and(|plan| plan.layout.total_bytes() < 16 << 20);
            if !small || ortelius::texture::bake::bake(&settings, &()).is_err() {
                refused += 1;
                assert_eq!(leftovers(&path("out.tiles")), Vec::<String>::new(), "{name}");
            } else {
                done += 1;
            }
        }
    }
    println!("{refused} refused, {done} baked");
    assert!(refused > 100 && done > 100, "{refused} refused, {done} baked");
}
