//! Tests of cutting, placing, numbering and checking blocks.

use proptest::prelude::*;

use crate::mesh::tests::*;
use crate::mesh::{CellKind, ElementKind, Facet, RawGroup};

/// A raw mesh in 2-D: elements and edges with their groups.
struct Plan {
    raw: RawMesh,
}

impl Plan {
    fn new(points: &[[f64; 2]]) -> Self {
        let mut raw = RawMesh::new("plan.msh");
        raw.points = points.iter().map(|&[x, y]| [x, y, 0.0]).collect();
        raw.point_tags = (1..=points.len() as u64).collect();
        Self { raw }
    }

    fn cell(mut self, kind: CellKind, nodes: &[u32], group: &str) -> Self {
        let dimension = kind.dimension();
        let raw = &mut self.raw;
        let same = |g: &RawGroup| g.name == group && g.dimension == dimension;
        let index = raw.groups.iter().position(same).unwrap_or_else(|| {
            let tag = raw.groups.len() as i32 + 1;
            raw.groups.push(RawGroup {
                dimension,
                tag,
                name: group.to_owned(),
            });
            raw.group_sets.push(vec![raw.groups.len() as u32 - 1]);
            raw.groups.len() - 1
        });
        let tag = 1 + raw
            .cells
            .iter()
            .map(|cells| cells.tags.len() as u64)
            .sum::<u64>();
        let cells = raw.cells_mut(kind);
        cells.nodes.extend_from_slice(nodes);
        cells.tags.push(tag);
        cells.sets.push(index as u32 + 1);
        self
    }

    fn triangle(self, nodes: [u32; 3], group: &str) -> Self {
        self.cell(CellKind::Element(ElementKind::Tri3), &nodes, group)
    }

    fn quad(self, nodes: [u32; 4], group: &str) -> Self {
        self.cell(CellKind::Element(ElementKind::Quad4), &nodes, group)
    }

    fn edge(self, nodes: [u32; 2], group: &str) -> Self {
        self.cell(CellKind::Line, &nodes, group)
    }
}

/// Returns two unit squares side by side. The right one consists of triangles, one of them numbered
/// clockwise. The edge between the squares is a group, and so is the top.
fn two_squares() -> RawMesh {
    let points = [[0., 0.], [1., 0.], [2., 0.], [0., 1.], [1., 1.], [2., 1.]];
    Plan::new(&points)
        .quad([0, 1, 4, 3], "left")
        .triangle([1, 2, 5], "right")
        .triangle([1, 4, 5], "right")
        .edge([1, 4], "joint")
        .edge([3, 4], "top")
        .edge([4, 5], "top")
        .cell(CellKind::Point, &[4], "middle")
        .raw
}

#[test]
fn blocks_of_groups_share_no_nodes_and_keep_their_groups() {
    let blocks = ["left", "right"].map(|name| block(name, file("m", Some(name))));
    let mesh = blocks_of::<2>(&two_squares(), blocks.to_vec()).expect("two blocks");
    assert_eq!(mesh.nodes.len(), 8);
    assert_eq!(mesh.blocks[1].nodes, 4..8);
    assert_eq!(
        mesh.elements[2].nodes(),
        [4, 7, 6],
        "turned counter-clockwise"
    );
    let joint = mesh.group("joint").expect("a group");
    assert_eq!(joint.nodes, [1, 3, 4, 6], "both sides of the joint");
    let joint_facets = [
        Facet {
            element: 0,
            local: 1,
        },
        Facet {
            element: 2,
            local: 2,
        },
    ];
    assert_eq!(joint.facets, joint_facets);
    assert_eq!(mesh.group("top").expect("a group").facets.len(), 2);
    assert_eq!(mesh.group("middle").expect("a group").nodes, [3, 6]);
    assert_eq!(mesh.group("right").expect("a group").facets.len(), 4);
    assert_eq!(mesh.boundary_facets().len(), 8);
    assert_eq!(mesh.smallest_boundary_edge(), 1.0);
    let note =
        "block \"right\": 1 of 2 elements were numbered the wrong way round and have been turned";
    assert_eq!(mesh.notes, [note]);
}

