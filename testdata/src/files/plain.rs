//! The model as PLY, PCD, OBJ and text.

use std::fmt::Write as _;

use super::model::{colours, normals, points, quads};

/// The encoding of the numbers of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// Text.
    Ascii,
    /// Binary, least byte first.
    Little,
    /// Binary, greatest byte first.
    Big,
}

/// A writer of numbers by the name of their PLY type.
struct Out {
    encoding: Encoding,
    bytes: Vec<u8>,
}

impl Out {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "test values are chosen to fit"
    )]
    fn put(&mut self, kind: &str, value: f64) {
        if self.encoding == Encoding::Ascii {
            self.bytes.extend(format!("{value} ").bytes());
            return;
        }
        let mut bytes = match kind {
            "char" => (value as i8).to_le_bytes().to_vec(),
            "uchar" => (value as u8).to_le_bytes().to_vec(),
            "short" => (value as i16).to_le_bytes().to_vec(),
            "ushort" => (value as u16).to_le_bytes().to_vec(),
            "int" => (value as i32).to_le_bytes().to_vec(),
            "uint" => (value as u32).to_le_bytes().to_vec(),
            "float" => (value as f32).to_le_bytes().to_vec(),
            "double" => value.to_le_bytes().to_vec(),
            other => panic!("no type {other}"),
        };
        if self.encoding == Encoding::Big {
            bytes.reverse();
        }
        self.bytes.extend(bytes);
    }

    fn end(&mut self) {
        if self.encoding == Encoding::Ascii {
            self.bytes.push(b'\n');
        }
    }
}

/// Returns PLY with everything that a reader must skip: other elements, other properties, lists
/// among them.
#[must_use]
pub fn ply(encoding: Encoding, coordinate: &str, index: &str) -> Vec<u8> {
    let name = match encoding {
        Encoding::Ascii => "ascii",
        Encoding::Little => "binary_little_endian",
        Encoding::Big => "binary_big_endian",
    };
    let header = format!(
        "ply\nformat {name} 1.0\ncomment made for a test\nobj_info nothing\n\
        element camera 2\nproperty double fov\nproperty list ushort float lens\nelement nothing 9\n\
        element vertex 20\nproperty uchar flag\nproperty {coordinate} x\nproperty {coordinate} y\n\
        property list uchar short tags\nproperty {coordinate} z\nproperty float nx\nproperty float ny\n\
        property float nz\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
        element face 12\nproperty char side\nproperty list uchar {index} vertex_indices\n\
        property list int double uv\nelement edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n"
    );
    let bytes = header.into_bytes();
    let mut out = Out { encoding, bytes };
    for lens in [0_u8, 3] {
        out.put("double", 60.5);
        out.put("ushort", lens.into());
        (0..lens).for_each(|i| out.put("float", f64::from(i) / 2.0));
        out.end();
    }
    for (i, ((p, n), c)) in (0_u8..).zip(points().iter().zip(normals()).zip(colours())) {
        out.put("uchar", i.into());
        out.put(coordinate, p[0].into());
        out.put(coordinate, p[1].into());
        out.put("uchar", f64::from(i % 3));
        (0..i % 3).for_each(|tag| out.put("short", -f64::from(tag)));
        out.put(coordinate, p[2].into());
        n.iter().for_each(|&x| out.put("float", x.into()));
        c.iter().for_each(|&x| out.put("uchar", x.into()));
        out.end();
    }
    for quad in quads() {
        out.put("char", -1.0);
        out.put("uchar", 4.0);
        quad.iter().for_each(|&corner| out.put(index, corner.into()));
        out.put("int", 2.0);
        (0..2).for_each(|_| out.put("double", 0.1));
        out.end();
    }
    out.put("int", 0.0);
    out.put("int", 1.0);
    out.end();
    out.bytes
}

