//! Paper 2: incremental level changes, compared with meshes built from scratch at each level.

mod baselines;
mod built;
mod check;
mod device;
mod governed;
mod made;
mod misses;
mod model;
mod pace;
mod pictures;
mod published;
mod run;
