//! What the documentation calls by name is in the code, and doc comments begin with what they describe.

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::layering::{files, is_word, without_comments};

/// Names that no file here defines or uses, each with the reason why a page has it.
const FOREIGN: [(&str, &str); 3] = [
    ("light_tree_importance", "a function of Cycles, which docs/LIGHTS.md quotes"),
    ("PolymorphicLightType", "a type of the samples of RTXDI, which docs/LIGHTS.md quotes"),
    ("MixedLightingExample", "a public scene in docs/FIELD.md"),
];

/// Pages that are read.
const PAGES: [&str; 16] = [
    "README.md",
    "CHANGELOG.md",
    "docs/ACCURACY.md",
    "docs/ARCHITECTURE.md",
    "docs/BUFFERS.md",
    "docs/CONSTANTS.md",
    "docs/FIELD.md",
    "docs/FIRST_HOUR.md",
    "docs/HOST.md",
    "docs/INTEGRATION.md",
    "docs/LIGHTS.md",
    "docs/NOTATION.md",
    "docs/SPEED.md",
    "docs/STABILITY.md",
    "docs/VISIBILITY.md",
    "docs/gallery/README.md",
];

/// Endings of the names of files.
const ENDINGS: [&str; 8] = [".rs", ".txt", ".md", ".log", ".exr", ".hdr", ".glb", ".gltf"];

/// How a doc comment must not begin: as the second half of a sentence that is in another place.
const HALVES: [&str; 5] = ["The same", "Of", "See", "Or", "And"];

/// How names of extensions of glTF begin, which the code has as texts alone.
const EXTENSIONS: [&str; 2] = ["KHR_", "EXT_"];

/// Folders whose Rust files define names.
const CODE: [&str; 4] = ["src", "tests", "benches", "examples"];

/// All words of a text.
fn words(text: &[char]) -> impl Iterator<Item = String> {
    text.split(|c| !is_word(*c)).filter(|word| !word.is_empty()).map(|word| word.iter().collect())
}

/// Whether a word is in capitals, as constants and variables of the environment are.
fn is_in_capitals(word: &str) -> bool {
    let is_capital = |c: char| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_';
    word.len() > 1 && word.starts_with(|c: char| c.is_ascii_uppercase()) && word.chars().all(is_capital)
}

/// Whether a word is written as only a name in code is: `snake_case`, `CamelCase`, `SCREAMING_CASE` or `CAPITALS`.
fn is_name(word: &str) -> bool {
    let starts_well = word.starts_with(|c: char| c.is_ascii_alphabetic());
    let has_inner = |is: fn(char) -> bool| word.chars().skip(1).any(is);
    let is_camel = word.starts_with(|c: char| c.is_ascii_uppercase()) && has_inner(|c| c.is_ascii_lowercase());
    let is_split = word.trim_matches('_').contains('_') && word.is_ascii();
    let is_extension = EXTENSIONS.iter().any(|prefix| word.starts_with(prefix));
    starts_well && !is_extension && (is_camel || is_split || is_in_capitals(word))
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
            // `NAME=value` sets a variable of the environment.
            let parts = span.split_whitespace().map(|part| match part.split_once('=') {
                Some((name, _)) if is_in_capitals(name) => name,
                _ => part,
            });
            for part in parts.filter(|part| !part.contains(['/', '-', '=', '"']) && !part.starts_with('.')) {
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
                    let is_file = ENDINGS.iter().any(|ending| part.ends_with(ending));
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

/// Every Rust file in a folder.
fn all_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the folder can be read") {
        let path = entry.expect("the entry can be read").path();
        if path.is_dir() {
            all_files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// Every Rust file that is somebody's own, without this one.
fn code(root: &Path) -> Vec<PathBuf> {
    let mut paths = Vec::new();
    CODE.iter().for_each(|folder| all_files(&root.join(folder), &mut paths));
    let is_built = |path: &Path| path.strip_prefix(root).is_ok_and(|path| path.iter().any(|part| part == "target"));
    paths.retain(|path| !path.ends_with("suite/docs.rs") && !is_built(path));
    paths
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).expect("the file can be read")
}

/// Words of a source that are not in its comments. Words in texts count only in capitals: variables of the environment,
/// and what messages and formats call by such names.
fn known_words(source: &str) -> Vec<String> {
    let in_texts = source.lines().filter_map(|line| line.split("//").next());
    let in_texts = in_texts.flat_map(|line| words(&line.chars().collect::<Vec<_>>()).collect::<Vec<_>>());
    words(&without_comments(source)).chain(in_texts.filter(|word| is_in_capitals(word))).collect()
}

/// Panics with the names on the pages that are unknown.
fn assert_known(pages: &[&str], is_checked: fn(&str) -> bool, known: &HashSet<String>, least: usize) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (mut unknown, mut count) = (Vec::new(), 0);
    for page in pages {
        for (line, word) in names(&read(&root.join(page))).into_iter().filter(|(_, word)| is_checked(word)) {
            count += 1;
            if !known.contains(&word) {
                unknown.push(format!("{page}:{line}: `{word}`"));
            }
        }
    }
    assert!(count > least, "only {count} names are found");
    assert!(unknown.is_empty(), "no such names in the code:\n{}", unknown.join("\n"));
}

#[test]
fn names_in_the_documentation_exist() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut known: HashSet<String> = code(root).iter().flat_map(|path| known_words(&read(path))).collect();
    for (name, reason) in FOREIGN {
        assert!(known.insert(name.to_owned()), "`{name}` is in the code, and need not be listed as {reason}");
    }
    assert_known(&PAGES, |_| true, &known, 1000);
}

