//! Paper 3 on the device against its f64 references and f32 twins.

mod coordinates;
mod parallax;
mod relief;
