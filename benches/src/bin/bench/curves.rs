//! The cost of curves of intersection of pairs of objects, by spacing. It is compared with the
//! search for the contacts that the curves start from, and with a rival that follows no curve:
//! Newton's method from every contact, which gives points in no order.
//!
//! Objects come in pairs, each scaled to a longest side of 2. The second of a pair is turned a
//! little and shifted along x.

use nearmiss::surface::meet;
use nearmiss::{
    BuildOptions, CollideOptions, CollidePlan, Contacts, CurveOptions, CurvePlan, Curves, Detail, Evidence,
    Order, Pair, Placed, Pose, Scan, Scratch,
};
use nearmiss_benches::clock::{nanoseconds, processor_time, timed};
use nearmiss_benches::object::Object;
use nearmiss_benches::{Failure, machine};

/// Spacings, in units of the smaller sampling radius.
const SPACINGS: [f64; 4] = [8.0, 2.0, 1.0, 0.25];

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Pairs of objects
    #[arg(required = true, value_name = "OBJECT")]
    objects: Vec<String>,
    /// Shift of the second object of a pair along x
    #[arg(long, value_name = "X", default_value_t = 0.25, allow_negative_numbers = true)]
    shift: f64,
    /// Passes; the least time counts
    #[arg(long, value_name = "N", default_value_t = 50)]
    passes: u32,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let &Arguments { ref objects, shift, passes } = arguments;
    if objects.len() % 2 == 1 {
        return Err(format!("expected pairs of objects, got {} objects; name one more", objects.len()).into());
    }
    println!("{}", machine::description());
    println!(
        "b turned by 0.7 about (1, 2, 3), shifted by {shift}; ms: least of {passes} passes, and processor time a pass\n"
    );
    println!(
        "| a, b | what | curves | closed | points | length, r | max residual, r | evaluations | least ms | processor ms |\n\
         | --- | --- |{}",
        " --: |".repeat(8)
    );
    let scans = objects
        .iter()
        .map(|source| {
            let object = Object::read(source)?.scaled()?;
            Ok((object.name.clone(), Scan::build(&object.cloud, &BuildOptions::default())?))
        })
        .collect::<Result<Vec<_>, Failure>>()?;
    let pose = Pose::from_axis_angle([1.0, 2.0, 3.0], 0.7).with_translation([shift, 0.0, 0.0]);
    for pair in scans.chunks_exact(2) {
        let [(name_a, a), (name_b, b)] = pair else { continue };
        measure(&format!("{name_a}, {name_b}"), &[a.at(&Pose::IDENTITY), b.at(&pose)], passes)?;
    }
    Ok(())
}

fn measure(pair: &str, [a, b]: &[Placed<'_>; 2], passes: u32) -> Result<(), Failure> {
    let radius = |view: &Placed<'_>| view.sampling_radius();
    let r = radius(a).min(radius(b));
    let options = CollideOptions::estimated()
        .with_detail(Detail::Verdict)
        .with_evidence(Evidence::Estimated)
        .with_order(Order::DepthFirst);
    let plan = CollidePlan::new(&options, a.scan(), b.scan())?;
    let (mut contacts, mut scratch) = (Contacts::default(), Scratch::default());
    let times = time(passes, || {
        Pair::new(*a, *b).contacts(&mut contacts).collide(&plan, &mut scratch);
    });
    println!("| {pair} | contacts | | | {} | | | | {times} |", contacts.contacts.len());

    let [mut of_a, mut of_b] = [Scratch::default(), Scratch::default()];
    let (mut evaluations, mut verified) = (0, 0);
    let times = time(passes, || {
        (evaluations, verified) = (0, 0);
        for contact in &contacts.contacts {
            let meeting = meet(contact.point, |x| {
                evaluations += 2;
                Some([a.evaluate(x, &mut of_a), b.evaluate(x, &mut of_b)])
            });
            verified += usize::from(meeting.is_some_and(|meeting| meeting.verified));
        }
    });
    println!("| {pair} | Newton from each | | | {verified} | | | {evaluations} | {times} |");

    for spacing in SPACINGS {
        let plan = CurvePlan::new(&CurveOptions::default().with_spacing(spacing * r), a.scan(), b.scan())?;
        let (mut found, mut scratch) = (Curves::default(), Scratch::default());
        let times = time(passes, || Pair::new(*a, *b).curves(&plan, &mut found, &mut scratch));
        println!(
            "| {pair} | contacts and curves, {spacing} r | {} | {} | {} | {:.1} | {:.1e} | {} | {times} |",
            found.curves.len(),
            found.closed(),
            found.points.len(),
            found.length() / r,
            found.max_residual / r,
            found.statistics.evaluations,
        );
    }
    Ok(())
}

/// The least time of several passes and the processor time per pass, both in milliseconds.
fn time(passes: u32, mut work: impl FnMut()) -> String {
    let start = processor_time();
    let least = (0..passes).map(|_| nanoseconds(timed(&mut work).1) / 1e6).fold(f64::INFINITY, f64::min);
    let spent = nanoseconds(processor_time().saturating_sub(start)) / 1e6 / f64::from(passes);
    format!("{least:.2} | {spent:.2}")
}
