//! Intersection test of two triangles, in double precision.
//!
//! The test compares the three corners of each triangle with the plane of the other. Two signs of
//! volumes then order the ends of the two chords on the common line: Guigue and Devillers, "Fast
//! and Robust Triangle-Triangle Overlap Test Using Orientation Predicates", Journal of Graphics
//! Tools 8(1), 2003, doi:10.1080/10867651.2003.10487580. Coplanar triangles are compared in the two
//! axes along which they are widest.
//!
//! Triangles are closed: touching counts. Volumes are rounded, so configurations within some 1e-16
//! of touching may give either answer. A triangle of zero area has no plane and must be left out;
//! in a mesh its neighbours cover it.

/// Three corners.
pub type Triangle = [[f64; 3]; 3];

/// a − b.
#[inline]
fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The normal of a triangle; its length is twice the area.
#[inline]
#[must_use]
pub fn normal(t: &Triangle) -> [f64; 3] {
    cross(sub(t[1], t[0]), sub(t[2], t[0]))
}

/// Six times the volume of a tetrahedron: positive if `d` is on the side that the normal of a, b, c
/// points to.
#[inline]
fn volume(a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]) -> f64 {
    dot(cross(sub(b, a), sub(c, a)), sub(d, a))
}

/// Returns `true` if two triangles of non-zero area share a point.
#[must_use]
pub fn intersect(s: &Triangle, t: &Triangle) -> bool {
    let normal_t = normal(t);
    let sides_s = s.map(|p| dot(normal_t, sub(p, t[0])));
    if beside(&sides_s) {
        return false;
    }
    let normal_s = normal(s);
    let sides_t = t.map(|p| dot(normal_s, sub(p, s[0])));
    if beside(&sides_t) {
        return false;
    }
    let (Some((at_s, above_s)), Some((at_t, above_t))) = (apex(&sides_s), apex(&sides_t)) else {
        return in_one_plane(s, t, &normal_s);
    };
    // Rotated so that the apex of each lies above the plane of the other. Reversing a triangle
    // swaps the sides of the other one's corners: reverse `t` if the apex of `s` is below it, and
    // vice versa.
    let [p, mut q, mut r] = [0, 1, 2].map(|k| s[(at_s + k) % 3]);
    let [u, mut v, mut w] = [0, 1, 2].map(|k| t[(at_t + k) % 3]);
    if !above_s {
        std::mem::swap(&mut v, &mut w);
    }
    if !above_t {
        std::mem::swap(&mut q, &mut r);
    }
    volume(p, q, u, v) <= 0.0 && volume(p, r, w, u) <= 0.0
}

/// Returns `true` if all corners lie strictly on one side.
#[inline]
fn beside(sides: &[f64; 3]) -> bool {
    sides.iter().all(|&d| d > 0.0) || sides.iter().all(|&d| d < 0.0)
}

/// The corner that is alone on its side, and `true` if it is above the plane; `None` if all corners
/// are in the plane.
#[inline]
fn apex(sides: &[f64; 3]) -> Option<(usize, bool)> {
    let others = |i: usize| [sides[(i + 1) % 3], sides[(i + 2) % 3]];
    (0..3).find_map(|i| {
        let (d, [e, f]) = (sides[i], others(i));
        if (d > 0.0 && e <= 0.0 && f <= 0.0) || (d >= 0.0 && e < 0.0 && f < 0.0) {
            Some((i, true))
        } else if (d < 0.0 && e >= 0.0 && f >= 0.0) || (d <= 0.0 && e > 0.0 && f > 0.0) {
            Some((i, false))
        } else {
            None
        }
    })
}

/// Intersection test of two triangles of one plane with this normal.
fn in_one_plane(s: &Triangle, t: &Triangle, normal: &[f64; 3]) -> bool {
    let steepest = (0..3).max_by(|&i, &j| normal[i].abs().total_cmp(&normal[j].abs())).unwrap_or(2);
    let [x, y] = [(steepest + 1) % 3, (steepest + 2) % 3];
    let flat = |triangle: &Triangle| {
        let [a, b, c] = triangle.map(|p| [p[x], p[y]]);
        if area(a, b, c) < 0.0 { [a, c, b] } else { [a, b, c] }
    };
    let (s, t) = (flat(s), flat(t));
    // Two convex polygons are disjoint if and only if an edge of one separates them.
    let parted = |s: &[[f64; 2]; 3], t: &[[f64; 2]; 3]| {
        (0..3).any(|i| t.iter().all(|&p| area(s[i], s[(i + 1) % 3], p) < 0.0))
    };
    !parted(&s, &t) && !parted(&t, &s)
}

/// Twice the signed area.
fn area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use nearmiss_testdata::arbitrary::{point_in, rng};

    /// The separating axis theorem with the eleven directions of two triangles, and those within a
    /// plane.
    fn naive(s: &Triangle, t: &Triangle) -> bool {
        let edges = |t: &Triangle| [sub(t[1], t[0]), sub(t[2], t[1]), sub(t[0], t[2])];
        let (normal_s, normal_t) = (normal(s), normal(t));
        let mut axes = vec![normal_s, normal_t];
        for e in edges(s) {
            axes.push(cross(normal_s, e));
            axes.extend(edges(t).map(|f| cross(e, f)));
        }
        axes.extend(edges(t).map(|f| cross(normal_t, f)));
        axes.iter().all(|&axis| {
            let span = |t: &Triangle| {
                let along = t.map(|p| dot(axis, p));
                along.iter().fold((f64::MAX, f64::MIN), |(lo, hi), &d| (lo.min(d), hi.max(d)))
            };
            let ((lo_s, hi_s), (lo_t, hi_t)) = (span(s), span(t));
            lo_s <= hi_t && lo_t <= hi_s
        })
    }

    #[test]
    fn random_triangles_agree_with_separating_axes() {
        let rng = &mut rng(7);
        let mut hits = 0;
        for _ in 0..200_000 {
            let s = [(); 3].map(|()| point_in(rng, 1.0));
            let t = [(); 3].map(|()| point_in(rng, 1.0));
            assert_eq!(intersect(&s, &t), naive(&s, &t), "{s:?} {t:?}");
            hits += u32::from(intersect(&s, &t));
        }
        assert!((30_000..170_000).contains(&hits), "{hits}");
    }

    /// Corners on a small lattice: most pairs touch, are coplanar or share edges, and all sums are
    /// exact.
    #[test]
    fn lattice_triangles_agree_with_separating_axes() {
        let rng = &mut rng(8);
        let (mut hits, mut flat, mut judged) = (0, 0, 0);
        for _ in 0..300_000 {
            let [s, t] = [(); 2].map(|()| [(); 3].map(|()| point_in(rng, 1.7).map(f64::round)));
            if [&s, &t].iter().any(|t| dot(normal(t), normal(t)) == 0.0) {
                continue;
            }
            judged += 1;
            flat += u32::from(t.iter().all(|&p| dot(normal(&s), sub(p, s[0])) == 0.0));
            assert_eq!(intersect(&s, &t), naive(&s, &t), "{s:?} {t:?}");
            assert_eq!(intersect(&t, &s), naive(&s, &t), "{t:?} {s:?}");
            hits += u32::from(intersect(&s, &t));
        }
        assert!(judged > 200_000 && flat > 500 && hits > 20_000, "{judged} {flat} {hits}");
        assert!(judged - hits > 20_000, "{judged} {hits}");
    }
}
