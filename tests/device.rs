//! The device itself: the driver works as it reports, and the validation layer is active.

use ortelius::vk::shader::Replaced;
use ortelius::vk::shader::self_test::dispatch_comp;
use ortelius::vk::{
    BufferUse, Error, Feature, Format, Gpu, GpuOptions, ImageInfo, Resource, TexelCopy, Watched, Work,
    self_test,
};

fn validating<'a>() -> GpuOptions<'a> {
    GpuOptions { validate: true, ..GpuOptions::default() }
}

#[test]
fn the_self_test_passes_without_a_validation_message() {
    let passed = self_test::run(&validating()).expect("driver and layer");
    assert!(passed.messages.is_empty(), "{:?}", passed.messages);
}

/// Threads open, use and close devices of their own at the same time.
#[test]
fn devices_come_and_go_beside_each_other() {
    let rounds = |options: GpuOptions<'_>| {
        for _ in 0..8 {
            let passed = self_test::run(&options).expect("driver");
            assert!(passed.messages.is_empty(), "{:?}", passed.messages);
        }
    };
    std::thread::scope(|scope| {
        for validate in [true, false, false] {
            scope.spawn(move || rounds(GpuOptions { validate, ..GpuOptions::default() }));
        }
    });
}

#[test]
fn a_frame_has_pass_statistics_only_on_request() {
    let gpu = Watched::open(&GpuOptions { wishes: &[Feature::PipelineStatistics], ..GpuOptions::default() });
    let pipeline = gpu.compute_pipeline("dispatch", &dispatch_comp::SHADER, &[]).unwrap();
    let words = gpu.buffer("words", 4 * 256, BufferUse::Storage).unwrap();
    let other = gpu.buffer("other", 4 * 256, BufferUse::Storage).unwrap();
    let work = || {
        let mut frame = gpu.frame().unwrap();
        let words_at = [(dispatch_comp::WORDS, Resource::Buffer(&words))];
        frame.pass("dispatch", |cmd| cmd.dispatch(&pipeline, &words_at, &[], [4, 1, 1])).unwrap();
        frame
            .pass("copies", |cmd| {
                cmd.fill(&other, 64, 7);
                cmd.sync();
                cmd.copy_buffer(&words, 0, &other, 0, 128);
                cmd.copy_ranges(&words, &other, &[[512, 512, 16], [600, 600, 8]]);
            })
            .unwrap();
        let passes = frame.submit().unwrap().wait().unwrap();
        passes.into_iter().map(|pass| pass.work).collect::<Vec<_>>()
    };
    assert_eq!(work(), [None, None]);
    gpu.count_work(true);
    let dispatched = Work { dispatches: 1, compute_invocations: 4 * 64, ..Work::default() };
    let copied = Work { copied_bytes: 64 + 128 + 16 + 8, ..Work::default() };
    assert_eq!(work(), [Some(dispatched), Some(copied)]);
    assert_eq!([dispatched, copied, dispatched].into_iter().sum::<Work>().compute_invocations, 512);
    gpu.count_work(false);
    assert_eq!(work(), [None, None]);
}

#[test]
fn a_pipeline_is_compiled_again_only_if_its_description_is_new_or_was_unused_for_long() {
    let gpu = Watched::open(&GpuOptions::default());
    let compiled = |name: &str| {
        let before = gpu.compiled_pipelines();
        let pipeline = gpu.compute_pipeline(name, &dispatch_comp::SHADER, &[]).unwrap();
        (pipeline, gpu.compiled_pipelines() - before)
    };
    let (held, first) = compiled("held");
    assert_eq!((first, compiled("held").1, compiled("other").1, compiled("other").1), (1, 0, 1, 0));
    let names: Vec<String> = (0..100).map(|n| format!("unused {n}")).collect();
    assert!(names.iter().all(|name| compiled(name).1 == 1));
    assert_eq!((compiled("held").1, compiled("unused 99").1, compiled("other").1), (0, 0, 1));
    gpu.replace_shaders(Replaced::new());
    assert_eq!(compiled("held").1, 1, "other shaders may have replaced those of before");
    drop(held);
}

#[test]
fn a_dispatch_beyond_the_devices_limit_is_refused_and_names_the_pipeline() {
    let gpu = Watched::open(&GpuOptions::default());
    let pipeline = gpu.compute_pipeline("endless", &dispatch_comp::SHADER, &[]).unwrap();
    let words = gpu.buffer("words", 4 * 256, BufferUse::Storage).unwrap();
    let resources = [(dispatch_comp::WORDS, Resource::Buffer(&words))];
    // No device allows this many groups in y.
    let groups = [1, u32::MAX, 1];
    let once = gpu.run_pass("once", |cmd| cmd.dispatch(&pipeline, &resources, &[], groups));
    let rounds = [vec![((), [1; 3])], vec![((), groups)]];
    let second = gpu.run_pass("rounds", |cmd| cmd.dispatch_rounds(&pipeline, &resources, &rounds));
    for result in [once, second] {
        let line = result.unwrap_err().to_string();
        assert!(line.starts_with("endless: needs [1, 4294967295, 1] workgroups"), "{line}");
    }
}

