//! The two things that `collide` and `distance` compare: two scans, or a scan and a mesh.

use nearmiss::{
    Answer, Budget, CollideOptions, CollidePlan, Contact, ContactGroup, Contacts, Distance, DistanceOptions,
    DistancePlan, Interior, ManifoldPoint, Mesh, MeshScanPair, MeshScanPlan, Pair, Penetration, Placed,
    PlacedMesh, PlanError, Pose, Proof, Scan, Scratch, Semantics,
};

use crate::contacts::{ContactArgs, Grouped};
use crate::posing::Posable;
use crate::sentence::{self, far_apart, world_bounds};
use crate::units::{SizeCheck, diagonal};

/// Two things that can be compared, in the order of the command line.
#[derive(Debug)]
pub(crate) enum Bodies {
    Scans([Scan; 2]),
    /// The mesh is a if `mesh_is_a`.
    MeshAndScan {
        mesh: Mesh,
        scan: Scan,
        mesh_is_a: bool,
    },
}

/// A validated question about bodies.
#[derive(Debug)]
pub(crate) enum Plan {
    Scans(CollidePlan),
    MeshAndScan(MeshScanPlan),
}

/// The insides of bodies, for their penetration.
#[derive(Debug)]
pub(crate) enum Insides {
    Scans([Interior; 2]),
    /// The closed parts of the mesh are its inside.
    MeshAndScan(Mesh, Interior),
}

impl Insides {
    /// Returns `true` if one of the bodies encloses a solid.
    pub(crate) fn has_solid(&self) -> bool {
        match self {
            Self::Scans(interiors) => interiors.contains(&Interior::Solid),
            Self::MeshAndScan(mesh, interior) => mesh.solid().is_closed() || *interior == Interior::Solid,
        }
    }
}

impl Plan {
    /// The options that were validated.
    pub(crate) fn options(&self) -> &CollideOptions {
        match self {
            Self::Scans(plan) => plan.options(),
            Self::MeshAndScan(plan) => plan.options(),
        }
    }
}

/// Bodies at poses.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Views<'a> {
    Scans([Placed<'a>; 2]),
    MeshAndScan { mesh: PlacedMesh<'a>, scan: Placed<'a>, mesh_is_a: bool },
}

/// The outputs beside an answer, each if it is wanted.
#[derive(Debug, Default)]
pub(crate) struct Wanted {
    pub(crate) proof: Option<Proof>,
    pub(crate) contacts: Option<Contacts>,
    pub(crate) manifold: Option<Vec<ManifoldPoint>>,
}

impl Bodies {
    /// Returns the scan that defines the options: the first one.
    pub(crate) fn scan(&self) -> &Scan {
        match self {
            Self::Scans([a, _]) => a,
            Self::MeshAndScan { scan, .. } => scan,
        }
    }

    /// Returns both bodies, to be posed.
    pub(crate) fn posable(&self) -> [&(dyn Posable + Sync); 2] {
        match self {
            Self::Scans([a, b]) => [a, b],
            Self::MeshAndScan { mesh, scan, mesh_is_a: true } => [mesh, scan],
            Self::MeshAndScan { mesh, scan, mesh_is_a: false } => [scan, mesh],
        }
    }

    /// Returns the insides of the bodies: those of scans as given, that of a mesh by its closed parts.
    pub(crate) fn insides(&self, interiors: [Interior; 2]) -> Insides {
        match self {
            Self::Scans(_) => Insides::Scans(interiors),
            Self::MeshAndScan { mesh, mesh_is_a, .. } => {
                Insides::MeshAndScan(mesh.clone(), interiors[usize::from(*mesh_is_a)])
            }
        }
    }

    /// Validates options of a collision query.
    pub(crate) fn plan(&self, options: &CollideOptions) -> Result<Plan, PlanError> {
        match self {
            Self::Scans([a, b]) => CollidePlan::new(options, a, b).map(Plan::Scans),
            Self::MeshAndScan { scan, .. } => MeshScanPlan::new(options, scan).map(Plan::MeshAndScan),
        }
    }

    /// Validates options of a distance query.
    pub(crate) fn distance_plan(&self, options: &DistanceOptions) -> Result<DistancePlan, PlanError> {
        match self {
            Self::Scans([a, b]) => DistancePlan::new(options, a, b),
            Self::MeshAndScan { scan, .. } => DistancePlan::against_mesh(options, scan),
        }
    }

    /// Places both bodies.
    pub(crate) fn at(&self, poses: &[Pose; 2]) -> Views<'_> {
        match self {
            Self::Scans([a, b]) => Views::Scans([a.at(&poses[0]), b.at(&poses[1])]),
            Self::MeshAndScan { mesh, scan, mesh_is_a } => {
                let of_mesh = usize::from(!mesh_is_a);
                Views::MeshAndScan {
                    mesh: mesh.at(&poses[of_mesh]),
                    scan: scan.at(&poses[1 - of_mesh]),
                    mesh_is_a: *mesh_is_a,
                }
            }
        }
    }

    /// Returns the unit to which lengths along a path are rounded: a hundredth of the smaller sampling
    /// radius.
    pub(crate) fn unit(&self) -> f64 {
        let radius = match self {
            Self::Scans([a, b]) => a.sampling_radius().min(b.sampling_radius()),
            Self::MeshAndScan { scan, .. } => scan.sampling_radius(),
        };
        radius / 100.0
    }
}

