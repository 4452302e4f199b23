//! Arrays of Python as slices of points and matrices.

use std::borrow::Cow;

use nearmiss::{CloudError, PointCloud};
use numpy::{PyReadonlyArray2, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::failure::refused;

/// Rows of three coordinates: the array itself where it is contiguous and aligned, else a copy.
pub(crate) enum Points<'py> {
    Single(PyReadonlyArray2<'py, f32>),
    Double(PyReadonlyArray2<'py, f64>),
}

/// Returns the module numpy.
fn numpy<'py>(py: Python<'py>) -> PyResult<Bound<'py, PyModule>> {
    py.import("numpy")
}

/// Returns `true` if an array can be read as a slice. A view of packed data may be contiguous, but not
/// aligned.
pub(crate) fn is_slice<'py>(array: &impl PyUntypedArrayMethods<'py>) -> bool {
    array.is_c_contiguous() && array.is_aligned()
}

/// Returns an array of double precision with the numbers of `given`, contiguous and aligned. `expected` is
/// what an error says was expected.
pub(crate) fn doubles<'py>(
    given: &Bound<'py, PyAny>,
    expected: &str,
) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    if let Ok(array) = given.extract::<PyReadonlyArrayDyn<'py, f64>>()
        && is_slice(&*array)
    {
        return Ok(array);
    }
    let array = numpy(given.py())?.call_method1("ascontiguousarray", (given,));
    let kind = array.as_ref().ok().and_then(|array| array.getattr("dtype").ok()?.getattr("kind").ok());
    let kind = kind.and_then(|kind| kind.extract::<String>().ok()).unwrap_or_default();
    // Booleans, text and objects are not coordinates, although some convert.
    let (Ok(array), "f" | "i" | "u") = (array, kind.as_str()) else {
        let class = given.get_type().name().map_or_else(|_| String::new(), |name| name.to_string());
        return Err(refused(format!(
            "expected {expected}, got {class} without numbers; give an array of floats"
        )));
    };
    // Makes a copy, which is aligned.
    let array = array.call_method1("astype", ("float64",))?;
    numpy(given.py())?.call_method1("ascontiguousarray", (array,))?.extract()
}

impl<'py> Points<'py> {
    /// Reads an array of shape (N, 3). Arrays of float32 and float64 that are contiguous and aligned are not
    /// copied.
    pub(crate) fn new(given: &Bound<'py, PyAny>) -> PyResult<Self> {
        const EXPECTED: &str = "an array of points of shape (N, 3)";
        let points = match given.extract::<PyReadonlyArray2<'py, f32>>() {
            Ok(array) if is_slice(&*array) => Self::Single(array),
            _ => {
                let array = doubles(given, EXPECTED)?;
                let array = array.extract::<PyReadonlyArray2<'py, f64>>();
                Self::Double(array.map_err(|_shape| wrong_shape(EXPECTED, given))?)
            }
        };
        let shape = match &points {
            Self::Single(array) => array.shape()[1],
            Self::Double(array) => array.shape()[1],
        };
        if shape == 3 { Ok(points) } else { Err(wrong_shape(EXPECTED, given)) }
    }

    /// Makes a cloud, without the interpreter. Invalid points are dropped if `drops`, else refused.
    pub(crate) fn cloud(&self, py: Python<'_>, drops: bool) -> PyResult<PointCloud> {
        let made = match self {
            Self::Single(array) => {
                let (points, _) = array.as_slice().map_err(refused)?.as_chunks::<3>();
                py.detach(|| {
                    if drops { PointCloud::cleaned(points) } else { PointCloud::from_positions(points) }
                })
            }
            Self::Double(array) => {
                let (points, _) = array.as_slice().map_err(refused)?.as_chunks::<3>();
                py.detach(|| {
                    if drops { PointCloud::cleaned(points) } else { PointCloud::from_positions(points) }
                })
            }
        };
        made.map_err(|cause| no_cloud(&cause))
    }

    /// Returns the points in double precision; those that are given so are not copied.
    pub(crate) fn doubles(&self) -> PyResult<Cow<'_, [[f64; 3]]>> {
        Ok(match self {
            Self::Single(array) => {
                let (points, _) = array.as_slice().map_err(refused)?.as_chunks::<3>();
                points.iter().map(|p| p.map(f64::from)).collect()
            }
            Self::Double(array) => Cow::Borrowed(array.as_slice().map_err(refused)?.as_chunks::<3>().0),
        })
    }

    /// Returns a copy of the points in double precision.
    pub(crate) fn to_doubles(&self) -> PyResult<Vec<[f64; 3]>> {
        self.doubles().map(Cow::into_owned)
    }
}

/// Returns the error of points that are no cloud.
pub(crate) fn no_cloud(cause: &CloudError) -> PyErr {
    match cause {
        CloudError::NotFinite { index } => refused(format!(
            "expected finite coordinates, got NaN or infinity (point {index}); drop such points with \
             drop_invalid=True"
        )),
        cause => refused(cause),
    }
}

/// Reads an array of indices of shape (N, 3).
pub(crate) fn corners(given: &Bound<'_, PyAny>) -> PyResult<Vec<[u32; 3]>> {
    const EXPECTED: &str = "an array of vertex indices of shape (N, 3)";
    let array = numpy(given.py())?.call_method1("ascontiguousarray", (given,))?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if kind != "i" && kind != "u" {
        return Err(refused(format!("expected {EXPECTED}, got numbers that are no integers")));
    }
    let array = array.call_method1("astype", ("int64",))?;
    let array =
        array.extract::<PyReadonlyArray2<'_, i64>>().map_err(|_shape| wrong_shape(EXPECTED, given))?;
    if array.shape()[1] != 3 {
        return Err(wrong_shape(EXPECTED, given));
    }
    let rows = array.as_slice().map_err(refused)?.as_chunks::<3>().0.iter().enumerate();
    let row = |(i, row): (usize, &[i64; 3])| {
        let [a, b, c] = row.map(u32::try_from);
        match (a, b, c) {
            (Ok(a), Ok(b), Ok(c)) => Ok([a, b, c]),
            _ => Err(refused(format!("expected indices from 0 to 4294967295, got {row:?} (triangle {i})"))),
        }
    };
    rows.map(row).collect()
}

/// Returns the error of an array of the wrong shape.
pub(crate) fn wrong_shape(expected: &str, given: &Bound<'_, PyAny>) -> PyErr {
    let shape = numpy(given.py()).and_then(|numpy| numpy.call_method1("shape", (given,)));
    let shape = shape.map_or_else(|_| "another shape".to_owned(), |shape| shape.to_string());
    refused(format!("expected {expected}, got {shape}"))
}

/// Returns three numbers.
pub(crate) fn vector(given: &Bound<'_, PyAny>, name: &str) -> PyResult<[f64; 3]> {
    if let Ok(vector) = given.extract::<[f64; 3]>() {
        return Ok(vector);
    }
    let expected = format!("three numbers for {name}");
    let array = doubles(given, &expected)?;
    let numbers = array.as_slice().map_err(refused)?;
    <[f64; 3]>::try_from(numbers).map_err(|_shape| wrong_shape(&expected, given))
}
