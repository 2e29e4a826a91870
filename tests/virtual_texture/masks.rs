//! U2's mask, all 32 bits of it. No texture streams more than 17 levels, so no `Pyramid` has a q of 31: the shaders of
//! stage 2 are specialized here with 32 streamed levels, and get a U1 that no mesh could draw.

use crate::device;
use ortelius::math::pyramid::Pyramid;
use ortelius::paper::virtual_texture::compact::CompactPass;
use ortelius::paper::virtual_texture::footprint::Footprint;
use ortelius::paper::virtual_texture::marks::Marks;
use ortelius::paper::virtual_texture::read_words;
use ortelius::paper::virtual_texture::{Compaction, Config, Dedup, Layout, PAPER, U1Format};
use ortelius::vk::shader::{Blocks, Shader, virtual_texture as glsl};
use ortelius::vk::{
    Blend, BufferUse, Clear, ColorTarget, Filter, Format, Gpu, GraphicsInfo, Image, Resource, Sampler,
    SamplerInfo, TexelCopy, View,
};
use std::collections::BTreeSet;

/// 64 x 32 cells of M0.
const TEXTURE: [u32; 3] = [10, 9, 4];
const SIZE: [u32; 2] = [48, 32];

/// Every q from 0 to 31 in few cells, so that masks have many bits; one cell has all of them, the last ones bit 31
/// alone, and some pixels lie beyond: background, and a q of 32, which no mask can hold.
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

/// Shaders of stage 2 that mark in U2, and log2 of the square of pixels that an invocation looks at.
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

/// 32 streamed levels, for the constants that the shader has.
fn constants(shader: &Shader, native: bool) -> Vec<(&'static str, u32)> {
    let [m, n, k] = TEXTURE;
    let all = [
        ("WIDTH_LOG2", m),
        ("HEIGHT_LOG2", n),
        ("TILE_LOG2", k),
        ("FIRST_RESIDENT_LEVEL", 32),
        ("U1_PACKED", 0),
        ("NATIVE_KEYING", u32::from(native)),
        ("SIDE_LOG2", 3),
        ("MEMO", 1),
    ];
    let has = |name: &str| shader.specialization.iter().any(|(known, _)| *known == name);
    all.into_iter().filter(|(name, _)| has(name)).collect()
}

fn upload(gpu: &Gpu, u1: &Image, triples: &[[u32; 3]]) {
    let words: Vec<u32> = triples.iter().flat_map(|&[q, i, j]| [q, i, j, 0]).collect();
    let texels = gpu.buffer_with("texels", &words, BufferUse::Storage).unwrap();
    let mut frame = gpu.frame().unwrap();
    let whole = TexelCopy { offset: 0, mip: 0, layer: 0, at: [0; 2], size: SIZE };
    frame
        .pass("upload", |cmd| {
            cmd.copy_to_image(&texels, u1, &[whole]);
            Ok(())
        })
        .unwrap();
    frame.submit().unwrap().wait().unwrap();
}

