//! `Scan`: a prepared scan, in memory or in a file.

use std::io::Write;
use std::ops::Deref;
use std::path::Path;
use std::sync::Arc;

use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildError, BuildOptions, HierarchyMeta, PointHierarchy};
use nearmiss_query::ScanView;
use nearmiss_store::{Bytes, Check, File, Writer};
use serde::{Deserialize, Serialize};

pub use nearmiss_hierarchy::LoadError;
pub use nearmiss_store::WriteError as SaveError;

/// What a container of ours holds.
const KIND: [u8; 4] = *b"SCAN";

/// Version of the layout of a scan's sections and metadata. Older versions are refused by name.
const VERSION: u32 = 3;

/// What a scan's file holds beside arrays.
#[derive(Debug, Serialize, Deserialize)]
struct ScanMeta {
    hierarchy: HierarchyMeta,
}

/// A scan prepared for queries. A clone costs a reference count; it may be shared between threads.
///
/// Derefs to its [`PointHierarchy`].
#[derive(Debug, Clone)]
pub struct Scan {
    hierarchy: Arc<PointHierarchy>,
}

impl Deref for Scan {
    type Target = PointHierarchy;

    fn deref(&self) -> &PointHierarchy {
        &self.hierarchy
    }
}

impl Scan {
    /// Prepares `cloud`: about a second and a half for a million points on two cores.
    ///
    /// # Errors
    /// Names the option that is out of range.
    pub fn build(cloud: &PointCloud, options: &BuildOptions) -> Result<Self, BuildError> {
        Ok(Self { hierarchy: Arc::new(PointHierarchy::build(cloud, options)?) })
    }

    /// Saves the scan, replacing a file that is there in one step; returns its length in bytes.
    ///
    /// # Errors
    /// When the file cannot be written; one that was there before is then whole.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<u64, SaveError> {
        let meta = self.meta();
        self.writer(&meta)?.save(path)
    }

    /// Writes what [`Scan::save`] would; returns its length in bytes.
    ///
    /// # Errors
    /// When `out` fails.
    pub fn write_to(&self, out: impl Write) -> Result<u64, SaveError> {
        let meta = self.meta();
        self.writer(&meta)?.write_to(out)
    }

    fn meta(&self) -> ScanMeta {
        ScanMeta { hierarchy: self.hierarchy.meta() }
    }

    fn writer(&self, meta: &ScanMeta) -> Result<Writer<'_>, SaveError> {
        let mut writer = Writer::new(KIND, VERSION);
        writer.metadata(meta)?;
        self.hierarchy.add_to(&mut writer)?;
        Ok(writer)
    }

    /// Opens a saved scan by mapping it: nothing is copied, and with [`Check::Structure`] little is read.
    ///
    /// [`Check::Structure`] looks through the nodes and their boxes, for files one has written oneself.
    /// [`Check::Full`], for all others, compares checksums too, and looks at every number of every point: what it
    /// lets pass could have been written by [`Scan::save`]. Either way a query ends, and never leaves its arrays.
    ///
    /// The file must not be changed in place while it is open (see `nearmiss_store::File::open`); replacing it
    /// by [`Scan::save`] is fine.
    ///
    /// # Errors
    /// When the file cannot be opened, is no prepared scan, of another version, damaged, or contradicts itself.
    pub fn open(path: impl AsRef<Path>, check: Check) -> Result<Self, LoadError> {
        Self::load(&File::open(path, check)?, check)
    }

    /// Reads a saved scan into memory.
    ///
    /// # Errors
    /// As [`Scan::open`].
    pub fn read(path: impl AsRef<Path>, check: Check) -> Result<Self, LoadError> {
        Self::load(&File::read(path, check)?, check)
    }

    /// A scan from the bytes that [`Scan::save`] or [`Scan::write_to`] wrote.
    ///
    /// # Errors
    /// As [`Scan::open`].
    pub fn from_bytes(bytes: impl Into<Bytes>, check: Check) -> Result<Self, LoadError> {
        Self::load(&File::from_bytes(bytes, check)?, check)
    }

    fn load(file: &File, check: Check) -> Result<Self, LoadError> {
        file.expect(KIND, VERSION..=VERSION)?;
        let meta: ScanMeta = file.metadata()?;
        Ok(Self { hierarchy: Arc::new(PointHierarchy::load(file, meta.hierarchy, check)?) })
    }

    /// The scan in a pose, which leads from the frame of its input to the world.
    #[must_use]
    pub fn at(&self, pose: &Pose) -> ScanView<'_> {
        ScanView::new(&self.hierarchy, pose)
    }
}
