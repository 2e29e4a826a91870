//! The variants of stages 2 and 3: each valid pair lists the reference set at every subgroup size; invalid pairs are
//! rejected.

use crate::TextureSession;
use crate::lists::{assert_equals_reference, assert_lists, list, run};
use crate::{device, landscapes, open, pose, scene};
use ortelius::math::pyramid::{Pyramid, TileId};
use ortelius::paper::virtual_texture::compact::CompactPass;
use ortelius::paper::virtual_texture::dedup::DedupPass;
use ortelius::paper::virtual_texture::footprint::FootprintPass;
use ortelius::paper::virtual_texture::needs;
use ortelius::paper::virtual_texture::streaming::TileAddress;
use ortelius::paper::virtual_texture::{
    Compaction, Config, Dedup, MaskLayout, ONE_SAMPLE, RequestFormat, reference,
};
use ortelius::texture::source::TileFormat;
use ortelius::vk::{BufferUse, Feature, Gpu, GpuOptions, Need, TexelCopy, Watched};
use std::collections::BTreeSet;

/// Every valid pair of stages 2 and 3 with both addresses.
fn all_variants(renderer: &TextureSession) -> Vec<Config> {
    variants_of(&renderer.technique.settings.config, &renderer.technique.source.pyramid())
}

fn variants_of(base: &Config, pyramid: &Pyramid) -> Vec<Config> {
    let mut configs = Vec::new();
    for dedup in Dedup::staged() {
        for &compact in Compaction::ALL {
            for address in [TileAddress::Level0, TileAddress::OwnLevel] {
                let config = Config { dedup, compact, address, ..*base };
                configs.extend(config.check(pyramid).is_ok().then_some(config));
            }
        }
    }
    configs
}

/// Stages 2 and 3 of the variants, created once for each pyramid and request format, because a pipeline's first use
/// compiles it.
#[derive(Default)]
struct Passes(Vec<(Pyramid, RequestFormat, Config, DedupPass, CompactPass)>);

impl Passes {
    fn list(&mut self, gpu: &Gpu, renderer: &TextureSession, config: &Config) -> Vec<[u32; 3]> {
        let (pyramid, stage1) = (renderer.technique.source.pyramid(), renderer.technique.stage1().unwrap());
        let same = |known: &(Pyramid, RequestFormat, Config, _, _)| {
            (known.0, known.1, known.2)
                == (pyramid, stage1.format, Config { request_format: None, ..*config })
        };
        let at = self.0.iter().position(same).unwrap_or_else(|| {
            let dedup = DedupPass::new(gpu, &pyramid, config, stage1).unwrap();
            let compact = CompactPass::new(gpu, &pyramid, config).unwrap();
            self.0.push((pyramid, stage1.format, Config { request_format: None, ..*config }, dedup, compact));
            self.0.len() - 1
        });
        let (.., dedup, compact) = &self.0[at];
        run(gpu, stage1, config, dedup, compact)
    }
}

#[test]
fn every_pair_of_variants_lists_the_reference_set() {
    let gpu = device();
    let scene = scene("earth");
    // With 141 rows the last workgroups extend beyond the picture's edge.
    let mut renderer = open(&gpu, &scene, [250, 141], |settings| {
        settings.config.request_format = Some(RequestFormat::Packed)
    });
    renderer.frame(&pose(&scene, "oblique")).unwrap();
    renderer.drain().unwrap();
    let configs = all_variants(&renderer);
    assert!(configs.len() > Dedup::ALL.len() * Compaction::ALL.len(), "{}", configs.len());
    for config in configs {
        let triples = list(&gpu, &renderer, &config);
        assert_equals_reference(&mut renderer, &triples, config.address, &format!("{config:?}"));
        if config.compact == Compaction::Ordered {
            assert_is_in_order(&triples, config.dedup);
        }
    }
}

/// An ordered list is in the order of the mask: row by row for texels, level by level for bits and bytes.
fn assert_is_in_order(triples: &[[u32; 3]], dedup: Dedup) {
    let key =
        |&[q, i, j]: &[u32; 3]| if dedup.layout() == MaskLayout::Texels { [i, j, q] } else { [q, i, j] };
    assert!(triples.iter().map(key).is_sorted(), "{dedup:?}");
}

