//! Instructions that the calls of the crate take, counted by Valgrind's callgrind: the same on a busy machine as on an
//! idle one, where times are not.
//!
//! ```sh
//! cargo bench -p fanlight-benches --bench instructions              # compares with the baseline, fails if any count grew by more than 5 %
//! cargo bench -p fanlight-benches --bench instructions -- --update  # writes the baseline
//! cargo bench -p fanlight-benches --bench instructions -- building  # only cases whose name contains the word
//! ```
//!
//! Cases named `nee` are what a host does at a lit point: `at`, `sample`, and the density of the sampled direction.
//! Those with `lobe` are at glossy surfaces of roughness 0.1.
//!
//! The program runs itself under Valgrind once for each case, on all cores, and has what happens inside of [`measured`]
//! counted.

mod building;
mod bulbs;
mod cases;

#[expect(dead_code, reason = "the quality bench uses the rest")]
#[path = "../quality/scenes/mod.rs"]
mod scenes;

use std::path::Path;
use std::process::{Command, ExitCode};

use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

type Error = Box<dyn core::error::Error + Send + Sync>;

/// Cases by name, and their counts.
type Counts = Vec<(String, u64)>;

/// How much a count may grow.
const TOLERANCE: f64 = 0.05;
/// Tells the program to run one case.
const CASE: &str = "--case";

fn main() -> ExitCode {
    match run() {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<ExitCode, Error> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    if let Some(at) = words.iter().position(|word| word == CASE) {
        let name = words.get(at + 1).ok_or("which case?")?;
        cases::find(name).ok_or("there is no such case")?.run();
        return Ok(ExitCode::SUCCESS);
    }
    // `cargo test` wants to see each case run, and needs no Valgrind for that.
    if !words.iter().any(|word| word == "--bench") {
        cases::ALL.iter().for_each(cases::Case::run);
        return Ok(ExitCode::SUCCESS);
    }
    let word = words.iter().find(|word| !word.starts_with("--"));
    let is_wanted = |case: &&cases::Case| word.is_none_or(|word| case.name.contains(word.as_str()));
    let wanted: Vec<_> = cases::ALL.iter().filter(is_wanted).collect();
    let counts: Counts =
        wanted.par_iter().map(|case| Ok((case.name.to_owned(), count(case)?))).collect::<Result<_, Error>>()?;
    if let Some(word) = word {
        counts.iter().for_each(|(name, count)| println!("{name:32} {count:>12}"));
        let message = format!("no case is called anything with {word}");
        return if counts.is_empty() { Err(message.into()) } else { Ok(ExitCode::SUCCESS) };
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("instructions/baseline.txt");
    if words.iter().any(|word| word == "--update") {
        let lines: String = counts.iter().map(|(name, count)| format!("{name} {count}\n")).collect();
        std::fs::write(&path, lines)?;
    }
    compare(&counts, &read(&path)?)
}

/// Instructions a call.
fn count(case: &cases::Case) -> Result<u64, Error> {
    let mut valgrind = Command::new("valgrind");
    valgrind
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null", "--toggle-collect=*measured*"])
        .arg(std::env::current_exe()?)
        .args([CASE, case.name]);
    let table = format!("fanlight-table-{}-{}", std::process::id(), case.name.replace('/', "-"));
    let table = std::env::temp_dir().join(table);
    if let Some(bytes) = building::table(case.name) {
        std::fs::write(&table, bytes)?;
        valgrind.arg(building::TABLE).arg(&table);
    }
    let output = valgrind
        .output()
        .map_err(|error| format!("valgrind does not start ({error}): it has to be installed for this bench"))?;
    if valgrind.get_args().any(|word| word == building::TABLE) {
        std::fs::remove_file(&table)?;
    }
    let text = String::from_utf8_lossy(&output.stderr);
    let collected = text.lines().find_map(|line| line.split("Collected : ").nth(1));
    let total: u64 = collected.ok_or_else(|| format!("{} ran into trouble:\n{text}", case.name))?.trim().parse()?;
    if total == 0 {
        return Err(format!("{}: nothing was counted", case.name).into());
    }
    Ok(total / case.calls as u64)
}

fn read(path: &Path) -> Result<Counts, Error> {
    let text = std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let line = |line: &str| {
        let (name, count) = line.split_once(' ').ok_or("a line of the baseline is not a name and a count")?;
        Ok((name.to_owned(), count.parse()?))
    };
    text.lines().map(line).collect()
}

/// Prints the counts next to the baseline's. Fails if one grew, or if the cases are not those of the baseline.
fn compare(counts: &[(String, u64)], baseline: &[(String, u64)]) -> Result<ExitCode, Error> {
    println!("{:32} {:>12} {:>12} {:>8}", "instructions a call", "baseline", "now", "change");
    let mut grown = vec![];
    for (name, now) in counts {
        let before = find(baseline, name).ok_or_else(|| format!("the baseline has no {name}: run with --update"))?;
        let change = *now as f64 / before as f64 - 1.0;
        println!("{name:32} {before:>12} {now:>12} {:>+7.1}%", 100.0 * change);
        if change > TOLERANCE {
            grown.push(name.as_str());
        }
    }
    if let Some((gone, _)) = baseline.iter().find(|(name, _)| find(counts, name).is_none()) {
        return Err(format!("the baseline's {gone} is not measured any more").into());
    }
    if grown.is_empty() { Ok(ExitCode::SUCCESS) } else { Err(format!("slower: {}", grown.join(", ")).into()) }
}

fn find(counts: &[(String, u64)], name: &str) -> Option<u64> {
    counts.iter().find(|(candidate, _)| candidate == name).map(|(_, count)| *count)
}
