//! Gmsh meshes: MSH 4.1 and 2.2, text and binary, either byte order.

mod cell_type;
mod collect;
mod msh2;
mod msh4;
mod scan;

use std::path::Path;

use cdem::mesh::{MeshError, RawMesh};
use collect::Collector;
use scan::{DAMAGED, Encoding, Scanner};

/// Reads a mesh file.
///
/// Coordinates stay in the file's units. Cells keep all physical groups they
/// lie in; a group without a name is called by its number. Sections that
/// describe no mesh (node data, periodicity, …) are skipped.
///
/// # Errors
/// [`MeshError::Unreadable`] if the system cannot read it,
/// [`MeshError::Format`] with section and line or byte if it is not such a
/// mesh or has cells of higher order.
pub fn read(path: &Path) -> Result<RawMesh, MeshError> {
    let bytes = std::fs::read(path).map_err(|error| MeshError::Unreadable {
        path: path.to_owned(),
        reason: if error.kind() == std::io::ErrorKind::NotFound {
            format!("there is no such file; {}", meshes_beside(path))
        } else {
            error.to_string()
        },
    })?;
    parse(&path.display().to_string(), &bytes)
}

/// Names of meshes that a message can show.
const SHOWN: usize = 5;

/// What there is in the folder of a mesh that is not there.
fn meshes_beside(path: &Path) -> String {
    let folder = path.parent().unwrap_or(Path::new(""));
    let folder = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    let place = folder.display();
    let Ok(entries) = std::fs::read_dir(folder) else {
        return format!("the folder {place} cannot be read");
    };
    let names = entries.flatten().map(|entry| entry.file_name());
    let mut meshes: Vec<String> = names
        .map(|name| name.to_string_lossy().into_owned())
        .filter(|name| name.ends_with(".msh"))
        .collect();
    meshes.sort_unstable();
    let more = meshes.len().saturating_sub(SHOWN);
    meshes.truncate(SHOWN);
    let names = meshes.join(", ");
    match (meshes.len(), more) {
        (0, _) => format!("the folder {place} holds no .msh file"),
        (_, 0) => format!("the folder {place} holds {names}"),
        _ => format!("the folder {place} holds {names} and {more} more"),
    }
}

/// Reads a mesh from the content of a file that messages call `origin`.
///
/// # Errors
/// As [`read`].
pub fn parse(origin: &str, bytes: &[u8]) -> Result<RawMesh, MeshError> {
    let mut scanner = Scanner::new(origin, bytes);
    let version = format(&mut scanner)?;
    let mut collector = Collector::new(origin);
    let mut sets = msh4::EntitySets::new();
    let mut has_elements = false;
    while let Some(section) = scanner.open()? {
        match (version, section) {
            (_, "PhysicalNames") => physical_names(&mut scanner, &mut collector)?,
            (_, "Nodes") if collector.has_nodes() => {
                return Err(scanner.fault("the section occurs twice", DAMAGED));
            }
            (_, "Entities" | "PartitionedEntities") if has_elements => {
                return Err(scanner.fault("the section must come before $Elements", DAMAGED));
            }
            (_, "Elements") if !collector.has_nodes() => {
                return Err(scanner.fault("$Nodes must come before $Elements", DAMAGED));
            }
            (Version::Four, "Entities") => {
                msh4::entities(&mut scanner, &mut collector, &mut sets)?;
            }
            (Version::Four, "PartitionedEntities") => {
                msh4::partitioned_entities(&mut scanner, &mut collector, &mut sets)?;
            }
            (Version::Four, "Nodes") => msh4::nodes(&mut scanner, &mut collector)?,
            (Version::Four, "Elements") => msh4::elements(&mut scanner, &mut collector, &sets)?,
            (Version::Two, "Nodes") => msh2::nodes(&mut scanner, &mut collector)?,
            (Version::Two, "Elements") => msh2::elements(&mut scanner, &mut collector)?,
            (Version::Two, "ParametricNodes") => {
                let help = "write the mesh without them: Mesh.SaveParametric = 0";
                return Err(scanner.fault("parametric nodes are not supported", help));
            }
            _ => {
                scanner.skip()?;
                continue;
            }
        }
        if section == "Elements" {
            collector.check_numbers(&scanner)?;
            has_elements = true;
        }
        scanner.close()?;
    }
    if !has_elements {
        let missing = if collector.has_nodes() {
            "$Elements"
        } else {
            "$Nodes"
        };
        return Err(scanner.fault(format!("there is no section {missing}"), DAMAGED));
    }
    Ok(collector.finish())
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Version {
    Two,
    Four,
}

/// `$MeshFormat`: version, text or binary, byte order.
fn format(scanner: &mut Scanner) -> Result<Version, MeshError> {
    let not_a_mesh = "expected the section $MeshFormat";
    let make_one = "this is no Gmsh mesh; of a geometry, make one with \
                    gmsh shape.geo -2 (or -3) -format msh41 -o shape.msh";
    match scanner.open() {
        Ok(Some("MeshFormat")) => {}
        _ => return Err(scanner.fault(not_a_mesh, make_one)),
    }
    let rewrite = "write version 4.1: gmsh old.msh -save -format msh41 -o new.msh";
    let version = match scanner.word("the version of the format")?.as_str() {
        "4.1" => Version::Four,
        "2.2" => Version::Two,
        other => {
            let problem = format!("version {other} is not supported, only 4.1 and 2.2 are");
            return Err(scanner.fault(problem, rewrite));
        }
    };
    let binary = match scanner.text_size("0 for text or 1 for binary")? {
        0 => false,
        1 => true,
        other => {
            let problem = format!("expected 0 for text or 1 for binary, found {other}");
            return Err(scanner.fault(problem, DAMAGED));
        }
    };
    let size = scanner.text_size("the size of numbers")?;
    if size != 8 {
        let problem = format!("numbers of {size} bytes are not supported, only 8 are");
        return Err(scanner.fault(problem, rewrite));
    }
    if binary {
        scanner.end_line();
        scanner.encoding = Encoding::LittleEndian;
        scanner.encoding = match scanner.int("the number one")?.to_le_bytes() {
            [1, 0, 0, 0] => Encoding::LittleEndian,
            [0, 0, 0, 1] => Encoding::BigEndian,
            _ => return Err(scanner.fault("the mark of the byte order is not 1", DAMAGED)),
        };
    }
    scanner.close()?;
    Ok(version)
}

/// `$PhysicalNames`, text in binary files, too.
fn physical_names(scanner: &mut Scanner, collector: &mut Collector) -> Result<(), MeshError> {
    let count = scanner.text_size("the number of names")?;
    scanner.end_line();
    for _ in 0..count {
        let dimension = scanner.text_size("the dimension of a physical group")?;
        let tag = scanner.text_size("the number of a physical group")?;
        let quoted = scanner.rest_of_line();
        let name = quoted
            .strip_prefix('"')
            .and_then(|rest| rest.strip_suffix('"'));
        let fitting = (
            usize::try_from(dimension).ok().filter(|&d| d <= 3),
            i32::try_from(tag).ok(),
        );
        let ((Some(dimension), Some(tag)), Some(name)) = (fitting, name) else {
            let problem = format!(
                "expected the dimension, number and \"name\" of a physical group, \
                 found {dimension} {tag} {quoted}"
            );
            return Err(scanner.fault(problem, DAMAGED));
        };
        collector.name_group(dimension, tag, name.to_owned());
    }
    Ok(())
}
