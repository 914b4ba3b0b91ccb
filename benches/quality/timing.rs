//! Nanoseconds a call, of all methods of a workload in turns, so that their ratios do not depend on the machine's
//! mood.

use core::hint::black_box;
use std::time::Instant;

use fanlight::ShadingPoint;

use crate::args::Effort;
use crate::methods::{Drawn, Method};
use crate::scenes::Scene;
use crate::scenes::pcg::Pcg32;

/// Nanoseconds a sample and a density.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nanoseconds {
    pub(crate) sample: f64,
    pub(crate) pdf: f64,
}

/// The calls of one method.
struct Calls<'a> {
    method: &'a dyn Method,
    count: usize,
    /// Points, each with a direction that the method drew there.
    drawn: Vec<(ShadingPoint, Drawn)>,
    samples: Vec<f64>,
    pdfs: Vec<f64>,
}

/// Times all methods.
pub(crate) fn time(scene: &Scene, methods: &[Box<dyn Method + '_>], effort: &Effort) -> Vec<Nanoseconds> {
    let points = scene.points.timing(effort.calls);
    let mut pcg = Pcg32::new(3, 3);
    let inputs: Vec<(ShadingPoint, [f32; 3])> = points.into_iter().map(|x| (x, pcg.uniform3())).collect();
    let mut calls: Vec<Calls<'_>> = methods.iter().map(|method| Calls::new(method.as_ref(), &inputs)).collect();
    for _ in 0..effort.repeats {
        calls.iter_mut().for_each(|calls| calls.repeat(&inputs));
    }
    calls.into_iter().map(|calls| Nanoseconds { sample: median(calls.samples), pdf: median(calls.pdfs) }).collect()
}

impl<'a> Calls<'a> {
    fn new(method: &'a dyn Method, inputs: &[(ShadingPoint, [f32; 3])]) -> Self {
        // A method that looks at every light needs few calls to be timed.
        let count = if method.is_slow() { inputs.len().div_ceil(64) } else { inputs.len() };
        let drawn = inputs[..count].iter().filter_map(|(x, u)| method.sample(x, *u).map(|drawn| (*x, drawn))).collect();
        Self { method, count, drawn, samples: vec![], pdfs: vec![] }
    }

    fn repeat(&mut self, inputs: &[(ShadingPoint, [f32; 3])]) {
        let method = black_box(self.method);
        self.samples.push(nanoseconds(&inputs[..self.count], |(x, u)| {
            black_box(method.sample(x, *u));
        }));
        self.pdfs.push(nanoseconds(&self.drawn, |(x, drawn)| {
            black_box(method.pdf(x, drawn));
        }));
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
