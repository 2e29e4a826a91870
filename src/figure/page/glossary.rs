//! Terms of the figures.

/// Term and meaning, in alphabetical order.
pub const GLOSSARY: &[(&str, &str)] = &[
    (
        "batches of 32 x 32",
        "model of vertex reuse on current GPUs: up to 32 triangles share up to 32 vertices; batches share nothing",
    ),
    ("compact", "stage 3 of paper 1: the tile mask becomes the visible-tile list"),
    ("dedup", "stage 2 of paper 1: the request image becomes the tile mask; equal triples are merged"),
    (
        "ecol, vsplit",
        "edge collapse, and vertex split, its inverse: one step between two levels of a progressive mesh",
    ),
    ("empty pass", "a pass without commands; its time shows the resolution of the device's timer"),
    (
        "FIFO-16",
        "a post-transform vertex cache of 16 entries that replaces the oldest; likewise 12, 24 and 32",
    ),
    (
        "FLIP",
        "difference of two pictures as seen when they alternate, 0 to 1 (Andersson et al., \"FLIP: A Difference Evaluator for Alternating Images\", 2020)",
    ),
    ("fused", "one draw textures and sets the bits of the tile mask; no request image is written"),
    ("Hausdorff distance", "the largest distance from a point of one surface to the other surface"),
    ("memo", "a geometry shader keeps the last triple and emits a point only if the next triple differs"),
    (
        "moved faces",
        "index-buffer entries that a split rewrites in addition to the faces that it adds or changes",
    ),
    ("NMSE", "sum of squared errors over the sum of squared true values, linear light"),
    ("p", "a geometry shader of paper 1 handles a block of 2^p x 2^p pixels"),
    ("page table", "for each tile of the pyramid, its place in the tile pool"),
    ("prefetch", "requests for tiles at the camera pose extrapolated by some frames"),
    ("PSNR", "peak signal-to-noise ratio in decibels"),
    ("read-back", "baseline: the request image is copied to the host, which computes the visible-tile list"),
    ("request image", "a triple (q, i, j) for each pixel: level, row and column of the tile that it needs"),
    (
        "skip lists",
        "baseline: face lists, optimised at chosen levels, that share a vertex buffer (Forsyth, \"Comparison of VIPM Methods\", 2001)",
    ),
    ("tile address", "the grid in which i and j count: level 0, as in the paper, or the tile's own level"),
    ("tile mask", "one bit or byte for each tile, set if a pixel needs the tile"),
    ("tile pool", "texture array on the GPU that holds the resident tiles"),
    ("transforms per vertex", "cache misses over the vertices of the level; 1 is the minimum"),
    ("tswap", "permutation of the index buffer at chosen levels, to restore its vertex-cache locality"),
    (
        "undecided (noise)",
        "the 95 % confidence interval contains the bound; the reason estimates how many rounds would decide",
    ),
    ("[a .. b]", "95 % confidence interval of the median of the per-round ratios"),
];

#[cfg(test)]
mod tests {
    use super::GLOSSARY;

    #[test]
    fn terms_are_sorted_and_unique() {
        let words = || GLOSSARY.iter().map(|(term, _)| term.trim_start_matches('[').to_lowercase());
        let words: Vec<String> = words().take(GLOSSARY.len() - 1).collect();
        assert!(words.is_sorted_by(|a, b| a < b), "{words:?}");
    }
}
