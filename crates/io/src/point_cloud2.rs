//! `PointCloud2`, the message of ROS for point clouds, as a view of the buffers of its owner.

use std::fmt;

use nearmiss_geometry::{CloudError, PointCloud};
use thiserror::Error;

use crate::scalar::{Order, Scalar};

/// A field of a `sensor_msgs/PointField`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PointField<'a> {
    /// The name, such as `x` or `intensity`.
    pub name: &'a str,
    /// The offset of the field in a point, in bytes.
    pub offset: u32,
    /// The type of the numbers: 1 to 8 for int8, uint8, int16, uint16, int32, uint32, float32 and
    /// float64.
    pub datatype: u8,
    /// The number of numbers. ROS writes 0 for 1 at times, and so it is read.
    pub count: u32,
}

/// The contents of a `sensor_msgs/PointCloud2`, borrowed from the message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PointCloud2<'a> {
    /// The number of rows: 1 if the cloud is not organised.
    pub height: u32,
    /// The number of points in a row.
    pub width: u32,
    /// The fields of a point, in any order.
    pub fields: &'a [PointField<'a>],
    /// `true` if numbers are big endian.
    pub is_bigendian: bool,
    /// The bytes from one point to the next.
    pub point_step: u32,
    /// The bytes from one row to the next.
    pub row_step: u32,
    /// The points. The padding after the last row may be missing.
    pub data: &'a [u8],
}

/// The treatment of points with a coordinate that is NaN or infinite.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Invalid {
    /// They are left out.
    #[default]
    Drop,
    /// They are kept, so that point `row · width + column` stays at that index.
    Keep,
}

/// Error of reading a [`PointCloud2`].
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum PointCloud2Error {
    /// A coordinate has no field.
    #[error("expected the fields x, y and z, got none named `{name}`; name the coordinates so")]
    Missing {
        /// The name of the field.
        name: &'static str,
    },
    /// A field has an unknown type.
    #[error("expected a datatype from 1 (int8) to 8 (float64), got {datatype} (field `{name}`)")]
    Datatype {
        /// The name of the field.
        name: Box<str>,
        /// The type.
        datatype: u8,
    },
    /// A field ends after the point.
    #[error(
        "expected fields within the {point_step} bytes of a point, got one that ends at byte {end} (field `{name}`); \
         correct its offset or point_step"
    )]
    Offset {
        /// The name of the field.
        name: Box<str>,
        /// The first byte after the field.
        end: u64,
        /// The bytes of a point.
        point_step: u32,
    },
    /// Rows overlap.
    #[error(
        "expected a row_step of at least {least} bytes, {width} points of {point_step} bytes each, got {row_step}"
    )]
    RowStep {
        /// The bytes from one row to the next.
        row_step: u32,
        /// The least possible number.
        least: u64,
        /// The points of a row.
        width: u32,
        /// The bytes of a point.
        point_step: u32,
    },
    /// The data end before the last point.
    #[error(
        "expected at least {needed} bytes of data for {width} × {height} points, got {len}; the message is cut off, or \
         its width, height, point_step or row_step is wrong"
    )]
    Short {
        /// The length of the data.
        len: usize,
        /// The least length.
        needed: u64,
        /// The points of a row.
        width: u32,
        /// The rows.
        height: u32,
    },
}

/// One of the numbers of a field, checked against the layout of the message.
#[derive(Clone, Copy)]
pub struct PointColumn<'a> {
    message: PointCloud2<'a>,
    offset: usize,
    scalar: Scalar,
}

