//! Checks of names of blocks, materials and probes, and of references to them.

use std::collections::BTreeMap;

use crate::scene::check::Check;
use crate::scene::problem::suggestion;
use crate::scene::{Help, KeyPath, Problem, Split, input, is_part};

/// Names that can be referred to.
pub(super) struct Names {
    blocks: Vec<(String, Split)>,
    fixed: Vec<String>,
    materials: Vec<String>,
}

/// Kinds of things that are referred to by name.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Sort {
    Block,
    Material,
}

impl Sort {
    pub(super) const fn word(self) -> &'static str {
        match self {
            Self::Block => "block",
            Self::Material => "material",
        }
    }
}

impl Names {
    pub(super) fn new(input: &input::SceneInput) -> Self {
        let blocks = input.block.iter();
        let fixed = input.block.iter().filter(|block| block.fixed);
        let materials = input.material.iter();
        Self {
            blocks: blocks
                .filter_map(|b| Some((b.name.clone()?, b.split)))
                .collect(),
            fixed: fixed.filter_map(|b| b.name.clone()).collect(),
            materials: materials.filter_map(|m| m.name.clone()).collect(),
        }
    }

    /// True if a block, or the block that it is a part of, is fixed.
    pub(super) fn is_fixed(&self, block: &str) -> bool {
        let mut fixed = self.fixed.iter();
        fixed.any(|whole| whole == block || is_part(whole, block))
    }

    /// Returns all names of a sort.
    fn all(&self, sort: Sort) -> Vec<&str> {
        match sort {
            Sort::Block => self.blocks.iter().map(|(name, _)| name.as_str()).collect(),
            Sort::Material => self.materials.iter().map(String::as_str).collect(),
        }
    }

    /// True if a name is that of a material, of a block, or of a part that the split of a block may
    /// make.
    pub(super) fn contains(&self, sort: Sort, name: &str) -> bool {
        self.all(sort).contains(&name)
            || sort == Sort::Block && self.splits().any(|block| is_part(block, name))
    }

    /// Returns the names of the blocks that are split.
    pub(super) fn splits(&self) -> impl Iterator<Item = &str> {
        let split = self
            .blocks
            .iter()
            .filter(|(_, split)| *split != Split::None);
        split.map(|(name, _)| name.as_str())
    }
}

impl Check {
    /// Checks a name that is used in tables and files.
    pub(super) fn name(
        &mut self,
        at: &KeyPath,
        name: Option<&str>,
        example: &str,
    ) -> Option<String> {
        let name = self.required(at, "name", name, example)?;
        self.not_empty(&at.key("name"), name)?;
        let odd = |c: char| c.is_control() || matches!(c, ',' | ';' | '"');
        if name.trim() != name || name.contains(odd) {
            let problem = Problem::new(
                at.key("name"),
                "a name has no commas, semicolons, quotes or line breaks, and no blanks at its ends",
            );
            self.problems
                .push(problem.help("names are columns of the result tables"));
            return None;
        }
        Some(name.to_owned())
    }

    /// Checks that a text is not empty.
    pub(super) fn not_empty(&mut self, path: &KeyPath, text: &str) -> Option<String> {
        if text.is_empty() {
            self.report(path.clone(), "must not be empty");
            return None;
        }
        Some(text.to_owned())
    }

    /// Checks that a block or material of this name exists.
    pub(super) fn reference(&mut self, path: &KeyPath, sort: Sort, name: &str) -> Option<String> {
        if self.names.contains(sort, name) {
            return Some(name.to_owned());
        }
        let word = sort.word();
        let known = self.names.all(sort);
        let help = if known.is_empty() {
            Help::on_list(word, |list| format!("add a {list} with this name"))
        } else {
            suggestion(name, known).into()
        };
        let problem = Problem::new(path.clone(), format!("no {word} is named \"{name}\""));
        self.problems.push(problem.help(help));
        None
    }

    /// Reports names that are used twice, or that parts of a split may get.
    pub(super) fn unique_names(&mut self, input: &input::SceneInput) {
        let blocks: Vec<_> = input.block.iter().map(|b| b.name.as_deref()).collect();
        let materials: Vec<_> = input.material.iter().map(|m| m.name.as_deref()).collect();
        let probes: Vec<_> = input.probe.iter().map(|p| p.name.as_deref()).collect();
        for (list, names) in [
            ("block", &blocks),
            ("material", &materials),
            ("probe", &probes),
        ] {
            self.unique(&KeyPath::root().key(list), names);
        }
        for (i, name) in blocks.into_iter().enumerate() {
            let Some(name) = name else { continue };
            let Some(whole) = self.names.splits().find(|whole| is_part(whole, name)) else {
                continue;
            };
            let message =
                format!("the name \"{name}\" may be that of a part of the split block \"{whole}\"");
            let problem = Problem::new(KeyPath::root().key("block").index(i).key("name"), message);
            self.problems
                .push(problem.help("choose a name without a number after the point"));
        }
    }

    fn unique(&mut self, list: &KeyPath, names: &[Option<&str>]) {
        let mut first = BTreeMap::new();
        for (i, name) in names.iter().enumerate() {
            let Some(name) = name else { continue };
            if let Some(other) = first.get(name) {
                let message = format!("the name \"{name}\" is taken by {}", list.index(*other));
                self.report(list.index(i).key("name"), message);
            } else {
                first.insert(*name, i);
            }
        }
    }
}