#[test]
fn every_variant_of_either_stage_lists_the_reference_set_in_all_scenes_and_formats() {
    let gpu = device();
    let mut passes = Passes::default();
    for name in landscapes() {
        let scene = scene(name);
        for &format in RequestFormat::ALL.iter().filter(|format| gpu.renders_to(format.image_format())) {
            let mut renderer =
                open(&gpu, &scene, [250, 141], |settings| settings.config.request_format = Some(format));
            renderer.frame(&pose(&scene, &scene.view.camera)).unwrap();
            renderer.drain().unwrap();
            for config in one_of_each(&renderer) {
                let triples = passes.list(&gpu, &renderer, &config);
                let what = format!("{name}: {config:?}");
                assert_equals_reference(&mut renderer, &triples, config.address, &what);
            }
        }
    }
}

/// Each variant of stage 2, with both addresses where valid; the variants of stage 3 alternate.
fn one_of_each(renderer: &TextureSession) -> Vec<Config> {
    let all = all_variants(renderer);
    let turn = |n: usize, &dedup: &Dedup| {
        let of_dedup: Vec<&Config> = all.iter().filter(|config| config.dedup == dedup).collect();
        let keyed = |address| of_dedup.iter().filter(move |config| config.address == address);
        let pick = |address, n: usize| keyed(address).nth(n % keyed(address).count().max(1)).map(|c| **c);
        [pick(TileAddress::Level0, n), pick(TileAddress::OwnLevel, n + 2)]
    };
    Dedup::staged().enumerate().flat_map(|(n, dedup)| turn(n, &dedup)).flatten().collect()
}

#[test]
fn frames_in_flight_do_not_share_their_marks() {
    let gpu = device();
    let scene = scene("earth");
    let poses = ["oblique", "headline"].map(|camera| pose(&scene, camera));
    for dedup in Dedup::staged() {
        let mut renderer = open(&gpu, &scene, [64, 36], |settings| {
            settings.config = Config {
                dedup,
                compact: Compaction::Append,
                address: TileAddress::OwnLevel,
                ..settings.config
            };
        });
        let alone = poses.map(|pose| {
            renderer.frame(&pose).unwrap();
            let requests = renderer.requests().unwrap();
            reference::visible_tiles(&requests, &renderer.technique.source.pyramid())
        });
        assert_ne!(alone[0], alone[1]);
        for pose in poses.iter().cycle().take(6) {
            renderer.frame(pose).unwrap();
        }
        renderer.drain().unwrap();
        for (n, record) in renderer.records.iter().enumerate() {
            let visible: BTreeSet<TileId> = record.visible.iter().copied().collect();
            assert_eq!(visible, alone[n % 2], "{dedup:?}, frame {n}");
        }
    }
}

/// Frame numbers repeat after 255 frames. Two pictures alternate, so that the last marks with the same number belong to
/// the other picture.
#[test]
fn bytes_of_the_frame_255_ago_do_not_count_as_marks() {
    let gpu = device();
    let scene = scene("earth");
    let mut renderers = ["oblique", "headline"].map(|camera| {
        let mut renderer = open(&gpu, &scene, [64, 36], |settings| {
            settings.config.request_format = Some(RequestFormat::Packed)
        });
        renderer.frame(&pose(&scene, camera)).unwrap();
        renderer.drain().unwrap();
        renderer
    });
    for address in [TileAddress::Level0, TileAddress::OwnLevel] {
        let config = Config {
            dedup: Dedup::MarkBytes,
            compact: Compaction::Append,
            address,
            ..renderers[0].technique.settings.config
        };
        let (pyramid, stage1) =
            (renderers[0].technique.source.pyramid(), renderers[0].technique.stage1().unwrap());
        let dedup = DedupPass::new(&gpu, &pyramid, &config, stage1).unwrap();
        let compact = CompactPass::new(&gpu, &pyramid, &config).unwrap();
        for n in 0..259 {
            let renderer = &mut renderers[n % 2];
            let triples = run(&gpu, renderer.technique.stage1().unwrap(), &config, &dedup, &compact);
            if !(2..=252).contains(&n) {
                assert_equals_reference(renderer, &triples, address, &format!("{address:?}, run {n}"));
            }
        }
    }
}

