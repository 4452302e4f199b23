//! Verdicts on shapes with known answers: none may be wrong beyond a band of one sampling radius.
use nearmiss::{BuildOptions, CollideOptions, CollidePlan, Pair, PointCloud, Reason, Scan, Scratch, Verdict};
use nearmiss_testdata::pairs::{AnalyticSet, SetOptions, analytic_set};

/// Returns descriptions of the wrong and of the undecided verdicts outside the band.
fn score(set: &AnalyticSet) -> (Vec<String>, Vec<String>, usize) {
    let scans: Vec<Scan> = (set.shapes.iter())
        .map(|shape| {
            let cloud = PointCloud::from_positions(&shape.points).unwrap();
            Scan::build(&cloud, &BuildOptions::default()).unwrap()
        })
        .collect();
    let mut scratch = Scratch::default();
    let (mut wrong, mut undecided, mut judged) = (Vec::new(), Vec::new(), 0);
    for pair in set.pairs.iter().filter(|pair| !pair.is_in_band()) {
        let (a, b) = (&scans[pair.a], &scans[pair.b]);
        let plan = CollidePlan::new(&CollideOptions::estimated(), a, b).unwrap();
        let (va, vb) = (a.at(&pair.pose_a), b.at(&pair.pose_b));
        let verdict = Pair::new(va, vb).collide(&plan, &mut scratch).verdict;
        let case = format!(
            "{} noise {} gap {:.2} r: {verdict:?} for {} ({})",
            pair.family,
            pair.noise,
            pair.gap / pair.r,
            pair.truth,
            pair.why
        );
        judged += 1;
        match verdict {
            Verdict::Undecided(Reason::Ambiguous) if pair.thin => undecided.push(case),
            Verdict::Undecided(_) => wrong.push(case),
            _ if verdict.is_intersecting() != pair.truth => wrong.push(case),
            _ => {}
        }
    }
    (wrong, undecided, judged)
}

#[test]
fn nothing_is_wrong_outside_the_band() {
    let set = analytic_set(1, &SetOptions { repeats: 1, ..SetOptions::default() });
    let (wrong, undecided, judged) = score(&set);
    let thin = set.pairs.iter().filter(|pair| pair.thin && !pair.is_in_band()).count();
    assert!(judged > 1000, "{judged} pairs outside the band");
    assert!(wrong.is_empty(), "{} of {judged} wrong:\n{}", wrong.len(), wrong.join("\n"));
    assert!(undecided.len() * 20 <= thin, "{} of {thin} thin ones undecided", undecided.len());
}
