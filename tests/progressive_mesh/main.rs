//! Paper 2: what runs, against meshes built afresh at each level.

mod built;
mod check;
mod device;
mod governed;
mod made;
mod model;
mod pictures;
mod rivals;
mod run;
