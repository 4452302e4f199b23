//! A bounded cache of slices, loaded as an avatar needs them.
//!
//! Slices are loaded until there are n; from then on each new slice replaces the one furthest from
//! the avatar (Anjos et al. 2012, §3.1). In addition, a separate thread loads the next slices in
//! the direction of movement; the paper's figures are without it.

use std::collections::VecDeque;
use std::ops::RangeInclusive;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;

use crate::Grid;
use crate::map::SliceMap;
use crate::route::Building;
use crate::slice::Slice;
use crate::store::{SliceFolder, StoreError};

/// Options of a [`SliceCache`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct CacheOptions {
    /// n, the number of slices kept in memory. Raised to the number needed at once. Default: 16, as
    /// in Anjos et al. 2012, Fig. 6.
    pub slices: u32,
    /// Loads slices ahead on a separate thread. Default: `true`.
    pub prefetch: bool,
}

impl Default for CacheOptions {
    fn default() -> Self {
        Self { slices: 16, prefetch: true }
    }
}

impl CacheOptions {
    /// Sets the number of slices.
    #[must_use]
    pub const fn with_slices(self, slices: u32) -> Self {
        Self { slices, ..self }
    }

    /// Enables or disables loading ahead.
    #[must_use]
    pub const fn with_prefetch(self, prefetch: bool) -> Self {
        Self { prefetch, ..self }
    }
}

/// Counters of a cache.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CacheCounts {
    /// Requested slices that were in the cache, or on their way since an earlier step.
    pub hits: u64,
    /// Requested slices that were not in the cache and not on their way.
    pub misses: u64,
    /// Number of requests that waited for the disk. Unlike the other counters, it depends on the
    /// speed of the disk.
    pub stalls: u64,
}

/// A cache of slices of a folder, with a thread that loads ahead.
///
/// The kept slices depend on the order of requests alone, never on the speed of the disk: a slice
/// has its place from the moment when it is requested.
#[derive(Debug)]
pub struct SliceCache {
    folder: SliceFolder,
    map: SliceMap,
    /// The slices that have a place, in no order; slices not yet on the map are on their way.
    kept: Vec<u32>,
    capacity: usize,
    /// Reference height of the feet; replaced when they are a slice's height away from it.
    feet: Option<f64>,
    /// `true` if the feet last moved up; `None` before any movement.
    is_rising: Option<bool>,
    counts: CacheCounts,
    loader: Option<Loader>,
}

impl SliceCache {
    /// Creates an empty cache. `span` is the number of slices needed at once
    /// ([`Avatar::slices`](crate::Avatar::slices)); the capacity is never less.
    #[must_use]
    pub fn new(folder: &SliceFolder, options: &CacheOptions, span: u32) -> Self {
        let most = folder.grid().counts[2].max(1);
        let capacity = options.slices.max(span).clamp(1, most) as usize;
        let loader = options.prefetch.then(|| Loader::start(folder.clone()));
        Self {
            map: folder.unloaded(),
            folder: folder.clone(),
            kept: Vec::with_capacity(capacity),
            capacity,
            feet: None,
            is_rising: None,
            counts: CacheCounts::default(),
            loader: loader.flatten(),
        }
    }

    /// Returns the greatest number of kept slices. It exceeds the requested number if an avatar
    /// needs more at once.
    #[must_use]
    pub fn capacity(&self) -> usize {
        self.capacity
    }

    /// Returns the counters so far.
    #[must_use]
    pub fn counts(&self) -> CacheCounts {
        self.counts
    }

    /// Returns the map. Only its loaded slices can be queried.
    #[must_use]
    pub fn map(&self) -> &SliceMap {
        &self.map
    }

    /// Loads these slices if they are missing, and requests the next ones in the direction of
    /// movement. `feet` is the height of the feet in the map's coordinates.
    ///
    /// # Errors
    /// If a slice cannot be loaded; the error names its file.
    pub fn want(&mut self, slices: RangeInclusive<u32>, feet: f64) -> Result<&SliceMap, StoreError> {
        while let Some(arrived) = self.loader.as_ref().and_then(Loader::arrived) {
            self.receive(arrived);
        }
        let mut waited = false;
        for slice in slices.clone() {
            if self.kept.contains(&slice) {
                self.counts.hits += 1;
                waited |= self.complete(slice)?;
            } else {
                self.counts.misses += 1;
                waited = true;
                let image = self.folder.load(slice)?;
                self.make_room(&slices, &slices);
                self.kept.push(slice);
                self.put(slice, image);
            }
        }
        self.counts.stalls += u64::from(waited);
        self.ask_ahead(&slices, feet);
        Ok(&self.map)
    }

    /// Loads a slice that has a place if it has not arrived. Returns `true` if it had to be loaded.
    ///
    /// Does not wait for the thread: a thread that has begun to load the slice may wait for a
    /// processor longer than loading takes.
    fn complete(&mut self, slice: u32) -> Result<bool, StoreError> {
        if self.map.slice(slice).is_ok() {
            return Ok(false);
        }
        self.forget(slice);
        match self.folder.load(slice) {
            Ok(image) => self.put(slice, image),
            Err(fault) => {
                self.kept.retain(|kept| *kept != slice);
                return Err(fault);
            }
        }
        Ok(true)
    }

