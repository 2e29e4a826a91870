//! The sub-commands, one file each.

pub mod bake;
pub mod demo;
pub mod doctor;
mod outputs;
pub mod render;
pub mod verify;

/// The command line says something that cannot be: exit code 2.
#[derive(Debug)]
pub struct Usage(pub String);

impl std::fmt::Display for Usage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Usage {}
