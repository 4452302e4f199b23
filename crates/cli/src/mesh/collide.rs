//! `mesh-collide`: tests whether two meshes meet, and where.

use nearmiss::{
    Mesh, MeshAnswer, MeshContact, MeshDistance, MeshPair, MeshQuality, MeshScratch, MeshSolid, MeshVerdict,
    Penetration, Pose, Scratch,
};
use nearmiss_draw::picture::Picture;

use super::args::MeshCollideArgs;
use super::contacts::MeshContacts;
use super::picture::{Told, paint};
use super::report::{MeshAnswerReport, evidence_and_reason, kind};
use super::two_meshes::{TwoMeshes, micros_since};
use super::words::{contact_line, sentence};
use crate::console::{Console, Results, now};
use crate::error::CliError;
use crate::output;
use crate::path::PathLog;
use crate::path_entry::PathEntry;
use crate::penetration::{self, penetration_sentence};
use crate::picture::{Style, check_name, names};
use crate::pose_batch::{PoseLine, answer_lines};
use crate::posing::{self, PoseFile, Posed};
use crate::sentence::far_apart;

/// The meshes and settings that all queries share.
struct Question<'a> {
    meshes: TwoMeshes,
    args: &'a MeshCollideArgs,
    /// `true` if the clearance of separated poses is needed.
    clearance: bool,
    console: Console,
}

/// A query and its answer.
struct Asked {
    /// The number of the line in the file of poses.
    line: Option<u64>,
    /// The time of that line.
    time: Option<f64>,
    poses: [Pose; 2],
    answer: MeshAnswer,
    /// All contacts, with `--all`, and `true` if there are no others.
    contacts: Option<(Vec<MeshContact>, bool)>,
    /// The distance, if it was computed.
    clearance: Option<MeshDistance>,
    /// The penetration, with `--penetration`.
    penetration: Option<Penetration>,
    micros: f64,
}

impl Asked {
    /// Returns the entry of this answer in the log of a path.
    fn entry(&self, line: u64) -> PathEntry {
        let witness = match self.answer.verdict {
            MeshVerdict::Intersecting(contact) => Some(contact.point),
            _ => None,
        };
        let bounds = self.clearance.map(|found| [found.lower, found.upper]);
        let (evidence, reason) = evidence_and_reason(&self.answer.verdict);
        PathEntry {
            line,
            time: self.time,
            verdict: kind(&self.answer.verdict),
            evidence,
            reason,
            clearance: bounds.or(witness.map(|_| [0.0; 2])),
            penetration: self.penetration.as_ref().and_then(penetration::bounds),
            // The triangles of nested meshes are separate.
            is_nested: self.penetration.as_ref().and_then(penetration::bounds).is_some() && witness.is_none(),
            place: witness.or(self.clearance.map(|found| found.points[0])),
            micros: self.micros,
        }
    }
}

pub(crate) fn run(args: &MeshCollideArgs) -> Result<(), CliError> {
    let console = Console::new(args.quiet);
    if let Some(path) = &args.image {
        output::check_apart(path, &args.pair.inputs())?;
        check_name(path)?;
    }
    args.path.check(&args.pair.inputs(), Some(args.all))?;
    args.contacts.check(args.path.csv.as_deref(), &args.pair.inputs())?;
    let matrices = args.pair.matrices()?;
    let mut poses = args.pair.pose_file(args.path.poses.as_ref())?;
    let meshes = TwoMeshes::open(&args.pair, args.threads, (args.budget, args.work), console)?;
    let clearance = poses.is_some() && (args.path.wants_clearance() || !args.json);
    let question = Question { meshes, args, clearance, console };
    let mut results = Results::new();
    match &mut poses {
        Some(poses) => output::replace_if_any(args.path.csv.as_deref(), |csv| {
            let mut log = PathLog::new(&args.path, csv, args.penetration)?;
            question.answer_all(poses, console, &mut log, &mut results)?;
            log.draw(&args.path, &names(args.pair.inputs()), 0.0)?;
            let unit = question.meshes.unit(&[Pose::IDENTITY; 2]);
            if args.json { Ok(()) } else { results.line(log.summary(unit, 0.0)) }
        })?,
        None => {
            let poses = posing::of_options(&matrices, question.meshes.both())?;
            let asked = question.ask(None, Posed { poses, time: None }, &mut MeshScratch::default());
            if let Some(path) = &args.image {
                let _bar = console.spinner(format_args!("painting {}", path.display()));
                output::save_picture(&question.paint(&asked), path)?;
            }
            question.tell(&asked, &mut results)?;
        }
    }
    results.flush()
}