    /// Stores a slice that the thread has loaded, unless it is present already or has lost its
    /// place. An error is reported when the slice is requested.
    fn receive(&mut self, (slice, image): (u32, Result<Slice, StoreError>)) {
        if let Ok(image) = image
            && self.kept.contains(&slice)
            && self.map.slice(slice).is_err()
        {
            self.put(slice, image);
        }
    }

    /// Withdraws the request for a slice.
    fn forget(&self, slice: u32) {
        if let Some(loader) = &self.loader {
            loader.withdraw(slice);
        }
    }

    fn put(&mut self, slice: u32, image: Slice) {
        // Equal images share memory.
        let checksums = self.folder.checksums();
        let same = self.kept.iter().filter(|s| checksums[**s as usize] == checksums[slice as usize]);
        let known = same.filter_map(|s| self.map.slices()[*s as usize].clone()).next();
        self.map.put(slice, Some(known.unwrap_or_else(|| Arc::new(image))));
    }

    /// If the cache is full, evicts the slice that is furthest from the middle of the wanted slices
    /// and not in `spared`. Returns `true` if there is a free place.
    fn make_room(&mut self, wanted: &RangeInclusive<u32>, spared: &RangeInclusive<u32>) -> bool {
        if self.kept.len() < self.capacity {
            return true;
        }
        // Twice the distance from the middle.
        let away = |s: u32| (2 * i64::from(s) - i64::from(*wanted.start()) - i64::from(*wanted.end())).abs();
        let candidates = (0..self.kept.len()).filter(|&i| !spared.contains(&self.kept[i]));
        let furthest = candidates.max_by_key(|&i| (away(self.kept[i]), self.kept[i]));
        if let Some(i) = furthest {
            let slice = self.kept.swap_remove(i);
            self.forget(slice);
            self.map.put(slice, None);
        }
        furthest.is_some()
    }

    /// Requests slices beyond the wanted ones, on the side that the avatar moves to. They get half
    /// of the free places, since the avatar may turn round.
    fn ask_ahead(&mut self, slices: &RangeInclusive<u32>, feet: f64) {
        let before = *self.feet.get_or_insert(feet);
        // The unevenness of a floor does not count as movement.
        if (feet - before).abs() >= self.map.grid().slice_height {
            self.is_rising = Some(feet > before);
            self.feet = Some(feet);
        }
        let Some(is_rising) = self.is_rising.filter(|_| self.loader.is_some()) else { return };
        let (first, last) = (*slices.start(), *slices.end());
        let room = u32::try_from(self.capacity.saturating_sub(slices.clone().count())).unwrap_or(0);
        let many = room.div_ceil(2);
        let spared = if is_rising {
            first..=last.saturating_add(many).min(self.map.grid().counts[2] - 1)
        } else {
            first.saturating_sub(many)..=last
        };
        // The nearest first.
        let ahead =
            (1..=many).filter_map(|i| if is_rising { last.checked_add(i) } else { first.checked_sub(i) });
        for slice in ahead.filter(|slice| spared.contains(slice)) {
            let is_new = !self.kept.contains(&slice) && self.make_room(slices, &spared);
            if is_new && self.loader.as_ref().is_some_and(|loader| loader.ask(slice)) {
                self.kept.push(slice);
            }
        }
    }
}

impl Building for SliceCache {
    type Error = StoreError;

    fn grid(&self) -> &Grid {
        self.map.grid()
    }

    fn with_slices(&mut self, slices: RangeInclusive<u32>, feet: f64) -> Result<&SliceMap, StoreError> {
        if slices.is_empty() {
            return Ok(&self.map);
        }
        self.want(slices, feet)
    }
}

/// A thread that loads slices; it ends when the cache does.
#[derive(Debug)]
struct Loader {
    wanted: Arc<Mutex<VecDeque<u32>>>,
    /// A message for each requested slice.
    calls: Sender<()>,
    loaded: Receiver<(u32, Result<Slice, StoreError>)>,
}

impl Loader {
    /// Starts the thread. Returns `None` if that fails; then nothing is loaded ahead.
    fn start(folder: SliceFolder) -> Option<Self> {
        let wanted = Arc::new(Mutex::new(VecDeque::new()));
        let (calls, requests) = channel::<()>();
        let (answers, loaded) = channel();
        let queue = Arc::clone(&wanted);
        let load = move || {
            while requests.recv().is_ok() {
                // A withdrawn slice leaves a message without a slice.
                let next = locked(&queue).pop_front();
                if next.is_some_and(|slice| answers.send((slice, folder.load(slice))).is_err()) {
                    return;
                }
            }
        };
        thread::Builder::new().name("slices".into()).spawn(load).ok()?;
        Some(Self { wanted, calls, loaded })
    }

    fn ask(&self, slice: u32) -> bool {
        locked(&self.wanted).push_back(slice);
        self.calls.send(()).is_ok()
    }

    /// Withdraws the request for a slice, unless it is being loaded already.
    fn withdraw(&self, slice: u32) {
        locked(&self.wanted).retain(|waiting| *waiting != slice);
    }

    fn arrived(&self) -> Option<(u32, Result<Slice, StoreError>)> {
        self.loaded.try_recv().ok()
    }
}

/// Locks the queue. A queue of numbers stays valid even if a thread panicked.
fn locked(queue: &Mutex<VecDeque<u32>>) -> MutexGuard<'_, VecDeque<u32>> {
    queue.lock().unwrap_or_else(PoisonError::into_inner)
}
