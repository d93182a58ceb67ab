//! Bad meshes with one mistake each, and their messages. To accept new messages:
//! `INSTA_UPDATE=always cargo test --package cdem-io --test bad_meshes`.

use std::path::{Path, PathBuf};

use cdem::mesh::{MeshError, RawMesh, assemble};
use cdem::scene::Geometry;
use cdem::{AnyMesh, Simulation};
use cdem_io::gmsh;
use cdem_io::scene::{SceneFile, parse};

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests")
        .join(name)
}

/// Returns names and contents of the bad files.
fn files() -> Vec<(String, Vec<u8>)> {
    let entries = std::fs::read_dir(folder("bad-meshes")).expect("a folder");
    let read = |path: PathBuf| {
        let name = path.file_name()?.to_str()?.to_owned();
        Some((name, std::fs::read(path).ok()?))
    };
    let files = entries.filter_map(|entry| read(entry.ok()?.path()));
    files.collect()
}

/// Returns a good file, to be changed.
fn good(name: &str) -> Vec<u8> {
    std::fs::read(folder("meshes").join(name)).expect("a good mesh")
}

/// Returns the position of a piece of a file.
fn place(file: &[u8], piece: &[u8]) -> usize {
    let mut windows = file.windows(piece.len());
    windows.position(|window| window == piece).expect("a piece")
}

/// Returns the position of the content of a section, after the line of its name.
fn inside(file: &[u8], section: &str) -> usize {
    place(file, format!("${section}\n").as_bytes()) + section.len() + 2
}

/// Returns a good file with the bytes at `offset` in a section replaced.
fn with(name: &str, section: &str, offset: usize, bytes: &[u8]) -> Vec<u8> {
    let mut file = good(name);
    let start = inside(&file, section) + offset;
    file[start..start + bytes.len()].copy_from_slice(bytes);
    file
}

/// Returns a good file truncated `length` bytes into a section.
fn cut(name: &str, section: &str, length: usize) -> Vec<u8> {
    let mut file = good(name);
    file.truncate(inside(&file, section) + length);
    file
}

/// Returns a good file with all occurrences of a piece replaced.
fn replaced(name: &str, from: &[u8], to: &[u8]) -> Vec<u8> {
    let mut file = good(name);
    let mut changed = Vec::new();
    while !file.is_empty() {
        let take = if file.starts_with(from) {
            changed.extend_from_slice(to);
            from.len()
        } else {
            changed.push(file[0]);
            1
        };
        file.drain(..take);
    }
    changed
}

