//! Work on a thread beside the window: a screenshot, a recording, the opening of a scene. The window waits for neither
//! tiles nor files, and the work goes on while the window is minimised.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// Interval at which the window checks its jobs.
pub const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Work whose result is a `T`: the path of what was written, or an opened scene. Dropping the job stops the work and
/// waits for its thread.
pub struct Job<T> {
    progress: Arc<JobProgress>,
    /// Number of steps of the work.
    steps: usize,
    /// `None` only while dropping.
    thread: Option<JoinHandle<anyhow::Result<T>>>,
}

/// The error of work that was stopped.
#[derive(Debug, thiserror::Error)]
#[error("stopped")]
pub struct Stopped;

/// What the work reports, and whether it must stop.
#[derive(Default)]
pub struct JobProgress {
    done: AtomicUsize,
    is_stopped: AtomicBool,
    at_stop: Mutex<Vec<Box<dyn FnOnce() + Send>>>,
}

impl JobProgress {
    /// Reports a step.
    pub fn advance(&self) {
        self.done.fetch_add(1, Ordering::Relaxed);
    }

    /// True once the work must stop.
    pub fn stopped(&self) -> &AtomicBool {
        &self.is_stopped
    }

    /// Called between steps.
    ///
    /// # Errors
    /// The work must stop.
    pub fn check(&self) -> Result<(), Stopped> {
        match self.is_stopped.load(Ordering::SeqCst) {
            true => Err(Stopped),
            false => Ok(()),
        }
    }

    /// Calls `end_waits` when the work must stop. `end_waits` must end the waits of the work.
    pub fn at_stop(&self, end_waits: impl FnOnce() + Send + 'static) {
        self.waits().push(Box::new(end_waits));
        // The work may already have been stopped.
        if self.check().is_err() {
            self.end_waits();
        }
    }

    fn stop(&self) {
        self.is_stopped.store(true, Ordering::SeqCst);
        self.end_waits();
    }

    fn end_waits(&self) {
        let waits = std::mem::take(&mut *self.waits());
        waits.into_iter().for_each(|end| end());
    }

    fn waits(&self) -> MutexGuard<'_, Vec<Box<dyn FnOnce() + Send>>> {
        self.at_stop.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<T: Send + 'static> Job<T> {
    /// Starts work of this number of steps.
    ///
    /// # Errors
    /// A thread cannot be created.
    pub fn start(
        name: &str,
        steps: usize,
        work: impl FnOnce(&JobProgress) -> anyhow::Result<T> + Send + 'static,
    ) -> std::io::Result<Job<T>> {
        let progress = Arc::new(JobProgress::default());
        let theirs = progress.clone();
        let thread = std::thread::Builder::new().name(name.to_owned()).spawn(move || work(&theirs))?;
        Ok(Job { progress, steps, thread: Some(thread) })
    }
}

impl<T> Job<T> {
    /// The number of finished steps, and the number of all steps.
    pub fn progress(&self) -> (usize, usize) {
        (self.progress.done.load(Ordering::Relaxed), self.steps)
    }

    /// Stops the work after the step under way. Work that is complete by then has a result; other work has the error
    /// [`Stopped`].
    pub fn stop(self) -> anyhow::Result<T> {
        self.progress.stop();
        self.wait()
    }

    /// The result of `job` if it has ended; `job` is then `None`.
    pub fn take_ended(job: &mut Option<Job<T>>) -> Option<anyhow::Result<T>> {
        job.take_if(|job| job.has_ended()).map(Job::wait)
    }

    pub fn has_ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Waits for the result.
    pub fn wait(mut self) -> anyhow::Result<T> {
        let thread = self.thread.take().expect("`None` only while dropping");
        thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }
}

impl<T> Drop for Job<T> {
    fn drop(&mut self) {
        self.progress.stop();
        // Nobody waits for this work, so its error or panic is dropped.
        drop(self.thread.take().map(JoinHandle::join));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;
    use std::sync::mpsc::channel;

    #[test]
    fn a_job_reports_its_steps_and_ends_with_its_path() {
        let (go, wait) = channel();
        let work = move |progress: &JobProgress| -> anyhow::Result<PathBuf> {
            wait.recv().unwrap();
            progress.advance();
            Ok(PathBuf::from("picture.png"))
        };
        let mut job = Some(Job::start("test", 1, work).unwrap());
        assert!(Job::take_ended(&mut job).is_none() && job.is_some());
        assert_eq!(job.as_ref().unwrap().progress(), (0, 1));
        go.send(()).unwrap();
        let ended = loop {
            if let Some(ended) = Job::take_ended(&mut job) {
                break ended;
            }
            std::thread::yield_now();
        };
        assert_eq!(ended.unwrap(), PathBuf::from("picture.png"));
        assert!(job.is_none());
    }

    #[test]
    fn a_dropped_job_stops() {
        let work = |progress: &JobProgress| -> anyhow::Result<PathBuf> {
            loop {
                progress.check()?;
                std::thread::yield_now();
            }
        };
        drop(Job::start("test", 1, work).unwrap());
        assert!(Job::start("test", 1, work).unwrap().stop().unwrap_err().is::<Stopped>());
        let complete = |_: &JobProgress| Ok(PathBuf::from("a.png"));
        assert_eq!(Job::start("test", 1, complete).unwrap().stop().unwrap(), PathBuf::from("a.png"));
    }

    #[test]
    fn stopping_ends_what_the_work_waits_for() {
        for late in [false, true] {
            let (go, wait) = channel();
            let (said, hear) = channel();
            let work = move |progress: &JobProgress| -> anyhow::Result<()> {
                if late {
                    while progress.check().is_ok() {
                        std::thread::yield_now();
                    }
                }
                progress.at_stop(move || go.send(()).unwrap());
                said.send(()).unwrap();
                // If stopping did not send, this wait would never end.
                wait.recv()?;
                Ok(progress.check()?)
            };
            let job = Job::start("test", 1, work).unwrap();
            if !late {
                hear.recv().unwrap();
            }
            assert!(job.stop().unwrap_err().is::<Stopped>(), "late: {late}");
        }
    }
}