impl<'a> Views<'a> {
    /// Returns both scans if there are two.
    pub(crate) fn scans(&self) -> Option<[&Placed<'a>; 2]> {
        match self {
            Self::Scans(scans) => Some(scans.each_ref()),
            Self::MeshAndScan { .. } => None,
        }
    }

    /// Returns what the sources of a contact count: points or triangles.
    pub(crate) fn items(&self) -> [&'static str; 2] {
        match self {
            Self::Scans(_) => ["point"; 2],
            Self::MeshAndScan { mesh_is_a: true, .. } => ["triangle", "point"],
            Self::MeshAndScan { mesh_is_a: false, .. } => ["point", "triangle"],
        }
    }

    /// Answers a collision query, and fills the outputs that are wanted. A proof is empty and a
    /// manifold absent unless two scans are compared.
    pub(crate) fn collide(
        &self,
        plan: &Plan,
        budget: &Budget,
        wanted: &mut Wanted,
        scratch: &mut Scratch,
    ) -> Answer {
        match (self, plan) {
            (Self::Scans([a, b]), Plan::Scans(plan)) => {
                let pair = Pair::new(*a, *b).within(budget);
                let mut question = pair.question();
                if let Some(proof) = &mut wanted.proof {
                    question = question.proof(proof);
                }
                if let Some(contacts) = &mut wanted.contacts {
                    question = question.contacts(contacts);
                }
                if let Some(manifold) = &mut wanted.manifold {
                    question = question.manifold(manifold);
                }
                question.collide(plan, scratch)
            }
            (Self::MeshAndScan { mesh, scan, mesh_is_a }, Plan::MeshAndScan(plan)) => {
                let pair = MeshScanPair::new(*scan, *mesh).within(budget);
                let mut answer = match &mut wanted.contacts {
                    Some(contacts) => pair.contacts(plan, contacts, scratch),
                    None => pair.collide(plan, scratch),
                };
                if *mesh_is_a {
                    if let nearmiss::Verdict::Intersecting { contact, .. } = &mut answer.verdict {
                        swap(contact);
                    }
                    wanted.contacts.iter_mut().flat_map(|all| &mut all.contacts).for_each(swap);
                }
                answer
            }
            // Plans come from the same bodies.
            _ => Answer::UNASKED,
        }
    }

    /// Bounds the penetration with these insides, which are those of the same bodies. The direction is that
    /// in which b moves.
    pub(crate) fn penetration(
        &self,
        plan: &Plan,
        insides: &Insides,
        budget: &Budget,
        scratch: &mut Scratch,
    ) -> Option<Penetration> {
        match (self, plan, insides) {
            (Self::Scans([a, b]), Plan::Scans(plan), Insides::Scans(interiors)) => {
                Some(Pair::new(*a, *b).within(budget).penetration(plan, *interiors, scratch))
            }
            (
                Self::MeshAndScan { mesh, scan, mesh_is_a },
                Plan::MeshAndScan(plan),
                Insides::MeshAndScan(own, interior),
            ) => {
                let pair = MeshScanPair::new(*scan, *mesh).within(budget);
                let mut found = pair.penetration(plan, (*interior, own.solid()), scratch);
                if *mesh_is_a {
                    turn(&mut found);
                }
                Some(found)
            }
            _ => None,
        }
    }

    /// Bounds the distance.
    pub(crate) fn distance(&self, plan: &DistancePlan, budget: &Budget, scratch: &mut Scratch) -> Distance {
        match self {
            Self::Scans([a, b]) => Pair::new(*a, *b).within(budget).distance(plan, scratch),
            Self::MeshAndScan { mesh, scan, mesh_is_a } => {
                let mut found = MeshScanPair::new(*scan, *mesh).within(budget).distance(plan, scratch);
                if *mesh_is_a {
                    found.points.swap(0, 1);
                    found.sources.swap(0, 1);
                }
                found
            }
        }
    }

