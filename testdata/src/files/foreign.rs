//! The model in formats of scanners and engines.

use std::io::{Cursor, Write};

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use laz::encoders::ArithmeticEncoder;
use laz::las::v2::LasPoint0Compressor;
use laz::models::{ArithmeticModel, ArithmeticModelBuilder};
use laz::record::{FieldCompressor, RecordCompressor, SequentialPointRecordCompressor};
use laz::{LasZipCompressor, LazVlr, LazVlrBuilder};

use super::model::{colours, normals, points, quads, triangles};

/// Steps of coordinates in LAS: all points of the model are whole multiples.
const STEP: f64 = 0.125;

/// Offset of coordinates in LAS.
const ORIGIN: [f64; 3] = [4_000_000.0, -500_000.0, 0.0];

/// Returns the bytes of a record, of which `extra` are extra bytes.
fn stride(format: u8, extra: u16) -> u16 {
    [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67][usize::from(format)] + extra
}

/// Returns the class of the `i`-th point.
#[must_use]
pub fn class(i: usize) -> u8 {
    [2, 6, 1][i % 3]
}

/// Returns the intensity of the `i`-th point.
///
/// # Panics
/// If the parameters are not supported by the format.
#[must_use]
pub fn intensity(i: usize) -> u16 {
    u16::try_from(i * 1000).expect("twenty points")
}

/// Returns the points of the model as far from the origin as in a survey.
#[must_use]
pub fn far_points() -> Vec<[f64; 3]> {
    points().iter().map(|p| [0, 1, 2].map(|k| f64::from(p[k]) + ORIGIN[k])).collect()
}

#[expect(clippy::cast_possible_truncation, reason = "whole and small")]
fn records(format: u8, extra: u16) -> Vec<u8> {
    let mut all = Vec::new();
    for (i, (p, c)) in points().iter().zip(colours()).enumerate() {
        let mut record = vec![0; usize::from(stride(format, extra))];
        for k in 0..3 {
            let steps = (f64::from(p[k]) / STEP).round() as i32;
            record[4 * k..4 * k + 4].copy_from_slice(&steps.to_le_bytes());
        }
        record[12..14].copy_from_slice(&intensity(i).to_le_bytes());
        // The class shares its byte with flags in the old formats.
        if format < 6 {
            record[15] = class(i) | 0x60
        } else {
            record[16] = class(i)
        }
        let at = match format {
            2 => Some(20),
            3 | 5 => Some(28),
            7 | 8 | 10 => Some(30),
            _ => None,
        };
        if let Some(at) = at {
            for k in 0..3 {
                record[at + 2 * k..at + 2 * k + 2]
                    .copy_from_slice(&(u16::from(c[k]) * 256 + 17).to_le_bytes());
            }
        }
        all.extend(record);
    }
    all
}

/// Returns LAS of this point format: version 1.4 from format 6 on, 1.2 or 1.3 before. `compressed`
/// makes it LAZ, in chunks of the given number of points.
///
/// # Panics
/// If the parameters are not supported by the format.
#[must_use]
pub fn las(format: u8, extra: u16, compressed: Option<u32>) -> Vec<u8> {
    let minor = if format >= 6 { 4 } else { 2 + format / 4 };
    let size: u16 = [227, 235, 375][usize::from(minor - 2)];
    let vlr = compressed.map(|chunk| {
        let builder = LazVlrBuilder::default().with_point_format(format, extra).expect("a known format");
        builder.with_fixed_chunk_size(chunk).build()
    });
    let mut content = Vec::new();
    if let Some(vlr) = &vlr {
        vlr.write_to(&mut content).expect("memory suffices");
    }
    // Another record comes first.
    let mut before = vec![0; 54 + 3];
    before[20] = 3;
    if vlr.is_some() {
        let mut about = vec![0; 54];
        about[2..2 + LazVlr::USER_ID.len()].copy_from_slice(LazVlr::USER_ID.as_bytes());
        about[18..20].copy_from_slice(&LazVlr::RECORD_ID.to_le_bytes());
        about[20..22].copy_from_slice(&u16::try_from(content.len()).expect("short").to_le_bytes());
        before.extend(about);
        before.extend(content);
    }
    let mut bytes = vec![0; usize::from(size)];
    bytes[..4].copy_from_slice(b"LASF");
    bytes[24..26].copy_from_slice(&[1, minor]);
    bytes[94..96].copy_from_slice(&size.to_le_bytes());
    let start = u32::from(size) + u32::try_from(before.len()).expect("short");
    bytes[96..100].copy_from_slice(&start.to_le_bytes());
    bytes[100] = if vlr.is_some() { 2 } else { 1 };
    bytes[104] = format | if vlr.is_some() { 0x80 } else { 0 };
    bytes[105..107].copy_from_slice(&stride(format, extra).to_le_bytes());
    if format < 6 {
        bytes[107] = 20;
    } else {
        bytes[247] = 20;
    }
    for (at, three) in [(131, [STEP; 3]), (155, ORIGIN)] {
        for k in 0..3 {
            bytes[at + 8 * k..at + 8 * k + 8].copy_from_slice(&f64::to_le_bytes(three[k]));
        }
    }
    bytes.extend(before);
    match vlr {
        None => bytes.extend(records(format, extra)),
        Some(vlr) => {
            let end = bytes.len() as u64;
            let mut out = Cursor::new(bytes);
            out.set_position(end);
            let mut packer = LasZipCompressor::new(&mut out, vlr).expect("a known format");
            packer.compress_many(&records(format, extra)).expect("memory suffices");
            packer.done().expect("memory suffices");
            drop(packer);
            bytes = out.into_inner();
        }
    }
    bytes
}

