//! Modules import only what lies below them: the table of the design, read against every `crate::` path in `src`. No
//! name of a constant stands for two values.

extern crate alloc;

use alloc::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Modules by level. Those of one level never import each other.
const LEVELS: [&[&str]; 6] = [
    &["error", "math", "simd", "geometry", "parallel", "progress", "buffers"],
    &["record", "receiver", "bounds", "warp"],
    &["env", "blas", "tlas"],
    &["light", "visibility"],
    &["technique"],
    &["sampler"],
];
/// The float functions stand in for those of the standard library, so geometry may use them although it is a sibling,
/// and one of them is a machine instruction. Readers of bytes fail with the one error type, and a build that is
/// cancelled does.
const EXCEPTIONS: [(&str, &str); 4] =
    [("geometry", "math"), ("math", "simd"), ("buffers", "error"), ("error", "progress")];
/// Not part of the house.
const EXEMPT: [&str; 2] = ["lib", "testing"];

fn level(module: &str) -> Option<usize> {
    LEVELS.iter().position(|modules| modules.contains(&module))
}

/// The module of the table that a file below `src` belongs to.
fn module_of(file: &Path) -> Option<String> {
    let first = file.components().next()?.as_os_str().to_str()?;
    Some(first.trim_end_matches(".rs").into())
}

/// The source with every comment, string and character literal blanked, so that places stay what they are.
pub(crate) fn without_comments(source: &str) -> Vec<char> {
    let mut chars: Vec<char> = source.chars().collect();
    let mut i = 0;
    let blank = |chars: &mut Vec<char>, from: usize, to: usize| {
        let to = to.min(chars.len());
        chars[from..to].iter_mut().filter(|c| **c != '\n').for_each(|c| *c = ' ');
    };
    while i < chars.len() {
        let next = chars.get(i + 1).copied();
        let end = match (chars[i], next) {
            ('/', Some('/')) => (i..chars.len()).find(|&j| chars[j] == '\n'),
            ('/', Some('*')) => (i + 2..chars.len()).find(|&j| chars[j] == '/' && chars[j - 1] == '*').map(|j| j + 1),
            ('"', _) => {
                let mut j = i + 1;
                while j < chars.len() && chars[j] != '"' {
                    j += if chars[j] == '\\' { 2 } else { 1 };
                }
                Some(j + 1)
            }
            // A quotation mark as a character; anything else after an apostrophe does no harm.
            ('\'', Some('"')) => Some(i + 3),
            _ => {
                i += 1;
                continue;
            }
        };
        let end = end.unwrap_or(chars.len());
        blank(&mut chars, i, end);
        i = end;
    }
    chars
}

pub(crate) fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Where `word` begins and nothing belongs to it before or after.
fn words(chars: &[char], word: &str) -> Vec<usize> {
    let pattern: Vec<char> = word.chars().collect();
    let free = |at: Option<&char>| at.is_none_or(|c| !is_word(*c));
    (0..chars.len().saturating_sub(pattern.len() - 1))
        .filter(|&i| chars[i..].starts_with(&pattern))
        .filter(|&i| free(i.checked_sub(1).and_then(|j| chars.get(j))) && free(chars.get(i + pattern.len())))
        .collect()
}

/// The first names after a `::`, each with its place: one, or those of a group, however nested or broken into lines.
fn first_names(chars: &[char], mut at: usize, names: &mut Vec<(usize, String)>) {
    while chars.get(at).is_some_and(|c| c.is_whitespace()) {
        at += 1;
    }
    if chars.get(at) != Some(&'{') {
        let name: String = chars[at..].iter().take_while(|c| is_word(**c) || **c == '*').collect();
        names.push((at, name));
        return;
    }
    let mut depth = 0;
    let mut expected = false;
    while at < chars.len() {
        match chars[at] {
            '{' => {
                depth += 1;
                expected = depth == 1;
            }
            '}' => depth -= 1,
            ',' => expected = depth == 1,
            c if expected && !c.is_whitespace() => {
                first_names(chars, at, names);
                expected = false;
            }
            _ => {}
        }
        if depth == 0 {
            return;
        }
        at += 1;
    }
}

