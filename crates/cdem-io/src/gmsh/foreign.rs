//! Recognises files that are not Gmsh meshes.

use super::scan::{BYTE_ORDER_MARK, DAMAGED, excerpt};

/// First bytes, in lower case, of other files that users try as meshes; description and advice.
const KNOWN: [(&[u8], &str, &str); 24] = [
    (b"solid", "a surface in STL format", FILL),
    (b"ply\n", "a surface in PLY format", FILL),
    (b"off\n", "a surface in OFF format", FILL),
    (b"v ", "a surface in OBJ format", FILL),
    (b"# vtk", "a VTK file", CONVERT),
    (b"<vtkfile", "a VTK file", CONVERT),
    (b"<?xml", "an XML file, such as one of VTK or XDMF", CONVERT),
    (b"meshversionformatted", "a Medit mesh", CONVERT),
    (
        b"\x89hdf\n",
        "an HDF5 file, such as one of MED or XDMF",
        CONVERT,
    ),
    (b"*heading", "an Abaqus input", CONVERT),
    (b"*node", "an Abaqus input", CONVERT),
    (b"**", "an Abaqus input", CONVERT),
    (b"(0 ", "a Fluent mesh", CONVERT),
    (b"(2 ", "a Fluent mesh", CONVERT),
    (b"-1\n", "a universal (UNV) file", IMPORT),
    (b"$nod\n", "a mesh of version 1", REWRITE),
    (
        b"$meshformat\r",
        "lines that end in carriage returns",
        LINES,
    ),
    (b"\xff\xfe", "text in UTF-16", UTF8),
    (b"\xfe\xff", "text in UTF-16", UTF8),
    (b"pk\x03\x04", "a zip archive", UNPACK),
    (b"\x1f\x8b", "a file packed with gzip", UNPACK),
    (b"<!doctype", "a web page", FETCH),
    (b"<html", "a web page", FETCH),
    (b"version https://git-lfs", "a Git LFS pointer", PULL),
];

const FILL: &str = "a block needs a mesh of its volume, and this is only its surface: merge it in \
     Gmsh, add a Volume within it, and mesh that with gmsh -3";
const CONVERT: &str = "convert it with meshio: meshio convert --output-format gmsh old new.msh";
const IMPORT: &str = "convert it with Gmsh: gmsh old.unv -save -format msh41 -o new.msh";
const REWRITE: &str = "write version 4.1: gmsh old.msh -save -format msh41 -o new.msh";
const LINES: &str = "lines must end in a line feed, alone or after a carriage return: change the \
     line ends in an editor";
const UTF8: &str = "save it as UTF-8 or ASCII";
const UNPACK: &str = "unpack it";
const FETCH: &str = "the download of the mesh failed: download it again";
const PULL: &str = "the mesh itself is not downloaded yet: git lfs pull";
const GEOMETRY: &str = "this is no Gmsh mesh; make a mesh from a geometry with gmsh shape.geo \
     -2 (or -3) -format msh41 -o shape.msh";
const EMPTY: &str = "the file is empty: write it again with Gmsh";
const FIRST: &str = "$MeshFormat must come first: remove the text before it";

/// Returns a description of a file that does not begin as a mesh should, and advice.
pub(super) fn recognise(file: &[u8]) -> (String, &'static str) {
    let file = file.strip_prefix(BYTE_ORDER_MARK).unwrap_or(file);
    let content = file.trim_ascii_start();
    let mut small = content[..content.len().min(32)].to_ascii_lowercase();
    // Carriage returns count only if they end lines without line feeds.
    if small.contains(&b'\n') {
        small.retain(|&byte| byte != b'\r');
    }
    let known = KNOWN
        .iter()
        .find(|(beginning, ..)| small.starts_with(beginning));
    if let Some(&(_, what, help)) = known {
        return (what.to_owned(), help);
    }
    if is_binary_stl(file) {
        return ("a surface in STL format".to_owned(), FILL);
    }
    let line = content.split(|&byte| byte == b'\n').next();
    let found = excerpt(line.unwrap_or_default());
    let help = if content.is_empty() {
        EMPTY
    } else if memchr::memmem::find(file, b"\n$MeshFormat").is_some() {
        FIRST
    } else if content.starts_with(b"$") {
        DAMAGED
    } else {
        GEOMETRY
    };
    (found, help)
}

/// True if the file has the length that its number of triangles requires.
fn is_binary_stl(file: &[u8]) -> bool {
    let count = file.get(80..).and_then(|rest| rest.first_chunk());
    count.is_some_and(|&count| {
        let triangles = u64::from(u32::from_le_bytes(count));
        file.len() as u64 == 84 + 50 * triangles
    })
}
