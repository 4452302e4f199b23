//! `PointCloud`: distinct finite points in single precision, relative to a double-precision origin.

use serde::{Deserialize, Serialize};

use crate::cloud_error::CloudError;
use crate::intake::{Intake, LEAST_POINTS, Repeated};
use crate::{Aabb, Frame, Scanner};

mod sealed {
    #[expect(unnameable_types, reason = "that is what seals `Coordinate`")]
    pub trait Sealed: Copy {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// A coordinate type that a cloud can be built from: `f32` or `f64`.
pub trait Coordinate: sealed::Sealed + Into<f64> {}
impl Coordinate for f32 {}
impl Coordinate for f64 {}

/// Numbers of dropped points, by reason.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Dropped {
    /// Points with a NaN or infinite coordinate.
    pub not_finite: usize,
    /// Points at the same position as an earlier point.
    pub duplicate: usize,
    /// Points removed by [`PointCloud::select`].
    pub filtered: usize,
}

/// A point cloud: samples of a surface, finite, distinct, at least eight, in the order given.
///
/// Positions are `f32` in a local [`Frame`] whose origin is `f64`, so a cloud in geographic
/// coordinates keeps its detail. [`PointCloud::step`] is the greatest rounding error. A point that
/// rounds to the position of an earlier point is a duplicate and is dropped. [`PointCloud::source`]
/// maps each kept point to its index in the input.
#[derive(Debug, Clone, PartialEq)]
pub struct PointCloud {
    frame: Frame,
    positions: Vec<[f32; 3]>,
    source: Vec<u32>,
    given: usize,
    dropped: Dropped,
    step: f64,
    normals: Option<Vec<[f32; 3]>>,
    colours: Option<Vec<[u8; 3]>>,
    intensities: Option<Vec<f32>>,
    classes: Option<Vec<u8>>,
    scanners: Vec<Scanner>,
}

impl PointCloud {
    /// Creates a cloud of all `positions`, each of which must be finite. Duplicates are dropped and
    /// counted.
    ///
    /// Takes O(n log n) time, for a sort.
    ///
    /// # Errors
    /// Fails if a point is not finite or too large; the error names the first such point. Fails if
    /// fewer than 8 points are distinct.
    pub fn from_positions<T: Coordinate>(positions: &[[T; 3]]) -> Result<Self, CloudError> {
        match positions.iter().position(|p| !is_finite(*p)) {
            Some(index) => Err(CloudError::NotFinite { index }),
            None => Self::cleaned(positions),
        }
    }

    /// Creates a cloud of the finite `positions`. All others, and duplicates, are dropped and
    /// counted.
    ///
    /// # Errors
    /// Fails if a finite point is too large; the error names the first such point. Fails if fewer
    /// than 8 finite points are distinct.
    pub fn cleaned<T: Coordinate>(positions: &[[T; 3]]) -> Result<Self, CloudError> {
        let given = positions.len();
        let mut intake = Intake::default();
        positions.iter().for_each(|p| intake.add((*p).map(Into::into)));
        let frame = intake.frame()?;
        let (mut kept, mut source) = (Vec::with_capacity(given), Vec::with_capacity(given));
        let mut step = 0.0_f64;
        for (index, p) in (0_u32..).zip(positions) {
            if is_finite(*p) {
                let world = (*p).map(Into::into);
                let local = frame.to_local(world);
                let back = frame.to_world(local);
                step = (0..3).fold(step, |s, k| s.max((world[k] - back[k]).abs()));
                kept.push(local);
                source.push(index);
            }
        }
        let not_finite = given - kept.len();
        let finite = kept.len();
        let (positions, source) = distinct(kept, source);
        let dropped = Dropped { not_finite, duplicate: finite - positions.len(), filtered: 0 };
        if positions.len() < LEAST_POINTS {
            return Err(CloudError::TooFew { distinct: positions.len(), given });
        }
        Ok(Self {
            frame,
            positions,
            source,
            given,
            dropped,
            step,
            normals: None,
            colours: None,
            intensities: None,
            classes: None,
            scanners: Vec::new(),
        })
    }

    /// Adds a normal to each point; `normals` are indexed like the input.
    ///
    /// # Errors
    /// Fails if the number of normals differs from the number of points in the input.
    pub fn with_normals(mut self, normals: &[[f32; 3]]) -> Result<Self, CloudError> {
        self.normals = Some(self.gathered(normals)?);
        Ok(self)
    }

