//! The host's share of a list, timed as one more pass.

use crate::figure::Contender;
use crate::paper::virtual_texture::classic::HostList;
use crate::vk::PassTime;
use std::cell::RefCell;
use std::time::Instant;

/// Label of that pass.
pub const ON_THE_HOST: &str = "list on the host";

/// What `work` takes of the host's time.
pub fn host_pass<T>(work: impl FnOnce() -> T) -> PassTime {
    let start = Instant::now();
    std::hint::black_box(work());
    PassTime { label: ON_THE_HOST.into(), ns: Some(start.elapsed().as_nanos() as u64) }
}

/// A contender whose last pass is the host's, over the words that the others brought.
pub fn and_list<'a>(
    mut bring: Contender<'a>,
    host: &'a RefCell<HostList>,
    words: impl Fn() -> &'a [u32] + 'a,
) -> Contender<'a> {
    let run = move || {
        let mut times = (bring.run)()?;
        times.push(host_pass(|| host.borrow_mut().list(words())));
        Ok(times)
    };
    Contender { variant: bring.variant, run: Box::new(run) }
}
