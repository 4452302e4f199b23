//! Views of `PointCloud2` messages: layouts, byte orders, invalid points, and faults.

use nearmiss_geometry::CloudError;
use nearmiss_io::{Invalid, PointCloud2, PointCloud2Error, PointCloud2View, PointField};

const fn field(name: &str, offset: u32, datatype: u8, count: u32) -> PointField<'_> {
    PointField { name, offset, datatype, count }
}

const XYZ: [PointField<'_>; 3] = [field("x", 0, 7, 1), field("y", 4, 7, 1), field("z", 8, 7, 1)];

/// Points on a grid, not a number at each index that is a multiple of seven.
fn grid(count: u16) -> Vec<[f32; 3]> {
    let z = |i: u16| if i.is_multiple_of(7) { f32::NAN } else { 0.25 };
    let point = |i: u16| [f32::from(i % 5), f32::from(i / 5) * 0.5, z(i)];
    (0..count).map(point).collect()
}

/// Lays out coordinates of single precision with this padding after each point and each row.
fn laid_out(points: &[[f32; 3]], width: usize, padding: [usize; 2], is_bigendian: bool) -> Vec<u8> {
    let mut data = Vec::new();
    for row in points.chunks(width) {
        for c in row {
            for value in c {
                data.extend(if is_bigendian { value.to_be_bytes() } else { value.to_le_bytes() });
            }
            data.extend(vec![0xAB; padding[0]]);
        }
        data.extend(vec![0xCD; padding[1]]);
    }
    data
}

fn message<'a>(data: &'a [u8], width: u32, height: u32, [point, row]: [u32; 2]) -> PointCloud2<'a> {
    let point_step = 12 + point;
    let row_step = width * point_step + row;
    PointCloud2 { height, width, fields: &XYZ, is_bigendian: false, point_step, row_step, data }
}

#[test]
fn every_layout_and_byte_order_gives_the_same_points() {
    let points = grid(20);
    for is_bigendian in [false, true] {
        for padding in [[0, 0], [4, 0], [0, 7], [3, 5]] {
            for width in [20, 5, 1] {
                let data = laid_out(&points, width, padding, is_bigendian);
                let sizes = [width, 20 / width].map(|size| u32::try_from(size).unwrap());
                let padded = padding.map(|bytes| u32::try_from(bytes).unwrap());
                let message = PointCloud2 { is_bigendian, ..message(&data, sizes[0], sizes[1], padded) };
                let view = PointCloud2View::new(message).unwrap();
                let case = format!("big endian {is_bigendian}, padding {padding:?}, width {width}");
                assert_eq!((view.len(), view.is_organised()), (20, width < 20), "{case}");
                for (i, point) in points.iter().enumerate() {
                    let read = view.position(i).unwrap().map(f64::to_bits);
                    assert_eq!(read, point.map(|c| f64::from(c).to_bits()), "{case}, point {i}");
                }
                assert_eq!(view.position(20), None, "{case}");
                assert_eq!(view.positions(Invalid::Keep).count(), 20, "{case}");
                assert_eq!(view.positions(Invalid::Drop).count(), 17, "{case}");
                let cloud = view.cloud().unwrap();
                assert_eq!((cloud.len(), cloud.dropped().not_finite), (17, 3), "{case}");
                assert_eq!(cloud.source()[..3], [1, 2, 3], "{case}");
            }
        }
    }
}

