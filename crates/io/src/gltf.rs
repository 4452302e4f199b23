//! glTF 2.0 and its binary form GLB: points and triangles of the default scene, transformed by
//! their nodes.
//!
//! The crate `gltf` parses and checks the document. Accessors are read here, because the readers of
//! the crate panic if an accessor exceeds its buffer.

use std::fs;
use std::path::{Component, Path};

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use gltf::accessor::{DataType, Dimensions};
use gltf::mesh::Mode;
use gltf::{Accessor, Gltf, Node, Primitive, Semantic};

use crate::columns::{Holds, Row};
use crate::error::{Broken, Fault};
use crate::guard::guarded;
use crate::scalar::{Order, Scalar};
use crate::sink::Sink;
use crate::text::{bytes as with_unit, counted};

/// Parses a file. Buffers in other files are read from the folder of `path`.
pub(crate) fn parse(bytes: &[u8], path: &Path) -> Result<Sink, Broken> {
    check_lengths(bytes)?;
    let Gltf { document, blob } = guarded(|| Gltf::from_slice(bytes))
        .ok_or_else(|| damaged("the decoder panicked"))?
        .map_err(|cause| damaged(&cause.to_string()))?;
    if let Some(extension) = document.extensions_required().find(|name| name.contains("compression")) {
        return Err(damaged(&format!("{extension} is not supported; save the file without compression")));
    }
    let mut buffers = Vec::new();
    let mut blob = blob;
    for buffer in document.buffers() {
        let content = match buffer.source() {
            gltf::buffer::Source::Bin => {
                blob.take().ok_or_else(|| damaged("expected a binary chunk for the buffer, got none"))?
            }
            gltf::buffer::Source::Uri(uri) => linked(uri, path)?,
        };
        if content.len() < buffer.length() {
            let (declared, found) = (buffer.length(), content.len());
            return Err(damaged(&format!("expected a buffer of {}, got {found}", with_unit(declared))));
        }
        buffers.push(content);
    }
    let scene = document.default_scene().or_else(|| document.scenes().next());
    let roots: Vec<Node<'_>> = match &scene {
        Some(scene) => scene.nodes().collect(),
        None => document.nodes().collect(),
    };
    let mut placed = Vec::new();
    // Each node has one parent, so a scene has at most as many nodes as the document.
    let mut seen = vec![false; document.nodes().count()];
    let mut open: Vec<(Node<'_>, Matrix)> = roots.into_iter().map(|node| (node, IDENTITY)).collect();
    while let Some((node, outer)) = open.pop() {
        if std::mem::replace(&mut seen[node.index()], true) {
            if scene.is_none() {
                continue;
            }
            return Err(damaged(&format!("expected one parent of node {}, got two", node.index())));
        }
        let matrix = product(&outer, &node.transform().matrix().map(|column| column.map(f64::from)));
        open.extend(node.children().map(|child| (child, matrix)));
        if let Some(mesh) = node.mesh() {
            placed.extend(mesh.primitives().map(|primitive| (primitive, matrix)));
        }
    }
    // Restores the order of the scene.
    placed.reverse();
    let all = |semantic: Semantic| placed.iter().all(|(primitive, _)| primitive.get(&semantic).is_some());
    let holds =
        Holds { normals: all(Semantic::Normals), colours: all(Semantic::Colors(0)), ..Holds::default() };
    let mut sink = Sink::new(holds, 0);
    let mut first = 0;
    for (primitive, matrix) in &placed {
        first += add(primitive, matrix, &buffers, holds, &mut sink, first)?;
    }
    Ok(sink)
}

/// A matrix in column-major order, as in glTF.
type Matrix = [[f64; 4]; 4];

const IDENTITY: Matrix =
    [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    b.map(|column| [0, 1, 2, 3].map(|row| (0..4).map(|k| a[k][row] * column[k]).sum()))
}

fn damaged(cause: &str) -> Broken {
    Fault::Decoder { cause: cause.into() }.at_byte(0)
}

