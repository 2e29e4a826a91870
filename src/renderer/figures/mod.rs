//! Figures about combinations of papers. Only these modules may name two papers.

mod filters;
mod kernel_truth;
pub mod shown;
mod silhouettes;

use crate::figure::Family;
use crate::paper::{progressive_mesh, texture_mapping, virtual_texture};

/// All figures, by family: what `list` and `reproduce` iterate.
pub const FAMILIES: [Family; 4] = [
    ("vt", virtual_texture::figures::FIGURES),
    ("pm", progressive_mesh::figures::FIGURES),
    ("tm", texture_mapping::figures::FIGURES),
    ("scene", &[&filters::FILTERS]),
];
