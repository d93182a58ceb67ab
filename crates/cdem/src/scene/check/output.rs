//! Checks of output and probes.

use std::collections::BTreeSet;

use crate::scene::check::Check;
use crate::scene::check::names::Sort;
use crate::scene::check::value::{NOT_NEGATIVE, POSITIVE};
use crate::scene::input::{self, Duration, Quantity};
use crate::scene::{Cadence, Field, KeyPath, Output, Probe};

impl Check {
    pub(super) fn output(&mut self, at: &KeyPath, input: &input::OutputInput) -> Option<Output> {
        let frames = ("frames", input.frames, 100);
        let frames = self.cadence(at, frames, ("frame_interval", input.frame_interval));
        let history = ("history", input.history, 1000);
        let history = self.cadence(at, history, ("history_interval", input.history_interval));
        let blocks = ("blocks", input.blocks, 1000);
        let blocks = self.cadence(at, blocks, ("blocks_interval", input.blocks_interval));
        let block_list = match &input.block_list {
            None => Some(None),
            Some(list) => self.block_list(&at.key("block_list"), list).map(Some),
        };
        let fields = self.fields(&at.key("fields"), &input.fields);
        let checkpoint = self.number(&at.key("checkpoint"), input.checkpoint, NOT_NEGATIVE);
        Some(Output {
            frames: frames?,
            history: history?,
            blocks: blocks?,
            block_list: block_list?,
            fields: fields?,
            checkpoint: checkpoint?,
        })
    }

    fn cadence(
        &mut self,
        at: &KeyPath,
        (count_key, count, default): (&str, Option<u32>, usize),
        (interval_key, interval): (&str, Option<Quantity<Duration>>),
    ) -> Option<Cadence> {
        match (count, interval) {
            (None, None) => Some(Cadence::Count(default)),
            (Some(0), None) => {
                self.report(
                    at.key(count_key),
                    "must be at least 1: the intervals between start and end",
                );
                None
            }
            (Some(count), None) => Some(Cadence::Count(count as usize)),
            (None, Some(interval)) => {
                let interval = self.number(&at.key(interval_key), interval, POSITIVE);
                interval.map(Cadence::Interval)
            }
            (Some(_), Some(_)) => {
                self.exclude(at, count_key, interval_key);
                None
            }
        }
    }

    fn block_list(&mut self, path: &KeyPath, list: &[String]) -> Option<Vec<String>> {
        let mut seen = BTreeSet::new();
        let mut checked = Vec::new();
        for (i, name) in list.iter().enumerate() {
            let at = path.index(i);
            checked.push(self.reference(&at, Sort::Block, name));
            if !seen.insert(name) {
                self.report(at, format!("\"{name}\" is listed twice"));
            }
        }
        checked.into_iter().collect()
    }

    fn fields(&mut self, path: &KeyPath, fields: &[Field]) -> Option<Vec<Field>> {
        for (i, field) in fields.iter().enumerate() {
            if fields[..i].contains(field) {
                self.report(path.index(i), "this field is listed twice");
                return None;
            }
        }
        Some(fields.to_vec())
    }

    pub(super) fn probe(&mut self, at: &KeyPath, input: &input::ProbeInput) -> Option<Probe> {
        let name = self.name(at, input.name.as_deref(), "name = \"tip\"");
        let block = self.required(at, "block", input.block.as_deref(), "block = \"left\"");
        let block = block.and_then(|block| self.reference(&at.key("block"), Sort::Block, block));
        let point = self.required(at, "point", input.point.as_ref(), "point = [0.0, 0.0]");
        let point = point.and_then(|point| self.vector(&at.key("point"), point));
        Some(Probe {
            name: name?,
            block: block?,
            point: point?,
        })
    }
}
