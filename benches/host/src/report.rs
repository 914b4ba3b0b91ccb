//! The table, and the figures as JSON.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::Error;
use crate::args::Args;
use crate::cost::Cost;
use crate::figure;
use crate::statistics::Ratio;

/// One method in one scene.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    pub(crate) scene: String,
    pub(crate) bounces: u32,
    pub(crate) method: &'static str,
    /// Whether it is the best competitor.
    pub(crate) is_best: bool,
    /// A pixel.
    pub(crate) samples: f64,
    /// CPU time an image.
    pub(crate) seconds: f64,
    pub(crate) rel_mse: f64,
    /// Error times seconds.
    pub(crate) product: f64,
    /// Error times seconds of the best competitor over this one's.
    pub(crate) over_best: Ratio,
    pub(crate) cost: Cost,
    /// Mean time of a ray.
    pub(crate) ray_ns: f64,
    pub(crate) reference_noise: f64,
    /// Seconds, and the error of the image by then.
    pub(crate) curve: Vec<[f64; 2]>,
}

/// Collects rows and prints them.
pub(crate) struct Report {
    rows: Vec<Row>,
    skipped: Vec<(String, PathBuf)>,
    json: Option<PathBuf>,
    figure: Option<PathBuf>,
    is_table: bool,
}

impl Report {
    /// Prints the head of the table.
    pub(crate) fn new(args: &Args) -> Self {
        let is_table = !args.validate;
        if is_table {
            println!(
                "{} seeds, {} s of CPU time an image, instruction set {}\n\n\
                 | scene | bounces | method | samples | relMSE | relMSE x s | over the best competitor | call, rays | \
                 call, ns lit | ns all | ray, ns |\n\
                 | --- | ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |",
                args.seeds,
                args.seconds,
                instruction_set()
            );
        }
        let (json, figure) = (args.json.clone(), args.figure.clone());
        Self { rows: Vec::new(), skipped: Vec::new(), json, figure, is_table }
    }

    /// Notes a scene whose data is missing.
    pub(crate) fn skip(&mut self, scene: &str, file: &Path) {
        eprintln!("skipped: {scene}, because {} is missing", file.display());
        self.skipped.push((scene.to_owned(), file.to_owned()));
    }

    /// Prints the rows of a scene.
    pub(crate) fn add(&mut self, rows: Vec<Row>) {
        for row in &rows {
            let Ratio { mean, low, high } = row.over_best;
            let ratio = if row.is_best { "best".to_owned() } else { format!("{mean:.2} ({low:.2} to {high:.2})") };
            println!(
                "| {} | {} | {} | {:.0} | {:.3e} | {:.3e} | {ratio} | {:.1} | {:.0} | {:.0} | {:.0} |",
                row.scene,
                row.bounces,
                row.method,
                row.samples,
                row.rel_mse,
                row.product,
                row.cost.lit_ns / row.ray_ns,
                row.cost.lit_ns,
                row.cost.ns,
                row.ray_ns,
            );
        }
        self.rows.extend(rows);
    }

    /// Prints what was left out, and writes the figures.
    pub(crate) fn finish(&self) -> Result<(), Error> {
        if self.is_table {
            self.print_summary();
        }
        if !self.skipped.is_empty() {
            println!("\n{} scenes skipped:", self.skipped.len());
            for (scene, file) in &self.skipped {
                println!("  {scene}: {} is missing", file.display());
            }
        }
        if let Some(path) = &self.json {
            let rows: Vec<Value> = self.rows.iter().map(Row::to_json).collect();
            let text = serde_json::to_string_pretty(&json!({
                "instruction_set": instruction_set(),
                "skipped": self.skipped.iter().map(|(scene, _)| scene).collect::<Vec<_>>(),
                "rows": rows,
            }))?;
            std::fs::write(path, text + "\n").map_err(|error| format!("cannot write {}: {error}", path.display()))?;
        }
        if let Some(path) = &self.figure {
            std::fs::write(path, figure::draw(&self.rows))
                .map_err(|error| format!("cannot write {}: {error}", path.display()))?;
        }
        Ok(())
    }

    /// Prints one line a scene: fanlight against the best competitor, and the noise of the reference over fanlight's
    /// error.
    fn print_summary(&self) {
        println!("\n| scene | bounces | best competitor | fanlight over it | 95 % | call, rays | reference's noise |");
        println!("| --- | ---: | --- | ---: | ---: | ---: | ---: |");
        for row in self.rows.iter().filter(|row| row.method == "fanlight") {
            let is_best = |other: &&Row| other.is_best && other.scene == row.scene && other.bounces == row.bounces;
            let best = self.rows.iter().find(is_best).map_or("none", |best| best.method);
            let Ratio { mean, low, high } = row.over_best;
            println!(
                "| {} | {} | {best} | {mean:.2} | {low:.2} to {high:.2} | {:.1} | {:.0} % |",
                row.scene,
                row.bounces,
                row.cost.lit_ns / row.ray_ns,
                100.0 * row.reference_noise / row.rel_mse
            );
        }
    }
}

impl Row {
    fn to_json(&self) -> Value {
        json!({
            "scene": self.scene,
            "bounces": self.bounces,
            "method": self.method,
            "spp": self.samples,
            "seconds": self.seconds,
            "relmse": self.rel_mse,
            "relmse_seconds": self.product,
            "efficiency_over_best": self.over_best.mean,
            "efficiency_over_best_low": self.over_best.low,
            "efficiency_over_best_high": self.over_best.high,
            "is_best_competitor": self.is_best,
            "call_rays": self.cost.lit_ns / self.ray_ns,
            "call_ns": self.cost.lit_ns,
            "call_ns_all": self.cost.ns,
            "ray_ns": self.ray_ns,
            "reference_noise": self.reference_noise,
            "curve": self.curve,
        })
    }
}

/// Returns the widest instructions that the machine has and the crate uses.
fn instruction_set() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        if std::is_x86_feature_detected!("avx512f") {
            return "AVX-512";
        }
        if std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma") {
            return "AVX2";
        }
        "SSE2"
    }
    #[cfg(not(target_arch = "x86_64"))]
    std::env::consts::ARCH
}
