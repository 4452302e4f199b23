//! The trait of what holds a convex shape.

use std::convert::Infallible;
use std::rc::Rc;
use std::sync::Arc;

use nearmiss_geometry::Pose;

use crate::solid::placed::PlacedShape;
use crate::solid::shape::Shape;

/// A convex shape, however it is owned: [`Shape`], a reference, `Arc`, `Rc` or `Box` of one, or a type of
/// the caller's that owns the points of a hull.
///
/// ```
/// use nearmiss_geometry::Pose;
/// use nearmiss_query::{AsShape, Shape};
///
/// struct Hull(Vec<[f64; 3]>);
///
/// impl AsShape for Hull {
///     fn as_shape(&self) -> Shape<'_> {
///         Shape::Hull { points: &self.0, radius: 0.0 }
///     }
/// }
///
/// let wedge = Hull(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
/// let bounds = wedge.at(&Pose::from_translation([0.0, 0.0, 2.0])).bounds().expect("it is valid");
/// assert!((bounds.min[2] - 2.0).abs() < 1e-12 && (bounds.max[2] - 3.0).abs() < 1e-12);
/// ```
pub trait AsShape {
    /// Returns the shape, in its own frame.
    fn as_shape(&self) -> Shape<'_>;

    /// Places the shape at `pose`, which maps its own frame to the world.
    #[inline]
    fn at(&self, pose: &Pose) -> PlacedShape<'_> {
        PlacedShape::new(self.as_shape(), pose)
    }
}

impl AsShape for Shape<'_> {
    #[inline]
    fn as_shape(&self) -> Shape<'_> {
        *self
    }
}

/// For worlds without shapes.
impl AsShape for Infallible {
    fn as_shape(&self) -> Shape<'_> {
        match *self {}
    }
}

impl<H: AsShape + ?Sized> AsShape for &H {
    fn as_shape(&self) -> Shape<'_> {
        (**self).as_shape()
    }
}

impl<H: AsShape + ?Sized> AsShape for Arc<H> {
    fn as_shape(&self) -> Shape<'_> {
        (**self).as_shape()
    }
}

impl<H: AsShape + ?Sized> AsShape for Rc<H> {
    fn as_shape(&self) -> Shape<'_> {
        (**self).as_shape()
    }
}

impl<H: AsShape + ?Sized> AsShape for Box<H> {
    fn as_shape(&self) -> Shape<'_> {
        (**self).as_shape()
    }
}
