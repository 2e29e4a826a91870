//! The loader (paper 1, section 3): threads that load tiles into main memory within their own time budget. The budget
//! is CPU time. A load that waits for the disk uses none, so all threads can wait for a slow disk at once.

use crate::math::pyramid::TileId;
use crate::texture::source::{TileError, TileSource};
use crossbeam_channel::{Receiver, Sender, bounded};
use rustix::time::{ClockId, clock_gettime};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// A request to load one tile into a reserved slot of the host cache.
pub struct Request {
    pub tile: TileId,
    pub slot: u32,
    /// The slot's generation when the slot was reserved. If the generation has changed when the load returns, the load
    /// is stale.
    pub generation: u64,
    /// Counts requests; results may arrive in another order.
    pub sequence: u64,
    pub bytes: Vec<u8>,
    /// Set if the tile is no longer wanted; the tile is then not read.
    pub cancelled: Arc<AtomicBool>,
}

/// A finished request. Its bytes hold the tile if `outcome` is `Ok`.
pub struct FinishedLoad {
    pub request: Request,
    pub outcome: Result<(), LoadFailure>,
}

/// Why a request's bytes hold no tile.
pub enum LoadFailure {
    Cancelled,
    Source(TileError),
    /// The source panicked, which is our bug. The frame's thread resumes the panic.
    Panicked(Box<dyn Any + Send>),
}

/// The CPU time that all threads together may still spend.
struct Tokens {
    left_ns: i64,
}

impl Tokens {
    /// Adds a grant. At most one grant is saved, so an idle second does not allow a second of loading at once.
    fn grant(&mut self, grant_ns: i64) {
        self.left_ns = self.left_ns.saturating_add(grant_ns).min(grant_ns);
    }

    /// Subtracts the CPU time of a load. The result may be a debt, because a load cannot be stopped halfway. Later
    /// grants pay the debt first.
    fn spend(&mut self, spent: Duration) {
        self.left_ns = self.left_ns.saturating_sub(nanoseconds(spent));
    }
}

fn nanoseconds(duration: Duration) -> i64 {
    i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX)
}

