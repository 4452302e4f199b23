//! Every kind of error, with its place and its exact message.

use std::fs;
use std::path::Path;

use nearmiss_geometry::CloudError;
use nearmiss_io::{At, Fault, Format, ReadError, read, read_bytes, read_mesh_bytes};

use nearmiss_testdata::files::foreign;
use nearmiss_testdata::files::plain::{self, Encoding};

fn error(bytes: &[u8], name: &str) -> ReadError {
    match read_bytes(bytes, None, Path::new(name)) {
        Ok(model) => panic!("{name} reads as {} points", model.cloud.len()),
        Err(error) => error,
    }
}

#[track_caller]
fn says(text: &str, name: &str, message: &str) {
    assert_eq!(error(text.as_bytes(), name).to_string(), message, "{text}");
}

const SQUARE: &str = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n";

fn ascii_ply(vertices: &str, faces: &str, body: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
        property float z\nelement face {faces}\nproperty list uchar int vertex_indices\nend_header\n{body}"
    )
}

#[test]
fn files_that_are_none() {
    let folder = tempfile::tempdir().unwrap();
    assert!(matches!(read(folder.path(), None), Err(ReadError::NotAFile { .. })));
    let missing = folder.path().join("missing.ply");
    let absent = read(&missing, None).unwrap_err();
    assert!(absent.to_string().starts_with(missing.to_str().unwrap()), "{absent}");
    assert!(absent.to_string().ends_with("missing.ply: no such file; check the path"), "{absent}");
    assert!(matches!(absent, ReadError::Io { .. }));
    let empty = folder.path().join("empty.ply");
    fs::write(&empty, "").unwrap();
    assert!(matches!(read(&empty, None), Err(ReadError::Empty { .. })));
    let mark_alone = error(b"\xef\xbb\xbf", "a.xyz");
    assert!(matches!(mark_alone, ReadError::Empty { .. }));
    if cfg!(unix) {
        let device = read(Path::new("/dev/zero"), None);
        assert!(matches!(device, Err(ReadError::NotAFile { .. })));
    }
}

#[test]
fn formats_are_listed_and_found_by_every_name() {
    assert_eq!(
        Format::list(),
        "ply, pcd, xyz (also csv, txt, asc, pts, xyzn, xyzrgb, 3d or neu), obj, las (also laz), e57, npy, stl, off or \
         gltf (also glb)"
    );
    for format in Format::ALL {
        for name in format.names() {
            assert_eq!(name.to_ascii_uppercase().parse(), Ok(format));
        }
    }
}

#[test]
fn formats_that_are_none_of_ours() {
    says(
        "some words\n",
        "notes.md",
        &format!(
            "notes.md: expected {}, got an unknown format; if it is one of these, name it with `preprocess --format`",
            Format::list()
        ),
    );
    says(
        "PK\u{3}\u{4}...",
        "hall.zip",
        "hall.zip: expected points or a mesh, got a zip archive; unpack it first",
    );
    let told = read_bytes(b"1 2 3\n", Some(Format::Ply), Path::new("a")).unwrap_err();
    assert_eq!(
        told.to_string(),
        "a: line 1: expected a header, got numbers; if the lines are points, read the file with `--format xyz`"
    );
}

#[test]
fn headers_of_ply() {
    let cases = [
        ("plx\n", "line 1: expected `ply`, got `plx`"),
        (
            "ply\nformat ascii 1.0\n",
            "line 2: expected `end_header` at the end of the header, got the end of the file; export the file again",
        ),
        (
            "ply\nformat text 1.0\n",
            "line 2: expected `ascii`, `binary_little_endian` or `binary_big_endian`, got `text`",
        ),
        ("ply\nproperty float x\n", "line 2: expected `element` before the first property, got `property`"),
        (
            "ply\nelement vertex 3\nproperty half x\n",
            "line 3: expected a type of property: char, uchar, short, ushort, int, uint, float, double, int8, uint8, int16, \
             uint16, int32, uint32, float32 or float64, got `half`",
        ),
        ("ply\nelement vertex -3\n", "line 2: expected the number of elements, got `-3`"),
        (
            "ply\nelement vertex 3\nproperty list uchar float x\n",
            "line 3: expected a number as coordinate, such as `property float x`, got `property list`",
        ),
        (
            "ply\nelements\n",
            "line 2: expected `element`, `property`, `comment` or `end_header`, got `elements`",
        ),
        (
            "ply\nelement vertex 0\nelement vertex 1\n",
            "line 3: expected one `vertex`, got two; remove one of them",
        ),
        (
            "ply\nelement vertex 0\nproperty int x\nproperty int x\n",
            "line 4: expected one `x`, got two; remove one of them",
        ),
        (
            "ply\nend_header\n",
            "line 2: expected an encoding, such as `format ascii 1.0`, in the header, got none",
        ),
        (
            "ply\nformat ascii 1.0\nend_header\n",
            "line 3: expected an element `vertex` in the header, got none",
        ),
        (
            "ply\nformat ascii 1.0\nelement vertex 0\nproperty int x\nproperty int z\nend_header\n",
            "line 3: expected the coordinate y in the header, got none",
        ),
    ];
    for (text, message) in cases {
        says(text, "a.ply", &format!("a.ply: {message}"));
    }
}