/// A synthetic picture: runs of hashed triples, the shortest of one pixel, with background between them.
fn hashed_triples(pyramid: &Pyramid, size: [u32; 2]) -> Vec<[u32; 3]> {
    let levels = pyramid.first_resident_level();
    let [columns, rows] = pyramid.tile_grid(0);
    let hash = |n: u32| (n ^ n >> 7).wrapping_mul(0x9e37_79b9).rotate_left(11).wrapping_mul(0x85eb_ca6b);
    (0..size[0] * size[1])
        .map(|n| {
            let h = hash(if n % 512 < 256 { n } else { n / 8 });
            match h % (levels + 2) {
                q if q > levels => [u32::MAX; 3],
                q => [q, (h >> 9) % rows, (h >> 20) % columns],
            }
        })
        .collect()
}

/// The request image is copied from the host, not drawn: with 16 lanes lavapipe 22.3 crashes when it rasterises.
#[test]
fn variants_with_subgroups_list_the_reference_set() {
    let gpu = device();
    println!("{} has subgroups of {}", gpu.physical().name, gpu.physical().subgroup_size);
    let pyramid = Pyramid::new(18, 17, 9, 4, None).unwrap();
    let size = [122, 67];
    let base = Config { request_format: Some(RequestFormat::Packed), ..ONE_SAMPLE };
    let stage1 = FootprintPass::new(&gpu, &pyramid, &base, size).unwrap();
    let requests = hashed_triples(&pyramid, size);
    let [columns, rows] = pyramid.tile_grid(0);
    let pack = |&[q, i, j]: &[u32; 3]| if q == u32::MAX { q } else { (q * rows + i) * columns + j };
    let words: Vec<u32> = requests.iter().map(pack).collect();
    let texels = gpu.buffer_with("texels", &words, BufferUse::Storage).unwrap();
    gpu.run_pass("upload", |cmd| {
        let whole = TexelCopy { offset: 0, mip: 0, layer: 0, at: [0; 2], size };
        cmd.copy_to_image(&texels, &stage1.requests, &[whole]);
    })
    .unwrap();
    for config in variants_of(&base, &pyramid) {
        // Each subgroup shader runs once with each tile address. The other stage is the simplest for each mask layout.
        let lanes = |needs: Vec<Need>| needs.iter().any(|need| need.feature == Feature::Subgroups);
        let plain = matches!(config.dedup, Dedup::TestOr | Dedup::Bitset | Dedup::MarkBytes);
        match (lanes(config.dedup.needs()), lanes(config.compact.needs())) {
            (true, false) if config.compact == Compaction::Append => {}
            (false, true) if plain => {}
            _ => continue,
        }
        let dedup = DedupPass::new(&gpu, &pyramid, &config, &stage1).unwrap();
        let compact = CompactPass::new(&gpu, &pyramid, &config).unwrap();
        let triples = run(&gpu, &stage1, &config, &dedup, &compact);
        assert_lists(&requests, &pyramid, &triples, config.address, &format!("{config:?}"));
    }
}

/// lavapipe's subgroups are as wide as its vectors, with 32 bits per lane. The width is set before the process loads
/// the driver.
#[test]
fn subgroups_of_4_and_of_16_lanes_list_the_reference_set() {
    let software = device().physical().name.contains("llvmpipe");
    for (bits, lanes) in [(128, 4), (512, 16)] {
        let ran = std::process::Command::new(std::env::current_exe().unwrap())
            .args(["variants::variants_with_subgroups_list_the_reference_set", "--exact", "--nocapture"])
            .env("LP_NATIVE_VECTOR_WIDTH", bits.to_string())
            .output()
            .unwrap();
        let words = String::from_utf8_lossy(&ran.stdout);
        assert!(ran.status.success(), "{lanes} lanes: {words}{}", String::from_utf8_lossy(&ran.stderr));
        assert!(words.contains("1 passed"), "{words}");
        assert!(!software || words.contains(&format!("has subgroups of {lanes}\n")), "{words}");
    }
}

