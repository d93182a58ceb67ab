//! All numerical constants of contact.
//!
//! A docstring tells the meaning with its unit, then the reason for the value, then the measurement
//! behind it. "Relative" values have no unit.

/// Contact resolution, relative to the smallest boundary edge: points of boundaries no farther
/// apart are not told apart. It is far above round-off and far below any feature.
pub(crate) const CONTACT_RESOLUTION: f64 = 1e-4;

// Surfaces.

/// Least cosine between the outward directions of two parts of one feature, dimensionless. A
/// smaller cosine means another feature at the same point, as the other lip of a crack.
pub(crate) const LIKE_NORMALS: f64 = 0.5;

/// Largest angle at rest between parts of one flat face or straight edge (rad); also the largest
/// distance of a material point beside its feature, relative to the size of the feature.
pub(crate) const SAME_FEATURE_ANGLE: f64 = 1e-6;

/// Sine of the largest angle at which two features count as flush, and at which a vertex counts as
/// inside a flat boundary, dimensionless.
///
/// With shrunken edges, a corner moved a length s into its face stays in the plane of contact to
/// within the resolution d if the sine is d/s or less. Here s = 50 d, a 200th of the
/// smallest edge. The value must be above the angle that d hides over such an edge, 1e-4, and above
/// the rotations of small strain, 1e-2. It must be below intended turns, as of a circle of 300
/// edges. It classifies contacts and breaks ties among features that touch within d anyway. Half
/// and twice the value give the same bounces of the six types, to all digits printed. Motion does
/// not jump where a tilt passes the value (`crates/cdem-verify/tests/solid/tilt.rs`). It also limits the
/// rise of a boundary along which a new contact slides on in the drift of its impact.
pub(crate) const FLUSH: f64 = 0.02;

/// Round-off of the parameters of a foot point on its target, relative to the size of the target.
pub(crate) const FOOT_ROUND_OFF: f64 = 1e-9;

/// Largest result of [`beyond_reentrant`](crate::contact::surface::beyond_reentrant), relative to
/// the depth.
pub(crate) const FARTHEST_BEYOND: f64 = 1.0 / FLUSH;

/// Turn of the boundary at an edge from which the edge is sharp whatever its size (rad).
pub(crate) const SHARP: f64 = 0.1;

/// Cosine of [`SHARP`], dimensionless.
pub(crate) const COSINE_OF_SHARP: f64 = 0.995_004_165_278_025_8;

/// Sine of the largest turn, either way, at which the test without a root may call an edge flat,
/// dimensionless. It must be below the sine of [`SHARP`].
pub(crate) const FLAT_EDGE: f64 = 0.09;

/// Fraction of the allowed height of an edge that the test without a root uses, dimensionless. It
/// must cover the difference of angle and sine: at [`FLAT_EDGE`] the angle is larger by 1.4e-3 of
/// it.
pub(crate) const FLAT_CAUTION: f64 = 0.99;

/// Sine up to which its third-order series gives the angle to round-off, dimensionless.
pub(crate) const ANGLE_SERIES: f64 = 1e-3;

/// Largest depth to which a straight edge laid across a flat edge may sink in, relative to the
/// contact resolution.
pub(crate) const SAGITTA: f64 = 0.25;

/// Turn of a clearly re-entrant edge (rad).
pub(crate) const REENTRANT: f64 = -0.1;

/// Largest turn for which the first order is accurate enough, with a tenth of a radian to spare
/// (rad).
pub(crate) const FIRST_ORDER_TURN: f64 = 0.5;

/// Most nodes of an edge or a triangle (count): those of a quadrilateral.
pub(crate) const MOST_NODES_OF_FEATURE: usize = 4;

// Narrow phase.

/// Sine of the angle below which two edges always count as parallel, dimensionless. The round-off
/// of their feet and normal is ε over the sine.
pub(crate) const PARALLEL_SINE: f64 = 1e-7;

/// Turn of the edges of a vertex against a triangle (rad), if the travels of the nodes of both
/// blocks add up to their size s. Travels w₁ and w₂ turn an edge by 2w₁/s and the triangle by 2w₂/s
/// at first order. Twice the sum holds for any travel.
pub(crate) const FACE_TURN_RATE: f64 = 4.0;

/// Turn of faces against the common normal of two edges (rad), if the travels of the nodes of both
/// blocks add up to s times the sine of the angle between the edges. A face turns by 2w/s, a face
/// beside its own edge by 2√2 w₁/s, and the normal by 2 (w₁ + w₂)/s.
pub(crate) const EDGE_TURN_RATE: f64 = 8.0;

