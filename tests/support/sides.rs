//! Whether left or right stands first, wherever a source has names for both.

use syn::visit::{self, Visit};

/// Neighbours in one source that name the same thing on either side: fields, variants, arguments, and the names of a pattern or an
/// array.
#[derive(Default)]
pub struct Sides {
    /// How often left stands first.
    pub left_first: usize,
    /// Both names of each pair in which right stands first.
    pub right_first: Vec<String>,
}

impl Sides {
    /// The pairs of a source.
    pub fn of(source: &syn::File) -> Self {
        let mut sides = Self::default();
        sides.visit_file(source);
        sides
    }

    /// Looks at names in a row; a neighbour without a name is an empty string.
    fn row(&mut self, names: impl Iterator<Item = String>) {
        let names: Vec<String> = names.collect();
        for pair in names.windows(2) {
            if is_other_side(&pair[1], &pair[0]) {
                self.right_first.push(pair.join(", "));
            }
            self.left_first += usize::from(is_other_side(&pair[0], &pair[1]));
        }
    }
}

/// Whether `left` and `right` name the same thing on either side.
fn is_other_side(left: &str, right: &str) -> bool {
    let (left, right) = (left.to_lowercase(), right.to_lowercase());
    let words = right.contains("right") && right.replace("right", "left") == left;
    let letters = right.strip_suffix("_r").zip(left.strip_suffix("_l"));
    words || letters.is_some_and(|(right, left)| right == left)
}

fn of_pattern(pattern: &syn::Pat) -> String {
    match pattern {
        syn::Pat::Ident(name) => name.ident.to_string(),
        syn::Pat::Type(typed) => of_pattern(&typed.pat),
        _ => String::new(),
    }
}

fn of_expression(expression: &syn::Expr) -> String {
    match expression {
        syn::Expr::Path(path) => path
            .path
            .segments
            .last()
            .map_or_else(String::new, |last| last.ident.to_string()),
        syn::Expr::Field(field) => match &field.member {
            syn::Member::Named(name) => name.to_string(),
            syn::Member::Unnamed(_) => String::new(),
        },
        syn::Expr::Reference(reference) => of_expression(&reference.expr),
        _ => String::new(),
    }
}

impl<'a> Visit<'a> for Sides {
    fn visit_fields_named(&mut self, fields: &'a syn::FieldsNamed) {
        self.row(
            fields
                .named
                .iter()
                .filter_map(|field| field.ident.as_ref())
                .map(ToString::to_string),
        );
        visit::visit_fields_named(self, fields);
    }

    fn visit_item_enum(&mut self, item: &'a syn::ItemEnum) {
        self.row(item.variants.iter().map(|variant| variant.ident.to_string()));
        visit::visit_item_enum(self, item);
    }

    fn visit_signature(&mut self, signature: &'a syn::Signature) {
        self.row(signature.inputs.iter().map(|input| match input {
            syn::FnArg::Typed(typed) => of_pattern(&typed.pat),
            syn::FnArg::Receiver(_) => String::new(),
        }));
        visit::visit_signature(self, signature);
    }

    fn visit_pat_slice(&mut self, pattern: &'a syn::PatSlice) {
        self.row(pattern.elems.iter().map(of_pattern));
        visit::visit_pat_slice(self, pattern);
    }

    fn visit_pat_tuple(&mut self, pattern: &'a syn::PatTuple) {
        self.row(pattern.elems.iter().map(of_pattern));
        visit::visit_pat_tuple(self, pattern);
    }

    fn visit_expr_array(&mut self, array: &'a syn::ExprArray) {
        self.row(array.elems.iter().map(of_expression));
        visit::visit_expr_array(self, array);
    }

    fn visit_expr_struct(&mut self, made: &'a syn::ExprStruct) {
        self.row(made.fields.iter().map(|field| match &field.member {
            syn::Member::Named(name) => name.to_string(),
            syn::Member::Unnamed(_) => String::new(),
        }));
        visit::visit_expr_struct(self, made);
    }
}

/// The places of a text, of comments, strings, pages or TOML, in which right stands first: "right and left", or the key `right` in
/// front of the key `left` of the same table. Each is given as the words from one side to the other.
pub fn right_first_in_text(text: &str) -> Vec<String> {
    const BETWEEN: [&[&str]; 7] = [
        &["and"],
        &["or"],
        &["and", "the"],
        &["or", "the"],
        &[","],
        &["/"],
        &["then"],
    ];
    let words = words(text);
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let mut found = Vec::new();
    for (at, _) in words.iter().enumerate().filter(|(_, word)| **word == "right") {
        let rest = &words[at + 1..];
        let phrase = BETWEEN
            .iter()
            .any(|between| rest.starts_with(between) && rest.get(between.len()) == Some(&"left"));
        if phrase || next_key(rest) == Some("left") {
            found.push(words[at..words.len().min(at + 8)].join(" "));
        }
    }
    found
}

/// If the words in front of `rest` are a key of TOML: the key that follows its value in the same table.
fn next_key<'a>(rest: &[&'a str]) -> Option<&'a str> {
    if *rest.first()? != "=" {
        return None;
    }
    let mut depth = 0_i32;
    for (at, word) in rest.iter().enumerate().skip(1) {
        match *word {
            "{" => depth += 1,
            "}" => depth -= 1,
            // The end of a statement, or of the text in quotes.
            ";" | "\"" => return None,
            // The head of another table.
            "[" if !["=", ",", "["].contains(&rest[at - 1]) => return None,
            _ => {}
        }
        let is_key = word.starts_with(|c: char| c.is_ascii_alphabetic()) && rest.get(at + 1) == Some(&"=");
        if depth < 0 || (depth == 0 && is_key) {
            return (depth == 0).then_some(word);
        }
    }
    None
}

/// The words of a text in small letters, and its punctuation except the marks of comments; `\n` in a string is a blank.
fn words(text: &str) -> Vec<String> {
    let text = text
        .replace("\\n", " ")
        .replace("///", " ")
        .replace("//!", " ")
        .replace("//", " ")
        .to_lowercase();
    let mut words: Vec<String> = Vec::new();
    let mut open = false;
    for letter in text.chars() {
        let in_word = letter.is_alphanumeric() || letter == '_' || letter == '-';
        match words.last_mut() {
            Some(word) if in_word && open => word.push(letter),
            _ if !letter.is_whitespace() && letter != '\\' => words.push(letter.to_string()),
            _ => {}
        }
        open = in_word;
    }
    words
}
