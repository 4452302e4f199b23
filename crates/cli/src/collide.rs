//! `collide`: tests whether two scans, or a mesh and a scan, touch, and where.

use std::io::Write;
use std::path::Path;
use std::time::Duration;

use nearmiss::{
    Answer, Budget, CollideOptions, Contacts, Deadline, Detail, Distance, DistanceOptions, DistancePlan,
    Evidence, Metric, Penetration, Pose, Proof, Scan, Scratch, Verdict,
};

use crate::answer_report::AnswerReport;
use crate::as_mesh::AsMeshName;
use crate::bodies::{Bodies, Insides, Plan, Wanted};
use crate::collide_args::{CollideArgs, DetailName, EvidenceName};
use crate::console::{self, Console, Results, micros_since, now};
use crate::distance_picture::paint_apart;
use crate::error::CliError;
use crate::eval::KernelName;
use crate::mesh::args::MeshCollideArgs;
use crate::path::PathLog;
use crate::path_entry::{PathEntry, PathVerdict};
use crate::penetration::{self, interiors, penetration_sentence};
use crate::pose_batch::{PoseLine, answer_lines};
use crate::posing::{self, PoseFile, Posed};
use crate::units::SizeCheck;
use crate::{mesh, output, picture, proof};

/// The bodies and settings that all queries share.
struct Question {
    bodies: Bodies,
    plan: Plan,
    budget: Option<Duration>,
    work: Option<u64>,
    resolution: Option<f64>,
    prove: bool,
    all: bool,
    manifold: bool,
    /// The insides of the bodies, if the penetration is wanted.
    insides: Option<Insides>,
    /// The plan of distance queries for the clearance along a path, if it is needed.
    clearance: Option<DistancePlan>,
    sizes: SizeCheck,
    console: Console,
}

impl Question {
    /// Answers one query. `line` is the number of its line in the file of poses.
    fn ask(&self, line: Option<u64>, posed: Posed, scratch: &mut Scratch) -> Asked {
        let Posed { poses, time } = posed;
        let start = now();
        let views = self.bodies.at(&poses);
        let mut wanted = Wanted {
            proof: self.prove.then(Proof::default),
            contacts: self.all.then(Contacts::default),
            manifold: self.manifold.then(Vec::new),
        };
        let answer = views.collide(&self.plan, &self.budget_from(start), &mut wanted, scratch);
        let micros = micros_since(start);
        let clearance = self.clearance.as_ref().filter(|_| needs_clearance(&answer, self.plan.options()));
        let clearance = clearance.map(|plan| views.distance(plan, &self.budget_from(now()), scratch));
        let penetration = self
            .insides
            .as_ref()
            .and_then(|insides| views.penetration(&self.plan, insides, &self.budget_from(now()), scratch));
        let has_solid = self.insides.as_ref().is_some_and(Insides::has_solid);
        Asked { line, time, poses, answer, clearance, penetration, has_solid, wanted, micros }
    }

    /// Returns the budget of a query that starts at `start`.
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

