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
    /// Points that a study looks at.
    pub(crate) study_points: usize,
    /// Independent repetitions in a study.
    pub(crate) repetitions: usize,
    /// Images of a curve of error against time; each takes twice as long as the one before.
    pub(crate) images: u32,
    /// Seconds that the last of them is rendered.
    pub(crate) seconds: f64,
}

impl Effort {
    const FULL: Self = Self {
        points: 1000,
        samples: 4096,
        calls: 1 << 16,
        repeats: 9,
        choices: 20_000_000,
        study_points: 100,
        repetitions: 256,
        images: 6,
        seconds: 8.0,
    };
    const QUICK: Self = Self {
        points: 80,
        samples: 256,
        calls: 1 << 12,
        repeats: 3,
        choices: 250_000,
        study_points: 8,
        repetitions: 64,
        images: 4,
        seconds: 0.5,
    };
    const SMOKE: Self = Self {
        points: 8,
        samples: 16,
        calls: 1 << 6,
        repeats: 1,
        choices: 30_000,
        study_points: 2,
        repetitions: 4,
        images: 1,
        seconds: 0.01,
    };
}

/// What can be run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    /// One row for each workload, method and class.
    Table,
    /// How the error falls with the number of samples.
    Stratification,
    /// Several samples by splitting against as many independent ones.
    Splitting,
    /// Glossy receivers.
    Lobes,
    /// The terms that can guide the descent inside a triangle.
    Terms,
    /// Portals by spherical harmonics: as an estimate, and as a control variate.
    Harmonics,
    /// Error against time of rendered images.
    Room,
}

impl Part {
    const ALL: [Self; 7] =
        [Self::Table, Self::Stratification, Self::Splitting, Self::Lobes, Self::Terms, Self::Harmonics, Self::Room];
}

/// What the user asks for.
#[derive(Debug)]
pub(crate) struct Args {
    pub(crate) effort: Effort,
    /// Not the full effort: skip methods that are slow to build.
    pub(crate) quick: bool,
    pub(crate) parts: Vec<Part>,
    pub(crate) json: Option<PathBuf>,
    pub(crate) plots: Option<PathBuf>,
    pub(crate) workloads: Vec<String>,
    pub(crate) methods: Vec<String>,
}

const USAGE: &str = "cargo bench -p fanlight-benches --bench quality -- [--quick] [--json FILE] [--plots DIR] [--workload W]... \
                     [--method M]... [--points N] [--samples N] \
                     [--table] [--stratification] [--splitting] [--lobes] [--terms] [--harmonics] [--room] [--everything]";

impl Args {
    /// Reads the command line; ignores what cargo adds.
    pub(crate) fn parse() -> Result<Self, String> {
        // `cargo bench` says so; `cargo test` does not, and wants to see everything run once.
        let is_bench = std::env::args().any(|word| word == "--bench");
        let effort = if is_bench { Effort::FULL } else { Effort::SMOKE };
        let (parts, json, plots, workloads, methods) = (vec![], None, None, vec![], vec![]);
        let mut args = Self { effort, quick: !is_bench, parts, json, plots, workloads, methods };
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
                "--table" => args.parts.push(Part::Table),
                "--stratification" => args.parts.push(Part::Stratification),
                "--splitting" => args.parts.push(Part::Splitting),
                "--lobes" => args.parts.push(Part::Lobes),
                "--terms" => args.parts.push(Part::Terms),
                "--harmonics" => args.parts.push(Part::Harmonics),
                "--room" => args.parts.push(Part::Room),
                "--everything" => args.parts = Part::ALL.to_vec(),
                _ => return Err(format!("unknown argument {word}\n{USAGE}")),
            }
        }
        if args.parts.is_empty() {
            args.parts = if is_bench { vec![Part::Table] } else { Part::ALL.to_vec() };
        }
        Ok(args)
    }

    /// Whether a workload is selected.
    pub(crate) fn wants(&self, workload: &str) -> bool {
        self.workloads.is_empty() || self.workloads.iter().any(|w| w == workload)
    }

    /// Whether a method is selected, by its name or by that of its variant.
    pub(crate) fn wants_method(&self, method: &str, variant: Option<&str>) -> bool {
        let is_same = |asked: &String| match (asked.split_once('@'), variant) {
            (None, _) => asked == method,
            (Some((name, of)), variant) => name == method && variant == Some(of),
        };
        self.methods.is_empty() || self.methods.iter().any(is_same)
    }
}

fn number(word: &str) -> Result<usize, String> {
    word.parse().ok().filter(|n| *n > 0).ok_or_else(|| format!("{word} is not a positive number\n{USAGE}"))
}