/// Returns bad binary files, made from good ones.
fn binary_files() -> Vec<(String, Vec<u8>)> {
    let (four, two) = ("plate-41-binary.msh", "plate-22-binary.msh");
    let stl = [vec![b' '; 80], vec![1, 0, 0, 0], vec![0; 50]].concat();
    let lossy = String::from_utf8_lossy(&good(four)).into_owned();
    // In version 4.1, section heads are four numbers of 8 bytes, and block heads three of 4 and one
    // of 8. In 2.2, numbers have 4 bytes.
    let block = 32;
    let first_node = block + 20;
    let files = [
        (
            "binary: marked as text",
            replaced(four, b"4.1 1 8", b"4.1 0 8"),
        ),
        (
            "binary: marked as text, 2.2",
            replaced(two, b"2.2 1 8", b"2.2 0 8"),
        ),
        (
            "binary: mark of the byte order 9",
            with(four, "MeshFormat", 8, &[9]),
        ),
        (
            "binary: byte order of another machine",
            with(four, "MeshFormat", 8, &[0, 0, 0, 1]),
        ),
        (
            "binary: byte order of another machine, 2.2",
            with(two, "MeshFormat", 8, &[0, 0, 0, 1]),
        ),
        (
            "binary: numbers of 4 bytes",
            replaced(four, b"4.1 1 8", b"4.1 1 4"),
        ),
        ("binary: sent as text", replaced(four, b"\n", b"\r\n")),
        ("binary: saved by an editor of text", lossy.into_bytes()),
        (
            "binary: cut in the mark of the byte order",
            cut(four, "MeshFormat", 10),
        ),
        ("binary: cut in entities", cut(four, "Entities", 100)),
        ("binary: cut in nodes", cut(four, "Nodes", 200)),
        ("binary: cut in elements", cut(four, "Elements", 100)),
        ("binary: cut in nodes, 2.2", cut(two, "Nodes", 100)),
        ("binary: cut in elements, 2.2", cut(two, "Elements", 100)),
        ("binary: zeros from elements on", {
            let mut file = good(four);
            let start = inside(&file, "Elements");
            file[start..].fill(0);
            file
        }),
        (
            "binary: a trillion nodes",
            with(four, "Nodes", 8, &(1_u64 << 40).to_le_bytes()),
        ),
        (
            "binary: -1 nodes",
            with(four, "Nodes", 8, &(-1_i64).to_le_bytes()),
        ),
        (
            "binary: -1 blocks of elements",
            with(four, "Elements", 0, &(-1_i64).to_le_bytes()),
        ),
        (
            "binary: -1 entities",
            with(four, "Entities", 16, &(-1_i64).to_le_bytes()),
        ),
        (
            "binary: a node's number is another's",
            with(four, "Nodes", first_node, &[2]),
        ),
        (
            "binary: a place that is none",
            with(four, "Nodes", first_node + 8, &f64::NAN.to_le_bytes()),
        ),
        (
            "binary: nodes of dimension -1",
            with(four, "Nodes", block, &(-1_i32).to_le_bytes()),
        ),
        (
            "binary: type 201",
            with(four, "Elements", block + 8, &201_i32.to_le_bytes()),
        ),
        (
            "binary: an unknown entity",
            with(four, "Elements", block + 4, &99_i32.to_le_bytes()),
        ),
        (
            "binary: an unknown node",
            with(four, "Elements", block + 28, &99_u64.to_le_bytes()),
        ),
        (
            "binary: no elements in a row, 2.2",
            with(two, "Elements", 3 + 4, &[0; 4]),
        ),
        (
            "binary: -1 elements in a row, 2.2",
            with(two, "Elements", 3 + 4, &[255; 4]),
        ),
        (
            "binary: -1 tags, 2.2",
            with(two, "Elements", 3 + 8, &[255; 4]),
        ),
        (
            "binary: -1 as an element's node, 2.2",
            with(two, "Elements", 3 + 24, &[255; 4]),
        ),
        ("binary: of second order", good("plate-41-second-order.msh")),
        ("other: a surface in STL", stl),
        (
            "other: a zip archive",
            b"PK\x03\x04\x14\0\0\0\x08\0".to_vec(),
        ),
        ("other: gzip", b"\x1f\x8b\x08\0\0\0\0\0".to_vec()),
        ("other: HDF5", b"\x89HDF\r\n\x1a\n\0\0\0\0".to_vec()),
    ];
    files.map(|(name, file)| (name.to_owned(), file)).to_vec()
}

fn scene(dimension: usize) -> SceneFile {
    let zeros = vec!["0.0"; dimension].join(", ");
    let text = format!(
        "version = 1\ndimension = {dimension}\ngravity = [{zeros}]\n\
         [time]\nend = 1e-3\n\
         [[material]]\nname = \"rock\"\nyoung_modulus = 40e9\npoisson_ratio = 0.25\n\
         density = 2700.0\n\
         [[block]]\nname = \"stone\"\nmesh = \"stone.msh\"\nmaterial = \"rock\"\n"
    );
    parse(&text, Path::new("scene.toml")).expect("a scene")
}

/// Returns the messages on a mesh: the reason of its refusal, or the warnings.
fn told(name: &str, read: impl Fn() -> Result<RawMesh, MeshError>) -> Vec<String> {
    let in_space = name.contains("-3d");
    let scene = scene(if in_space { 3 } else { 2 }).scene;
    let mut load = |_: &Path| read();
    let (mesh, notes) = if in_space {
        match assemble(&scene, &mut load) {
            Ok(mesh) => (AnyMesh::Solid(mesh.clone()), mesh.notes),
            Err(error) => return vec![error.to_string()],
        }
    } else {
        match assemble(&scene, &mut load) {
            Ok(mesh) => (AnyMesh::Plane(mesh.clone()), mesh.notes),
            Err(error) => return vec![error.to_string()],
        }
    };
    match Simulation::new(&scene, mesh) {
        Ok(simulation) => {
            let cautions = simulation.overview().warnings;
            let cautions = cautions.iter().map(|caution| caution.message.clone());
            let all = notes.into_iter().chain(cautions);
            all.map(|note| format!("told: {note}")).collect()
        }
        Err(error) => vec![error.to_string()],
    }
}