/// What a file imports that it must not, as messages with file and line.
fn violations(file: &Path, source: &str) -> Vec<String> {
    let Some(module) = module_of(file) else { return vec![format!("{}: in no module", file.display())] };
    if EXEMPT.contains(&module.as_str()) {
        return Vec::new();
    }
    let chars = without_comments(source);
    let line = |at: usize| chars[..at].iter().filter(|c| **c == '\n').count() + 1;
    let mut found = Vec::new();
    let mut report = |at: usize, what: String| found.push(format!("{}:{}: {what}", file.display(), line(at)));
    let Some(own) = level(&module) else {
        report(0, format!("`{module}` is not in the table"));
        return found;
    };
    let after = |at: usize, what: &str| {
        let rest: String = chars[at..].iter().filter(|c| !c.is_whitespace()).take(what.len()).collect();
        rest == what
    };
    for at in words(&chars, "crate") {
        let end = at + "crate".len();
        if !after(end, "::") {
            // `pub(crate)` is no import, but `use crate as other` hides some.
            if after(end, "as") || after(end, ";") {
                report(at, "the crate under another name".into());
            }
            continue;
        }
        let colons = (end..chars.len()).find(|&i| chars[i] == ':').map_or(end, |i| i + 2);
        let mut names = Vec::new();
        first_names(&chars, colons, &mut names);
        for (at, name) in names {
            let allowed = name == module
                || name == "testing"
                || EXCEPTIONS.contains(&(module.as_str(), name.as_str()))
                || own == LEVELS.len() - 1 && name != "*"
                || level(&name).is_some_and(|other| other < own);
            if !allowed {
                report(at, format!("`{module}` must not import `crate::{name}`"));
            }
        }
    }
    // A way around: `super` up to the root of the crate.
    let depth = file.components().count();
    let is_root_of_module = depth == 1 || depth == 2 && file.ends_with("mod.rs");
    for at in words(&chars, "super") {
        let starts_line = {
            let start = (0..at).rev().find(|&i| chars[i] == '\n').map_or(0, |i| i + 1);
            chars[start] == 'u' || chars[start] == 'p'
        };
        if after(at, "super::super") || (is_root_of_module && starts_line) {
            report(at, "`super` leads to the root: write `crate::`".into());
        }
    }
    found
}

/// Names and values of the constants at the top of a file. Those of an `impl`, of a trait or of a function are others.
fn constants(source: &str) -> Vec<(String, String)> {
    let (chars, text) = (without_comments(source), source.chars().collect::<Vec<_>>());
    let starts =
        ["const", "static"].map(|keyword| words(&chars, keyword).into_iter().map(move |at| (at, at + keyword.len())));
    let mut depths = Vec::new();
    let mut depth = 0;
    for c in &chars {
        depth += i32::from("{[(".contains(*c)) - i32::from("}])".contains(*c));
        depths.push(depth);
    }
    let find = |from: usize, what: char| (from..chars.len()).find(|&i| chars[i] == what && depths[i] == 0);
    let constant = |(before, at): (usize, usize)| {
        let name: String = chars[at..].iter().skip_while(|c| c.is_whitespace()).take_while(|c| is_word(**c)).collect();
        let before = chars[..before].iter().rev().find(|c| !c.is_whitespace());
        // Not a parameter.
        let is_item = depths[at] == 0 && !matches!(before, Some('<' | ','));
        let is_constant = is_item && name.chars().all(|c| !c.is_lowercase()) && name != "_";
        let start = find(at, '=').filter(|_| is_constant)? + 1;
        let value = text[start..find(start, ';')?].iter().filter(|c| !c.is_whitespace()).collect();
        Some((name, value))
    };
    starts.into_iter().flatten().filter_map(constant).collect()
}

/// The names of constants with several values, with these values and their files.
fn ambiguous_constants(files: &[(String, String)]) -> Vec<String> {
    let mut values: BTreeMap<String, BTreeMap<String, &str>> = BTreeMap::new();
    for (file, source) in files {
        for (name, value) in constants(source) {
            values.entry(name).or_default().entry(value).or_insert(file);
        }
    }
    let several = values.into_iter().filter(|(_, values)| values.len() > 1);
    several.map(|(name, values)| format!("`{name}`: {values:?}")).collect()
}