    /// Returns the distance, found within a budget, to state it with a separation.
    pub(crate) fn beside(&self, semantics: Semantics, budget: &Budget) -> Option<Distance> {
        let options = DistanceOptions::default().with_semantics(semantics);
        let plan = match self {
            Self::Scans([a, b]) => DistancePlan::new(&options, a.scan(), b.scan()),
            Self::MeshAndScan { scan, .. } => DistancePlan::against_mesh(&options, scan.scan()),
        };
        Some(self.distance(&plan.ok()?, budget, &mut Scratch::default()))
    }

    /// Groups `contacts` by the link length of the options, or else by the default for these scans.
    pub(crate) fn group(&self, contacts: &[Contact], args: &ContactArgs) -> Grouped {
        match self {
            Self::Scans([a, b]) => args.group(contacts, [a, b]),
            Self::MeshAndScan { scan, .. } => args.group(contacts, [scan; 2]),
        }
    }

    /// Returns how far b must move out of each group of contacts, given the penetration of the bodies.
    pub(crate) fn depths(
        &self,
        plan: &Plan,
        insides: &Insides,
        (contacts, groups): (&[Contact], &[ContactGroup]),
        whole: &Penetration,
        budget: &Budget,
    ) -> Vec<Penetration> {
        let groups: Vec<&ContactGroup> = groups.iter().collect();
        match (self, plan, insides) {
            (Self::Scans([a, b]), Plan::Scans(plan), Insides::Scans(interiors)) => {
                let pair = Pair::new(*a, *b).within(budget);
                pair.depths((contacts, &groups), (plan, *interiors), whole, &mut |_| ())
            }
            (
                Self::MeshAndScan { mesh, scan, mesh_is_a },
                Plan::MeshAndScan(plan),
                Insides::MeshAndScan(own, interior),
            ) => {
                let pair = MeshScanPair::new(*scan, *mesh).within(budget);
                let of = (plan, *interior, own.solid());
                if !mesh_is_a {
                    return pair.depths((contacts, &groups), of, whole, &mut |_| ());
                }
                let (mut contacts, mut whole) = (contacts.to_vec(), *whole);
                contacts.iter_mut().for_each(swap);
                turn(&mut whole);
                let mut found = pair.depths((&contacts, &groups), of, &whole, &mut |_| ());
                found.iter_mut().for_each(turn);
                found
            }
            _ => Vec::new(),
        }
    }

    /// Returns the unit to which lengths are rounded: a hundredth of the smaller sampling radius.
    pub(crate) fn unit(&self) -> f64 {
        match self {
            Self::Scans([a, b]) => sentence::unit([a, b]),
            Self::MeshAndScan { scan, .. } => sentence::unit([scan; 2]),
        }
    }

    /// Warns about units once if the sizes differ too much.
    pub(crate) fn compare_sizes(&self, check: &SizeCheck) {
        match self {
            Self::Scans([a, b]) => check.compare([a, b]),
            Self::MeshAndScan { mesh, scan, mesh_is_a } => check.compare_sizes(|| {
                let of_mesh = diagonal(mesh.mesh().bounds()) * mesh.pose().scale();
                let of_scan = diagonal(&world_bounds(scan));
                if *mesh_is_a { [of_mesh, of_scan] } else { [of_scan, of_mesh] }
            }),
        }
    }

    /// Returns the answer as a sentence. It states a clearance only if `distance` is given.
    pub(crate) fn sentence(
        &self,
        answer: &Answer,
        options: &CollideOptions,
        distance: Option<&Distance>,
    ) -> String {
        match self {
            Self::Scans([a, b]) => sentence::sentence(answer, [a, b], options, distance),
            Self::MeshAndScan { scan, mesh_is_a, .. } => {
                let letter = if *mesh_is_a { "b" } else { "a" };
                sentence::against_mesh(answer, (letter, scan), options, distance)
            }
        }
    }

    /// Returns a hint if two separated bodies are further apart than the size of both.
    pub(crate) fn hint(&self, answer: &Answer) -> Option<String> {
        if !answer.verdict.is_separated() {
            return None;
        }
        far_apart(match self {
            Self::Scans([a, b]) => [world_bounds(a), world_bounds(b)],
            Self::MeshAndScan { mesh, scan, .. } => {
                let corners = mesh.mesh().bounds().corners().map(|p| mesh.pose().apply(p));
                [nearmiss::Aabb::of(corners), world_bounds(scan)]
            }
        })
    }
}

/// Turns the shift of one body into that of the other one.
fn turn(found: &mut Penetration) {
    // No negative zeros.
    found.direction = found.direction.map(|x| 0.0 - x);
}

/// Exchanges what a contact says about a and b.
pub(crate) fn swap(contact: &mut Contact) {
    contact.sources.swap(0, 1);
    if let Some(normals) = &mut contact.normals {
        normals.swap(0, 1);
    }
}
