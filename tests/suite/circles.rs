//! No circle of files: what a file imports is defined in files that do not import from it, however far around.
//!
//! The source is read as in [`layering`](crate::layering), without a parser. A path in a `use` or in an expression
//! leads to the file that defines the item, through all `use` of the modules in between. What a method call or an
//! `impl` leads to does not count, nor do unit tests and imports for the documentation.
//!
//! A file with a folder of its own (`light/mod.rs`) may use the files in that folder, which may use what it defines:
//! such a file is the face of its folder, and the type that all files below it are about is often there.

extern crate alloc;

use alloc::collections::{BTreeMap, BTreeSet};
use std::collections::HashMap;
use std::fs;
use std::path::Path;

use crate::layering::{files, is_word, without_comments};

/// A path of names, as written.
type Names = Vec<String>;

/// What one file of `src` holds, as far as paths go.
#[derive(Default)]
struct Source {
    /// Names of the items at the top of the file.
    items: BTreeSet<String>,
    /// Names of the modules that have files of their own.
    modules: BTreeSet<String>,
    /// Words in calls of macros at the top of the file, which may define items.
    generated: BTreeSet<String>,
    /// Names that `use` brings into the file, with the path they stand for.
    imports: HashMap<String, Names>,
    /// All paths, those of `use` among them.
    paths: Vec<Names>,
}

/// All files by the path of their module; that of `lib.rs` is empty.
type Sources = BTreeMap<Names, Source>;

/// Words, `::`, and every other character on its own.
fn tokens(source: &str) -> Names {
    let chars = without_comments(source);
    let mut found = Vec::new();
    let mut i = 0;
    while i < chars.len() {
        let end = match chars[i] {
            c if is_word(c) => (i..chars.len()).find(|&j| !is_word(chars[j])).unwrap_or(chars.len()),
            ':' if chars.get(i + 1) == Some(&':') => i + 2,
            _ => i + 1,
        };
        if !chars[i].is_whitespace() {
            found.push(chars[i..end].iter().collect());
        }
        i = end;
    }
    found
}

fn is_name(token: &str) -> bool {
    token.starts_with(is_word)
}

/// The place after the bracket that closes the one at `open`.
fn after_bracket(tokens: &[String], open: usize) -> usize {
    let mut depth = 0;
    for (i, token) in tokens.iter().enumerate().skip(open) {
        match token.as_str() {
            "{" | "(" | "[" => depth += 1,
            "}" | ")" | "]" => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return i + 1;
        }
    }
    tokens.len()
}

/// Takes out the items that are for tests or for the documentation alone.
fn without_hidden(tokens: &[String]) -> Names {
    let mut kept = Vec::new();
    let mut i = 0;
    while i < tokens.len() {
        if tokens[i] != "#" || tokens.get(i + 1).is_none_or(|token| token != "[") {
            kept.push(tokens[i].clone());
            i += 1;
            continue;
        }
        let end = after_bracket(tokens, i + 1);
        let attribute = &tokens[i + 2..end];
        let has = |word: &str| attribute.iter().any(|token| token == word);
        i = end;
        if attribute[0] != "cfg" || has("not") || !(has("test") || has("doc") || has("doctest")) {
            continue;
        }
        // The item ends with a semicolon, or with its braces.
        let is_import =
            tokens[i..].iter().take_while(|token| *token != ";" && *token != "{").any(|token| token == "use");
        while tokens[i] != ";" {
            let is_open = ["{", "(", "["].contains(&tokens[i].as_str());
            let is_body = tokens[i] == "{" && !is_import;
            i = if is_open { after_bracket(tokens, i) - 1 } else { i };
            if is_body {
                break;
            }
            i += 1;
        }
        i += 1;
    }
    kept
}

/// Adds the paths of a `use` from the place `at` on, each with the name that it brings. Returns the place after them.
fn import(tokens: &[String], mut at: usize, mut path: Names, found: &mut Vec<(String, Names)>) -> usize {
    loop {
        match tokens[at].as_str() {
            "::" => at += 1,
            "{" => {
                at += 1;
                while tokens[at] != "}" {
                    at = import(tokens, at, path.clone(), found);
                    at += usize::from(tokens[at] == ",");
                }
                return at + 1;
            }
            // `module::{self}`
            "self" if !path.is_empty() => at += 1,
            name if name != "as" && (name == "*" || is_name(name)) => {
                path.push(name.into());
                at += 1;
            }
            other => {
                let is_renamed = other == "as";
                let name = if is_renamed { &tokens[at + 1] } else { &path[path.len() - 1] };
                found.push((name.clone(), path.clone()));
                return at + if is_renamed { 2 } else { 0 };
            }
        }
    }
}

