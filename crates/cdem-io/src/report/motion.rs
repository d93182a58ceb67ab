//! The frames of a run, small enough for a page.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::pack::pack;
use super::surface::Surface;
use crate::results::{ResultsError, SavedFrame, read_frame};

/// Largest size of all frames together before compression, bytes; beyond it, frames are left out.
const ROOM: usize = 64 << 20;

/// The frames that the page draws.
#[derive(Serialize)]
pub(super) struct Motion {
    /// Box around all points, m.
    low: [f64; 3],
    high: [f64; 3],
    topologies: Vec<Topology>,
    frames: Vec<PackedFrame>,
    /// Values that the largest byte stands for, m/s and Pa.
    speed_scale: Option<f64>,
    stress_scale: Option<f64>,
    /// Number of the frame of the first impact.
    pub(super) impact: Option<usize>,
    left_out: usize,
}

/// Triangles and edges, shared by several frames.
#[derive(Serialize)]
struct Topology {
    triangles: String,
    edges: String,
    /// Block of each triangle.
    block: String,
}

#[derive(Serialize)]
struct PackedFrame {
    time: f64,
    topology: usize,
    points: String,
    speed: Option<String>,
    stress: Option<String>,
}

/// The visible part of one frame.
struct Seen {
    time: f64,
    topology: usize,
    points: Vec<[f32; 3]>,
    /// Values of the points, m/s, and of the triangles, Pa.
    speed: Option<Vec<f32>>,
    stress: Option<Vec<f32>>,
}

impl Motion {
    /// Reads the frames in files, each with its time, s; `impact` is the time of the first impact,
    /// if there is one.
    ///
    /// # Errors
    /// If a frame cannot be read.
    pub(super) fn read(
        files: &[(f64, PathBuf)],
        impact: Option<f64>,
    ) -> Result<Option<Self>, ResultsError> {
        let Some((_, first)) = files.first() else {
            return Ok(None);
        };
        let impact = impact.and_then(|time| files.iter().position(|(at, _)| *at >= time));
        let chosen = choose(files.len(), size(&read(first)?), impact);
        let mut seeing = Seeing::default();
        for &number in &chosen {
            let (time, path) = &files[number];
            seeing.add(*time, &read(path)?);
        }
        let left_out = files.len() - chosen.len();
        let impact = impact.and_then(|impact| chosen.iter().position(|&number| number == impact));
        Ok(Some(seeing.packed(impact, left_out)))
    }
}

fn read(path: &Path) -> Result<SavedFrame, ResultsError> {
    read_frame(path).map_err(|why| ResultsError::Frame {
        path: path.to_owned(),
        why,
    })
}

/// Returns the approximate size of a frame, bytes.
fn size(frame: &SavedFrame) -> usize {
    let surface = Surface::of(frame);
    7 * surface.points.len() + surface.triangles.len()
}

/// Returns the numbers of the frames for which there is room: evenly spaced, with the first, the
/// last and that of the impact.
fn choose(count: usize, size: usize, impact: Option<usize>) -> Vec<usize> {
    let apart = (count * size).div_ceil(ROOM).max(1);
    let mut chosen: Vec<usize> = (0..count).step_by(apart).collect();
    chosen.extend(impact);
    chosen.push(count - 1);
    chosen.sort_unstable();
    chosen.dedup();
    chosen
}

/// Frames read so far.
#[derive(Default)]
struct Seeing {
    topologies: Vec<Topology>,
    frames: Vec<Seen>,
    /// Cells and blocks of the last frame, and its surface.
    cells: SavedFrame,
    surface: Surface,
}

impl Seeing {
    fn add(&mut self, time: f64, frame: &SavedFrame) {
        let block = frame.cell_fields.get("block");
        let same = self.cells.kinds == frame.kinds
            && self.cells.connectivity == frame.connectivity
            && self.cells.cell_fields.get("block") == block;
        if !same || self.topologies.is_empty() {
            self.surface = Surface::of(frame);
            self.topologies.push(self.topology(block));
            self.cells = SavedFrame {
                kinds: frame.kinds.clone(),
                connectivity: frame.connectivity.clone(),
                cell_fields: block
                    .map(|block| ("block".to_owned(), block.clone()))
                    .into_iter()
                    .collect(),
                ..SavedFrame::default()
            };
        }
        let points = self.surface.points.iter();
        let at = |&point: &u32| frame.points[point as usize].map(|x| x as f32);
        self.frames.push(Seen {
            time,
            topology: self.topologies.len() - 1,
            points: points.map(at).collect(),
            speed: self.speeds(frame),
            stress: self.stresses(frame),
        });
    }

