//! Old names of variants and quantities in stored results, with today's names (format version 5).

use super::Row;

/// (figure's id, or a family with its dot; old name; today's name)
const RENAMED: &[(&str, &str, &str)] = &[
    ("vt.", "J1", "tile pool"),
    ("vt.", "H1", "page table"),
    ("vt.", "G1", "resident levels"),
    ("vt.headline", "moving over standing", "frame, moving over standing"),
    ("vt.na", "tiles copied a frame", "tiles copied per frame"),
    ("vt.feedback", "samples a frame", "samples per frame"),
    ("vt.feedback", "frames to all tiles", "frames until all tiles are listed"),
    ("vt.limit", "over one copy of request image", "stages 2 and 3 over one copy of the request image"),
    ("vt.limit", "over an empty pass", "stages 2 and 3 over an empty pass"),
    ("vt.budget", "frames to 50 %", "frames until 50 % of the error is gone"),
    ("vt.budget", "frames to 95 %", "frames until 95 % of the error is gone"),
    ("vt.budget", "time to 50 %", "time until 50 % of the error is gone"),
    ("vt.budget", "time to 95 %", "time until 95 % of the error is gone"),
    ("vt.disk", "time until whole", "time until the picture is complete"),
    ("vt.pop", "frames held against the one before", "frames compared with the previous one"),
    ("vt.pop", "pixels of each", "pixels of a frame"),
    ("vt.extremes", "looked at", "compared with f64"),
    ("vt.extremes", "beyond", "beyond the reference"),
    ("vt.filter", "what pixels cover", "the mean over the footprint"),
    ("vt.filter", "NMSE against what pixels cover", "NMSE against the mean over the footprint"),
    ("vt.filter", "FLIP against what pixels cover", "FLIP against the mean over the footprint"),
    ("vt.filter", "PSNR against what pixels cover", "PSNR against the mean over the footprint"),
    (
        "vt.filter",
        "pixels beyond the landscape or at its outline, left out",
        "pixels left out: beyond the textured surface or at its outline",
    ),
    ("pm.order", "FIFO-16, least from 1000 faces on", "FIFO-16, best level of at least 1000 faces"),
    (
        "pm.order",
        "FIFO-16, most over the classical order's from 1000 faces on",
        "FIFO-16 over the classical order's, worst level of at least 1000 faces",
    ),
    ("pm.average", "made for it, after a tswap", "optimised for it, after a tswap"),
    ("pm.average", "made for it, all levels", "optimised for it, all levels"),
    ("pm.cpu", "whole way", "all splits"),
    ("pm.cpu", "whole way back", "all collapses"),
    ("pm.cpu", "a hundredth of the way", "a hundredth of the splits"),
    ("pm.cpu", "splits a second", "splits per second"),
    ("pm.cpu", "collapses a second", "collapses per second"),
    (
        "pm.cpu",
        "the host's share of a frame with a hundredth of the way",
        "host's work for a frame with a hundredth of the splits",
    ),
    ("pm.cpu", "the host's share of a frame", "host's work for a frame without a level change"),
    ("pm.cpu", "a frame until it is drawn", "whole time of a frame without a level change"),
    ("pm.cpu", "the same, lines without weight", "the paper's greedy, no weight for lines"),
    ("pm.size", "file: header and heads", "file: headers of file and chunks"),
    ("pm.draw", "faces drawn for each live one", "faces drawn per live face"),
    ("pm.draw", "draw for each million of vertex invocations", "draw, per million vertex invocations"),
    ("pm.pop", "geomorph, 0.1 pixels per frame", "geomorph, 6 pixels per second"),
    (
        "pm.pop",
        "the same at an error of at most a pixel",
        "most pixels that change visibly at an error of at most a pixel",
    ),
    ("pm.governor", "frames after the first 30", "frame time after the first 30 frames"),
    ("pm.governor", "frames within 1.1 of the budget", "frames within 1.1 times the budget"),
    (
        "pm.governor",
        "the frame that one of twenty exceeds, over the budget",
        "95th percentile of the frame times, over the budget",
    ),
    ("pm.governor", "turns of the error", "reversals of the error"),
    (
        "pm.shading",
        "normal-aware collapses, the paper's number of faces",
        "normal-aware collapses, as many faces as the paper",
    ),
    ("pm.shading", "the paper, the faces of normal-aware", "the paper, as many faces as normal-aware"),
    (
        "pm.shading",
        "normals of the level, the faces of normal-aware",
        "normals of the level, as many faces as normal-aware",
    ),
    ("pm.extremes", "distance of what is left", "distance of the remaining faces"),
    ("pm.extremes", "distance of the components that remain", "distance of the remaining components"),
    ("pm.extremes", "promises that the outcome breaks", "conditions that the outcome violates"),
    ("tm.extremes", "the first of them", "first pixel that differs from f64 by more than rounding"),
    ("tm.", "time a pixel", "time per pixel"),
    ("tm.", "texels a pixel", "texels per pixel"),
    ("tm.", "texels fetched a pixel", "texels fetched per pixel"),
    ("tm.", "samples a pixel", "samples per pixel"),
    ("tm.", "fragments a pixel", "fragments per pixel"),
    ("tm.", "fragments a pixel of the object", "fragments per pixel of the object"),
    ("tm.", "fragments a pixel of the screen", "fragments per pixel of the screen"),
    ("tm.26", "steps a ray", "steps per ray"),
];

/// Gives stored rows of a figure today's names.
pub fn rename_old(figure: &str, rows: &mut [Row]) {
    for name in rows.iter_mut().flat_map(|row| [&mut row.variant, &mut row.quantity]) {
        *name = now(figure, name);
    }
}

/// Today's name for an old name; other names are returned unchanged. If the name of a quantity is not listed and starts
/// with a cache, as in "FIFO-12, ", the rest is looked up and replaced.
fn now(figure: &str, name: &str) -> String {
    let (cache, own) = match name.split_once(", ") {
        Some((cache, own)) if cache.starts_with("FIFO-") => (Some(cache), own),
        _ => (None, name),
    };
    let known = |old: &str| {
        RENAMED.iter().find(|(of, known, _)| figure.starts_with(of) && *known == old).map(|(.., new)| *new)
    };
    match (known(name), cache.zip(known(own))) {
        (Some(new), _) => new.to_owned(),
        (None, Some((cache, new))) => format!("{cache}, {new}"),
        (None, None) => name.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_old_name_of_a_figure_becomes_todays_and_all_others_stay() {
        for (figure, old, new) in [
            ("vt.resolution", "J1", "tile pool"),
            ("pm.average", "FIFO-12, made for it, all levels", "FIFO-12, optimised for it, all levels"),
            ("pm.order", "FIFO-16, least from 1000 faces on", "FIFO-16, best level of at least 1000 faces"),
            ("vt.extremes", "beyond", "beyond the reference"),
            ("vt.extremes", "beyond the reference", "beyond the reference"),
            ("vt.dedup", "beyond", "beyond"),
            ("pm.size", "J1", "J1"),
        ] {
            assert_eq!(now(figure, old), new, "{figure} {old}");
        }
    }

    #[test]
    fn a_name_of_today_is_not_old_and_no_name_is_listed_twice() {
        for (n, (figure, old, new)) in RENAMED.iter().enumerate() {
            assert_eq!(now(figure, new), *new, "{figure}");
            assert!(RENAMED[..n].iter().all(|(of, known, _)| (of, known) != (figure, old)), "{figure} {old}");
        }
    }
}
