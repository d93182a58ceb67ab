//! All numerical constants of contact.
//!
//! A constant over the tolerance, or relative, has no unit. Each says its meaning, its reason
//! and its measurement.

// Surfaces.

/// Cosine between what parts of one feature look to, at least.
pub(crate) const LIKE_NORMALS: f64 = 0.5;

/// Angle at rest, rad, up to which parts of one flat face or straight edge differ; and how
/// far a mark on either lies beside it, over its size.
pub(crate) const SAME_FEATURE_ANGLE: f64 = 1e-6;

/// Sine of the angle up to which two features count as flush and a vertex as
/// lying inside a flat boundary.
///
/// A corner drawn a length s into its face, as for shrunken edges, stays in the plane
/// of contact to within the tolerance d where the sine is d/s or less: this is
/// s = 50 d, by default a 200th of the smallest edge. It must be above the angle that
/// d hides over such an edge, 1e-4, and the rotations of small strain, 1e-2; and below
/// turns that are meant, as of a circle of 300 edges. It names contacts and breaks ties
/// among what touches within d anyway: half of it and twice as much give the same bounces
/// of the six types, to all digits printed, and motion does not jump where a tilt
/// passes it (`crates/cdem-verify/tests/solid/tilt.rs`).
pub(crate) const FLUSH: f64 = 0.02;

/// Relative round-off of a foot's parameters on its target.
pub(crate) const FOOT_ROUND_OFF: f64 = 1e-9;

/// Most of what is [beyond a re-entrant edge](crate::contact::surface::beyond_reentrant), over the depth.
pub(crate) const FARTHEST_BEYOND: f64 = 1.0 / FLUSH;

/// Turn of the boundary at an edge, rad, from which on it is sharp whatever its
/// size.
pub(crate) const SHARP: f64 = 0.1;

/// cos [`SHARP`].
pub(crate) const COSINE_OF_SHARP: f64 = 0.995_004_165_278_025_8;

/// Sine of the turn, either way, up to which a glance at an edge may tell that it is flat, below
/// that of [`SHARP`]; and what it allows of what an edge may stand out: the angle of this sine is
/// larger by 1.4e-3 of it.
pub(crate) const FLAT_EDGE: f64 = 0.09;

pub(crate) const FLAT_CAUTION: f64 = 0.99;

/// Sine up to which the angle is its series to the third power, to round-off.
pub(crate) const ANGLE_SERIES: f64 = 1e-3;

/// What a straight edge laid across a flat one may sink in, over the tolerance of
/// contact.
pub(crate) const SAGITTA: f64 = 0.25;

/// Turn, rad, of an edge that is clearly re-entrant.
pub(crate) const REENTRANT: f64 = -0.1;

/// Turn, rad, up to which the first order says enough with a tenth of a radian to spare.
pub(crate) const FIRST_ORDER_TURN: f64 = 0.5;

/// Nodes of an edge or a triangle at most: those of a quadrilateral.
pub(crate) const MOST_NODES_OF_FEATURE: usize = 4;

// Narrow phase.

/// How far an end of the shorter of two edges may lie aside of the other, over the
/// tolerance of contact, where they still count as parallel: they meet at their ends
/// then, up to that much late.
pub(crate) const CLOSE_TO_PARALLEL: f64 = 0.1;

/// Sine of the angle below which two edges count as parallel in any case: round-off of
/// their feet and normal is ε over the sine.
pub(crate) const PARALLEL_SINE: f64 = 1e-7;

/// Turn of a vertex's edges against a triangle, rad, for ways of both blocks' nodes that
/// add up to their size s. Ways w₁ and w₂ turn an edge by 2w₁/s and the triangle by
/// 2w₂/s at first order; twice that holds however far they go.
pub(crate) const FACE_TURN_RATE: f64 = 4.0;

/// The same of faces against the common normal of two edges, with s times the sine of
/// the angle between these: 2w/s for a face, 2√2 w₁/s for one beside its own edge, and
/// 2 (w₁ + w₂)/s for the normal.
pub(crate) const EDGE_TURN_RATE: f64 = 8.0;