    /// Adds a colour to each point; `colours` are indexed like the input.
    ///
    /// # Errors
    /// Fails if the number of colours differs from the number of points in the input.
    pub fn with_colours(mut self, colours: &[[u8; 3]]) -> Result<Self, CloudError> {
        self.colours = Some(self.gathered(colours)?);
        Ok(self)
    }

    /// Adds an intensity to each point; `intensities` are indexed like the input.
    ///
    /// # Errors
    /// Fails if the number of intensities differs from the number of points in the input.
    pub fn with_intensities(mut self, intensities: &[f32]) -> Result<Self, CloudError> {
        self.intensities = Some(self.gathered(intensities)?);
        Ok(self)
    }

    /// Adds a class to each point; `classes` are indexed like the input.
    ///
    /// # Errors
    /// Fails if the number of classes differs from the number of points in the input.
    pub fn with_classes(mut self, classes: &[u8]) -> Result<Self, CloudError> {
        self.classes = Some(self.gathered(classes)?);
        Ok(self)
    }

    /// Adds the positions of the scanners that took the cloud. Where the ranges of two scanners
    /// overlap, the first scanner counts.
    #[must_use]
    pub fn with_scanners(mut self, scanners: Vec<Scanner>) -> Self {
        self.scanners = scanners;
        self
    }

    /// Returns the cloud of the points with these `ids`: indices into [`PointCloud::positions`], in
    /// ascending order.
    ///
    /// Normals, colours, intensities and classes follow their points. The frame and
    /// [`PointCloud::step`] stay the same. [`PointCloud::dropped`] counts the points left out, and
    /// [`PointCloud::source`] still holds indices of the input.
    ///
    /// ```
    /// # use nearmiss_geometry::PointCloud;
    /// let points: Vec<[f64; 3]> = (0..20).map(|i| [f64::from(i), 0.0, 0.0]).collect();
    /// let cloud = PointCloud::from_positions(&points)?;
    /// let every_other: Vec<u32> = (0..20).step_by(2).collect();
    /// let selected = cloud.select(&every_other)?;
    /// assert_eq!(selected.len(), 10);
    /// assert_eq!(selected.point(3), [6.0, 0.0, 0.0]);
    /// assert_eq!(selected.source()[3], 6);
    /// # Ok::<(), nearmiss_geometry::CloudError>(())
    /// ```
    ///
    /// # Errors
    /// Fails if an index is out of range or out of order; the error names the first such index.
    /// Fails if there are fewer than 8 indices.
    pub fn select(&self, ids: &[u32]) -> Result<Self, CloudError> {
        let points = self.len();
        if let Some(pair) = ids.windows(2).find(|pair| pair[0] >= pair[1]) {
            return Err(CloudError::NotAscending { index: pair[1], before: pair[0] });
        }
        if let Some(&index) = ids.iter().find(|&&id| id as usize >= points) {
            return Err(CloudError::NoSuchPoint { index, points });
        }
        if ids.len() < LEAST_POINTS {
            return Err(CloudError::TooFew { distinct: ids.len(), given: points });
        }
        let filtered = self.dropped.filtered + points - ids.len();
        Ok(Self {
            dropped: Dropped { filtered, ..self.dropped },
            positions: selected(&self.positions, ids),
            source: selected(&self.source, ids),
            normals: self.normals.as_deref().map(|normals| selected(normals, ids)),
            colours: self.colours.as_deref().map(|colours| selected(colours, ids)),
            intensities: self.intensities.as_deref().map(|intensities| selected(intensities, ids)),
            classes: self.classes.as_deref().map(|classes| selected(classes, ids)),
            scanners: self.scanners.clone(),
            ..*self
        })
    }

    fn gathered<V: Copy>(&self, values: &[V]) -> Result<Vec<V>, CloudError> {
        if values.len() != self.given {
            return Err(CloudError::AttributeCount { given: values.len(), points: self.given });
        }
        Ok(self.source.iter().map(|&i| values[i as usize]).collect())
    }

    /// Returns the number of points.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "a cloud has at least eight points")]
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Returns the positions in the local frame.
    #[must_use]
    pub fn positions(&self) -> &[[f32; 3]] {
        &self.positions
    }

    /// Returns the position of point `i` in the caller's frame.
    ///
    /// # Panics
    /// Panics if `i` is not below [`PointCloud::len`].
    #[must_use]
    pub fn point(&self, i: usize) -> [f64; 3] {
        self.frame.to_world(self.positions[i])
    }

    /// Returns the index in the input of each kept point.
    #[must_use]
    pub fn source(&self) -> &[u32] {
        &self.source
    }

