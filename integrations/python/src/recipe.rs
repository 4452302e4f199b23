//! Recipes: how scans are prepared.

use nearmiss::{BuildOptions, GraphOptions, Paths, PointCloud, Scan as Prepared, Workspace};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::vector;
use crate::failure::refused;
use crate::prepare::watched;

/// The names of options of a scan.
pub(crate) const OF_SCAN: &[&str] = &["radius_neighbours", "reach", "graph", "close_pairs", "scanner"];

/// The names of options of a moving scan.
pub(crate) const OF_MOVING: &[&str] = &["radius_neighbours", "reach"];

/// How a scan is prepared, read from keywords.
pub(crate) struct Recipe {
    pub(crate) build: BuildOptions,
    graph: Option<(GraphOptions, Option<[f64; 3]>)>,
}

impl Recipe {
    /// Reads options that are among `names`.
    pub(crate) fn new(given: Option<&Bound<'_, PyDict>>, names: &[&str]) -> PyResult<Self> {
        let mut recipe = Self { build: BuildOptions::default(), graph: None };
        let Some(given) = given else { return Ok(recipe) };
        if let Some(unknown) =
            given.keys().iter().map(|name| name.to_string()).find(|name| !names.contains(&name.as_str()))
        {
            let known = names.join(", ");
            return Err(PyTypeError::new_err(format!("expected options among {known}, got `{unknown}`")));
        }
        let of = |name: &str| given.get_item(name).map(|value| value.filter(|value| !value.is_none()));
        if let Some(neighbours) = of("radius_neighbours")? {
            recipe.build = recipe.build.with_radius_neighbours(neighbours.extract()?);
        }
        if let Some(reach) = of("reach")? {
            recipe.build = recipe.build.with_reach(reach.extract()?);
        }
        let is_set = |name: &str| of(name)?.map_or(Ok(false), |value| value.is_truthy());
        let scanner = of("scanner")?.map(|place| vector(&place, "the scanner")).transpose()?;
        let close_pairs = is_set("close_pairs")?;
        if is_set("graph")? || close_pairs || scanner.is_some() {
            let paths = close_pairs.then_some(Paths::Rebuilt);
            recipe.graph = Some((GraphOptions::default().with_close_pairs(paths), scanner));
        }
        Ok(recipe)
    }

    /// Prepares a cloud, watched.
    pub(crate) fn prepare(
        self,
        py: Python<'_>,
        cloud: PointCloud,
        told: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Prepared> {
        let work = Workspace::in_memory();
        let progress = work.progress().clone();
        let whole = watched(py, told, &progress, move || {
            let scan = Prepared::build_in(&(&cloud).into(), &self.build, &work)
                .map_err(|cause| cause.to_string())?;
            match &self.graph {
                None => Ok(scan),
                Some((options, scanner)) => {
                    work.progress().reach(0.0);
                    let scan = scan.with_graph_watched(&cloud, options, *scanner, work.progress());
                    scan.map_err(|cause| cause.to_string())
                }
            }
        })?;
        whole.map_err(refused)
    }
}
