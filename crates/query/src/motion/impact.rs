//! The search for the first contact along a motion, from the time at which a proof stalls.

use nearmiss_geometry::Motion;

use super::advance::{Stop, SweepScratch, Sweeping};
use super::answer::{SweepAnswer, SweepReason, SweepVerdict};
use super::course::Course;
use super::plan::SweepPlan;
use super::step::least_step;
use crate::ask::answer::{Contact, Evidence, Reason, Verdict};
use crate::ask::budget::Budget;

/// Decides whether the whole motion is free, and finds the first impact otherwise.
pub(crate) fn sweep<C: Course>(
    (course, motions): (&C, [&Motion; 2]),
    plan: &SweepPlan,
    budget: &Budget,
    scratch: SweepScratch<'_>,
) -> SweepAnswer {
    let mut sweeping = Sweeping::new((course, motions), plan, budget, scratch);
    let undecided = |t_free, reason| SweepVerdict::Undecided { t_free, reason };
    let verdict = if !plan.proves() {
        undecided(0.0, SweepReason::Geodesic)
    } else if let Some(Hit { t_hit, contact, evidence }) = sweeping.contact_at_start(budget) {
        SweepVerdict::Impact { t_free: 0.0, t_hit, contact, evidence }
    } else {
        match sweeping.prove() {
            Ok(()) => {
                sweeping.tighten();
                let (clearance, nearest) = (sweeping.proving, sweeping.nearest);
                SweepVerdict::Free { clearance, upper: nearest.upper, at: nearest.at }
            }
            Err((t_free, Stop::Ended(reason))) => undecided(t_free, reason),
            Err((t_free, Stop::Stalled)) => match sweeping.first_contact(t_free) {
                Ok(Hit { t_hit, contact, evidence }) => {
                    SweepVerdict::Impact { t_free, t_hit, contact, evidence }
                }
                Err(reason) => undecided(t_free, reason),
            },
        }
    };
    let Sweeping { nearest, distances, contacts, intervals, spent, .. } = sweeping;
    SweepAnswer { verdict, band: nearest.band, distances, contacts, intervals, statistics: spent }
}

/// A contact.
struct Hit {
    t_hit: f64,
    contact: Contact,
    evidence: Evidence,
}

impl<C: Course> Sweeping<'_, C> {
    /// Returns the contact at the start, if there is one and a budget may end before the proof stalls there.
    fn contact_at_start(&mut self, budget: &Budget) -> Option<Hit> {
        if !budget.may_end() {
            return None;
        }
        let answer = self.touches(&self.screws(0), 0.0);
        let Verdict::Intersecting { contact, evidence } = answer.verdict else { return None };
        self.nearest.band = answer.band;
        Some(Hit { t_hit: 0.0, contact, evidence })
    }

    /// Returns the first contact that is found from `time` on.
    fn first_contact(&mut self, time: f64) -> Result<Hit, SweepReason> {
        let duration = self.duration();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most the duration")]
        let mut k = time as usize;
        #[expect(clippy::cast_precision_loss, reason = "fewer than 2⁵³ poses fit into memory")]
        let mut within = time - k as f64;
        loop {
            #[expect(clippy::cast_precision_loss, reason = "fewer than 2⁵³ poses fit into memory")]
            let start = k as f64;
            let length = (duration - start).min(1.0);
            if let Some(hit) = self.contact_of_screws((k, start), within, length)? {
                return Ok(hit);
            }
            (k, within) = (k + 1, 0.0);
            if start + 1.0 >= duration {
                return Err(SweepReason::Near);
            }
        }
    }

    /// Returns the first contact that is found from `within` to `length` of the screws number `k`,
    /// which start at `start`.
    fn contact_of_screws(
        &mut self,
        (k, start): (usize, f64),
        mut within: f64,
        length: f64,
    ) -> Result<Option<Hit>, SweepReason> {
        let screws = self.screws(k);
        let clearance = self.plan.options().clearance;
        // The radius of the smaller thing with all that counts as contact.
        let size = self.size() + self.plan.thickness().unwrap_or(0.0) + clearance;
        loop {
            let answer = self.touches(&screws, within);
            let gap = match answer.verdict {
                Verdict::Intersecting { contact, evidence } => {
                    return Ok(Some(Hit { t_hit: start + within, contact, evidence }));
                }
                Verdict::Separated { gap, .. } => gap,
                Verdict::Undecided(Reason::Budget { .. }) => return Err(SweepReason::Budget),
                Verdict::Undecided(Reason::Pose) => return Err(SweepReason::Pose),
                Verdict::Undecided(_) => 0.0,
            };
            if within >= length {
                return Ok(None);
            }
            let way = (gap - clearance).max(least_step(self.nearest.band, size));
            let next = within + way / self.speed(&screws, within);
            // A speed of zero leads to the end at once.
            within = if next < length && next > within { next } else { length };
        }
    }
}