#[test]
fn invalid_variants_are_rejected_with_the_reason_and_a_remedy() {
    let paper = Pyramid::new(18, 17, 9, 4, None).unwrap();
    let seventeen_levels = Pyramid::new(20, 20, 4, 2, None).unwrap();
    let fused = Config { dedup: Dedup::Fused, compact: Compaction::FusedAppend, ..ONE_SAMPLE };
    let base = Config { compact: Compaction::Append, ..ONE_SAMPLE };
    let bits = Config { dedup: Dedup::Bitset, address: TileAddress::OwnLevel, ..base };
    let bytes = Config { dedup: Dedup::MarkBytes, ..base };
    for (config, pyramid, words) in [
        (Config { address: TileAddress::Level0, ..bits }, paper, ["bitset", "address = \"own-level\""]),
        (Config { compact: Compaction::TransformFeedback, ..bits }, paper, ["transform-feedback", "append"]),
        (Config { compact: Compaction::TransformFeedback, ..bytes }, paper, ["transform-feedback", "append"]),
        (ONE_SAMPLE, seventeen_levels, ["16 streamed levels", "larger tiles"]),
        (Config { dedup: Dedup::TestOr, ..fused }, paper, ["fused-append", "fused-exact"]),
        (fused, seventeen_levels, ["32 bits", "larger tiles"]),
        (
            Config { address: TileAddress::OwnLevel, ..bytes },
            seventeen_levels,
            ["mark-bytes", "larger tiles"],
        ),
    ] {
        let line = config.check(&pyramid).unwrap_err().to_string();
        assert!(words.iter().all(|word| line.contains(word)), "{line}");
    }
    let fits = [(bits, paper), (bytes, paper), (base, seventeen_levels), (ONE_SAMPLE, paper), (fused, paper)];
    for (config, pyramid) in fits {
        assert_eq!(config.check(&pyramid), Ok(()));
    }
    // 2^20 x 2^19 texels need 350 KB of bits, more than any device's shared memory.
    let gpu = device();
    let large = Pyramid::new(20, 19, 9, 4, None).unwrap();
    let stage1 = FootprintPass::new(&gpu, &large, &bits, [16, 16]).unwrap();
    let line = DedupPass::new(&gpu, &large, &bits, &stage1).err().unwrap().to_string();
    let max = gpu.physical().shared_bytes.to_string();
    for word in ["349528", max.as_str(), "shared memory", "tile-memo"] {
        assert!(line.contains(word), "no {word} in: {line}");
    }
}

#[test]
fn a_device_opened_for_compute_variants_has_no_geometry_shader_and_runs_them() {
    let compute = Config { dedup: Dedup::TestOr, compact: Compaction::Append, ..ONE_SAMPLE };
    assert!(needs(&compute, TileFormat::Rgba8).is_empty());
    let gpu = Watched::open(&GpuOptions::default());
    let scene = scene("earth");
    let mut renderer = open(&gpu, &scene, [64, 36], |settings| settings.config = compute);
    renderer.frame(&pose(&scene, "oblique")).unwrap();
    renderer.drain().unwrap();
    let expected =
        reference::visible_tiles(&renderer.requests().unwrap(), &renderer.technique.source.pyramid());
    assert_eq!(renderer.records[0].visible.iter().copied().collect::<BTreeSet<_>>(), expected);
    let refused = DedupPass::new(
        &gpu,
        &renderer.technique.source.pyramid(),
        &ONE_SAMPLE,
        renderer.technique.stage1().unwrap(),
    )
    .err()
    .unwrap();
    for word in ["geometryShader", "\"dedup\"", "test-or"] {
        assert!(refused.to_string().contains(word), "{refused}");
    }
}
