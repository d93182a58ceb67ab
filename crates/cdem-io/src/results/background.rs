//! Writes in the background while the run steps: one job after the other, in order.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};

use super::error::ResultsError;

/// Number of jobs that may wait while another is written; each one holds a frame or a checkpoint in
/// memory.
const WAITING: usize = 1;

type Piece = Box<dyn FnOnce() -> Result<(), ResultsError> + Send>;

/// A thread that writes, and the error that stopped it.
#[derive(Default)]
pub(super) struct Background {
    worker: Option<(SyncSender<Piece>, JoinHandle<()>)>,
    failure: Failure,
}

/// An error that has not been reported yet.
#[derive(Clone, Default)]
struct Failure(Arc<Mutex<Option<ResultsError>>>);

impl Background {
    /// Queues a job; waits if the queue is full. After a failed job none is written until
    /// [`Self::wait`], so lists name only files that exist.
    ///
    /// # Errors
    /// If an earlier job failed.
    pub(super) fn begin(
        &mut self,
        piece: impl FnOnce() -> Result<(), ResultsError> + Send + 'static,
    ) -> Result<(), ResultsError> {
        self.failure.tell()?;
        if self.worker.is_none() {
            self.worker = start(self.failure.clone());
        }
        let Some((pieces, _)) = &self.worker else {
            // No thread could be started.
            return piece();
        };
        // If the worker has panicked, `wait` reports it.
        let _ = pieces.send(Box::new(piece));
        Ok(())
    }

    /// Reports an error that occurred since the last report.
    ///
    /// # Errors
    /// If a job failed.
    pub(super) fn look(&self) -> Result<(), ResultsError> {
        self.failure.tell()
    }

    /// Waits until all jobs are written.
    ///
    /// # Errors
    /// If a job failed.
    pub(super) fn wait(&mut self) -> Result<(), ResultsError> {
        if let Some((pieces, worker)) = self.worker.take() {
            drop(pieces);
            let ended = worker.join();
            ended.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        }
        self.failure.tell()
    }
}

/// Starts a writing thread, if possible. It compresses on its own threads, half as many as the
/// steps have, because the threads of the steps may all wait for it.
fn start(failure: Failure) -> Option<(SyncSender<Piece>, JoinHandle<()>)> {
    let threads = rayon::current_num_threads().div_ceil(2);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.ok()?;
    let (pieces, waiting) = sync_channel(WAITING);
    let work = move || pool.install(move || write(&waiting, &failure));
    let worker = Builder::new().spawn(work).ok()?;
    Some((pieces, worker))
}

/// Writes jobs as they come; none after a failed one.
fn write(pieces: &Receiver<Piece>, failure: &Failure) {
    let failed = pieces.iter().find_map(|piece| piece().err());
    if let Some(error) = failed {
        failure.keep(error);
        // Later jobs depend on the failed one, as a checkpoint on its frames, so they are dropped.
        pieces.iter().for_each(drop);
    }
}

impl Failure {
    fn keep(&self, error: ResultsError) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
    }

    fn tell(&self) -> Result<(), ResultsError> {
        let mut first = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        first.take().map_or(Ok(()), Err)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_written_in_their_order() {
        let order = Arc::new(Mutex::new(Vec::new()));
        let mut background = Background::default();
        for number in 0..20 {
            let order = Arc::clone(&order);
            let piece = move || {
                order.lock().expect("no panic").push(number);
                Ok(())
            };
            background.begin(piece).expect("none fails");
        }
        background.wait().expect("none fails");
        assert_eq!(
            *order.lock().expect("no panic"),
            (0..20).collect::<Vec<_>>()
        );
    }

    #[test]
    fn what_comes_after_a_failure_is_not_written_until_all_is_waited_for() {
        let written = Arc::new(Mutex::new(0));
        let count = || {
            let written = Arc::clone(&written);
            move || {
                *written.lock().expect("no panic") += 1;
                Ok(())
            }
        };
        let mut background = Background::default();
        let refused = || {
            Err(ResultsError::write(
                "there".as_ref(),
                std::io::Error::other("full"),
            ))
        };
        background.begin(refused).expect("nothing has failed yet");
        let _ = background.begin(count());
        let _ = background.wait();
        assert_eq!(*written.lock().expect("no panic"), 0);
        background.begin(count()).expect("a new beginning");
        background.wait().expect("none fails");
        assert_eq!(*written.lock().expect("no panic"), 1);
    }
}