#[test]
fn fields_of_all_types_are_read() {
    let mut data = Vec::new();
    for i in 0..9_u8 {
        let x = f64::from(i);
        data.extend(x.to_be_bytes()); // x at 0: float64
        data.extend((-i16::from(i)).to_be_bytes()); // y at 8: int16
        data.extend((u32::from(i) * i.pow(2) as u32).to_be_bytes()); // z at 10: uint32
        data.extend(0x00FF_8000_u32.to_be_bytes()); // rgb at 14
        data.extend([1.0_f32, 2.0, f32::from(i)].map(f32::to_be_bytes).concat()); // ring at 18: 3 × float32
        data.push(200 + i); // intensity at 30: uint8
    }
    let fields = [
        field("intensity", 30, 2, 0),
        field("z", 10, 6, 1),
        field("rgb", 14, 7, 1),
        field("y", 8, 3, 1),
        field("ring", 18, 7, 3),
        field("x", 0, 8, 1),
    ];
    let message = PointCloud2 {
        height: 1,
        width: 9,
        fields: &fields,
        is_bigendian: true,
        point_step: 31,
        row_step: 0,
        data: &data,
    };
    let view = PointCloud2View::new(message).unwrap();
    assert_eq!(view.position(3), Some([3.0, -3.0, 27.0]));
    assert_eq!(view.column("ring", 2).and_then(|ring| ring.get(5)), Some(5.0));
    assert!(view.column("ring", 3).is_none() && view.column("time", 0).is_none());
    assert_eq!(view.column("intensity", 0).and_then(|column| column.get(9)), None);
    let cloud = view.cloud().unwrap();
    assert_eq!(cloud.intensities().unwrap()[8], 208.0);
    assert_eq!(cloud.colours().unwrap()[2], [0xFF, 0x80, 0]);
}

#[track_caller]
fn refuses(message: PointCloud2<'_>, words: &str) {
    let error: Option<PointCloud2Error> = PointCloud2View::new(message).err();
    assert_eq!(error.map(|error| error.to_string()).as_deref(), Some(words), "{message:?}");
}

#[test]
fn layouts_that_do_not_fit_are_refused() {
    let data = laid_out(&grid(20), 5, [4, 2], false);
    let good = message(&data, 5, 4, [4, 2]);
    assert!(PointCloud2View::new(good).is_ok());
    // The padding after the last row may be missing, the last point may not.
    assert!(PointCloud2View::new(PointCloud2 { data: &data[..data.len() - 2], ..good }).is_ok());
    refuses(
        PointCloud2 { data: &data[..data.len() - 3], ..good },
        "expected at least 326 bytes of data for 5 × 4 points, got 325; the message is cut off, or its width, height, \
         point_step or row_step is wrong",
    );
    refuses(
        PointCloud2 { row_step: 79, ..good },
        "expected a row_step of at least 80 bytes, 5 points of 16 bytes each, got 79",
    );
    refuses(
        PointCloud2 { fields: &XYZ[..2], ..good },
        "expected the fields x, y and z, got none named `z`; name the coordinates so",
    );
    let with_z = |z| [XYZ[0], XYZ[1], z];
    refuses(
        PointCloud2 { fields: &with_z(field("z", 13, 7, 1)), ..good },
        "expected fields within the 16 bytes of a point, got one that ends at byte 17 (field `z`); correct its offset \
         or point_step",
    );
    refuses(
        PointCloud2 { fields: &with_z(field("z", 8, 9, 1)), ..good },
        "expected a datatype from 1 (int8) to 8 (float64), got 9 (field `z`)",
    );
    let huge = PointCloud2 { width: u32::MAX, height: u32::MAX, row_step: u32::MAX, point_step: 1, ..good };
    assert!(PointCloud2View::new(huge).is_err(), "sizes near 2^64 are refused");
    let most = field("z", u32::MAX, 8, u32::MAX);
    assert!(PointCloud2View::new(PointCloud2 { fields: &with_z(most), ..good }).is_err(), "{most:?}");
}

#[test]
fn empty_messages_have_no_points() {
    for (width, height) in [(0, 0), (0, 3), (3, 0)] {
        let view = PointCloud2View::new(message(&[], width, height, [0, 0])).unwrap();
        assert!(view.is_empty(), "{width} × {height}");
        assert_eq!((view.position(0), view.positions(Invalid::Keep).count()), (None, 0));
        assert_eq!(view.cloud(), Err(CloudError::TooFew { distinct: 0, given: 0 }));
    }
}
