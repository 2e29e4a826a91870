//! Random input must neither lose the device nor make memory grow.

use crate::FAST;
use crate::display::{Display, key};
use crate::program::Program;
use ortelius::math::splitmix::SplitMix64;

const SEED: u64 = 20_261_122;

/// Bytes of device memory and of the resident set, read when no screenshot is under way and no scene is being opened.
fn memory(window: &mut Program<'_>) -> [u64; 2] {
    let mut line = String::new();
    window.until("the end of all jobs", |window| {
        window.handled();
        line = window.stdout().lines().rfind(|line| line.starts_with("memory: ")).unwrap().to_owned();
        line.ends_with("; 0 jobs under way")
    });
    let number = |name: &str| line.split(name).nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    [number("device "), number("resident ")]
}

/// Sends one random input.
fn step(window: &mut Program<'_>, random: &mut SplitMix64, is_long: bool) {
    let numbers: [u64; 8] = std::array::from_fn(|_| random.draw());
    let below = |n: usize, max: u64| numbers[n] % max;
    let keys = [
        key::F1,
        key::F2,
        key::G,
        key::Z,
        key::X,
        key::V,
        key::F,
        key::SPACE,
        key::N,
        key::C,
        key::P,
        key::L,
        key::F9,
        key::DIGIT_1,
        key::DIGIT_1 + 1,
        key::F12,
        // Compiling the shaders takes some seconds, so only a long walk does it.
        if is_long { key::F5 } else { key::F1 },
    ];
    let flights = [key::W, key::A, key::S, key::D, key::Q, key::E];
    let place = |n: usize| [below(n, 300) as i16, below(n + 1, 200) as i16];
    let (from, to) = (place(0), place(2));
    match below(4, 13) {
        0..4 => window.press(keys[below(5, keys.len() as u64) as usize]),
        4..6 => window.hold(flights[below(5, 6) as usize], 20 + below(6, 150)),
        6..8 => window.drag(from, to, 1 + 2 * below(5, 2) as u8),
        8 => window.wheel(from, below(5, 9) as i32 - 4),
        9 => window.resize([64 + below(5, 300) as u32, 64 + below(6, 200) as u32]),
        10 => window.hide_and_show(),
        11 => window.press_with_control(key::DIGIT_1 + below(5, 9) as u8),
        _ => window.press(key::F11),
    }
}

#[test]
fn a_random_walk_of_inputs_leaves_memory_as_it_was() {
    let display = Display::start();
    // Steps instead of seconds, so that the walk is the same on every machine.
    const STEPS: u32 = 96;
    let steps = std::env::var("ORTELIUS_WALK_STEPS").map_or(STEPS, |text| text.parse().unwrap());
    // With one malloc arena, memory that one thread has freed is used again by the other threads. Small caches are full
    // after a few steps, so that they do not grow later.
    let caches = ["-D", "cache.gpu_tiles=32", "-D", "cache.host_tiles=32"];
    let scene = [&["globe", "--size", "300x200", "-D", FAST][..], &caches].concat();
    let mut window = Program::start(&display, &scene, &[("MALLOC_ARENA_MAX", "1")]);
    window.settled_picture();
    let mut random = SplitMix64(SEED);
    // The first half of the steps opens variants, overlays and sizes for the first time.
    let mut walk = |window: &mut Program<'_>, count: u32| {
        (0..count).for_each(|_| step(window, &mut random, steps > STEPS));
        memory(window)
    };
    let max = (0..4).map(|_| walk(&mut window, steps / 8));
    let [device, resident] = max.reduce(|a, b| [a[0].max(b[0]), a[1].max(b[1])]).unwrap();
    let [device_after, resident_after] = walk(&mut window, steps / 2);
    eprintln!(
        "device {device} -> {device_after}, resident {resident} -> {resident_after}, process {}",
        window.process()
    );
    // Twice the device memory is one more renderer: the second half may end with two renderers. Lavapipe's device
    // memory is main memory. The second half may also open a variant or an overlay that the first did not. A leak of
    // one frame's buffers (1 MB) exceeds both bounds within seconds.
    let another = device_after.saturating_sub(device);
    assert!(device_after <= 2 * device, "device: {device} bytes, then {device_after}");
    assert!(
        resident_after <= resident + another + 80_000_000,
        "resident: {resident} bytes, then {resident_after}"
    );
    window.quit();
}
