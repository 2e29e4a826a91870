//! One file a subcommand: arguments, and what they call in the library.

pub mod bake;
pub mod verify;
