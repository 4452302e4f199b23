//! The touch of two bodies of a world.

use serde::{Deserialize, Serialize};

use crate::ask::answer::{Answer, Evidence, Reason, Verdict};
use crate::ask::options::CollidePlan;
use crate::many::body::BodyPair;
use crate::mesh::answer::MeshVerdict;
use crate::mesh::pair::MeshPair;
use crate::mesh_scan::plan::MeshScanPlan;
use crate::question::Scratch;
use crate::solid::answer::ShapeVerdict;
use crate::solid::plan::ShapePlan;

/// The verdict on whether two bodies touch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum BodyVerdict {
    /// The bodies touch, or are within the margin.
    Touching {
        /// A place where they do, in the world; midway between the bodies if they are apart.
        point: [f64; 3],
        /// The certainty.
        evidence: Evidence,
    },
    /// The bodies are further apart than the margin.
    Separated {
        /// The certainty.
        evidence: Evidence,
    },
    /// The query could not decide.
    Undecided(Reason),
}

impl BodyVerdict {
    /// Returns `true` if the bodies touch.
    #[must_use]
    pub const fn is_touching(&self) -> bool {
        matches!(self, Self::Touching { .. })
    }

    /// Returns `true` if the bodies are apart.
    #[must_use]
    pub const fn is_separated(&self) -> bool {
        matches!(self, Self::Separated { .. })
    }
}

/// A verdict about two bodies, and the length below which the scans among them do not determine it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BodyAnswer {
    /// The verdict.
    pub verdict: BodyVerdict,
    /// The band, in world units; 0 for meshes and shapes, infinite for invalid poses and shapes.
    pub band: f64,
}

impl BodyAnswer {
    /// The answer about a pair with an invalid pose or shape.
    const fn invalid(reason: Reason) -> Self {
        Self { verdict: BodyVerdict::Undecided(reason), band: f64::INFINITY }
    }

    /// The answer about exact bodies, given bounds of their distance and their nearest points.
    fn exact((lower, upper): (f64, f64), [p, q]: [[f64; 3]; 2], margin: f64) -> Self {
        let evidence = Evidence::Certified;
        let verdict = if lower > margin {
            BodyVerdict::Separated { evidence }
        } else if upper <= margin || upper - lower <= 1e-8 * upper.max(margin) {
            let point = [0, 1, 2].map(|k| 0.5 * (p[k] + q[k]));
            BodyVerdict::Touching { point, evidence }
        } else {
            let likelihood = 0.5;
            BodyVerdict::Undecided(Reason::Budget { likelihood })
        };
        Self { verdict, band: 0.0 }
    }
}