/// Returns PCD with two fields to skip, one of three values a point and one of an odd size, and NaN
/// points at the end.
///
/// # Panics
/// If the parameters are not supported by the format.
#[must_use]
pub fn pcd(data: &str) -> Vec<u8> {
    let header = format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n\
        FIELDS x y descriptor z normal_x normal_y normal_z rgb\n\
        SIZE 4 4 2 8 4 4 4 4\nTYPE F F U F F F F U\nCOUNT 1 1 3 1 1 1 1 1\n\
        WIDTH 11\nHEIGHT 2\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 22\nDATA {data}\n"
    );
    let mut points = points();
    let mut normals = normals();
    let mut colours = colours();
    for _ in 0..2 {
        points.push([f32::NAN; 3]);
        normals.push([f32::NAN; 3]);
        colours.push([0; 3]);
    }
    let rows = points.iter().zip(&normals).zip(&colours);
    let mut out = header.into_bytes();
    if data == "ascii" {
        let mut text = String::new();
        for ((p, n), &[r, g, b]) in rows {
            let packed = u32::from_be_bytes([0, r, g, b]);
            let ([x, y, z], [nx, ny, nz]) = (p, n);
            writeln!(text, "{x} {y} 1 2 3 {z} {nx} {ny} {nz} {packed}").expect("memory suffices");
        }
        out.extend(text.into_bytes());
        return out;
    }
    let mut fields = vec![Vec::new(); 8];
    let mut records = Vec::new();
    for ((p, n), &[r, g, b]) in rows {
        let values = [
            p[0].to_le_bytes().to_vec(),
            p[1].to_le_bytes().to_vec(),
            vec![1, 0, 2, 0, 3, 0],
            f64::from(p[2]).to_le_bytes().to_vec(),
            n[0].to_le_bytes().to_vec(),
            n[1].to_le_bytes().to_vec(),
            n[2].to_le_bytes().to_vec(),
            vec![b, g, r, 255],
        ];
        for (field, value) in fields.iter_mut().zip(values) {
            field.extend(&value);
            records.extend(value);
        }
    }
    if data == "binary" {
        out.extend(records);
    } else {
        let packed = lzf::compress(&fields.concat()).expect("repetitive data get shorter");
        for length in [packed.len(), records.len()] {
            out.extend(u32::try_from(length).expect("short").to_le_bytes());
        }
        out.extend(packed);
    }
    out
}

/// Returns text with named columns, in an unusual order.
pub fn csv(divider: &str) -> Vec<u8> {
    let names = ["R", "G", "B", "intensity", "x", "y", "z", "nx", "ny", "nz", "label"];
    let mut text = format!("# a comment\n{}\n", names.join(divider));
    for ((p, n), c) in points().iter().zip(normals()).zip(colours()) {
        let mut values: Vec<String> = c.iter().map(u8::to_string).collect();
        values.push("0.5".into());
        values.extend(p.iter().chain(&n).map(f32::to_string));
        values.push("wall".into());
        writeln!(text, "{}", values.join(divider)).expect("memory suffices");
    }
    text.into_bytes()
}

/// Returns OBJ with vertex colours and the four ways of writing a corner.
#[must_use]
pub fn obj() -> Vec<u8> {
    let mut text = String::from("mtllib a.mtl\no sheet\n# C:\\meshes\\\n");
    for (p, c) in points().iter().zip(colours()) {
        let [x, y, z] = p;
        let [r, g, b] = c.map(|c| f64::from(c) / 255.0);
        writeln!(text, "v {x} {y} {z} {r:.6} {g:.6} {b:.6}").expect("memory suffices");
    }
    text.push_str("vt 0 0\nvn 0 0 1\ng part\nusemtl grey\ns off\n");
    for (i, quad) in quads().iter().enumerate() {
        let [a, b, c, d] = quad.map(|corner| corner + 1);
        let line = match i % 5 {
            0 => format!("f {a} {b} {c} {d}"),
            1 => format!("f {a}/1 {b}/1 {c}/1 {d}/1"),
            2 => format!("f {a}//1 {b}//1 {c}//1 {d}//1"),
            3 => format!("f {a}/1/1 {b}/1/1 \\\n {c}/1/1 {d}/1/1"),
            _ => format!("f -{} -{} -{} -{}", 21 - a, 21 - b, 21 - c, 21 - d),
        };
        writeln!(text, "{line}").expect("memory suffices");
    }
    text.into_bytes()
}
