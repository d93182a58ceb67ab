//! An edge against an edge.

use crate::contact::tolerances::PARALLEL_SINE;
use crate::math::vector::{add_scaled, cross, dot, norm, scale, sub};

/// Two lines with their common normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeEdge {
    /// Unit normal of both, out of the target.
    pub(crate) normal: [f64; 3],
    /// Distance of the main line from the target line along the normal, m.
    pub(crate) gap: f64,
    /// Closest points of the lines, relative to the lengths of main and target edge.
    pub(crate) foot: [f64; 2],
    /// Sine of the angle between the edges.
    pub(super) sine: f64,
    /// The sine times both lengths, m². The gap times this is the volume of the four ends.
    pub(crate) area: f64,
    /// Component of the outward direction along the normal.
    pub(crate) outward: f64,
    /// True if the normal is main direction × target direction, false if opposite.
    pub(crate) forward: bool,
}

/// Two lines that are not parallel, without the sides of their blocks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LinePair {
    /// Closest points of the lines, relative to the lengths of main and target edge.
    pub(crate) foot: [f64; 2],
    /// Main direction × target direction, m², and its norm.
    area: [f64; 3],
    size: f64,
    /// Sine of the angle between the edges.
    sine: f64,
    /// Vector from the start of the target edge to the start of the main edge, m.
    from: [f64; 3],
}

impl LinePair {
    /// Returns the lines through two edges; `None` if they are parallel. They are if the ends of the
    /// shorter one lie beside the other by no more than the `resolution`, m, over the `slope` of the
    /// faces there. Such edges touch at their ends: late by half of the resolution if they cross in
    /// the middle, else by less. The slope is taken of few edges only.
    pub(crate) fn new(
        main: &[[f64; 3]; 2],
        target: &[[f64; 3]; 2],
        resolution: f64,
        slope: impl FnOnce() -> f64,
    ) -> Option<Self> {
        let (along, other) = (sub(&main[1], &main[0]), sub(&target[1], &target[0]));
        let area = cross(&along, &other);
        let size = norm(&area);
        let lengths = [norm(&along), norm(&other)];
        let sine = size / (lengths[0] * lengths[1]);
        let aside = sine * f64::min(lengths[0], lengths[1]);
        if sine <= PARALLEL_SINE || aside <= resolution && aside * slope() <= resolution {
            return None;
        }
        let from = sub(&main[0], &target[0]);
        let square = size * size;
        Some(Self {
            foot: [
                -dot(&cross(&from, &other), &area) / square,
                -dot(&cross(&from, &along), &area) / square,
            ],
            area,
            size,
            sine,
            from,
        })
    }

    /// Returns the crossing of the edges; `outward` points out of the target and into the main
    /// block.
    pub(crate) fn between(&self, outward: &[f64; 3]) -> EdgeEdge {
        let forward = dot(&self.area, outward) >= 0.0;
        let normal = scale(if forward { 1.0 } else { -1.0 } / self.size, &self.area);
        EdgeEdge {
            normal,
            gap: dot(&self.from, &normal),
            foot: self.foot,
            sine: self.sine,
            area: self.size,
            outward: dot(&normal, outward),
            forward,
        }
    }
}

impl EdgeEdge {
    /// Returns the distance of the foot points outside the edges of these lengths, m; ≤ 0 within.
    pub(crate) fn foot_distance(&self, lengths: [f64; 2]) -> f64 {
        let beyond = |k: usize| (-self.foot[k]).max(self.foot[k] - 1.0) * lengths[k];
        beyond(0).max(beyond(1))
    }
}

