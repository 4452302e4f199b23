//! Dependency cycles between the files of a crate, and between its folders. Folders without cycles
//! have an order in which each uses only those below it.
//!
//! A file uses another if it names one of its items, by `use` or by a path that starts with
//! `crate`, `self`, `super` or a module of its own. Re-exports of a file's own modules (`pub use`)
//! do not count. Neither do tests within a file, and files `tests.rs`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use petgraph::algo::tarjan_scc;
use petgraph::graph::DiGraph;
use syn::visit::{self, Visit};

use crate::repository::Outcome;

/// Path of a module from the root of the crate; empty for the root.
type Module = Vec<String>;

/// Returns a line for each cycle in the sources of a folder.
///
/// # Errors
/// If a source cannot be read or is not valid Rust.
pub(crate) fn circles(sources: &Path) -> Outcome<Vec<String>> {
    let mut files = BTreeMap::new();
    collect(sources, &Module::new(), &mut files)?;
    let parsed = files.iter().map(|(module, path)| {
        let text = fs::read_to_string(path)?;
        let file = syn::parse_file(&text).map_err(|cause| format!("{}: {cause}", path.display()))?;
        Ok((module.clone(), file))
    });
    Ok(circles_among(&parsed.collect::<Outcome<BTreeMap<Module, syn::File>>>()?))
}

/// Returns a line for each cycle among parsed files.
fn circles_among(files: &BTreeMap<Module, syn::File>) -> Vec<String> {
    let known: Vec<&Module> = files.keys().collect();
    let root = Module::new();
    let names = files.get(&root).map(|file| exported(file, &known)).unwrap_or_default();
    let mut arrows = Vec::new();
    for (module, file) in files.iter().filter(|(module, _)| !module.is_empty()) {
        let mut uses = Uses { module, known: &known, names: &names, found: Vec::new() };
        uses.visit_file(file);
        let used = uses.found.into_iter().filter(|used| !used.is_empty());
        arrows.extend(used.map(|used| (module.clone(), used)));
    }
    let of_files = circles_of(&arrows);
    if !of_files.is_empty() {
        return of_files;
    }
    let folder = |module: Module| module.into_iter().take(1).collect::<Module>();
    let between: Vec<_> = arrows.into_iter().map(|(from, to)| (folder(from), folder(to))).collect();
    circles_of(&between).into_iter().map(|circle| format!("folders {circle}")).collect()
}

/// Returns a line for each cycle of these edges.
fn circles_of(arrows: &[(Module, Module)]) -> Vec<String> {
    let mut graph = DiGraph::<&Module, ()>::new();
    let mut nodes = BTreeMap::new();
    for (from, to) in arrows.iter().filter(|(from, to)| from != to) {
        let [from, to] = [from, to].map(|end| *nodes.entry(end).or_insert_with(|| graph.add_node(end)));
        graph.update_edge(from, to, ());
    }
    let circles = tarjan_scc(&graph).into_iter().filter(|circle| circle.len() > 1);
    let told = circles.map(|circle| {
        let mut names: Vec<String> = circle.iter().map(|node| graph[*node].join("::")).collect();
        names.sort();
        format!("{} depend on each other in a cycle; move what they share below them", names.join(", "))
    });
    told.collect()
}

/// Collects the files in a folder by their modules.
fn collect(folder: &Path, module: &Module, files: &mut BTreeMap<Module, PathBuf>) -> Outcome {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let Some(stem) = path.file_stem().and_then(|stem| stem.to_str()).filter(|stem| *stem != "tests")
        else {
            continue;
        };
        let own = if module.is_empty() && (stem == "lib" || stem == "main") {
            Module::new()
        } else {
            [module.as_slice(), &[stem.to_owned()]].concat()
        };
        if path.is_dir() {
            collect(&path, &own, files)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            // A crate with both a library and a program has its modules in the library.
            files.entry(own).or_insert(path);
        }
    }
    Ok(())
}

/// Returns the names that the root of a crate re-exports from these modules.
fn exported(root: &syn::File, known: &[&Module]) -> BTreeMap<String, Module> {
    let mut names = BTreeMap::new();
    for item in &root.items {
        if let syn::Item::Use(item) = item {
            let mut paths = Vec::new();
            flatten(&item.tree, &mut Module::new(), &mut paths);
            for (mut path, name) in paths {
                path.retain(|word| word != "crate" && word != "self");
                if let Some(module) = longest(&path, known) {
                    names.insert(name, module);
                }
            }
        }
    }
    names
}

/// Collects the paths of a `use` tree, each with the name that it introduces.
fn flatten(tree: &syn::UseTree, before: &mut Module, paths: &mut Vec<(Module, String)>) {
    match tree {
        syn::UseTree::Path(path) => {
            before.push(path.ident.to_string());
            flatten(&path.tree, before, paths);
            before.pop();
        }
        syn::UseTree::Group(group) => group.items.iter().for_each(|tree| flatten(tree, before, paths)),
        syn::UseTree::Name(name) => {
            let name = name.ident.to_string();
            paths.push(([before.as_slice(), std::slice::from_ref(&name)].concat(), name));
        }
        syn::UseTree::Rename(rename) => {
            let path = [before.as_slice(), &[rename.ident.to_string()]].concat();
            paths.push((path, rename.rename.to_string()));
        }
        syn::UseTree::Glob(_) => paths.push((before.clone(), "*".into())),
    }
}