#[test]
fn a_buffer_larger_than_the_device_allows_is_rejected_with_a_message() {
    let gpu = Gpu::new(&validating()).expect("driver and layer");
    // Limits of texels are 32 bits, and no device has 2^60 bytes.
    for (usage, words) in
        [(BufferUse::Texels, "texel buffers can hold"), (BufferUse::Upload, "buffers can hold")]
    {
        let line = gpu.buffer("page table", 1 << 60, usage).err().map(|error| error.to_string());
        assert!(line.as_ref().is_some_and(|line| line.contains(words)), "{line:?}");
    }
}

/// Copies a buffer into another one and back in one pass.
fn copy_back_and_forth(gpu: &Gpu, barrier: bool) {
    let [from, to] = ["from", "to"].map(|name| gpu.buffer(name, 1024, BufferUse::Storage).unwrap());
    assert!(gpu.messages().is_empty(), "{:?}", gpu.messages());
    gpu.run_pass("copies", |cmd| {
        cmd.copy_buffer(&from, 0, &to, 0, 1024);
        if barrier {
            cmd.sync();
        }
        cmd.copy_buffer(&to, 0, &from, 0, 1024);
    })
    .unwrap();
}

/// The layer and synchronisation validation are active: two copies into one buffer without a barrier are reported.
#[test]
fn a_missing_barrier_is_reported() {
    let gpu = Gpu::new(&validating()).expect("driver and layer");
    copy_back_and_forth(&gpu, false);
    let messages = gpu.messages();
    assert!(messages.iter().any(|m| m.id.contains("SYNC-HAZARD")), "{messages:?}");
}

/// Near miss that must stay silent: the same copies with the barrier.
#[test]
fn the_same_copies_with_a_barrier_are_silent() {
    let gpu = Gpu::new(&validating()).expect("driver and layer");
    copy_back_and_forth(&gpu, true);
    assert!(gpu.messages().is_empty(), "{:?}", gpu.messages());
}

#[test]
#[should_panic(expected = "SYNC-HAZARD")]
fn a_watched_device_fails_a_test_that_ends_with_messages() {
    copy_back_and_forth(&Watched::open(&GpuOptions::default()), false);
}

/// The inner submissions run before the frame, so the frame sees their results. The objects that the frame uses outlive
/// these submissions.
#[test]
fn buffers_and_images_are_filled_while_a_frame_is_recorded() {
    let gpu = Watched::open(&GpuOptions::default());
    let host = gpu.buffer("host", 32, BufferUse::Readback).unwrap();
    let image = gpu.image("image", ImageInfo::texture([2, 2], Format::R32Uint, 1)).unwrap();
    let mut frame = gpu.frame().unwrap();
    frame
        .pass("words", |cmd| {
            let words = gpu.buffer_with("words", &[1u32, 2, 3, 4], BufferUse::Storage)?;
            cmd.copy_buffer(&words, 0, &host, 0, 16);
            Ok(())
        })
        .unwrap();
    gpu.fill_levels(&image, &[bytemuck::cast_slice(&[5u32, 6, 7, 8]).to_vec()]).unwrap();
    let copy = TexelCopy { offset: 16, mip: 0, layer: 0, at: [0; 2], size: [2, 2] };
    frame.pass("texels", |cmd| cmd.copy_from_image(&image, &host, &[copy])).unwrap();
    drop(image);
    (0..3).for_each(|_| drop(gpu.frame().unwrap().submit().unwrap().wait().unwrap()));
    frame.submit().unwrap().wait().unwrap();
    assert_eq!(*host.mapped::<u32>(), [1, 2, 3, 4, 5, 6, 7, 8]);
}

#[test]
fn two_threads_record_frames_at_the_same_time() {
    let gpu = Watched::open(&GpuOptions::default());
    let gpu: &Gpu = &gpu;
    let fill = |first: u32| {
        for value in first..first + 20 {
            let host = gpu.buffer("host", 4, BufferUse::Readback).unwrap();
            let mut frame = gpu.frame().unwrap();
            let words = gpu.buffer_with("words", &[value], BufferUse::Storage).unwrap();
            frame.pass("copy", |cmd| cmd.copy_buffer(&words, 0, &host, 0, 4)).unwrap();
            frame.submit().unwrap().wait().unwrap();
            assert_eq!(*host.mapped::<u32>(), [value]);
        }
    };
    std::thread::scope(|scope| [0, 100].map(|first| scope.spawn(move || fill(first))).map(drop));
}

