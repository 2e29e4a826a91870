//! Borders and filters: which texels filters read, and the mean of stochastic filters.

use crate::truth::{RADIUS_PX, tolerance, view_of};
use crate::{bordered, device, open, pose, scene};
use ortelius::math::pyramid::Pyramid;
use ortelius::paper::virtual_texture::Filtering;
use ortelius::paper::virtual_texture::VirtualTextureSettings;
use ortelius::paper::virtual_texture::reference::picture::{SourceTexels, footprint, sides};
use ortelius::paper::virtual_texture::reference::stage1::snapping;
use ortelius::paper::virtual_texture::reference::triple;
use ortelius::picture::Picture;
use ortelius::picture::PixelFormat;
use ortelius::picture::error::compare;
use ortelius::picture::srgb::from_linear_f64;
use ortelius::reference::Sample;
use ortelius::reference::filter::sample_count;
use ortelius::texture::source::{border::true_texel, ruler::ruler_hash};

#[test]
fn two_texels_of_border_are_enough_for_two_levels_and_fewer_are_not() {
    let gpu = device();
    let wrong = [0, 1, 2, 3].map(|border| {
        let scene = bordered("ruler", border);
        let mut renderer = open(&gpu, &scene, [320, 180], |_| ());
        let pose = pose(&scene, "corner-oblique");
        renderer.settle(&pose).unwrap();
        let verdicts = renderer.ruler_verdicts().unwrap();
        assert_eq!(verdicts.not_resident, 0);
        verdicts.wrong
    });
    println!("pixels with wrong texels at borders 0, 1, 2, 3: {wrong:?}");
    // The coarser level has half the border. Half of a border of one texel is one texel before the tile and none after
    // it.
    assert!(wrong[0] > wrong[1] && wrong[1] > 0, "{wrong:?}");
    assert_eq!(wrong[2..], [0, 0]);
}

/// True if a ruler's texel is one of the eight that the trilinear filter mixes at a sample, within the device's
/// tolerance.
fn is_mixed_there(texel: u32, sample: &Sample, pyramid: &Pyramid) -> bool {
    let e = triple(&footprint(sample), pyramid, 1).e;
    // The footprint's relative tolerance of 2^-9 is less than 1/50 of a level.
    let slack = 0.02 + (1.0 + snapping(sample)).log2();
    let level = |e: f64| e.floor().clamp(0.0, f64::from(pyramid.coarsest_level())) as u32;
    let coarsest = if e < -slack { 0 } else { (level(e + slack) + 1).min(pyramid.coarsest_level()) };
    let tolerance = tolerance(sample);
    (level(e - slack)..=coarsest).any(|level| {
        let size = pyramid.level_size(level);
        let range = |n: usize| {
            let side = f64::from(size[n]);
            let (at, reach) = ([sample.s, sample.t][n] * side - 0.5, tolerance.coordinate[n] * side);
            (at - reach).floor() as i64..=(at + reach).floor() as i64 + 1
        };
        range(1).any(|y| {
            range(0).any(|x| {
                let [x, y] = true_texel(size, x, y);
                texel == ruler_hash(level, x, y)
            })
        })
    })
}

/// Number of pixels of a settled ruler, filtered by one tap, that show a texel that the trilinear filter would not mix.
fn wrong_taps(camera: &str, border: u32, spoil: impl Fn(&mut [u8; 4])) -> usize {
    let gpu = device();
    let (scene, size) = (bordered("ruler", border), [240, 135]);
    let mut renderer = open(&gpu, &scene, size, |settings| {
        settings.target = PixelFormat::Linear32;
        settings.config.filter.kind = Filtering::Stochastic;
    });
    let pose = pose(&scene, camera);
    renderer.settle(&pose).unwrap();
    let (picture, pyramid) = (renderer.linear_picture().unwrap(), renderer.technique.source.pyramid());
    let view = view_of(&scene, &pose, size);
    let wrong = |&(x, y): &(u32, u32)| {
        let [r, g, b, a] = picture.at(x, y);
        let [r, g, b] = [r, g, b].map(|channel| from_linear_f64(f64::from(channel)));
        let mut texel = [r, g, b, (a * 255.0).round() as u8];
        spoil(&mut texel);
        let texel = u32::from_le_bytes(texel);
        let candidates = view.candidates(x, y, RADIUS_PX);
        !candidates.background && !candidates.samples.iter().any(|s| is_mixed_there(texel, s, &pyramid))
    };
    (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))).filter(wrong).count()
}

