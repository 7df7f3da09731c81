//! The modules of one crate, and which of them import from which.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use syn::visit::{self, Visit};
use syn::{Attribute, Item, ItemMod, ItemUse, UseTree, Visibility};

/// A module, or a name in it, by its path from the crate's root.
pub type Place = Vec<String>;

/// The file that `#[path = "..."]` gives a module.
fn path_of(attributes: &[Attribute]) -> Option<String> {
    attributes.iter().find_map(|attribute| {
        let syn::Meta::NameValue(named) = &attribute.meta else {
            return None;
        };
        match &named.value {
            syn::Expr::Lit(syn::ExprLit {
                lit: syn::Lit::Str(path),
                ..
            }) if named.path.is_ident("path") => Some(path.value()),
            _ => None,
        }
    })
}

/// One crate: what each of its modules names.
#[derive(Default)]
pub struct Crate {
    modules: BTreeMap<Place, Names>,
}

/// What one module names of its own crate.
#[derive(Default)]
struct Names {
    /// Names that a `use` imports, each with its place.
    aliases: BTreeMap<String, Place>,
    /// Other places that the module's code and its `use`s name.
    places: BTreeSet<Place>,
    /// Types that the module implements something for, by their names.
    implemented: BTreeSet<String>,
}

impl Crate {
    /// Reads the crate whose root is `file`. Tests are left out: they may look anywhere.
    pub fn read(file: &Path) -> Self {
        let mut crate_ = Self::default();
        let folder = file.parent().expect("a file stands in a folder");
        crate_.read_file(file, folder, &[]);
        crate_
    }

    /// Reads the module `place` from its file; the files of the modules in it stand in `folder`.
    fn read_file(&mut self, file: &Path, folder: &Path, place: &[String]) {
        let text = fs::read_to_string(file).expect("a source is readable");
        let parsed = syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        self.read_items(&parsed.items, folder, place);
    }

    fn read_items(&mut self, items: &[Item], folder: &Path, place: &[String]) {
        let mut reader = Reader::default();
        for item in items {
            reader.visit_item(item);
        }
        self.modules.insert(place.to_vec(), reader.names(place));
        for module in reader.modules {
            let name = module.ident.to_string();
            let below = folder.join(&name);
            let place = joined(place, &[name]);
            if let Some((_, items)) = &module.content {
                self.read_items(items, &below, &place);
            } else {
                // A `#[path]` is relative to the folder of the file that names the module: a crate's root or a `mod.rs`. The modules
                // in that module stand beside its file.
                if let Some(own) = path_of(&module.attrs).map(|path| folder.join(path)) {
                    let beside = own.parent().expect("a file stands in a folder");
                    self.read_file(&own, beside, &place);
                    continue;
                }
                let file = [below.with_extension("rs"), below.join("mod.rs")]
                    .into_iter()
                    .find(|file| file.exists())
                    .unwrap_or_else(|| panic!("{}: no file of this module", below.display()));
                self.read_file(&file, &below, &place);
            }
        }
    }

    /// The module that defines the item at `place`, through re-exports.
    fn home(&self, place: &[String]) -> Place {
        let mut module = Place::new();
        for (n, name) in place.iter().enumerate() {
            let below = joined(&module, std::slice::from_ref(name));
            if self.modules.contains_key(&below) {
                module = below;
            } else if let Some(alias) = self.modules[&module].aliases.get(name) {
                return self.home(&joined(alias, &place[n + 1..]));
            } else {
                break;
            }
        }
        module
    }

    /// The number of modules.
    pub fn modules(&self) -> usize {
        self.modules.len()
    }

    /// What modules import from a module above them that also imports from them: "module: item". A module may name a type of the
    /// module above it to implement it: a long implementation stands in several files.
    pub fn imports_from_above(&self) -> Vec<String> {
        let mut found = BTreeSet::new();
        for (from, names) in &self.modules {
            for place in names.places.iter().chain(names.aliases.values()) {
                let above = self.home(place);
                let item = place.last().filter(|_| place.len() > above.len());
                let implements = item.is_some_and(|item| names.implemented.contains(item));
                if above.len() < from.len() && from.starts_with(&above) && !implements {
                    let branch = &from[..=above.len()];
                    let upper = &self.modules[&above];
                    let mut named = upper.places.iter().chain(upper.aliases.values());
                    if named.any(|named| self.home(named).starts_with(branch)) {
                        let item = item.map_or("*", |item| item.as_str());
                        found.insert(format!("{}: {}::{item}", from.join("::"), above.join("::")));
                    }
                }
            }
        }
        found.into_iter().collect()
    }

