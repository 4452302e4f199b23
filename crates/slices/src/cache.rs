//! So many slices in memory, loaded as an avatar needs them.
//!
//! S4, §3.1: new slices are loaded until there are n; from then on each takes the place of the one furthest
//! from the avatar. Beside that a thread of its own loads what comes next in the direction of movement (the
//! paper's figures are without one).

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

/// How slices are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct CacheOptions {
    /// n: how many slices are kept in memory. Raised to what is needed at once. Default: 16, as in S4's Fig.
    /// 6.
    pub slices: u32,
    /// Whether a thread loads ahead. Default: yes.
    pub prefetch: bool,
}

impl Default for CacheOptions {
    fn default() -> Self {
        Self { slices: 16, prefetch: true }
    }
}

impl CacheOptions {
    /// The same with so many slices.
    #[must_use]
    pub const fn with_slices(self, slices: u32) -> Self {
        Self { slices, ..self }
    }

    /// The same with or without loading ahead.
    #[must_use]
    pub const fn with_prefetch(self, prefetch: bool) -> Self {
        Self { prefetch, ..self }
    }
}

/// What a cache has done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CacheCounts {
    /// Slices wanted that were there, or on their way since an earlier step.
    pub hits: u64,
    /// Slices wanted that nobody had asked for.
    pub misses: u64,
    /// How often somebody had to wait for the disk. Depends on how fast that is, unlike the others.
    pub stalls: u64,
}

/// Some slices of a folder in memory, and a thread that loads others.
///
/// Which slices are kept follows from what was wanted, in order, never from how fast the disk is: a slice has
/// its place from when it is asked for.
#[derive(Debug)]
pub struct SliceCache {
    folder: SliceFolder,
    map: SliceMap,
    /// Which slices have a place, in no order; those not yet on the map are on their way.
    kept: Vec<u32>,
    capacity: usize,
    /// Where the feet were when they last were a slice's height from where they had been.
    feet: Option<f64>,
    /// Whether they went up to there, if they have gone anywhere.
    is_rising: Option<bool>,
    counts: CacheCounts,
    loader: Option<Loader>,
}

impl SliceCache {
    /// A cache without slices. `span` is how many are needed at once
    /// ([`Avatar::slices`](crate::Avatar::slices)): fewer are never kept.
    #[must_use]
    pub fn new(folder: &SliceFolder, options: &CacheOptions, span: u32) -> Self {
        // No more than there are.
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

    /// How many slices are kept at most; more than asked for where an avatar needs more at once.
    #[must_use]
    pub fn capacity(&self) -> usize {
        self.capacity
    }

    /// What it has done so far.
    #[must_use]
    pub fn counts(&self) -> CacheCounts {
        self.counts
    }

    /// The map, of which the loaded slices can be asked.
    #[must_use]
    pub fn map(&self) -> &SliceMap {
        &self.map
    }

    /// Sees to it that these slices are loaded, for feet at this height of the map's coordinates, and asks
    /// for those that come next.
    ///
    /// # Errors
    /// Names the file of a slice that cannot be loaded.
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

    /// Loads a slice that has a place, if it is not there yet. Tells whether that took any waiting.
    ///
    /// A thread that has begun to load it may have to wait for a processor longer than loading takes, so
    /// nobody waits for it.
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

    /// Takes in what the thread has loaded, unless it is there already or its place has gone to another. What
    /// cannot be loaded is told when it is wanted.
    fn receive(&mut self, (slice, image): (u32, Result<Slice, StoreError>)) {
        if let Ok(image) = image
            && self.kept.contains(&slice)
            && self.map.slice(slice).is_err()
        {
            self.put(slice, image);
        }
    }

    /// Asks the thread for a slice no more.
    fn forget(&self, slice: u32) {
        if let Some(loader) = &self.loader {
            loader.withdraw(slice);
        }
    }

    fn put(&mut self, slice: u32, image: Slice) {
        // What is the same image already takes no memory again.
        let checksums = self.folder.checksums();
        let same = self.kept.iter().filter(|s| checksums[**s as usize] == checksums[slice as usize]);
        let known = same.filter_map(|s| self.map.slices()[*s as usize].clone()).next();
        self.map.put(slice, Some(known.unwrap_or_else(|| Arc::new(image))));
    }

    /// Takes the place of the slice furthest from the middle of those wanted, if all places are taken, but of
    /// none in `spared`. Tells whether there is room.
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

    /// Asks for slices beyond those wanted, on the side the avatar moves to: half of those that there is room
    /// for, as it may turn round.
    fn ask_ahead(&mut self, slices: &RangeInclusive<u32>, feet: f64) {
        let before = *self.feet.get_or_insert(feet);
        // Unevenness of a floor is no movement.
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
    /// One for each slice that is asked for.
    calls: Sender<()>,
    loaded: Receiver<(u32, Result<Slice, StoreError>)>,
}

impl Loader {
    /// None where no thread can be started: then nothing is loaded ahead.
    fn start(folder: SliceFolder) -> Option<Self> {
        let wanted = Arc::new(Mutex::new(VecDeque::new()));
        let (calls, requests) = channel::<()>();
        let (answers, loaded) = channel();
        let queue = Arc::clone(&wanted);
        let load = move || {
            while requests.recv().is_ok() {
                // What was withdrawn leaves a request without a slice.
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

    /// Asks for a slice no more; too late if it is being loaded.
    fn withdraw(&self, slice: u32) {
        locked(&self.wanted).retain(|waiting| *waiting != slice);
    }

    fn arrived(&self) -> Option<(u32, Result<Slice, StoreError>)> {
        self.loaded.try_recv().ok()
    }
}

/// A queue of numbers is whole whatever became of a thread.
fn locked(queue: &Mutex<VecDeque<u32>>) -> MutexGuard<'_, VecDeque<u32>> {
    queue.lock().unwrap_or_else(PoisonError::into_inner)
}
