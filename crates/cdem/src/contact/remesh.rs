//! Contact goes on when the mesh of blocks changes.

use rayon::prelude::*;

use crate::contact::island::Island;
use crate::contact::live::{Live, Record};
use crate::contact::search::{Patches, Search};
use crate::contact::solve::shear_norm;
use crate::contact::surface::{Feature, Pair, Positions, Surface};
use crate::contact::{Contacts, Moment};
use crate::mesh::Mesh;
use crate::model::inertia::Inertia;
use crate::vector::{add_scaled, dot};

/// Two blocks that are about to touch, or touch.
#[derive(Clone, Debug)]
pub(crate) struct Place<const D: usize> {
    pub(crate) blocks: [u32; 2],
    /// Where at rest, m, and a node of the feature there: of main and target.
    pub(crate) rest: [[f64; D]; 2],
    pub(crate) nodes: [u32; 2],
    /// Whether each feature is an edge in space.
    pub(crate) are_edges: [bool; 2],
    /// Where, and out of the target.
    pub(crate) point: [f64; D],
    pub(crate) normal: [f64; D],
    /// How fast the two come nearer, m/s.
    pub(crate) speed: f64,
    /// Until they touch, s.
    pub(crate) wait: f64,
    /// When the contact began, s; of one that is about to be, nothing.
    pub(crate) since: Option<f64>,
    /// How far it has slipped since, m; and does in a second now, m/s.
    pub(crate) slip: f64,
    pub(crate) slip_rate: f64,
}

impl<const D: usize> Contacts<D> {
    /// Where open pairs will touch within `duration` seconds at constant velocities.
    pub(crate) fn ahead(
        &self,
        at: Positions<D>,
        velocity: &[[f64; D]],
        rest: Positions<D>,
        duration: f64,
    ) -> Vec<Place<D>> {
        let mut closed: Vec<Pair> = self.live().map(|live| live.pair).collect();
        closed.sort_unstable();
        let surface = &*self.terms.surface;
        let look = |&pair: &Pair| {
            if closed.binary_search(&pair).is_ok() {
                return None;
            }
            let tolerance = self.terms.tolerance;
            let time = surface.time_of_impact(pair, at, velocity, duration, tolerance)?;
            let then = at.after(velocity, time);
            let foot = surface.project(pair, then).foot.map(|w| w.clamp(0.0, 1.0));
            let operator = surface.operator(pair, &foot, then);
            let speed = -operator.relative_velocity(0, velocity);
            Some(Place {
                speed,
                wait: time,
                ..self.place(pair, &foot, (then, rest), operator.frame[0])
            })
        };
        self.near.par_iter().filter_map(look).collect()
    }

    /// Where closed pairs touch.
    pub(crate) fn present(
        &self,
        at: Positions<D>,
        velocity: &[[f64; D]],
        rest: Positions<D>,
    ) -> Vec<Place<D>> {
        let surface = &*self.terms.surface;
        let place = |live: &Live<D>| {
            let operator = live.operator(surface, at);
            Place {
                since: Some(live.record.time_on),
                slip: live.record.slip,
                slip_rate: shear_norm(&operator.relative_velocities(velocity)),
                ..self.place(live.pair, &live.foot, (at, rest), operator.frame[0])
            }
        };
        self.live().map(place).collect()
    }

    fn place(
        &self,
        pair: Pair,
        foot: &[f64; 2],
        (at, rest): (Positions<D>, Positions<D>),
        normal: [f64; D],
    ) -> Place<D> {
        let surface = &*self.terms.surface;
        let nodes = [
            surface.main_nodes(pair.main),
            surface.target_nodes(pair.target),
        ];
        let nodes = nodes.map(|nodes| nodes[0]);
        let marks = surface.marks(pair, foot, rest);
        Place {
            blocks: nodes.map(|node| self.terms.block_of[node as usize]),
            are_edges: marks.map(|mark| matches!(mark.on, Feature::Edge(_))),
            rest: marks.map(|mark| mark.place),
            nodes,
            point: surface.point(pair, at),
            normal,
            speed: 0.0,
            wait: 0.0,
            since: None,
            slip: 0.0,
            slip_rate: 0.0,
        }
    }

    /// Which nodes, and others of their features, would move on these `ways`, m, where other
    /// blocks are no farther away than that.
    pub(crate) fn close(&self, at: Positions<D>, ways: &[f64]) -> Vec<bool> {
        let longest = |nodes: &[u32]| {
            let of = nodes.iter().map(|&node| ways[node as usize]);
            of.fold(0.0, f64::max)
        };
        let mut margins = vec![self.terms.tolerance; self.fixed.len()];
        for (way, &block) in ways.iter().zip(&self.terms.block_of) {
            let margin = &mut margins[block as usize];
            *margin = margin.max(way + self.terms.tolerance);
        }
        let margin = |block: u32| margins[block as usize];
        let may_meet = self.terms.may_meet(&self.fixed);
        let goes = |block: u32| margin(block) > self.terms.tolerance;
        let wanted = |[a, b]: [u32; 2]| (goes(a) || goes(b)) && may_meet([a, b]);
        let surface = &*self.terms.surface;
        let pairs = self
            .terms
            .patches
            .overlapping(surface, at, &margin, &wanted);
        let mut close = vec![false; ways.len()];
        for pair in pairs {
            let sides = [
                surface.main_nodes(pair.main),
                surface.target_nodes(pair.target),
            ];
            let of_sides = sides.map(longest);
            let reach = of_sides[0] + of_sides[1] + 2.0 * self.terms.tolerance;
            if of_sides != [0.0; 2] && surface.apart(pair, at) <= reach {
                for (nodes, way) in sides.iter().zip(of_sides) {
                    nodes
                        .iter()
                        .for_each(|&node| close[node as usize] |= way > 0.0);
                }
            }
        }
        close
    }

