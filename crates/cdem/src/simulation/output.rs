//! Output of a run: plain rows and frames, for the code that writes them.
//!
//! All values of one instant are synchronised (half of the kick that is due at that instant is
//! included). Vectors have three components; in 2-D the third is 0 and only the third of angular
//! quantities is used.

pub use crate::contact::surface::contact_kind::ContactKind;

/// A row of `history.csv`. Energies J, momenta N·s and N·m·s; sums since t = 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs)] // the fields are the columns of the contract
pub struct HistoryRow {
    pub step: u64,
    pub time: f64,
    /// ½ v⁻·M·v⁺ of the half steps before and after. Central differences conserve this plus the
    /// strain energy.
    pub kinetic_energy: f64,
    pub strain_energy: f64,
    pub external_work: f64,
    pub gravity_work: f64,
    pub impact_loss: f64,
    pub friction_loss: f64,
    pub damping_loss: f64,
    pub fracture_loss: f64,
    /// Energy lost to changes of the mesh or of time levels.
    pub remesh_loss: f64,
    pub correction_loss: f64,
    pub energy_residual: f64,
    pub momentum: [f64; 3],
    pub angular_momentum: [f64; 3],
    pub impulse: [f64; 3],
    pub contacts: u64,
    pub refined_blocks: u64,
    pub elements: u64,
}

impl HistoryRow {
    /// True if energies, residual and momenta are finite. They are sums over the whole state, so
    /// all other output of this instant is finite too.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let energies = [
            self.kinetic_energy,
            self.strain_energy,
            self.energy_residual,
        ];
        let momenta = self.momentum.iter().chain(&self.angular_momentum);
        energies.iter().chain(momenta).all(|x| x.is_finite())
    }
}

/// A row of `blocks.csv`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BlockRow {
    /// Time, s.
    pub time: f64,
    /// Name of the block.
    pub block: String,
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass, m.
    pub position: [f64; 3],
    /// Velocity of the centre of mass, m/s.
    pub velocity: [f64; 3],
    /// Angular velocity, rad/s.
    pub angular_velocity: [f64; 3],
    /// Resultant contact force, averaged since the last row, N.
    pub force: [f64; 3],
}

/// A row of `contacts.csv`: the life of one contact point.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactRow {
    /// Name of the main block (it gives the vertex).
    pub main: String,
    /// Name of the target block.
    pub target: String,
    /// Configuration of the two blocks when the contact begins.
    pub kind: ContactKind,
    /// First touch, s.
    pub time_on: f64,
    /// Separation, s; `None` while it lasts.
    pub time_off: Option<f64>,
    /// Place of the first touch, m.
    pub position: [f64; 3],
    /// Largest impulse in a coarse step divided by the step, N.
    pub peak_normal_force: f64,
    /// Sum of normal impulses, N·s.
    pub normal_impulse: f64,
    /// Path length of the shear impulse, N·s.
    pub shear_impulse: f64,
    /// Path length of the slip, m.
    pub slip: f64,
    /// Number of halvings of the elements at the contact point, on the finer side.
    pub level: u32,
}

/// A row of `probes.csv`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProbeRow {
    /// Time, s.
    pub time: f64,
    /// Name of the probe.
    pub probe: String,
    /// Position, m.
    pub position: [f64; 3],
    /// Displacement, m.
    pub displacement: [f64; 3],
    /// Velocity, m/s.
    pub velocity: [f64; 3],
}

/// A frame: cells, points and fields of the whole model at one instant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// Time, s.
    pub time: f64,
    /// Current positions of the points, m.
    pub points: Vec<[f64; 3]>,
    /// Kind of each cell.
    pub kinds: Vec<crate::mesh::ElementKind>,
    /// Points of all cells, one cell after the other.
    pub connectivity: Vec<u32>,
    /// Fields on points.
    pub point_fields: Vec<FrameField>,
    /// Fields on cells.
    pub cell_fields: Vec<FrameField>,
}

/// A named array of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameField {
    /// Name in ParaView.
    pub name: &'static str,
    /// Names of its components; empty for scalars.
    pub components: &'static [&'static str],
    /// The values, all components of the first item first.
    pub values: FieldValues,
}

/// Values of a field.
#[derive(Clone, Debug, PartialEq)]
pub enum FieldValues {
    /// Real numbers.
    Real(Vec<f64>),
    /// Whole numbers (block, material, level, refinement).
    Whole(Vec<i32>),
}

/// The contact points of one instant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactFrame {
    /// Time, s.
    pub time: f64,
    /// Contact points, m.
    pub points: Vec<[f64; 3]>,
    /// Unit normals, from target to main.
    pub normals: Vec<[f64; 3]>,
    /// Forces on the main block, N.
    pub forces: Vec<[f64; 3]>,
    /// Slip path, m.
    pub slips: Vec<f64>,
    /// Tributary area, m².
    pub areas: Vec<f64>,
}