#[test]
fn each_mistake_is_told_with_its_place() {
    let mut files = [files(), binary_files()].concat();
    files.sort();
    assert!(files.len() >= 180, "{} files", files.len());
    let (mut all, mut miscounted) = (String::new(), Vec::new());
    for (name, bytes) in files {
        let lines = told(&name, || gmsh::parse("stone.msh", &bytes));
        if lines.len() != 1 {
            miscounted.push(name.clone());
        }
        all.push_str(&format!("{name}\n  {}\n", lines.join("\n  ")));
    }
    insta::assert_snapshot!(all);
    assert!(miscounted.is_empty(), "one mistake in each: {miscounted:?}");
}

#[test]
fn a_folder_is_told_with_the_meshes_in_it() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("wall.msh"), "").expect("written");
    let lines = told("a folder", || gmsh::read(folder.path()));
    let shown = folder.path().display();
    let expected = format!("mesh {shown}: it is a folder; the folder {shown} has wall.msh");
    assert_eq!(lines, [expected]);
}

/// The advice on a group without elements depends on the elements that the file has.
#[test]
fn an_empty_group_is_told_with_what_the_file_has() {
    let file = |groups: [u32; 2]| {
        let [one, other] = groups;
        format!(
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n\
             $PhysicalNames\n2\n3 1 \"left\"\n3 2 \"right\"\n$EndPhysicalNames\n\
             $Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 0 0 -1\n$EndNodes\n\
             $Elements\n2\n1 4 2 {one} 1 1 2 3 4\n2 4 2 {other} 2 1 3 2 5\n$EndElements\n"
        )
    };
    let mut scene = scene(3).scene;
    let Geometry::Mesh { group, .. } = &mut scene.block[0].geometry else {
        panic!("a mesh")
    };
    *group = Some("left".to_owned());
    let told = |groups| {
        let mut load = |_: &Path| gmsh::parse("stone.msh", file(groups).as_bytes());
        let error = assemble::<3>(&scene, &mut load).expect_err("nothing in the group");
        error.to_string()
    };
    let start = "block \"stone\" (stone.msh): physical group \"left\" has no 3-D elements; ";
    // Written by Gmsh with Mesh.SaveAll = 1.
    assert_eq!(
        told([0, 0]),
        format!(
            "{start}the file has 2 of them, but none belongs to a physical group: MSH 2.2 with \
             Mesh.SaveAll = 1 writes none; set it to 0, or write version 4.1 \
             (Mesh.MshFileVersion = 4.1)"
        )
    );
    assert_eq!(
        told([2, 2]),
        format!(
            "{start}the file has 2 of them outside this group; add elements to the group in \
             Gmsh, or choose another group"
        )
    );
}

/// Unusual but valid files.
#[test]
fn files_that_are_only_unusual_are_read() {
    let plain = String::from_utf8(good("plate-22-text.msh")).expect("text");
    let expected = gmsh::parse("plate.msh", plain.as_bytes()).expect("a mesh");
    let windows = plain.replace('\n', "\r\n");
    let named = |name: &str| plain.replace("\"base\"", name);
    for (what, text) in [
        ("line ends of Windows", windows.clone()),
        ("a mark of UTF-8", format!("\u{feff}{plain}")),
        ("both", format!("\u{feff}{windows}")),
        ("tabs and blanks", plain.replace(" 0", " \t 0")),
        ("blanks at line ends", plain.replace('\n', "  \n")),
        ("empty lines", plain.replace('\n', "\n\n")),
        ("no line end at the end", plain.trim_end().to_owned()),
        (
            "signs and exponents",
            plain.replace("8 1.5 0", "8 +15.0E-01 -0."),
        ),
        (
            "a comment",
            format!("{plain}$Comments\nof Monday\n$EndComments\n"),
        ),
    ] {
        let mesh = gmsh::parse("plate.msh", text.as_bytes());
        assert_eq!(mesh.as_ref(), Ok(&expected), "{what}");
    }
    // As Neper writes them: a name without quotes ends with the line.
    for name in ["bound1", "left wall", "Süd"] {
        let mesh = gmsh::parse("plate.msh", named(name).as_bytes());
        let groups = mesh.expect(name).groups;
        assert!(groups.iter().any(|group| group.name == name), "{name}");
    }
    for name in ["left, right", "the \"base\"", "Süd", " "] {
        let mesh = gmsh::parse("plate.msh", named(&format!("\"{name}\"")).as_bytes());
        let groups = mesh.expect(name).groups;
        assert!(groups.iter().any(|group| group.name == name), "{name}");
    }
}
