//! Refinement of an approximate point to one on both surfaces by the papers' methods, as
//! alternatives to Newton's method.

use std::ops::ControlFlow;

use nearmiss_surface::Status;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;

use crate::ask::answer::Contact;
use crate::ask::interpolation::{Interpolation, Refinement};
use crate::ask::occupancy::points_to_draw;
use crate::ask::options::Detail;
use crate::papers::Papers;
use crate::papers::random::place_in;

/// The limit of test points in a sphere.
const MOST_PLACES: u32 = 65_536;

/// The cube root of this limit.
const MOST_ACROSS: f64 = 40.0;

/// The probability that each of the small spheres that make up the large one contains a point
/// (Klein & Zachmann 2005, Lemma 1).
const PROBABILITY: f64 = 0.97;

impl Papers<'_, '_> {
    /// Handles a contact near points `i` and `j`, with the requested refinement.
    pub(super) fn hit_by(
        &mut self,
        search: &Interpolation,
        contact: Contact,
        i: usize,
        j: usize,
    ) -> ControlFlow<()> {
        let seed = search.seed;
        let (tolerance, by_grid) = match search.refinement {
            _ if self.search.detail != Detail::Witness => return self.search.hit(contact, i, j),
            Refinement::Newton => return self.search.hit(contact, i, j),
            Refinement::Sphere(tolerance) => (tolerance, false),
            Refinement::Grid(tolerance) => (tolerance, true),
        };
        let [va, _] = self.search.pair.views;
        let radii = [
            f64::from(self.search.pair.a.radii[i]) * va.stored_to_world().scale(),
            f64::from(self.search.pair.b.radii[j]) * self.scale_of_b(),
        ];
        // The sphere about the point between two neighbours contains a common point unless the
        // surface is bent (Klein & Zachmann 2005, §4.6).
        let (radius, wanted) = (radii[0].max(radii[1]), tolerance * radii[0].max(radii[1]));
        let found = self.look_through(contact, [i, j], (radius, wanted), (by_grid, seed))?;
        self.search.tries += 1;
        self.search.record(found.unwrap_or(contact), None)
    }

    /// Returns the first point in the sphere within the wanted distance of both surfaces, or else
    /// the nearest one.
    fn look_through(
        &mut self,
        contact: Contact,
        [i, j]: [usize; 2],
        (radius, wanted): (f64, f64),
        (by_grid, seed): (bool, u64),
    ) -> ControlFlow<(), Option<Contact>> {
        let [va, vb] = self.search.pair.views;
        // The large sphere is covered by this number of small ones of that diameter (Rogers 1963),
        // which get one point each.
        let across = (3.0_f64.sqrt() * 2.0 * radius / wanted).ceil();
        // A finer grid would reach the limit before it covers the sphere.
        let across = if by_grid { across.min(MOST_ACROSS) } else { across };
        let places =
            if by_grid { across.powi(3) } else { f64::from(points_to_draw(across.powi(3), PROBABILITY)) };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it saturates")]
        let places = (places as u32).min(MOST_PLACES);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed ^ i as u64 ^ (j as u64) << 32);
        let mut best: Option<Contact> = None;
        for k in 0..places {
            self.search.pair.meter.go_on()?;
            let offset = if by_grid {
                let (k, across) = (f64::from(k), across);
                let cell = [k % across, (k / across).floor() % across, (k / across / across).floor()];
                let offset = cell.map(|c| (2.0 * c + 1.0) / across - 1.0);
                if offset.iter().map(|x| x * x).sum::<f64>() > 1.0 {
                    continue;
                }
                offset
            } else {
                place_in(&mut rng, [0.0; 3], 1.0).map(f64::from)
            };
            let x = [0, 1, 2].map(|k| contact.point[k] + radius * offset[k]);
            let meter = &mut self.search.pair.meter;
            meter.evaluated(2);
            let at = [
                va.evaluate_near(i, x, &mut self.search.gathers[0]),
                vb.evaluate_near(j, x, &mut self.search.gathers[1]),
            ];
            let residual = at[0].f.abs().max(at[1].f.abs());
            if at.iter().any(|at| at.status != Status::Ok)
                || best.is_some_and(|best| best.residual <= residual)
            {
                continue;
            }
            best = Some(Contact { point: x, normals: Some(at.map(|at| at.normal)), residual, ..contact });
            if residual <= wanted {
                break;
            }
        }
        ControlFlow::Continue(best)
    }
}
