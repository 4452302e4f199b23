//! Compressed files that expand to far more than their length.

use std::path::Path;

use nearmiss_io::{Fault, ReadError, read_bytes};

/// Creates a `binary_compressed` file of points with one-byte coordinates, whose compressed data
/// are `packed`.
fn file(points: usize, packed: &[u8]) -> Vec<u8> {
    let mut bytes = format!(
        "VERSION .7\nFIELDS x y z\nSIZE 1 1 1\nTYPE U U U\nCOUNT 1 1 1\nWIDTH {points}\nHEIGHT 1\nPOINTS {points}\n\
         DATA binary_compressed\n"
    )
    .into_bytes();
    for length in [packed.len(), 3 * points] {
        bytes.extend(u32::try_from(length).expect("a small file").to_le_bytes());
    }
    bytes.extend(packed);
    bytes
}

/// Compresses `length` zeros as runs of 264, which take three bytes each. The first byte and the
/// rest are literals.
fn zeros(length: usize) -> Vec<u8> {
    let (runs, rest) = ((length - 1) / 264, (length - 1) % 264);
    let mut packed = vec![0, 0];
    packed.extend([0xE0, 255, 0].repeat(runs));
    (0..rest).for_each(|_| packed.extend([0, 0]));
    packed
}

#[test]
fn twenty_million_points_from_two_thirds_of_a_megabyte_are_refused() {
    let packed = zeros(60_000_000);
    assert!(packed.len() < 700_000, "{} bytes", packed.len());
    let refused = read_bytes(&file(20_000_000, &packed), None, Path::new("bomb.pcd")).unwrap_err();
    let ReadError::Malformed { fault: Fault::Expansion { points: 20_000_000, packed: length }, .. } = refused
    else {
        panic!("{refused}")
    };
    assert_eq!(length, packed.len() as u64);
    assert!(refused.to_string().ends_with("save the file with `DATA binary`"), "{refused}");
}

/// A camera frame of two million pixels, of which one in fifty has a point.
#[test]
fn a_frame_that_saw_little_is_read() {
    let count = 2_000_000_u32;
    let pixel = |i: u32| if i.is_multiple_of(50) { i.to_le_bytes()[..3].to_vec() } else { vec![0; 3] };
    let pixels: Vec<Vec<u8>> = (0..count).map(pixel).collect();
    let columns: Vec<u8> = (0..3).flat_map(|k| pixels.iter().map(move |p| p[k])).collect();
    let packed = lzf::compress(&columns).unwrap();
    assert!(packed.len() < 600_000, "{} bytes", packed.len());
    let model = read_bytes(&file(count as usize, &packed), None, Path::new("frame.pcd")).unwrap();
    assert_eq!(model.cloud.len(), 40_000, "each pixel that saw something; the first is at the others' place");
}
