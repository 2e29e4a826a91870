//! The device itself: does the driver do what it says, and is the validation layer alive?

use ortelius::vk::{BufferUse, Error, Format, Gpu, GpuOptions, ImageInfo, Watched, self_test};

fn validating<'a>() -> GpuOptions<'a> {
    GpuOptions { validate: true, ..GpuOptions::default() }
}

#[test]
fn the_self_test_passes_without_a_validation_message() {
    let messages = self_test::run(&validating()).expect("driver and layer");
    assert!(messages.is_empty(), "{messages:?}");
}

#[test]
fn a_table_that_no_texel_buffer_holds_is_refused_in_words() {
    let gpu = Gpu::new(&validating()).expect("driver and layer");
    // Limits are 32 bits: no device holds 2^38 words.
    let line = gpu.buffer("H1", 1 << 40, BufferUse::Texels).err().map(|error| error.to_string());
    assert!(line.as_ref().is_some_and(|line| line.contains("texel buffers hold")), "{line:?}");
}

/// The layer is alive, and so is synchronisation validation: two copies into one buffer without a barrier.
#[test]
fn a_missing_barrier_is_reported() {
    let gpu = Gpu::new(&validating()).expect("driver and layer");
    let from = gpu.buffer("from", 1024, BufferUse::Storage).unwrap();
    let to = gpu.buffer("to", 1024, BufferUse::Storage).unwrap();
    assert!(gpu.messages().is_empty(), "{:?}", gpu.messages());
    let mut frame = gpu.frame().unwrap();
    frame
        .pass("hazard", |cmd| {
            cmd.copy_buffer(&from, 0, &to, 0, 1024);
            cmd.copy_buffer(&to, 0, &from, 0, 1024);
            Ok(())
        })
        .unwrap();
    frame.submit().unwrap().wait().unwrap();
    let messages = gpu.messages();
    assert!(messages.iter().any(|m| m.id.contains("SYNC-HAZARD")), "{messages:?}");
}

/// The neighbour that must stay silent: the same copies with the barrier.
#[test]
fn the_same_copies_with_a_barrier_are_silent() {
    let gpu = Gpu::new(&validating()).expect("driver and layer");
    let from = gpu.buffer("from", 1024, BufferUse::Storage).unwrap();
    let to = gpu.buffer("to", 1024, BufferUse::Storage).unwrap();
    let mut frame = gpu.frame().unwrap();
    frame
        .pass("no hazard", |cmd| {
            cmd.copy_buffer(&from, 0, &to, 0, 1024);
            cmd.sync();
            cmd.copy_buffer(&to, 0, &from, 0, 1024);
            Ok(())
        })
        .unwrap();
    frame.submit().unwrap().wait().unwrap();
    assert!(gpu.messages().is_empty(), "{:?}", gpu.messages());
}

#[test]
#[should_panic(expected = "SYNC-HAZARD")]
fn a_watched_device_fails_a_test_that_ends_with_messages() {
    let gpu = Watched::open(&GpuOptions::default());
    let [from, to] = ["from", "to"].map(|name| gpu.buffer(name, 1024, BufferUse::Storage).unwrap());
    let mut frame = gpu.frame().unwrap();
    frame
        .pass("hazard", |cmd| {
            cmd.copy_buffer(&from, 0, &to, 0, 1024);
            cmd.copy_buffer(&to, 0, &from, 0, 1024);
            Ok(())
        })
        .unwrap();
    frame.submit().unwrap().wait().unwrap();
}

fn clear(gpu: &Gpu, value: u32, made_in_the_frame: bool, submit: bool) {
    let info = ImageInfo::texture([16, 16], Format::R32Uint, 1);
    let early = gpu.image("early", info).unwrap();
    for submitted in [submit, true] {
        let mut frame = gpu.frame().unwrap();
        let late = made_in_the_frame.then(|| gpu.image("late", info).unwrap());
        frame
            .pass("clear", |cmd| {
                cmd.clear_uint(late.as_ref().unwrap_or(&early), value);
                Ok(())
            })
            .unwrap();
        if submitted {
            frame.submit().unwrap().wait().unwrap();
        }
    }
    assert!(gpu.messages().is_empty(), "{:?}", gpu.messages());
}

#[test]
fn an_image_made_while_a_frame_is_recorded_is_ready_for_its_next_pass() {
    clear(&Gpu::new(&validating()).expect("driver and layer"), 1, true, true);
}

#[test]
fn an_image_of_a_frame_that_was_given_up_is_ready_in_the_next() {
    clear(&Gpu::new(&validating()).expect("driver and layer"), 2, false, false);
}

#[test]
fn a_buffer_of_nothing_is_no_error() {
    let gpu = Gpu::new(&validating()).expect("driver and layer");
    assert_eq!(gpu.buffer_with::<u32>("nothing", &[], BufferUse::Vertices).unwrap().bytes(), 0);
    assert!(gpu.messages().is_empty(), "{:?}", gpu.messages());
}

/// No side, no count of layers and no size in bytes reaches the driver that the driver did not promise to take.
#[test]
fn an_image_beyond_the_devices_limits_is_refused_in_words() {
    let gpu = Gpu::new(&validating()).expect("driver and layer");
    let refused = |info: ImageInfo| match gpu.image("too much", info).map(|_| ()) {
        Err(Error::Limit { object, what }) => {
            assert_eq!(object, "too much");
            what
        }
        other => panic!("{info:?}: {other:?}"),
    };
    let wide = refused(ImageInfo::target([1 << 20, 16], Format::R32Uint));
    assert!(wide.starts_with("1048576 x 16 texels; the device takes "), "{wide}");
    let array = ImageInfo { array: true, layers: 1 << 20, ..ImageInfo::texture([4, 4], Format::Rgba8, 1) };
    let layers = refused(array);
    assert!(layers.starts_with("1048576 layers of 1 levels; the device takes "), "{layers}");
    let levels = refused(ImageInfo::texture([4, 4], Format::Rgba8, 40));
    assert!(levels.starts_with("1 layers of 40 levels; the device takes "), "{levels}");
    // 2048 layers are every device's, 16384 texels a side nearly every one's; 2 TiB are none's.
    let bytes = ImageInfo { array: true, layers: 2048, ..ImageInfo::texture([16384; 2], Format::Rgba8, 1) };
    let bytes = refused(bytes);
    assert!(bytes.contains("bytes in one image") || bytes.contains("texels; the device takes"), "{bytes}");
    assert!(gpu.messages().is_empty(), "{:?}", gpu.messages());
}

/// A driver leaks a little of the process each time it is loaded: NVIDIA 580.159 answers about thirty times.
#[test]
fn a_driver_stays_loaded_when_its_last_device_is_gone() {
    let libraries = || -> std::collections::BTreeSet<String> {
        let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
        let paths = maps.lines().filter_map(|line| line.split_once('/')).map(|(_, path)| path);
        // Layers come and go with the other tests of this process.
        let drivers = paths.filter(|path| path.contains(".so") && !path.contains("VkLayer"));
        drivers.map(String::from).collect()
    };
    let gpu = Gpu::new(&GpuOptions::default()).expect("driver");
    let with = libraries();
    drop(gpu);
    let gone: Vec<_> = with.difference(&libraries()).cloned().collect();
    assert!(gone.is_empty(), "{gone:?}");
}
