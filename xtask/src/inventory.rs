//! `cargo xtask inventory [COMMIT]`: the size of the libraries, compared with an earlier commit.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use syn::visit::{self, Visit};

use crate::circles::circles;
use crate::repository::{Outcome, root, run};

/// The size of some sources.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Inventory {
    files: usize,
    lines: usize,
    circles: usize,
    public: usize,
    descents: usize,
}

impl Inventory {
    /// Returns the rows of the table.
    fn rows(&self) -> [(&'static str, usize); 5] {
        [
            ("source files", self.files),
            ("lines", self.lines),
            ("circles of files or folders", self.circles),
            ("public items", self.public),
            ("loops over a stack, queue or heap", self.descents),
        ]
    }
}

/// Prints the inventory of the working tree, and that of the commit in `words` if there is one.
pub(crate) fn run_with(words: &[&str]) -> Outcome {
    let now = Inventory::of(&root().join("crates"))?;
    match words {
        [] => {
            println!("| libraries and command line | now |\n| --- | --: |");
            for (what, count) in now.rows() {
                println!("| {what} | {count} |");
            }
        }
        [commit] => {
            let then = Inventory::of(&unpacked(commit)?)?;
            println!("| libraries and command line | {commit} | now |\n| --- | --: | --: |");
            for ((what, before), (_, count)) in then.rows().into_iter().zip(now.rows()) {
                println!("| {what} | {before} | {count} |");
            }
        }
        _ => return Err(format!("expected at most one commit, got {}", words.join(" ")).into()),
    }
    Ok(())
}

/// Unpacks the folder of crates at a commit into the target folder.
fn unpacked(commit: &str) -> Outcome<PathBuf> {
    let folder = root().join("target").join("inventory");
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    fs::create_dir_all(&folder)?;
    let mut archive = Command::new("git")
        .current_dir(root())
        .args(["archive", "--format=tar", commit, "crates"])
        .stdout(Stdio::piped())
        .spawn()?;
    let tar = archive.stdout.take().ok_or("expected an output of `git archive`, got none")?;
    run(Command::new("tar").arg("-x").arg("-C").arg(&folder).stdin(tar), "tar")?;
    if !archive.wait()?.success() {
        return Err(format!("expected a commit with the folder `crates`, got `{commit}`").into());
    }
    Ok(folder.join("crates"))
}

impl Inventory {
    /// Returns the inventory of the sources of all crates in a folder.
    fn of(crates: &Path) -> Outcome<Self> {
        let mut all = Self::default();
        for entry in fs::read_dir(crates)? {
            let sources = entry?.path().join("src");
            if sources.is_dir() {
                all.add_folder(&sources)?;
                all.circles += circles(&sources)?.len();
            }
        }
        Ok(all)
    }

    fn add_folder(&mut self, folder: &Path) -> Outcome {
        for entry in fs::read_dir(folder)? {
            let path = entry?.path();
            if path.is_dir() {
                self.add_folder(&path)?;
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let text = fs::read_to_string(&path)?;
                let file = syn::parse_file(&text).map_err(|cause| format!("{}: {cause}", path.display()))?;
                self.files += 1;
                self.lines += text.lines().count();
                self.visit_file(&file);
            }
        }
        Ok(())
    }

    fn count_public(&mut self, visibility: &syn::Visibility) {
        self.public += usize::from(matches!(visibility, syn::Visibility::Public(_)));
    }
}

/// A visitor that records if a loop takes its next item from a stack, a queue or a heap.
#[derive(Default)]
struct Takes(bool);

impl<'ast> Visit<'ast> for Takes {
    fn visit_expr_method_call(&mut self, call: &'ast syn::ExprMethodCall) {
        self.0 |= call.args.is_empty() && ["pop", "pop_front"].iter().any(|name| call.method == name);
        visit::visit_expr_method_call(self, call);
    }
}

impl<'ast> Visit<'ast> for Inventory {
    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        if item.ident != "tests" {
            visit::visit_item_mod(self, item);
        }
    }

    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        self.count_public(&item.vis);
        visit::visit_item_fn(self, item);
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        self.count_public(&item.vis);
        visit::visit_impl_item_fn(self, item);
    }

    fn visit_item_struct(&mut self, item: &'ast syn::ItemStruct) {
        self.count_public(&item.vis);
    }

    fn visit_item_enum(&mut self, item: &'ast syn::ItemEnum) {
        self.count_public(&item.vis);
    }

    fn visit_item_trait(&mut self, item: &'ast syn::ItemTrait) {
        self.count_public(&item.vis);
        visit::visit_item_trait(self, item);
    }

    fn visit_item_const(&mut self, item: &'ast syn::ItemConst) {
        self.count_public(&item.vis);
    }

    fn visit_expr_while(&mut self, item: &'ast syn::ExprWhile) {
        let mut takes = Takes::default();
        takes.visit_expr_while(item);
        // Of nested loops, the outermost counts.
        self.descents += usize::from(takes.0);
    }

    fn visit_expr_loop(&mut self, item: &'ast syn::ExprLoop) {
        let mut takes = Takes::default();
        takes.visit_expr_loop(item);
        self.descents += usize::from(takes.0);
    }
}