#[test]
fn rows_of_ascii_ply() {
    let cases = [
        (
            ascii_ply("4", "1", "0 0 0\n\n1 0 O\n"),
            "line 12, vertex 1: expected a number in column `z`, got `O`",
        ),
        (
            ascii_ply("4", "1", "0 0 0\n1 0\n"),
            "line 11, vertex 1: expected a value in column `z`, got the end of the line",
        ),
        (
            ascii_ply("4", "1", "0 0 0 7\n"),
            "line 10, vertex 0: expected one value for each column of the header, got more",
        ),
        (
            ascii_ply("99999999999", "1", SQUARE),
            "line 3: expected 99999999999 `vertex` elements, got 4; the file is cut off, or this count is wrong",
        ),
        (
            ascii_ply("4", "2", &format!("{SQUARE}3 0 1 2\n")),
            "line 7: expected 2 `face` elements, got 1; the file is cut off, or this count is wrong",
        ),
        (
            ascii_ply("4", "1", &format!("{SQUARE}3 0 1 2\n3 0 1 3\n")),
            "line 15: expected the end of the file after the last element, got more text; correct the count in the header",
        ),
        (
            ascii_ply("4", "1", &format!("{SQUARE}3 0 1 4\n")),
            "line 14, face 0: expected a vertex index from 0 to 3, got 4",
        ),
        (
            ascii_ply("4", "1", &format!("{SQUARE}3 0 1 -1\n")),
            "line 14, face 0: expected a vertex index from 0 to 3, got -1",
        ),
        (
            ascii_ply("4", "1", &format!("{SQUARE}3 0 1 1.5\n")),
            "line 14, face 0: expected a vertex index (a whole number), got `1.5`",
        ),
        (
            ascii_ply("4", "1", &format!("{SQUARE}-3 0 1 2\n")),
            "line 14, face 0: expected a list length (a whole number), got `-3`",
        ),
        (
            ascii_ply("4", "1", &format!("{SQUARE}9999999999999 0 1 2\n")),
            "line 14, face 0: expected a value in column `vertex_indices`, got the end of the line",
        ),
        (
            ascii_ply("4", "1", &format!("{SQUARE}2 0 1\n")),
            "line 14, face 0: expected at least 3 corners of the face, got 2",
        ),
    ];
    for (text, message) in cases {
        says(&text, "a.ply", &format!("a.ply: {message}"));
    }
}

#[test]
fn rows_of_binary_ply() {
    let whole = plain::ply(Encoding::Little, "float", "int");
    let start = whole.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    // Two cameras, the second with three floats, then vertices, the first without tags.
    let vertices = start + (8 + 2) + (8 + 2 + 12);
    let cut = error(&whole[..vertices + 10], "a.ply").to_string();
    assert_eq!(
        cut,
        "a.ply: line 9: expected 20 `vertex` elements, got 0; the file is cut off, or this count is wrong"
    );
    let mut long = whole[..vertices + 40].to_vec();
    long[vertices + 9] = 200;
    let ReadError::Malformed { place, fault, .. } = error(&long, "a.ply") else { panic!("malformed") };
    assert_eq!(place.at, At::Byte(vertices as u64));
    assert_eq!(place.to_string(), format!("byte {vertices}, vertex 0"));
    assert_eq!(fault, Fault::ListPastEnd { values: 200, left: 30 });
    long[vertices + 9] = 10;
    let past = error(&long, "a.ply").to_string();
    assert_eq!(
        past,
        format!("a.ply: byte {vertices}, vertex 0: expected the rest of an element, got the end of the file")
    );
    let header = "ply\nformat binary_big_endian 1.0\nelement vertex 18446744073709551615\nproperty float x\n\
        property float y\nproperty float z\nend_header\n0123456789ab";
    says(
        header,
        "a.ply",
        "a.ply: line 3: expected 18446744073709551615 `vertex` elements, got 1; the file is cut off, or this count is wrong",
    );
}

