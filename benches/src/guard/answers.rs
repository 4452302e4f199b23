//! Answers to the questions of a case: asked, written and compared.

use std::fmt::{self, Display};
use std::str::FromStr;

use nearmiss::{
    CollideOptions, CollidePlan, CurveOptions, CurvePlan, Curves, Detail, Distance, DistanceOptions,
    DistancePlan, Evidence, Metric, Pair, Placed, Pose, Scan, Scratch, Semantics, Shape, ShapeIndex, Verdict,
};

use super::cases::{Case, Question};
use crate::Failure;

/// Interval of the questions that are also asked for curves and shapes.
const ONE_OF: usize = 10;

/// Decimal places of the numbers of a record, in scientific notation.
const DIGITS: usize = 8;

/// Relative difference that rounding to [`DIGITS`] can cause.
const ROUNDING: f64 = 1e-6;

/// Greatest relative change of the length of curves, and greatest relative loss of the mean of
/// bounds.
const TOLERANCE: f64 = 0.01;

/// A verdict and its evidence as two letters. `S` separated, `I` intersecting, `U` undecided; `c`
/// certified, `e` estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Said {
    verdict: char,
    evidence: char,
}

impl Said {
    fn of(verdict: &Verdict) -> Self {
        let (verdict, evidence) = match verdict {
            Verdict::Separated { evidence, .. } => ('S', *evidence),
            Verdict::Intersecting { evidence, .. } => ('I', *evidence),
            Verdict::Undecided(_) => ('U', Evidence::Estimated),
        };
        Self { verdict, evidence: if evidence == Evidence::Certified { 'c' } else { 'e' } }
    }

    fn is_less_sure_than(self, other: Self) -> bool {
        self.evidence == 'e' && other.evidence == 'c'
    }
}

impl Display for Said {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.verdict, self.evidence)
    }
}

impl FromStr for Said {
    type Err = Failure;

    fn from_str(text: &str) -> Result<Self, Failure> {
        match text.chars().collect::<Vec<_>>()[..] {
            [verdict @ ('S' | 'I' | 'U'), evidence @ ('c' | 'e')] => Ok(Self { verdict, evidence }),
            _ => Err(format!("expected a verdict such as \"Sc\", got {text:?}").into()),
        }
    }
}

/// The curves of a pair, and the answers about three shapes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Aside {
    curves: usize,
    closed: usize,
    length: f64,
    /// A bit for each shape that touches.
    touches: u32,
}

/// The answers to one question.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Verdict about obstacles, with certified evidence and a witness.
    certified: Said,
    /// Verdict about obstacles, estimated, without a witness.
    estimated: Said,
    /// Verdict about surfaces alone, with certified evidence.
    surface: Said,
    /// Verdict about balls of half the band around all points.
    thickened: Said,
    /// The certified gap.
    gap: f64,
    /// The lower bound of the distance.
    lower: f64,
    upper: f64,
    aside: Option<Aside>,
}

/// The names of the columns of a record.
const HEADER: &str = "certified,estimated,surface,thickened,gap,lower,upper,curves,closed,length,touches";

impl Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { certified, estimated, surface, thickened, gap, lower, upper, aside } = self;
        write!(
            f,
            "{certified},{estimated},{surface},{thickened},{gap:.DIGITS$e},{lower:.DIGITS$e},{upper:.DIGITS$e},"
        )?;
        match aside {
            Some(Aside { curves, closed, length, touches }) => {
                write!(f, "{curves},{closed},{length:.DIGITS$e},{touches}")
            }
            None => write!(f, ",,,"),
        }
    }
}

impl FromStr for Row {
    type Err = Failure;

