//! Local refinement of a block.

use cdem::output::FieldValues;

/// Returns the largest number of halvings among the elements nearest to a point.
pub(crate) fn halvings_at(simulation: &mut cdem::Simulation, point: [f64; 3]) -> i32 {
    let frame = simulation.frame();
    let field = frame.cell_fields.iter().find(|f| f.name == "refinement");
    let Some(FieldValues::Whole(halvings)) = field.map(|field| &field.values) else {
        panic!("frames tell refinement");
    };
    let mut first = 0;
    let apart = |p: &[f64; 3]| (p[0] - point[0]).hypot(p[1] - point[1]);
    let cells = frame.kinds.iter().zip(halvings).map(|(kind, &halvings)| {
        let nodes = &frame.connectivity[first..][..kind.node_count()];
        first += kind.node_count();
        let apart = nodes
            .iter()
            .map(|&node| apart(&frame.points[node as usize]));
        (apart.fold(f64::INFINITY, f64::min), halvings)
    });
    let nearest = cells.min_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
    nearest.expect("there are elements").1
}