fn pcd(change: (&str, &str)) -> Vec<u8> {
    let text = format!(
        "VERSION .7\nFIELDS x y z t\nSIZE 4 4 4 2\nTYPE F F F U\nCOUNT 1 1 1 2\nWIDTH 2\nHEIGHT 2\n\
        POINTS 4\nDATA ascii\n{}",
        "0 0 0 5 5\n".repeat(4)
    );
    assert!(text.contains(change.0), "{change:?}");
    text.replacen(change.0, change.1, 1).into_bytes()
}

#[test]
fn pcd_in_text() {
    let cases = [
        (
            ("FIELDS x y z t\n", ""),
            "line 8: expected fields, such as `FIELDS x y z`, in the header, got none",
        ),
        (("SIZE 4 4 4 2\n", ""), "line 8: expected sizes, such as `SIZE 4 4 4`, in the header, got none"),
        (("TYPE F F F U\n", ""), "line 8: expected types, such as `TYPE F F F`, in the header, got none"),
        (("SIZE 4 4 4 2", "SIZE 4 4"), "line 3: expected 4 entries in SIZE, one for each field, got 2"),
        (
            ("COUNT 1 1 1 2", "COUNT 1 1 1 2 1"),
            "line 5: expected 4 entries in COUNT, one for each field, got 5",
        ),
        (
            ("SIZE 4", "SIZE 3"),
            "line 4: expected type F of 4 or 8 bytes, or I or U of 1, 2, 4 or 8 bytes, for field `x`, got F of 3 bytes",
        ),
        (
            ("SIZE 4 4 4 2", "SIZE 4 4 4 18446744073709551615"),
            "line 3: expected points shorter than 2^63 bytes, got `18446744073709551615`",
        ),
        (("SIZE 4 4 4 2", "SIZE 4 4 4 two"), "line 3: expected the size of a field in bytes, got `two`"),
        (("COUNT 1 1 1 2", "COUNT 1 1 1 -2"), "line 5: expected the number of values of a field, got `-2`"),
        (("x y z t", "x y w t"), "line 2: expected the coordinate z in the header, got none"),
        (("x y z t", "x y z X"), ""),
        (("WIDTH 2", "WIDTH"), "line 6: expected a count, got ``"),
        (("HEIGHT 2", "HEIGHT 3"), "line 8: expected POINTS to equal WIDTH × HEIGHT, 2 × 3, got 4"),
        (
            ("WIDTH 2\nHEIGHT 2\nPOINTS 4\n", ""),
            "line 6: expected the number of points, `POINTS`, in the header, got none",
        ),
        (
            ("WIDTH 2\nHEIGHT 2\nPOINTS 4\n", "POINTS 5\n"),
            "line 6: expected 5 `point` elements, got 4; the file is cut off, or this count is wrong",
        ),
        (
            ("WIDTH 2\nHEIGHT 2\nPOINTS 4\n", "POINTS 3\n"),
            "line 11: expected the end of the file after the last element, got more text; correct the count in the header",
        ),
        (
            ("DATA ascii", "DATA base64"),
            "line 9: expected `ascii`, `binary` or `binary_compressed`, got `base64`",
        ),
        (
            ("DATA ascii\n", ""),
            "line 9: expected a line of a PCD header, such as `FIELDS x y z` or `DATA ascii`, got `0`",
        ),
        (
            ("0 0 0 5 5", "0 0 0 5"),
            "line 10, point 0: expected a value in column `t`, got the end of the line",
        ),
        (
            ("0 0 0 5 5", "0 0 0 5 5 5"),
            "line 10, point 0: expected one value for each column of the header, got more",
        ),
        (("0 0 0 5 5", "0 0,0 0 5 5"), "line 10, point 0: expected a number in column `y`, got `0,0`"),
    ];
    for (change, message) in cases {
        let found = error(&pcd(change), "a.pcd").to_string();
        if message.is_empty() {
            // A field with two values is not a coordinate, whatever its name.
            assert!(found.contains("distinct finite points"), "{found}");
        } else {
            assert_eq!(found, format!("a.pcd: {message}"), "{change:?}");
        }
    }
    let twice = error(b"FIELDS x y z z\nSIZE 4 4 4 4\nTYPE F F F F\nPOINTS 1\nDATA ascii\n", "a");
    assert_eq!(twice.to_string(), "a: line 1: expected one `z`, got two; remove one of them");
    let endless = error(b"# .PCD v0.7\nFIELDS x y z\n", "a").to_string();
    assert!(
        endless.contains("line 2: expected `DATA` at the end of the header, got the end of the file"),
        "{endless}"
    );
    says(
        "1 2 3\n",
        "a.pcd",
        "a.pcd: line 1: expected a header, got numbers; if the lines are points, read the file with `--format xyz`",
    );
}

