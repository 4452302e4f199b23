//! Keeps the memory of mapped arrays within bounds: when the process holds too much, it gives all of it back
//! to the system, in whose cache the content stays as long as there is room, and on the disk after.

use std::fs;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::own_map::Tenant;

/// How often it looks: in this time two cores that go through an array touch some 20 MB anew, and as much as
/// 100 MB if they jump about in one that the system has in its cache.
const PAUSE: Duration = Duration::from_millis(1);

/// It acts when this share of what is allowed is held. To give a gigabyte back takes some 20 ms, in which
/// others touch more.
const SHARE: f64 = 0.15;

type Tenants = Arc<Mutex<Vec<Tenant>>>;

/// A thread that watches how much memory is held.
#[derive(Debug)]
pub(crate) struct Warden {
    tenants: Tenants,
    /// Dropped to end the thread.
    end: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Warden {
    /// Begins to watch that no more than `resident` bytes are held. Does nothing where the system does not
    /// tell.
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

    /// Watches another map.
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

/// How many bytes of memory the process holds.
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