/// Checks that the chunks of a binary file are within the file.
fn check_lengths(bytes: &[u8]) -> Result<(), Broken> {
    if !bytes.starts_with(b"glTF") {
        return Ok(());
    }
    let number =
        |at: usize| bytes.get(at..at + 4).and_then(<[u8]>::first_chunk).map(|n| u32::from_le_bytes(*n));
    let mut at = 12;
    while at < bytes.len() {
        let length = number(at).ok_or_else(|| Fault::PastEnd.at_byte(at))?;
        let left = bytes.len().saturating_sub(at + 8);
        let fits = usize::try_from(length).is_ok_and(|length| length <= left);
        if !fits {
            return Err(Fault::ListPastEnd { values: length.into(), left: left as u64 }.at_byte(at));
        }
        at += 8 + length as usize;
    }
    Ok(())
}

/// Reads the buffer of a URI: base64 data in the URI itself, or a file in the same folder or below.
fn linked(uri: &str, path: &Path) -> Result<Vec<u8>, Broken> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (_, encoded) =
            data.split_once(";base64,").ok_or_else(|| damaged("expected a buffer in base64"))?;
        return BASE64_STANDARD.decode(encoded).map_err(|cause| damaged(&cause.to_string()));
    }
    let name = uri.replace("%20", " ");
    if !Path::new(&name).components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir)) {
        return Err(damaged(&format!("expected a buffer in the same folder, got `{uri}`")));
    }
    let file = path.parent().unwrap_or(Path::new("")).join(&name);
    let is_file = fs::metadata(&file).is_ok_and(|about| about.is_file());
    let content = if is_file { fs::read(&file).ok() } else { None };
    content.ok_or_else(|| damaged(&format!("cannot read the buffer {}", file.display())))
}

/// A view of the numbers of an accessor.
struct Numbers<'a> {
    bytes: &'a [u8],
    scalar: Scalar,
    /// Number of components of an element.
    width: usize,
    /// Bytes from one element to the next.
    stride: usize,
    count: usize,
    /// Divisor of normalised integers; otherwise 1.
    unit: f64,
}

impl<'a> Numbers<'a> {
    fn of(accessor: &Accessor<'_>, buffers: &'a [Vec<u8>]) -> Result<Self, Broken> {
        let wrong = |cause: &str| damaged(&format!("accessor {}: {cause}", accessor.index()));
        if accessor.sparse().is_some() {
            return Err(wrong("sparse accessors are not supported"));
        }
        let view = accessor.view().ok_or_else(|| wrong("expected data, got none"))?;
        let (scalar, unit) = match accessor.data_type() {
            DataType::I8 => (Scalar::I8, 127.0),
            DataType::U8 => (Scalar::U8, 255.0),
            DataType::I16 => (Scalar::I16, 32767.0),
            DataType::U16 => (Scalar::U16, 65535.0),
            DataType::U32 => (Scalar::U32, 1.0),
            DataType::F32 => (Scalar::F32, 1.0),
        };
        let width = match accessor.dimensions() {
            Dimensions::Scalar => 1,
            Dimensions::Vec2 => 2,
            Dimensions::Vec3 => 3,
            Dimensions::Vec4 => 4,
            Dimensions::Mat2 | Dimensions::Mat3 | Dimensions::Mat4 => {
                return Err(wrong("expected scalars or vectors, got matrices"));
            }
        };
        let size = width * scalar.size();
        let stride = view.stride().unwrap_or(size);
        let count = accessor.count();
        let in_view = count.checked_sub(1).map_or(Some(0), |last| {
            last.checked_mul(stride)?.checked_add(size)?.checked_add(accessor.offset())
        });
        let in_buffer = view.offset().checked_add(view.length());
        let buffer = buffers.get(view.buffer().index());
        let bytes = in_buffer.and_then(|end| buffer?.get(view.offset()..end));
        match (bytes, in_view) {
            (Some(bytes), Some(end)) if stride > 0 && end <= bytes.len() => Ok(Self {
                bytes: &bytes[accessor.offset().min(bytes.len())..],
                scalar,
                width,
                stride,
                count,
                unit: if accessor.normalized() { unit } else { 1.0 },
            }),
            _ => {
                let elements = counted(count, "element", "elements");
                Err(wrong(&format!("expected elements within the buffer, got {elements} that exceed it")))
            }
        }
    }

