//! Tests of the checker on true proofs about a real scan, and on tampered ones.

use std::ffi::OsString;
use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::OnceLock;
use std::sync::atomic::AtomicU64;

use nearmiss::{BuildOptions, MovingScan, Scan};
use nearmiss_testdata::dragon::{Dragon, dragon_path};

use crate::claim::{Checker, Kind};
use crate::proof::{self, Line, Poses, Semantics, Verdict};
use crate::subject::Subject;
use crate::surface;

/// A scan, poses, and the lines that the command line wrote about them.
struct Trial {
    subject: Subject,
    poses: Poses,
    lines: Vec<Line>,
}

/// Shifts of the second scan along y, along which it is 0.143 long, from inside the first to far
/// away; it is turned about that axis.
const SHIFTS: [f64; 9] = [0.0, 0.06, 0.1, 0.14, 0.15, 0.175, 0.18, 0.2, 1.0];

static TRIAL: OnceLock<Trial> = OnceLock::new();

fn trial() -> &'static Trial {
    TRIAL.get_or_init(|| Trial::new("0", &SHIFTS))
}

impl Trial {
    fn new(margin: &str, shifts: &[f64]) -> Self {
        let cloud = nearmiss::io::read(dragon_path(Dragon::Points5k), None).unwrap().cloud;
        Self::of(&Scan::build(&cloud, &BuildOptions::default()).unwrap(), margin, shifts)
    }

    /// Asks about `cloud` and itself, shifted.
    fn of(cloud: &Scan, margin: &str, shifts: &[f64]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let [scan, poses, proof] =
            ["dragon.nm", "poses.jsonl", "proof.jsonl"].map(|name| folder.path().join(name));
        cloud.save(&scan).unwrap();
        let identity = "[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]";
        let line =
            |y: &f64| format!("{{\"a\":{identity},\"b\":[0.8,0,-0.6,0,0,1,0,{y},0.6,0,0.8,0,0,0,0,1]}}\n");
        fs::write(&poses, shifts.iter().map(line).collect::<String>()).unwrap();
        let words = |paths: &[&str], path: &PathBuf| -> Vec<OsString> {
            paths.iter().map(OsString::from).chain([path.clone().into_os_string()]).collect()
        };
        let args = [
            words(&["nearmiss", "collide"], &scan),
            words(&[], &scan),
            words(&["--poses"], &poses),
            words(&["--margin", margin, "--prove"], &proof),
        ];
        assert_eq!(nearmiss_cli::run(args.concat()), ExitCode::SUCCESS);
        let subject = Subject::open(&scan).unwrap();
        let poses = proof::read_poses(&poses).unwrap();
        let text = fs::read_to_string(&proof).unwrap();
        let lines = text.lines().map(|line| Line::parse(line).unwrap()).collect();
        Self { subject, poses, lines }
    }

    fn checker(&self) -> Checker<'_> {
        Checker { subjects: [&self.subject; 2], poses: Some(&self.poses) }
    }

    fn certified(&self, verdict: Verdict) -> impl Iterator<Item = &Line> {
        self.lines.iter().filter(move |line| line.verdict == verdict && line.is_certified())
    }

    /// Returns the certified separation with the most pairs.
    fn separation(&self) -> Line {
        self.certified(Verdict::Separated).max_by_key(|line| line.pairs.len()).unwrap().clone()
    }

    fn fault(&self, line: &Line) -> String {
        let faults = self.checker().check(line).faults;
        assert_eq!(faults.len(), 1, "{faults:?}");
        faults.into_iter().next().unwrap()
    }
}

#[test]
fn what_the_search_proves_holds() {
    let trial = trial();
    assert_eq!(trial.lines.len(), SHIFTS.len());
    let (mut apart, mut meeting) = (0, 0);
    for line in &trial.lines {
        let finding = trial.checker().check(line);
        assert_eq!(finding.faults, Vec::<String>::new(), "line {}", line.query);
        apart += usize::from(finding.kind == Kind::Separated);
        meeting += usize::from(finding.kind == Kind::Intersecting);
    }
    assert!(apart >= 2 && meeting >= 2, "{apart} apart, {meeting} meeting");
    let sampled = surface::check(&trial.subject, 20_000, 1, &AtomicU64::new(0));
    assert_eq!(sampled.faults, Vec::<String>::new());
    assert_eq!(sampled.points, 20_000);
    assert!(sampled.fill > 0.5 && sampled.fill <= 1.0 && sampled.far > 0.3, "{sampled:?}");
}

