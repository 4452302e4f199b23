//! Files with a shape on each line.

use std::collections::BTreeMap;
use std::path::Path;

use nearmiss::{Aabb, Pose, PoseError, Shape};
use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::Value;

use crate::digits::short;
use crate::error::CliError;
use crate::json_lines::JsonLines;
use crate::label::Label;
use crate::matrix::{Matrix, PoseRefused};
use crate::pose_text::JsonPose;
use crate::units::UnitCheck;

/// The form of a line, for messages.
const SHAPE_LINE: &str =
    r#"a line is like {"sphere":{"centre":[x,y,z],"radius":r}}; `touch --help` shows all shapes"#;

/// The names of the shapes, and the forms of their lines.
const SHAPES: [(&str, &str); 8] = [
    ("sphere", r#"a sphere is {"sphere":{"centre":[x,y,z],"radius":r}}"#),
    ("capsule", r#"a capsule is {"capsule":{"ends":[[x,y,z],[x,y,z]],"radius":r}}"#),
    ("box", r#"a box is {"box":{"pose":[7, 12 or 16 numbers],"half":[x,y,z]}}, with "radius":r if wanted"#),
    (
        "cylinder",
        r#"a cylinder is {"cylinder":{"pose":[7, 12 or 16 numbers],"half_height":h,"radius":r}}, with "rounding":r if wanted"#,
    ),
    (
        "cone",
        r#"a cone is {"cone":{"pose":[7, 12 or 16 numbers],"half_height":h,"radius":r}}, with "rounding":r if wanted"#,
    ),
    ("hull", r#"a hull is {"hull":{"points":[[x,y,z],…]}}, with "radius":r if wanted"#),
    (
        "triangle",
        r#"a triangle is {"triangle":{"points":[[x,y,z],[x,y,z],[x,y,z]]}}, with "radius":r if wanted"#,
    ),
    ("segment", r#"a segment is {"segment":{"points":[[x,y,z],[x,y,z]]}}, with "radius":r if wanted"#),
];

/// The form of a line that names a shape, or of any line.
fn form_of(text: &str) -> &'static str {
    let named = SHAPES.iter().find(|(name, _)| text.contains(&format!("\"{name}\":")));
    named.map_or(SHAPE_LINE, |(_, form)| form)
}

/// The fields of shapes. Beside a shape they would be ignored, and the shape would be another one.
const OF_SHAPES: [&str; 9] =
    ["radius", "rounding", "pose", "half", "half_height", "centre", "center", "ends", "points"];

/// A line of a file of shapes, which holds one shape. Other fields of the line are ignored, but not
/// [those of shapes](OF_SHAPES); a shape may have no others, since a misspelt radius would be none.
#[derive(Debug, Deserialize)]
#[serde(expecting = "an object")]
struct ShapeLine {
    sphere: Option<SphereLine>,
    capsule: Option<CapsuleLine>,
    r#box: Option<BoxLine>,
    cylinder: Option<RoundLine>,
    cone: Option<RoundLine>,
    hull: Option<HullLine>,
    triangle: Option<TriangleLine>,
    segment: Option<SegmentLine>,
    name: Option<Value>,
    id: Option<Value>,
    #[serde(flatten)]
    others: BTreeMap<String, IgnoredAny>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SphereLine {
    #[serde(alias = "center")]
    centre: [f64; 3],
    radius: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CapsuleLine {
    ends: [[f64; 3]; 2],
    radius: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct BoxLine {
    pose: JsonPose,
    half: [f64; 3],
    #[serde(default, alias = "rounding")]
    radius: f64,
}

/// A cylinder or a cone.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RoundLine {
    pose: JsonPose,
    half_height: f64,
    radius: f64,
    #[serde(default)]
    rounding: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct HullLine {
    points: Vec<[f64; 3]>,
    #[serde(default)]
    radius: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct TriangleLine {
    points: [[f64; 3]; 3],
    #[serde(default)]
    radius: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SegmentLine {
    points: [[f64; 3]; 2],
    #[serde(default)]
    radius: f64,
}

/// A shape from a file.
#[derive(Debug)]
pub(super) enum ReadShape {
    Plain(Shape<'static>),
    /// The convex hull of points, and the radius about it.
    Hull(Vec<[f64; 3]>, f64),
}

impl ReadShape {
    pub(super) fn shape(&self) -> Shape<'_> {
        match self {
            Self::Plain(shape) => *shape,
            Self::Hull(points, radius) => Shape::Hull { points, radius: *radius },
        }
    }

    /// Warns if the shape on this line seems to be in another unit than the scan.
    pub(super) fn compare(&self, check: &mut UnitCheck, line: u64) {
        if let Some(bounds) = self.shape().bounds() {
            check.compare(&bounds, format_args!("the shape on line {line}"));
        }
    }
}

impl ShapeLine {
    /// Returns the shape of the line. The pose of a solid may deviate from a rotation by a tenth of `r`.
    fn read(self, r: f64) -> Result<ReadShape, String> {
        let mut shapes: Vec<Result<ReadShape, String>> = Vec::new();
        let mut add = |shape: Option<Result<ReadShape, String>>| shapes.extend(shape);
        add(self.sphere.map(SphereLine::read));
        add(self.capsule.map(CapsuleLine::read));
        add(self.r#box.map(|line| line.read(r)));
        add(self.cylinder.map(|line| line.read(false, r)));
        add(self.cone.map(|line| line.read(true, r)));
        add(self.hull.map(HullLine::read));
        add(self.triangle.map(TriangleLine::read));
        add(self.segment.map(SegmentLine::read));
        let beside = |name: &str| !shapes.is_empty() && self.others.contains_key(name);
        if let Some(name) = OF_SHAPES.iter().find(|name| beside(name)) {
            return Err(format!("expected `{name}` within the shape, got it beside it; {SHAPE_LINE}"));
        }
        if beside("margin") {
            return Err("expected a margin by the option --margin, got `margin` on a line; remove it".into());
        }
        match (shapes.pop(), shapes.len(), self.others.keys().next()) {
            (Some(shape), 0, _) => shape,
            (None, _, Some(_)) if self.others.contains_key("type") => {
                Err(format!("expected the name of the shape as the key, got `type`; {SHAPE_LINE}"))
            }
            (None, _, Some(name)) => {
                let name: String = name.chars().take(40).flat_map(char::escape_debug).collect();
                Err(format!("unknown shape `{name}`; known: {}", SHAPES.map(|(name, _)| name).join(", ")))
            }
            (last, count, _) => {
                let count = count + usize::from(last.is_some());
                Err(format!("expected one shape, got {count}; {SHAPE_LINE}"))
            }
        }
    }
}

impl SphereLine {
    fn read(self) -> Result<ReadShape, String> {
        let radius = positive("radius", self.radius)?;
        Ok(ReadShape::Plain(Shape::Sphere { centre: self.centre, radius }))
    }
}

impl CapsuleLine {
    fn read(self) -> Result<ReadShape, String> {
        let radius = positive("radius", self.radius)?;
        Ok(ReadShape::Plain(Shape::Capsule { ends: self.ends, radius }))
    }
}

impl BoxLine {
    fn read(self, r: f64) -> Result<ReadShape, String> {
        let [x, y, z] = self.half;
        let half = [positive("half", x)?, positive("half", y)?, positive("half", z)?];
        let radius = positive("radius", self.radius)?;
        Ok(ReadShape::Plain(Shape::Box { pose: pose(&self.pose, half, r)?, half, radius }))
    }
}

impl RoundLine {
    fn read(self, is_cone: bool, r: f64) -> Result<ReadShape, String> {
        let half_height = positive("half_height", self.half_height)?;
        let radius = positive("radius", self.radius)?;
        let rounding = positive("rounding", self.rounding)?;
        let pose = pose(&self.pose, [radius, half_height, radius], r)?;
        Ok(ReadShape::Plain(if is_cone {
            Shape::Cone { pose, half_height, radius, rounding }
        } else {
            Shape::Cylinder { pose, half_height, radius, rounding }
        }))
    }
}

impl HullLine {
    fn read(self) -> Result<ReadShape, String> {
        if self.points.is_empty() {
            return Err("expected at least one point in `points`, got none".to_owned());
        }
        Ok(ReadShape::Hull(self.points, positive("radius", self.radius)?))
    }
}

impl TriangleLine {
    fn read(self) -> Result<ReadShape, String> {
        let radius = positive("radius", self.radius)?;
        Ok(ReadShape::Plain(Shape::Triangle { points: self.points, radius }))
    }
}

impl SegmentLine {
    fn read(self) -> Result<ReadShape, String> {
        let radius = positive("radius", self.radius)?;
        Ok(ReadShape::Plain(Shape::Capsule { ends: self.points, radius }))
    }
}

/// Makes a pose of its numbers. `half` are half the edge lengths of what it places.
fn pose(given: &JsonPose, half: [f64; 3], r: f64) -> Result<Pose, String> {
    let matrix: Matrix = given.matrix().map_err(|what| format!("`pose`: {what}"))?;
    let bounds = Aabb { min: half.map(|h| -h), max: half };
    Pose::from_row_major(&matrix, &bounds, 0.1 * r).map_err(|cause| format!("`pose`: {}", refused(cause)))
}

fn refused(cause: PoseError) -> PoseRefused {
    PoseRefused { cause, is_transposed: false, allowed: "a tenth of the sampling radius" }
}

fn positive(name: &str, length: f64) -> Result<f64, String> {
    if length >= 0.0 {
        Ok(length)
    } else {
        Err(format!("expected a length of zero or more in `{name}`, got {}", short(length)))
    }
}

/// A file with a shape on each line.
pub(super) struct ShapeFile {
    lines: JsonLines,
}

impl ShapeFile {
    pub(super) fn open(path: &Path) -> Result<Self, CliError> {
        Ok(Self { lines: JsonLines::open(path, "shapes", SHAPE_LINE)? })
    }

    /// Returns the number of the next line with a shape, counted from 1, and its text.
    pub(super) fn next_line(&mut self) -> Result<Option<(u64, String)>, CliError> {
        self.lines.next_line()
    }

    /// Parses the shape on line `number`, whose text is `text`, and its label. The pose of a solid may
    /// deviate from a rotation by a tenth of `r`.
    pub(super) fn shape(&self, number: u64, text: &str, r: f64) -> Result<(ReadShape, Label), CliError> {
        let mut line: ShapeLine = self.lines.parse_as(number, text, form_of(text))?;
        let label = Label { name: line.name.take(), id: line.id.take() };
        let shape = line.read(r).map_err(|what| self.lines.fault_on(number, what))?;
        Ok((shape, label))
    }

    /// The error about a shape at a distance that is not finite.
    pub(super) fn too_far(&self, number: u64) -> CliError {
        let what =
            "expected a shape within measurable distance, got one too far away or too large; check its units";
        self.lines.fault_on(number, what)
    }
}