    /// Goes on with the surface of another mesh of the same blocks, of which some have
    /// `changed`: contacts go on where they are; those of points that there are no more
    /// begin anew, as far as they touch there.
    pub(crate) fn remesh(
        &mut self,
        (old, new): (Sight<D>, Sight<D>),
        mesh: &Mesh<D>,
        surface: Box<dyn Surface<D>>,
        changed: &[bool],
        inertia: &Inertia<D>,
        time: f64,
    ) {
        let nodes_of = |block: u32| mesh.blocks[block as usize].nodes.clone();
        let before = std::mem::replace(&mut self.terms.surface, surface);
        self.terms.block_of = vec![0; mesh.nodes.len()];
        for (number, block) in (0..).zip(&mesh.blocks) {
            let nodes = block.nodes.start as usize..block.nodes.end as usize;
            self.terms.block_of[nodes].fill(number);
        }
        self.terms.halvings = mesh.halvings_at_nodes();
        let after = &*self.terms.surface;
        self.terms.patches = Patches::new(after, &self.terms.block_of, &mesh.nodes);
        self.search = Search::default();
        self.near.clear();
        self.joins.clear();
        self.grouped = false;
        let mut lost: Vec<Record> = Vec::new();
        let mut kept: Vec<Live<D>> = Vec::new();
        let mut all: Vec<Live<D>> = Vec::new();
        for island in &mut self.islands {
            all.append(&mut island.live);
        }
        for mut live in all {
            let marks = before.marks(live.pair, &live.foot, old.rest);
            let nodes = live.record.blocks.map(nodes_of);
            let found = after.at_marks(&marks, nodes, new.rest);
            let Some((pair, foot)) = found else {
                lost.push(live.record);
                continue;
            };
            let frames = [
                before.operator(live.pair, &live.foot, old.at).frame,
                after.operator(pair, &foot, new.at).frame,
            ];
            live.impulse = turned(&live.impulse, &frames);
            if live
                .record
                .blocks
                .iter()
                .any(|&block| changed[block as usize])
            {
                live.foot = foot;
            }
            live.pair = pair;
            kept.push(live);
        }
        kept.sort_by_key(|live| live.pair);
        kept.dedup_by(|next, first| {
            let same = next.pair == first.pair;
            if same {
                self.ended.push(Record {
                    time_off: Some(time),
                    ..next.record.clone()
                });
            }
            same
        });
        self.in_island = vec![false; mesh.nodes.len()];
        self.place = vec![0; mesh.nodes.len()];
        self.islands = vec![Island {
            live: kept,
            ..Island::default()
        }];
        self.begin_anew(lost, new.at, inertia, time);
    }

    /// Contacts of blocks that have `lost` some begin where these blocks touch.
    fn begin_anew(&mut self, lost: Vec<Record>, at: Positions<D>, inertia: &Inertia<D>, time: f64) {
        if lost.is_empty() {
            return;
        }
        let ordered = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
        let mut blocks: Vec<[u32; 2]> = lost.iter().map(|r| ordered(r.blocks)).collect();
        blocks.sort_unstable();
        blocks.dedup();
        self.ended.extend(lost.into_iter().map(|record| Record {
            time_off: Some(time),
            ..record
        }));
        let within = self.terms.tolerance;
        let wanted = |pair: [u32; 2]| blocks.binary_search(&ordered(pair)).is_ok();
        let pairs = self
            .terms
            .blocks(&self.fixed)
            .pairs_within(at, within, &wanted);
        let setting = self.terms.setting(inertia);
        let surface = setting.surface;
        let island = &mut self.islands[0];
        for pair in pairs {
            let projection = surface.project(pair, at);
            let touches = projection.gap.abs() <= within
                && projection.outside <= within
                && surface.admits(pair, at)
                && surface.presses(pair, at, within);
            if touches {
                let count = island.live.len();
                self.books.touches += island.touch(&setting, Moment::still(at), pair, time);
                for live in &mut island.live[count..] {
                    live.fresh = false;
                }
            }
        }
    }
}

/// A mesh as it lies: now, and at rest.
#[derive(Clone, Copy)]
pub(crate) struct Sight<'a, const D: usize> {
    pub(crate) at: Positions<'a, D>,
    pub(crate) rest: Positions<'a, D>,
}

/// A vector in one frame in another, its first component as it is.
fn turned<const D: usize>(vector: &[f64; D], [old, new]: &[[[f64; D]; D]; 2]) -> [f64; D] {
    let mut whole = [0.0; D];
    for r in 1..D {
        add_scaled(&mut whole, vector[r], &old[r]);
    }
    std::array::from_fn(|r| {
        if r == 0 {
            vector[0]
        } else {
            dot(&whole, &new[r])
        }
    })
}
