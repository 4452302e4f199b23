//! Points of files and of messages of ROS, as arrays.

use std::path::PathBuf;

use nearmiss::io::{Invalid, PointCloud2, PointCloud2View, PointField};
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::failure::{refused, unreadable};

/// Returns rows of three numbers as an array of shape (N, 3).
pub(crate) fn rows<'py, T: numpy::Element>(
    py: Python<'py>,
    flat: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    Ok(PyArray1::from_vec(py, flat).reshape(shape.to_vec())?.into_any())
}

/// Read the points of a file as an array of shape (N, 3), without invalid points and duplicates.
///
/// `format` is recognised by default.
#[pyfunction]
#[pyo3(signature = (path, format = None))]
pub(crate) fn read_points<'py>(
    py: Python<'py>,
    path: PathBuf,
    format: Option<&str>,
) -> PyResult<Bound<'py, PyAny>> {
    let format = format.map(str::parse).transpose().map_err(refused)?;
    let cloud = py.detach(|| nearmiss::io::read(&path, format)).map_err(unreadable)?.cloud;
    let flat: Vec<f64> = (0..cloud.len()).flat_map(|i| cloud.point(i)).collect();
    rows(py, flat, &[cloud.len(), 3])
}

/// The bytes of a message: an array of bytes, or anything that NumPy reads as one.
enum Data<'py> {
    Bytes(Bound<'py, PyBytes>),
    Array(PyReadonlyArray1<'py, u8>),
}

impl<'py> Data<'py> {
    fn new(given: &Bound<'py, PyAny>) -> PyResult<Self> {
        if let Ok(bytes) = given.cast::<PyBytes>() {
            return Ok(Self::Bytes(bytes.clone()));
        }
        let expected = || {
            refused(
                "expected the data of the message as bytes, an array of uint8 or a buffer; pass `message.data`",
            )
        };
        let array = given
            .py()
            .import("numpy")?
            .call_method1("frombuffer", (given, "u1"))
            .map_err(|_cause| expected())?;
        Ok(Self::Array(array.extract().map_err(|_cause| expected())?))
    }

    fn slice(&self) -> PyResult<&[u8]> {
        match self {
            Self::Bytes(bytes) => Ok(bytes.as_bytes()),
            Self::Array(array) => array.as_slice().map_err(refused),
        }
    }
}

/// Read the points of a ROS `sensor_msgs/PointCloud2`, or of any object with its attributes.
///
/// Returns an array of shape (N, 3) without points that are not finite. With `drop_invalid=False` these
/// are kept, and an organised cloud gives an array of shape (height, width, 3).
#[pyfunction]
#[pyo3(signature = (message, *, drop_invalid = true))]
pub(crate) fn point_cloud2<'py>(
    message: &Bound<'py, PyAny>,
    drop_invalid: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let number = |name: &str| message.getattr(name)?.extract::<u32>();
    let mut described: Vec<(String, u32, u8, u32)> = Vec::new();
    for field in message.getattr("fields")?.try_iter()? {
        let field = field?;
        described.push((
            field.getattr("name")?.extract()?,
            field.getattr("offset")?.extract()?,
            field.getattr("datatype")?.extract()?,
            field.getattr("count")?.extract()?,
        ));
    }
    let fields: Vec<PointField<'_>> = described
        .iter()
        .map(|(name, offset, datatype, count)| PointField {
            name,
            offset: *offset,
            datatype: *datatype,
            count: *count,
        })
        .collect();
    let data = Data::new(&message.getattr("data")?)?;
    let data = data.slice()?;
    let view = PointCloud2View::new(PointCloud2 {
        height: number("height")?,
        width: number("width")?,
        fields: &fields,
        is_bigendian: message.getattr("is_bigendian")?.is_truthy()?,
        point_step: number("point_step")?,
        row_step: number("row_step")?,
        data,
    })
    .map_err(refused)?;
    let py = message.py();
    if drop_invalid || !view.is_organised() {
        let invalid = if drop_invalid { Invalid::Drop } else { Invalid::Keep };
        let flat: Vec<f64> = py.detach(|| view.positions(invalid).flatten().collect());
        let count = flat.len() / 3;
        return rows(py, flat, &[count, 3]);
    }
    let flat: Vec<f64> = py.detach(|| view.positions(Invalid::Keep).flatten().collect());
    rows(py, flat, &[view.height() as usize, view.width() as usize, 3])
}
