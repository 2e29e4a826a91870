//! Contenders of one pass each.

use crate::figure::Contender;
use crate::vk::{Cmd, Gpu};

/// Runs `record` as the only pass of a frame, and times it.
pub fn pass<'a>(
    gpu: &'a Gpu,
    variant: impl Into<String>,
    mut record: impl FnMut(&mut Cmd<'_>) -> crate::vk::Result<()> + 'a,
) -> Contender<'a> {
    let variant = variant.into();
    let label = variant.clone();
    let run = move || Ok(gpu.run_pass(&label, &mut record)?);
    Contender { variant, run: Box::new(run) }
}
