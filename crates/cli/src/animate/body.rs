//! Moving bodies, their partners, and the tests of both.

use std::path::Path;

use clap::ValueEnum;
use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::io::{Pieces, read_in_pieces};
use nearmiss::store::File;
use nearmiss::{
    Answer, Check, CollideOptions, CollidePlan, DeformError, DistanceOptions, DistancePlan, Evidence, Mesh,
    MeshAnswer, MeshBuildOptions, MeshItself, MeshPair, MeshScanPair, MeshScanPlan, MeshScratch, MeshVerdict,
    MovingMesh, MovingScan, Pair, Placed, PlacedMesh, Pose, Renewal, Scan, Scratch, TriangleMesh, Verdict,
};

use super::frames::Frames;
use super::solid::Solid;
use crate::error::CliError;
use crate::evidence::word;
use crate::input::{self, Opening};
use crate::picture::splat;

/// How bounds follow a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
#[non_exhaustive]
pub enum AnimateMethod {
    /// Refit, and rebuild when the bounding volumes are too loose; kinetic for meshes with many query
    /// times between files, if that is faster
    Auto,
    /// Refit the bounding volumes and keep the order of triangles or points
    Refit,
    /// Prepare every frame anew
    Rebuild,
    /// Update a box only when another point becomes extremal on one of its sides (Zachmann & Weller
    /// 2006); for meshes only
    Kinetic,
}

/// How a mesh or a scan follows the frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Following {
    Auto,
    Refit,
    Rebuild,
}

impl AnimateMethod {
    /// Returns how each body follows the frames; `None` for kinetic trees.
    pub(super) fn following(self) -> Option<Following> {
        match self {
            Self::Auto => Some(Following::Auto),
            Self::Refit => Some(Following::Refit),
            Self::Rebuild => Some(Following::Rebuild),
            Self::Kinetic => None,
        }
    }
}

/// A mesh or a scan that moves.
pub(super) enum Body {
    Mesh(Box<MovingMesh>),
    Scan(Box<MovingScan>),
}

/// A mesh or a scan that stays.
pub(super) enum Still {
    Mesh(Mesh),
    Scan(Scan),
}

/// The partner of the test of a body.
#[derive(Clone, Copy)]
pub(super) enum Partner<'a> {
    /// Nothing; a mesh is tested against itself.
    Nothing,
    /// Something that moves too.
    Moving(&'a Frames),
    /// Something that stays.
    Still(&'a Still),
}

impl<'a> Partner<'a> {
    /// Returns the frames of a partner that moves.
    pub(super) fn frames(self) -> Option<&'a Frames> {
        match self {
            Self::Moving(frames) => Some(frames),
            _ => None,
        }
    }
}

/// Either of them, placed.
#[derive(Clone, Copy)]
pub(super) enum View<'a> {
    Mesh(PlacedMesh<'a>),
    Scan(Placed<'a>),
}

impl View<'_> {
    /// Returns what is seen of it.
    pub(super) fn solid(&self) -> Solid {
        match self {
            Self::Mesh(mesh) => {
                let arrays = mesh.mesh().arrays();
                let corner = |vertex: u32| Vector3::from(arrays.vertices[vertex as usize]);
                Solid::Triangles(arrays.triangles.iter().map(|triangle| triangle.map(corner)).collect())
            }
            Self::Scan(scan) => Solid::Discs((0..scan.scan().len()).map(|i| splat(scan, i)).collect()),
        }
    }
}

/// A verdict, and its evidence if it has one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found {
    pub(super) verdict: &'static str,
    pub(super) evidence: Option<&'static str>,
}

impl Found {
    /// A verdict that exact tests of triangles gave.
    pub(super) fn exact(verdict: &'static str) -> Self {
        Self { verdict, evidence: Some(word(Evidence::Certified)) }
    }

    /// Returns the verdict for people.
    pub(super) fn words(self) -> String {
        match self.evidence {
            Some(evidence) => format!("{}, {evidence}", self.verdict),
            None => self.verdict.to_owned(),
        }
    }
}

impl Body {
    /// Prepares the first frame.
    pub(super) fn first(frames: &Frames) -> Result<Self, CliError> {
        let (path, positions) = frames.first();
        let fault = |what: String| CliError::UnsuitableFile { path: path.to_owned(), what };
        let Some(triangles) = &frames.triangles else {
            let scan = MovingScan::new(positions, &nearmiss::BuildOptions::default());
            return scan.map(|scan| Self::Scan(Box::new(scan))).map_err(|cause| fault(cause.to_string()));
        };
        let mesh = TriangleMesh::new(positions.to_vec(), triangles.clone());
        let mesh = mesh.map_err(|cause| fault(cause.to_string()))?;
        // Cells serve probabilities, which are not asked for.
        let mesh = MovingMesh::new(&mesh, &MeshBuildOptions::default().with_cells(false));
        mesh.map(|mesh| Self::Mesh(Box::new(mesh))).map_err(|cause| fault(cause.to_string()))
    }

    /// Moves the body.
    pub(super) fn move_to(
        &mut self,
        positions: &[[f64; 3]],
        method: Following,
    ) -> Result<Renewal, DeformError> {
        match (self, method) {
            (Self::Mesh(mesh), Following::Auto) => mesh.move_to(positions),
            (Self::Scan(scan), Following::Auto) => scan.move_to(positions),
            (Self::Mesh(mesh), Following::Refit) => mesh.refit(positions).map(|()| Renewal::Refitted),
            (Self::Scan(scan), Following::Refit) => scan.refit(positions).map(|_| Renewal::Refitted),
            (Self::Mesh(mesh), Following::Rebuild) => mesh.rebuild(positions).map(|()| Renewal::Rebuilt),
            (Self::Scan(scan), Following::Rebuild) => scan.rebuild(positions).map(|()| Renewal::Rebuilt),
        }
    }

