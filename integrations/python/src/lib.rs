//! The module `nearmiss._native` of the Python package `nearmiss`: classes over the crate
//! `nearmiss`. Python code in `python/nearmiss` re-exports it; stubs document it.

// Bottom up.
mod pool;
mod record;

mod codes;
mod failure;

mod answers;
mod arrays;
mod frame;
mod options;
mod penetration;
mod poses;
mod shape_answers;

mod each;
mod prepare;
mod recipe;
mod shape;
mod things;

mod cloud;
mod hint;
mod pair;
mod target;

mod any_scan;
mod mesh;
mod moving;
mod scan;
mod slices;
mod sweep;
mod world;

#[pyo3::pymodule]
mod _native {
    use pyo3::types::{PyModule, PyModuleMethods};
    use pyo3::{Bound, PyResult};

    #[pymodule_export]
    use super::answers::{Answer, Distance};
    #[pymodule_export]
    use super::cloud::{point_cloud2, read_points};
    #[pymodule_export]
    use super::hint::{Hint, ShapeHint};
    #[pymodule_export]
    use super::moving::MovingScan;
    #[pymodule_export]
    use super::penetration::Penetration;
    #[pymodule_export]
    use super::scan::Scan;
    #[pymodule_export]
    use super::shape::Shape;
    #[pymodule_export]
    use super::shape_answers::{RayAnswer, ShapeAnswer, ShapeDistance};
    #[pymodule_export]
    use super::slices::SliceMap;
    #[pymodule_export]
    use super::sweep::{SweepAnswer, sweep};
    #[pymodule_export]
    use super::target::Target;
    #[pymodule_export]
    use super::things::{AnyScan, Mesh};
    #[pymodule_export]
    use super::world::World;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