/// Relative velocity of the material of two edges at the points `foot`, main minus target, as a
/// linear map of the velocities of their ends. The target material is moved to the main point with
/// the rotation of the two edges. Then a rigid motion of all four ends has no relative velocity.
///
/// With m normal to both directions d₁ and d₂, a rotation ω changes them by ω·(d₁×m) = m·d₁',
/// ω·(d₂×m) = m·d₂' and ω·m = (m×d₂)·d₂'/|d₂|².
#[derive(Clone, Copy, Debug)]
pub(super) struct NormalRotation {
    normal: [f64; 3],
    foot: [f64; 2],
    /// From the target point to the main point, m.
    offset: [f64; 3],
    /// Coefficients of ω for m·d₁', m·d₂' and (m×d₂)·d₂': the dual basis of d₁×m, d₂×m and m.
    by_main: [f64; 3],
    by_target: [f64; 3],
    about_normal: [f64; 3],
    /// m×d₂.
    beside: [f64; 3],
}

impl NormalRotation {
    /// Makes the map. If the edges have turned parallel, the rotation about the other axes is not
    /// defined and counts as zero.
    pub(super) fn new(
        [main, target]: [&[[f64; 3]; 2]; 2],
        foot: &[f64; 2],
        normal: &[f64; 3],
        are_parallel: bool,
    ) -> Self {
        let (along, other) = (sub(&main[1], &main[0]), sub(&target[1], &target[0]));
        let mut offset = sub(&main[0], &target[0]);
        add_scaled(&mut offset, foot[0], &along);
        add_scaled(&mut offset, -foot[1], &other);
        let (one, two) = (cross(&along, normal), cross(&other, normal));
        let volume = dot(&one, &cross(&two, normal));
        let inverse = if are_parallel { 0.0 } else { 1.0 / volume };
        Self {
            normal: *normal,
            foot: *foot,
            offset,
            by_main: scale(inverse, &cross(&two, normal)),
            by_target: scale(inverse, &cross(normal, &one)),
            about_normal: scale(1.0 / dot(&other, &other), normal),
            beside: cross(normal, &other),
        }
    }

    /// Returns the vector from the target point to the main point, m.
    pub(super) fn offset(&self) -> &[f64; 3] {
        &self.offset
    }

    /// Returns the coefficients of the ends for a direction: main edge first, then target edge.
    pub(super) fn rows(&self, direction: &[f64; 3]) -> [[f64; 3]; 4] {
        let moment = cross(&self.offset, direction);
        let turn_main = scale(dot(&self.by_main, &moment), &self.normal);
        let mut turn_target = scale(dot(&self.by_target, &moment), &self.normal);
        let about_normal = dot(&self.about_normal, &moment);
        add_scaled(&mut turn_target, about_normal, &self.beside);
        let row = |weight: f64, sign: f64, turn: &[f64; 3]| {
            let mut row = scale(weight, direction);
            add_scaled(&mut row, -sign, turn);
            row
        };
        let [one, other] = self.foot;
        [
            row(1.0 - one, -1.0, &turn_main),
            row(one, 1.0, &turn_main),
            row(other - 1.0, -1.0, &turn_target),
            row(-other, 1.0, &turn_target),
        ]
    }
}

/// Returns the distance of two edges, m (\[Ericson2005\], section 5.1.9).
pub(crate) fn distance(main: &[[f64; 3]; 2], target: &[[f64; 3]; 2]) -> f64 {
    let (along, other) = (sub(&main[1], &main[0]), sub(&target[1], &target[0]));
    let from = sub(&main[0], &target[0]);
    let (a, e, f) = (dot(&along, &along), dot(&other, &other), dot(&other, &from));
    let (b, c) = (dot(&along, &other), dot(&along, &from));
    let denominator = a * e - b * b;
    let mut s = if denominator > 0.0 {
        ((b * f - c * e) / denominator).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let mut t = (b * s + f) / e;
    if !(0.0..=1.0).contains(&t) {
        t = t.clamp(0.0, 1.0);
        s = ((b * t - c) / a).clamp(0.0, 1.0);
    }
    let mut apart = from;
    add_scaled(&mut apart, s, &along);
    add_scaled(&mut apart, -t, &other);
    norm(&apart)
}