/// Reads one file.
fn read(source: &str) -> Source {
    let tokens = without_hidden(&tokens(source));
    let mut read = Source::default();
    let (mut i, mut depth) = (0, 0);
    let is = |at: usize, what: &str| tokens.get(at).is_some_and(|token| token == what);
    while i < tokens.len() {
        let mut next = i + 1;
        match tokens[i].as_str() {
            "{" => depth += 1,
            "}" => depth -= 1,
            "use" if !is(i + 1, "<") => {
                let mut found = Vec::new();
                next = import(&tokens, i + 1, Vec::new(), &mut found);
                for (name, path) in found {
                    read.paths.push(path.clone());
                    if depth == 0 {
                        read.imports.insert(name, path);
                    }
                }
            }
            "fn" | "struct" | "enum" | "union" | "trait" | "type" | "const" | "static" if depth == 0 => {
                read.items.insert(tokens[i + 1].clone());
            }
            "mod" if is(i + 2, ";") => {
                read.modules.insert(tokens[i + 1].clone());
            }
            "macro_rules" => {
                read.items.insert(tokens[i + 2].clone());
            }
            // A call of a macro that defines items, not the definition of one.
            "!" if depth == 0 && is(i + 1, "{") => {
                read.generated.extend(tokens[i + 1..after_bracket(&tokens, i + 1)].iter().cloned());
            }
            word if is_name(word) && is(i + 1, "::") => {
                let mut path = vec![word.into()];
                while is(next, "::") && tokens.get(next + 1).is_some_and(|token| is_name(token)) {
                    path.push(tokens[next + 1].clone());
                    next += 2;
                }
                read.paths.push(path);
            }
            _ => {}
        }
        i = next;
    }
    read
}

/// The module that a path from `module` leads to: the file that defines the item. `None` for other crates, and for what
/// stops at a module.
fn resolve(sources: &Sources, module: &[String], path: &[String]) -> Result<Option<Names>, String> {
    let mut at = module.to_vec();
    for (i, name) in path.iter().enumerate() {
        let is_last = i + 1 == path.len();
        let source = &sources[&at];
        let child: Names = at.iter().cloned().chain([name.clone()]).collect();
        match name.as_str() {
            "crate" => at.clear(),
            "self" => {}
            "super" => {
                at.pop();
            }
            _ if !is_last && sources.contains_key(&child) => at = child,
            _ if source.items.contains(name) => return Ok(Some(at)),
            // What stands for itself is a macro of this file.
            _ if source.imports.get(name).is_some_and(|import| import.as_slice() != core::slice::from_ref(name)) => {
                let rest = [source.imports[name].as_slice(), &path[i + 1..]].concat();
                return resolve(sources, &at, &rest);
            }
            _ if sources.contains_key(&child) => at = child,
            _ if source.generated.contains(name) => return Ok(Some(at)),
            _ if i == 0 => return Ok(None),
            _ => return Err(format!("{}: `{}` leads nowhere", name_of(module), path.join("::"))),
        }
    }
    Ok(None)
}

/// A module as messages name it.
fn name_of(module: &[String]) -> String {
    if module.is_empty() { "lib".into() } else { module.join("/") }
}

/// The files that each file imports from, with the first path that leads there.
fn graph(sources: &Sources) -> Result<BTreeMap<Names, BTreeMap<Names, String>>, String> {
    let mut graph = BTreeMap::new();
    for (module, source) in sources {
        let edges: &mut BTreeMap<_, _> = graph.entry(module.clone()).or_default();
        for path in &source.paths {
            if let Some(other) = resolve(sources, module, path)?.filter(|other| !other.starts_with(module)) {
                edges.entry(other).or_insert_with(|| path.join("::"));
            }
        }
    }
    Ok(graph)
}