    fn topology(&self, block: Option<&Vec<f64>>) -> Topology {
        let of = |&cell: &u32| block.map_or(0, |block| block[cell as usize] as u16);
        let blocks: Vec<u16> = self.surface.cells.iter().map(of).collect();
        Topology {
            triangles: pack(&self.surface.triangles),
            edges: pack(&self.surface.edges),
            block: pack(&blocks),
        }
    }

    fn speeds(&self, frame: &SavedFrame) -> Option<Vec<f32>> {
        let velocity = frame.point_fields.get("velocity")?;
        let speed = |&point: &u32| {
            let own = velocity.get(3 * point as usize..).unwrap_or_default();
            let square: f64 = own.iter().take(3).map(|v| v * v).sum();
            square.sqrt() as f32
        };
        Some(self.surface.points.iter().map(speed).collect())
    }

    fn stresses(&self, frame: &SavedFrame) -> Option<Vec<f32>> {
        let cells = self.surface.cells.iter().map(|&cell| cell as usize);
        if let Some(known) = frame.cell_fields.get("von_mises") {
            let of = |cell: usize| known.get(cell).copied().unwrap_or_default() as f32;
            return Some(cells.map(of).collect());
        }
        let stress = frame.cell_fields.get("stress")?;
        let of = |cell: usize| match stress.get(6 * cell..6 * cell + 6) {
            Some(&[xx, yy, zz, xy, yz, zx]) => {
                let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
                let shear = xy * xy + yz * yz + zx * zx;
                (0.5 * normal + 3.0 * shear).sqrt() as f32
            }
            _ => 0.0,
        };
        Some(cells.map(of).collect())
    }

    fn packed(self, impact: Option<usize>, left_out: usize) -> Motion {
        // The last frame of an unstable run may have values that are not finite.
        let all = self.frames.iter().flat_map(|frame| &frame.points);
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for point in all {
            for c in (0..3).filter(|&c| point[c].is_finite()) {
                low[c] = low[c].min(point[c]);
                high[c] = high[c].max(point[c]);
            }
        }
        let largest = |of: fn(&Seen) -> Option<&Vec<f32>>| {
            let mut known = self.frames.iter().filter_map(of).peekable();
            known.peek()?;
            let finite = known.flatten().copied().filter(|value| value.is_finite());
            Some(finite.fold(0.0, f32::max))
        };
        let speed_scale = largest(|frame| frame.speed.as_ref());
        let stress_scale = largest(|frame| frame.stress.as_ref());
        let frames = self.frames.iter().map(|frame| PackedFrame {
            time: frame.time,
            topology: frame.topology,
            points: pack(&quantised(&frame.points, low, high)),
            speed: packed_shares(frame.speed.as_deref(), speed_scale),
            stress: packed_shares(frame.stress.as_deref(), stress_scale),
        });
        Motion {
            frames: frames.collect(),
            low: low.map(f64::from),
            high: high.map(f64::from),
            topologies: self.topologies,
            speed_scale: speed_scale.map(f64::from),
            stress_scale: stress_scale.map(f64::from),
            impact,
            left_out,
        }
    }
}

/// Returns points as fractions of a box.
fn quantised(points: &[[f32; 3]], low: [f32; 3], high: [f32; 3]) -> Vec<[u16; 3]> {
    let share = |point: &[f32; 3]| {
        std::array::from_fn(|c| {
            let width = high[c] - low[c];
            let share = if width > 0.0 {
                (point[c] - low[c]) / width
            } else {
                0.0
            };
            (share * f32::from(u16::MAX)).round() as u16
        })
    };
    points.iter().map(share).collect()
}

/// Returns values as fractions of the largest, packed.
fn packed_shares(values: Option<&[f32]>, most: Option<f32>) -> Option<String> {
    let (values, most) = (values?, most?);
    let share = |&value: &f32| {
        let share = if most > 0.0 { value / most } else { 0.0 };
        (share * f32::from(u8::MAX)).round() as u8
    };
    Some(pack(&values.iter().map(share).collect::<Vec<u8>>()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_room_for_all_of_a_few_frames() {
        assert_eq!(choose(4, 1000, Some(2)), [0, 1, 2, 3]);
        assert_eq!(choose(1, 1 << 30, None), [0]);
    }

    #[test]
    fn large_frames_are_left_out_but_not_those_that_matter() {
        assert_eq!(choose(11, ROOM / 4, Some(5)), [0, 3, 5, 6, 9, 10]);
    }

    #[test]
    fn points_are_shares_of_the_box() {
        let points = [[0.0, 1.0, 5.0], [2.0, 3.0, 5.0]];
        let quantised = quantised(&points, [0.0, 1.0, 5.0], [2.0, 5.0, 5.0]);
        assert_eq!(quantised, [[0, 0, 0], [u16::MAX, 32768, 0]]);
    }
}