/// The same of the normal against the sum of four normals of faces, which says on which
/// side of an edge the other's block lies: 4 · 2 (w₁ + w₂)/s for the normal, and 4w/s for
/// the two faces of either edge.
pub(crate) const SIDE_TURN_RATE: f64 = 16.0;

/// How much faster than the ways of both blocks together what a pair lacks may shrink:
/// by 1 in front of faces, 1.1 and 1.75 between edges (`shell::nearness`), 1.3 where
/// edges sharpen, all at first order. It ends before nodes have moved by a 16th of the
/// smallest length that bears on it, within which the rest is far less.
pub(crate) const CULLING_RATE: f64 = 4.0;

// Continuous collision detection.

/// Gap, over the tolerance, at which a pair that is about to touch, and no farther aside of
/// its target than the tolerance, joins an event that comes before: a 1e-8th of the smallest boundary edge by default.
pub(crate) const EARLY: f64 = 1e-4;

/// Overlap, over the tolerance, that is none: a 1e-6th of the smallest boundary edge
/// by default. A pair too slow to come deeper in a drift waits for the next kick,
/// which holds it: stones that settle would open and close one after the other, each
/// touch an impact of the whole pile.
pub(crate) const SHALLOW: f64 = 1e-2;

/// First touches within one substep that are taken at their own instants. Where
/// there are more, as when long faces meet at a small angle, those of the next
/// 1/16 of the substep become one event: closed a little early, never late.
pub(crate) const EVENTS: usize = 16;

/// Touches closer in time than this share of the substep are one event.
pub(crate) const SIMULTANEOUS: f64 = 1e-9;

/// Edges that turn less in a drift than by the angle of this cosine do not become parallel
/// in it; and how far their normal must point out of the target, to do so all the time.
pub(crate) const EDGE_STEADY: f64 = 0.5;

pub(crate) const EDGE_OUTWARD: f64 = 0.1;

/// Bisections that take an interval down to round-off.
pub(crate) const BISECTIONS: u32 = 64;

/// Instants, of those in which a pair falls behind its target's line or plane no deeper than
/// it may, at which it is looked at: what comes in and is out again between two of them
/// goes past a corner, or over a whole target in an eighth of that time.
pub(crate) const CCD_SAMPLES: u32 = 8;

/// Round-off of the volume, over the bound of its terms. A term is a product of up to
/// three differences, summed and multiplied by times: 16 roundings of half an ε at
/// most. The terms' moduli add up to 1.2 of the bound (Hadamard's for permanents), so
/// a third of this would do.
pub(crate) const VOLUME_ROUND_OFF: f64 = 32.0 * f64::EPSILON;

/// How far a pair that has touched may sink in a drift and rests, over the depth up to which
/// it has not.
pub(crate) const RESTING_SINK: f64 = 1e-3;

/// What a target keeps of the smaller of its sizes at both ends of a drift, at least: all
/// but a share that its nodes move over its height.
pub(crate) const LEAST_TARGET_SIZE: f64 = 0.5;

/// Depth, over the tolerance, at which a pair that sinks in is closed in a kick: a 1e-11th
/// of the smallest boundary edge by default. By as much points stay uneven that come to
/// rest; what has been left to sink in farther closes no later than at [`SHALLOW`].
pub(crate) const LEAST_DEPTH: f64 = 1e-7;

// Detection.

/// How far from a touch the main feature of a contact may be that says the same, over
/// the tolerance: either's point lies aside of its feature, and both aside of the touch.
pub(crate) const DUPLICATE_REACH: f64 = 4.0;

/// Coarse steps for which nodes stay joined after their pair was last near: a
/// change of levels costs energy, so they change seldom (design, section 3). And for
/// which islands stay one that need not.
pub(crate) const JOIN_STEPS: u64 = 32;