/// All source files but unit tests, which may look at everything.
pub(crate) fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the folder can be read") {
        let path = entry.expect("the entry can be read").path();
        if path.file_stem().is_some_and(|stem| stem == "tests") {
            continue;
        }
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn modules_import_only_what_lies_below_them() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    files(&root, &mut paths);
    assert!(paths.len() > 40, "{} files", paths.len());
    let check = |path: &PathBuf| {
        let source = fs::read_to_string(path).expect("the file can be read");
        violations(path.strip_prefix(&root).expect("the file is below the root"), &source)
    };
    let found: Vec<_> = paths.iter().flat_map(check).collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn imports_from_above_and_from_siblings_are_found() {
    let source = "//! use crate::sampler;\nuse core::fmt;\nuse crate::env::View;\nuse crate::{\n    math,\n    \
                  warp::{self, pick},\n    tlas::{node::Node},\n};\nconst S: &str = \"crate::light\";\nfn f() { \
                  crate :: light::g(); }\n";
    let found = violations(Path::new("blas/node.rs"), source);
    let expected = [
        "blas/node.rs:3: `blas` must not import `crate::env`",
        "blas/node.rs:7: `blas` must not import `crate::tlas`",
        "blas/node.rs:10: `blas` must not import `crate::light`",
    ];
    assert_eq!(found, expected);
    let count = |file: &str, source: &str| violations(Path::new(file), source).len();
    assert_eq!(count("light/mod.rs", source), 0);
    assert_eq!(count("lib.rs", source), 0);
    assert_eq!(count("record/a.rs", "pub(crate) use crate::error::Error;"), 0);
    assert_eq!(count("record/a.rs", "use crate::warp::pick;"), 1);
    assert_eq!(count("geometry/a.rs", "use crate::math;"), 0);
    assert_eq!(count("math.rs", "use crate::geometry;"), 1);
    assert_eq!(count("blas/a.rs", "use crate::*;"), 1);
    assert_eq!(count("blas/a.rs", "use crate::{*};"), 1);
    assert_eq!(count("blas/a.rs", "use crate::Error;"), 1);
    assert_eq!(count("blas/a.rs", "use crate as other;"), 1);
    assert_eq!(count("blas/a.rs", "use super::super::tlas;"), 1);
    assert_eq!(count("blas/mod.rs", "use super::tlas;"), 1);
    assert_eq!(count("blas/a.rs", "use super::node;"), 0);
    assert_eq!(count("blas/walk/mod.rs", "use super::node;"), 0);
    assert_eq!(count("blas/walk/mod.rs", "use super::super::tlas;"), 1);
    assert_eq!(count("buffers.rs", "use crate::error::Error;"), 0);
    assert_eq!(count("buffers.rs", "use crate::math;"), 1);
    assert_eq!(count("stray.rs", ""), 1);
}

#[test]
fn names_of_constants_stand_for_one_value() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    files(&root, &mut paths);
    let read = |path: &PathBuf| (path.display().to_string(), fs::read_to_string(path).expect("the file can be read"));
    let files: Vec<_> = paths.iter().map(read).collect();
    let count: usize = files.iter().map(|(_, source)| constants(source).len()).sum();
    assert!(count > 200, "only {count} constants are found");
    let found = ambiguous_constants(&files);
    assert!(found.is_empty(), "give each value a name of its own:\n{}", found.join("\n"));
}

#[test]
fn constants_of_several_values_are_found() {
    let file = |name: &str, source: &str| (name.to_owned(), source.to_owned());
    let first = "const A: [u8; 2] = [1, 2];\npub(crate) static B: &str = \"a\";\nconst _: () = ();\nconst C: u8 = 1;\n\
                 impl<const A: u8> T {\n    const VERSION: u32 = 1;\n}\nconst fn f() -> u8 { 0 }";
    let second =
        "// const C: u8 = 2;\nconst A: [u8;2] = [1,\n 2];\nconst B: &str = \"b\";\nimpl T { const VERSION: u32 = 2; }";
    let found = ambiguous_constants(&[file("x.rs", first), file("y.rs", second)]);
    assert_eq!(found, ["`B`: {\"\\\"a\\\"\": \"x.rs\", \"\\\"b\\\"\": \"y.rs\"}"]);
}
