//! Each kind of error, with its place and the very words that a user reads.

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
fn formats_that_are_none_of_ours() {
    says(
        "some words\n",
        "notes.md",
        "notes.md: unknown format; known are ply, pcd, las, laz, e57, xyz (also csv and other text), npy, obj, stl, off \
         and gltf; say which with `--format`",
    );
    says(
        "PK\u{3}\u{4}...",
        "hall.zip",
        "hall.zip: this is a zip archive, which this version cannot read; unpack it first",
    );
    let told = read_bytes(b"1 2 3\n", Some(Format::Ply), Path::new("a")).unwrap_err();
    assert_eq!(
        told.to_string(),
        "a: line 1: numbers instead of a header; if its lines are points, read it with `--format xyz`"
    );
}

#[test]
fn headers_of_ply() {
    let cases = [
        ("plx\n", "line 1: expected `ply`, with which PLY files start, found `plx`"),
        (
            "ply\nformat ascii 1.0\n",
            "line 2: the header never ends: no line `end_header`; the file is cut off or not what its start says",
        ),
        (
            "ply\nformat text 1.0\n",
            "line 2: expected `ascii`, `binary_little_endian` or `binary_big_endian`, found `text`",
        ),
        ("ply\nproperty float x\n", "line 2: expected `element` before its first property, found `property`"),
        (
            "ply\nelement vertex 3\nproperty half x\n",
            "line 3: expected the type of a property, such as `float` or `uint8`, found `half`",
        ),
        ("ply\nelement vertex -3\n", "line 2: expected how many there are of the element, found `-3`"),
        (
            "ply\nelements\n",
            "line 2: expected `element`, `property`, `comment` or `end_header`, found `elements`",
        ),
        ("ply\nelement vertex 0\nelement vertex 1\n", "line 3: `vertex` is declared twice"),
        ("ply\nelement vertex 0\nproperty int x\nproperty int x\n", "line 4: `x` is declared twice"),
        (
            "ply\nend_header\n",
            "line 2: the header does not declare its encoding, `format ascii 1.0` or one of the binary ones",
        ),
        ("ply\nformat ascii 1.0\nend_header\n", "line 3: the header does not declare an element `vertex`"),
        (
            "ply\nformat ascii 1.0\nelement vertex 0\nproperty int x\nproperty int z\nend_header\n",
            "line 3: the header does not declare a coordinate y",
        ),
    ];
    for (text, message) in cases {
        says(text, "a.ply", &format!("a.ply: {message}"));
    }
}

