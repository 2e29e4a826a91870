//! The host's time for a list, reported as an additional pass.

use crate::figure::Contender;
use crate::paper::virtual_texture::read_back::HostList;
use crate::vk::{Mapped, PassTime};
use std::cell::RefCell;
use std::time::Instant;

/// Label of the host's pass.
pub const ON_THE_HOST: &str = "list on the host";

/// The host's time for `work`, as a pass.
pub fn host_pass<T>(work: impl FnOnce() -> T) -> PassTime {
    let start = Instant::now();
    std::hint::black_box(work());
    PassTime { label: ON_THE_HOST.into(), ns: Some(start.elapsed().as_nanos() as u64), work: None }
}

/// Adds a last pass to a contender: the host makes the list from the words that the other passes copied.
pub fn and_list<'a>(
    mut bring: Contender<'a>,
    host: &'a RefCell<HostList>,
    words: impl Fn() -> Mapped<'a, u32> + 'a,
) -> Contender<'a> {
    let run = move || {
        let mut times = (bring.run)()?;
        times.push(host_pass(|| host.borrow_mut().list(&words())));
        Ok(times)
    };
    Contender { variant: bring.variant, run: Box::new(run) }
}