/// What blocks may have ahead more than when candidates were sorted out, over the largest of
/// their shares then: some nine steps at the present speeds.
pub(crate) const ACTIVE_STEPS: f64 = 4.0;

/// For how much more than that they are sorted out: far above round-off.
pub(crate) const ACTIVE_MARGIN: f64 = 1.25;

/// Cells beyond which coordinates are not resolved: boxes smaller than a
/// 2⁻⁴⁰th of the largest coordinate share the class of that size.
pub(crate) const GRID_RESOLUTION: i32 = 40;

/// The coarsest class, and less its number the finest: cells of 1e301 and
/// 1e-301 m. Coordinates beyond are no model's.
pub(crate) const COARSEST_CLASS: i32 = 1000;

/// Features of a patch, at most: a hexahedron has 104, mains and targets.
pub(crate) const MOST_FEATURES_OF_CLUSTER: usize = 128;

/// Speed to reckon with, over that which kicks have made. What is struck by
/// something heavy flies off at up to twice its speed, and so does the far end of
/// a rod that falls flat and hits something with its near end; kicks add to it.
pub(crate) const SPEED_GAIN: f64 = 2.25;

/// Share of a block at rest, over the tolerance. Edges within flat faces may be sharp
/// once nodes have moved by a few times this.
pub(crate) const LEAST_REACH: f64 = 0.02;

/// Distance of features that the surface takes for near, over reach and tolerance,
/// at most: √2 where both are spent along the target and along its normal.
pub(crate) const DISTANCE_CHECKED: f64 = 1.5;

/// The same with what round-off may add to distances and ways: a tenth of the
/// tolerance, which is far above.
pub(crate) const DISTANCE_KEPT: f64 = 1.6;

/// What round-off may add to what pairs lack, over the tolerance; it is far below.
pub(crate) const CULLING_ROUND_OFF: f64 = 0.01;

/// Ways of both blocks together for which a pair that was near counts as near: over the
/// tolerance at least, and over its reach, some nine steps at the present speeds.
pub(crate) const NEAR_MARGIN: f64 = 0.25;

pub(crate) const NEAR_MARGIN_IN_MOTION: f64 = 4.0;

/// Coarse steps at the present speeds for which a broad phase serves, about; and
/// how far blocks may move at least until the next, over the tolerance: a 20th of
/// the smallest boundary edge by default.
pub(crate) const BROAD_PHASE_STEPS: f64 = 11.0;

pub(crate) const BROAD_PHASE_STEPS_AT_REST: f64 = 500.0;

/// What round-off may add to distances and ways, over the tolerance; it is far
/// below.
pub(crate) const SEPARATION_ROUND_OFF: f64 = 0.1;

/// Way of a block, over the tolerance, at which all pairs are looked at anew: a
/// hundred of the smallest boundary edge by default. A billion substeps later its
/// round-off is within the above.
pub(crate) const STALE_TRAVEL: f64 = 1e6;

/// For how much those that may touch are sorted out, over what a touch in the next drift
/// takes.
pub(crate) const SEPARATION_DRIFTS: f64 = 16.0;

// Constraints.

/// How far the gaps of closed contacts may miss what they are to be at the end of
/// a drift, over the tolerance, and how often the island is solved again for it.
/// Gaps are asked for along their present gradients; those of points that slide
/// along a turning edge change besides, by the square of the drift.
pub(crate) const MISS: f64 = 0.1;

/// Relative move that is round-off, over the tolerance: a 1e-14th of the smallest
/// boundary edge by default.
pub(crate) const LEAST_MOVE: f64 = 1e-10;

/// Round-off of a gap, over the coordinates of its nodes.
pub(crate) const GAP_ROUND_OFF: f64 = 8.0 * f64::EPSILON;

/// Share of what a gap is wrong by that a step sets right. All of it at once (SHAKE)
/// hands on what a solve has left, as a kick against all that presses. A solve that
/// brings some impulses nearer by a share η of what they miss makes oscillators of gaps,
/// damped by √(η/AIM)/2 of the critical: a wall of 210 stones, with solves that ended at
/// 1e-4, gained 8 W at 1, 0.6 W at 0.1, and next to nothing at this.
pub(crate) const GAP_CORRECTION: f64 = 0.02;