#[test]
fn one_block_of_the_whole_mesh_has_no_facets_inside() {
    let mesh = blocks_of::<2>(&two_squares(), vec![block("b", file("m", None))]).expect("a block");
    assert_eq!(mesh.nodes.len(), 6);
    let joint = mesh.group("joint").expect("a group");
    assert_eq!(
        (joint.nodes.as_slice(), joint.facets.len()),
        ([1, 4].as_slice(), 0)
    );
}

#[test]
fn splitting_by_components_and_cells_names_the_parts() {
    let mut raw = two_squares();
    // A third, separate triangle.
    for point in [[5., 0.], [6., 0.], [5., 1.]] {
        raw.points.push([point[0], point[1], 0.0]);
        raw.point_tags.push(raw.points.len() as u64);
    }
    let cells = raw.cells_mut(CellKind::Element(ElementKind::Tri3));
    cells.nodes.extend([6, 7, 8]);
    cells.tags.push(99);
    cells.sets.push(0);
    let parts = |split| {
        let whole = Block {
            split,
            ..block("b", file("m", None))
        };
        let mesh = blocks_of::<2>(&raw, vec![whole]).expect("blocks");
        let names: Vec<_> = mesh.blocks.iter().map(|b| b.name.clone()).collect();
        (names.join(" "), mesh.nodes.len())
    };
    assert_eq!(parts(Split::None), ("b".into(), 9));
    assert_eq!(parts(Split::Components), ("b.1 b.2".into(), 9));
    assert_eq!(parts(Split::Cells), ("b.1 b.2 b.3 b.4".into(), 13));
}

#[test]
fn blocks_are_scaled_then_rotated_then_shifted() {
    let placed = Block {
        scale: 2.0,
        rotate: Rotation {
            axis: [0.0, 0.0, 1.0],
            angle: std::f64::consts::FRAC_PI_2,
        },
        translate: vec![10.0, 20.0],
        ..block("b", file("m", Some("left")))
    };
    let mesh = blocks_of::<2>(&two_squares(), vec![placed]).expect("a block");
    // (1, 0) → (2, 0) → (0, 2) → (10, 22), up to the rounding of cos 90°.
    let [x, y] = mesh.nodes[1];
    assert!(
        (x - 10.0).abs() < 1e-14 && (y - 22.0).abs() < 1e-14,
        "{x} {y}"
    );
    let tilt = Rotation {
        axis: [1.0, 0.0, 0.0],
        angle: std::f64::consts::FRAC_PI_2,
    };
    let (min, max, divisions) = (vec![0.0; 3], vec![1.0, 2.0, 3.0], vec![1; 3]);
    let shape = Geometry::Box {
        min,
        max,
        divisions,
        element: ElementKind::Hex8,
    };
    let mesh = shapes::<3>(vec![Block {
        rotate: tilt,
        ..block("b", shape)
    }])
    .expect("a block");
    let (low, high) = crate::mesh::vector::bounds(mesh.nodes.iter().copied());
    for (corner, expected) in [(low, [0.0, -3.0, 0.0]), (high, [1.0, 0.0, 2.0])] {
        assert!(
            crate::mesh::vector::distance(corner, expected) < 1e-14,
            "{corner:?}"
        );
    }
}

#[test]
fn a_crack_is_noted_but_allowed() {
    let points = [[0., 0.], [1., 0.], [0., 1.], [1., 0.], [1., 1.], [0., 1.]];
    let raw = Plan::new(&points)
        .triangle([0, 1, 2], "a")
        .triangle([3, 4, 5], "a")
        .raw;
    let mesh = blocks_of::<2>(&raw, vec![block("b", file("m", None))]).expect("a block");
    insta::assert_snapshot!(mesh.notes.join("\n"));
}

#[test]
fn equal_notes_on_many_blocks_are_one() {
    let points = [[0., 0.], [1., 0.], [0., 1.], [1., 0.], [1., 1.], [0., 1.]];
    let raw = Plan::new(&points)
        .triangle([0, 2, 1], "a")
        .triangle([3, 4, 5], "a")
        .raw;
    let names = ["a", "b", "c", "d", "e"];
    let blocks = names.map(|name| block(name, file("m", None)));
    let mesh = blocks_of::<2>(&raw, blocks.to_vec()).expect("blocks");
    insta::assert_snapshot!(mesh.notes.join("\n"));
}