    fn tell(&self, out: &mut Outputs<'_, '_, '_>, asked: &Asked, args: &CollideArgs) -> Result<(), CliError> {
        let views = self.bodies.at(&asked.poses);
        let Wanted { proof, contacts, manifold } = &asked.wanted;
        views.compare_sizes(&self.sizes);
        if let (Some((path, file)), Some(proof), Some(scans)) = (&mut out.proof, proof, views.scans()) {
            let line = asked.line.unwrap_or(0);
            proof::write(file, line, scans, self.plan.options(), &asked.answer, proof)
                .map_err(CliError::writing(path))?;
        }
        if let (Some(log), Some(line)) = (&mut out.log, asked.line) {
            log.add(asked.entry(line))?;
        }
        let results = &mut *out.results;
        let report = AnswerReport::new(&asked.answer, contacts.as_ref(), asked.micros).of(views.items());
        let report = report.with_manifold(manifold.as_deref());
        let all = contacts.as_ref().map(|all| all.contacts.as_slice());
        let grouped = all.map(|all| {
            let mut grouped = views.group(all, &args.contacts);
            // Lines for people have no room for depths.
            let is_told = args.json || asked.line.is_none();
            if let (true, Some(insides), Some(whole)) = (is_told, &self.insides, &asked.penetration) {
                let _bar = asked.line.is_none().then(|| self.console.spinner("measuring the clashes"));
                let groups = (all, grouped.groups.as_slice());
                grouped.depths = views.depths(&self.plan, insides, groups, whole, &self.budget_from(now()));
            }
            (all, grouped)
        });
        if let Some((all, grouped)) = &grouped {
            let csv = args.path.csv.as_deref().filter(|_| asked.line.is_none());
            args.contacts.write(csv, all, grouped)?;
        }
        let report = report.with_clashes(grouped.as_ref()).with_penetration(asked.penetration.as_ref());
        if args.json {
            return results.json(&report);
        }
        let options = self.plan.options();
        let is_apart = asked.line.is_none() && asked.answer.verdict.is_separated();
        let distance = is_apart.then(|| views.beside(options.semantics, &self.budget_from(now()))).flatten();
        let distance = distance.as_ref().or(asked.clearance.as_ref());
        let sentence = views.sentence(&asked.answer, options, distance);
        if let Some(line) = asked.line {
            let apart = asked.penetration.as_ref();
            let apart = apart.and_then(|found| asked.way_out(found, views.unit()));
            let apart = apart.map_or_else(String::new, |apart| format!(" {apart}"));
            return results.line(format_args!("line {line}: {sentence}{apart}"));
        }
        results.line(sentence)?;
        if let Some(hint) = views.hint(&asked.answer) {
            results.line(hint)?;
        }
        let unit = views.unit();
        let apart = asked.penetration.as_ref().and_then(|found| asked.way_out(found, unit));
        if let Some(apart) = apart {
            results.line(apart)?;
        }
        results.line(report.details())?;
        if let Some((all, grouped)) = &grouped {
            grouped.lines(all, unit).iter().try_for_each(|line| results.line(line))?;
        }
        report.contacts(unit).chain(report.manifold(unit)).try_for_each(|contact| results.line(contact))
    }
}

/// Returns `true` if the distance adds to the answer. For a contact without a margin it is 0.
fn needs_clearance(answer: &Answer, options: &CollideOptions) -> bool {
    !answer.verdict.is_intersecting() || options.margin > 0.0
}

/// A query and its answer.
struct Asked {
    /// The number of the line in the file of poses.
    line: Option<u64>,
    /// The time of that line.
    time: Option<f64>,
    poses: [Pose; 2],
    answer: Answer,
    /// The distance, if it was computed.
    clearance: Option<Distance>,
    /// The penetration, if it is wanted.
    penetration: Option<Penetration>,
    /// `true` if the inside of a scan counts for it.
    has_solid: bool,
    wanted: Wanted,
    micros: f64,
}

impl Asked {
    fn is_hit(&self) -> bool {
        self.answer.verdict.is_intersecting()
    }

    /// Returns `true` if the surfaces are separate and one is inside the other, which is solid. A method that
    /// only estimates may have missed a contact.
    fn is_nested(&self, found: &Penetration) -> bool {
        let has_missed = self.clearance.is_some_and(|clearance| clearance.upper <= 0.0);
        self.has_solid
            && self.answer.verdict.is_separated()
            && !has_missed
            && penetration::bounds(found).is_some()
    }

    /// Returns the penetration as a sentence.
    fn way_out(&self, found: &Penetration, unit: f64) -> Option<String> {
        let sentence = penetration_sentence(found, ["b", "them"], unit)?;
        Some(if self.is_nested(found) {
            format!("One is inside the other, which is solid. {sentence}")
        } else {
            sentence
        })
    }

    /// Returns the entry of this answer in the log of a path.
    fn entry(&self, line: u64) -> PathEntry {
        let report = AnswerReport::new(&self.answer, None, self.micros);
        let (verdict, witness, gap) = match self.answer.verdict {
            Verdict::Intersecting { contact, .. } => (PathVerdict::Intersecting, Some(contact.point), 0.0),
            Verdict::Separated { gap, .. } => (PathVerdict::Separated, None, gap),
            Verdict::Undecided(_) => (PathVerdict::Undecided, None, 0.0),
        };
        // A search for the distance may find a contact that the method has missed.
        let found = self.clearance.filter(|found| verdict != PathVerdict::Separated || found.upper > 0.0);
        let bounds = found.map(|found| [found.lower.max(gap).min(found.upper), found.upper]);
        let clearance = bounds.or(witness.map(|_| [0.0; 2]));
        let place = witness.or(found.map(|found| found.points[0]));
        let penetration = self.penetration.as_ref().and_then(penetration::bounds);
        let is_nested = self.penetration.as_ref().is_some_and(|found| self.is_nested(found));
        let (time, micros) = (self.time, self.micros);
        let (evidence, reason) = report.evidence_and_reason();
        PathEntry { line, time, verdict, evidence, reason, clearance, penetration, is_nested, place, micros }
    }
}

