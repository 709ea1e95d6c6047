//! Long work beside the interpreter: its lock is released, progress is told, and an interrupt is heard at once.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::error::raise;

/// How often signals are looked for.
const LISTEN: Duration = Duration::from_millis(50);

/// What work says.
enum News<T> {
    Progress(String),
    Done(Box<Result<T, dynid::Error>>),
    Broken,
}

/// The mark of work that was told to stop.
struct Stopped;

/// Tells steps, and ends the work at a step once nobody waits for it.
struct Teller<T> {
    to: Sender<News<T>>,
    stop: Arc<AtomicBool>,
}

impl<T> Teller<T> {
    fn tell(&self, step: String) {
        if self.stop.load(Ordering::Relaxed) {
            resume_unwind(Box::new(Stopped));
        }
        // Nobody listens any longer: the next step ends the work.
        let _ = self.to.send(News::Progress(step));
    }
}

/// Does work on a thread of its own, `threads` of them in all (0: as many as there are cores).
///
/// An interrupt, or an exception of `progress`, ends the wait at once, and the work at its next step.
pub(crate) fn run<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<Bound<'_, PyAny>>,
    threads: usize,
    work: impl FnOnce(&mut (dyn FnMut(String) + Send)) -> Result<T, dynid::Error> + Send + 'static,
) -> PyResult<T> {
    let (to, news) = channel();
    let stop = Arc::new(AtomicBool::new(false));
    let teller = Teller { to: to.clone(), stop: stop.clone() };
    let pool = match threads {
        0 => None,
        n => Some(pool(n)?),
    };
    std::thread::spawn(move || {
        let whole = move || {
            let mut tell = |step: String| teller.tell(step);
            match &pool {
                Some(pool) => pool.install(|| work(&mut |step| tell(step))),
                None => work(&mut tell),
            }
        };
        let end = match catch_unwind(AssertUnwindSafe(whole)) {
            Ok(done) => News::Done(Box::new(done)),
            Err(_) => News::Broken,
        };
        let _ = to.send(end);
    });
    let outcome = wait(py, progress, news);
    stop.store(true, Ordering::Relaxed);
    outcome
}

/// A pool of so many threads.
pub(crate) fn pool(threads: usize) -> PyResult<rayon::ThreadPool> {
    let built = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    built.map_err(|e| PyRuntimeError::new_err(format!("{threads} threads: {e}")))
}

fn wait<T: Send>(
    py: Python<'_>,
    progress: Option<Bound<'_, PyAny>>,
    mut news: Receiver<News<T>>,
) -> PyResult<T> {
    loop {
        let receiver = &mut news;
        match py.detach(move || receiver.recv_timeout(LISTEN)) {
            Ok(News::Progress(step)) => {
                if let Some(progress) = &progress {
                    progress.call1((step,))?;
                }
            }
            Ok(News::Done(done)) => return done.map_err(|e| raise(py, &e)),
            Ok(News::Broken) | Err(RecvTimeoutError::Disconnected) => {
                let text = "dynid: internal fault, please report it with what it was given";
                return Err(PyRuntimeError::new_err(text));
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
        py.check_signals()?;
    }
}