/// Checked access to the points of a [`PointCloud2`], without a copy.
///
/// ```
/// use nearmiss_io::{Invalid, PointCloud2, PointCloud2View, PointField};
///
/// // Two rows of two points: x, y and z as float32, then four bytes of padding.
/// let points = [[0.0_f32, 0.0, 1.0], [1.0, 0.0, 1.0], [f32::NAN; 3], [1.0, 1.0, 1.0]];
/// let mut data = Vec::new();
/// for point in points {
///     point.iter().for_each(|c| data.extend(c.to_le_bytes()));
///     data.extend([0; 4]);
/// }
/// let field = |name, offset| PointField { name, offset, datatype: 7, count: 1 };
/// let fields = [field("x", 0), field("y", 4), field("z", 8)];
/// let view = PointCloud2View::new(PointCloud2 {
///     height: 2,
///     width: 2,
///     fields: &fields,
///     is_bigendian: false,
///     point_step: 16,
///     row_step: 32,
///     data: &data,
/// })?;
/// assert!(view.is_organised());
/// assert_eq!(view.position(3), Some([1.0; 3]));
/// assert_eq!(view.positions(Invalid::Keep).count(), 4);
/// assert_eq!(view.positions(Invalid::Drop).count(), 3);
/// # Ok::<(), nearmiss_io::PointCloud2Error>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct PointCloud2View<'a> {
    message: PointCloud2<'a>,
    axes: [PointColumn<'a>; 3],
}

impl<'a> PointCloud2View<'a> {
    /// Checks the layout of `message`. O(1) in the number of points.
    ///
    /// # Errors
    /// Fails if x, y or z is missing, a field has an unknown type or ends after its point, rows
    /// overlap, or the data are too short; the error names the field.
    pub fn new(message: PointCloud2<'a>) -> Result<Self, PointCloud2Error> {
        for field in message.fields {
            column(&message, field, 0)?;
        }
        let PointCloud2 { height, width, point_step, row_step, data, .. } = message;
        let least = u64::from(width) * u64::from(point_step);
        if height > 1 && u64::from(row_step) < least {
            return Err(PointCloud2Error::RowStep { row_step, least, width, point_step });
        }
        // Products of two 32-bit numbers, and their sum, fit into 64 bits.
        let needed = match (width, height) {
            (0, _) | (_, 0) => 0,
            _ => u64::from(height - 1) * u64::from(row_step) + least,
        };
        if (data.len() as u64) < needed {
            return Err(PointCloud2Error::Short { len: data.len(), needed, width, height });
        }
        let axis = |name: &'static str| {
            let field = message.fields.iter().find(|field| field.name == name);
            column(&message, field.ok_or(PointCloud2Error::Missing { name })?, 0)
        };
        Ok(Self { message, axes: [axis("x")?, axis("y")?, axis("z")?] })
    }

    /// Returns the number of points, invalid ones included.
    #[must_use]
    pub fn len(&self) -> usize {
        self.message.width as usize * self.message.height as usize
    }

    /// Returns `true` if there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the number of points in a row.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.message.width
    }

    /// Returns the number of rows.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.message.height
    }

    /// Returns `true` if the points are pixels of an image: more than one row.
    #[must_use]
    pub fn is_organised(&self) -> bool {
        self.message.height > 1
    }

    /// Returns the coordinates of point `i`, which is in row `i / width`; `None` past the end. They
    /// may be NaN or infinite.
    #[inline]
    #[must_use]
    pub fn position(&self, i: usize) -> Option<[f64; 3]> {
        let [x, y, z] = &self.axes;
        Some([x.get(i)?, y.get(i)?, z.get(i)?])
    }

    /// Returns the coordinates of all points in the order of the message.
    pub fn positions(&self, invalid: Invalid) -> impl Iterator<Item = [f64; 3]> + use<'_, 'a> {
        let all = (0..self.len()).filter_map(|i| self.position(i));
        all.filter(move |p| invalid == Invalid::Keep || p.iter().all(|c| c.is_finite()))
    }

    /// Returns the `index`-th number of the field `name` for every point; `None` if there is no such
    /// field, or it has fewer numbers.
    #[must_use]
    pub fn column(&self, name: &str, index: u32) -> Option<PointColumn<'a>> {
        let field = self.message.fields.iter().find(|field| field.name == name)?;
        if index >= field.count.max(1) { None } else { column(&self.message, field, index).ok() }
    }

    /// Copies the points into a cloud, with their normals (`normal_x`, …), intensities and colours
    /// (`rgb` or `rgba`, packed) if they have any.
    ///
    /// Invalid points and duplicates are dropped and counted. [`PointCloud::source`] holds indices
    /// of the message: index `row · width + column` of an organised cloud.
    ///
    /// # Errors
    /// Fails if fewer than 8 valid points are distinct, or if one is too large.
    pub fn cloud(&self) -> Result<PointCloud, CloudError> {
        let positions: Vec<[f64; 3]> = self.positions(Invalid::Keep).collect();
        let mut cloud = PointCloud::cleaned(&positions)?;
        drop(positions);
        let columns = ["normal_x", "normal_y", "normal_z"].map(|name| self.column(name, 0));
        if let [Some(x), Some(y), Some(z)] = columns {
            let normal = |i| [x, y, z].map(|axis| axis.single(i));
            cloud = cloud.with_normals(&(0..self.len()).map(normal).collect::<Vec<_>>())?;
        }
        if let Some(column) = self.column("intensity", 0) {
            let intensities: Vec<f32> = (0..self.len()).map(|i| column.single(i)).collect();
            cloud = cloud.with_intensities(&intensities)?;
        }
        let packed = self.column("rgb", 0).or_else(|| self.column("rgba", 0));
        if let Some(column) = packed.filter(|column| column.scalar.size() == 4) {
            let colours: Vec<[u8; 3]> = (0..self.len()).map(|i| column.colour(i)).collect();
            cloud = cloud.with_colours(&colours)?;
        }
        Ok(cloud)
    }
}