/// Turn of the common normal against the sum of four face normals (rad), for the same travels. The
/// sum tells on which side of an edge the block of the other edge lies. The turn of the normal
/// counts 4 · 2 (w₁ + w₂)/s, that of the two faces of either edge 4w/s.
pub(crate) const SIDE_TURN_RATE: f64 = 16.0;

/// Rate at which the [exclusion length](crate::contact::surface::Distance::exclusion) may change,
/// relative to the sum of the travels of both blocks. At first order the rate is 1 in front
/// of faces, 1.1 and 1.75 between edges (`narrow_phase/culling.rs`), and 1.3 where edges sharpen.
/// The length is used up before nodes have moved by a 16th of the smallest length involved; the
/// higher orders are far smaller there.
pub(crate) const CULLING_RATE: f64 = 2.0;

// Continuous collision detection.

/// Largest gap at which a pair about to touch joins an earlier event, relative to the contact
/// resolution: a 1e-8th of the smallest boundary edge. Its foot point must lie no farther
/// outside the target than the resolution.
pub(crate) const EARLY_GAP: f64 = 1e-4;

/// Penetration that counts as none, relative to the contact resolution: a 1e-6th of the smallest
/// boundary edge. A pair too slow to sink in deeper in a drift waits for the next kick.
/// Otherwise settling stones would open and close one after the other, and each touch would be an
/// impact of the whole pile.
pub(crate) const IGNORED_PENETRATION: f64 = 1e-2;

/// Most first touches within one substep that keep their own instants (count). If there are more,
/// as when long faces meet at a small angle, the touches of the next 1/16 of the substep become one
/// event. They close a little early, never late.
pub(crate) const EVENTS: usize = 16;

/// Least cosine of the turn of the common normal of two edges in a drift, dimensionless. Edges that
/// turn less do not become parallel in the drift.
pub(crate) const EDGE_STEADY: f64 = 0.5;

/// Least component of the common normal of two edges along the outward direction of the target,
/// dimensionless. With it, the normal points out of the target during the whole drift.
pub(crate) const EDGE_OUTWARD: f64 = 0.1;

/// Most bisections of an interval (count): they reduce it to round-off.
pub(crate) const BISECTIONS: u32 = 64;

/// Instants at which a pair is tested while it is behind the line or plane of its target, no deeper
/// than allowed (count). A point that enters and leaves between two of them goes past a corner, or
/// crosses a whole target in an eighth of that time.
pub(crate) const CCD_SAMPLES: u32 = 8;

/// Round-off of a signed volume, relative to the bound of its terms. A term is a product of up to
/// three differences, summed and multiplied by times: 16 roundings of half an ε at most. The moduli
/// of the terms add up to 1.2 of the bound (Hadamard's for permanents), so a third of this would
/// do.
pub(crate) const VOLUME_ROUND_OFF: f64 = 32.0 * f64::EPSILON;

/// Largest sink in a drift at which a pair that is already too deep still rests, relative to the
/// depth allowed to other pairs.
pub(crate) const RESTING_SINK: f64 = 1e-3;

/// Least size of a target during a drift, relative to the smaller of its sizes at both ends. The
/// target loses only the fraction of its size that its nodes move over its height.
pub(crate) const LEAST_TARGET_SIZE: f64 = 0.5;

/// Depth at which a sinking pair is closed in a kick, relative to the contact resolution: a 1e-11th
/// of the smallest boundary edge. Points that come to rest stay uneven by as much. A
/// pair left to sink in farther closes at [`IGNORED_PENETRATION`] at the latest.
pub(crate) const LEAST_DEPTH: f64 = 1e-7;

// Detection.

/// Largest distance between a touch and the main feature of a closed contact point that may be the
/// same contact, relative to the contact resolution. The point of either may lie outside its
/// feature, and both may lie beside the touch.
pub(crate) const DUPLICATE_REACH: f64 = 4.0;

/// Coarse steps for which nodes stay joined after their pair was last near (count), and for which
/// islands stay joined without need. A change of time levels costs energy, so they change seldom
/// (design, section 3).
pub(crate) const JOIN_STEPS: u64 = 32;

/// Further travel of the blocks for which the list of active candidates serves, relative to the
/// largest motion bound: some nine steps at the present speeds.
pub(crate) const ACTIVE_STEPS: f64 = 4.0;

/// Travel for which active candidates are selected, relative to the travel for which the list
/// serves. The excess is far above round-off.
pub(crate) const ACTIVE_MARGIN: f64 = 1.25;

