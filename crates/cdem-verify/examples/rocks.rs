//! Writes a mesh of rocks: `cargo run --release -p cdem-verify --example rocks -- 20 10 5` writes
//! 1000 rocks. With `-- 20 10 5 cut` each rock is cut into one to six tetrahedra.

#![allow(clippy::print_stdout, reason = "the mesh is the output")]

use cdem::mesh::CellKind;
use cdem_verify::{SEED, rocks};

/// Returns Gmsh's number of an element type.
fn number_of(kind: CellKind) -> u32 {
    match kind.node_count() {
        4 => 4,
        6 => 6,
        _ => 5,
    }
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let count = |k: usize| words.get(k).and_then(|word| word.parse().ok()).unwrap_or(5);
    let cut = words.iter().any(|word| word == "cut");
    let mesh = rocks(SEED, [count(0), count(1), count(2)], cut);
    println!("$MeshFormat\n2.2 0 8\n$EndMeshFormat");
    println!("$Nodes\n{}", mesh.points.len());
    for ([x, y, z], tag) in mesh.points.iter().zip(&mesh.point_tags) {
        println!("{tag} {x} {y} {z}");
    }
    println!("$EndNodes\n$Elements\n{}", mesh.cell_count(3));
    let mut tag = 0;
    for cells in &mesh.cells {
        for cell in cells.nodes.chunks_exact(cells.kind.node_count()) {
            tag += 1;
            let nodes: Vec<String> = cell.iter().map(|node| (node + 1).to_string()).collect();
            println!("{tag} {} 0 {}", number_of(cells.kind), nodes.join(" "));
        }
    }
    println!("$EndElements");
}
