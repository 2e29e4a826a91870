//! Paper 3.

pub mod coordinates;