/// Returns the longest prefix of a path that is a module with a file.
fn longest(path: &[String], known: &[&Module]) -> Option<Module> {
    let starts = (1..=path.len()).rev().map(|length| path[..length].to_vec());
    starts.into_iter().find(|start| known.contains(&start))
}

/// The modules that a file names.
struct Uses<'a> {
    module: &'a Module,
    known: &'a [&'a Module],
    names: &'a BTreeMap<String, Module>,
    found: Vec<Module>,
}

impl Uses<'_> {
    fn name(&mut self, path: &[String]) {
        let Some(first) = path.first() else { return };
        let absolute = match first.as_str() {
            "crate" => path[1..].to_vec(),
            "self" => [self.module.as_slice(), &path[1..]].concat(),
            "super" => {
                let ups = path.iter().take_while(|word| *word == "super").count();
                let kept = self.module.len().saturating_sub(ups);
                [&self.module[..kept], &path[ups..]].concat()
            }
            own => {
                let child = [self.module.as_slice(), &[own.to_owned()]].concat();
                if !self.known.contains(&&child) {
                    return;
                }
                [self.module.as_slice(), path].concat()
            }
        };
        let named = absolute.first().and_then(|first| self.names.get(first)).cloned();
        self.found.extend(longest(&absolute, self.known).or(named));
    }
}

/// Returns `true` if an item exists for tests or documentation only.
fn is_aside(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let syn::Meta::List(list) = &attribute.meta else { return false };
        let tokens = list.tokens.to_string();
        list.path.is_ident("cfg") && (tokens == "test" || tokens == "doc")
    })
}

impl<'ast> Visit<'ast> for Uses<'_> {
    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        if !is_aside(&item.attrs) {
            visit::visit_item_mod(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        if is_aside(&item.attrs) {
            return;
        }
        let mut paths = Vec::new();
        flatten(&item.tree, &mut Module::new(), &mut paths);
        for (path, _) in paths {
            let is_own = !matches!(path.first().map(String::as_str), Some("crate" | "super"));
            if !(is_own && matches!(item.vis, syn::Visibility::Public(_) | syn::Visibility::Restricted(_))) {
                self.name(&path);
            }
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let words: Module = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        if words.len() > 1 {
            self.name(&words);
        }
        visit::visit_path(self, path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(files: &[(&str, &str)]) -> Vec<String> {
        let file = |(path, text): &(&str, &str)| {
            let module = path.split("::").filter(|word| !word.is_empty()).map(str::to_owned).collect();
            (module, syn::parse_file(text).unwrap())
        };
        circles_among(&files.iter().map(file).collect())
    }

    #[test]
    fn circles_are_found_however_things_are_named() {
        let root = ("", "mod a; mod b; pub use b::B;");
        let back = ("b", "use crate::a::{self, A}; pub struct B;");
        let circle = ["a, b depend on each other in a cycle; move what they share below them"];
        assert_eq!(told(&[root, ("a", "use crate::b::B; pub struct A;"), back]), circle);
        assert_eq!(told(&[root, ("a", "use crate::B; pub struct A;"), back]), circle, "by the root's name");
        assert_eq!(told(&[root, ("a", "pub struct A(super::b::B);"), back]), circle, "by a path");
        assert_eq!(told(&[root, ("a", "use super::b as c; pub struct A(c::B);"), back]), circle, "renamed");
        assert!(told(&[root, ("a", "pub struct A;"), back]).is_empty());
    }

    #[test]
    fn a_module_and_its_own_may_make_a_circle_but_not_by_making_it_public() {
        let child = ("a::c", "use super::A; pub struct C;");
        let root = ("", "mod a;");
        assert_eq!(told(&[root, ("a", "mod c; use c::C; pub struct A;"), child]).len(), 1);
        assert_eq!(told(&[root, ("a", "mod c; pub struct A(c::C);"), child]).len(), 1);
        assert!(told(&[root, ("a", "mod c; pub use c::C; pub struct A;"), child]).is_empty());
    }

    #[test]
    fn folders_make_circles_where_their_files_do_not() {
        let root = ("", "mod a; mod b;");
        let upper = ("a::x", "use crate::b::y::Y; pub struct X;");
        let lower = ("b::y", "pub struct Y;");
        let back = ("b::z", "use crate::a::w::W;");
        let files =
            [root, ("a", "mod x; mod w;"), ("a::w", "pub struct W;"), upper, ("b", "mod y; mod z;"), lower];
        assert!(told(&files).is_empty());
        let circle = ["folders a, b depend on each other in a cycle; move what they share below them"];
        assert_eq!(told(&[&files[..], &[back]].concat()), circle);
    }

    #[test]
    fn tests_within_a_file_do_not_count() {
        let files = [
            ("", "mod a; mod b;"),
            ("a", "pub struct A; #[cfg(test)] mod tests { use crate::b::B; }"),
            ("b", "use crate::a::A; pub struct B;"),
        ];
        assert!(told(&files).is_empty());
    }
}
