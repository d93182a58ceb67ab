//! Plots of curves, as SVG.

use plotters::prelude::*;

/// Size of a plot, px.
const SIZE: (u32, u32) = (680, 340);

/// Height reserved for the name of a curve, over the height of the curves.
const NAME: f64 = 0.1;

/// Largest number of points of a curve. More cannot be seen and make files long.
const POINTS: usize = 340;

/// Colours of computed curves, in order. They differ in grey and for most colour-blind readers.
const COLOURS: [RGBColor; 4] = [
    RGBColor(0, 92, 175),
    RGBColor(213, 94, 0),
    RGBColor(0, 130, 90),
    RGBColor(160, 70, 140),
];

/// Curves over one axis.
#[derive(Clone, Debug)]
pub struct Plot {
    /// Labels of the horizontal and the vertical axis, with units.
    pub axes: [String; 2],
    /// The curves.
    pub curves: Vec<Curve>,
}

/// A curve of a plot.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// Line or point style.
    pub style: Style,
    /// Its points.
    pub points: Vec<[f64; 2]>,
}

/// The style of a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// A thin black line, for a known answer.
    Known,
    /// A line in colour.
    Line,
    /// Points in colour.
    Dots,
}

impl Plot {
    /// Creates a plot without curves.
    #[must_use]
    pub fn new(across: &str, up: &str) -> Self {
        Self {
            axes: [across, up].map(str::to_owned),
            curves: Vec::new(),
        }
    }

    /// Returns the plot with one more curve.
    #[must_use]
    pub fn with(mut self, name: &str, style: Style, points: Vec<[f64; 2]>) -> Self {
        self.curves.push(Curve {
            name: name.to_owned(),
            style,
            points,
        });
        self
    }

    /// Draws the plot as SVG text.
    ///
    /// # Panics
    /// If the plot has no point.
    #[must_use]
    pub fn draw(&self) -> String {
        let mut svg = String::new();
        if let Err(error) = self.draw_on(&mut svg) {
            panic!("a plot of {:?}: {error}", self.axes);
        }
        svg
    }

    fn draw_on(&self, svg: &mut String) -> Result<(), Box<dyn std::error::Error>> {
        let area = SVGBackend::with_string(svg, SIZE).into_drawing_area();
        area.fill(&WHITE)?;
        let [across, up] = [0, 1].map(|axis| self.range(axis));
        let mut chart = ChartBuilder::on(&area)
            .margin(10)
            .x_label_area_size(40)
            .y_label_area_size(64)
            .build_cartesian_2d(across[0]..across[1], up[0]..up[1])?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .x_desc(&self.axes[0])
            .y_desc(&self.axes[1])
            .x_labels(8)
            .y_labels(6)
            .label_style(("sans-serif", 14))
            .draw()?;
        let mut colours = COLOURS.into_iter().cycle();
        for curve in &self.curves {
            let colour = match curve.style {
                Style::Known => BLACK,
                Style::Line | Style::Dots => colours.next().unwrap_or(BLACK),
            };
            let points = curve.thinned();
            let drawn = if curve.style == Style::Dots {
                let dot = |point| Circle::new(point, 3, colour.filled());
                chart.draw_series(points.map(dot))?
            } else {
                chart.draw_series(LineSeries::new(points, colour.stroke_width(curve.width())))?
            };
            drawn.label(&curve.name).legend(move |(x, y)| {
                PathElement::new([(x, y), (x + 16, y)], colour.stroke_width(2))
            });
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .label_font(("sans-serif", 14))
            .background_style(WHITE)
            .border_style(RGBColor(200, 200, 200))
            .draw()?;
        area.present()?;
        Ok(())
    }

    /// Returns the range of the points along an axis, with a margin in the vertical one.
    fn range(&self, axis: usize) -> [f64; 2] {
        let points = self.curves.iter().flat_map(|curve| &curve.points);
        let [least, most] = points.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], point| {
            [a.min(point[axis]), b.max(point[axis])]
        });
        assert!(least <= most, "a plot has points");
        let span = if most > least { most - least } else { 1.0 };
        match axis {
            0 => [least, least + span],
            // The legend is above the curves.
            _ => [
                least - 0.05 * span,
                most + (0.08 + NAME * self.curves.len() as f64) * span,
            ],
        }
    }
}

impl Curve {
    fn width(&self) -> u32 {
        if self.style == Style::Known { 1 } else { 2 }
    }

    /// Returns every n-th point and the last one: [`POINTS`] + 1 points at most.
    fn thinned(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let stride = self.points.len().div_ceil(POINTS).max(1);
        let last = self.points.len().saturating_sub(1);
        let points = self.points.iter().enumerate();
        points
            .filter(move |(k, _)| k.is_multiple_of(stride) || *k == last)
            .map(|(_, &[x, y])| (x, y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_has_its_curves_and_names() {
        let plot = Plot::new("time, s", "force, N")
            .with("exact", Style::Known, vec![[0.0, 1.0], [1.0, 1.0]])
            .with("found", Style::Dots, vec![[0.5, 1.1]]);
        let svg = plot.draw();
        for text in ["<svg", "time, s", "force, N", "exact", "found", "<circle"] {
            assert!(svg.contains(text), "{text} in {svg}");
        }
    }
}