    fn from_str(line: &str) -> Result<Self, Failure> {
        let cells: Vec<&str> = line.split(',').collect();
        let [certified, estimated, surface, thickened, gap, lower, upper, curves, closed, length, touches] =
            cells[..]
        else {
            return Err(format!("expected 11 cells, got {}", cells.len()).into());
        };
        let aside = if curves.is_empty() {
            None
        } else {
            let (curves, closed) = (curves.parse()?, closed.parse()?);
            Some(Aside { curves, closed, length: length.parse()?, touches: touches.parse()? })
        };
        Ok(Self {
            certified: certified.parse()?,
            estimated: estimated.parse()?,
            surface: surface.parse()?,
            thickened: thickened.parse()?,
            gap: gap.parse()?,
            lower: lower.parse()?,
            upper: upper.parse()?,
            aside,
        })
    }
}

impl Row {
    /// The faults of `self` compared with the earlier answers `old`.
    fn faults(&self, old: &Self) -> Vec<String> {
        let mut faults = Vec::new();
        let verdicts = [
            ("certified", self.certified, old.certified),
            ("estimated", self.estimated, old.estimated),
            ("surface", self.surface, old.surface),
            ("thickened", self.thickened, old.thickened),
        ];
        for (what, new, old) in verdicts {
            if new.verdict != old.verdict || new.is_less_sure_than(old) {
                faults.push(format!("{what}: {new}, {old} on record"));
            }
        }
        if old.gap > 0.0 && self.gap <= 0.0 {
            faults.push(format!("gap {}, {} on record", self.gap, old.gap));
        }
        let above = |x: f64, most: f64| x > most + ROUNDING * most.abs();
        if above(self.upper, old.upper) {
            faults.push(format!("upper {}, {} on record", self.upper, old.upper));
        }
        if above(self.lower, old.upper) || above(old.lower, self.upper) || above(self.lower, self.upper) {
            let Self { lower, upper, .. } = self;
            faults.push(format!("distance {lower} to {upper}, {} to {} on record", old.lower, old.upper));
        }
        if above(self.gap, self.upper) {
            faults.push(format!("gap {}, but the distance is at most {}", self.gap, self.upper));
        }
        if let (Some(new), Some(old)) = (self.aside, old.aside) {
            let longer = (new.length - old.length).abs() > TOLERANCE * old.length;
            if (new.curves, new.closed) != (old.curves, old.closed) || longer || new.touches != old.touches {
                faults.push(format!("{new:?}, {old:?} on record"));
            }
        }
        faults
    }
}

/// The text of a record: a header and a line for each question.
#[must_use]
pub fn written(rows: &[Row]) -> String {
    rows.iter().fold(format!("{HEADER}\n"), |text, row| format!("{text}{row}\n"))
}

/// Parses the rows of a record.
///
/// # Errors
/// When a line is not a row; the error names the first one.
pub fn read(text: &str) -> Result<Vec<Row>, Failure> {
    let mut lines = text.lines().enumerate();
    if lines.next().map(|(_, line)| line) != Some(HEADER) {
        return Err(format!("expected the columns {HEADER}, got others; record the answers again").into());
    }
    lines
        .map(|(number, line)| line.parse().map_err(|cause| format!("line {}: {cause}", number + 1).into()))
        .collect()
}

/// The regressions of `new` against `old`, one line each: changed verdicts, lost evidence, bounds
/// that contradict the old ones, and bounds that are looser on average.
#[must_use]
pub fn faults(new: &[Row], old: &[Row]) -> Vec<String> {
    let mut faults = Vec::new();
    if new.len() != old.len() {
        faults.push(format!("{} answers, {} on record", new.len(), old.len()));
    }
    for (number, (new, old)) in new.iter().zip(old).enumerate() {
        faults.extend(new.faults(old).into_iter().map(|fault| format!("#{number} {fault}")));
    }
    for (what, value) in [("gaps", (|row| row.gap) as fn(&Row) -> f64), ("lower bounds", |row| row.lower)] {
        let [sum, before] = [new, old].map(|rows| rows.iter().map(value).sum::<f64>());
        if sum < before * (1.0 - TOLERANCE) {
            faults.push(format!("{what} are {:.1} % less", 100.0 * (1.0 - sum / before)));
        }
    }
    faults
}

