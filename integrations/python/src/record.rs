//! Records: plain structs that NumPy reads as structured arrays.

use bytemuck::allocation::cast_vec;
use bytemuck::{Pod, try_pod_read_unaligned};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyList};

use crate::failure::refused;

/// A name, a NumPy format and the offset in bytes.
pub(crate) type Field = (&'static str, &'static str, usize);

/// A plain struct with named fields.
pub(crate) trait Record: Pod {
    /// The fields.
    const FIELDS: &'static [Field];

    /// The place of the dtype, once it is made.
    fn dtype_cell() -> &'static PyOnceLock<Py<PyAny>>;
}

/// Defines a record: its fields, each with its type in Rust and in NumPy.
macro_rules! record {
    ($(#[$about:meta])* $name:ident { $($field:ident: $of:ty = $format:literal),* $(,)? }) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
        #[repr(C)]
        pub(crate) struct $name {
            $(pub(crate) $field: $of,)*
        }

        impl $crate::record::Record for $name {
            const FIELDS: &'static [$crate::record::Field] =
                &[$((stringify!($field), $format, std::mem::offset_of!($name, $field)),)*];

            fn dtype_cell() -> &'static pyo3::sync::PyOnceLock<pyo3::Py<pyo3::PyAny>> {
                static CELL: pyo3::sync::PyOnceLock<pyo3::Py<pyo3::PyAny>> = pyo3::sync::PyOnceLock::new();
                &CELL
            }
        }
    };
}
pub(crate) use record;

/// Returns the dtype of a record.
fn dtype<'py, R: Record>(py: Python<'py>) -> PyResult<&'py Bound<'py, PyAny>> {
    let made = R::dtype_cell().get_or_try_init(py, || {
        let about = PyDict::new(py);
        let shown = || R::FIELDS.iter().filter(|(name, ..)| !name.starts_with('_'));
        about.set_item("names", PyList::new(py, shown().map(|(name, ..)| name))?)?;
        about.set_item("formats", PyList::new(py, shown().map(|(_, format, _)| format))?)?;
        about.set_item("offsets", PyList::new(py, shown().map(|(.., offset)| offset))?)?;
        about.set_item("itemsize", size_of::<R>())?;
        py.import("numpy")?.call_method1("dtype", (about,)).map(Bound::unbind)
    })?;
    Ok(made.bind(py))
}

/// Reads a record from the bytes of one.
pub(crate) fn read<R: Pod>(bytes: &[u8]) -> PyResult<R> {
    try_pod_read_unaligned(bytes).ok().ok_or_else(|| {
        refused(format!(
            "expected {} bytes of an answer of this version, got {}",
            size_of::<R>(),
            bytes.len()
        ))
    })
}

/// Returns records as a structured array with one dimension, which takes over their memory.
pub(crate) fn array<'py, R: Record>(py: Python<'py>, records: Vec<R>) -> PyResult<Bound<'py, PyAny>> {
    const { assert!(size_of::<R>().is_multiple_of(8) && align_of::<R>() == 8, "expected whole words") };
    let dtype = dtype::<R>(py)?;
    let words = PyArray1::from_vec(py, cast_vec::<R, u64>(records));
    words.call_method1("view", (dtype,))
}
