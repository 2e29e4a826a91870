//! The command line (its commands land with the next commits).
fn main() {}
