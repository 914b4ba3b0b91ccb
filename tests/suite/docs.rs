//! What the documentation calls by name is in the code.

use std::collections::HashSet;
use std::fs;
use std::path::Path;

use crate::layering::{files, is_word, without_comments};

/// Names of other programs, of the language and of tools, which no file here defines or uses.
const FOREIGN: [&str; 0] = [];

/// How names of extensions of glTF begin, which the code has as texts alone.
const EXTENSIONS: [&str; 2] = ["KHR_", "EXT_"];

/// Folders whose Rust files define names.
const CODE: [&str; 4] = ["src", "tests", "benches", "examples"];

/// All words of a text.
fn words(text: &[char]) -> impl Iterator<Item = String> {
    text.split(|c| !is_word(*c)).filter(|word| !word.is_empty()).map(|word| word.iter().collect())
}

/// Whether a word is written as only a name in code is: `snake_case`, `CamelCase` or `SCREAMING_CASE`.
fn is_name(word: &str) -> bool {
    let starts_well = word.starts_with(|c: char| c.is_ascii_alphabetic());
    let has_inner = |is: fn(char) -> bool| word.chars().skip(1).any(is);
    let is_camel = word.starts_with(|c: char| c.is_ascii_uppercase()) && has_inner(|c| c.is_ascii_lowercase());
    let is_split = word.trim_matches('_').contains('_') && word.is_ascii();
    let is_extension = EXTENSIONS.iter().any(|prefix| word.starts_with(prefix));
    starts_well && !is_extension && (is_camel || is_split)
}

/// Names in the code spans of a text in Markdown, each with its line. What is a path, the ending of one, an option or a
/// name with hyphens is none. Blocks of code are left to the compiler.
fn names(text: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    let mut is_block = false;
    for (number, line) in (1..).zip(text.lines()) {
        if line.trim_start().starts_with("```") {
            is_block = !is_block;
        }
        if is_block {
            continue;
        }
        for span in line.split('`').skip(1).step_by(2) {
            for part in
                span.split_whitespace().filter(|part| !part.contains(['/', '-', '=', '"']) && !part.starts_with('.'))
            {
                let chars: Vec<char> = part.chars().collect();
                let mut i = 0;
                while i < chars.len() {
                    let end = (i..chars.len()).find(|&j| !is_word(chars[j])).unwrap_or(chars.len());
                    let word: String = chars[i..end].iter().collect();
                    let has =
                        |at: Option<&[char]>, what: &str| at.is_some_and(|c| c.iter().collect::<String>() == what);
                    let is_path = has(chars.get(end..end + 2), "::") || i > 1 && has(chars.get(i - 2..i), "::");
                    let is_call = chars.get(end) == Some(&'(') || i > 0 && chars[i - 1] == '.' && !word.is_empty();
                    let is_plain = word.starts_with(|c: char| c.is_ascii_alphabetic()) && word.is_ascii();
                    let is_file = part.ends_with(".rs") || part.ends_with(".txt") || part.ends_with(".exr");
                    if !is_file && is_plain && word.len() > 1 && (is_name(&word) || is_path || is_call) {
                        found.push((number, word));
                    }
                    i = end.max(i) + 1;
                }
            }
        }
    }
    found
}

#[test]
fn names_in_the_documentation_exist() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths = Vec::new();
    CODE.iter().for_each(|folder| files(&root.join(folder), &mut paths));
    let is_mine = |path: &&std::path::PathBuf| !path.ends_with("suite/docs.rs");
    let read = |path: &Path| fs::read_to_string(path).expect("the file can be read");
    let mut known: HashSet<String> = paths
        .iter()
        .filter(is_mine)
        .flat_map(|path| words(&without_comments(&read(path))).collect::<Vec<_>>())
        .collect();
    known.extend(FOREIGN.map(str::to_owned));
    let texts = ["README.md", "docs/ACCURACY.md", "docs/ARCHITECTURE.md", "docs/INTEGRATION.md", "docs/NOTATION.md"];
    let more = [
        "docs/BUFFERS.md",
        "docs/FIRST_HOUR.md",
        "docs/VISIBILITY.md",
        "docs/SPEED.md",
        "docs/STABILITY.md",
        "docs/gallery/README.md",
    ];
    let (mut unknown, mut count) = (Vec::new(), 0);
    for name in texts.into_iter().chain(more) {
        for (line, word) in names(&read(&root.join(name))) {
            count += 1;
            if !known.contains(&word) {
                unknown.push(format!("{name}:{line}: `{word}`"));
            }
        }
    }
    assert!(count > 200, "only {count} names are found");
    assert!(unknown.is_empty(), "no such names in the code:\n{}", unknown.join("\n"));
}

/// Every section of the bytes is described.
#[test]
fn the_page_of_the_buffers_names_all_sections() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths = Vec::new();
    files(&root.join("src"), &mut paths);
    let read = |path: &Path| fs::read_to_string(path).expect("the file can be read");
    let page = read(&root.join("docs/BUFFERS.md"));
    let (mut missing, mut count) = (Vec::new(), 0);
    // The format's own tests have a section too.
    for path in paths.iter().filter(|path| !path.ends_with("src/buffers.rs")) {
        let text = read(path);
        for rest in text.split("b\"").skip(1) {
            let tag = rest.split('"').next().unwrap_or("");
            if tag.len() == 4 && tag.bytes().all(|c| c.is_ascii_uppercase()) {
                count += 1;
                if !page.contains(&format!("| `{tag}` |")) {
                    missing.push(format!("{}: {tag}", path.display()));
                }
            }
        }
    }
    assert!(count > 20, "only {count} sections are found");
    assert!(missing.is_empty(), "not in docs/BUFFERS.md:\n{}", missing.join("\n"));
}

#[test]
fn names_are_told_from_other_words() {
    let text = "`Mesh::portal` and `sample.pdf`, `u`, `cargo test`, `a-b_c`, `src/lib_rs`\n```\n`not_this`\n```\n\
                `at(&x)` `None` `BOX_SIZE` `plain`";
    let found: Vec<String> = names(text).into_iter().map(|(line, word)| format!("{line} {word}")).collect();
    assert_eq!(found, ["1 Mesh", "1 portal", "1 pdf", "5 at", "5 None", "5 BOX_SIZE"]);
}
