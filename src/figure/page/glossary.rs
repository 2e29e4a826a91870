//! Terms of the figures.

/// Term and meaning, in alphabetical order.
pub const GLOSSARY: &[(&str, &str)] = &[
    ("axis ratio", "the longer axis of a footprint's ellipse over the shorter one"),
    (
        "batches of 32 x 32",
        "model of vertex reuse on current GPUs: up to 32 triangles share up to 32 vertices; batches share nothing",
    ),
    (
        "Belady's optimum",
        "the cache policy with the fewest misses: it evicts the tile whose next use is latest (Belady, \"A study of replacement algorithms for a virtual-storage computer\", 1966)",
    ),
    ("compact", "stage 3 of paper 1: the tile mask becomes the visible-tile list"),
    (
        "cut-off volume, V1",
        "if the footprint's edge cuts a texel, paper 3 weights the texel by the part of a Gaussian body (sigma 0.2 texels) that lies inside the footprint",
    ),
    ("dedup", "stage 2 of paper 1: the request image becomes the tile mask; equal triples are merged"),
    (
        "ecol, vsplit",
        "edge collapse, and vertex split, its inverse: one step between two levels of a progressive mesh",
    ),
    (
        "empty pass",
        "a pass without commands: the cost of a barrier and two timestamps; a shorter time cannot be measured",
    ),
    (
        "EWA",
        "elliptical weighted average: a Gaussian over the footprint's ellipse (Greene and Heckbert, \"Creating Raster Omnimax Images from Multiple Perspective Views Using the Elliptical Weighted Average Filter\", 1986)",
    ),
    (
        "Feline",
        "several trilinear samples along the footprint's longer axis (McCormack et al., \"Feline: Fast Elliptical Lines for Anisotropic Texture Mapping\", 1999)",
    ),
    (
        "FIFO-16",
        "a post-transform vertex cache of 16 entries that replaces the oldest entry; FIFO-12, FIFO-24 and FIFO-32 have 12, 24 and 32 entries",
    ),
    (
        "FLIP",
        "difference of two pictures as seen when they alternate, 0 to 1 (Andersson et al., \"FLIP: A Difference Evaluator for Alternating Images\", 2020)",
    ),
    ("footprint", "the part of the texture that a pixel covers; paper 3: an ellipse in texels"),
    (
        "fused",
        "a single draw applies the texture and sets the bits of the tile mask; no request image is written. The pass of this name may also be the draw that applies the texture and writes the request image (request_draw)",
    ),
    (
        "geomorph",
        "a vertex moves gradually from its position in the coarser level to its own, instead of popping",
    ),
    ("Hausdorff distance", "the largest distance from a point of one surface to the other surface"),
    (
        "k",
        "reconstruction term of paper 3's corrected footprint, in squared texels of level 0: it widens the ellipse, so that no footprint is empty",
    ),
    ("LRU", "a cache that evicts the least recently used tile"),
    ("memo", "a geometry shader keeps the last triple and emits a point only if the next triple differs"),
    (
        "moved faces",
        "index-buffer entries that a split rewrites in addition to the faces that it adds or changes",
    ),
    ("N1, N2", "number of tiles in the tile pool and in the host's tile cache (paper 1)"),
    ("NA", "largest number of samples along a footprint's longer side"),
    ("NMSE", "sum of squared errors over the sum of squared true values, linear light"),
    ("p", "a geometry shader of paper 1 handles a block of 2^p x 2^p pixels"),
    (
        "page table",
        "for each tile of the pyramid, its slot in the pool, or the slot of the nearest coarser tile in the pool",
    ),
    ("prefetch", "requests for the tiles that the camera will see some frames later, by extrapolation"),
    ("PSNR", "peak signal-to-noise ratio in decibels"),
    ("read-back", "baseline: the request image is copied to the host, which computes the visible-tile list"),
    ("request image", "a triple (q, i, j) for each pixel: level, row and column of the tile that it needs"),
    (
        "skip lists",
        "baseline: face lists, optimised at chosen levels, that share a vertex buffer (Forsyth, \"Comparison of VIPM Methods\", 2001)",
    ),
    (
        "texels across",
        "setting of paper 3's filter, in texels: it reads the finest level on which the ellipse's shorter semi-axis is less than twice this number",
    ),
    ("tile address", "the grid in which i and j count: level 0, as in the paper, or the tile's own level"),
    ("tile mask", "one bit or byte for each tile, set if a pixel needs the tile"),
    ("tile pool", "texture array on the GPU that holds the resident tiles"),
    (
        "transforms per vertex",
        "vertex-cache misses over the vertices of the level (also called ATVR); 1 is the minimum",
    ),
    ("tswap", "permutation of the index buffer at chosen levels, to restore its vertex-cache locality"),
    ("U1, U2, U3", "paper 1's letters for the request image, the tile mask and the visible-tile list"),
    (
        "undecided (noise)",
        "the 95 % confidence interval contains the bound; the reason estimates how many rounds would decide",
    ),
    ("weight map", "paper 3: a table of the Gaussian weight by the texel's position in the footprint"),
    ("[a .. b]", "95 % confidence interval of a median; for a ratio, of the median of the per-round ratios"),
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