/// Binary digits of coordinates that the grid resolves (count): boxes smaller than a 2⁻⁴⁰th of the
/// largest coordinate share the size class of that size.
pub(crate) const GRID_RESOLUTION: i32 = 40;

/// Exponent of the coarsest size class, and the finest is its negative (count): cells of 1e301 and
/// 1e-301 m. No model has coordinates beyond.
pub(crate) const COARSEST_CLASS: i32 = 1000;

/// Most features of a cluster, mains and targets (count): a hexahedron has 104.
pub(crate) const MOST_FEATURES_OF_CLUSTER: usize = 128;

/// Speed assumed in the motion bounds, relative to the largest speed after the kick. A light body
/// hit by a heavy one leaves at up to twice its speed. So does the far end of a rod that falls flat
/// and hits something with its near end. Kicks add to it.
pub(crate) const SPEED_GAIN: f64 = 2.25;

/// Motion bound of a block at rest, relative to the contact resolution. Edges within flat faces may
/// become sharp once nodes have moved by some ten times this.
pub(crate) const LEAST_MOTION_BOUND: f64 = 0.005;

/// Distance by which a bound on motion must clear a limit to tell without a test if a pair is near,
/// relative to the contact resolution. It is far above the round-off of distances and travels.
pub(crate) const BOUND_SLACK: f64 = 1e-3;

/// Largest travel of a block since the last broad phase plus its motion bound, relative to its motion
/// bound.
pub(crate) const BROAD_PHASE_STEPS: f64 = 11.0;

/// Least value of that allowance for travel and motion bound, relative to the contact resolution: a
/// 20th of the smallest boundary edge.
pub(crate) const BROAD_PHASE_STEPS_AT_REST: f64 = 500.0;

/// Allowance for round-off of distances and travels, relative to the contact resolution. The
/// round-off is far below.
pub(crate) const SEPARATION_ROUND_OFF: f64 = 0.1;

/// Travel of a block at which all pairs are measured again, relative to the contact resolution: a
/// hundred of the smallest boundary edge. After a billion more substeps the round-off of
/// the travel is still within [`SEPARATION_ROUND_OFF`].
pub(crate) const STALE_TRAVEL: f64 = 1e6;

/// Travel for which the pairs that may touch are selected, relative to the travel of the next
/// drift.
pub(crate) const SEPARATION_DRIFTS: f64 = 16.0;

// Constraints.

/// Gap, depth or slip that counts as an error of a closed contact, relative to the contact resolution:
/// from it on solves are repeated for the quadratic change of a gap, contacts count as open, feet
/// follow creep, a pair beside a contact counts as uncovered, one pair of a touch counts as deeper than
/// another, and a gap counts as kept. Smaller ones are left to the next kick, or to [`GAP_CORRECTION`].
/// With 0.01 and 0.03 for the pairs of a touch, walls that are hit pushed blocks along at their common
/// edges; with 0.5 edges nearly parallel sank in.
pub(crate) const GAP_ERROR: f64 = 0.1;

/// Largest turn of the normal of a sliding contact in a drift, rad. Beyond it the contact has parted: a
/// push along the normal opens a gap along the turned one by less than 0.7 of it, so repeated solves
/// push more and more. Edges all but parallel turn so. Without this limit three cubes got 11 % of
/// their energy in one kick; at 26 degrees edges sink in.
pub(crate) const MOST_TURN: f64 = std::f64::consts::FRAC_PI_4;

/// Bisections of a drift for the instant at which a sliding contact parts (count). The instant is
/// exact to a 1000th of the drift.
pub(crate) const PARTING_BISECTIONS: u32 = 10;

/// Relative displacement that is round-off, relative to the contact resolution: a 1e-14th of the
/// smallest boundary edge.
pub(crate) const LEAST_MOVE: f64 = 1e-10;

/// Round-off of a gap, relative to the coordinates of its nodes.
pub(crate) const GAP_ROUND_OFF: f64 = 8.0 * f64::EPSILON;

/// Fraction of the error of a gap that one coarse step corrects, dimensionless. A full correction
/// turns the error that a solve has left into a kick against all pressing contacts. A solve that
/// reduces the error of some impulses by a fraction η turns gaps into oscillators, damped by
/// √(η/`GAP_CORRECTION`)/2 of the critical damping. A wall of 210 stones, with solves that ended at
/// 1e-4, gained 8 W at 1, 0.6 W at 0.1, and next to nothing at this value. At all time levels the
/// correction has the same velocity: by this fraction in each substep, gap errors that a change of
/// mesh had left gave large impulses, and a wall of 14 stones got 200 times its energy.
pub(crate) const GAP_CORRECTION: f64 = 0.02;