#[test]
fn pcd_in_bytes() {
    let binary = plain::pcd("binary");
    assert_eq!(
        error(&binary[..binary.len() - 1], "a").to_string(),
        "a: line 10: expected 22 `point` elements, got 21; the file is cut off, or this count is wrong"
    );
    let whole = plain::pcd("binary_compressed");
    let start = whole.windows(11).position(|w| w == b"compressed\n").unwrap() + 11;
    let changed = |at: usize, byte: u8| {
        let mut bytes = whole.clone();
        bytes[start + at] = byte;
        match error(&bytes, "a") {
            ReadError::Malformed { place, fault, .. } => (place.at, fault),
            other => panic!("{other}"),
        }
    };
    let at = |byte: usize| At::Byte((start + byte) as u64);
    // 22 points of 38 bytes.
    let (declared, needed) = (836 + (255 << 24), 836);
    assert_eq!(changed(7, 255), (at(4), Fault::UnpackedSize { declared, needed }));
    let left = (whole.len() - start - 8) as u64;
    let packed = u64::from(u32::from_le_bytes([whole[start], whole[start + 1], 9, 0]));
    assert_eq!(changed(2, 9), (at(0), Fault::ListPastEnd { values: packed, left }));
    assert_eq!(changed(8, 0xff), (at(8), Fault::Corrupt));
    assert!(matches!(changed(0, whole[start] - 1), (At::Byte(_), Fault::Corrupt)));
    let cut = error(&whole[..start + 7], "a").to_string();
    assert_eq!(cut, format!("a: byte {start}: expected the rest of an element, got the end of the file"));
}

#[test]
fn text() {
    let cases = [
        ("0 0 0\n1 zero 0\n", "line 2, point 1: expected a number in column `y`, got `zero`"),
        ("# two\n0 0 0\n\n1 0\n", "line 4, point 1: expected a value in column `z`, got the end of the line"),
        (
            "1,5;2,5;0,0\n",
            "line 1: expected three numbers (with decimal points), or column names that include x, y and z, got `1,5;2,5;0,0`",
        ),
        ("0;0;0\n1;2,5;0\n", "line 2, point 1: expected a number in column `y`, got `2,5`"),
        ("0,0,0\n1,,0\n", "line 2, point 1: expected a number in column `y`, got ``"),
        (
            "a,b,c\n0,0,0\n",
            "line 1: expected three numbers (with decimal points), or column names that include x, y and z, got `a,b,c`",
        ),
        ("x,y,z,X\n0,0,0,0\n", "line 1: expected one `x`, got two; remove one of them"),
        (
            "x y z w nx ny nz\n1 2 3 4\n",
            "line 2, point 0: expected a value in column `nx`, got the end of the line",
        ),
        (
            "x y z w nx ny nz\n1 2 3\n",
            "line 2, point 0: expected a value in column `nx`, got the end of the line",
        ),
        (
            "\n3\n0 0 0\n1 1 1\n",
            "line 2: expected 3 `point` elements, got 2; the file is cut off, or this count is wrong",
        ),
        (
            "1\n0 0 0\n1 1 1\n",
            "line 3: expected the end of the file after the last element, got more text; correct the count in the header",
        ),
        ("7\n", "line 1: expected 7 `point` elements, got 0; the file is cut off, or this count is wrong"),
        (
            "# nothing\n",
            "expected at least 8 distinct finite points, got 0 (of 0 given); give more points, or sample the surface of a mesh",
        ),
    ];
    for (text, message) in cases {
        says(text, "a.csv", &format!("a.csv: {message}"));
    }
}

