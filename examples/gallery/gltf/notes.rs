//! What a user should know of a file: what was ignored, and what became of the rest.

use std::collections::HashMap;

/// Most uses that a note names.
const NAMED: usize = 3;

/// Notes in the order in which they came up. Notes of the same text become one that names all of its uses.
#[derive(Default)]
pub(crate) struct Notes {
    texts: Vec<String>,
    uses: HashMap<String, Vec<String>>,
}

impl Notes {
    /// Adds a note that stands for itself.
    pub(super) fn add(&mut self, text: String) {
        if !self.texts.contains(&text) {
            self.texts.push(text);
        }
    }

    /// Adds a note about something, such as a mesh or a material.
    pub(super) fn about(&mut self, user: &str, text: &str) {
        let users = self.uses.entry(text.to_owned()).or_default();
        if users.is_empty() {
            self.texts.push(text.to_owned());
        }
        if users.last().is_none_or(|last| last != user) {
            users.push(user.to_owned());
        }
    }

    /// All notes, a line each.
    pub(super) fn lines(&self) -> Vec<String> {
        let line = |text: &String| match self.uses.get(text) {
            Some(users) => format!("{}: {text}", listed(users)),
            None => text.clone(),
        };
        self.texts.iter().map(line).collect()
    }
}

/// The first of some names, and how many more there are.
pub(super) fn listed(names: &[String]) -> String {
    let named = names.iter().take(NAMED).map(String::as_str).collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(NAMED) {
        0 => named,
        more => format!("{named} and {more} more"),
    }
}
