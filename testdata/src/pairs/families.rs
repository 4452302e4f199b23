//! The table of families: the bodies, their placement, and the reason why the answer is known.

use super::bodies::Body;
use super::place::{Placed, Stream, Wanted};
use super::{ball, sheets, spheres};
use crate::shapes::Form;

/// A placement; `None` if the forms or this draw do not allow the wanted gap.
type Place = fn(&Form, &Form, Wanted, &mut Stream) -> Option<Placed>;

pub(super) struct Family {
    pub(super) name: &'static str,
    pub(super) why: &'static str,
    pub(super) bodies: [Body; 2],
    pub(super) thin: bool,
    pub(super) place: Place,
}

const BALL: &str = "with δ the exact distance of the ball's centre to A, the surfaces are |δ − q| apart if δ > q; \
    if δ < q and the component nearest to the centre reaches beyond q, it meets the sphere, and as a shift changes \
    both distances by at most its length, q − δ is a lower bound of the depth";
const AVATAR: &str = "as for a ball, with the distance of the capsule's segment to A, which is convex along the \
    segment for each rectangle; depth is a lower bound";
const APART: &str = "spheres outside each other: exact, d − R − q; depth min(R + q − d, d − R + q), exact";
const NESTED: &str =
    "a sphere in a hollow one is apart by R − q − d, exact; through its wall the depth is exact";
const SHIFTED: &str =
    "equal spheres with centres d apart cross along a circle until d is 0 or 2R: depth min(d, 2R − d)";
const LINKED: &str = "linked equal circles, one moved by e from the other's middle, are R − e apart, so the tubes \
    are R − e − 2ρ apart; equal tubes cannot contain each other and a shift changes the distance of the circles by \
    at most its length: depth is a lower bound";
const STACKED: &str =
    "coaxial equal circles z apart: tubes z − 2ρ apart; depth a lower bound as for linked tori";
const PARALLEL: &str = "parallel patches whose footprints overlap are apart by their offset, exact";
const EDGE: &str = "one edge of B is the part of it nearest to the plane of A, above the inside of A: apart by its \
    height; below, B must rise by its depth, any other way is longer: exact";
const RIMS: &str = "bowls mouth to mouth, axes e apart: their rims cross in projection, so their distance is that of \
    the planes of the rims; pushed into each other by g they meet at (e/2, ±√(R² − e²/4 − g²/4), −g/2): depth \
    min(g, 2R − √(e² + g²)), exact or a lower bound";
const BETWEEN: &str =
    "a sheet between two parallel plates, parallel to them: the distance to the nearer, exact";

/// Distances of plates, in r of a lattice.
const DISTANCES: [f64; 7] = [0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0];

pub(super) fn families() -> Vec<Family> {
    use Body::{
        Avatar, Ball, Bowl, Box, Building, Field, Globe, Grid, Patch, Plates, Sheet, Shells, Step, Torus,
    };
    let family = |name, why, bodies, place: Place| Family { name, why, bodies, thin: false, place };
    let thin = |name, why, bodies, place: Place| Family { thin: true, ..family(name, why, bodies, place) };
    let mut all = vec![
        family("spheres-apart", APART, [Globe, Ball], spheres::apart),
        family("sphere-nested", NESTED, [Globe, Ball], spheres::nested),
        family("spheres-shifted", SHIFTED, [Globe, Globe], spheres::shifted),
        family("tori-linked", LINKED, [Torus, Torus], spheres::linked),
        family("tori-stacked", STACKED, [Torus, Torus], spheres::stacked),
        family("bowls-rim-to-rim", RIMS, [Bowl, Bowl], spheres::rims),
        family("ball-patch", BALL, [Patch, Ball], ball::ball),
        family("ball-box", BALL, [Box, Ball], ball::ball),
        family("ball-torus", BALL, [Torus, Ball], ball::ball),
        family("ball-bowl", BALL, [Bowl, Ball], ball::ball),
        family("ball-step", BALL, [Step, Ball], ball::ball),
        family("ball-shells", BALL, [Shells, Ball], ball::ball),
        family("ball-grid", BALL, [Grid, Ball], ball::ball),
        family("ball-field", BALL, [Field, Ball], ball::ball),
        family("ball-building", BALL, [Building, Ball], ball::ball),
        family("avatar-building", AVATAR, [Building, Avatar], ball::avatar),
        family("avatar-step", AVATAR, [Step, Avatar], ball::avatar),
        family("patches-parallel", PARALLEL, [Patch, Patch], sheets::parallel),
        family("edge-patch", EDGE, [Patch, Patch], sheets::edge),
    ];
    for distance in DISTANCES {
        let plates = Plates(distance);
        all.push(thin("sheet-between-plates", BETWEEN, [plates, Sheet], sheets::between));
        all.push(thin("sheet-above-plates", PARALLEL, [plates, Sheet], sheets::parallel));
        all.push(thin("edge-plates", EDGE, [plates, Sheet], sheets::edge));
        all.push(thin("ball-plates", BALL, [plates, Ball], ball::ball));
    }
    all
}
