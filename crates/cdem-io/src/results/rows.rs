//! The columns of the tables.

use cdem::output::{BlockRow, ContactRow, HistoryRow, ProbeRow};

use super::table::Row;

pub(super) const HISTORY: &str = "step,time,\
    kinetic_energy,strain_energy,external_work,gravity_work,\
    impact_loss,friction_loss,damping_loss,fracture_loss,remesh_loss,correction_loss,\
    energy_residual,\
    momentum_x,momentum_y,momentum_z,\
    angular_momentum_x,angular_momentum_y,angular_momentum_z,\
    impulse_x,impulse_y,impulse_z,\
    contacts,refined_blocks,elements";

pub(super) const BLOCKS: &str = "time,block,mass,x,y,z,vx,vy,vz,wx,wy,wz,fx,fy,fz";

pub(super) const CONTACTS: &str = "main,target,type,time_on,time_off,x,y,z,\
    peak_normal_force,normal_impulse,shear_impulse,slip,level";

/// Index of `time_on` among the columns of contacts.
pub(super) const CONTACTS_TIME_ON: usize = 3;

pub(super) const PROBES: &str = "time,probe,x,y,z,ux,uy,uz,vx,vy,vz";

impl From<&HistoryRow> for Row {
    fn from(row: &HistoryRow) -> Self {
        Self::default()
            .whole(row.step)
            .real(row.time)
            .real(row.kinetic_energy)
            .real(row.strain_energy)
            .real(row.external_work)
            .real(row.gravity_work)
            .real(row.impact_loss)
            .real(row.friction_loss)
            .real(row.damping_loss)
            .real(row.fracture_loss)
            .real(row.remesh_loss)
            .real(row.correction_loss)
            .real(row.energy_residual)
            .reals(&row.momentum)
            .reals(&row.angular_momentum)
            .reals(&row.impulse)
            .whole(row.contacts)
            .whole(row.refined_blocks)
            .whole(row.elements)
    }
}

impl From<&BlockRow> for Row {
    fn from(row: &BlockRow) -> Self {
        Self::default()
            .real(row.time)
            .text(&row.block)
            .real(row.mass)
            .reals(&row.position)
            .reals(&row.velocity)
            .reals(&row.angular_velocity)
            .reals(&row.force)
    }
}

impl From<&ContactRow> for Row {
    fn from(row: &ContactRow) -> Self {
        let started = Self::default()
            .text(&row.main)
            .text(&row.target)
            .text(row.kind.name())
            .real(row.time_on);
        match row.time_off {
            Some(time) => started.real(time),
            None => started.text(""),
        }
        .reals(&row.position)
        .real(row.peak_normal_force)
        .real(row.normal_impulse)
        .real(row.shear_impulse)
        .real(row.slip)
        .whole(row.level.into())
    }
}

impl From<&ProbeRow> for Row {
    fn from(row: &ProbeRow) -> Self {
        Self::default()
            .real(row.time)
            .text(&row.probe)
            .reals(&row.position)
            .reals(&row.displacement)
            .reals(&row.velocity)
    }
}
