//! The papers, one folder each; none names another.

pub mod progressive_mesh;
pub mod texture_mapping;
pub mod virtual_texture;

use crate::figure::Figure;

/// All figures, by family: what `list` and `reproduce` iterate.
pub const FAMILIES: [(&str, &[&Figure]); 3] = [
    ("vt", virtual_texture::figures::FIGURES),
    ("pm", progressive_mesh::figures::FIGURES),
    ("tm", texture_mapping::figures::FIGURES),
];
