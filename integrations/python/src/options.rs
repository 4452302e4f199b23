//! Options of questions, given by name.

use std::time::Duration;

use nearmiss::{
    Budget, CollideOptions, Deadline, Detail, Evidence, MeshQuality, Metric, Semantics, Statistics,
};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

use crate::failure::refused;

/// The options of a question, read from keywords.
pub(crate) struct Options {
    pub(crate) collide: CollideOptions,
    pub(crate) relative: f64,
    /// How well meshes are tested; `None` for exactly.
    pub(crate) quality: Option<MeshQuality>,
    work: Option<u64>,
    seconds: Option<f64>,
}

/// The names of options for two scans.
pub(crate) const OF_SCANS: &[&str] =
    &["margin", "thickened", "surface_only", "evidence", "detail", "work", "seconds"];

/// The names of options that say what a scan means.
pub(crate) const OF_MEANING: &[&str] = &["thickened", "surface_only"];

/// The names of options for two meshes.
pub(crate) const OF_MESHES: &[&str] = &["p_min", "k_min", "work", "seconds"];

/// The names of options that limit a question.
pub(crate) const OF_BUDGET: &[&str] = &["work", "seconds"];

/// The names of options for a distance.
pub(crate) const OF_DISTANCE: &[&str] = &["thickened", "surface_only", "relative", "work", "seconds"];

/// The names of options for the nearest pair of a world.
pub(crate) const OF_NEAREST: &[&str] = &["thickened", "surface_only", "relative"];

/// The names of options for shapes and rays.
pub(crate) const OF_SHAPES: &[&str] = &["margin", "thickened", "surface_only", "evidence", "detail"];

impl Options {
    /// Reads options that are among `names`, for a question about scans of this metric.
    pub(crate) fn new(given: Option<&Bound<'_, PyDict>>, names: &[&str], metric: Metric) -> PyResult<Self> {
        let mut options = Self {
            collide: CollideOptions::default(),
            relative: 0.1,
            quality: None,
            work: None,
            seconds: None,
        };
        if metric == Metric::Geodesic {
            options.collide = options.collide.with_semantics(Semantics::Surface);
        }
        let Some(given) = given else { return Ok(options) };
        for (name, value) in given {
            let name = name.cast::<PyString>()?.to_string();
            if !names.contains(&name.as_str()) {
                let known = names.join(", ");
                return Err(PyTypeError::new_err(format!("expected options among {known}, got `{name}`")));
            }
            // Python's `None` is the default.
            if !value.is_none() {
                options.set(&name, &value)?;
            }
        }
        let is_set = |name: &str| Ok::<_, PyErr>(given.get_item(name)?.is_some_and(|value| !value.is_none()));
        if options.collide.semantics == Semantics::Surface && is_set("surface_only")? && is_set("thickened")?
        {
            return Err(refused("expected `thickened` or `surface_only`, got both; leave one of them out"));
        }
        Ok(options)
    }

    fn set(&mut self, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let options = self.collide;
        match name {
            "margin" => self.collide = options.with_margin(value.extract()?),
            "thickened" => self.collide = options.with_semantics(Semantics::Thickened(value.extract()?)),
            "surface_only" if value.extract()? => self.collide = options.with_semantics(Semantics::Surface),
            "evidence" => {
                self.collide = options.with_evidence(match &*value.extract::<String>()? {
                    "certified" => Evidence::Certified,
                    "estimated" => Evidence::Estimated,
                    other => {
                        return Err(refused(format!(
                            "expected evidence `certified` or `estimated`, got `{other}`"
                        )));
                    }
                });
            }
            "detail" => {
                self.collide = options.with_detail(match &*value.extract::<String>()? {
                    "verdict" => Detail::Verdict,
                    "witness" => Detail::Witness,
                    other => {
                        return Err(refused(format!(
                            "expected detail `verdict` or `witness`, got `{other}`"
                        )));
                    }
                });
            }
            "p_min" => {
                let p_min: f64 = value.extract()?;
                if !(0.0..=1.0).contains(&p_min) {
                    return Err(refused(format!("expected p_min from 0 to 1, got {p_min}")));
                }
                self.quality = Some(self.quality.unwrap_or_default().with_p_min(p_min));
            }
            "k_min" => {
                let k_min: u32 = value.extract()?;
                if k_min == 0 {
                    return Err(refused("expected k_min of at least 1, got 0"));
                }
                self.quality = Some(self.quality.unwrap_or_default().with_k_min(k_min));
            }
            "relative" => self.relative = value.extract()?,
            "work" => self.work = Some(value.extract()?),
            "seconds" => {
                let seconds: f64 = value.extract()?;
                if seconds.is_nan() || seconds < 0.0 {
                    return Err(refused(format!("expected a time of at least 0 seconds, got {seconds}")));
                }
                self.seconds = Some(seconds);
            }
            _ => {}
        }
        Ok(())
    }

    /// Returns the budget of a query that starts now.
    pub(crate) fn budget(&self) -> Budget {
        let mut budget = Budget::UNLIMITED;
        if let Some(units) = self.work {
            budget = budget.with_work(units);
        }
        if let Some(seconds) = self.seconds {
            let time = Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX);
            budget = budget.with_deadline(Deadline::within(time));
        }
        budget
    }
}

/// Returns `true` if a limit of `budget` may have ended a question that has just been answered at this cost.
pub(crate) fn may_have_ended(budget: &Budget, cost: &Statistics) -> bool {
    let now = Deadline::within(Duration::ZERO);
    budget.work.is_some_and(|most| cost.evaluations + cost.node_pairs >= most)
        || budget.deadline.is_some_and(|end| end <= now)
}