/// The frames of scans that moved: bent, so that discs are carried along and some fitted anew; fitted
/// anew in the old order; and replaced by a picture of depths.
#[test]
fn what_the_search_proves_about_moved_frames_holds() {
    let dragon = nearmiss::io::read(dragon_path(Dragon::Points5k), None).unwrap().cloud;
    let frame: Vec<[f64; 3]> = dragon.positions().iter().map(|p| dragon.frame().to_world(*p)).collect();
    let mut scan = MovingScan::new(&frame, &BuildOptions::default()).unwrap();
    let bent: Vec<[f64; 3]> =
        frame.iter().map(|[x, y, z]| [1.1 * x + 0.3 * z * z, y + 0.01 * (60.0 * x).sin(), *z]).collect();
    let refitted = scan.refit(&bent).unwrap();
    assert!(refitted.carried > 1000 && refitted.fitted > 50, "{refitted:?}");
    let mut trials = vec![("refitted", Trial::of(&scan.still(), "0", &[0.06, 0.14, 0.16, 0.2]))];
    scan.renew(&bent).unwrap();
    trials.push(("renewed", Trial::of(&scan.still(), "0", &[0.06, 0.14, 0.16, 0.2])));
    let depth = |i: u32| {
        let [u, v] = [f64::from(i % 64) - 31.5, f64::from(i / 64) - 23.5];
        let z = if u * u + v * v < 180.0 { 1.4 } else { 2.0 + 0.004 * u };
        if i.is_multiple_of(97) { [f64::NAN; 3] } else { [u * z / 60.0, v * z / 60.0, z] }
    };
    scan.replace_organised(&(0..64 * 48).map(depth).collect::<Vec<_>>(), 64).unwrap();
    trials.push(("a depth frame", Trial::of(&scan.still(), "0", &[0.1, 1.5, 3.0, 4.0])));
    for (name, trial) in trials {
        let (mut apart, mut meeting) = (0, 0);
        for line in &trial.lines {
            let finding = trial.checker().check(line);
            assert_eq!(finding.faults, Vec::<String>::new(), "{name}, line {}", line.query);
            apart += usize::from(finding.kind == Kind::Separated);
            meeting += usize::from(finding.kind == Kind::Intersecting);
        }
        assert!(apart >= 1 && meeting >= 1, "{name}: {apart} apart, {meeting} meeting");
        let sampled = surface::check(&trial.subject, 10_000, 1, &AtomicU64::new(0));
        assert_eq!(sampled.faults, Vec::<String>::new(), "{name}");
    }
}

#[test]
fn any_pair_that_is_missing_is_missed() {
    let trial = trial();
    let line = trial.separation();
    assert!(line.pairs.len() >= 8, "{}", line.pairs.len());
    for i in 0..line.pairs.len() {
        let mut line = line.clone();
        line.pairs.remove(i);
        assert!(trial.fault(&line).contains("expected a node pair with point"), "pair {i}");
    }
}

#[test]
fn enclosures_are_the_scans_own() {
    let trial = trial();
    let tampered = |change: &dyn Fn(&mut proof::Enclosure)| {
        let mut line = trial.separation();
        change(&mut line.nodes_b[1]);
        trial.fault(&line)
    };
    assert!(
        tampered(&|node| node.half[2] = node.half[2].next_down()).contains("expected the stored enclosure")
    );
    assert!(tampered(&|node| node.centre[0] = -node.centre[0]).contains("expected the stored enclosure"));
    assert!(tampered(&|node| node.axes[1][2] += 1e-6).contains("expected the stored enclosure"));
    assert!(tampered(&|node| node.count += 1).contains("expected the points of a node"));
}

#[test]
fn gaps_and_margins_are_not_taken_on_trust() {
    let trial = trial();
    for line in trial.certified(Verdict::Separated) {
        let with = |gap: f64, margin: f64| Line { gap: Some(gap), margin, ..line.clone() };
        let gap = line.gap.unwrap();
        assert!(trial.checker().check(&with(0.0, 0.9 * gap)).faults.is_empty(), "less is proven too");
        // The bound is no worse than that.
        assert!(trial.fault(&with(gap + 0.3, 0.0)).contains("apart, got nearer"), "line {}", line.query);
        assert!(trial.fault(&with(0.0, gap + 0.3)).contains("apart, got nearer"), "line {}", line.query);
        assert!(trial.fault(&Line { gap: None, ..line.clone() }).contains("expected a gap"));
    }
    let mut crossed = trial.separation();
    crossed.placed_b[7] -= 0.1;
    let checker = Checker { poses: None, ..trial.checker() };
    assert!(checker.check(&crossed).faults[0].contains("apart, got nearer"), "moved into each other");
    assert!(trial.fault(&crossed).contains("sampling radii away"), "and moved at all");
}

