//! `collide`: whether, where and how near two scans meet.

use std::fs::File;
use std::io::BufWriter;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::{Args, ValueEnum};
use nearmiss::{
    Answer, BatchScratch, Budget, CollideOptions, CollidePlan, Contacts, Deadline, Detail, Evidence,
    ManifoldPoint, Metric, Pair, Placed, Pose, Proof, Scan, Scratch, each,
};

use crate::console::{self, Console, Results, now};
use crate::contacts::ContactArgs;
use crate::distance::beside;
use crate::error::CliError;
use crate::eval::KernelName;
use crate::meaning::MeaningArgs;
use crate::parse::{parse_duration, parse_radius};
use crate::posing::{self, PairArgs, PoseFile};
use crate::preprocess::parse_threads;
use crate::report::AnswerReport;
use crate::search::SearchArgs;
use crate::sentence::{hint, sentence, unit};
use crate::units::SizeCheck;
use crate::{output, picture, proof};

/// Options of `collide`.
#[derive(Debug, Clone, Args)]
pub struct CollideArgs {
    /// What is asked about
    #[command(flatten)]
    pub pair: PairArgs,
    /// A query a line, {"a":[16 numbers],"b":[16 numbers]}, as `poses` makes them; an answer a line, in order
    #[arg(long, value_name = "FILE.jsonl", conflicts_with_all = ["pose_a", "pose_b", "image"])]
    pub poses: Option<PathBuf>,
    /// Stop after the first hit of --poses: the last line is the hit, if there is one, and all before it are
    /// none
    #[arg(long, requires = "poses")]
    pub first: bool,
    /// Which distances define the surfaces, as scans are prepared for and raw inputs will be; by default as
    /// prepared, else straight ones. By the geodesic kernel surfaces alone are compared, and separations are
    /// estimated
    #[arg(long, value_enum, conflicts_with = "thickened")]
    pub kernel: Option<KernelName>,
    /// The meaning of the scans
    #[command(flatten)]
    pub meaning: MeaningArgs,
    /// Count as meeting what comes nearer than this, in world units
    #[arg(long, value_name = "D", allow_hyphen_values = true, value_parser = parse_radius, default_value = "0")]
    pub margin: f64,
    /// How sure a separation should be: certified is tried for, and proven distances told, for half as much
    /// time again, near contact two to three times as much; by default certified, where the kernel is
    /// geodesic estimated, as nothing is proven of that
    #[arg(long, value_enum)]
    pub evidence: Option<EvidenceName>,
    /// Write what certified answers rest on, a line of JSON a query, for an independent check
    #[arg(long, value_name = "FILE", conflicts_with = "thickened")]
    pub prove: Option<PathBuf>,
    /// Time for each query from its start, whatever other threads do, often 50us to 1ms: a number with ns,
    /// us, ms or s
    #[arg(long, value_name = "200us", allow_hyphen_values = true, value_parser = parse_duration)]
    pub budget: Option<Duration>,
    /// Work units for each query, evaluations of f and node pairs, often 500 to 10000; reproducible, unlike
    /// time
    #[arg(long, value_name = "N")]
    pub work: Option<u64>,
    /// How much to find out about a contact
    #[arg(long, value_enum, default_value_t = DetailName::Witness)]
    pub detail: DetailName,
    /// All contacts, one for each pair of leaves that meets or, without hierarchy, each bracket: to first
    /// order, beside the answer
    #[arg(long)]
    pub all: bool,
    /// What is done with all contacts
    #[command(flatten)]
    pub contacts: ContactArgs,
    /// How to search
    #[command(flatten)]
    pub search: SearchArgs,
    /// Threads, 0 for all cores: to prepare raw inputs, by default all, and to answer --poses, by default one
    #[arg(long, value_name = "N", value_parser = parse_threads)]
    pub threads: Option<usize>,
    /// Picture, as PNG, of both scans and of the place where they meet
    #[arg(long, value_name = "OUT.png")]
    pub image: Option<PathBuf>,
    /// One object of JSON a query instead of sentences
    #[arg(long)]
    pub json: bool,
    /// No progress on the terminal
    #[arg(long)]
    pub quiet: bool,
}