impl BodyPair<'_> {
    /// Decides whether the bodies touch, or are within the margin of `plan`.
    ///
    /// `plan` is for any two scans of the world, or for their metric ([`CollidePlan::of_metric`]). It gives
    /// scans their meaning. Meshes and shapes are exact. A shape is solid. A mesh is a shell: what is inside
    /// without touching it is separate. The method, order and coverings of the plan count for two scans only.
    /// See [`Pair::collide`](crate::Pair::collide), [`MeshScanPair::collide`](crate::MeshScanPair::collide),
    /// [`MeshPair::collide`],
    /// [`ShapeScanPair::touch`](crate::ShapeScanPair::touch),
    /// [`ShapeMeshPair::distance`](crate::ShapeMeshPair::distance) and
    /// [`ShapePair::distance`](crate::ShapePair::distance). Does not allocate once `scratch` is warm.
    ///
    /// ```
    /// use nearmiss_geometry::{PointCloud, Pose};
    /// use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
    /// use nearmiss_query::{Bodies, CollideOptions, CollidePlan, Scratch, Shape, World};
    ///
    /// let points: Vec<[f32; 3]> =
    ///     (0..2500_u16).map(|i| [f32::from(i % 50) * 0.02, f32::from(i / 50) * 0.02, 0.0]).collect();
    /// let floor = PointHierarchy::build(&PointCloud::from_positions(&points)?, &BuildOptions::default())?;
    /// let plan = CollidePlan::of_metric(&CollideOptions::default(), floor.metric())?;
    ///
    /// // A ball in a floor, and one on top of it.
    /// let mut world = World::with_shapes();
    /// world.insert(&floor, &Pose::IDENTITY);
    /// let ball = Shape::Sphere { centre: [0.5, 0.5, 0.0], radius: 0.1 };
    /// world.insert_shape(ball, &Pose::from_translation([0.0, 0.0, 0.09]));
    /// world.insert_shape(ball, &Pose::from_translation([0.0, 0.0, 0.28]));
    ///
    /// let (mut near, mut scratch) = (Vec::new(), Scratch::default());
    /// world.near_pairs(Bodies::All, plan.reach(), &mut near);
    /// let pairs = near.iter().filter_map(|&pair| world.body_pair(pair));
    /// let touching = pairs.filter(|pair| pair.touch(&plan, &mut scratch).verdict.is_touching());
    /// assert_eq!(touching.count(), 2, "the floor and the lower ball, and both balls");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn touch(&self, plan: &CollidePlan, scratch: &mut Scratch) -> BodyAnswer {
        let margin = plan.options().margin;
        match self {
            Self::Scans(pair) => of_scans(&pair.collide(plan, scratch)),
            Self::MeshAndScan { pair, .. } => of_scans(&pair.collide(&MeshScanPlan::of_pair(plan), scratch)),
            Self::Meshes(pair) => of_meshes(pair, margin, scratch),
            Self::ShapeAndScan { pair, .. } => {
                let answer = pair.touch(&ShapePlan::of_plan(plan), scratch);
                let verdict = match answer.verdict {
                    ShapeVerdict::Touching { point, evidence, .. } => {
                        BodyVerdict::Touching { point, evidence }
                    }
                    ShapeVerdict::Separated { evidence } => BodyVerdict::Separated { evidence },
                    ShapeVerdict::Undecided(reason) => BodyVerdict::Undecided(reason),
                };
                BodyAnswer { verdict, band: answer.band }
            }
            Self::ShapeAndMesh { pair, .. } => {
                let evidence = Evidence::Certified;
                match pair.distance(margin, scratch) {
                    Some(found) => BodyAnswer::exact((found.lower, found.upper), found.points, margin),
                    None => match pair.shape().refused_in(pair.mesh().stored_to_world()) {
                        Some(reason) => BodyAnswer::invalid(reason),
                        None => BodyAnswer { verdict: BodyVerdict::Separated { evidence }, band: 0.0 },
                    },
                }
            }
            Self::Shapes(pair) => {
                let [a, b] = pair.shapes();
                match pair.distance() {
                    Some(found) => BodyAnswer::exact((found.lower, found.upper), found.points, margin),
                    None => {
                        let reason = a.refused_in(b.pose()).or_else(|| b.refused_in(a.pose()));
                        BodyAnswer::invalid(reason.unwrap_or(Reason::Shape))
                    }
                }
            }
        }
    }
}

fn of_scans(answer: &Answer) -> BodyAnswer {
    let verdict = match answer.verdict {
        Verdict::Intersecting { contact, evidence } => {
            BodyVerdict::Touching { point: contact.point, evidence }
        }
        Verdict::Separated { evidence, .. } => BodyVerdict::Separated { evidence },
        Verdict::Undecided(reason) => BodyVerdict::Undecided(reason),
    };
    BodyAnswer { verdict, band: answer.band }
}

fn of_meshes(pair: &MeshPair<'_>, margin: f64, scratch: &mut Scratch) -> BodyAnswer {
    let answer = pair.collide(scratch.meshes());
    let evidence = Evidence::Certified;
    let verdict = match answer.verdict {
        MeshVerdict::Intersecting(contact) => BodyVerdict::Touching { point: contact.point, evidence },
        MeshVerdict::Separated if margin > 0.0 => {
            let found = pair.distance(scratch.meshes());
            return BodyAnswer::exact((found.lower, found.upper), found.points, margin);
        }
        MeshVerdict::Separated => BodyVerdict::Separated { evidence },
        MeshVerdict::Undecided(_) => BodyVerdict::Undecided(Reason::Budget { likelihood: answer.likelihood }),
        MeshVerdict::Pose => return BodyAnswer::invalid(Reason::Pose),
    };
    BodyAnswer { verdict, band: 0.0 }
}