impl Question<'_> {
    /// Answers line by line, in order; with `--first`, up to the first contact.
    fn answer_all(
        &self,
        poses: &mut PoseFile,
        console: Console,
        log: &mut PathLog<'_>,
        results: &mut Results,
    ) -> Result<(), CliError> {
        let _watch = poses.watch(console, results);
        let ask = |poses: &PoseFile, (line, text): &PoseLine, scratch: &mut Scratch| {
            let posed = poses.poses(*line, text, self.meshes.both())?;
            let asked = self.ask(Some(*line), posed, scratch.meshes());
            poses.answered();
            Ok(asked)
        };
        let is_last = |asked: &Asked| self.args.first && asked.answer.verdict.is_intersecting();
        answer_lines(poses, self.args.threads.unwrap_or(1), ask, is_last, |asked| {
            // Answers to the lines before a faulty one are written before the error.
            let asked = asked.or_else(|fault| results.flush().and(Err(fault)))?;
            if let Some(line) = asked.line {
                log.add(asked.entry(line))?;
            }
            self.tell(asked, results)
        })
    }

    /// Answers one query. `line` is the number of its line in the file of poses.
    fn ask(&self, line: Option<u64>, Posed { poses, time }: Posed, scratch: &mut MeshScratch) -> Asked {
        let start = now();
        let pair = self.meshes.pair(&poses, start);
        let (answer, contacts) = if self.args.all {
            let mut contacts = Vec::new();
            let (answer, complete) = pair.contacts(&mut contacts, scratch);
            (answer, Some((contacts, complete)))
        } else {
            (self.collide(&pair, scratch), None)
        };
        let micros = micros_since(start);
        let wants_clearance = self.clearance && !answer.verdict.is_intersecting();
        let clearance = wants_clearance.then(|| self.meshes.pair(&poses, now()).distance(scratch));
        // An infinite distance is that of an invalid pose.
        let clearance = clearance.filter(|found| found.upper.is_finite());
        let penetration = self
            .args
            .penetration
            .then(|| self.meshes.pair(&poses, now()).penetration(self.solids(), scratch));
        Asked { line, time, poses, answer, contacts, clearance, penetration, micros }
    }

    /// Returns the solids of both meshes.
    fn solids(&self) -> [&MeshSolid; 2] {
        self.meshes.both().map(Mesh::solid)
    }

    /// Tests the meshes as well as --p-min and --k-min ask for.
    fn collide(&self, pair: &MeshPair<'_>, scratch: &mut MeshScratch) -> MeshAnswer {
        let Some(p_min) = self.args.p_min else { return pair.collide(scratch) };
        let quality = MeshQuality::default().with_p_min(p_min);
        let quality = self.args.k_min.map_or(quality, |k_min| quality.with_k_min(k_min));
        pair.collide_likely(&quality, scratch)
    }

    /// Paints the meshes, and their contacts or nearest points.
    fn paint(&self, asked: &Asked) -> Picture {
        let pair = self.meshes.pair(&asked.poses, now());
        let (mut contacts, scratch) = (Vec::new(), &mut MeshScratch::default());
        let distance = asked.answer.verdict.is_separated().then(|| pair.distance(scratch));
        if asked.answer.verdict.is_intersecting() {
            pair.contacts(&mut contacts, scratch);
        }
        let told = Told {
            answer: &asked.answer,
            contacts: &contacts,
            distance: distance.as_ref(),
            digit: self.meshes.unit(&asked.poses),
        };
        let style = Style {
            names: names(self.args.pair.inputs()),
            points: false,
            view: self.args.view,
            unit: self.args.pair.world_unit(),
        };
        paint(self.meshes.placed(&asked.poses).each_ref(), &told, &style)
    }

    fn tell(&self, asked: &Asked, results: &mut Results) -> Result<(), CliError> {
        self.meshes.compare_sizes(&asked.poses);
        let all = asked.contacts.as_ref();
        let grouped = all.map(|(all, complete)| {
            let mut all = MeshContacts::new(all, &self.args.contacts);
            // Lines for people have no room for depths.
            let is_told = self.args.json || asked.line.is_none();
            if let Some(whole) = asked.penetration.as_ref().filter(|_| is_told) {
                let _bar = asked.line.is_none().then(|| self.console.spinner("measuring the clashes"));
                all.measure(&self.meshes.pair(&asked.poses, now()), self.solids(), whole);
            }
            (all, *complete)
        });
        if let Some((all, _)) = &grouped {
            let csv = self.args.path.csv.as_deref().filter(|_| asked.line.is_none());
            all.write(csv, &self.args.contacts)?;
        }
        let all = grouped.as_ref().map(|(all, complete)| (all, *complete));
        let report = MeshAnswerReport::new(&asked.answer, all, asked.penetration.as_ref(), asked.micros);
        if self.args.json {
            return results.json(&report);
        }
        let unit = self.meshes.unit(&asked.poses);
        let is_apart = asked.line.is_none() && asked.answer.verdict.is_separated();
        let beside =
            is_apart.then(|| self.meshes.pair(&asked.poses, now()).distance(&mut MeshScratch::default()));
        let distance = beside.as_ref().or(asked.clearance.as_ref());
        let apart =
            asked.penetration.as_ref().and_then(|found| penetration_sentence(found, ["b", "them"], unit));
        let sentence = sentence(&asked.answer, distance, unit);
        let sentence = match apart {
            Some(apart) => format!("{sentence} {apart}"),
            None => sentence,
        };
        if let Some(line) = asked.line {
            return results.line(format_args!("line {line}: {sentence}"));
        }
        results.line(sentence)?;
        if let Some(hint) = is_apart.then(|| far_apart(self.meshes.world_bounds(&asked.poses))).flatten() {
            results.line(hint)?;
        }
        results.line(report.details())?;
        let Some((all, complete)) = &grouped else { return Ok(()) };
        all.lines(unit).iter().try_for_each(|line| results.line(line))?;
        let contacts = asked.contacts.iter().flat_map(|(contacts, _)| contacts);
        contacts.map(|contact| contact_line(contact, unit)).try_for_each(|line| results.line(line))?;
        if *complete {
            return Ok(());
        }
        results.line("The budget ran out; there may be more contacts. Raise --budget or --work.")
    }
}