impl PointColumn<'_> {
    /// Returns the number of point `i`; `None` past the end. Exact.
    #[inline]
    #[must_use]
    pub fn get(&self, i: usize) -> Option<f64> {
        let order = if self.message.is_bigendian { Order::Big } else { Order::Little };
        self.scalar.read(self.bytes(i)?, order)
    }

    /// Returns the bytes of the number of point `i`, and all that follow.
    #[inline]
    fn bytes(&self, i: usize) -> Option<&[u8]> {
        let PointCloud2 { width, height, point_step, row_step, data, .. } = self.message;
        let (row, across) = (i.checked_div(width as usize)?, i.checked_rem(width as usize)?);
        let start = row * row_step as usize + across * point_step as usize + self.offset;
        if row < height as usize { data.get(start..) } else { None }
    }

    #[expect(clippy::cast_possible_truncation, reason = "clouds keep attributes in single precision")]
    fn single(&self, i: usize) -> f32 {
        self.get(i).map_or(f32::NAN, |value| value as f32)
    }

    /// Returns red, green and blue of the four bytes 0xAARRGGBB.
    fn colour(&self, i: usize) -> [u8; 3] {
        let bytes = self.bytes(i).and_then(<[u8]>::first_chunk::<4>).copied().unwrap_or_default();
        let packed =
            if self.message.is_bigendian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) };
        let [_, red, green, blue] = packed.to_be_bytes();
        [red, green, blue]
    }
}

impl fmt::Debug for PointColumn<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PointColumn").field("offset", &self.offset).field("scalar", &self.scalar).finish()
    }
}

/// Checks a field, and returns its `index`-th number.
fn column<'a>(
    message: &PointCloud2<'a>,
    field: &PointField<'_>,
    index: u32,
) -> Result<PointColumn<'a>, PointCloud2Error> {
    let scalar = match field.datatype {
        1 => Scalar::I8,
        2 => Scalar::U8,
        3 => Scalar::I16,
        4 => Scalar::U16,
        5 => Scalar::I32,
        6 => Scalar::U32,
        7 => Scalar::F32,
        8 => Scalar::F64,
        datatype => return Err(PointCloud2Error::Datatype { name: field.name.into(), datatype }),
    };
    let size = scalar.size() as u64;
    let end = u64::from(field.offset) + size * u64::from(field.count.max(1));
    if end > u64::from(message.point_step) {
        let (name, point_step) = (field.name.into(), message.point_step);
        return Err(PointCloud2Error::Offset { name, end, point_step });
    }
    let offset = field.offset as usize + scalar.size() * index as usize;
    Ok(PointColumn { message: *message, offset, scalar })
}
