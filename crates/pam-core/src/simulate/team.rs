//! Threads that share work in chunks.

use std::sync::{Mutex, PoisonError};

/// Threads that wait for work, and the caller's.
pub(crate) struct Team {
    threads: usize,
    /// The others, and the process that they live in: a fork takes none of them along.
    pool: Option<(u32, rayon::ThreadPool)>,
}

impl Team {
    /// So many threads at most, that of the caller among them.
    pub fn new(threads: usize) -> Self {
        Self { threads: threads.max(1), pool: None }
    }

    /// Do something with every chunk, by the caller alone where it is not worth more.
    pub fn share<T: Send>(&mut self, chunks: &mut [T], worth: bool, work: impl Fn(&mut T) + Sync) {
        let helpers = self.threads.min(chunks.len()).saturating_sub(1);
        if !worth || helpers == 0 {
            chunks.iter_mut().for_each(work);
            return;
        }
        let here = std::process::id();
        if let Some((there, pool)) = self.pool.take() {
            if there == here {
                self.pool = Some((here, pool));
            } else {
                // Its threads are those of the parent: there is nobody to tell that it ends.
                std::mem::forget(pool);
            }
        }
        if self.pool.is_none() {
            let built = rayon::ThreadPoolBuilder::new().num_threads(self.threads - 1).build();
            self.pool = built.ok().map(|pool| (here, pool));
        }
        let Some((_, pool)) = &self.pool else {
            chunks.iter_mut().for_each(work); // the system gives no more threads
            return;
        };
        let queue = Mutex::new(chunks.iter_mut());
        let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).next();
        let all = || {
            while let Some(chunk) = next() {
                work(chunk);
            }
        };
        pool.in_place_scope(|scope| {
            for _ in 0..helpers {
                scope.spawn(|_| all());
            }
            all();
        });
    }
}
