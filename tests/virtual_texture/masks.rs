//! All 32 bits of the tile mask. No texture streams more than 17 levels, so no `Pyramid` has a q of 31. Here the
//! shaders of stage 2 are specialized with 32 streamed levels, and read a synthetic request image.

use crate::device;
use ortelius::math::pyramid::Pyramid;
use ortelius::paper::virtual_texture::compact::CompactPass;
use ortelius::paper::virtual_texture::footprint::FootprintPass;
use ortelius::paper::virtual_texture::read_words;
use ortelius::paper::virtual_texture::tile_mask::{Mask, TileMask};
use ortelius::paper::virtual_texture::{Compaction, Config, Dedup, MaskLayout, ONE_SAMPLE, RequestFormat};
use ortelius::vk::shader::{Blocks, Shader, virtual_texture as glsl};
use ortelius::vk::{
    Blend, BufferUse, Clear, ColorTarget, Format, Gpu, GraphicsInfo, Image, ReadAs, Resource, Sampler,
    SamplerFilter, SamplerInfo, TexelCopy,
};
use std::collections::BTreeSet;

/// Level 0 has 64 x 32 tiles.
const TEXTURE: [u32; 3] = [10, 9, 4];
const SIZE: [u32; 2] = [48, 32];

/// Every q from 0 to 31 in few cells, so that masks have many bits. One cell has all bits, the last cells only bit 31.
/// Some pixels need no tile: background, and a q of 32, which no mask can hold.
fn triples() -> Vec<[u32; 3]> {
    let [rows, columns] = [32, 64];
    let pixel = |n: u32| match n % 48 {
        0..=31 if n < 48 => [n % 32, 3, 5],
        40 => [31, rows - 1, columns - 1 - n / 48 % 8],
        44 => [u32::MAX; 3],
        46 => [32, 1, 1],
        _ => {
            let h = n.wrapping_mul(0x9e37_79b9).rotate_left(13).wrapping_mul(0x85eb_ca6b);
            [h % 32, (h >> 8) % 7, (h >> 16) % 9]
        }
    };
    (0..SIZE[0] * SIZE[1]).map(pixel).collect()
}