/// Copies a word to a buffer of the host, and submits the frame with a view of that buffer open.
fn copy_to_the_host(view_is_open: bool) {
    let gpu = Watched::open(&GpuOptions::default());
    let words = gpu.buffer_with("words", &[7u32], BufferUse::Storage).unwrap();
    let host = gpu.buffer("host", 4, BufferUse::Readback).unwrap();
    let mut frame = gpu.frame().unwrap();
    frame.pass("copy", |cmd| cmd.copy_buffer(&words, 0, &host, 0, 4)).unwrap();
    let view = view_is_open.then(|| host.mapped::<u32>());
    let ticket = frame.submit().unwrap();
    drop(view);
    assert_eq!(host.mapped::<u32>().len(), 1);
    ticket.wait().unwrap();
}

#[test]
#[should_panic(expected = "host: a submitted frame uses it; wait for the frame's ticket")]
fn the_host_cannot_view_a_buffer_that_a_frame_in_flight_uses() {
    copy_to_the_host(false);
}

#[test]
#[should_panic(expected = "host: the host still views it")]
fn a_frame_cannot_be_submitted_while_the_host_views_its_buffers() {
    copy_to_the_host(true);
}

fn clear(gpu: &Gpu, value: u32, made_in_the_frame: bool, submit: bool) {
    let info = ImageInfo::texture([16, 16], Format::R32Uint, 1);
    let early = gpu.image("early", info).unwrap();
    for submitted in [submit, true] {
        let mut frame = gpu.frame().unwrap();
        let late = made_in_the_frame.then(|| gpu.image("late", info).unwrap());
        frame.pass("clear", |cmd| cmd.clear_uint(late.as_ref().unwrap_or(&early), value)).unwrap();
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
fn an_image_of_an_abandoned_frame_is_ready_in_the_next() {
    clear(&Gpu::new(&validating()).expect("driver and layer"), 2, false, false);
}

#[test]
fn an_empty_buffer_is_not_an_error() {
    let gpu = Gpu::new(&validating()).expect("driver and layer");
    assert_eq!(gpu.buffer_with::<u32>("nothing", &[], BufferUse::Vertices).unwrap().bytes(), 0);
    assert!(gpu.messages().is_empty(), "{:?}", gpu.messages());
}

/// No side, layer count or size in bytes beyond the driver's limits reaches the driver.
#[test]
fn an_image_beyond_the_devices_limits_is_rejected_with_a_message() {
    let gpu = Gpu::new(&validating()).expect("driver and layer");
    let refused = |info: ImageInfo| match gpu.image("too much", info).map(|_| ()) {
        Err(Error::Limit { object, what }) => {
            assert_eq!(object, "too much");
            what
        }
        other => panic!("{info:?}: {other:?}"),
    };
    let wide = refused(ImageInfo::target([1 << 20, 16], Format::R32Uint));
    assert!(wide.starts_with("needs 1048576 x 16 texels; this device supports "), "{wide}");
    let array = ImageInfo { array: true, layers: 1 << 20, ..ImageInfo::texture([4, 4], Format::Rgba8, 1) };
    let layers = refused(array);
    assert!(layers.starts_with("needs 1048576 layers of 1 levels; this device supports "), "{layers}");
    let levels = refused(ImageInfo::texture([4, 4], Format::Rgba8, 40));
    assert!(levels.starts_with("needs 1 layers of 40 levels; this device supports "), "{levels}");
    // Every device supports 2048 layers, nearly every one 16384 texels a side; none supports 2 TiB.
    let bytes = ImageInfo { array: true, layers: 2048, ..ImageInfo::texture([16384; 2], Format::Rgba8, 1) };
    let bytes = refused(bytes);
    assert!(
        bytes.contains("bytes in one image") || bytes.contains("texels; this device supports"),
        "{bytes}"
    );
    assert!(gpu.messages().is_empty(), "{:?}", gpu.messages());
}

/// A driver leaks some process memory each time it is loaded: NVIDIA 580.159 can be loaded about thirty times. The test
/// runs in a process of its own, because the devices of other tests would keep the driver loaded.
#[test]
fn a_driver_stays_loaded_when_its_last_device_is_gone() {
    let mut alone = std::process::Command::new(std::env::current_exe().unwrap());
    let ran = alone.args(["--exact", "--ignored", "the_only_device_comes_and_goes"]).output().unwrap();
    let words = String::from_utf8_lossy(&ran.stdout);
    assert!(ran.status.success() && words.contains("1 passed"), "{words}");
}

#[test]
#[ignore = "run by a_driver_stays_loaded_when_its_last_device_is_gone"]
fn the_only_device_comes_and_goes() {
    let libraries = || -> std::collections::BTreeSet<String> {
        let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
        let paths = maps.lines().filter_map(|line| line.split_once('/')).map(|(_, path)| path);
        // Layers go with their instance.
        let drivers = paths.filter(|path| path.contains(".so") && !path.contains("VkLayer"));
        drivers.map(String::from).collect()
    };
    let gpu = Gpu::new(&GpuOptions::default()).expect("driver");
    let with = libraries();
    drop(gpu);
    let gone: Vec<_> = with.difference(&libraries()).cloned().collect();
    assert!(gone.is_empty(), "{gone:?}");
}