    /// Which modules import from which neighbours in the same folder. The modules below a module count as part of it.
    pub fn imports(&self) -> BTreeMap<Place, BTreeSet<Place>> {
        let mut imports: BTreeMap<Place, BTreeSet<Place>> = BTreeMap::new();
        for (from, names) in &self.modules {
            for place in names.places.iter().chain(names.aliases.values()) {
                let to = self.home(place);
                let shared = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
                if from.len() > shared && to.len() > shared {
                    let neighbours = imports.entry(from[..=shared].to_vec()).or_default();
                    neighbours.insert(to[..=shared].to_vec());
                }
            }
        }
        imports
    }

    /// Returns circles of imports. Each starts and ends at the same module, and every module that lies on a
    /// circle appears in the result.
    pub fn circles(&self) -> Vec<Vec<Place>> {
        let imports = self.imports();
        let mut circles: Vec<Vec<Place>> = Vec::new();
        for start in imports.keys() {
            if circles.iter().any(|circle| circle.contains(start)) {
                continue;
            }
            // The shortest way back to `start`: modules in order of distance, each with its predecessor.
            let mut before: Vec<(&Place, Option<usize>)> = vec![(start, None)];
            let mut at = 0;
            while let Some((module, _)) = before.get(at).copied() {
                let next = imports.get(module);
                if next.is_some_and(|next| next.contains(start)) {
                    let mut circle = vec![start.clone()];
                    let mut step = Some(at);
                    while let Some(n) = step {
                        circle.insert(0, before[n].0.clone());
                        step = before[n].1;
                    }
                    circles.push(circle);
                    break;
                }
                for module in next.into_iter().flatten() {
                    if before.iter().all(|(known, _)| *known != module) {
                        before.push((module, Some(at)));
                    }
                }
                at += 1;
            }
        }
        circles
    }
}

fn joined(place: &[String], rest: &[String]) -> Place {
    [place, rest].concat()
}

/// The place that `path`, written in the module `from`, leads to.
fn place_of(from: &[String], path: &[String]) -> Place {
    let mut place = match path.first().map(String::as_str) {
        Some("crate") => Place::new(),
        _ => from.to_vec(),
    };
    for name in path {
        match name.as_str() {
            "crate" | "self" => {}
            "super" => {
                place.pop();
            }
            name => place.push(name.to_owned()),
        }
    }
    place
}

/// Reads one module as it is written.
#[derive(Default)]
struct Reader<'a> {
    /// Paths that a `use` names, each with the name it brings in; `*` for a glob.
    uses: Vec<(Place, String)>,
    /// Other paths in the code.
    paths: Vec<Place>,
    /// Modules in this one.
    modules: Vec<&'a ItemMod>,
    /// Types that the module implements something for.
    implemented: BTreeSet<String>,
}

impl Reader<'_> {
    /// What the module names of its own crate, as the module `place`.
    fn names(&self, place: &[String]) -> Names {
        // A path starts with a keyword, a module of this one, or the name of another crate.
        let inside = |path: &Place| {
            path.first().is_some_and(|first| {
                ["crate", "self", "super"].contains(&first.as_str())
                    || self.modules.iter().any(|module| module.ident == first)
            })
        };
        let mut names = Names {
            implemented: self.implemented.clone(),
            ..Names::default()
        };
        for (path, alias) in self.uses.iter().filter(|(path, _)| inside(path)) {
            if alias == "*" {
                names.places.insert(place_of(place, path));
            } else {
                names.aliases.insert(alias.clone(), place_of(place, path));
            }
        }
        let paths = self.paths.iter().filter(|path| inside(path));
        names.places.extend(paths.map(|path| place_of(place, path)));
        names
    }

    /// Notes what a `use` brings in; `path` is what stands before `tree`.
    fn read_use(&mut self, path: &[String], tree: &UseTree) {
        match tree {
            UseTree::Path(tree) => self.read_use(&joined(path, &[tree.ident.to_string()]), &tree.tree),
            UseTree::Name(tree) => {
                let path = joined(path, &[tree.ident.to_string()]);
                let alias = path.iter().rfind(|name| *name != "self").cloned();
                self.uses.push((path, alias.unwrap_or_default()));
            }
            UseTree::Rename(tree) => {
                let path = joined(path, &[tree.ident.to_string()]);
                self.uses.push((path, tree.rename.to_string()));
            }
            UseTree::Glob(_) => self.uses.push((path.to_vec(), "*".to_owned())),
            UseTree::Group(group) => {
                for tree in &group.items {
                    self.read_use(path, tree);
                }
            }
        }
    }
}

