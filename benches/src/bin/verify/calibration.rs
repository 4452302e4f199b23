//! Calibration of likelihoods: the frequency of contact where a budget ended the search, by decile
//! of the likelihood.
//!
//! An object is queried against itself. `SCAN+OBJECT` queries an object in a scan, scaled to a
//! twenty-fifth of the scan's diagonal. With `--as-mesh`, the meshes of objects are queried.
//!
//! The check fails if a decile with a hundred answers or more is off by more than 0.15, or if the
//! Brier score of all answers is not below that of the best constant.

use nearmiss::{
    Budget, BuildOptions, CollideOptions, Mesh, MeshBuildOptions, MeshPair, MeshScratch, MeshVerdict, Pose,
    Reason, Scan, Verdict,
};
use nearmiss_benches::asked::{Asking, Limits};
use nearmiss_benches::object::Object;
use nearmiss_benches::questions::{self, Asked};
use nearmiss_benches::rivals::ours::Ours;
use nearmiss_benches::sample::count;
use nearmiss_benches::{Failure, machine};

/// Budgets, in node pairs and evaluations.
const BUDGETS: [u64; 8] = [1, 4, 8, 16, 32, 64, 128, 256];

/// The object's longest side over the diagonal of the scan around it.
const SHARE: f64 = 0.04;

/// Least answers of a decile that counts.
const ENOUGH: usize = 100;

/// Greatest difference of the frequency of a decile from its mean likelihood.
const TOLERANCE: f64 = 0.15;

/// Likelihoods, each with `true` if the scans meet.
#[derive(Debug, Clone, Default)]
struct Answers(Vec<(f64, bool)>);

impl Answers {
    fn brier(&self, likelihood: impl Fn(f64) -> f64) -> f64 {
        let square = |&(p, meets): &(f64, bool)| (likelihood(p) - f64::from(u8::from(meets))).powi(2);
        self.0.iter().map(square).sum::<f64>() / count(self.0.len().max(1))
    }

    fn frequency(&self) -> f64 {
        count(self.0.iter().filter(|(_, meets)| *meets).count()) / count(self.0.len().max(1))
    }

    /// The answers with a likelihood in the `i`-th tenth.
    fn decile(&self, i: usize) -> Self {
        let of = |p: f64| (0..9).rev().find(|&k| p >= 0.1 * count(k + 1)).map_or(0, |k| k + 1);
        Self(self.0.iter().filter(|(p, _)| of(*p) == i).copied().collect())
    }

    fn mean(&self) -> f64 {
        self.0.iter().map(|(p, _)| p).sum::<f64>() / count(self.0.len().max(1))
    }

    /// The greatest difference over the deciles with enough answers.
    fn worst(&self) -> f64 {
        let deciles = (0..10).map(|i| self.decile(i)).filter(|decile| decile.0.len() >= ENOUGH);
        deciles.map(|decile| (decile.mean() - decile.frequency()).abs()).fold(0.0, f64::max)
    }
}

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Objects, or `SCAN+OBJECT` for an object in a scan
    #[arg(required = true, value_name = "OBJECT")]
    objects: Vec<String>,
    /// Poses near contact
    #[arg(long, value_name = "N", default_value_t = 1000)]
    near: usize,
    /// Poses at each distance of the sweep
    #[arg(long, value_name = "N", default_value_t = 80)]
    swept: usize,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 2)]
    seed: u64,
    /// Query the meshes of the objects
    #[arg(long)]
    as_mesh: bool,
    #[command(flatten)]
    asking: Asking,
}

