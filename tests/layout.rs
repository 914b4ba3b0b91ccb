//! The rule of the house: a module imports from lower levels only, and never from another module of its own level.

use std::fs;
use std::path::{Path, PathBuf};

/// Modules by level, the lowest first. The same table is in `docs/ARCHITECTURE.md`.
const LEVELS: [&[&str]; 6] = [
    &["error", "math"],
    &["geometry"],
    &["record", "bounds", "warp"],
    &["tlas", "blas", "env"],
    &["light"],
    &["sampler"],
];

/// What unit tests may use anywhere.
const TESTING: &str = "testing";

fn level(module: &str) -> Option<usize> {
    LEVELS.iter().position(|modules| modules.contains(&module))
}

fn files(directory: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(directory).expect("a directory") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// Modules of the crate that a line of code names.
fn named(line: &str) -> impl Iterator<Item = &str> {
    let code = line.split("//").next().unwrap_or_default();
    code.split("crate::").skip(1).map(|rest| {
        let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        &rest[..end]
    })
}

#[test]
fn imports_go_down() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    files(&source, &mut paths);
    let mut seen = 0;
    for path in paths {
        let relative = path.strip_prefix(&source).expect("a file in src");
        let module = relative.iter().next().and_then(|first| Path::new(first).file_stem()).expect("a name");
        let module = module.to_str().expect("a name in ASCII");
        if module == "lib" || module == TESTING {
            continue;
        }
        let own = level(module).unwrap_or_else(|| panic!("{module} is on no level"));
        let text = fs::read_to_string(&path).expect("a text");
        for (number, line) in (1..).zip(text.lines()) {
            for other in named(line).filter(|other| *other != module && *other != TESTING) {
                let place = format!("{}:{number}: `{}`", relative.display(), line.trim());
                assert!(!other.is_empty(), "{place}: one module a line, please");
                // What the crate exports may be named by its public name on the top level.
                let is_public = other.starts_with(char::is_uppercase);
                let below = if is_public { LEVELS.len() - 1 } else { level(other).unwrap_or(LEVELS.len()) };
                let allowed = if is_public { own == below } else { below < own };
                assert!(allowed, "{place}: {module} must not import {other}");
                seen += 1;
            }
        }
    }
    assert!(seen > 20, "found {seen} imports only: is this still reading the right files?");
}