/// Returns LAZ of point format 1 whose second time switches a million times from one sequence of
/// times to the next.
///
/// # Panics
/// Never, while memory suffices.
#[must_use]
pub fn laz_of_endless_times() -> Vec<u8> {
    struct Switches(ArithmeticModel);
    impl<W: Write> FieldCompressor<W> for Switches {
        fn size_of_field(&self) -> usize {
            8
        }
        fn compress_first(&mut self, out: &mut W, time: &[u8]) -> std::io::Result<()> {
            out.write_all(time)
        }
        fn compress_with(&mut self, encoder: &mut ArithmeticEncoder<W>, _: &[u8]) -> std::io::Result<()> {
            (0..1_000_000).try_for_each(|_| encoder.encode_symbol(&mut self.0, 3))
        }
    }
    let mut bytes = las(1, 0, Some(50_000));
    let start = u32::from_le_bytes([96, 97, 98, 99].map(|at| bytes[at]));
    bytes.truncate(start as usize);
    // A single chunk, to the end of the file, needs no table.
    let packing = bytes.windows(LazVlr::USER_ID.len()).position(|at| at == LazVlr::USER_ID.as_bytes());
    let packing = packing.expect("of LAZ") - 2 + 54;
    bytes[packing..packing + 2].copy_from_slice(&1_u16.to_le_bytes());
    let mut packer = SequentialPointRecordCompressor::new(&mut bytes);
    packer.add_field_compressor(LasPoint0Compressor::default());
    packer.add_field_compressor(Switches(ArithmeticModelBuilder::new(6).with_compression(true).build()));
    for record in records(1, 0)[..2 * 28].chunks_exact(28) {
        packer.compress_next(record).expect("memory suffices");
    }
    packer.done().expect("memory suffices");
    drop(packer);
    bytes
}

/// Returns E57 of two scans of ten points each, with poses; the second scan has an additional
/// invalid point.
///
/// # Panics
/// If the parameters are not supported by the format.
pub fn e57() -> Vec<u8> {
    use e57::{E57Writer, Record, RecordDataType, RecordName, RecordValue, Transform};
    let mut out = Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut out, "file").expect("memory suffices");
    for (scan, height) in [(0, 5.0), (1, 7.0)] {
        let mut prototype = vec![
            Record::CARTESIAN_X_F64,
            Record::CARTESIAN_Y_F64,
            Record::CARTESIAN_Z_F64,
            Record::COLOR_RED_U8,
        ];
        prototype.extend([Record::COLOR_GREEN_U8, Record::COLOR_BLUE_U8, Record::INTENSITY_UNIT_F32]);
        let is_invalid = RecordDataType::Integer { min: 0, max: 2 };
        prototype.push(Record { name: RecordName::CartesianInvalidState, data_type: is_invalid });
        let mut cloud = writer.add_pointcloud(&format!("scan {scan}"), prototype).expect("memory suffices");
        let mut pose = Transform::default();
        pose.translation.z = height;
        cloud.set_transform(Some(pose));
        let rows = points().into_iter().zip(colours()).enumerate().skip(10 * scan).take(10);
        for (i, (p, c)) in rows {
            let mut row: Vec<RecordValue> =
                [f64::from(p[0]), f64::from(p[1]), f64::from(p[2]) - height].map(RecordValue::Double).into();
            row.extend(c.map(|channel| RecordValue::Integer(channel.into())));
            row.push(RecordValue::Single(f32::from(u8::try_from(i).expect("few")) / 32.0));
            row.push(RecordValue::Integer(0));
            cloud.add_point(row).expect("memory suffices");
        }
        if scan == 1 {
            let mut row: Vec<RecordValue> = [9.0; 3].map(RecordValue::Double).into();
            row.extend([0; 3].map(RecordValue::Integer));
            row.extend([RecordValue::Single(0.0), RecordValue::Integer(2)]);
            cloud.add_point(row).expect("memory suffices");
        }
        cloud.finalize().expect("memory suffices");
    }
    writer.finalize().expect("memory suffices");
    drop(writer);
    out.into_inner()
}