/// All circles, each as one message that names its files and the paths between them.
fn circles(sources: &Sources) -> Result<Vec<String>, String> {
    let graph = graph(sources)?;
    let reached = |from: &Names| {
        let mut reached = BTreeSet::new();
        let mut open: Vec<_> = graph[from].keys().collect();
        while let Some(module) = open.pop() {
            if reached.insert(module) {
                open.extend(graph[module].keys());
            }
        }
        reached
    };
    let reached: BTreeMap<_, _> = graph.keys().map(|module| (module, reached(module))).collect();
    let mut seen = BTreeSet::new();
    let mut found = Vec::new();
    for module in graph.keys().filter(|module| reached[*module].contains(module)) {
        let circle: BTreeSet<_> =
            reached[module].iter().copied().filter(|other| reached[*other].contains(module)).collect();
        if !seen.insert(circle.clone()) {
            continue;
        }
        let mut lines = vec!["circle:".to_owned()];
        for from in &circle {
            for (to, path) in graph[*from].iter().filter(|(to, _)| circle.contains(to)) {
                lines.push(format!("    {} -> {}: `{path}`", name_of(from), name_of(to)));
            }
        }
        found.push(lines.join("\n"));
    }
    Ok(found)
}

/// The path of a module from that of its file below `src`.
fn module_of(file: &Path) -> Names {
    let mut names: Names = file.with_extension("").iter().map(|name| name.to_string_lossy().into()).collect();
    if names.last().is_some_and(|name| name == "mod" || name == "lib") {
        names.pop();
    }
    names
}

#[test]
fn no_files_import_from_each_other() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    files(&root, &mut paths);
    let read_file = |path: &std::path::PathBuf| {
        let source = fs::read_to_string(path).expect("the file can be read");
        (module_of(path.strip_prefix(&root).expect("the file is below the root")), read(&source))
    };
    let mut sources: Sources = paths.iter().map(read_file).collect();
    let is_hidden =
        |module: &Names| module.split_last().is_some_and(|(name, parent)| !sources[parent].modules.contains(name));
    let hidden: Vec<_> = sources.keys().filter(|module| is_hidden(module)).cloned().collect();
    hidden.iter().for_each(|module| drop(sources.remove(module)));
    let count: usize = graph(&sources).expect("all paths are understood").values().map(BTreeMap::len).sum();
    assert!(count > 500, "only {count} imports are found");
    let found = circles(&sources).expect("all paths are understood");
    assert!(found.is_empty(), "{} circles of files\n{}", found.len(), found.join("\n"));
}

#[test]
fn circles_are_found_through_other_modules() {
    let sources = |files: &[(&str, &str)]| -> Sources {
        files.iter().map(|(file, source)| (module_of(Path::new(file)), read(source))).collect()
    };
    let found = |files: &[(&str, &str)]| circles(&sources(files)).expect("all paths are understood");
    let lib = ("lib.rs", "mod a; mod b;");
    let face =
        ("a/mod.rs", "mod x; mod y; pub(crate) use x::{X, x as other};\nuse y::Y as Z;\npub(crate) struct Top(Z);");
    let x = ("a/x.rs", "use super::{Top, Z};\npub(crate) struct X;\nfn x() {}");
    let y = ("a/y.rs", "pub(crate) struct Y;");
    assert!(found(&[lib, face, x, y]).is_empty());
    let circle = "circle:\n    a/x -> a/y: `super::Z`\n    a/y -> b: `crate::b::g`\n    b -> a/x: `a::other`";
    let y = ("a/y.rs", "pub(crate) struct Y;\nfn f() { crate::b::g(); }");
    let b = ("b.rs", "use crate::{a, core};\npub(crate) fn g() { a::other(); core::fmt::f() }");
    assert_eq!(found(&[lib, face, x, y, ("b.rs", "pub(crate) fn g() {}")]).len(), 0);
    assert_eq!(found(&[("lib.rs", "mod a; mod b; use std as core;"), face, x, y, b]), [circle]);
    // Tests and comments are none.
    let b = (
        "b.rs",
        "#[cfg(test)]\nuse crate::a::X;\n// use crate::a::X;\npub(crate) fn g() {}\n#[cfg(test)] mod t { \
                      use crate::a::X; }",
    );
    assert!(found(&[lib, face, x, y, b]).is_empty());
    let error = circles(&sources(&[lib, ("a.rs", "use crate::b::Missing;"), ("b.rs", "")]));
    assert_eq!(error, Err("a: `crate::b::Missing` leads nowhere".into()));
}