/// The calling thread's CPU time.
fn cpu_time() -> Duration {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    // The clock counts from the thread's start, so neither part is negative.
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

/// The state on which the threads wait: the tokens, and a flag that is true once the loader is being dropped.
struct Pace {
    state: Mutex<(Tokens, bool)>,
    changed: Condvar,
}

impl Pace {
    /// A panic cannot leave the state half-changed, so a poisoned lock is still valid.
    fn lock(&self) -> MutexGuard<'_, (Tokens, bool)> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sleeps until there are tokens. Returns false if the loader is being dropped.
    fn wait(&self) -> bool {
        let state = self
            .changed
            .wait_while(self.lock(), |(tokens, ended)| !*ended && tokens.left_ns <= 0)
            .unwrap_or_else(PoisonError::into_inner);
        !state.1
    }
}

/// The loader threads. Dropping the loader joins the threads; loads that have not begun are skipped.
pub struct Loader {
    /// `None` only while dropping.
    requests: Option<Sender<Request>>,
    results: Receiver<FinishedLoad>,
    pace: Arc<Pace>,
    threads: Vec<JoinHandle<()>>,
    sent: u64,
    received: u64,
    capacity: u64,
}

impl Loader {
    /// At most `capacity` requests are under way at a time.
    ///
    /// # Errors
    /// A thread cannot be created.
    pub fn new(source: &Arc<dyn TileSource>, threads: usize, capacity: usize) -> std::io::Result<Self> {
        let (request_in, request_out) = bounded::<Request>(capacity);
        // The channel has room for the results of all requests under way. So no thread blocks on sending a result, and
        // joining ends.
        let (result_in, result_out) = bounded(capacity);
        let pace = Pace { state: Mutex::new((Tokens { left_ns: 0 }, false)), changed: Condvar::new() };
        let mut loader = Self {
            requests: Some(request_in),
            results: result_out,
            pace: Arc::new(pace),
            threads: Vec::with_capacity(threads),
            sent: 0,
            received: 0,
            capacity: capacity as u64,
        };
        for index in 0..threads {
            let (source, pace) = (Arc::clone(source), Arc::clone(&loader.pace));
            let (requests, results) = (request_out.clone(), result_in.clone());
            let work = move || load_tiles(&*source, &pace, &requests, &results);
            loader.threads.push(std::thread::Builder::new().name(format!("tiles {index}")).spawn(work)?);
        }
        Ok(loader)
    }

    /// Requests sent whose result has not been received.
    pub fn under_way(&self) -> u64 {
        self.sent - self.received
    }

    pub fn has_room(&self) -> bool {
        self.under_way() < self.capacity
    }

    /// Lets the threads load for another `budget` of CPU time, summed over the threads.
    pub fn grant(&self, budget: Duration) {
        self.pace.lock().0.grant(nanoseconds(budget));
        self.pace.changed.notify_all();
    }

    /// Sends a request. Requires [`Loader::has_room`].
    pub fn send(&mut self, request: Request) {
        assert!(self.has_room(), "{} requests under way of {}", self.under_way(), self.capacity);
        let requests = self.requests.as_ref().unwrap_or_else(|| unreachable!("sending while dropping"));
        if requests.send(request).is_err() {
            unreachable!("threads outlive the channel: they only end by Drop");
        }
        self.sent += 1;
    }

    /// A finished load, if there is one.
    pub fn try_receive(&mut self) -> Option<FinishedLoad> {
        let loaded = self.results.try_recv().ok()?;
        Some(self.accept(loaded))
    }

    /// Waits for everything under way; returns the results in the order of the requests.
    pub fn receive_all(&mut self) -> Vec<FinishedLoad> {
        let mut all = Vec::with_capacity(self.under_way() as usize);
        while self.under_way() > 0 {
            match self.results.recv() {
                Ok(loaded) => all.push(self.accept(loaded)),
                Err(_) => unreachable!("threads outlive the channel: they only end by Drop"),
            }
        }
        all.sort_unstable_by_key(|loaded| loaded.request.sequence);
        all
    }

    fn accept(&mut self, loaded: FinishedLoad) -> FinishedLoad {
        self.received += 1;
        match loaded.outcome {
            Err(LoadFailure::Panicked(payload)) => resume_unwind(payload),
            outcome => FinishedLoad { outcome, ..loaded },
        }
    }
}

impl Drop for Loader {
    fn drop(&mut self) {
        self.requests = None;
        self.pace.lock().1 = true;
        self.pace.changed.notify_all();
        for thread in self.threads.drain(..) {
            // The thread has caught panics of the source. A panic of the loader itself is resumed, but not while
            // unwinding.
            if let Err(payload) = thread.join()
                && !std::thread::panicking()
            {
                resume_unwind(payload);
            }
        }
    }
}

/// The work of one loader thread.
fn load_tiles(
    source: &dyn TileSource,
    pace: &Pace,
    requests: &Receiver<Request>,
    results: &Sender<FinishedLoad>,
) {
    for mut request in requests {
        if !pace.wait() {
            return;
        }
        let outcome = if request.cancelled.load(Ordering::Relaxed) {
            Err(LoadFailure::Cancelled)
        } else {
            let begin = cpu_time();
            let (tile, bytes) = (request.tile, &mut request.bytes);
            let read = catch_unwind(AssertUnwindSafe(|| source.read_tile(tile, bytes)));
            pace.lock().0.spend(cpu_time().saturating_sub(begin));
            match read {
                Ok(read) => read.map_err(LoadFailure::Source),
                Err(payload) => Err(LoadFailure::Panicked(payload)),
            }
        };
        if results.send(FinishedLoad { request, outcome }).is_err() {
            return; // the Loader is gone
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::pyramid::Pyramid;
    use crate::texture::source::TileFormat;

    /// A source whose reads end in descending order of their columns, in whatever order the threads run.
    struct Gate {
        /// Number of reads begun; and 1 + the lowest column whose read may end.
        state: Mutex<(usize, u32)>,
        changed: Condvar,
    }

    impl Gate {
        fn new(end: u32) -> Arc<Gate> {
            Arc::new(Gate { state: Mutex::new((0, end)), changed: Condvar::new() })
        }

        /// Waits until this many reads have begun.
        fn wait_for(&self, begun: usize) {
            drop(self.changed.wait_while(self.state.lock().unwrap(), |state| state.0 < begun).unwrap());
        }

        fn open_for_all(&self) {
            self.state.lock().unwrap().1 = 0;
            self.changed.notify_all();
        }
    }

    impl TileSource for Gate {
        fn describe(&self) -> String {
            "gate".to_owned()
        }
        fn pyramid(&self) -> Pyramid {
            unreachable!("the loader knows no sizes")
        }
        fn format(&self) -> TileFormat {
            TileFormat::Rgba8
        }
        fn read_tile(&self, tile: TileId, bytes: &mut [u8]) -> Result<(), TileError> {
            let mut state = self.state.lock().unwrap();
            state.0 += 1;
            self.changed.notify_all();
            let mut state = self.changed.wait_while(state, |state| tile.column + 1 < state.1).unwrap();
            state.1 = state.1.min(tile.column);
            self.changed.notify_all();
            bytes[0] = tile.column as u8;
            Ok(())
        }
        fn read_resident_level(&self, level: u32) -> Result<Vec<u8>, TileError> {
            unreachable!("level {level}")
        }
    }

    /// A loader with a request for each of these columns.
    fn loading(gate: &Arc<Gate>, threads: usize, columns: u32) -> Loader {
        let source: Arc<dyn TileSource> = gate.clone();
        let loader = requested(&source, threads, columns);
        loader.grant(Duration::MAX);
        loader
    }

    /// As [`loading`], before the first grant.
    fn requested(source: &Arc<dyn TileSource>, threads: usize, columns: u32) -> Loader {
        let mut loader = Loader::new(source, threads, columns as usize).unwrap();
        for column in 0..columns {
            loader.send(Request {
                tile: TileId { level: 0, row: 0, column },
                slot: column,
                generation: 1,
                sequence: u64::from(column),
                bytes: vec![0],
                cancelled: Arc::default(),
            });
        }
        assert!(!loader.has_room());
        loader
    }

    #[test]
    fn results_of_a_frame_come_in_the_order_of_the_requests() {
        let mut loader = loading(&Gate::new(4), 4, 4);
        let order: Vec<u8> = loader.receive_all().iter().map(|loaded| loaded.request.bytes[0]).collect();
        assert_eq!(order, [0, 1, 2, 3]);
        assert_eq!(loader.under_way(), 0);
    }

    #[test]
    fn loads_wait_for_the_disk_together_and_are_charged_no_waiting() {
        let gate = Gate::new(u32::MAX);
        let source: Arc<dyn TileSource> = gate.clone();
        let mut loader = requested(&source, 2, 2);
        let budget = Duration::from_millis(20);
        loader.grant(budget);
        gate.wait_for(2);
        std::thread::sleep(2 * budget);
        gate.open_for_all();
        assert_eq!(loader.receive_all().len(), 2);
        assert!(loader.pace.lock().0.left_ns > 0, "waiting was charged as work");
    }

    #[test]
    fn work_is_charged() {
        let source: Arc<dyn TileSource> = Gate::new(1);
        let mut loader = requested(&source, 1, 1);
        // Any read takes longer than a nanosecond.
        loader.grant(Duration::from_nanos(1));
        assert_eq!(loader.receive_all().len(), 1);
        assert!(loader.pace.lock().0.left_ns <= 0, "work was not charged");
    }

    #[test]
    fn loads_that_have_not_begun_when_the_loader_is_dropped_are_skipped() {
        let gate = Gate::new(u32::MAX);
        let loader = loading(&gate, 2, 8);
        gate.wait_for(2);
        let pace = Arc::clone(&loader.pace);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                // The loads under way end once the loader is being dropped. Their threads then look for more requests.
                while !pace.lock().1 {
                    std::thread::yield_now();
                }
                gate.open_for_all();
            });
            drop(loader);
        });
        assert_eq!(gate.state.lock().unwrap().0, 2);
    }

    #[test]
    fn idle_time_is_not_saved_up() {
        let mut tokens = Tokens { left_ns: 0 };
        for _ in 0..10 {
            tokens.grant(100);
        }
        assert_eq!(tokens.left_ns, 100);
    }

    #[test]
    fn a_load_longer_than_its_budget_is_paid_from_the_next_ones() {
        let mut tokens = Tokens { left_ns: 0 };
        tokens.grant(100);
        tokens.spend(Duration::from_nanos(250));
        assert_eq!(tokens.left_ns, -150);
        tokens.grant(100);
        assert!(tokens.left_ns <= 0);
        tokens.grant(100);
        assert_eq!(tokens.left_ns, 50);
    }

    #[test]
    fn an_endless_budget_does_not_overflow() {
        let mut tokens = Tokens { left_ns: 0 };
        tokens.grant(nanoseconds(Duration::MAX));
        tokens.grant(nanoseconds(Duration::MAX));
        assert_eq!(tokens.left_ns, i64::MAX);
        tokens.spend(Duration::MAX);
        assert_eq!(tokens.left_ns, 0);
    }
}