/// What a gap may be wrong by and is right, over the tolerance: a 1e-7th of the smallest
/// boundary edge by default. Where contacts are more than freedoms, gaps contradict each
/// other by what solves have missed and bodies bent. To set that right is to ask for what
/// cannot be: impulses grow and shrink from step to step, until a contact opens or slips
/// and all begins anew, and a wall of 210 stones stirs for ever, at 1e-6 m/s. What is
/// right asks for no motion, on which all contacts agree.
pub(crate) const GAP_DEAD_BAND: f64 = 1e-3;

/// Penetration that is left as it is, over the tolerance. To take it out of the
/// positions compresses the bodies more where they press on each other, and makes
/// energy; it need only stay so far below the tolerance that what comes on top is
/// still found.
pub(crate) const CORRECTED_PENETRATION: f64 = 0.5;

/// Overlap that a change of mesh may make, over the tolerance: what gaps may miss at the end
/// of any drift.
pub(crate) const SLIGHT_OVERLAP: f64 = MISS;

/// Contacts of a block that are lifted one after the other, at most.
pub(crate) const LIFT_STEPS: usize = 64;

// Solver.

pub(crate) const AGAIN: usize = 2;

/// Residual of a solve of which the user should know: forces of contacts are
/// wrong by as much, until the next step goes on from there.
pub(crate) const UNSOLVED: f64 = 1e-2;

/// How far the force of a contact is taken to go on changing as it did: where forces swing,
/// solves begin an order nearer to their ends than from the last forces, and take two thirds
/// of the sweeps. Not all of it: what does not matter to any velocity, as between contacts
/// that are more than freedoms, would go on for ever.
pub(crate) const FORCE_TREND: f64 = 0.95;

/// Curvature along a direction in which impulses change no velocity, over that
/// of each contact alone: round-off.
pub(crate) const LEAST_CURVATURE: f64 = 1e-14;

/// Most that an impulse may change in a step, in terms of the velocity it makes
/// alone, over the largest of these: contacts that all but contradict each other
/// press and pull without bound, and what cancels between them leaves round-off
/// in the momenta.
pub(crate) const LARGEST_GROWTH: f64 = 1e3;

/// Nodes that one mass matrix couples, at most, where gains of each contact are fewer bytes than
/// processors wait for: two packs of a component.
pub(crate) const SMALL_BLOCK_NODES: usize = 16;

/// Residual at which a solve is done: change of relative velocity in a sweep
/// over the largest that the impulses make. What is left is a position error
/// of 1e-8 of a kick's displacement, far below the positions' own round-off,
/// and the next step corrects it.
pub(crate) const RESIDUAL: f64 = 1e-8;

/// Sweeps in which the residual falls to [`STALL_RATIO`] of what it was, or they do
/// not get on.
pub(crate) const STALL_SWEEPS: u32 = 8;

pub(crate) const STALL_RATIO: f64 = 0.2;

/// Steps of the first descent; each next one may take twice as many.
pub(crate) const CG_STEPS: u32 = 16;

/// How often it is doubled, at most.
pub(crate) const LONGEST_CG_DOUBLING: u32 = 7;

/// Share of the residual to which a descent and the sweeps after it must come, or the next
/// but one is not made: impulses that contacts which contradict each other could only
/// balance far away are not looked for.
pub(crate) const CG_WORTH: f64 = 0.5;

pub(crate) const CG_TRIES: u32 = 2;

/// What a contact takes for itself of the velocity that a change of its impulse makes,
/// once descents are no longer worth it: the change from what the solve began with is
/// held back by that share (proximal point, \[Rockafellar1976\]). Of all impulses that do,
/// or all but do where they contradict each other, those nearest to the start's are
/// found: the last kick's, or none in an impact. What is missed for it the next kick
/// finds, and is nearer.
pub(crate) const PROXIMAL_WEIGHT: f64 = 1e-3;