#[test]
fn a_mesh_that_conforms_has_nothing_to_be_told() {
    for (kind, dimension) in [
        (ElementKind::Tri3, 2),
        (ElementKind::Quad4, 2),
        (ElementKind::Tet4, 3),
        (ElementKind::Wedge6, 3),
        (ElementKind::Hex8, 3),
    ] {
        let shape = Geometry::Box {
            min: vec![0.0; dimension],
            max: vec![1.0; dimension],
            divisions: vec![3; dimension],
            element: kind,
        };
        let notes = match dimension {
            2 => blocks_of::<2>(&RawMesh::default(), vec![block("b", shape)]).map(|m| m.notes),
            _ => blocks_of::<3>(&RawMesh::default(), vec![block("b", shape)]).map(|m| m.notes),
        };
        assert_eq!(notes, Ok(Vec::new()), "{kind:?}");
    }
}

#[test]
fn unused_nodes_are_left_out_and_counted() {
    let points = [[0., 0.], [1., 0.], [0., 1.], [7., 7.]];
    let raw = Plan::new(&points).triangle([0, 1, 2], "a").raw;
    let mesh = blocks_of::<2>(&raw, vec![block("b", file("m", None))]).expect("a block");
    assert_eq!(mesh.nodes.len(), 3);
    assert_eq!(
        mesh.notes,
        [
            "plan.msh: number of nodes that are left out because no 2-D element has them: 1; the \
             first is node 4"
        ]
    );
}