/// Runs one compute shader over U1 into marks of its own.
fn marked(
    gpu: &Gpu,
    pyramid: &Pyramid,
    u1: &Image,
    (dedup, shader, side_log2): (Dedup, &'static Shader, u32),
    native: bool,
) -> Marks {
    assert_eq!(dedup.layout(), Layout::U2);
    let marks = Marks::new(gpu, pyramid, &Config { dedup, ..PAPER }).unwrap();
    let pipeline = gpu.compute_pipeline(shader.name, shader, &constants(shader, native)).unwrap();
    let texels = SamplerInfo { filter: Filter::Nearest, wraps_in_s: false };
    let texels: Sampler = gpu.sampler("U1 texels", texels).unwrap();
    let groups = [0, 1].map(|axis| SIZE[axis].div_ceil(shader.group[axis] << side_log2));
    let mut frame = gpu.frame().unwrap();
    frame
        .pass("dedup", |cmd| {
            marks.begin(cmd);
            let resources = [
                (glsl::dedup_test_or_comp::U1, Resource::Sampled(u1, &texels)),
                (glsl::dedup_test_or_comp::MARKS, marks.resource()),
            ];
            cmd.dispatch(&pipeline, &resources, &[], [groups[0], groups[1], 1])
        })
        .unwrap();
    frame.submit().unwrap().wait().unwrap();
    marks
}

/// The geometry shader's points with p = 3 and memo, ORed by the blending hardware.
fn drawn(gpu: &Gpu, pyramid: &Pyramid, u1: &Image, native: bool) -> Marks {
    let marks = Marks::new(gpu, pyramid, &PAPER).unwrap();
    let shader = &glsl::dedup_geom::SHADERS[3];
    let pipeline = gpu
        .graphics_pipeline(&GraphicsInfo {
            name: shader.name,
            vertex: &glsl::blocks_vert::SHADER,
            geometry: Some(shader),
            fragment: Some(&glsl::dedup_frag::SHADER),
            specialization: &constants(shader, native),
            points: true,
            depth: None,
            colors: &[Format::R32Uint],
            blend: Blend::LogicOr,
        })
        .unwrap();
    let u2 = marks.u2().unwrap();
    let [columns, rows] = SIZE.map(|side| side.div_ceil(8));
    let push = Blocks { size: SIZE, columns };
    let target = ColorTarget { image: u2, clear: Clear::Uint([0; 4]) };
    let mut frame = gpu.frame().unwrap();
    frame
        .pass("dedup", |cmd| {
            cmd.render(u2.info().size, &[target], None, |render| {
                let resources = [(glsl::dedup_geom::U1, Resource::Texture(u1, View::Whole))];
                render.draw(&pipeline, &resources, bytemuck::bytes_of(&push), columns * rows)
            })
        })
        .unwrap();
    frame.submit().unwrap().wait().unwrap();
    marks
}

/// Each set bit of U2 as a triple, by the word's bits from the lowest on.
fn bits(gpu: &Gpu, marks: &Marks) -> BTreeSet<[u32; 3]> {
    let u2 = marks.u2().unwrap();
    let columns = u2.info().size[0];
    let words = read_words(gpu, u2).unwrap();
    let of_word = |(n, &word): (usize, &u32)| {
        let (i, j) = (n as u32 / columns, n as u32 % columns);
        (0..32).filter(move |q| word / 2u32.pow(*q) % 2 == 1).map(move |q| [q, i, j])
    };
    words.iter().enumerate().flat_map(of_word).collect()
}

/// What the paper's rule makes of the triples: bit q of texel (i, j), or of (i / 2^q, j / 2^q).
fn expected(triples: &[[u32; 3]], native: bool) -> BTreeSet<[u32; 3]> {
    let of = |&[q, i, j]: &[u32; 3]| if native { [q, i / 2u32.pow(q), j / 2u32.pow(q)] } else { [q, i, j] };
    triples.iter().filter(|triple| triple[0] < 32).map(of).collect()
}

#[test]
fn bit_31_of_the_mask_is_a_bit_like_any_other() {
    let gpu = device();
    let [m, n, k] = TEXTURE;
    let pyramid = Pyramid::new(m, n, k, 2, None).unwrap();
    let config = Config { u1: Some(U1Format::Rgba32), ..PAPER };
    let u1 = Footprint::new(&gpu, &pyramid, &config, SIZE).unwrap().u1;
    let triples = triples();
    upload(&gpu, &u1, &triples);
    for native in [false, true] {
        let expected = expected(&triples, native);
        assert!(expected.iter().filter(|[q, ..]| *q == 31).count() > if native { 0 } else { 8 });
        assert_eq!(expected.iter().filter(|[_, i, j]| (*i, *j) == (3, 5)).count() == 32, !native);
        assert_eq!(bits(&gpu, &drawn(&gpu, &pyramid, &u1, native)), expected, "geometry, native {native}");
        let mut last = None;
        for variant in compute_shaders() {
            let marks = marked(&gpu, &pyramid, &u1, variant, native);
            assert_eq!(bits(&gpu, &marks), expected, "{:?}, native {native}", variant.0);
            last = Some(marks);
        }
        // Stage 3's compute shaders take the bits that they find; transform feedback is refused beyond 16 levels.
        let marks = last.unwrap();
        for compact in [Compaction::Append, Compaction::Subgroup, Compaction::Workgroup, Compaction::Ordered]
        {
            let config = Config { dedup: Dedup::TestOr, compact, ..config };
            let pass = CompactPass::new(&gpu, &pyramid, &config).unwrap();
            let mut list = pass.list(&gpu, 4096).unwrap();
            let mut frame = gpu.frame().unwrap();
            frame.pass("compact", |cmd| pass.run(cmd, &marks, &list)).unwrap();
            frame
                .pass("read-back", |cmd| {
                    list.read_back(cmd);
                    Ok(())
                })
                .unwrap();
            frame.submit().unwrap().wait().unwrap();
            let (listed, _) = pass.collect(&gpu, &marks, &mut list).unwrap();
            let entries: BTreeSet<[u32; 3]> = listed.iter().copied().collect();
            assert_eq!((entries.len(), &entries), (listed.len(), &expected), "{compact:?}, native {native}");
        }
    }
}