/// Returns a NumPy array of this type.
///
/// # Panics
/// If the parameters are not supported by the format.
#[must_use]
pub fn npy(kind: &str) -> Vec<u8> {
    let mut header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': (20, 3), }}");
    while (header.len() + 11) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(u16::try_from(header.len()).expect("short").to_le_bytes());
    bytes.extend(header.bytes());
    for x in points().iter().flatten() {
        match kind {
            "<f4" => bytes.extend(x.to_le_bytes()),
            ">f4" => bytes.extend(x.to_be_bytes()),
            _ => bytes.extend(f64::from(*x).to_le_bytes()),
        }
    }
    bytes
}

/// Returns STL as text, or binary.
pub fn stl(is_text: bool) -> Vec<u8> {
    let points = points();
    let mut bytes = if is_text { b"solid sheet\n".to_vec() } else { vec![b' '; 80] };
    if !is_text {
        bytes.extend(24_u32.to_le_bytes());
    }
    for triangle in triangles() {
        if is_text {
            bytes.extend(b"  facet normal 0 0 1\n    outer loop\n");
        } else {
            bytes.extend([0; 12]);
        }
        for corner in triangle {
            let [x, y, z] = points[corner as usize];
            if is_text {
                bytes.extend(format!("      vertex {x} {y} {z}\n").bytes());
            } else {
                bytes.extend([x, y, z].map(f32::to_le_bytes).as_flattened());
            }
        }
        if is_text {
            bytes.extend(b"    endloop\n  endfacet\n");
        } else {
            bytes.extend([0; 2]);
        }
    }
    if is_text {
        bytes.extend(b"endsolid sheet\n");
    }
    bytes
}

/// Returns OFF with normals and colours.
#[must_use]
pub fn off() -> Vec<u8> {
    let mut text = String::from("CNOFF # a sheet\n20 12 0\n\n");
    for ((p, n), [r, g, b]) in points().iter().zip(normals()).zip(colours()) {
        text += &format!("{} {} {}  {} {} {}  {r} {g} {b} 255\n", p[0], p[1], p[2], n[0], n[1], n[2]);
    }
    for [a, b, c, d] in quads() {
        text += &format!("4 {a} {b} {c} {d} 0.5 0.5 0.5\n");
    }
    text.into_bytes()
}

/// Returns glTF with its buffer in the document, or GLB. A node halves the model and its parent
/// doubles it again.
///
/// # Panics
/// If the parameters are not supported by the format.
pub fn gltf(is_binary: bool) -> Vec<u8> {
    let mut buffer = Vec::new();
    for p in points() {
        buffer.extend(p.map(f32::to_le_bytes).as_flattened());
    }
    for n in unit_normals() {
        buffer.extend(n.map(f32::to_le_bytes).as_flattened());
    }
    for [r, g, b] in colours() {
        buffer.extend([r, g, b, 255]);
    }
    for corner in triangles().as_flattened() {
        buffer.extend(u16::try_from(*corner).expect("few").to_le_bytes());
    }
    let uri = format!(r#","uri":"data:application/octet-stream;base64,{}""#, BASE64_STANDARD.encode(&buffer));
    let uri = if is_binary { "" } else { &uri };
    let length = buffer.len();
    let document = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
"nodes":[{{"children":[1],"scale":[2,2,2],"translation":[1,0,0]}},{{"mesh":0,"scale":[0.5,0.5,0.5],"translation":[-0.5,0,0]}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1,"COLOR_0":2}},"indices":3}}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":20,"type":"VEC3","min":[0,0,-0.25],"max":[4,1.5,0.25]}},
{{"bufferView":0,"byteOffset":240,"componentType":5126,"count":20,"type":"VEC3"}},
{{"bufferView":1,"componentType":5121,"normalized":true,"count":20,"type":"VEC4"}},
{{"bufferView":2,"componentType":5123,"count":72,"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteLength":480}},{{"buffer":0,"byteOffset":480,"byteLength":80}},
{{"buffer":0,"byteOffset":560,"byteLength":144}}],"buffers":[{{"byteLength":{length}{uri}}}]}}"#
    );
    if !is_binary {
        return document.into_bytes();
    }
    let mut json = document.into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    let word = |length: usize| u32::try_from(length).expect("short").to_le_bytes();
    bytes.extend(word(12 + 8 + json.len() + 8 + buffer.len()));
    bytes.extend(word(json.len()));
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes.extend(word(buffer.len()));
    bytes.extend(b"BIN\0");
    bytes.extend(buffer);
    bytes
}

/// Returns the normals of the model at unit length, as glTF requires.
#[must_use]
pub fn unit_normals() -> Vec<[f32; 3]> {
    let unit = |n: [f32; 3]| {
        let length = n.iter().map(|c| c * c).sum::<f32>().sqrt();
        n.map(|c| c / length)
    };
    normals().into_iter().map(unit).collect()
}