#[test]
fn a_tap_shows_one_texel_that_the_trilinear_filter_mixes_also_across_tiles_without_a_border() {
    let scene = scene("ruler");
    for camera in scene.cameras.keys() {
        assert_eq!(wrong_taps(camera, 0, |_| ()), 0, "{camera}");
    }
}

/// Near miss that must be rejected: the same picture with one bit of each texel flipped.
#[test]
fn a_tap_with_a_wrong_bit_is_found() {
    let wrong = wrong_taps("corner-oblique", 4, |texel| texel[1] ^= 1);
    assert!(wrong > 240 * 135 / 5, "{wrong}");
}

#[test]
fn the_mean_of_taps_is_the_trilinear_filter_and_its_noise_falls_with_their_number() {
    let gpu = device();
    let scene = scene("earth");
    let pose = pose(&scene, "oblique");
    let open = |filter, samples| {
        let mut renderer = open(&gpu, &scene, [160, 90], |settings| {
            settings.target = PixelFormat::Linear32;
            settings.config.filter.kind = filter;
            settings.config.filter.samples = samples;
        });
        renderer.settle(&pose).unwrap();
        renderer
    };
    let truth = open(Filtering::Trilinear, 1).linear_picture().unwrap();
    let noise = [1, 4, 16].map(|samples| {
        compare(&open(Filtering::Stochastic, samples).linear_picture().unwrap(), &truth).unwrap().nmse()
    });
    // 64 taps in each of 16 frames.
    let mut renderer = open(Filtering::Stochastic, 64);
    let mut mean = Picture::filled(160, 90, [0.0; 4]);
    let mut last = Picture::filled(160, 90, [0.0; 4]);
    for _ in 0..16 {
        renderer.frame(&pose).unwrap();
        let frame = renderer.linear_picture().unwrap();
        assert_ne!(frame, last, "each frame has noise of its own");
        for (sum, pixel) in mean.rgba.iter_mut().zip(&frame.rgba) {
            *sum = std::array::from_fn(|c| sum[c] + pixel[c] / 16.0);
        }
        last = frame;
    }
    let left = compare(&mean, &truth).unwrap();
    println!(
        "NMSE of 1, 4, 16 taps {noise:?}, of 1024 {:.2e}, worst {:.5}",
        left.nmse(),
        left.worst().unwrap().value
    );
    // The NMSE of the noise falls at least as fast as with independent taps: in inverse proportion to their number.
    assert!(noise[1] < noise[0] / 4.0 && noise[2] < noise[1] / 4.0, "{noise:?}");
    assert!(left.nmse() < noise[0] / 1024.0 * 2.0, "{:.2e}", left.nmse());
}

#[test]
fn the_noise_of_a_settled_picture_does_not_depend_on_its_frames() {
    let gpu = device();
    let scene = scene("earth");
    let pose = pose(&scene, "oblique");
    let settled = |tiles| {
        let mut renderer = open(&gpu, &scene, [160, 90], |settings| {
            settings.config.filter.kind = Filtering::Stochastic;
            settings.streaming.deterministic = true;
            settings.streaming.load_tiles_per_frame = tiles;
            settings.streaming.upload_tiles_per_frame = tiles;
        });
        let frames = renderer.settle(&pose).unwrap();
        let first = renderer.picture_bytes().unwrap();
        renderer.settle(&pose).unwrap();
        (frames, first, renderer.picture_bytes().unwrap())
    };
    let ((few, first, second), (many, again, _)) = (settled(64), settled(4));
    assert!(few < many, "{few} and {many} frames");
    assert!(first == again);
    assert!(first != second, "the next picture has noise of its own");
}

/// Number of pixels of the settled picture from earth's `camera` that lie inside one triangle and differ by more than
/// `bound` from every colour that `possible` allows.
fn beyond(
    camera: &str,
    border: u32,
    bound: f64,
    change: impl FnOnce(&mut VirtualTextureSettings),
    possible: impl Fn(&SourceTexels<'_>, &Sample, &Pyramid) -> Vec<[f64; 4]>,
) -> usize {
    let gpu = device();
    let (scene, size) = (bordered("earth", border), [320, 180]);
    let mut renderer = open(&gpu, &scene, size, |settings| {
        settings.target = PixelFormat::Linear32;
        settings.streaming.gpu_tiles = 192;
        change(settings);
    });
    let pose = pose(&scene, camera);
    renderer.settle(&pose).unwrap();
    assert_eq!(renderer.technique.bias(), 0);
    let (picture, pyramid) = (renderer.linear_picture().unwrap(), renderer.technique.source.pyramid());
    let (view, texels) = (view_of(&scene, &pose, size), SourceTexels::new(&*renderer.technique.source));
    let error = |found: [f32; 4], colour: &[f64; 4]| {
        (0..3).map(|c| (f64::from(found[c]) - colour[c]).abs()).fold(0.0, f64::max)
    };
    let mut worst: f64 = 0.0;
    let mut beyond = 0;
    for (x, y) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))) {
        let Some(sample) = view.sample(x, y) else { continue };
        let colours = possible(&texels, &sample, &pyramid);
        let min = colours.iter().map(|colour| error(picture.at(x, y), colour)).fold(f64::INFINITY, f64::min);
        if min > bound {
            let candidates = view.candidates(x, y, RADIUS_PX);
            beyond += usize::from(candidates.samples.len() == 1 && !candidates.background);
        } else {
            worst = worst.max(min);
        }
    }
    println!("earth, {camera}: worst within the bound {bound:.4}: {worst:.4}; beyond {beyond}");
    beyond
}

