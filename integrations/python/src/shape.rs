//! Convex shapes.

use nearmiss::{Pose, Shape as Convex};
use pyo3::prelude::*;

use crate::arrays::{Points, vector, wrong_shape};
use crate::failure::refused;
use crate::poses::Poses;

/// A convex shape in the world, which owns its points.
#[pyclass(frozen, module = "nearmiss")]
#[derive(Debug, Clone)]
pub(crate) struct Shape {
    kind: Kind,
    rounding: f64,
}

#[derive(Debug, Clone)]
enum Kind {
    Sphere([f64; 3]),
    Capsule([[f64; 3]; 2]),
    Box(Pose, [f64; 3]),
    Cylinder(Pose, f64, f64),
    Cone(Pose, f64, f64),
    Triangle([[f64; 3]; 3]),
    Hull(Vec<[f64; 3]>),
}

impl Shape {
    /// Refuses lengths and points that the library would not accept.
    fn checked(kind: Kind, rounding: f64) -> PyResult<Self> {
        let is_finite = |points: &[[f64; 3]]| points.iter().flatten().all(|c| c.is_finite());
        let (points_are_finite, lengths): (bool, &[f64]) = match &kind {
            Kind::Sphere(centre) => (is_finite(&[*centre]), &[]),
            Kind::Capsule(ends) => (is_finite(ends), &[]),
            Kind::Box(_, half) => (true, half),
            Kind::Cylinder(_, half_height, radius) | Kind::Cone(_, half_height, radius) => {
                (true, &[*half_height, *radius])
            }
            Kind::Triangle(points) => (is_finite(points), &[]),
            Kind::Hull(points) => (is_finite(points), &[]),
        };
        if !points_are_finite {
            return Err(refused("expected finite points of a shape, got NaN or infinity"));
        }
        if let Some(wrong) = lengths.iter().chain([&rounding]).find(|&&l| !(l >= 0.0 && l.is_finite())) {
            return Err(refused(format!("expected finite lengths of a shape of at least 0, got {wrong}")));
        }
        if matches!(&kind, Kind::Hull(points) if points.is_empty()) {
            return Err(refused("expected at least one point of a hull, got none"));
        }
        Ok(Self { kind, rounding })
    }

    /// The shape as the library takes it.
    pub(crate) fn convex(&self) -> Convex<'_> {
        let radius = self.rounding;
        let rounding = radius;
        match &self.kind {
            Kind::Sphere(centre) => Convex::Sphere { centre: *centre, radius },
            Kind::Capsule(ends) => Convex::Capsule { ends: *ends, radius },
            Kind::Box(pose, half) => Convex::Box { pose: *pose, half: *half, radius },
            Kind::Cylinder(pose, half_height, radius) => {
                Convex::Cylinder { pose: *pose, half_height: *half_height, radius: *radius, rounding }
            }
            Kind::Cone(pose, half_height, radius) => {
                Convex::Cone { pose: *pose, half_height: *half_height, radius: *radius, rounding }
            }
            Kind::Triangle(points) => Convex::Triangle { points: *points, radius },
            Kind::Hull(points) => Convex::Hull { points, radius },
        }
    }
}

/// Reads the pose of a shape.
fn pose(given: Option<&Bound<'_, PyAny>>) -> PyResult<Pose> {
    Poses::new(given)?.one_of_shape()
}

#[pymethods]
impl Shape {
    /// A ball: `centre` of shape (3,) and `radius`, in the world.
    #[staticmethod]
    fn sphere(centre: &Bound<'_, PyAny>, radius: f64) -> PyResult<Self> {
        Self::checked(Kind::Sphere(vector(centre, "the centre")?), radius)
    }

    /// All points within `radius` of the segment from `start` to `end`, both of shape (3,).
    #[staticmethod]
    fn capsule(start: &Bound<'_, PyAny>, end: &Bound<'_, PyAny>, radius: f64) -> PyResult<Self> {
        Self::checked(Kind::Capsule([vector(start, "the start")?, vector(end, "the end")?]), radius)
    }

    /// A box with these half sides, of shape (3,), about the origin of `pose`, of shape (4, 4).
    /// `rounding` grows it by a length in all directions.
    #[staticmethod]
    #[pyo3(name = "box", signature = (half, pose = None, rounding = 0.0))]
    fn cuboid(half: &Bound<'_, PyAny>, pose: Option<&Bound<'_, PyAny>>, rounding: f64) -> PyResult<Self> {
        Self::checked(Kind::Box(self::pose(pose)?, vector(half, "the half sides")?), rounding)
    }

    /// A cylinder about the axis y of `pose`, of shape (4, 4). `rounding` grows it by a length.
    #[staticmethod]
    #[pyo3(signature = (half_height, radius, pose = None, rounding = 0.0))]
    fn cylinder(
        half_height: f64,
        radius: f64,
        pose: Option<&Bound<'_, PyAny>>,
        rounding: f64,
    ) -> PyResult<Self> {
        Self::checked(Kind::Cylinder(self::pose(pose)?, half_height, radius), rounding)
    }

    /// A cone about the axis y of `pose`, of shape (4, 4), with its tip upwards. `rounding` grows it by a
    /// length.
    #[staticmethod]
    #[pyo3(signature = (half_height, radius, pose = None, rounding = 0.0))]
    fn cone(half_height: f64, radius: f64, pose: Option<&Bound<'_, PyAny>>, rounding: f64) -> PyResult<Self> {
        Self::checked(Kind::Cone(self::pose(pose)?, half_height, radius), rounding)
    }

    /// A triangle with corners of shape (3, 3), grown by `rounding`.
    #[staticmethod]
    #[pyo3(signature = (points, rounding = 0.0))]
    fn triangle(points: &Bound<'_, PyAny>, rounding: f64) -> PyResult<Self> {
        let corners = Points::new(points)?.to_doubles()?;
        let corners = <[[f64; 3]; 3]>::try_from(corners);
        let corners =
            corners.map_err(|_shape| wrong_shape("the corners of a triangle, of shape (3, 3)", points))?;
        Self::checked(Kind::Triangle(corners), rounding)
    }

    /// The convex hull of points of shape (N, 3), grown by `rounding`.
    #[staticmethod]
    #[pyo3(signature = (points, rounding = 0.0))]
    fn hull(points: &Bound<'_, PyAny>, rounding: f64) -> PyResult<Self> {
        Self::checked(Kind::Hull(Points::new(points)?.to_doubles()?), rounding)
    }

    fn __repr__(&self) -> String {
        let rounding = self.rounding;
        match &self.kind {
            Kind::Sphere(centre) => format!("Shape.sphere({centre:?}, {rounding})"),
            Kind::Capsule([start, end]) => format!("Shape.capsule({start:?}, {end:?}, {rounding})"),
            Kind::Box(pose, half) => {
                format!("<Shape: box, half sides {half:?}, at {:?}>", pose.translation())
            }
            Kind::Cylinder(pose, half_height, radius) => {
                format!(
                    "<Shape: cylinder, half height {half_height}, radius {radius}, at {:?}>",
                    pose.translation()
                )
            }
            Kind::Cone(pose, half_height, radius) => {
                format!(
                    "<Shape: cone, half height {half_height}, radius {radius}, at {:?}>",
                    pose.translation()
                )
            }
            Kind::Triangle(points) => format!("<Shape: triangle {points:?}>"),
            Kind::Hull(points) => format!("<Shape: hull of {} points>", points.len()),
        }
    }
}
