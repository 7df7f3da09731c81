//! Which names a source defines.

use std::collections::BTreeSet;

use syn::visit::{self, Visit};

/// Whether a source defines `name`: as an item, a field, a variant, a binding by `let`, or an entry of a list in a macro.
pub fn defines(source: &str, name: &str) -> bool {
    let parsed = syn::parse_file(source).unwrap_or_else(|error| panic!("{error}: {source}"));
    let mut names = Names::default();
    names.visit_file(&parsed);
    names.0.contains(name)
}

/// The names that a source defines.
#[derive(Default)]
struct Names(BTreeSet<String>);

impl Names {
    fn add(&mut self, name: &syn::Ident) {
        self.0.insert(name.to_string());
    }
}

impl<'a> Visit<'a> for Names {
    fn visit_item(&mut self, item: &'a syn::Item) {
        match item {
            syn::Item::Const(item) => self.add(&item.ident),
            syn::Item::Enum(item) => self.add(&item.ident),
            syn::Item::Static(item) => self.add(&item.ident),
            syn::Item::Struct(item) => self.add(&item.ident),
            syn::Item::Trait(item) => self.add(&item.ident),
            syn::Item::Type(item) => self.add(&item.ident),
            syn::Item::Macro(item) => {
                if let Some(name) = &item.ident {
                    self.add(name);
                }
                self.0.extend(entries(&item.mac.tokens.to_string()));
            }
            _ => {}
        }
        visit::visit_item(self, item);
    }

    /// Functions, also those of an implementation and of a trait.
    fn visit_signature(&mut self, signature: &'a syn::Signature) {
        self.add(&signature.ident);
        visit::visit_signature(self, signature);
    }

    fn visit_impl_item_const(&mut self, item: &'a syn::ImplItemConst) {
        self.add(&item.ident);
    }

    fn visit_trait_item_const(&mut self, item: &'a syn::TraitItemConst) {
        self.add(&item.ident);
    }

    fn visit_field(&mut self, field: &'a syn::Field) {
        if let Some(name) = &field.ident {
            self.add(name);
        }
    }

    fn visit_variant(&mut self, variant: &'a syn::Variant) {
        self.add(&variant.ident);
        visit::visit_variant(self, variant);
    }

    fn visit_local(&mut self, local: &'a syn::Local) {
        if let syn::Pat::Ident(name) = &local.pat {
            self.add(&name.ident);
        }
        visit::visit_local(self, local);
    }
}

/// The names of the entries in the text of a macro's tokens: names in front of `:`, `=`, `,` or `;`, and behind a keyword that defines.
fn entries(tokens: &str) -> Vec<String> {
    const KEYWORDS: [&str; 6] = ["struct", "enum", "trait", "const", "type", "fn"];
    let tokens = without_quotes(tokens);
    let words: Vec<&str> = tokens.split_whitespace().collect();
    let is_name = |word: &str| {
        word.starts_with(|c: char| c.is_ascii_alphabetic())
            && word.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    let mut found = Vec::new();
    for (at, word) in words.iter().enumerate() {
        // A mark may stand close to its name.
        let (name, close) = match word.find([':', '=', ',', ';', '(']) {
            Some(end) => word.split_at(end),
            None => (*word, ""),
        };
        let next = if close.is_empty() {
            words.get(at + 1).copied().unwrap_or("")
        } else {
            close
        };
        let listed = (next.starts_with(':') && !next.starts_with("::"))
            || (next.starts_with('=') && !next.starts_with("=>") && !next.starts_with("=="))
            || next.starts_with([',', ';']);
        let defined = at > 0 && KEYWORDS.contains(&words[at - 1]);
        if is_name(name) && (listed || defined) {
            found.push(name.to_owned());
        }
    }
    found
}

/// The text outside quotes.
fn without_quotes(tokens: &str) -> String {
    let (mut quoted, mut escaped) = (false, false);
    tokens
        .chars()
        .filter(|letter| {
            let mark = *letter == '"' && !escaped;
            escaped = quoted && *letter == '\\' && !escaped;
            quoted ^= mark;
            !quoted && !mark
        })
        .collect()
}
