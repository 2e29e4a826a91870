//! The papers, one folder each; none names another.

pub mod virtual_texture;
