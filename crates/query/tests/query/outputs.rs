//! Outputs of a question: each is the same in every combination.
use std::collections::BTreeSet;

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, NodePair, PointHierarchy};
use nearmiss_query::{
    Answer, CollideOptions, CollidePlan, Contacts, Detail, Evidence, ManifoldPoint, Pair, PairHint, Placed,
    Proof, Scratch, Semantics, Verdict,
};
use nearmiss_testdata::arbitrary::{self, CloudKind};

fn prepared(kind: CloudKind, count: u32, seed: u64) -> PointHierarchy {
    let cloud = PointCloud::from_positions(&arbitrary::cloud(kind, count, seed)).unwrap();
    PointHierarchy::build(&cloud, &BuildOptions::default().with_leaf_size(8)).unwrap()
}

/// An answer with every output.
#[derive(Debug, Default)]
struct Told {
    manifold: Vec<ManifoldPoint>,
    contacts: Contacts,
    proof: Proof,
}

/// Asks for the outputs that have a bit in `which`, in reused memory: manifold, contacts, proof.
fn ask(
    pair: &Pair<'_>,
    plan: &CollidePlan,
    which: u32,
    hint: Option<&mut PairHint>,
    (told, scratch): (&mut Told, &mut Scratch),
) -> Answer {
    let mut question = pair.question();
    if which & 1 != 0 {
        question = question.manifold(&mut told.manifold);
    }
    if which & 2 != 0 {
        question = question.contacts(&mut told.contacts);
    }
    if which & 4 != 0 {
        question = question.proof(&mut told.proof);
    }
    if let Some(hint) = hint {
        question = question.hinted(hint);
    }
    question.collide(plan, scratch)
}

/// Returns `true` if the pairs of a proof cover each pair of points once, by the counts of points
/// alone.
fn covers(proof: &Proof, [a, b]: [&PointHierarchy; 2]) -> bool {
    let points = |pair: &NodePair| a.topology().points(pair.a).len() * b.topology().points(pair.b).len();
    let distinct: BTreeSet<_> = proof.pairs.iter().map(|(pair, _)| (pair.a, pair.b)).collect();
    distinct.len() == proof.pairs.len()
        && proof.pairs.iter().map(|(pair, _)| points(pair)).sum::<usize>() == a.len() * b.len()
}

#[test]
fn outputs_are_the_same_in_every_combination() {
    let rng = &mut arbitrary::rng(11);
    let (mut scratch, mut dirty) = (Scratch::default(), Told::default());
    let mut seen = [0; 4];
    for (n, kind) in (0_u64..).zip([CloudKind::Sphere, CloudKind::Random, CloudKind::Rings]) {
        let scans = [prepared(kind, 400, n), prepared(kind, 300, n + 7)];
        let r = scans[0].sampling_radius();
        let size = scans[0].bounds().half_extents().into_iter().fold(0.0, f64::max);
        let sure = CollideOptions::estimated().with_evidence(Evidence::Certified);
        for options in [
            sure,
            sure.with_detail(Detail::Verdict).with_margin(0.5 * r),
            sure.with_semantics(Semantics::Surface),
            sure.with_semantics(Semantics::Thickened(0.3 * r)),
        ] {
            let plan = CollidePlan::new(&options, &scans[0], &scans[1]).unwrap();
            let mut hints: Vec<PairHint> = vec![PairHint::default(); 8];
            let start = Vector3::from(arbitrary::unit_vector(rng)) * (2.2 * size);
            let way = Vector3::from(arbitrary::unit_vector(rng)) * (0.3 * size) - start;
            for step in 0..60 {
                // Move in, then stay for the last steps.
                let share = f64::from(step).min(50.0) / 50.0;
                let pose = Pose::from_axis_angle([1.0, 2.0, 3.0], 0.2 * share)
                    .with_translation((start + way * share).into());
                let pair = Pair::new(Placed::new(&scans[0], &Pose::IDENTITY), Placed::new(&scans[1], &pose));
                let alone = pair.collide(&plan, &mut scratch);
                let mut each = [Told::default(), Told::default(), Told::default()];
                for (output, told) in each.iter_mut().enumerate() {
                    ask(&pair, &plan, 1 << output, None, (told, &mut scratch));
                }
                let [manifold, contacts, proof] = &each;
                for which in 0..8_u32 {
                    let answer = ask(&pair, &plan, which, None, (&mut dirty, &mut scratch));
                    let what = format!("{kind:?} {options:?}, step {step}, outputs {which:b}");
                    assert_eq!(answer.verdict.is_intersecting(), alone.verdict.is_intersecting(), "{what}");
                    if which & 2 == 0 {
                        assert_eq!(answer.verdict, alone.verdict, "{what}");
                        if which & 1 != 0 {
                            assert_eq!(dirty.manifold, manifold.manifold, "{what}");
                        }
                    } else {
                        assert_eq!(dirty.contacts, contacts.contacts, "{what}");
                        assert!(dirty.contacts.complete);
                    }
                    if which & 4 != 0 {
                        assert_eq!(dirty.proof, proof.proof, "{what}");
                    }
                    // Each combination has its own hint.
                    let hint = &mut hints[which as usize];
                    let hinted = ask(&pair, &plan, which, Some(hint), (&mut dirty, &mut scratch));
                    let what = format!("{what}, hinted");
                    assert_eq!(hinted.verdict.is_intersecting(), alone.verdict.is_intersecting(), "{what}");
                    assert_eq!(hinted.verdict.is_separated(), alone.verdict.is_separated(), "{what}");
                    if which & 1 != 0 {
                        let has_places = !dirty.manifold.is_empty();
                        assert_eq!(has_places, hinted.verdict.is_intersecting(), "{what}");
                        seen[0] += usize::from(has_places);
                    }
                    if which & 2 != 0 {
                        assert_eq!(dirty.contacts, contacts.contacts, "{what}");
                        seen[1] += usize::from(dirty.contacts.contacts.len() > 1);
                    }
                    if which & 4 != 0 {
                        match hinted.verdict {
                            Verdict::Separated { gap, evidence: Evidence::Certified }
                                if options.semantics != Semantics::Thickened(0.3 * r) =>
                            {
                                assert!(covers(&dirty.proof, scans.each_ref()), "{what}");
                                let least = dirty.proof.pairs.iter().map(|(_, gap)| *gap);
                                let least = least.fold(f64::INFINITY, f64::min);
                                assert!(gap <= least * (1.0 + 1e-6), "{what}: {gap} of {least}");
                                seen[2] += 1;
                            }
                            _ => assert!(dirty.proof.pairs.is_empty(), "{what}: {hinted:?}"),
                        }
                    }
                    seen[3] += usize::from(hinted.statistics.node_pairs < alone.statistics.node_pairs / 2);
                }
            }
        }
    }
    assert!(seen.iter().all(|&n| n > 300), "{seen:?}");
}