/// Sweeps with reluctance, at most.
pub(crate) const LAST_SWEEPS: u32 = 128;

/// Contacts of an island in which none sleeps, and whose impacts are solved as far as kicks.
pub(crate) const FEW_CONTACTS: usize = 128;

/// What a visit may have changed of a relative velocity, over that at which a solve is done,
/// of a contact that falls asleep.
pub(crate) const CONVERGED_FRACTION: f64 = 0.3;

/// Round-off of a relative velocity, over the largest velocity in it.
pub(crate) const SOLVE_ROUND_OFF: f64 = 8.0 * f64::EPSILON;

/// Most sweeps and steps of descents of a solve.
pub(crate) const MAX_SWEEPS: u32 = 2000;

/// Inverse mass of a row whose nodes are held, over what it would be of free
/// ones: round-off.
pub(crate) const NEGLIGIBLE_MOBILITY: f64 = 1e-12;

/// Share of its contacts, one in so many, that must sink in for those closed before in the
/// same kick to have the island solved once more. Fewer wait for the next kick: those are
/// one or two at a time, for many rounds, in a large island that settles.
pub(crate) const PAIRS_WORTH_A_SOLVE: usize = 64;

/// Residual at which the solve of an impact is done in an island of more than [`FEW_CONTACTS`]
/// contacts: what it leaves the next kick finds, and no position is wrong by more than a
/// 1e-6th of a drift. To go on to [`RESIDUAL`] takes three times as long.
pub(crate) const CROWD_RESIDUAL: f64 = 1e-6;

// Grain sizes: they bound the overhead of threads and registers.

/// Pairs whose island a thread finds in a row.
pub(crate) const PAIRS_PER_TASK: usize = 1024;

/// Points of a task, at least, where there are more: some 15 µs of sweeping.
pub(crate) const CONTACTS_PER_COLOUR_TASK: usize = 64;

/// Tasks of a colour, in points awake, for which threads are called.
pub(crate) const COLOUR_TASKS_WORTH_A_THREAD: usize = 4;

/// Groups of which a point each is visited in turn: a point of the same group waits for
/// what the one before has made of its nodes.
pub(crate) const CONTACTS_ABREAST: usize = 4;

/// Contacts that a thread takes at once, where each is on its own: to call one takes as long as
/// some tens of them.
pub(crate) const CONTACTS_PER_TASK: usize = 256;

/// Packs that a thread takes at once, at most.
pub(crate) const BLOCKS_PER_TASK: usize = 8192;

/// Parts of the islands for each thread: one that is done early takes up another's.
pub(crate) const TASKS_PER_THREAD: usize = 4;

/// Nodes for each contact, at most, that each part may have copied: in a kick the velocity of a
/// node takes a thousandth of the time of a contact, in a drift all of a node three times that,
/// of contacts that are solved three times or more.
pub(crate) const NODES_PER_CONTACT: usize = 50;

/// Contacts beside those of the largest island, at least, for which threads are called: some
/// 30 µs of work.
pub(crate) const CONTACTS_WORTH_A_THREAD: usize = 64;

/// Pairs whose touch a thread foresees, at least: to wake it takes as long.
pub(crate) const PREDICTIONS_PER_TASK: usize = 32;

/// Patches, or pairs of them, that a thread takes in a row.
pub(crate) const CLUSTERS_PER_TASK: usize = 32;

/// Pairs that a thread looks at in a row, and pairs of which it sees whether it has to.
pub(crate) const CANDIDATES_PER_TASK: usize = 256;

pub(crate) const GLANCES_PER_TASK: usize = 2048;

/// How many values are cleared together: those of features near each other.
pub(crate) const CACHE_CHUNK: usize = 32;

/// Triangles for each pair looked at, or contact held, at most, for which room pays.
pub(crate) const CACHE_WORTH_PAIRS: usize = 3;