#[test]
fn meshes_that_cannot_be_say_why() {
    let square = [[0., 0.], [1., 0.], [1., 1.], [0., 1.], [2., 1.], [2., 0.5]];
    let plan = || Plan::new(&square);
    let mut tilted = plan().triangle([0, 1, 2], "a").raw;
    tilted.points[2][2] = 0.3;
    let mut nowhere = plan().triangle([0, 1, 2], "a").raw;
    nowhere.points[1][0] = f64::INFINITY;
    let mut broken = plan().triangle([0, 1, 2], "a").raw;
    broken.cells[0].nodes[0] = 77;
    let cases = [
        (plan().quad([0, 1, 3, 2], "a").raw, None),
        (plan().triangle([0, 0, 2], "a").raw, None),
        (
            plan().triangle([0, 1, 2], "a").triangle([2, 0, 1], "a").raw,
            None,
        ),
        (
            plan().triangle([0, 1, 2], "a").triangle([1, 2, 3], "a").raw,
            None,
        ),
        (
            plan()
                .triangle([1, 2, 0], "a")
                .triangle([1, 2, 4], "a")
                .triangle([1, 2, 5], "a")
                .raw,
            None,
        ),
        (plan().triangle([0, 1, 2], "block_i").raw, Some("blok_i")), // spelling: wrong on purpose
        (
            plan().triangle([0, 1, 2], "a").edge([0, 1], "base").raw,
            Some("base"),
        ),
        (plan().edge([0, 1], "base").raw, None),
        (tilted, None),
        (nowhere, None),
        (broken, None),
    ];
    let messages = cases.map(|(raw, group)| {
        let wrong = blocks_of::<2>(&raw, vec![block("b", file("m", group))]);
        wrong.expect_err("a bad mesh").to_string()
    });
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn names_of_parts_must_be_free() {
    let split = Block {
        split: Split::Cells,
        ..block("b", file("m", None))
    };
    let blocks = vec![split, block("b.2", file("m", Some("left")))];
    let error = blocks_of::<2>(&two_squares(), blocks).expect_err("a name twice");
    insta::assert_snapshot!(error);
}

#[test]
fn group_names_are_checked_when_they_are_used() {
    let raw = Plan::new(&[[0., 0.], [1., 0.], [0., 1.], [5., 5.]])
        .triangle([0, 1, 2], "base")
        .edge([0, 1], "base")
        .edge([1, 2], "slope")
        .cell(CellKind::Point, &[3], "far")
        .raw;
    let mesh = blocks_of::<2>(&raw, vec![block("b", file("m", None))]).expect("a block");
    assert_eq!(mesh.group("slope").expect("a group").nodes, [1, 2]);
    let messages = ["base", "far", "slop", "quite different"]
        .map(|name| mesh.group(name).expect_err("a bad name").to_string());
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn a_group_may_be_asked_of_one_block() {
    let raw = Plan::new(&[[0., 0.], [1., 0.], [0., 1.]])
        .triangle([0, 1, 2], "base")
        .edge([1, 2], "slope")
        .raw;
    let blocks = ["b", "b.c", "b2"].map(|name| block(name, file("m", None)));
    let mesh = blocks_of::<2>(&raw, blocks.into()).expect("blocks");
    let nodes = |name: &str| mesh.group(name).expect("a group").nodes.clone();
    assert_eq!(nodes("slope"), [1, 2, 4, 5, 7, 8]);
    assert_eq!(nodes("b.slope"), [1, 2]);
    assert_eq!(nodes("b.c.slope"), [4, 5]);
    assert_eq!(nodes("b2.slope"), [7, 8]);
    assert_eq!(nodes("b2.base"), [6, 7, 8]);
    let of_facets = mesh.group("b.c.slope").expect("a group").facets.clone();
    assert_eq!(of_facets.len(), 1);
    assert_eq!(of_facets[0].element, 1);
    for wrong in ["b3.slope", "b.slop", "slope.b", ".slope", "b."] {
        mesh.group(wrong).expect_err("no such block or group");
    }
}

#[test]
fn parts_of_a_split_block_have_its_groups() {
    let raw = Plan::new(&[[0., 0.], [1., 0.], [0., 1.], [2., 0.], [3., 0.], [2., 1.]])
        .triangle([0, 1, 2], "base")
        .triangle([3, 4, 5], "base")
        .edge([0, 1], "foot")
        .edge([3, 4], "foot")
        .raw;
    let split = Block {
        split: Split::Components,
        ..block("b", file("m", None))
    };
    let other = block("c", file("m", None));
    let mesh = blocks_of::<2>(&raw, vec![other, split]).expect("blocks");
    let nodes = |name: &str| mesh.group(name).expect("a group").nodes.clone();
    assert_eq!(nodes("b.foot"), [6, 7, 9, 10]);
    assert_eq!(nodes("b.2.foot"), [9, 10]);
    assert_eq!(nodes("c.foot"), [0, 1, 3, 4]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// The elements, as sets of positions, and their volume do not depend on the split and the
    /// numbering.
    #[test]
    fn splitting_and_renumbering_keep_cells_and_volume(
        divisions in prop::array::uniform3(1..6_usize),
        hexahedra in any::<bool>(),
    ) {
        let element = if hexahedra { ElementKind::Hex8 } else { ElementKind::Tet4 };
        let shape = Geometry::Box {
            min: vec![0.0; 3],
            max: vec![1.0, 2.0, 3.0],
            divisions: divisions.to_vec(),
            element,
        };
        let places = |mesh: &Mesh<3>| {
            let of = |e: &Element| {
                let mut at: Vec<_> = e.nodes().iter().map(|&n| mesh.nodes[n as usize].map(f64::to_bits)).collect();
                at.sort_unstable();
                at
            };
            let mut all: Vec<_> = mesh.elements.iter().map(of).collect();
            all.sort_unstable();
            all
        };
        let cut = |split| shapes::<3>(vec![Block { split, ..block("b", shape.clone()) }]).expect("a box");
        let whole = cut(Split::None);
        for split in [Split::Components, Split::Cells] {
            let parts = cut(split);
            prop_assert_eq!(places(&whole), places(&parts));
            // Sums of some thousand terms of equal sign, in different order.
            prop_assert!((total_volume(&parts) / 6.0 - 1.0).abs() < 1e-12);
        }
        // Every node is used, and numbered once.
        let mut used: Vec<_> = whole.elements.iter().flat_map(|e| e.nodes().to_vec()).collect();
        used.sort_unstable();
        used.dedup();
        prop_assert_eq!(used.len(), whole.nodes.len());
        prop_assert_eq!(whole.nodes.len(), divisions.iter().map(|n| n + 1).product::<usize>());
    }
}