impl<'a> Visit<'a> for Reader<'a> {
    fn visit_item(&mut self, item: &'a Item) {
        if !attributes(item).iter().any(is_test) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_mod(&mut self, module: &'a ItemMod) {
        self.modules.push(module);
    }

    fn visit_item_use(&mut self, item: &'a ItemUse) {
        self.read_use(&[], &item.tree);
    }

    fn visit_item_impl(&mut self, item: &'a syn::ItemImpl) {
        if let syn::Type::Path(of) = &*item.self_ty
            && let Some(last) = of.path.segments.last()
        {
            self.implemented.insert(last.ident.to_string());
        }
        visit::visit_item_impl(self, item);
    }

    fn visit_path(&mut self, path: &'a syn::Path) {
        let segments = path.segments.iter();
        self.paths
            .push(segments.map(|segment| segment.ident.to_string()).collect());
        visit::visit_path(self, path);
    }

    /// The arguments and the body of a macro are not parsed: their paths are found in the text.
    fn visit_macro(&mut self, call: &'a syn::Macro) {
        self.paths.extend(paths_in(&call.tokens.to_string()));
        visit::visit_macro(self, call);
    }

    // `pub(super)` imports nothing.
    fn visit_visibility(&mut self, _: &'a Visibility) {}
}

/// The paths of two or more names in the text of a macro's tokens, outside quotes.
pub fn paths_in(tokens: &str) -> Vec<Place> {
    let characters: Vec<char> = tokens.chars().collect();
    let at = |n: usize| characters.get(n).copied().unwrap_or('\0');
    let in_name = |letter: char| letter.is_alphanumeric() || letter == '_';
    let (mut paths, mut path, mut joins, mut n) = (Vec::new(), Place::new(), false, 0);
    while n < characters.len() {
        let begin = n;
        if in_name(at(n)) {
            while in_name(at(n)) {
                n += 1;
            }
            if !joins {
                paths.push(std::mem::take(&mut path));
            }
            path.push(characters[begin..n].iter().collect());
            joins = false;
            continue;
        }
        n += match (at(n), at(n + 1)) {
            (':', ':') => 2,
            ('"', _) => quoted(&characters[n..], begin > 0 && at(begin - 1) == '#'),
            // A letter in quotes, and no lifetime.
            ('\'', '\\') => 4,
            ('\'', _) if at(n + 2) == '\'' => 3,
            _ => 1,
        };
        if at(begin) == ':' && n == begin + 2 {
            joins = !path.is_empty();
        } else if !at(begin).is_whitespace() {
            paths.push(std::mem::take(&mut path));
            joins = false;
        }
    }
    paths.push(path);
    paths.retain(|path| path.len() > 1);
    paths
}

/// The length of the text in quotes that `characters` begins with; one that is `raw` ends with its `#`.
fn quoted(characters: &[char], raw: bool) -> usize {
    let mut n = 1;
    while let Some(character) = characters.get(n) {
        match character {
            '\\' if !raw => n += 1,
            '"' if !raw || characters.get(n + 1) == Some(&'#') => return n + 1,
            _ => {}
        }
        n += 1;
    }
    n
}

fn is_test(attribute: &Attribute) -> bool {
    let meta = attribute.meta.require_list();
    attribute.path().is_ident("cfg") && meta.is_ok_and(|list| list.tokens.to_string() == "test")
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(item) => &item.attrs,
        Item::Enum(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Mod(item) => &item.attrs,
        Item::Static(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Trait(item) => &item.attrs,
        Item::Type(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        _ => &[],
    }
}