#[test]
fn rows_of_ascii_ply() {
    let cases = [
        (ascii_ply("4", "1", "0 0 0\n\n1 0 O\n"), "line 12, vertex 1: `O` in column `z` is not a number"),
        (ascii_ply("4", "1", "0 0 0\n1 0\n"), "line 11, vertex 1: the line ends before column `z`"),
        (
            ascii_ply("4", "1", "0 0 0 7\n"),
            "line 10, vertex 0: the line has more values than the header declares columns",
        ),
        (
            ascii_ply("99999999999", "1", SQUARE),
            "line 3: 99999999999 of `vertex` promised, but the file holds 4; it is cut off, or this count is wrong",
        ),
        (
            ascii_ply("4", "2", &format!("{SQUARE}3 0 1 2\n")),
            "line 7: 2 of `face` promised, but the file holds 1; it is cut off, or this count is wrong",
        ),
        (
            ascii_ply("4", "1", &format!("{SQUARE}3 0 1 2\n3 0 1 3\n")),
            "line 15: text after the last element; the header promises too few, or the file is damaged",
        ),
        (
            ascii_ply("4", "1", &format!("{SQUARE}3 0 1 4\n")),
            "line 14, face 0: the face names vertex 4, but there are 4, counted from 0",
        ),
        (
            ascii_ply("4", "1", &format!("{SQUARE}3 0 1 -1\n")),
            "line 14, face 0: the face names vertex -1, but there are 4, counted from 0",
        ),
        (
            ascii_ply("4", "1", &format!("{SQUARE}3 0 1 1.5\n")),
            "line 14, face 0: `1.5` is not the index of a vertex",
        ),
        (
            ascii_ply("4", "1", &format!("{SQUARE}-3 0 1 2\n")),
            "line 14, face 0: `-3` is not the length of a list",
        ),
        (
            ascii_ply("4", "1", &format!("{SQUARE}9999999999999 0 1 2\n")),
            "line 14, face 0: the line ends before column `vertex_indices`",
        ),
        (
            ascii_ply("4", "1", &format!("{SQUARE}2 0 1\n")),
            "line 14, face 0: the face has 2 corners; at least 3 are needed",
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
    // Two cameras, one with three floats; then vertices, the first without tags.
    let vertices = start + (8 + 2) + (8 + 2 + 12);
    let cut = error(&whole[..vertices + 10], "a.ply").to_string();
    assert_eq!(
        cut,
        "a.ply: line 9: 20 of `vertex` promised, but the file holds 0; it is cut off, or this count is wrong"
    );
    let mut long = whole[..vertices + 40].to_vec();
    long[vertices + 9] = 200;
    let ReadError::Malformed { place, fault, .. } = error(&long, "a.ply") else { panic!("malformed") };
    assert_eq!(place.at, At::Byte(vertices as u64));
    assert_eq!(place.to_string(), format!("byte {vertices}, vertex 0"));
    assert_eq!(fault, Fault::ListPastEnd { values: 200, left: 30 });
    long[vertices + 9] = 10;
    let past = error(&long, "a.ply").to_string();
    assert_eq!(past, format!("a.ply: byte {vertices}, vertex 0: the file ends here, within an element"));
    let header = "ply\nformat binary_big_endian 1.0\nelement vertex 18446744073709551615\nproperty float x\n\
        property float y\nproperty float z\nend_header\n0123456789ab";
    says(
        header,
        "a.ply",
        "a.ply: line 3: 18446744073709551615 of `vertex` promised, but the file holds 1; it is cut off, or this count is wrong",
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
        (("FIELDS x y z t\n", ""), "line 8: the header does not declare its fields, `FIELDS x y z`"),
        (("SIZE 4 4 4 2\n", ""), "line 8: the header does not declare sizes, `SIZE 4 4 4`"),
        (("TYPE F F F U\n", ""), "line 8: the header does not declare types, `TYPE F F F`"),
        (("SIZE 4 4 4 2", "SIZE 4 4"), "line 3: SIZE has 2 entries for 4 fields"),
        (("COUNT 1 1 1 2", "COUNT 1 1 1 2 1"), "line 5: COUNT has 5 entries for 4 fields"),
        (
            ("SIZE 4", "SIZE 3"),
            "line 4: field `x` has type F and size 3; readable are F 4, F 8, and I or U of size 1, 2, 4, 8",
        ),
        (
            ("SIZE 4 4 4 2", "SIZE 4 4 4 18446744073709551615"),
            "line 3: expected sizes that add up, found `18446744073709551615`",
        ),
        (("SIZE 4 4 4 2", "SIZE 4 4 4 two"), "line 3: expected the size of a field in bytes, found `two`"),
        (("COUNT 1 1 1 2", "COUNT 1 1 1 -2"), "line 5: expected a count of values, found `-2`"),
        (("x y z t", "x y w t"), "line 2: the header does not declare a coordinate z"),
        (("x y z t", "x y z X"), ""),
        (("WIDTH 2", "WIDTH"), "line 6: expected a count, found ``"),
        (("HEIGHT 2", "HEIGHT 3"), "line 8: 4 points declared, but width 2 times height 3 is another number"),
        (
            ("WIDTH 2\nHEIGHT 2\nPOINTS 4\n", ""),
            "line 6: the header does not declare how many points there are, `POINTS`",
        ),
        (
            ("WIDTH 2\nHEIGHT 2\nPOINTS 4\n", "POINTS 5\n"),
            "line 6: 5 of `point` promised, but the file holds 4; it is cut off, or this count is wrong",
        ),
        (
            ("WIDTH 2\nHEIGHT 2\nPOINTS 4\n", "POINTS 3\n"),
            "line 11: text after the last element; the header promises too few, or the file is damaged",
        ),
        (
            ("DATA ascii", "DATA base64"),
            "line 9: expected `ascii`, `binary` or `binary_compressed`, found `base64`",
        ),
        (
            ("DATA ascii\n", ""),
            "line 9: expected a line of a PCD header, as `FIELDS x y z` or `DATA ascii`, found `0`",
        ),
        (("0 0 0 5 5", "0 0 0 5"), "line 10, point 0: the line ends before column `t`"),
        (
            ("0 0 0 5 5", "0 0 0 5 5 5"),
            "line 10, point 0: the line has more values than the header declares columns",
        ),
        (("0 0 0 5 5", "0 0,0 0 5 5"), "line 10, point 0: `0,0` in column `y` is not a number"),
    ];
    for (change, message) in cases {
        let found = error(&pcd(change), "a.pcd").to_string();
        if message.is_empty() {
            // A field of two values is none of the coordinates, even if it is called so.
            assert!(found.contains("distinct finite points"), "{found}");
        } else {
            assert_eq!(found, format!("a.pcd: {message}"), "{change:?}");
        }
    }
    let twice = error(b"FIELDS x y z z\nSIZE 4 4 4 4\nTYPE F F F F\nPOINTS 1\nDATA ascii\n", "a");
    assert_eq!(twice.to_string(), "a: line 1: `z` is declared twice");
    let endless = error(b"# .PCD v0.7\nFIELDS x y z\n", "a").to_string();
    assert!(endless.contains("line 2: the header never ends: no line `DATA`"), "{endless}");
    says(
        "1 2 3\n",
        "a.pcd",
        "a.pcd: line 1: numbers instead of a header; if its lines are points, read it with `--format xyz`",
    );
}

#[test]
fn pcd_in_bytes() {
    let binary = plain::pcd("binary");
    assert_eq!(
        error(&binary[..binary.len() - 1], "a").to_string(),
        "a: line 10: 22 of `point` promised, but the file holds 21; it is cut off, or this count is wrong"
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
    assert_eq!(cut, format!("a: byte {start}: the file ends here, within an element"));
}

#[test]
fn text() {
    let cases = [
        ("0 0 0\n1 zero 0\n", "line 2, point 1: `zero` in column `y` is not a number"),
        ("# two\n0 0 0\n\n1 0\n", "line 4, point 1: the line ends before column `z`"),
        (
            "1,5;2,5;0,0\n",
            "line 1: expected three numbers (with decimal points), or names of columns with x, y and z among them, found `1,5;2,5;0,0`",
        ),
        ("0;0;0\n1;2,5;0\n", "line 2, point 1: `2,5` in column `y` is not a number"),
        ("0,0,0\n1,,0\n", "line 2, point 1: `` in column `y` is not a number"),
        (
            "a,b,c\n0,0,0\n",
            "line 1: expected three numbers (with decimal points), or names of columns with x, y and z among them, found `a,b,c`",
        ),
        ("x,y,z,X\n0,0,0,0\n", "line 1: `x` is declared twice"),
        ("x y z w nx ny nz\n1 2 3 4\n", "line 2, point 0: the line ends before column `nx`"),
        ("x y z w nx ny nz\n1 2 3\n", "line 2, point 0: the line ends before column `nx`"),
        (
            "\n3\n0 0 0\n1 1 1\n",
            "line 2: 3 of `point` promised, but the file holds 2; it is cut off, or this count is wrong",
        ),
        (
            "1\n0 0 0\n1 1 1\n",
            "line 3: text after the last element; the header promises too few, or the file is damaged",
        ),
        ("7\n", "line 1: 7 of `point` promised, but the file holds 0; it is cut off, or this count is wrong"),
        ("# nothing\n", "0 distinct finite points of 0 given; at least 8 are needed"),
    ];
    for (text, message) in cases {
        says(text, "a.csv", &format!("a.csv: {message}"));
    }
}

#[test]
fn obj() {
    let square = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";
    let cases = [
        ("v 1 2\n", "line 1, vertex 0: the line ends before column `z`"),
        ("# o\nv 1 2 c\n", "line 2, vertex 0: `c` in column `z` is not a number"),
        ("f 1 2 5\n", "line 5, face 0: the face names vertex 5, but there are 4, counted from 1"),
        ("f 1 2 0\n", "line 5, face 0: the face names vertex 0, but there are 4, counted from 1"),
        ("f 1 2 3\nf 1 2 -5\n", "line 6, face 1: the face names vertex -5, but there are 4, counted from 1"),
        ("f 1 2\n", "line 5, face 0: the face has 2 corners; at least 3 are needed"),
        ("f 1/1 /2 3\n", "line 5, face 0: `/2` is not the index of a vertex"),
        ("f 1 2 3.5\n", "line 5, face 0: `3.5` is not the index of a vertex"),
        (
            "f 1 2 9223372036854775807\n",
            "line 5, face 0: the face names vertex 9223372036854775807, but there are 4, counted from 1",
        ),
        (
            "f 1 2 -9223372036854775808\n",
            "line 5, face 0: the face names vertex -9223372036854775808, but there are 4, counted from 1",
        ),
    ];
    for (text, message) in cases {
        let text = if text.starts_with('f') { format!("{square}{text}") } else { text.to_owned() };
        says(&text, "a.obj", &format!("a.obj: {message}"));
    }
    let joined = format!("{square}f 1 \\\n2 \\\n3\nf 1 2 7\n");
    says(&joined, "a.obj", "a.obj: line 8, face 1: the face names vertex 7, but there are 4, counted from 1");
}

#[test]
fn meshes() {
    let square = ascii_ply("4", "1", &format!("{SQUARE}3 0 1 2\n"));
    let few = error(square.as_bytes(), "a.ply");
    assert!(matches!(few, ReadError::Cloud { cause: CloudError::TooFew { distinct: 4, given: 4 }, .. }));
    let mesh = read_mesh_bytes(square.as_bytes(), None, Path::new("a.ply")).unwrap();
    assert_eq!((mesh.vertices().len(), mesh.triangles()), (4, &[[0, 1, 2]][..]));
    let none = read_mesh_bytes(SQUARE.as_bytes(), None, Path::new("a.xyz")).unwrap_err();
    assert_eq!(none.to_string(), "a.xyz: the file has points but no faces; a mesh is needed here");
    let broken = square.replace("1 1 0", "1 nan 0");
    let broken = read_mesh_bytes(broken.as_bytes(), None, Path::new("a.ply")).unwrap_err();
    assert_eq!(
        broken.to_string(),
        "a.ply: vertex 3 of a mesh has a coordinate that is not finite; repair it, or remove the faces to use the points alone"
    );
}

/// Found by fuzzing: a buffer that is named by a kilobyte was named by all of it in the message.
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

/// The decoder of `laz` 0.13 calls itself for each switch, and overflows the stack.
#[test]
fn times_of_laz_that_switch_without_end() {
    let refused = error(&foreign::laz_of_endless_times(), "a.laz").to_string();
    assert_eq!(refused, "a.laz: byte 384, point 1: the data are damaged: a GPS time that is in no sequence");
}