/// How much to find out about a contact, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum DetailName {
    /// That there is one, to first order: fastest
    Verdict,
    /// A point on both surfaces, verified where that can be had
    Witness,
    /// A contact, and several places of it, well spread, each with the way out and the gap along it, for a
    /// solver
    Manifold,
}

/// How sure a separation should be, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum EvidenceName {
    /// Proven, where the volumes about the surfaces are disjoint
    Certified,
    /// By an exhaustive search, with nothing proven: faster
    Estimated,
}

/// Everything that is the same for all queries.
struct Question {
    a: Scan,
    b: Scan,
    plan: CollidePlan,
    budget: Option<Duration>,
    work: Option<u64>,
    resolution: Option<f64>,
    prove: bool,
    all: bool,
    manifold: bool,
    sizes: SizeCheck,
}

impl Question {
    /// The answer to the question on this line of the file of poses.
    fn ask(&self, line: Option<u64>, poses: [Pose; 2], scratch: &mut Scratch) -> Asked {
        let start = now();
        let [a, b] = self.views(&poses);
        let budget = self.budget_from(start);
        let mut proof = self.prove.then(Proof::default);
        let mut contacts = self.all.then(Contacts::default);
        let mut manifold = self.manifold.then(Vec::new);
        let pair = Pair::new(a, b).within(&budget);
        let mut question = pair.question();
        if let Some(proof) = &mut proof {
            question = question.proof(proof);
        }
        if let Some(contacts) = &mut contacts {
            question = question.contacts(contacts);
        }
        if let Some(manifold) = &mut manifold {
            question = question.manifold(manifold);
        }
        let answer = question.collide(&self.plan, scratch);
        #[expect(clippy::cast_precision_loss, reason = "nanoseconds of less than a month are exact")]
        let micros = start.elapsed().as_nanos() as f64 / 1e3;
        Asked { line, poses, answer, proof, contacts, manifold, micros }
    }

    /// The budget of a query that starts at `start`.
    fn budget_from(&self, start: std::time::Instant) -> Budget {
        let mut budget = Budget::UNLIMITED;
        if let Some(units) = self.work {
            budget = budget.with_work(units);
        }
        if let Some(length) = self.resolution {
            budget = budget.with_resolution(length);
        }
        if let Some(end) = self.budget.and_then(|time| start.checked_add(time)) {
            budget = budget.with_deadline(Deadline::at(end));
        }
        budget
    }

    fn views(&self, poses: &[Pose; 2]) -> [Placed<'_>; 2] {
        [self.a.at(&poses[0]), self.b.at(&poses[1])]
    }

    fn tell(&self, out: &mut Outputs<'_, '_>, asked: &Asked, args: &CollideArgs) -> Result<(), CliError> {
        let [a, b] = self.views(&asked.poses);
        self.sizes.compare([&a, &b]);
        if let (Some((path, file)), Some(proof)) = (&mut out.proof, &asked.proof) {
            let line = asked.line.unwrap_or(0);
            proof::write(file, line, [&a, &b], self.plan.options(), &asked.answer, proof)
                .map_err(CliError::writing(path))?;
        }
        let results = &mut *out.results;
        let report = AnswerReport::new(&asked.answer, asked.contacts.as_ref(), asked.micros);
        let report = report.with_manifold(asked.manifold.as_deref());
        let all = asked.contacts.as_ref().map(|all| all.contacts.as_slice());
        let grouped = all.map(|all| (all, args.contacts.group(all, [&a, &b])));
        if let Some((all, grouped)) = &grouped {
            args.contacts.write(all, grouped)?;
        }
        let report = report.with_clashes(grouped.as_ref());
        if args.json {
            return results.json(&report);
        }
        let options = self.plan.options();
        let is_apart = asked.line.is_none() && asked.answer.verdict.is_separated();
        let distance =
            is_apart.then(|| beside([&a, &b], options.semantics, &self.budget_from(now()))).flatten();
        let sentence = sentence(&asked.answer, [&a, &b], options, distance.as_ref());
        if let Some(line) = asked.line {
            return results.line(format_args!("line {line}: {sentence}"));
        }
        results.line(sentence)?;
        if let Some(hint) = hint(&asked.answer, [&a, &b]) {
            results.line(hint)?;
        }
        results.line(report.details())?;
        if let Some((all, grouped)) = &grouped {
            grouped.lines(all, unit([&a, &b])).iter().try_for_each(|line| results.line(line))?;
        }
        report.contacts().chain(report.manifold()).try_for_each(|contact| results.line(contact))
    }
}

