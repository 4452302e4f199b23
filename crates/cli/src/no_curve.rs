//! The report of `curve` if no curve was found: the answers of `collide` for the same poses, as a
//! sentence and as JSON.

use nearmiss::{
    Answer, Budget, CollideOptions, CollidePlan, Contact, Detail, Evidence, Pair, Placed, PlanError, Reason,
    Scratch, Semantics, Statistics, Verdict,
};

use crate::answer_report::AnswerReport;
use crate::console::{micros_since, now};
use crate::digits::{place, rough, rounded_down};
use crate::evidence::word;
use crate::sentence::world_radius;

/// Answers for two scans without a curve, each with its time in µs.
#[derive(Debug)]
pub(crate) struct NoCurve {
    /// The answer with [`Semantics::Surface`]: curves belong to surfaces only.
    surfaces: (Answer, f64),
    /// The answer with [`Semantics::Obstacle`]: points that sample no surface may touch where no
    /// curve can be.
    obstacles: (Answer, f64),
}

impl NoCurve {
    /// Runs `collide` with both semantics, each within `budget`.
    pub(crate) fn ask([a, b]: [&Placed<'_>; 2], budget: &Budget) -> Result<Self, PlanError> {
        let mut scratch = Scratch::default();
        let mut ask = |semantics| {
            let options = CollideOptions::estimated()
                .with_semantics(semantics)
                .with_detail(Detail::Witness)
                .with_evidence(Evidence::Certified);
            let plan = CollidePlan::new(&options, a.scan(), b.scan())?;
            let start = now();
            let answer = Pair::new(*a, *b).within(budget).collide(&plan, &mut scratch);
            let micros = micros_since(start);
            Ok((answer, micros))
        };
        Ok(Self { surfaces: ask(Semantics::Surface)?, obstacles: ask(Semantics::Obstacle)? })
    }

    /// Returns the statistics of both answers.
    pub(crate) fn statistics(&self) -> [Statistics; 2] {
        [self.surfaces.0.statistics, self.obstacles.0.statistics]
    }

    /// Returns the verdict as `collide` writes it: "intersecting" if surfaces or obstacles touch,
    /// or else the verdict of the obstacles.
    pub(crate) fn word(&self) -> &'static str {
        let (surfaces, obstacles) = (self.surfaces.0.verdict, self.obstacles.0.verdict);
        if surfaces.is_intersecting() || obstacles.is_intersecting() {
            "intersecting"
        } else if obstacles.is_separated() {
            "separated"
        } else {
            "undecided"
        }
    }

    /// Returns both answers for scripts: of the surfaces, then of the obstacles.
    pub(crate) fn reports(&self) -> [AnswerReport; 2] {
        [&self.surfaces, &self.obstacles].map(|(answer, micros)| AnswerReport::new(answer, None, *micros))
    }