    /// Returns the first three numbers of the `i`-th element.
    fn get(&self, i: usize) -> [f64; 3] {
        let mut numbers = [0.0; 3];
        for (k, number) in numbers.iter_mut().enumerate().take(self.width) {
            let at = i * self.stride + k * self.scalar.size();
            let read = self.bytes.get(at..).and_then(|bytes| self.scalar.read(bytes, Order::Little));
            *number = read.unwrap_or_default() / self.unit;
        }
        numbers
    }
}

/// Adds a primitive. Its first vertex has the index `first`. Returns the number of its vertices.
fn add(
    primitive: &Primitive<'_>,
    matrix: &Matrix,
    buffers: &[Vec<u8>],
    holds: Holds,
    sink: &mut Sink,
    first: u32,
) -> Result<u32, Broken> {
    let numbers =
        |semantic: Semantic| primitive.get(&semantic).map(|accessor| Numbers::of(&accessor, buffers));
    let Some(places) = numbers(Semantic::Positions).transpose()? else { return Ok(0) };
    let of_each = |semantic, wanted: bool| {
        let found = if wanted { numbers(semantic).transpose()? } else { None };
        match found {
            Some(found) if found.count != places.count => {
                let (expected, found) = (places.count, found.count);
                Err(damaged(&format!("expected attributes of length {expected}, got {found}")))
            }
            found => Ok(found),
        }
    };
    let normals = of_each(Semantic::Normals, holds.normals)?;
    let colours = of_each(Semantic::Colors(0), holds.colours)?;
    let turned = cofactors(matrix);
    for i in 0..places.count {
        let mut row: Row = [0.0; 11];
        let [x, y, z] = places.get(i);
        let at = |k: usize| matrix[0][k] * x + matrix[1][k] * y + matrix[2][k] * z + matrix[3][k];
        row[..3].copy_from_slice(&[at(0), at(1), at(2)]);
        if let Some(normals) = &normals {
            let [x, y, z] = normals.get(i);
            let along = |k: usize| turned[0][k] * x + turned[1][k] * y + turned[2][k] * z;
            let normal = [along(0), along(1), along(2)];
            let length = normal.iter().map(|c| c * c).sum::<f64>().sqrt();
            row[3..6].copy_from_slice(&normal.map(|c| if length > 0.0 { c / length } else { 0.0 }));
        }
        if let Some(colours) = &colours {
            // The components of colours are in 0..=1.
            row[6..9].copy_from_slice(&colours.get(i).map(|channel| channel * 255.0));
        }
        sink.row(&row);
    }
    let too_many = || damaged("expected at most 2^32 - 1 vertices, got more");
    let count = u32::try_from(places.count).ok().ok_or_else(too_many)?;
    let corners = match primitive.indices() {
        None => (0..count).collect(),
        Some(accessor) => indices(&Numbers::of(&accessor, buffers)?, count)?,
    };
    let corners: Vec<u32> = corners.into_iter().map(|corner| first.saturating_add(corner)).collect();
    match primitive.mode() {
        Mode::Triangles => sink.triangles(corners.as_chunks().0),
        Mode::TriangleStrip => sink.strip(&corners),
        Mode::TriangleFan if corners.len() >= 3 => {
            sink.polygon(&corners).map_err(|fault| fault.at_byte(0))?
        }
        Mode::TriangleFan | Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => (),
    }
    first.checked_add(count).map(|_| count).ok_or_else(too_many)
}

/// Reads the corners, as indices of the `count` vertices of a primitive.
fn indices(numbers: &Numbers<'_>, count: u32) -> Result<Vec<u32>, Broken> {
    let corner = |i: usize| {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "saturates, and is checked"
        )]
        let index = numbers.get(i)[0] as u32;
        let fault = Fault::NoSuchVertex { vertex: index.into(), vertices: count.into(), first: 0 };
        if index < count { Ok(index) } else { Err(fault.at_byte(0)) }
    };
    (0..numbers.count).map(corner).collect()
}

/// Returns the matrix that transforms normals: the cofactors of the linear part, in columns.
fn cofactors(m: &Matrix) -> [[f64; 3]; 3] {
    let cross = |a: [f64; 4], b: [f64; 4]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    [cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])]
}