/// Near contact, the points of leaves prove what their enclosures do not. That holds for obstacles
/// alone.
#[test]
fn points_part_obstacles_only() {
    let shifts: Vec<f64> = (0..24_u8).map(|i| 0.15 + 0.001 * f64::from(i)).collect();
    let trial = Trial::new("0", &shifts);
    let mut by_points = 0;
    for line in trial.certified(Verdict::Separated) {
        let finding = trial.checker().check(line);
        assert_eq!(finding.faults, Vec::<String>::new(), "line {}", line.query);
        if finding.by_points == 0 {
            continue;
        }
        by_points += 1;
        let of_surfaces = Line { semantics: Semantics::Surface, ..line.clone() };
        assert!(!trial.fault(&of_surfaces).is_empty(), "line {}", line.query);
        let further = Line { gap: line.gap.map(|gap| gap + 0.01), ..line.clone() };
        assert!(trial.fault(&further).contains("apart, got nearer"), "line {}", line.query);
    }
    assert!(by_points > 0, "no pair was parted by points");
}

#[test]
fn placements_are_the_poses_asked_for() {
    let trial = trial();
    let mut sheared = trial.separation();
    sheared.placed_a[1] += 1e-9;
    assert!(trial.fault(&sheared).contains("expected a rotation with uniform scale"));
    let unknown = Line { query: 99, ..trial.separation() };
    assert!(trial.fault(&unknown).contains("expected the line of a pose"));
}

#[test]
fn witnesses_lie_on_both_surfaces() {
    let trial = trial();
    let line = trial.certified(Verdict::Intersecting).next().unwrap();
    let r = trial.subject.scan.sampling_radius();
    for (by, fault) in [(1e-3 * r, "distances from the obstacles"), (50.0 * r, "")] {
        // Along the diagonal, in no plane of either surface.
        let mut moved = line.clone();
        moved.witness = line.witness.map(|x| x.map(|c| c + by));
        assert!(trial.fault(&moved).contains(fault), "moved by {by}");
    }
    let residual = Line { residual: Some(0.01 * r), ..line.clone() };
    assert!(trial.fault(&residual).contains("expected the residual"));
    assert!(trial.fault(&Line { witness: None, ..line.clone() }).contains("expected a witness with"));
}

#[test]
fn witnesses_between_surfaces_are_within_the_margin() {
    let margin = 0.012;
    // Some of the poses at this distance have verified places.
    let shifts: Vec<f64> = (0..16_u8).map(|i| 0.142 + 0.002 * f64::from(i)).collect();
    let trial = Trial::new(&margin.to_string(), &shifts);
    let mut between = Vec::new();
    for line in &trial.lines {
        let finding = trial.checker().check(line);
        assert_eq!(finding.faults, Vec::<String>::new(), "line {}", line.query);
        between.extend(finding.between.then_some(line));
    }
    // Of these, the one with the scans furthest apart, which do not meet without a margin.
    let line = between.last().unwrap();
    let mut moved = (*line).clone();
    moved.witness = line.witness.map(|[x, y, z]| [x, y + 5.0 * margin, z]);
    assert!(trial.fault(&moved).contains("the margin, "));
    let narrow = Line { margin: 0.1 * line.residual.unwrap(), ..(*line).clone() };
    assert!(trial.fault(&narrow).contains("the margin, "));
    assert!(trial.fault(&Line { margin: 0.0, ..(*line).clone() }).contains("distances from the obstacles"));
}

#[test]
fn lines_that_are_none_are_refused() {
    let number = |margin: &str| {
        let matrix = "[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]";
        format!(
            "{{\"query\":1,\"placed_a\":{matrix},\"placed_b\":{matrix},\"margin\":{margin},\"verdict\":\"undecided\",\
             \"evidence\":null,\"gap\":null,\"witness\":null,\"residual\":null,\"nodes_a\":[],\"nodes_b\":[],\
             \"pairs\":[],\"unknown\":1}}"
        )
    };
    assert!(Line::parse(&number("0")).is_ok(), "unknown fields are ignored");
    for wrong in ["1e999", "NaN", "null", "\"0\""] {
        assert!(Line::parse(&number(wrong)).is_err(), "{wrong}");
    }
    let huge =
        "{\"first\":0,\"count\":1,\"centre\":[1e39,0,0],\"half\":[0,0,0],\"axes\":[[1,0,0],[0,1,0],[0,0,1]]}";
    assert!(Line::parse(&number("0").replace("\"nodes_a\":[]", &format!("\"nodes_a\":[{huge}]"))).is_err());
}