    /// Returns both answers as a sentence for people.
    pub(crate) fn sentence(&self, views: [&Placed<'_>; 2]) -> String {
        let [ra, rb] = views.map(world_radius);
        sentence([self.surfaces.0.verdict, self.obstacles.0.verdict], ra.min(rb) / 100.0)
    }
}

/// Returns the verdicts of the surfaces and of the obstacles in words, with lengths rounded to
/// `unit`.
fn sentence([surfaces, obstacles]: [Verdict; 2], unit: f64) -> String {
    let at = |contact: Contact, evidence: Evidence| {
        (place(contact.point, unit), format!("within {} ({})", rough(contact.residual), word(evidence)))
    };
    if let Verdict::Intersecting { contact, evidence } = surfaces {
        let verb = if evidence == Evidence::Certified { "touch" } else { "seem to touch" };
        let (place, within) = at(contact, evidence);
        return format!("No curve found, but they {verb} at {place}, {within}. Curves may be missing there.");
    }
    let proven = |verdict| match verdict {
        Verdict::Separated { gap, evidence: Evidence::Certified } => Some(gap),
        _ => None,
    };
    let least = |gap: f64| {
        if gap > 0.0 {
            format!("; they are at least {} apart (certified)", rounded_down(gap, unit))
        } else {
            " (certified)".into()
        }
    };
    match (proven(surfaces), obstacles) {
        (of_surfaces, Verdict::Intersecting { contact, evidence }) => {
            let (place, within) = at(contact, evidence);
            let cut = of_surfaces.map_or_else(
                || "No curve found".into(),
                |gap| format!("The surfaces do not intersect{}", least(gap)),
            );
            format!("{cut}. But they touch at {place}, where no surface is sampled, {within}.")
        }
        (Some(of_surfaces), Verdict::Separated { gap, evidence: Evidence::Certified }) => {
            format!("They do not intersect{}.", least(gap.min(of_surfaces)))
        }
        (None, Verdict::Separated { gap, evidence: Evidence::Certified }) => {
            format!("No curve and no contact found{}.", least(gap))
        }
        (_, Verdict::Separated { evidence: Evidence::Estimated, .. }) => {
            "No curve and no contact found (estimated).".into()
        }
        (_, Verdict::Undecided(reason)) => {
            format!("No curve found. Cannot tell if they touch: {}.", why(reason))
        }
    }
}

/// Returns the reason in words.
fn why(reason: Reason) -> &'static str {
    match reason {
        Reason::Budget { .. } => "the budget ran out; raise --budget or --work",
        Reason::Undersampled => "they come near each other only where the points are too sparse",
        Reason::Ambiguous => {
            "they come near each other only where the points do not look like a single surface"
        }
        Reason::Pose => {
            "a pose is not finite, or makes one scan vanishingly small beside the other; check the poses"
        }
        _ => "`nearmiss collide` may say why",
    }
}

#[cfg(test)]
mod tests {
    use nearmiss::PointId;

    use super::*;

    const UNIT: f64 = 0.001;

    fn touch(evidence: Evidence) -> Verdict {
        let contact = Contact {
            point: [1.0, 2.0, 3.0],
            normals: None,
            residual: 0.0004,
            sources: [PointId(1), PointId(2)],
        };
        Verdict::Intersecting { contact, evidence }
    }

    const fn apart(gap: f64, evidence: Evidence) -> Verdict {
        Verdict::Separated { gap, evidence }
    }

    #[test]
    fn a_contact_without_a_curve_is_never_called_apart() {
        use Evidence::{Certified, Estimated};
        let unknown = Verdict::Undecided(Reason::Undersampled);
        let said = |surfaces, obstacles| sentence([surfaces, obstacles], UNIT);
        assert_eq!(
            said(touch(Certified), touch(Estimated)),
            "No curve found, but they touch at (1.000, 2.000, 3.000), within 0.0004 (certified). Curves may be missing there."
        );
        assert!(
            said(touch(Estimated), unknown)
                .contains("seem to touch at (1.000, 2.000, 3.000), within 0.0004 (estimated)")
        );
        assert_eq!(
            said(apart(0.2504, Certified), touch(Certified)),
            "The surfaces do not intersect; they are at least 0.250 apart (certified). But they touch at (1.000, 2.000, 3.000), where no \
             surface is sampled, within 0.0004 (certified)."
        );
        assert!(
            said(apart(0.0, Estimated), touch(Certified)).starts_with("No curve found. But they touch at (1")
        );
        assert_eq!(
            said(apart(0.2504, Certified), apart(0.1254, Certified)),
            "They do not intersect; they are at least 0.125 apart (certified)."
        );
        assert_eq!(said(apart(0.0, Certified), apart(0.0, Certified)), "They do not intersect (certified).");
        assert_eq!(
            said(unknown, apart(0.1254, Certified)),
            "No curve and no contact found; they are at least 0.125 apart (certified)."
        );
        assert_eq!(said(unknown, apart(0.0, Estimated)), "No curve and no contact found (estimated).");
        let budget = Verdict::Undecided(Reason::Budget { likelihood: 0.5 });
        assert_eq!(
            said(apart(0.2504, Certified), budget),
            "No curve found. Cannot tell if they touch: the budget ran out; raise --budget or --work."
        );
    }
}
