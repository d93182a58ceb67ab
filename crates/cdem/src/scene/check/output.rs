//! Checks of output and probes.

use std::collections::BTreeSet;

use crate::scene::check::Check;
use crate::scene::check::names::Sort;
use crate::scene::check::value::{NOT_NEGATIVE, OptionalKey, POSITIVE};
use crate::scene::input::{self, Duration, Quantity};
use crate::scene::{Cadence, Field, KeyPath, Output, Probe};

/// The two keys of a cadence, which exclude each other.
struct CadenceKeys<'a> {
    /// Number of intervals over the run.
    count: OptionalKey<'a, u32>,
    /// Simulated time between two outputs.
    interval: OptionalKey<'a, Quantity<Duration>>,
    /// Number of intervals if both keys are left out.
    default: usize,
}

impl Check {
    pub(super) fn output(&mut self, at: &KeyPath, input: &input::OutputInput) -> Option<Output> {
        let frames = CadenceKeys {
            count: OptionalKey::new("frames", input.frames),
            interval: OptionalKey::new("frame_interval", input.frame_interval),
            default: 100,
        };
        let frames = self.cadence(at, frames);
        let history = CadenceKeys {
            count: OptionalKey::new("history", input.history),
            interval: OptionalKey::new("history_interval", input.history_interval),
            default: 1000,
        };
        let history = self.cadence(at, history);
        let blocks = CadenceKeys {
            count: OptionalKey::new("blocks", input.blocks),
            interval: OptionalKey::new("blocks_interval", input.blocks_interval),
            default: 1000,
        };
        let blocks = self.cadence(at, blocks);
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

    fn cadence(&mut self, at: &KeyPath, keys: CadenceKeys<'_>) -> Option<Cadence> {
        let CadenceKeys {
            count,
            interval,
            default,
        } = keys;
        match (count.value, interval.value) {
            (None, None) => Some(Cadence::Count(default)),
            (Some(0), None) => {
                self.report(
                    at.key(count.name),
                    "must be at least 1: it is the number of intervals from start to end",
                );
                None
            }
            (Some(count), None) => Some(Cadence::Count(count as usize)),
            (None, Some(time)) => {
                let time = self.number(&at.key(interval.name), time, POSITIVE);
                time.map(Cadence::Interval)
            }
            (Some(_), Some(_)) => {
                self.exclude(at, count.name, interval.name);
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