    /// Returns the local frame of the positions.
    #[must_use]
    pub fn frame(&self) -> Frame {
        self.frame
    }

    /// Returns the numbers of input points that were dropped.
    #[must_use]
    pub fn dropped(&self) -> Dropped {
        self.dropped
    }

    /// Returns the greatest change of a coordinate by rounding to `f32`, in the caller's units.
    #[must_use]
    pub fn step(&self) -> f64 {
        self.step
    }

    /// Returns the normals of the input, if any. They are unit and consistently oriented only if
    /// the input's are.
    #[must_use]
    pub fn normals(&self) -> Option<&[[f32; 3]]> {
        self.normals.as_deref()
    }

    /// Returns the colours as red, green, blue, if any.
    #[must_use]
    pub fn colours(&self) -> Option<&[[u8; 3]]> {
        self.colours.as_deref()
    }

    /// Returns the intensities in the units of the input, if any.
    #[must_use]
    pub fn intensities(&self) -> Option<&[f32]> {
        self.intensities.as_deref()
    }

    /// Returns the classes as LAS codes, if any: 2 is ground, 6 is buildings.
    #[must_use]
    pub fn classes(&self) -> Option<&[u8]> {
        self.classes.as_deref()
    }

    /// Returns the positions of the scanners that took the cloud, as far as the input gives them.
    #[must_use]
    pub fn scanners(&self) -> &[Scanner] {
        &self.scanners
    }

    /// Returns the bounding box in the caller's frame.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        Aabb::of(self.positions.iter().map(|&p| self.frame.to_world(p)))
    }
}

fn selected<V: Copy>(values: &[V], ids: &[u32]) -> Vec<V> {
    ids.iter().map(|&id| values[id as usize]).collect()
}

fn is_finite<T: Coordinate>(p: [T; 3]) -> bool {
    p.iter().all(|x| (*x).into().is_finite())
}

