//! Several samples by splitting the light tree against as many independent ones: error times time.

use core::hint::black_box;
use std::time::Instant;

use ::fanlight::{LightSample, ShadingPoint, Splitting};
use smallvec::SmallVec;

use crate::args::{Args, Effort};
use crate::comparison::truths;
use crate::methods::Fanlight;
use crate::metrics::{Summary, summary};
use crate::oracle::Truth;
use crate::parallel::parallel;
use crate::report::short;
use crate::scenes::pcg::Pcg32;
use crate::scenes::{self, Scene};
use crate::timing::median;
use crate::variance::contribution;

const WORKLOADS: [&str; 3] = ["cloud-10000", "cloud-100000", "grid-100"];
const COUNTS: [f64; 3] = [2.0, 4.0, 8.0];
/// Most levels to split.
const LEVELS: u32 = 16;

type Samples = SmallVec<[LightSample; 64]>;

/// How samples are drawn: one, or by splitting.
type Way = Option<Splitting>;

struct Study<'a> {
    scene: &'a Scene,
    method: Fanlight<'a>,
    points: Vec<(ShadingPoint, Truth)>,
    samples: usize,
}

pub(crate) fn run(args: &Args) {
    println!(
        "\nSplitting: error x time of independent samples over that of as many by splitting (above 1: splitting wins)"
    );
    println!(
        "{:12} {:>8} {:>6} {:>9} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}",
        "workload", "samples", "levels", "threshold", "relvar", "p90", "EW", "ns", "gain", "of p90", "of EW"
    );
    for workload in WORKLOADS.iter().filter(|workload| args.wants(workload)) {
        let scene = scenes::scene(workload);
        let points = truths(&scene, 5 * args.effort.study_points);
        let method = Fanlight::new(&scene);
        let study = Study { scene: &scene, method, points, samples: args.effort.samples };
        study.compare(workload, &args.effort);
    }
}

impl Study<'_> {
    fn compare(&self, workload: &str, effort: &Effort) {
        let ways: Vec<Way> = core::iter::once(None).chain(COUNTS.map(|count| Some(self.splitting(count)))).collect();
        let times = self.nanoseconds(&ways, effort);
        let one = self.measure(None);
        for (way, ns) in ways.into_iter().zip(&times) {
            let all = self.measure(way);
            let gain = |get: fn(&Summary) -> f64| short(get(&one) * times[0] / (get(&all) * ns));
            let (count, Splitting { threshold, levels, .. }) =
                way.map_or((1.0, Splitting::new(0.0, 0)), |splitting| (self.count(&splitting), splitting));
            let [median, p90, mean, ns] = [all.median, all.p90, all.energy_weighted, *ns].map(short);
            println!(
                "{workload:12} {count:>8.2} {levels:>6} {threshold:>9.3} {median:>8} {p90:>8} {mean:>8} {ns:>8} \
                 {:>8} {:>8} {:>8}",
                gain(|s| s.median),
                gain(|s| s.p90),
                gain(|s| s.energy_weighted),
            );
        }
    }

    /// The fewest levels that can give the number of samples, and the threshold that gives about that number.
    fn splitting(&self, count: f64) -> Splitting {
        let can = |levels: &u32| self.count(&Splitting::new(1.0, *levels)) >= count;
        let levels = (1..LEVELS).find(can).unwrap_or(LEVELS);
        let (mut low, mut high) = (0.0_f32, 1.0_f32);
        for _ in 0..12 {
            let threshold = 0.5 * (low + high);
            let is_less = self.count(&Splitting::new(threshold, levels)) < count;
            *(if is_less { &mut low } else { &mut high }) = threshold;
        }
        Splitting::new(0.5 * (low + high), levels)
    }

    /// Mean number of samples.
    fn count(&self, splitting: &Splitting) -> f64 {
        let mut samples = Samples::new();
        for (i, (x, _)) in self.points.iter().enumerate() {
            self.method.sampler().at(x).sample_split(Pcg32::new(i as u64, 6).uniform3(), splitting, &mut samples);
        }
        samples.len() as f64 / self.points.len() as f64
    }

    /// Calls back with all samples of one set.
    fn draw(&self, x: &ShadingPoint, u: [f32; 3], way: Way, samples: &mut Samples) {
        samples.clear();
        match way {
            Some(splitting) => self.method.sampler().at(x).sample_split(u, &splitting, samples),
            None => samples.extend(self.method.sampler().at(x).sample(u)),
        }
    }

    /// Relative variance of a set.
    fn measure(&self, way: Way) -> Summary {
        let at_point = |i: usize, (x, truth): &(ShadingPoint, Truth)| {
            let mut pcg = Pcg32::new(i as u64, 7);
            let mut samples = Samples::new();
            let squares: f64 = (0..self.samples)
                .map(|_| {
                    self.draw(x, pcg.uniform3(), way, &mut samples);
                    let estimate = |sample: &LightSample| {
                        let drawn = self.method.drawn(sample, sample.pdf);
                        contribution(self.scene, x, &drawn) / drawn.pdf
                    };
                    (samples.iter().map(estimate).sum::<f64>() - truth.total).powi(2)
                })
                .sum();
            (squares / self.samples as f64, truth.total * truth.total)
        };
        summary(parallel(&self.points, at_point).into_iter()).expect("there are points")
    }

    /// Times of sets, taken alternately.
    fn nanoseconds(&self, ways: &[Way], effort: &Effort) -> Vec<f64> {
        let points = self.scene.points.timing(effort.calls);
        let mut pcg = Pcg32::new(3, 3);
        let inputs: Vec<[f32; 3]> = points.iter().map(|_| pcg.uniform3()).collect();
        let mut samples = Samples::new();
        let mut times = vec![vec![]; ways.len()];
        for _ in 0..effort.repeats {
            for (way, times) in ways.iter().zip(&mut times) {
                let start = Instant::now();
                for (x, u) in points.iter().zip(&inputs) {
                    self.draw(x, *u, *way, &mut samples);
                    black_box(&samples);
                }
                times.push(start.elapsed().as_secs_f64() * 1e9 / effort.calls as f64);
            }
        }
        times.into_iter().map(median).collect()
    }
}
