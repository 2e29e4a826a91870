//! The device itself: does the driver do what it says, and is the validation layer alive?

use ortelius::vk::{BufferUse, Gpu, GpuOptions, self_test};

fn validating<'a>() -> GpuOptions<'a> {
    GpuOptions { validate: true, ..GpuOptions::default() }
}

#[test]
fn the_self_test_passes_without_a_validation_message() {
    let messages = self_test::run(&validating()).expect("driver and layer");
    assert!(messages.is_empty(), "{messages:?}");
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