/// Returns the first of each group of equal positions, in the order given. Takes O(n log n) time
/// and 16 bytes a point.
fn distinct(points: Vec<[f32; 3]>, source: Vec<u32>) -> (Vec<[f32; 3]>, Vec<u32>) {
    let repeated = Repeated::among(&points, &mut vec![0; points.len()]);
    if repeated.count() == 0 {
        return (points, source);
    }
    let kept = (0..).zip(points.into_iter().zip(source)).filter(|(i, _)| !repeated.contains(*i));
    kept.map(|(_, kept)| kept).unzip()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(n: u16) -> Vec<[f64; 3]> {
        (0..n).map(|i| [f64::from(i % 4), f64::from(i / 4), 0.5]).collect()
    }

    #[test]
    fn the_first_of_equal_points_stays_and_source_leads_back() {
        let mut points = grid(12);
        points.insert(3, points[0]);
        points.push(points[5]);
        points.insert(0, [f64::INFINITY, 0.0, 0.0]);
        let cloud = PointCloud::cleaned(&points).unwrap();
        assert_eq!(cloud.len(), 12);
        assert_eq!(cloud.dropped(), Dropped { not_finite: 1, duplicate: 2, filtered: 0 });
        for i in 0..cloud.len() {
            assert_eq!(cloud.point(i), points[cloud.source()[i] as usize], "point {i}");
        }
        assert_eq!(cloud.source()[..4], [1, 2, 3, 5], "index 4 repeats index 1");
        let numbers: Vec<[f32; 3]> = (0_u8..15).map(|i| [f32::from(i); 3]).collect();
        let cloud = cloud.with_normals(&numbers).unwrap();
        assert_eq!(cloud.normals().unwrap()[3], [5.0; 3], "attributes follow their points");
        let count = cloud.with_normals(&numbers[1..]).unwrap_err();
        assert_eq!(count, CloudError::AttributeCount { given: 14, points: 15 });
    }

    #[test]
    fn points_are_told_apart_as_by_a_set() {
        // With 200,000 points, hashes of different points collide too.
        let mut state = 1_u64;
        let mut coordinate = |of: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            #[expect(clippy::cast_precision_loss, reason = "below 2^24")]
            let x = ((state >> 33) % of) as f32;
            x
        };
        for of in [3, 40, 1 << 20] {
            let points: Vec<[f32; 3]> =
                (0..200_000).map(|_| [coordinate(of), coordinate(of), coordinate(of)]).collect();
            let mut seen = std::collections::BTreeSet::new();
            let is_new = |(p, _): &([f32; 3], u32)| seen.insert(p.map(f32::to_bits));
            let expected = points.iter().copied().zip(0..).filter(is_new).unzip();
            assert_eq!(distinct(points, (0..200_000).collect()), expected, "{of} values a coordinate");
        }
    }

    #[test]
    fn selected_points_keep_their_attributes_and_sources() {
        let mut points = grid(24);
        points.insert(0, [f64::NAN; 3]);
        points.insert(5, points[1]);
        let numbers: Vec<[f32; 3]> = (0_u8..26).map(|i| [f32::from(i); 3]).collect();
        let colours: Vec<[u8; 3]> = (0_u8..26).map(|i| [i; 3]).collect();
        let cloud = PointCloud::cleaned(&points).unwrap();
        let cloud = cloud.with_normals(&numbers).unwrap().with_colours(&colours).unwrap();
        let ids: Vec<u32> = (2..20).step_by(2).collect();
        let part = cloud.select(&ids).unwrap();
        assert_eq!((part.len(), part.frame()), (ids.len(), cloud.frame()));
        assert_eq!(part.dropped(), Dropped { not_finite: 1, duplicate: 1, filtered: 24 - ids.len() });
        for (i, &id) in ids.iter().enumerate() {
            let source = part.source()[i] as usize;
            assert_eq!(source, cloud.source()[id as usize] as usize, "point {i}");
            assert_eq!(part.point(i), points[source], "point {i}");
            assert_eq!(part.normals().unwrap()[i], numbers[source], "point {i}");
            assert_eq!(part.colours().unwrap()[i], colours[source], "point {i}");
        }
        let again = part.clone().with_normals(&numbers).unwrap();
        assert_eq!(again, part, "attributes are still indexed like the input");
        assert_eq!(cloud.select(&(0..24).collect::<Vec<u32>>()).unwrap(), cloud);
    }

    #[test]
    fn a_selection_needs_ascending_indices_of_the_cloud() {
        let cloud = PointCloud::from_positions(&grid(12)).unwrap();
        let refused = |ids: &[u32]| cloud.select(ids).unwrap_err();
        assert_eq!(refused(&[0, 1, 2, 2, 3]), CloudError::NotAscending { index: 2, before: 2 });
        assert_eq!(refused(&[0, 9, 2]), CloudError::NotAscending { index: 2, before: 9 });
        let beyond: Vec<u32> = (4..14).collect();
        assert_eq!(refused(&beyond), CloudError::NoSuchPoint { index: 12, points: 12 });
        assert_eq!(refused(&[]), CloudError::TooFew { distinct: 0, given: 12 });
        assert_eq!(refused(&[0, 1, 2, 3, 4, 5, 6]), CloudError::TooFew { distinct: 7, given: 12 });
    }

    #[test]
    fn negative_zero_is_zero() {
        let mut points = grid(12);
        points.push([-0.0, -0.0, 0.5]);
        assert_eq!(PointCloud::from_positions(&points).unwrap().dropped().duplicate, 1);
    }

    #[test]
    fn refusals_name_the_place() {
        let mut points = grid(12);
        points[7][1] = f64::NAN;
        assert_eq!(PointCloud::from_positions(&points), Err(CloudError::NotFinite { index: 7 }));
        points[7][1] = -1e200;
        assert_eq!(PointCloud::cleaned(&points), Err(CloudError::TooLarge { index: 7 }));
        let few = vec![[1.0_f32; 3]; 100];
        assert_eq!(PointCloud::cleaned(&few), Err(CloudError::TooFew { distinct: 1, given: 100 }));
        assert_eq!(PointCloud::cleaned::<f32>(&[]), Err(CloudError::TooFew { distinct: 0, given: 0 }));
    }

    #[test]
    fn step_bounds_what_rounding_loses() {
        let points: Vec<[f64; 3]> = grid(16).iter().map(|p| p.map(|x| 1e6 + x / 3.0)).collect();
        let cloud = PointCloud::from_positions(&points).unwrap();
        for i in 0..16 {
            for k in 0..3 {
                assert!((cloud.point(i)[k] - points[i][k]).abs() <= cloud.step(), "point {i}");
            }
        }
        assert!(cloud.step() > 0.0 && cloud.step() < 2e-7, "{}", cloud.step());
        let exact: Vec<[f32; 3]> = (0_u8..9).map(|i| [f32::from(i) / 3.0, 0.1, 0.2]).collect();
        assert_eq!(PointCloud::from_positions(&exact).unwrap().step().to_bits(), 0, "f32 stays as it is");
    }
}