#[test]
fn obj() {
    let square = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";
    let cases = [
        ("v 1 2\n", "line 1, vertex 0: expected a value in column `z`, got the end of the line"),
        ("# o\nv 1 2 c\n", "line 2, vertex 0: expected a number in column `z`, got `c`"),
        ("f 1 2 5\n", "line 5, face 0: expected a vertex index from 1 to 4, got 5"),
        ("f 1 2 0\n", "line 5, face 0: expected a vertex index from 1 to 4, got 0"),
        ("f 1 2 3\nf 1 2 -5\n", "line 6, face 1: expected a vertex index from -4 to -1, got -5"),
        ("f 1 2\n", "line 5, face 0: expected at least 3 corners of the face, got 2"),
        ("f 1/1 /2 3\n", "line 5, face 0: expected a vertex index (a whole number), got `/2`"),
        ("f 1 2 3.5\n", "line 5, face 0: expected a vertex index (a whole number), got `3.5`"),
        (
            "f 1 2 9223372036854775807\n",
            "line 5, face 0: expected a vertex index from 1 to 4, got 9223372036854775807",
        ),
        (
            "f 1 2 -9223372036854775808\n",
            "line 5, face 0: expected a vertex index from -4 to -1, got -9223372036854775808",
        ),
    ];
    for (text, message) in cases {
        let text = if text.starts_with('f') { format!("{square}{text}") } else { text.to_owned() };
        says(&text, "a.obj", &format!("a.obj: {message}"));
    }
    let joined = format!("{square}f 1 \\\n2 \\\n3\nf 1 2 7\n");
    says(&joined, "a.obj", "a.obj: line 8, face 1: expected a vertex index from 1 to 4, got 7");
}

#[test]
fn meshes() {
    let square = ascii_ply("4", "1", &format!("{SQUARE}3 0 1 2\n"));
    let few = error(square.as_bytes(), "a.ply");
    assert!(matches!(few, ReadError::Cloud { cause: CloudError::TooFew { distinct: 4, given: 4 }, .. }));
    let mesh = read_mesh_bytes(square.as_bytes(), None, Path::new("a.ply")).unwrap();
    assert_eq!((mesh.vertices().len(), mesh.triangles()), (4, &[[0, 1, 2]][..]));
    let none = read_mesh_bytes(SQUARE.as_bytes(), None, Path::new("a.xyz")).unwrap_err();
    assert_eq!(none.to_string(), "a.xyz: expected a mesh, got points without faces; name a file with faces");
    let broken = square.replace("1 1 0", "1 nan 0");
    let broken = read_mesh_bytes(broken.as_bytes(), None, Path::new("a.ply")).unwrap_err();
    assert_eq!(
        broken.to_string(),
        "a.ply: expected finite coordinates in a mesh, got NaN or infinity (vertex 3); repair it, or remove the faces to \
         use the points alone"
    );
}

/// Found by fuzzing: a URI of a kilobyte was quoted in full in the message.
#[test]
fn what_a_decoder_repeats_of_the_file_is_cut() {
    let uri = "A".repeat(1000);
    let text = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"buffers\":[{{\"uri\":\"{uri}\",\"byteLength\":4}}],\
         \"scenes\":[{{\"nodes\":[]}}],\"scene\":0}}"
    );
    let message = read_bytes(text.as_bytes(), None, Path::new("sheet.gltf")).unwrap_err().to_string();
    assert!(message.starts_with("sheet.gltf") && message.contains("AAAA"), "{message}");
    assert!(message.chars().count() < 300 && message.contains('…'), "{message}");
}

/// The decoder of `laz` 0.13 recurses for each switch, and overflows the stack.
#[test]
fn times_of_laz_that_switch_without_end() {
    let refused = error(&foreign::laz_of_endless_times(), "a.laz").to_string();
    assert_eq!(
        refused,
        "a.laz: byte 384, point 1: cannot decode the data: expected a GPS time, got a second switch of sequences"
    );
}
