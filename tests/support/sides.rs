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
