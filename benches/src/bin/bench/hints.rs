//! Benefit of hints: small motions near contact, each pose queried with a hint and without.

use nearmiss::{
    BuildOptions, CollideOptions, CollidePlan, Detail, Evidence, Pair, PairHint, Pose, Scan, Scratch,
};
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::object::Object;
use nearmiss_benches::sample::{Sample, count};
use nearmiss_benches::{Failure, machine, poses};
use nearmiss_testdata::arbitrary::{rng, unit_vector};

/// Steps of a walk, in r: translation and rotation together move the furthest point by about this.
const STEPS: [f64; 5] = [0.01, 0.1, 0.3, 1.0, 3.0];

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Objects to measure: files, `dragon-5k`, `dragon-23k` or `bumpy:POINTS`
    #[arg(required = true, value_name = "OBJECT")]
    objects: Vec<String>,
    /// Walks from poses near contact
    #[arg(long, value_name = "N", default_value_t = 200)]
    walks: usize,
    /// Steps per walk
    #[arg(long, value_name = "N", default_value_t = 60)]
    steps: u32,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 5)]
    seed: u64,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let &Arguments { ref objects, walks, steps, seed } = arguments;
    println!("{}", machine::description());
    println!("{walks} walks of {steps} steps from poses within 10 r of first touch, in random directions");
    for source in objects {
        let object = Object::read(source)?.scaled()?;
        let scan = Scan::build(&object.cloud, &BuildOptions::default())?;
        let starts = poses::near(&object, walks, seed)?;
        println!("\n## {}: {} points, r {:.5}\n", object.name, object.cloud.len(), object.r);
        println!(
            "| evidence | step, r | meet | apart: cold µs | hinted | meet: cold | hinted | all: cold | hinted | ratio |\n\
             | --- |{}",
            " --: |".repeat(9)
        );
        for evidence in [Evidence::Estimated, Evidence::Certified] {
            let options = CollideOptions::estimated().with_detail(Detail::Verdict).with_evidence(evidence);
            let plan = CollidePlan::new(&options, &scan, &scan)?;
            for step in STEPS {
                let mut walked = Walked::default();
                let rng = &mut rng(seed);
                for start in &starts {
                    let heading = unit_vector(rng);
                    walked.walk(&scan, &plan, start.pose, (heading, step * object.r), steps);
                }
                walked.tell(evidence, step)?;
            }
        }
    }
    Ok(())
}

/// Times for intersecting and for separate poses, cold and hinted.
#[derive(Debug, Default)]
struct Walked {
    times: [[Sample; 2]; 2],
    differ: usize,
}

impl Walked {
    fn walk(
        &mut self,
        scan: &Scan,
        plan: &CollidePlan,
        start: Pose,
        (heading, step): ([f64; 3], f64),
        steps: u32,
    ) {
        let (mut hint, mut cold, mut warm) = (PairHint::default(), Scratch::default(), Scratch::default());
        let from = start.translation();
        for i in 0..steps {
            // Half of the step is a rotation, which moves points at distance one by that much.
            let way = 0.5 * step * f64::from(i);
            let turned = Pose::from_axis_angle(heading, way).after(&start.with_translation([0.0; 3]));
            let pose = turned.with_translation([0, 1, 2].map(|k| from[k] + heading[k] * way));
            let views = [scan.at(&Pose::IDENTITY), scan.at(&pose)];
            let (one, time) = timed(|| Pair::new(views[0], views[1]).collide(plan, &mut cold));
            let (other, hinted) =
                timed(|| Pair::new(views[0], views[1]).hinted(&mut hint).collide(plan, &mut warm));
            let meets = one.verdict.is_intersecting();
            self.differ += usize::from(other.verdict.is_intersecting() != meets);
            if i > 0 {
                let [of_cold, of_hinted] = &mut self.times[usize::from(meets)];
                of_cold.push(nanoseconds(time));
                of_hinted.push(nanoseconds(hinted));
            }
        }
    }

    fn tell(&self, evidence: Evidence, step: f64) -> Result<(), Failure> {
        if self.differ > 0 {
            return Err(format!("{} verdicts differ with a hint", self.differ).into());
        }
        let [apart, meet] = &self.times;
        let mean = |samples: &[&Sample]| {
            let all = samples.iter().map(|s| count(s.len())).sum::<f64>();
            samples.iter().map(|s| s.summary().mean * count(s.len())).sum::<f64>() / all / 1e3
        };
        let [cold, hinted] = [0, 1].map(|k| mean(&[&apart[k], &meet[k]]));
        println!(
            "| {evidence:?} | {step} | {:.0} % | {:.2} | {:.2} | {:.2} | {:.2} | {cold:.2} | {hinted:.2} | {:.2} |",
            100.0 * count(meet[0].len()) / count(meet[0].len() + apart[0].len()),
            mean(&[&apart[0]]),
            mean(&[&apart[1]]),
            mean(&[&meet[0]]),
            mean(&[&meet[1]]),
            hinted / cold,
        );
        Ok(())
    }
}
