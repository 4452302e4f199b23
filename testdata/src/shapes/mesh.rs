//! Triangles for a form: the input of exact tests of polygons.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;
use nearmiss_geometry::TriangleMesh;

use super::primitive::{Primitive, rectangle_point, steps, torus_point};
use super::{Form, Shape};
use crate::oracle::count;

impl Form {
    /// Returns the form as triangles with edges of about `edge` where it is curved, whose corners
    /// are on it. Each rectangle is two triangles. Parts are not cut where they cross, and share no
    /// corners.
    ///
    /// # Panics
    /// If there are 2³² corners.
    #[must_use]
    pub fn tessellated(&self, edge: f64) -> TriangleMesh {
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for part in &self.parts {
            let base = u32::try_from(vertices.len()).expect("fewer than 2^32 corners");
            let (columns, rows) = part.cells(edge);
            for row in 0..=rows {
                let along = |column| [count(column) / count(columns), count(row) / count(rows)];
                vertices.extend((0..=columns).map(|column| <[f64; 3]>::from(part.at(along(column)))));
            }
            let stride = u32::try_from(columns + 1).expect("fewer than 2^32 corners");
            for row in (0..rows).map(|row| u32::try_from(row).unwrap_or(u32::MAX)) {
                let first = base + row * stride;
                let quads = (first..first + stride - 1).map(|a| [a, a + 1, a + stride, a + stride + 1]);
                triangles.extend(quads.flat_map(|[a, b, c, d]| [[a, b, c], [b, d, c]]));
            }
        }
        TriangleMesh::new(vertices, triangles).expect("corners are there")
    }
}

impl Shape {
    /// Returns the same as [`Form::tessellated`], with edges as long as the samples are apart.
    #[must_use]
    pub fn tessellated(&self) -> TriangleMesh {
        self.form.tessellated(self.sampling.spacing)
    }
}

impl Primitive {
    /// Returns the numbers of cells into which `s` and `t` of [`Self::at`] are divided.
    fn cells(&self, edge: f64) -> (usize, usize) {
        let around = |radius: f64| steps(TAU * radius, edge).max(3);
        match *self {
            Self::Sphere { radius, .. } => (around(radius), steps(PI * radius, edge).max(2)),
            Self::Bowl { radius } => (around(radius), steps(0.5 * PI * radius, edge)),
            Self::Torus { major, minor } => (around(major + minor), around(minor)),
            Self::Capsule { half, radius } => (around(radius), steps(PI * radius + 2.0 * half, edge).max(2)),
            Self::Rectangle { .. } => (1, 1),
        }
    }

    /// Returns the point with these parameters, which run from 0 to 1.
    fn at(&self, [s, t]: [f64; 2]) -> Vector3<f64> {
        let turned =
            |tilt: f64| Vector3::new(tilt.cos() * (TAU * s).cos(), tilt.cos() * (TAU * s).sin(), tilt.sin());
        match *self {
            Self::Sphere { centre, radius } => Vector3::from(centre) + radius * turned(PI * (t - 0.5)),
            Self::Bowl { radius } => radius * turned(0.5 * PI * (t - 1.0)),
            Self::Torus { major, minor } => torus_point(major, minor, TAU * s, TAU * t).0,
            Self::Capsule { half, radius } => {
                let profile = PI * radius + 2.0 * half;
                let arc = profile * (t - 0.5);
                let tilt = (arc.abs() - half).max(0.0).copysign(arc) / radius;
                radius * turned(tilt) + arc.clamp(-half, half) * Vector3::z()
            }
            Self::Rectangle { corner, u, v } => rectangle_point(corner, u, v, [s, t]).0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{avatar, bars, bowl, building, field, sphere, torus};
    use super::*;

    #[test]
    fn triangles_lie_on_the_form_and_have_its_area() {
        for form in [
            sphere(1.0),
            bowl(1.0),
            torus(1.0, 0.4),
            avatar(1.6, 0.3),
            bars(3, 1.0, 0.3),
            field([2, 2, 2], 1.0, 0.3),
            building(),
        ] {
            let edge = 0.05;
            let mesh = form.tessellated(edge);
            let corner = |v: u32| Vector3::from(mesh.vertices()[v as usize]);
            let mut area = 0.0;
            for corners in mesh.triangles() {
                let [a, b, c] = corners.map(corner);
                area += 0.5 * (b - a).cross(&(c - a)).norm();
                for p in [a, b, c] {
                    assert!(form.distance(p.into()) < 1e-12, "{}: a corner off it", form.name);
                }
                let middle = (a + b + c) / 3.0;
                // The height of an arc over its chord, for the smallest radius here.
                let off = form.distance(middle.into());
                assert!(off < edge * edge / 0.3, "{}: {off} off", form.name);
            }
            let exact: f64 = form.parts.iter().map(Primitive::area).sum();
            assert!((area / exact - 1.0).abs() < 0.01, "{}: area {area}, {exact}", form.name);
        }
    }
}