/// Returns `true` if the check passes.
pub(crate) fn run(arguments: &Arguments) -> Result<bool, Failure> {
    let &Arguments { ref objects, near, swept, seed, as_mesh, asking } = arguments;
    let options = asking.options();
    println!("{}", machine::description());
    println!(
        "order {:?}; budgets of {BUDGETS:?} units; {near} poses near contact, {swept} at each distance\n",
        options.order
    );
    let mut all = Answers::default();
    println!(
        "| object | answers | meet | Brier | constant | worst decile |\n| --- | --: | --: | --: | --: | --: |"
    );
    for source in objects {
        let build = |object: &Object| Scan::build(&object.cloud, &BuildOptions::default());
        let (name, answers) = if let Some((room, body)) = source.split_once('+') {
            if as_mesh {
                return Err("expected objects with `--as-mesh`, got an object in a scan".into());
            }
            let (room, body) = (Object::read(room)?, Object::read(body)?);
            let scans = [build(&room)?, build(&body)?];
            let half = room.cloud.bounds().half_extents();
            let diagonal = half.iter().map(|x| x * x).sum::<f64>().sqrt();
            let longest = body.cloud.bounds().half_extents().into_iter().fold(0.0, f64::max);
            let asked = questions::in_room([&scans[0], &scans[1]], SHARE * diagonal / longest, near, seed)?;
            (room.name, of_scans([&scans[0], &scans[1]], &options, &asked)?)
        } else {
            let object = Object::read(source)?.scaled()?;
            let scan = build(&object)?;
            let asked = questions::asked(&object, &scan, near, swept, seed)?;
            let answers =
                if as_mesh { of_mesh(&object, &asked)? } else { of_scans([&scan; 2], &options, &asked)? };
            (object.name, answers)
        };
        row(&name, &answers);
        all.0.extend(answers.0);
    }
    row("all", &all);
    println!("\n| likelihood | answers | mean likelihood | meet |\n| --- | --: | --: | --: |");
    for i in 0..10 {
        let decile = all.decile(i);
        let (from, to) = (0.1 * count(i), 0.1 * count(i + 1));
        println!(
            "| {from:.1} to {to:.1} | {} | {:.3} | {:.3} |",
            decile.0.len(),
            decile.mean(),
            decile.frequency()
        );
    }
    let constant = all.frequency();
    let good = all.worst() <= TOLERANCE && all.brier(|p| p) < all.brier(|_| constant);
    println!("\n{}", if good { "calibrated" } else { "FAILED: not calibrated" });
    Ok(good)
}

/// Queries two scans with all budgets.
fn of_scans(scans: [&Scan; 2], options: &CollideOptions, asked: &[Asked]) -> Result<Answers, Failure> {
    let mut answers = Answers::default();
    for question in asked {
        for work in BUDGETS {
            let limits = Limits { work: Some(work), ..Limits::default() };
            let answer =
                Ours::of(scans, options)?.with_limits(limits).answer(&Pose::IDENTITY, &question.pose);
            if let Verdict::Undecided(Reason::Budget { likelihood }) = answer.verdict {
                answers.0.push((likelihood, question.meets));
            }
        }
    }
    Ok(answers)
}

/// Queries an object's mesh against itself with all budgets.
fn of_mesh(object: &Object, asked: &[Asked]) -> Result<Answers, Failure> {
    let mesh = object.mesh.as_ref().ok_or("expected an object with a mesh, got points")?;
    let mesh = Mesh::build(mesh, &MeshBuildOptions::default())?;
    let mut scratch = MeshScratch::default();
    let mut answers = Answers::default();
    for question in asked {
        let pair = MeshPair::new(mesh.at(&Pose::IDENTITY), mesh.at(&question.pose));
        for work in BUDGETS {
            let answer = pair.within(&Budget::UNLIMITED.with_work(work)).collide(&mut scratch);
            if let MeshVerdict::Undecided(_) = answer.verdict {
                answers.0.push((answer.likelihood, question.meets));
            }
        }
    }
    Ok(answers)
}

fn row(name: &str, answers: &Answers) {
    let constant = answers.frequency();
    println!(
        "| {name} | {} | {constant:.3} | {:.4} | {:.4} | {:.3} |",
        answers.0.len(),
        answers.brier(|p| p),
        answers.brier(|_| constant),
        answers.worst(),
    );
}
