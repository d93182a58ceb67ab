//! Gmsh files, good and bad.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use cdem::mesh::{CellKind, ElementKind, MeshError, RawMesh};
use cdem_io::gmsh::{parse, read};
use proptest::prelude::*;

fn sample(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/meshes")
        .join(name)
}

fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(sample(name)).expect("a sample")
}

fn text(name: &str) -> String {
    String::from_utf8(bytes(name)).expect("a text sample")
}

fn mesh(name: &str) -> RawMesh {
    let mesh = read(&sample(name)).expect("a good sample");
    mesh.check().expect("a consistent mesh");
    mesh
}

/// A cell as all variants must give it: kind, node numbers, names of groups.
type Content = (CellKind, Vec<u64>, Vec<String>);

fn cells(mesh: &RawMesh) -> Vec<Content> {
    let mut all = Vec::new();
    for cells in &mesh.cells {
        let nodes = cells.nodes.chunks_exact(cells.kind.node_count());
        for (nodes, &set) in nodes.zip(&cells.sets) {
            let numbers = nodes.iter().map(|&n| mesh.point_tags[n as usize]).collect();
            let groups = mesh.group_sets[set as usize].iter();
            let mut names: Vec<_> = groups
                .map(|&g| mesh.groups[g as usize].name.clone())
                .collect();
            names.sort_unstable();
            all.push((cells.kind, numbers, names));
        }
    }
    all.sort_unstable();
    all
}

/// Returns positions by node number, to the 15 digits that all text files contain.
fn places(mesh: &RawMesh) -> BTreeMap<u64, [String; 3]> {
    let places = mesh
        .points
        .iter()
        .map(|place| place.map(|x| format!("{x:.14e}")));
    mesh.point_tags.iter().copied().zip(places).collect()
}

#[test]
fn all_variants_hold_the_same_mesh() {
    for (shape, variants) in [
        (
            "plate",
            &[
                "41-binary",
                "22-text",
                "22-binary",
                "41-big-endian",
                "22-big-endian",
            ][..],
        ),
        ("solids", &["41-binary", "22-text", "22-binary"]),
    ] {
        let first = mesh(&format!("{shape}-41-text.msh"));
        for variant in variants {
            let other = mesh(&format!("{shape}-{variant}.msh"));
            assert_eq!(cells(&first), cells(&other), "{shape} {variant}");
            assert_eq!(places(&first), places(&other), "{shape} {variant}");
            assert_eq!(first.groups, other.groups, "{shape} {variant}");
        }
    }
}

#[test]
fn the_plate_is_what_its_geometry_says() {
    let plate = mesh("plate-41-text.msh");
    let count = |kind, group: &str| {
        let named = |names: &[String]| names.iter().any(|name| name == group);
        cells(&plate)
            .iter()
            .filter(|(k, _, names)| *k == kind && named(names))
            .count()
    };
    let [triangle, quadrilateral] = [ElementKind::Tri3, ElementKind::Quad4].map(CellKind::Element);
    assert_eq!(count(triangle, "right half"), 8);
    assert_eq!(count(quadrilateral, "left"), 4);
    assert_eq!(count(triangle, "plate") + count(quadrilateral, "plate"), 12);
    assert_eq!(count(CellKind::Line, "base"), 4);
    assert_eq!(
        count(CellKind::Line, "7"),
        4,
        "a group without a name goes by its number"
    );
    assert_eq!(count(CellKind::Point, "corner"), 1);
    assert_eq!(plate.points.len(), 15);
}

#[test]
fn partitions_change_nothing() {
    let is_cell = |(kind, ..): &Content| kind.dimension() == 2;
    let whole: Vec<_> = cells(&mesh("plate-41-text.msh"))
        .into_iter()
        .filter(is_cell)
        .collect();
    for name in [
        "plate-41-partitioned.msh",
        "plate-41-partitioned-binary.msh",
    ] {
        let parts = mesh(name);
        let own = |names: Vec<String>| names.into_iter().filter(|n| !n.starts_with('_')).collect();
        let pieces = cells(&parts).into_iter().filter(is_cell);
        let pieces: Vec<_> = pieces
            .map(|(kind, nodes, names)| (kind, nodes, own(names)))
            .collect();
        assert_eq!(whole, pieces, "{name}");
    }
}

#[test]
fn other_sections_and_line_ends_do_not_matter() {
    let plain = text("plate-41-text.msh");
    let data = "$NodeData\n1\n\"T\"\n1\n0.0\n3\n0\n1\n1\n1 3.5\n$EndNodeData\n";
    let extended = plain.replace("$Nodes", &format!("{data}$Nodes")) + data;
    let windows = plain.replace('\n', "\r\n");
    let expected = cells(&mesh("plate-41-text.msh"));
    for variant in [extended, windows] {
        assert_eq!(
            cells(&parse("variant", variant.as_bytes()).expect("a mesh")),
            expected
        );
    }
}

#[test]
fn node_numbers_may_be_far_apart() {
    let plain = text("plate-22-text.msh").replace("\n15 1.5 0", "\n2000000000 1.5 0");
    let sparse: Vec<_> = plain
        .lines()
        .map(
            |line| match line.split(' ').collect::<Vec<_>>().as_slice() {
                [start @ .., "15"] if start.len() > 4 => format!("{} 2000000000", start.join(" ")),
                fields if fields.len() > 6 => {
                    let nodes = fields[5..]
                        .iter()
                        .map(|&n| if n == "15" { "2000000000" } else { n });
                    [fields[..5].to_vec(), nodes.collect()].concat().join(" ")
                }
                _ => line.to_owned(),
            },
        )
        .collect();
    let mesh = parse("sparse", sparse.join("\n").as_bytes()).expect("a mesh");
    assert!(mesh.point_tags.contains(&2_000_000_000));
    assert_eq!(mesh.cell_count(2), 12);
}

#[test]
fn a_missing_file_is_told_by_its_path() {
    let error = read(Path::new("no/such.msh")).expect_err("no file");
    assert!(matches!(error, MeshError::Unreadable { .. }));
    assert!(
        error.to_string().starts_with("mesh no/such.msh: "),
        "{error}"
    );
}

const SAMPLES: [&str; 7] = [
    "plate-41-text.msh",
    "plate-41-binary.msh",
    "plate-22-text.msh",
    "plate-22-binary.msh",
    "plate-41-big-endian.msh",
    "plate-41-partitioned-binary.msh",
    "plate-41-second-order.msh",
];

/// A truncated file is refused, unless only white space is cut off.
#[test]
fn cut_files_are_refused_at_every_byte() {
    for name in &SAMPLES[..6] {
        let whole = bytes(name);
        for length in 0..whole.len() - 1 {
            assert!(
                parse(name, &whole[..length]).is_err(),
                "{name} cut at {length}"
            );
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// A damaged file is read or refused, but never panics.
    #[test]
    fn damaged_files_never_panic(
        sample in 0..SAMPLES.len(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in any::<prop::sample::Index>(),
        whole in any::<bool>(),
    ) {
        let mut damaged = bytes(SAMPLES[sample]);
        for (place, value) in changes {
            let place = place.index(damaged.len());
            damaged[place] = value;
        }
        if !whole {
            damaged.truncate(cut.index(damaged.len()));
        }
        if let Ok(mesh) = parse("damaged", &damaged) {
            prop_assert_eq!(mesh.check(), Ok(()));
        }
    }
}