/// Asks all questions of a case.
///
/// # Errors
/// When a plan does not fit the scans.
pub fn ask(case: &Case) -> Result<Vec<Row>, Failure> {
    let mut asker = Asker::default();
    let ask = |(i, question): (usize, &Question)| asker.ask(case, question, i % ONE_OF == 0);
    case.questions.iter().enumerate().map(ask).collect()
}

#[derive(Debug, Default)]
struct Asker {
    scratch: Scratch,
    curves: Curves,
}

impl Asker {
    fn ask(&mut self, case: &Case, question: &Question, aside: bool) -> Result<Row, Failure> {
        let [a, b] = [&case.scans[question.a], &case.scans[question.b]];
        let views = [a.at(&question.poses[0]), b.at(&question.poses[1])];
        let found = self.distance(&views)?;
        let evidence = if a.metric() == Metric::Geodesic { Evidence::Estimated } else { Evidence::Certified };
        let certified = CollideOptions::estimated().with_evidence(evidence);
        let quick =
            CollideOptions::estimated().with_detail(Detail::Verdict).with_evidence(Evidence::Estimated);
        let balls = Semantics::Thickened(0.5 * found.band);
        let sure = self.collide(&views, &certified)?;
        let gap = if let Verdict::Separated { gap, .. } = sure { gap } else { 0.0 };
        Ok(Row {
            certified: Said::of(&sure),
            estimated: Said::of(&self.collide(&views, &quick)?),
            surface: Said::of(&self.collide(&views, &certified.with_semantics(Semantics::Surface))?),
            thickened: Said::of(&self.collide(&views, &quick.with_semantics(balls))?),
            gap,
            lower: found.lower,
            upper: found.upper,
            aside: if aside { Some(self.aside(&views, a, question)?) } else { None },
        })
    }

    fn collide(&mut self, [a, b]: &[Placed<'_>; 2], options: &CollideOptions) -> Result<Verdict, Failure> {
        let plan = CollidePlan::new(options, a.scan(), b.scan())?;
        Ok(Pair::new(*a, *b).collide(&plan, &mut self.scratch).verdict)
    }

    fn distance(&mut self, [a, b]: &[Placed<'_>; 2]) -> Result<Distance, Failure> {
        let plan = DistancePlan::new(&DistanceOptions::default(), a.scan(), b.scan())?;
        Ok(Pair::new(*a, *b).distance(&plan, &mut self.scratch))
    }

    fn aside(
        &mut self,
        [a, b]: &[Placed<'_>; 2],
        scan: &Scan,
        question: &Question,
    ) -> Result<Aside, Failure> {
        let plan = CurvePlan::new(&CurveOptions::default(), a.scan(), b.scan())?;
        Pair::new(*a, *b).curves(&plan, &mut self.curves, &mut self.scratch);
        Ok(Aside {
            curves: self.curves.curves.len(),
            closed: self.curves.closed(),
            length: self.curves.length(),
            touches: touches(scan, question),
        })
    }
}

/// A bit for each of a sphere, a capsule and a box at b's position that touches the points of a.
fn touches(a: &Scan, question: &Question) -> u32 {
    let [pose, at] = question.poses;
    let size = a.bounds().half_extents().into_iter().fold(0.0, f64::max) * pose.scale();
    let centre = at.translation();
    let [x, y, z] = centre;
    let shapes = [
        Shape::Sphere { centre, radius: 0.1 * size },
        Shape::Capsule { ends: [centre, [x + 0.2 * size, y, z]], radius: 0.05 * size },
        Shape::Box {
            pose: Pose::IDENTITY.with_translation(centre),
            half: [0.2 * size, 0.1 * size, 0.05 * size],
            radius: 0.0,
        },
    ];
    let index = ShapeIndex::new(a);
    let mut answers = [false; 3];
    a.at(&pose).with_shapes(&index).touch_each(&shapes, &mut answers);
    answers.iter().enumerate().map(|(i, &touches)| u32::from(touches) << i).sum()
}