/// A query and its answer.
struct Asked {
    /// Of the file of poses.
    line: Option<u64>,
    poses: [Pose; 2],
    answer: Answer,
    /// What it rests on, if that is to be written.
    proof: Option<Proof>,
    /// All contacts, if they are wanted.
    contacts: Option<Contacts>,
    /// The manifold, if it is wanted.
    manifold: Option<Vec<ManifoldPoint>>,
    micros: f64,
}

impl Asked {
    fn is_hit(&self) -> bool {
        self.answer.verdict.is_intersecting()
    }
}

/// Where answers go.
struct Outputs<'a, 'f> {
    results: &'a mut Results,
    proof: Option<(&'a Path, &'a mut BufWriter<&'f File>)>,
}

pub(crate) fn run(args: &CollideArgs) -> Result<(), CliError> {
    let console = Console::new(args.quiet);
    if let Some(path) = &args.image {
        output::check_apart(path, &args.pair.inputs())?;
        picture::check_name(path)?;
    }
    if let Some(path) = &args.prove {
        output::check_apart(path, &args.pair.inputs())?;
    }
    args.contacts.check(&args.pair.inputs())?;
    let matrices = args.pair.matrices()?;
    let mut poses = args.pair.pose_file(args.poses.as_ref())?;

    let threads = args.threads.unwrap_or(0);
    let [a, b] = open(args, threads, console)?;
    let semantics = args.meaning.semantics(&a);
    let detail = match args.detail {
        DetailName::Verdict => Detail::Verdict,
        DetailName::Witness | DetailName::Manifold => Detail::Witness,
    };
    let evidence = match args.evidence {
        None | Some(EvidenceName::Certified) => Evidence::Certified,
        Some(EvidenceName::Estimated) => Evidence::Estimated,
    };
    let options = CollideOptions::default()
        .with_semantics(semantics)
        .with_detail(detail)
        .with_margin(args.margin)
        .with_evidence(evidence);
    args.search.check(&a, &b)?;
    if args.search.wants_graphs() {
        a.make_ready();
    }
    let options = args.search.apply(options, &a)?;
    let plan = CollidePlan::new(&options, &a, &b)?;
    let prove = args.prove.is_some();
    let (budget, work, resolution) = (args.budget, args.work, args.search.resolution);
    let sizes = args.pair.size_check(console);
    let manifold = args.detail == DetailName::Manifold;
    let question = Question { a, b, plan, budget, work, resolution, prove, all: args.all, manifold, sizes };

    let mut results = Results::new();
    let mut answer = |out: &mut Outputs<'_, '_>| match &mut poses {
        Some(poses) => answer_all(&question, poses, args, out),
        None => answer_one(&question, &matrices, args, console, out),
    };
    match &args.prove {
        Some(path) => output::replace(path, |file| {
            let mut out = Outputs { results: &mut results, proof: Some((path, file)) };
            answer(&mut out)
        })?,
        None => answer(&mut Outputs { results: &mut results, proof: None })?,
    }
    results.flush()
}

/// The scans: balls about points know no kernel, so any do for these.
fn open(args: &CollideArgs, threads: usize, console: Console) -> Result<[Scan; 2], CliError> {
    let opening = args.pair.opening(Some(threads), console);
    if args.meaning.thickened.is_some() {
        return opening.open_points(args.pair.inputs());
    }
    let kernel = args.kernel.map(KernelName::metric);
    let scans = if args.search.wants_graphs() && kernel.is_none() {
        opening.open_both_with_graphs(args.pair.inputs())?
    } else {
        opening.open_both(kernel, args.pair.inputs())?
    };
    if args.prove.is_some() && scans[0].metric() == Metric::Geodesic {
        let what = "--prove is for the euclidean kernel: by the geodesic one no separation is proven, and what would \
                    check witnesses does not know it";
        return Err(CliError::Usage(what.into()));
    }
    if args.evidence == Some(EvidenceName::Certified) && scans[0].metric() == Metric::Geodesic {
        console::warn("by the geodesic kernel no separation is proven: they are all estimated");
    }
    Ok(scans)
}

/// The one answer to the poses of the command line.
fn answer_one(
    question: &Question,
    matrices: &[[f64; 16]; 2],
    args: &CollideArgs,
    console: Console,
    out: &mut Outputs<'_, '_>,
) -> Result<(), CliError> {
    let poses = posing::of_options(matrices, [&question.a, &question.b])?;
    let asked = question.ask(None, poses, &mut Scratch::default());
    if let Some(path) = &args.image {
        let bar = console.spinner(format_args!("painting {}", path.display()));
        let [a, b] = question.views(&asked.poses);
        let style = picture::Style {
            names: picture::names(args.pair.inputs()),
            points: args.meaning.thickened.is_some(),
        };
        picture::paint([&a, &b], &asked.answer, &style).save(path)?;
        drop(bar);
    }
    question.tell(out, &asked, args)
}

/// Lines held at a time when several threads answer.
const BATCH: usize = 1024;

/// An answer a line, in order, up to the first hit if no more are wanted; holds no more than a batch.
fn answer_all(
    question: &Question,
    poses: &mut PoseFile,
    args: &CollideArgs,
    out: &mut Outputs<'_, '_>,
) -> Result<(), CliError> {
    let threads = args.threads.unwrap_or(1);
    // One thread, this one, answers each line before it reads the next.
    let (pool, most) = if threads == 1 { (None, 1) } else { (Some(pool(threads)?), BATCH) };
    let (mut lines, mut answers) = (Vec::with_capacity(most), Vec::with_capacity(most));
    let mut scratch = BatchScratch::default();
    loop {
        lines.clear();
        let read = read_lines(poses, most, &mut lines);
        let ask = |i: usize, scratch: &mut Scratch| {
            let (line, text): &(u64, String) = &lines[i];
            let poses = poses.poses(*line, text, [&question.a, &question.b]);
            let asked = poses.map(|poses| question.ask(Some(*line), poses, scratch));
            // What comes after a fault, or after the hit that was looked for, is not told.
            let is_last = asked.as_ref().map_or(true, |asked| args.first && asked.is_hit());
            if is_last { ControlFlow::Break(Some(asked)) } else { ControlFlow::Continue(Some(asked)) }
        };
        answers.clear();
        answers.resize_with(lines.len(), || None);
        let mut answer = || each(&mut answers, None, &mut scratch, ask);
        let told = match &pool {
            Some(pool) => pool.install(answer),
            None => answer(),
        };
        for asked in answers.drain(..).take(told).flatten().chain(read.err().map(Err)) {
            // What was answered before a faulty line is told before the fault.
            let asked = asked.or_else(|fault| out.results.flush().and(Err(fault)))?;
            question.tell(out, &asked, args)?;
            if args.first && asked.is_hit() {
                return Ok(());
            }
        }
        if lines.len() < most {
            return Ok(());
        }
    }
}

fn pool(threads: usize) -> Result<rayon::ThreadPool, CliError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.or(Err(CliError::Threads(threads)))
}

/// Reads up to `most` lines; those before a fault are read.
fn read_lines(poses: &mut PoseFile, most: usize, lines: &mut Vec<(u64, String)>) -> Result<(), CliError> {
    while lines.len() < most
        && let Some(line) = poses.next_line()?
    {
        lines.push(line);
    }
    Ok(())
}
