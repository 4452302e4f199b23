//! Messages of ROS.

use std::ffi::c_char;
use std::mem::MaybeUninit;

use nearmiss::io::{PointCloud2, PointCloud2View, PointField};

use crate::handle::make;
use crate::pointer::{required, slice, text};
use crate::scan::{PrepareOptions, Scan, nearmiss_prepare_options, prepare};
use crate::status::{Failure, Status, guard};

/// A field of a ROS `PointField`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct MessageField {
    /// The name, such as "x".
    pub name: *const c_char,
    /// The offset in a point, in bytes.
    pub offset: u32,
    /// The type: 1 to 8 for int8, uint8, int16, uint16, int32, uint32, float32 and float64.
    pub datatype: u8,
    /// The number of numbers.
    pub count: u32,
}

/// The contents of a ROS `PointCloud2`. Nothing is copied.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Message {
    /// The number of rows.
    pub height: u32,
    /// The number of points in a row.
    pub width: u32,
    /// The fields of a point.
    pub fields: *const MessageField,
    /// The number of fields.
    pub field_count: usize,
    /// Not 0 if numbers are big endian.
    pub is_bigendian: i32,
    /// The bytes from one point to the next.
    pub point_step: u32,
    /// The bytes from one row to the next.
    pub row_step: u32,
    /// The points.
    pub data: *const u8,
    /// The number of bytes of the points.
    pub data_length: usize,
}

/// Prepares the points of a ROS `PointCloud2`, with its normals if it has any. Points that are not finite
/// are dropped. `options` may be null. Thread safety: any thread.
///
/// # Safety
/// The message's fields, their names and its data are valid; other pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_scan_from_point_cloud2(
    message: Option<&Message>,
    options: Option<&PrepareOptions>,
    out: Option<&mut MaybeUninit<*mut Scan>>,
) -> Status {
    guard(|| {
        make(out, || {
            let message = required(message, "message")?;
            // SAFETY: the caller promises the fields.
            let fields = unsafe { slice(message.fields, message.field_count, "fields") }?;
            let field = |field: &MessageField| -> Result<PointField<'_>, Failure> {
                let &MessageField { name, offset, datatype, count } = field;
                // SAFETY: the caller promises the names.
                Ok(PointField { name: unsafe { text(name, "name") }?, offset, datatype, count })
            };
            let fields: Vec<PointField<'_>> = fields.iter().map(field).collect::<Result<_, _>>()?;
            let view = PointCloud2View::new(PointCloud2 {
                height: message.height,
                width: message.width,
                fields: &fields,
                is_bigendian: message.is_bigendian != 0,
                point_step: message.point_step,
                row_step: message.row_step,
                // SAFETY: the caller promises the data.
                data: unsafe { slice(message.data, message.data_length, "data") }?,
            });
            let cloud = view.map_err(Failure::argument)?.cloud().map_err(Failure::argument)?;
            prepare(&cloud, &options.copied().unwrap_or_else(|| nearmiss_prepare_options()))
        })
    })
}