/// Error of a gap that is not corrected, relative to the contact resolution: a 1e-7th of the
/// smallest boundary edge. With more contact points than degrees of freedom, the gaps
/// contradict each other, because of solver errors and the bending of bodies. A correction then has
/// no solution: impulses grow and shrink from step to step, until a contact opens or slips, and the
/// cycle repeats. A wall of 210 stones then moves for ever, at 1e-6 m/s. Gaps in the dead band
/// request no motion, so they cannot contradict each other.
pub(crate) const GAP_DEAD_BAND: f64 = 1e-3;

/// Penetration that is not corrected, relative to the smaller of contact tolerance and resolution. A
/// correction of the positions compresses the bodies more where they press on each other, and makes
/// energy. The rest must only stay so far below the resolution that further penetration is still
/// found.
pub(crate) const CORRECTED_PENETRATION: f64 = 0.5;

/// Overlap that a change of mesh may make, relative to the contact resolution.
pub(crate) const SLIGHT_OVERLAP: f64 = GAP_ERROR;

/// Most contact points of a block that are lifted one after the other (count).
pub(crate) const LIFT_STEPS: usize = 64;

// Solver.

/// Most repeated solves of an island because of wrong gaps or new penetrations (count).
pub(crate) const MOST_REPEATED_SOLVES: usize = 2;

/// Residual of a solve above which the user is warned, dimensionless. Contact forces are wrong by
/// as much, until the next step continues from there.
pub(crate) const UNSOLVED: f64 = 1e-2;

/// Curvature of a direction in which impulses change no velocity, relative to the curvature of the
/// contact points alone: round-off.
pub(crate) const LEAST_CURVATURE: f64 = 1e-14;

/// Largest change of an impulse in a descent, in terms of the velocity that it makes alone, relative
/// to the largest of these velocities at the start of the solve. Contact points that nearly
/// contradict each other press and pull without bound, and their cancellation leaves round-off in
/// the momenta.
pub(crate) const LARGEST_GROWTH: f64 = 1e2;

/// Most nodes coupled by one mass matrix for which the responses of each contact point are stored
/// (count): two SIMD blocks of a component. Above that, their bytes cost more time to load.
pub(crate) const SMALL_BLOCK_NODES: usize = 16;

/// Residual at which a solve is exact, dimensionless: the change of relative velocity in a sweep
/// over the largest that a normal impulse makes.
pub(crate) const RESIDUAL: f64 = 1e-8;

/// Sweeps and descent steps in which a solve may become exact (count). Blocks that meet in a few
/// points take two to twenty, a wall or a heap hundreds: a tenth of their modes is near zero. After
/// this number the patch test between unequal meshes still holds to 5e-4; after half of it, to 2 %.
pub(crate) const EXACT_SWEEPS: u32 = 32;

/// Residual at which the solve of a kick is done after [`EXACT_SWEEPS`], dimensionless. The next
/// kick begins with these impulses. What a solve must leave is less than 1/(1 +
/// [`GAP_CORRECTION`]) of an error in each mode. Sweeps there and back do; the steps of conjugate
/// gradients between them are covered by runs without damping alone, whose energy rises by less than
/// a 1e-4th of the strain energy.
pub(crate) const KICK_RESIDUAL: f64 = 1e-3;

/// Residual at which the solve of an impact is done after [`EXACT_SWEEPS`], dimensionless. The
/// remaining relative velocities are forces in the next kick, and hold its square of the energy of
/// the impact. In a heap of 36 rocks, exact solves take 1800 sweeps each; losses differ by 1e-5.
pub(crate) const IMPACT_RESIDUAL: f64 = 1e-4;

/// Residual at which a solve with joints is done after [`EXACT_SWEEPS`], dimensionless. A joint corrects
/// slips, so what solves leave of them does work. Two blocks joined at four points and hit by a third,
/// at twelve speeds, gained up to 71 times the energy at 1e-3, 1.4 % at 1e-4, and 4e-5 at 1e-5; another
/// pair 7.5 % at 1e-5. At this value both gain what they do with exact solves.
pub(crate) const JOINT_RESIDUAL: f64 = 1e-6;

/// Sweeps before the first step of nonlinear conjugate gradients (count). Many solves of blocks that
/// meet in a few points are done before it.
pub(crate) const PLAIN_SWEEPS: u32 = 7;

/// Sweeps in which the residual must fall to [`STALL_RATIO`] of its value (count). Otherwise the
/// sweeps have stalled.
pub(crate) const STALL_SWEEPS: u32 = 8;

