//! Nanoseconds a call, of all methods of a workload in turns, so that their ratios do not depend on the machine's
//! mood.

use core::hint::black_box;
use std::time::Instant;

use fanlight::ShadingPoint;

use crate::args::Effort;
use crate::methods::{Drawn, Method};
use crate::scenes::Scene;
use crate::scenes::pcg::Pcg32;

/// Nanoseconds a call and a density. A call is all that a host does for one light sample: see [`Method::call`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nanoseconds {
    /// A call at a point that light can arrive at: the time that belongs to the variance.
    pub(crate) lit: f64,
    /// A call at any point, many of which are dark and return early.
    pub(crate) all: f64,
    pub(crate) pdf: f64,
}

/// A point, and random numbers for it.
type Input = (ShadingPoint, [f32; 3]);

/// The calls of one method.
struct Calls<'a> {
    method: &'a dyn Method,
    /// At lit points, and at all.
    inputs: [&'a [Input]; 2],
    /// Points, each with a direction that the method drew there.
    drawn: Vec<(ShadingPoint, Drawn)>,
    /// At lit points, and at all.
    calls: [Vec<f64>; 2],
    pdfs: Vec<f64>,
}

/// Times all methods.
pub(crate) fn time(scene: &Scene, methods: &[Box<dyn Method + '_>], effort: &Effort) -> Vec<Nanoseconds> {
    let points = scene.points.timing(effort.calls);
    let mut pcg = Pcg32::new(3, 3);
    let all: Vec<Input> = points.into_iter().map(|x| (x, pcg.uniform3())).collect();
    let lit: Vec<Input> = all.iter().copied().filter(|(x, _)| scene.is_lit(x)).collect();
    assert!(!lit.is_empty(), "no point is lit");
    let mut calls: Vec<Calls<'_>> =
        methods.iter().map(|method| Calls::new(method.as_ref(), [lit.as_slice(), all.as_slice()])).collect();
    for _ in 0..effort.repeats {
        calls.iter_mut().for_each(Calls::repeat);
    }
    calls.into_iter().map(Calls::medians).collect()
}

impl<'a> Calls<'a> {
    fn new(method: &'a dyn Method, inputs: [&'a [Input]; 2]) -> Self {
        // A method that looks at every light needs few calls to be timed.
        let few = |inputs: &'a [Input]| if method.is_slow() { &inputs[..inputs.len().div_ceil(64)] } else { inputs };
        let inputs = inputs.map(few);
        let drawn = inputs[1].iter().filter_map(|(x, u)| method.sample(x, *u).map(|drawn| (*x, drawn))).collect();
        Self { method, inputs, drawn, calls: [vec![], vec![]], pdfs: vec![] }
    }

    fn repeat(&mut self) {
        let method = black_box(self.method);
        for (times, inputs) in self.calls.iter_mut().zip(self.inputs) {
            times.push(nanoseconds(inputs, |(x, u)| {
                black_box(method.call(x, *u));
            }));
        }
        self.pdfs.push(nanoseconds(&self.drawn, |(x, drawn)| {
            black_box(method.pdf(x, drawn));
        }));
    }

    fn medians(self) -> Nanoseconds {
        let [lit, all] = self.calls.map(median);
        Nanoseconds { lit, all, pdf: median(self.pdfs) }
    }
}

/// Mean time of a call.
fn nanoseconds<T>(inputs: &[T], call: impl FnMut(&T)) -> f64 {
    let start = Instant::now();
    inputs.iter().for_each(call);
    start.elapsed().as_secs_f64() * 1e9 / inputs.len() as f64
}

pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