    /// Returns the number of bounding volumes, all of which a frame updates.
    pub(super) fn nodes(&self) -> usize {
        match self {
            Self::Mesh(mesh) => mesh.topology().len(),
            Self::Scan(scan) => scan.topology().len(),
        }
    }

    pub(super) fn view(&self) -> View<'_> {
        match self {
            Self::Mesh(mesh) => View::Mesh(mesh.at(&Pose::IDENTITY)),
            Self::Scan(scan) => View::Scan(scan.at(&Pose::IDENTITY)),
        }
    }
}

impl Still {
    /// Opens a prepared scan or mesh, or prepares a raw input: as a mesh if it has faces.
    pub(super) fn open(opening: Opening, path: &Path) -> Result<Self, CliError> {
        input::check_there(path)?;
        let is_mesh = if input::is_prepared(path) {
            File::open(path, Check::Structure).is_ok_and(|file| file.kind() == Mesh::KIND)
        } else {
            const BLOCK: usize = 1 << 20;
            let _limit = input::limit_reading(path, None);
            matches!(read_in_pieces(path, None, BLOCK)?, Pieces::Mesh { .. })
        };
        if is_mesh { opening.open_mesh(path).map(Self::Mesh) } else { opening.open(path).map(Self::Scan) }
    }

    pub(super) fn view(&self) -> View<'_> {
        match self {
            Self::Mesh(mesh) => View::Mesh(mesh.at(&Pose::IDENTITY)),
            Self::Scan(scan) => View::Scan(scan.at(&Pose::IDENTITY)),
        }
    }
}

/// The memory of all tests.
#[derive(Default)]
pub(super) struct Asking {
    of_meshes: MeshScratch,
    scratch: Scratch,
}

impl Asking {
    /// Tests two bodies.
    pub(super) fn of_two(&mut self, a: &Body, b: &Body) -> Result<Found, CliError> {
        self.ask(a.view(), b.view())
    }

    /// Tests a body against something that stays.
    pub(super) fn against(&mut self, body: &Body, still: &Still) -> Result<Found, CliError> {
        self.ask(body.view(), still.view())
    }

    /// Tests a mesh against itself; `None` for a scan.
    pub(super) fn of_itself(&mut self, body: &Body) -> Option<Found> {
        let View::Mesh(mesh) = body.view() else { return None };
        Some(of_meshes(&MeshItself::new(mesh).collide(&mut self.of_meshes)))
    }

    /// Returns the distance of two bodies.
    pub(super) fn clearance(&mut self, a: View<'_>, b: View<'_>) -> Result<f64, CliError> {
        let options = DistanceOptions::default();
        Ok(match (a, b) {
            (View::Mesh(a), View::Mesh(b)) => MeshPair::new(a, b).distance(&mut self.of_meshes).upper,
            (View::Scan(a), View::Scan(b)) => {
                let plan = DistancePlan::new(&options, a.scan(), b.scan())?;
                Pair::new(a, b).distance(&plan, &mut self.scratch).upper
            }
            (View::Mesh(mesh), View::Scan(scan)) | (View::Scan(scan), View::Mesh(mesh)) => {
                let plan = DistancePlan::new(&options, scan.scan(), scan.scan())?;
                MeshScanPair::new(scan, mesh).distance(&plan, &mut self.scratch).upper
            }
        })
    }

    fn ask(&mut self, a: View<'_>, b: View<'_>) -> Result<Found, CliError> {
        let options = CollideOptions::default().with_evidence(Evidence::Certified);
        Ok(match (a, b) {
            (View::Mesh(a), View::Mesh(b)) => of_meshes(&MeshPair::new(a, b).collide(&mut self.of_meshes)),
            (View::Scan(a), View::Scan(b)) => {
                let plan = CollidePlan::new(&options, a.scan(), b.scan())?;
                of_scans(&Pair::new(a, b).collide(&plan, &mut self.scratch))
            }
            (View::Mesh(mesh), View::Scan(scan)) | (View::Scan(scan), View::Mesh(mesh)) => {
                let plan = MeshScanPlan::new(&options, scan.scan())?;
                of_scans(&MeshScanPair::new(scan, mesh).collide(&plan, &mut self.scratch))
            }
        })
    }
}

fn of_meshes(answer: &MeshAnswer) -> Found {
    let verdict = match answer.verdict {
        MeshVerdict::Intersecting(_) => "intersecting",
        MeshVerdict::Separated => "separated",
        _ => "undecided",
    };
    // Without a budget all verdicts about triangles are exact.
    Found { verdict, evidence: Some(word(Evidence::Certified)).filter(|_| verdict != "undecided") }
}

fn of_scans(answer: &Answer) -> Found {
    let (verdict, evidence) = match answer.verdict {
        Verdict::Intersecting { evidence, .. } => ("intersecting", Some(word(evidence))),
        Verdict::Separated { evidence, .. } => ("separated", Some(word(evidence))),
        Verdict::Undecided(_) => ("undecided", None),
    };
    Found { verdict, evidence }
}
