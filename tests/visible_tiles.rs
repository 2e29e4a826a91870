//! Stages 1 to 3 on the device against the reference: equal, as sets, always.

use ortelius::math::camera::Pose;
use ortelius::math::pyramid::Pyramid;
use ortelius::paper::virtual_texture::streaming::StreamingConfig;
use ortelius::paper::virtual_texture::{Config, Keying, NEEDS, PAPER, U1Format, reference};
use ortelius::renderer::{Renderer, Settings, Target};
use ortelius::scene::camera::{Camera, Place};
use ortelius::scene::mesh;
use ortelius::scene::source::ruler::Ruler;
use ortelius::vk::{Gpu, GpuOptions};
use std::collections::BTreeSet;
use std::sync::Arc;

fn gpu() -> Gpu {
    Gpu::new(&GpuOptions { validate: true, needs: &NEEDS, ..GpuOptions::default() })
        .expect("driver and layer")
}

fn renderer(gpu: &Gpu, config: Config) -> Renderer {
    let pyramid = Pyramid::new(18, 17, 9, 4, None).unwrap();
    let mesh = mesh::gpu_mesh(&mesh::earth(388, 194).unwrap()).unwrap();
    let streaming = StreamingConfig { gpu_tiles: 64, host_tiles: 64, ..StreamingConfig::default() };
    let settings = Settings { size: [640, 360], config, streaming, target: Target::Srgb8 };
    Renderer::new(gpu.clone(), Arc::new(Ruler::new(pyramid)), &mesh, settings).unwrap()
}

fn pose() -> Pose {
    let place = Place::Planet { latitude_deg: 46.0, longitude_deg: 8.0 };
    Camera {
        place,
        altitude_m: 300e3,
        heading_deg: 0.0,
        tilt_deg: 66.0,
        vertical_fov_deg: 45.0,
        magnification: 1.0,
    }
    .pose()
}

#[test]
fn every_variant_lists_exactly_the_reference_set() {
    let gpu = gpu();
    for u1 in U1Format::ALL {
        for keying in [Keying::Paper, Keying::Native] {
            let mut renderer = renderer(&gpu, Config { u1: Some(u1), keying, ..PAPER });
            renderer.frame(&pose()).unwrap();
            renderer.drain().unwrap();
            let u1 = renderer.u1().unwrap();
            let expected = reference::visible_tiles(&u1, &renderer.source.pyramid());
            let record = renderer.records.last().unwrap();
            let found: BTreeSet<_> = record.visible.iter().copied().collect();
            println!("{} tiles, {} triples", found.len(), record.triples);
            for pass in &record.passes {
                println!("{:?}", pass);
            }
            assert!(expected.len() > 5);
            assert_eq!(found, expected);
        }
    }
    assert!(gpu.messages().is_empty(), "{:?}", gpu.messages());
}

#[test]
fn every_texel_of_the_settled_frame_is_the_right_one() {
    let gpu = gpu();
    let mut renderer = renderer(&gpu, PAPER);
    let frames = renderer.settle(&pose()).unwrap();
    println!("settled after {frames}");
    let verdicts = renderer.ruler_verdicts(&pose()).unwrap();
    println!("{verdicts:?}");
    let comparison = renderer.compare_plain(&pose()).unwrap();
    println!("{comparison:#?}");
    assert_eq!((verdicts.wrong, verdicts.not_resident), (0, 0));
    assert!(verdicts.covered > 100_000);
    assert!(gpu.messages().is_empty(), "{:?}", gpu.messages());
}