/// The outputs that answers are written to.
struct Outputs<'a, 'p, 'c> {
    results: &'a mut Results,
    proof: Option<(&'a Path, &'p mut (dyn Write + 'p))>,
    /// The log of a path, for many poses.
    log: Option<PathLog<'c>>,
}

pub(crate) fn run(args: &CollideArgs) -> Result<(), CliError> {
    if let Some(which) = args.as_mesh {
        args.check_as_mesh(which)?;
        if which == AsMeshName::Both {
            return mesh::collide::run(&mesh_args(args));
        }
    }
    let console = Console::new(args.quiet);
    if let Some(path) = &args.image {
        output::check_apart(path, &args.pair.inputs())?;
        picture::check_name(path)?;
    }
    if let Some(path) = &args.prove {
        output::check_apart(path, &args.pair.inputs())?;
    }
    args.path.check(&args.pair.inputs(), Some(args.all))?;
    args.contacts.check(args.path.csv.as_deref(), &args.pair.inputs())?;
    let matrices = args.pair.matrices()?;
    let mut poses = args.pair.pose_file(args.path.poses.as_ref())?;

    let threads = args.threads.unwrap_or(0);
    let bodies = open(args, threads, console)?;
    let plan = bodies.plan(&options(args, bodies.scan())?)?;
    let prove = args.prove.is_some();
    let (budget, work, resolution) = (args.budget, args.work, args.search.resolution);
    let sizes = args.pair.size_check(console);
    let manifold = args.detail == DetailName::Manifold;
    let wants_clearance = poses.is_some() && (args.path.wants_clearance() || !args.json);
    let distance = DistanceOptions::default().with_semantics(plan.options().semantics);
    let clearance = wants_clearance.then(|| bodies.distance_plan(&distance)).transpose()?;
    let insides = args.penetration.then(|| bodies.insides(interiors(args.solid)));
    let question = Question {
        bodies,
        plan,
        budget,
        work,
        resolution,
        prove,
        all: args.all,
        manifold,
        insides,
        clearance,
        sizes,
        console,
    };

    let mut results = Results::new();
    output::replace_if_any(args.prove.as_deref(), |proof| {
        let proof = args.prove.as_deref().zip(proof);
        let table = args.path.csv.as_deref().filter(|_| poses.is_some());
        output::replace_if_any(table, |csv| match &mut poses {
            Some(poses) => {
                let log = Some(PathLog::new(&args.path, csv, args.penetration)?);
                let mut out = Outputs { results: &mut results, proof, log };
                answer_all(&question, poses, args, console, &mut out)?;
                conclude(&question, args, &mut out)
            }
            None => {
                let mut out = Outputs { results: &mut results, proof, log: None };
                answer_one(&question, &matrices, args, console, &mut out)
            }
        })
    })?;
    results.flush()
}

/// Returns the options of a query. `a` is the first scan.
pub(crate) fn options(args: &CollideArgs, a: &Scan) -> Result<CollideOptions, CliError> {
    let detail = match args.detail {
        DetailName::Verdict => Detail::Verdict,
        DetailName::Witness | DetailName::Manifold => Detail::Witness,
    };
    let evidence = match args.evidence {
        None | Some(EvidenceName::Certified) => Evidence::Certified,
        Some(EvidenceName::Estimated) => Evidence::Estimated,
    };
    let options = CollideOptions::default()
        .with_semantics(args.meaning.semantics(a))
        .with_detail(detail)
        .with_margin(args.margin)
        .with_evidence(evidence);
    args.search.apply(options, a)
}

/// Returns the same options for `mesh-collide`.
fn mesh_args(args: &CollideArgs) -> MeshCollideArgs {
    MeshCollideArgs {
        pair: args.pair.clone(),
        path: args.path.clone(),
        first: args.first,
        all: args.all,
        contacts: args.contacts.clone(),
        penetration: args.penetration,
        budget: args.budget,
        work: args.work,
        p_min: None,
        k_min: None,
        threads: args.threads,
        image: args.image.clone(),
        view: args.view,
        json: args.json,
        quiet: args.quiet,
    }
}

/// Writes the summary of the answers along a path, and draws their plot.
fn conclude(question: &Question, args: &CollideArgs, out: &mut Outputs<'_, '_, '_>) -> Result<(), CliError> {
    let Some(log) = &out.log else { return Ok(()) };
    log.draw(&args.path, &picture::names(args.pair.inputs()), args.margin)?;
    if args.json {
        return Ok(());
    }
    out.results.line(log.summary(question.bodies.unit(), args.margin))
}

/// Opens both inputs. Scans with different kernels may be mixed for `--thickened`, which uses no
/// kernel.
fn open(args: &CollideArgs, threads: usize, console: Console) -> Result<Bodies, CliError> {
    let opening = args.pair.opening(Some(threads), console);
    let inputs = args.pair.inputs();
    let kernel = args.kernel.map(KernelName::metric);
    let bodies = if let Some(which) = args.as_mesh {
        opening.open_mesh_and_scan(which, kernel, inputs)?
    } else if args.meaning.thickened.is_some() {
        Bodies::Scans(opening.open_points(inputs)?)
    } else if args.search.wants_graphs() && kernel.is_none() {
        Bodies::Scans(opening.open_both_with_graphs(inputs, &args.search.graph_options())?)
    } else {
        Bodies::Scans(opening.open_both(kernel, inputs)?)
    };
    if let Bodies::Scans([a, b]) = &bodies {
        args.search.check([a, b], inputs)?;
        if args.search.wants_graphs() {
            a.make_ready();
        }
    }
    if args.meaning.thickened.is_some() || bodies.scan().metric() != Metric::Geodesic {
        return Ok(bodies);
    }
    if args.prove.is_some() {
        let what = "--prove: expected scans prepared for the euclidean kernel, got the geodesic kernel, which proves \
                    no separation; prepare the scans again with `--kernel euclidean`";
        return Err(CliError::Usage(what.into()));
    }
    if args.evidence == Some(EvidenceName::Certified) {
        console::warn(
            "--evidence certified: the geodesic kernel proves no separation, so separations are estimated",
        );
    }
    Ok(bodies)
}

/// Answers the query with the poses of the command line.
fn answer_one(
    question: &Question,
    matrices: &[[f64; 16]; 2],
    args: &CollideArgs,
    console: Console,
    out: &mut Outputs<'_, '_, '_>,
) -> Result<(), CliError> {
    let poses = posing::of_options(matrices, question.bodies.posable())?;
    let asked = question.ask(None, Posed { poses, time: None }, &mut Scratch::default());
    let views = question.bodies.at(&asked.poses);
    if let Some((path, scans)) = args.image.as_ref().zip(views.scans()) {
        let bar = console.spinner(format_args!("painting {}", path.display()));
        let style = picture::Style {
            names: picture::names(args.pair.inputs()),
            points: args.meaning.thickened.is_some(),
            view: args.view,
            unit: args.pair.world_unit(),
        };
        let apart = match asked.answer.verdict {
            Verdict::Separated { evidence, .. } => {
                let semantics = question.plan.options().semantics;
                views.beside(semantics, &question.budget_from(now())).map(|found| (found, evidence))
            }
            _ => None,
        };
        let picture = match apart.filter(|(found, _)| found.upper > 0.0 && found.upper.is_finite()) {
            Some((found, evidence)) => paint_apart(scans, &found, evidence, &style),
            None => picture::paint(scans, &asked.answer, &style),
        };
        output::save_picture(&picture, path)?;
        drop(bar);
    }
    question.tell(out, &asked, args)
}

/// Answers line by line, in order; with `--first`, up to the first contact.
fn answer_all(
    question: &Question,
    poses: &mut PoseFile,
    args: &CollideArgs,
    console: Console,
    out: &mut Outputs<'_, '_, '_>,
) -> Result<(), CliError> {
    let _watch = poses.watch(console, out.results);
    let ask = |poses: &PoseFile, (line, text): &PoseLine, scratch: &mut Scratch| {
        let posed = poses.poses(*line, text, question.bodies.posable())?;
        let asked = question.ask(Some(*line), posed, scratch);
        poses.answered();
        Ok(asked)
    };
    let is_last = |asked: &Asked| args.first && asked.is_hit();
    answer_lines(poses, args.threads.unwrap_or(1), ask, is_last, |asked| {
        // Answers to the lines before a faulty one are written before the error.
        let asked = asked.or_else(|fault| out.results.flush().and(Err(fault)))?;
        question.tell(out, asked, args)
    })
}