#[test]
fn the_page_of_the_constants_names_constants() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut constants = HashSet::new();
    for path in code(root) {
        let words: Vec<String> = words(&without_comments(&read(&path))).collect();
        constants.extend(words.windows(2).filter(|pair| pair[0] == "const").map(|pair| pair[1].clone()));
    }
    assert_known(&["docs/CONSTANTS.md"], is_in_capitals, &constants, 50);
}

/// The first line of each doc comment, with its number.
fn first_doc_lines(source: &str) -> Vec<(usize, &str)> {
    let mut is_inside = false;
    let mut found = Vec::new();
    for (number, line) in (1..).zip(source.lines()) {
        let line = line.trim_start();
        let doc = line.strip_prefix("///").or_else(|| line.strip_prefix("//!"));
        if let (Some(doc), false) = (doc, is_inside) {
            found.push((number, doc.trim_start()));
        }
        is_inside = doc.is_some();
    }
    found
}

/// Whether a text begins with one of the [`HALVES`].
fn is_half(text: &str) -> bool {
    let rest = HALVES.iter().find_map(|half| text.strip_prefix(half));
    rest.is_some_and(|rest| !rest.starts_with(is_word))
}

#[test]
fn doc_comments_begin_with_what_they_describe() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (mut halves, mut count) = (Vec::new(), 0);
    for path in &code(root) {
        for (line, text) in first_doc_lines(&read(path)) {
            count += 1;
            if is_half(text) {
                halves.push(format!("{}:{line}: {text}", path.display()));
            }
        }
    }
    assert!(count > 3000, "only {count} doc comments are found");
    assert!(halves.is_empty(), "only half of a sentence:\n{}", halves.join("\n"));
}

/// Every section of the bytes is described.
#[test]
fn the_page_of_the_buffers_names_all_sections() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths = Vec::new();
    files(&root.join("src"), &mut paths);
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
                `at(&x)` `None` `BOX_SIZE` `plain` `SIZE` `N` `TIER=full cargo` `KHR_lights` `file.glb`";
    let found: Vec<String> = names(text).into_iter().map(|(line, word)| format!("{line} {word}")).collect();
    assert_eq!(found, ["1 Mesh", "1 portal", "1 pdf", "5 at", "5 None", "5 BOX_SIZE", "5 SIZE", "5 TIER"]);
}

#[test]
fn halves_of_sentences_are_found() {
    let source = "//! Of one.\n//!\n/// Offers.\nfn f() {}\n    /// The same.\n    /// See.\n/// Orders.\n\n/// Or\n";
    let found: Vec<usize> =
        first_doc_lines(source).into_iter().filter(|(_, text)| is_half(text)).map(|(line, _)| line).collect();
    assert_eq!(found, [1, 5, 9]);
}
