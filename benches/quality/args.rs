//! Command line.

use std::path::PathBuf;

/// How much is run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// Shading points that variance is measured at.
    pub(crate) points: usize,
    /// Samples a point.
    pub(crate) samples: usize,
    /// Calls a timing.
    pub(crate) calls: usize,
    /// Timings, of which the median counts.
    pub(crate) repeats: usize,
    /// Most probabilities of triangles to be asked of a method.
    pub(crate) choices: usize,
}

impl Effort {
    const FULL: Self = Self { points: 1000, samples: 4096, calls: 1 << 16, repeats: 9, choices: 20_000_000 };
    const QUICK: Self = Self { points: 100, samples: 256, calls: 1 << 11, repeats: 3, choices: 300_000 };
    const SMOKE: Self = Self { points: 8, samples: 16, calls: 1 << 6, repeats: 1, choices: 30_000 };
}

/// What the user asks for.
#[derive(Debug)]
pub(crate) struct Args {
    pub(crate) effort: Effort,
    /// Not the full effort: skip methods that are slow to build.
    pub(crate) quick: bool,
    pub(crate) json: Option<PathBuf>,
    pub(crate) plots: Option<PathBuf>,
    pub(crate) workloads: Vec<String>,
    pub(crate) methods: Vec<String>,
}

const USAGE: &str = "cargo bench --bench quality -- [--quick] [--json FILE] [--plots DIR] [--workload W]... \
                     [--method M]... [--points N] [--samples N]";

impl Args {
    /// Reads the command line; ignores what cargo adds.
    pub(crate) fn parse() -> Result<Self, String> {
        // `cargo bench` says so; `cargo test` does not, and wants to see it run once.
        let is_bench = std::env::args().any(|word| word == "--bench");
        let effort = if is_bench { Effort::FULL } else { Effort::SMOKE };
        let mut args = Self { effort, quick: !is_bench, json: None, plots: None, workloads: vec![], methods: vec![] };
        let mut words = std::env::args().skip(1);
        while let Some(word) = words.next() {
            let mut value = || words.next().ok_or_else(|| format!("{word} needs a value\n{USAGE}"));
            match word.as_str() {
                "--bench" => {}
                "--test" => (args.effort, args.quick) = (Effort::SMOKE, true),
                "--quick" => (args.effort, args.quick) = (Effort::QUICK, true),
                "--json" => args.json = Some(value()?.into()),
                "--plots" => args.plots = Some(value()?.into()),
                "--workload" => args.workloads.push(value()?),
                "--method" => args.methods.push(value()?),
                "--points" => args.effort.points = number(&value()?)?,
                "--samples" => args.effort.samples = number(&value()?)?,
                _ => return Err(format!("unknown argument {word}\n{USAGE}")),
            }
        }
        Ok(args)
    }

    /// Whether a workload is asked for.
    pub(crate) fn wants(&self, workload: &str) -> bool {
        self.workloads.is_empty() || self.workloads.iter().any(|w| w == workload)
    }

    /// The methods to run on a workload.
    pub(crate) fn methods<'a>(&'a self, defaults: &'a [&'a str]) -> Vec<&'a str> {
        let is_quick_enough = |method: &&str| !self.quick || *method != "tessellated";
        if self.methods.is_empty() {
            defaults.iter().copied().filter(is_quick_enough).collect()
        } else {
            defaults.iter().copied().filter(|method| self.methods.iter().any(|m| m == method)).collect()
        }
    }
}

fn number(word: &str) -> Result<usize, String> {
    word.parse().ok().filter(|n| *n > 0).ok_or_else(|| format!("{word} is not a positive number\n{USAGE}"))
}