/// Shaders of stage 2 that set bits in the tile mask, with log2 of the side of an invocation's square of pixels.
fn compute_shaders() -> [(Dedup, &'static Shader, u32); 6] {
    [
        (Dedup::AtomicOr, &glsl::dedup_atomic_or_comp::SHADER, 0),
        (Dedup::TestOr, &glsl::dedup_test_or_comp::SHADER, 0),
        (Dedup::SubgroupUnique, &glsl::dedup_subgroup_unique_comp::SHADER, 0),
        (Dedup::SharedHash, &glsl::dedup_shared_hash_comp::SHADER, 0),
        (Dedup::TileMemo, &glsl::dedup_tile_memo_comp::SHADER, 3),
        (Dedup::Runs, &glsl::dedup_runs_comp::SHADER, 3),
    ]
}

/// Values of the shader's specialization constants, with 32 streamed levels.
fn constants(shader: &Shader, own_level: bool) -> Vec<(&'static str, u32)> {
    let [m, n, k] = TEXTURE;
    let all = [
        ("WIDTH_LOG2", m),
        ("HEIGHT_LOG2", n),
        ("TILE_LOG2", k),
        ("FIRST_RESIDENT_LEVEL", 32),
        ("REQUESTS_PACKED", 0),
        ("OWN_LEVEL", u32::from(own_level)),
        ("SIDE_LOG2", 3),
        ("MEMO", 1),
    ];
    let has = |name: &str| shader.specialization.iter().any(|(known, _)| *known == name);
    all.into_iter().filter(|(name, _)| has(name)).collect()
}

fn upload(gpu: &Gpu, requests: &Image, triples: &[[u32; 3]]) {
    let words: Vec<u32> = triples.iter().flat_map(|&[q, i, j]| [q, i, j, 0]).collect();
    let texels = gpu.buffer_with("texels", &words, BufferUse::Storage).unwrap();
    let mut frame = gpu.frame().unwrap();
    let whole = TexelCopy { offset: 0, mip: 0, layer: 0, at: [0; 2], size: SIZE };
    frame.pass("upload", |cmd| cmd.copy_to_image(&texels, requests, &[whole])).unwrap();
    frame.submit().unwrap().wait().unwrap();
}

/// Runs one compute shader on the request image, into a new mask.
fn marked(
    gpu: &Gpu,
    pyramid: &Pyramid,
    requests: &Image,
    (dedup, shader, side_log2): (Dedup, &'static Shader, u32),
    own_level: bool,
) -> Image {
    assert_eq!(dedup.layout(), MaskLayout::Texels);
    let mask = TileMask::image(gpu, pyramid, true).unwrap();
    let pipeline = gpu.compute_pipeline(shader.name, shader, &constants(shader, own_level)).unwrap();
    let texels = SamplerInfo { filter: SamplerFilter::Nearest, wraps_in_s: false };
    let texels: Sampler = gpu.sampler("request image texels", texels).unwrap();
    let groups = [0, 1].map(|axis| SIZE[axis].div_ceil(shader.group[axis] << side_log2));
    gpu.run_pass("dedup", |cmd| {
        cmd.clear_uint(&mask, 0);
        cmd.sync();
        let resources = [
            (glsl::dedup_test_or_comp::REQUESTS, Resource::Sampled(requests, &texels)),
            (glsl::dedup_test_or_comp::TILE_MASK, Mask::of_image(&mask).resource),
        ];
        cmd.dispatch(&pipeline, &resources, &[], [groups[0], groups[1], 1])
    })
    .unwrap();
    mask
}

/// The geometry shader's points with p = 3 and memo, combined by logic OR.
fn drawn(gpu: &Gpu, pyramid: &Pyramid, requests: &Image, own_level: bool) -> Image {
    let mask = TileMask::image(gpu, pyramid, false).unwrap();
    let shader = &glsl::dedup_geom::SHADERS[3];
    let pipeline = gpu
        .graphics_pipeline(&GraphicsInfo {
            name: shader.name,
            vertex: &glsl::blocks_vert::SHADER,
            geometry: Some(shader),
            fragment: Some(&glsl::dedup_frag::SHADER),
            specialization: &constants(shader, own_level),
            points: true,
            depth: None,
            colors: &[Format::R32Uint],
            blend: Blend::LogicOr,
        })
        .unwrap();
    let [columns, rows] = SIZE.map(|side| side.div_ceil(8));
    let push = Blocks { size: SIZE, columns };
    let target = ColorTarget { image: &mask, clear: Clear::Uint([0; 4]) };
    gpu.run_pass("dedup", |cmd| {
        cmd.render(mask.info().size, &[target], None, |render| {
            let resources = [(glsl::dedup_geom::REQUESTS, Resource::Texture(requests, ReadAs::Whole))];
            render.draw(&pipeline, &resources, bytemuck::bytes_of(&push), columns * rows)
        })
    })
    .unwrap();
    mask
}

/// Each set bit of the tile mask as a triple, lowest bit first.
fn bits(gpu: &Gpu, mask: &Image) -> BTreeSet<[u32; 3]> {
    let columns = mask.info().size[0];
    let words = read_words(gpu, mask).unwrap();
    let of_word = |(n, &word): (usize, &u32)| {
        let (i, j) = (n as u32 / columns, n as u32 % columns);
        (0..32).filter(move |q| word / 2u32.pow(*q) % 2 == 1).map(move |q| [q, i, j])
    };
    words.iter().enumerate().flat_map(of_word).collect()
}

/// The paper's rule applied to the triples: bit q of texel (i, j), or of (i / 2^q, j / 2^q).
fn expected(triples: &[[u32; 3]], own_level: bool) -> BTreeSet<[u32; 3]> {
    let of =
        |&[q, i, j]: &[u32; 3]| if own_level { [q, i / 2u32.pow(q), j / 2u32.pow(q)] } else { [q, i, j] };
    triples.iter().filter(|triple| triple[0] < 32).map(of).collect()
}

#[test]
fn bit_31_of_the_mask_works_like_the_others() {
    let gpu = device();
    let [m, n, k] = TEXTURE;
    let pyramid = Pyramid::new(m, n, k, 2, None).unwrap();
    let config = Config { request_format: Some(RequestFormat::Rgba32), ..ONE_SAMPLE };
    let requests = FootprintPass::new(&gpu, &pyramid, &config, SIZE).unwrap().requests;
    let triples = triples();
    upload(&gpu, &requests, &triples);
    for own_level in [false, true] {
        let expected = expected(&triples, own_level);
        assert!(expected.iter().filter(|[q, ..]| *q == 31).count() > if own_level { 0 } else { 8 });
        assert_eq!(expected.iter().filter(|[_, i, j]| (*i, *j) == (3, 5)).count() == 32, !own_level);
        assert_eq!(
            bits(&gpu, &drawn(&gpu, &pyramid, &requests, own_level)),
            expected,
            "geometry, own_level {own_level}"
        );
        let mut last = None;
        for variant in compute_shaders() {
            let mask = marked(&gpu, &pyramid, &requests, variant, own_level);
            assert_eq!(bits(&gpu, &mask), expected, "{:?}, own_level {own_level}", variant.0);
            last = Some(mask);
        }
        // Stage 3's compute shaders list all bits; transform feedback is rejected beyond 16 levels.
        let mask = last.unwrap();
        for compact in [Compaction::Append, Compaction::Subgroup, Compaction::Workgroup, Compaction::Ordered]
        {
            let config = Config { dedup: Dedup::TestOr, compact, ..config };
            let pass = CompactPass::new(&gpu, &pyramid, &config).unwrap();
            let mut list = pass.list(&gpu, 4096).unwrap();
            let mut frame = gpu.frame().unwrap();
            frame.pass("compact", |cmd| list.compact(cmd, Mask::of_image(&mask))).unwrap();
            frame.pass("read-back", |cmd| list.read_back(cmd)).unwrap();
            frame.submit().unwrap().wait().unwrap();
            let (listed, _) = pass.collect(&gpu, Mask::of_image(&mask), &mut list).unwrap();
            let entries: BTreeSet<[u32; 3]> = listed.iter().copied().collect();
            assert_eq!(
                (entries.len(), &entries),
                (listed.len(), &expected),
                "{compact:?}, own_level {own_level}"
            );
        }
    }
}