/// Lengths of a footprint's sides, and the tolerance of the device's lengths, which follows from the tolerance of the
/// device's derivatives.
fn lengths(sample: &Sample, pyramid: &Pyramid) -> ([f64; 2], f64) {
    let [w, h] = pyramid.level_size(0).map(f64::from);
    let [ds, dt] = tolerance(sample).derivative;
    (sides(sample, pyramid).lengths(), (w * ds).hypot(h * dt))
}

/// Compares the settled picture (NA = `max`) with f64 pictures (NA = `reference_most`). If the ratio of the sides is
/// an integer within the derivatives' tolerance, the number of samples nA may have either of two values. The picture
/// jumps between them, and both are right.
fn anisotropic_beyond(camera: &str, border: u32, max: u32, reference_most: u32) -> usize {
    // 5/256 of the contrast, as for one sample. The outermost of nA samples adds nA/2 texels times the relative
    // tolerance of the side, 2^-8.
    let bound = (5.0 + f64::from(max) / 2.0) / 256.0;
    beyond(
        camera,
        border,
        bound,
        |settings| settings.config.filter.max_anisotropy = max,
        |texels, sample, pyramid| {
            let ([longest, shortest], reach) = lengths(sample, pyramid);
            let count = |by: f64| sample_count(longest + by, (shortest - by).max(0.0), reference_most);
            let footprint = sides(sample, pyramid);
            let texture = texels.texture();
            (count(-reach)..=count(reach))
                .map(|count| texture.along(&footprint, count, sample.s, sample.t))
                .collect()
        },
    )
}

#[test]
fn the_anisotropic_picture_is_the_f64_picture_for_every_number_of_samples() {
    for max in 2..=16 {
        assert_eq!(anisotropic_beyond("oblique", 4, max, max), 0, "NA = {max}");
    }
    // In the first two cases, all samples are within the border; in the last two, as many as possible are beyond it.
    for (max, border) in [(4, 4), (16, 16), (3, 2), (16, 2)] {
        assert_eq!(anisotropic_beyond("low", border, max, max), 0, "NA = {max}, border {border}");
    }
}

/// Near miss that must be rejected: half as many samples.
#[test]
fn the_anisotropic_picture_is_not_that_of_half_as_many_samples() {
    let beyond = anisotropic_beyond("oblique", 4, 4, 2);
    assert!(beyond > 20, "{beyond}");
}

/// Compares the picture of the nearer level with f64 bilinear samples, `off` levels from the nearer one. If a pixel is
/// halfway between two levels within the derivatives' tolerance, either level counts as the nearer one.
fn nearer_level_beyond(off: f64) -> usize {
    let bilinear = |settings: &mut VirtualTextureSettings| settings.config.filter.kind = Filtering::Bilinear;
    beyond("oblique", 4, 5.0 / 256.0, bilinear, |texels, sample, pyramid| {
        let ([longest, _], reach) = lengths(sample, pyramid);
        let level =
            |length: f64| (length.log2() + 0.5 + off).floor().clamp(0.0, f64::from(pyramid.coarsest_level()));
        let texture = texels.texture();
        (level(longest - reach) as u32..=level(longest + reach) as u32)
            .map(|level| texture.bilinear(level, sample.s, sample.t))
            .collect()
    })
}

#[test]
fn the_bilinear_picture_is_that_of_the_nearer_level_and_not_of_the_finer_one() {
    assert_eq!(nearer_level_beyond(0.0), 0);
    let of_the_finer = nearer_level_beyond(-0.5);
    assert!(of_the_finer > 20, "{of_the_finer}");
}
