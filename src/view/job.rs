//! Work on a thread beside the window: a screenshot, a recording. The window waits for neither its tiles nor its files,
//! and the work goes on while the window is minimised.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// Time between two looks at a job.
pub const LOOK_AGAIN: Duration = Duration::from_millis(50);

/// Work that ends with the path of what it has written. Dropping it stops the work and waits for its thread.
pub struct Job {
    progress: Arc<JobProgress>,
    /// Steps of the work.
    steps: usize,
    /// `None` only while dropping.
    thread: Option<JoinHandle<anyhow::Result<PathBuf>>>,
}

/// Why stopped work has no result.
#[derive(Debug, thiserror::Error)]
#[error("stopped")]
pub struct Stopped;

/// What the work reports, and whether it must stop.
#[derive(Default)]
pub struct JobProgress {
    done: AtomicUsize,
    is_stopped: AtomicBool,
}

impl JobProgress {
    /// Reports a step.
    pub fn advance(&self) {
        self.done.fetch_add(1, Ordering::Relaxed);
    }

    /// Called between steps.
    ///
    /// # Errors
    /// The work must stop.
    pub fn check(&self) -> Result<(), Stopped> {
        match self.is_stopped.load(Ordering::Relaxed) {
            true => Err(Stopped),
            false => Ok(()),
        }
    }
}

impl Job {
    /// Starts work of this number of steps.
    ///
    /// # Errors
    /// A thread cannot be created.
    pub fn start(
        name: &str,
        steps: usize,
        work: impl FnOnce(&JobProgress) -> anyhow::Result<PathBuf> + Send + 'static,
    ) -> std::io::Result<Job> {
        let progress = Arc::new(JobProgress::default());
        let theirs = progress.clone();
        let thread = std::thread::Builder::new().name(name.to_owned()).spawn(move || work(&theirs))?;
        Ok(Job { progress, steps, thread: Some(thread) })
    }

    /// Steps that are done, and all steps.
    pub fn progress(&self) -> (usize, usize) {
        (self.progress.done.load(Ordering::Relaxed), self.steps)
    }

    /// Stops the work after the step under way. Work that is complete by then has a result; other work has the error
    /// [`Stopped`].
    pub fn stop(mut self) -> anyhow::Result<PathBuf> {
        self.progress.is_stopped.store(true, Ordering::Relaxed);
        let thread = self.thread.take().expect("`None` only while dropping");
        thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }

    /// The result of `job` if it has ended; `job` is then `None`.
    pub fn take_ended(job: &mut Option<Job>) -> Option<anyhow::Result<PathBuf>> {
        let has_ended = |job: &mut Job| job.thread.as_ref().is_none_or(JoinHandle::is_finished);
        let thread = job.take_if(has_ended)?.thread.take()?;
        Some(thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    }
}

impl Drop for Job {
    fn drop(&mut self) {
        self.progress.is_stopped.store(true, Ordering::Relaxed);
        // Nobody waits for this work, so its error or panic is dropped.
        drop(self.thread.take().map(JoinHandle::join));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
}