/// Residual after [`STALL_SWEEPS`] sweeps above which they have stalled, relative to the residual
/// before them.
pub(crate) const STALL_RATIO: f64 = 0.2;

/// Steps of the first descent (count). Each next descent may take twice as many.
pub(crate) const CG_STEPS: u32 = 16;

/// Most doublings of the steps of a descent (count).
pub(crate) const LONGEST_CG_DOUBLING: u32 = 7;

/// Largest residual after a descent and its sweeps at which they were worth it, relative to the
/// best residual before. The solver does not search for impulses that contradicting contact points
/// could balance only far away.
pub(crate) const CG_WORTH: f64 = 0.5;

/// Descents in a row that were not worth it, after which a solve is given up (count).
pub(crate) const CG_TRIES: u32 = 2;

/// Round-off of a relative velocity, relative to the largest velocity in it.
pub(crate) const SOLVE_ROUND_OFF: f64 = 8.0 * f64::EPSILON;

/// Most sweeps and descent steps of a solve (count).
pub(crate) const MAX_SWEEPS: u32 = 2000;

/// Square of the lever of a contact row up to which the row belongs to prescribed nodes and has no
/// impulse, dimensionless. The square is the sum of the squared weights of the components that are not
/// prescribed: in the middle of a face of four free nodes 1/4. A row with a short lever asks free nodes
/// to undo the motion of prescribed ones: they must be faster by the inverse of the lever, here by 32,
/// and the impulse is larger by the inverse of its square. A block with nodes pressed into a corner at
/// 40 µm/s got 3.7 kJ in its first step when only levers of round-off counted as none.
pub(crate) const SHORT_LEVER_SQUARED: f64 = 1e-3;

/// Inverse fraction of its contact points that must newly penetrate for an island to be solved
/// again in the same kick, dimensionless. Fewer wait for the next kick. In a large island that
/// settles, there are one or two at a time, for many rounds.
pub(crate) const PAIRS_WORTH_A_SOLVE: usize = 64;

// Grain sizes: they bound the overhead of threads and registers.

/// Pairs whose island a thread finds in a row (count).
pub(crate) const PAIRS_PER_TASK: usize = 1024;

/// Least contact points of a task, if there are more (count): some 15 µs of a sweep.
pub(crate) const CONTACTS_PER_COLOUR_TASK: usize = 64;

/// Tasks of a colour, in active contact points, above which threads are used (count).
pub(crate) const COLOUR_TASKS_WORTH_A_THREAD: usize = 4;

/// Groups whose contact points are visited in turn, one of each (count). A contact point waits for
/// the node velocities of the one before it in its group.
pub(crate) const CONTACTS_ABREAST: usize = 4;

/// Independent contact points that a thread takes at once (count). Calling a thread takes as long
/// as some tens of them.
pub(crate) const CONTACTS_PER_TASK: usize = 256;

/// Most SIMD blocks that a thread takes at once (count).
pub(crate) const BLOCKS_PER_TASK: usize = 8192;

/// Tasks of islands for each thread (count). A thread that is done early takes the task of another.
pub(crate) const TASKS_PER_THREAD: usize = 4;

/// Most nodes that each task may copy for each contact point (count). In a kick the velocity of a
/// node takes a thousandth of the time of a contact point. In a drift all data of a node take three
/// times that, and contact points are solved three times or more.
pub(crate) const NODES_PER_CONTACT: usize = 50;

/// Least contact points outside the largest island for which threads are used (count): some 30 µs
/// of work.
pub(crate) const CONTACTS_WORTH_A_THREAD: usize = 64;

/// Difference of the times of two predicted touches that is round-off or its growth, over the horizon
/// of the prediction.
pub(crate) const SAME_TOUCH: f64 = 1e-6;

/// Least pairs whose touch a thread predicts (count). Waking a thread takes as long.
pub(crate) const PREDICTIONS_PER_TASK: usize = 32;

/// Clusters, or pairs of them, that a thread takes in a row (count).
pub(crate) const CLUSTERS_PER_TASK: usize = 32;

/// Candidate pairs that a thread tests in a row (count).
pub(crate) const CANDIDATES_PER_TASK: usize = 256;

/// Candidate pairs that a thread compares with their motion bounds in a row (count).
pub(crate) const BOUND_CHECKS_PER_TASK: usize = 2048;

/// Cached values that are cleared together (count): those of features near each other.
pub(crate) const CACHE_CHUNK: usize = 32;

/// Most triangles for each tested pair or closed contact point at which a geometry cache pays
/// (count).
pub(crate) const CACHE_WORTH_PAIRS: usize = 3;
