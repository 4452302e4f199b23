//! `Warden`: a limit on the memory of mapped arrays.
//!
//! When the process exceeds the limit, the warden returns the memory of all mapped arrays to the
//! system. The content stays in the system's cache while there is space, and on the disk
//! afterwards.

use std::fs;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::own_map::Tenant;

/// Interval between two checks. In this time two cores that read an array sequentially load some 20
/// MB, and up to 100 MB if they read a cached array in random order.
const PAUSE: Duration = Duration::from_millis(1);

/// Share of the limit at which memory is returned. Returning a gigabyte takes some 20 ms, in which
/// other threads load more.
const SHARE: f64 = 0.15;

type Tenants = Arc<Mutex<Vec<Tenant>>>;

/// A thread that watches the resident memory of the process.
#[derive(Debug)]
pub(crate) struct Warden {
    tenants: Tenants,
    /// Channel to the thread. Dropping it ends the thread.
    end: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Warden {
    /// Starts a thread that keeps the resident memory below `resident` bytes. Has no effect on
    /// systems that do not report it.
    pub(crate) fn new(resident: u64) -> Self {
        let tenants = Tenants::default();
        let (end, ended) = channel();
        #[expect(
            clippy::cast_precision_loss,
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a rough figure"
        )]
        let most = (resident as f64 * SHARE) as u64;
        let watched = Arc::clone(&tenants);
        let watch = move || watch(&watched, &ended, most);
        let thread = std::thread::Builder::new().name("memory".into()).spawn(watch).ok();
        Self { tenants, end: Some(end), thread }
    }

    /// Adds a map to those whose memory is returned.
    pub(crate) fn watch(&self, tenant: Tenant) {
        self.tenants.lock().unwrap_or_else(PoisonError::into_inner).push(tenant);
    }
}

impl Drop for Warden {
    fn drop(&mut self) {
        self.end = None;
        if let Some(thread) = self.thread.take() {
            let _ended = thread.join();
        }
    }
}

fn watch(tenants: &Tenants, ended: &Receiver<()>, most: u64) {
    while ended.recv_timeout(PAUSE) == Err(RecvTimeoutError::Timeout) {
        if held().is_some_and(|held| held > most) {
            tenants.lock().unwrap_or_else(PoisonError::into_inner).retain(Tenant::leave);
        }
    }
}

/// Returns the resident memory of the process in bytes.
#[cfg(any(target_os = "linux", target_os = "android"))]
fn held() -> Option<u64> {
    let text = fs::read_to_string("/proc/self/statm").ok()?;
    let pages: u64 = text.split(' ').nth(1)?.parse().ok()?;
    Some(pages * rustix::param::page_size() as u64)
}

#[cfg(not(any(target_os = "linux", target_os = "android")))]
fn held() -> Option<u64> {
    None
}
