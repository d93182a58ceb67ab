//! Gmsh meshes: MSH 4.1 and 2.2, text and binary, either byte order.

mod cell_type;
mod collect;
mod foreign;
mod msh2;
mod msh4;
mod scan;

use std::path::Path;

use cdem::mesh::{MeshError, RawMesh};
use collect::Collector;
use scan::{COUNTS, DAMAGED, Encoding, Scanner};

/// Reads a mesh file.
///
/// Coordinates stay in the file's units. Cells keep all their physical groups; a group without a
/// name is called by its number. Sections that do not describe the mesh (node data, periodicity, …)
/// are skipped.
///
/// # Errors
/// [`MeshError::Unreadable`] if the system cannot read it, [`MeshError::Format`] with section and
/// line or byte if it is not such a mesh or has cells of higher order.
pub fn read(path: &Path) -> Result<RawMesh, MeshError> {
    let bytes = std::fs::read(path).map_err(|error| MeshError::Unreadable {
        path: path.to_owned(),
        reason: if path.is_dir() {
            format!("it is a folder; {}", meshes_in(path))
        } else if error.kind() == std::io::ErrorKind::NotFound {
            let beside = path.parent().unwrap_or(Path::new(""));
            format!("there is no such file; {}", meshes_in(beside))
        } else {
            error.to_string()
        },
    })?;
    parse(&path.display().to_string(), &bytes)
}

/// Largest number of mesh names in a message.
const SHOWN: usize = 5;

/// Returns a text that lists the meshes in a folder.
fn meshes_in(folder: &Path) -> String {
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
        (0, _) => format!("the folder {place} has no .msh file"),
        (_, 0) => format!("the folder {place} has {names}"),
        _ => format!("the folder {place} has {names} and {more} more"),
    }
}

/// Reads a mesh from the content of a file; messages call it `origin`.
///
/// # Errors
/// As [`read`].
pub fn parse(origin: &str, bytes: &[u8]) -> Result<RawMesh, MeshError> {
    let mut scanner = Scanner::new(origin, bytes);
    let version = format(&mut scanner)?;
    let mut collector = Collector::new(origin);
    let mut sets = msh4::EntitySets::new();
    let mut opened = vec!["$MeshFormat".to_owned()];
    while let Some(section) = scanner.open()? {
        refuse_order(&scanner, &collector, section, &opened)?;
        match (version, section) {
            (_, "PhysicalNames") => physical_names(&mut scanner, &mut collector)?,
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
                opened.push(format!("${section}"));
                scanner.skip()?;
                continue;
            }
        }
        opened.push(format!("${section}"));
        if section == "Elements" {
            collector.check_numbers(&scanner)?;
        }
        scanner.close()?;
    }
    if !has(&opened, "$Elements") {
        let missing = if collector.has_nodes() {
            "$Elements"
        } else {
            "$Nodes"
        };
        let problem = format!("there is no section {missing} among {}", opened.join(", "));
        return Err(scanner.fault(problem, DAMAGED));
    }
    Ok(collector.finish())
}

/// Refuses a section that may not follow those `opened` before.
fn refuse_order(
    scanner: &Scanner,
    collector: &Collector,
    section: &str,
    opened: &[String],
) -> Result<(), MeshError> {
    match section {
        "MeshFormat" => {
            let help = "the file seems to consist of two meshes: save each in a file of its own, \
                        for a block of its own";
            Err(scanner.fault("the section occurs twice", help))
        }
        "Nodes" if collector.has_nodes() => {
            let help = "put all nodes into one section, or write the file again with Gmsh";
            Err(scanner.fault("the section occurs twice", help))
        }
        "Entities" | "PartitionedEntities" if has(opened, "$Elements") => {
            Err(scanner.fault("the section must come before $Elements", DAMAGED))
        }
        "Elements" if !collector.has_nodes() => {
            let problem = format!(
                "$Nodes must come before $Elements; the sections before it are {}",
                opened.join(", ")
            );
            Err(scanner.fault(problem, DAMAGED))
        }
        _ => Ok(()),
    }
}

fn has(opened: &[String], section: &str) -> bool {
    opened.iter().any(|known| known == section)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Version {
    Two,
    Four,
}

const KIND_LINE: &str = "the line consists of the version, 0 for text or 1 for binary, and 8, the \
     number of bytes of a number, as in 4.1 0 8";

/// Reads `$MeshFormat`: version, text or binary, byte order.
fn format(scanner: &mut Scanner) -> Result<Version, MeshError> {
    match scanner.open() {
        Ok(Some("MeshFormat")) => {}
        _ => {
            let (found, help) = foreign::recognise(scanner.file());
            let problem = format!("expected the section $MeshFormat, found {found}");
            return Err(scanner.fault(problem, help));
        }
    }
    let (version, binary) = scanner.line(KIND_LINE, kind)?;
    if binary {
        scanner.end_line();
        scanner.encoding = Encoding::LittleEndian;
        scanner.encoding = match &scanner.int("the number one")?.to_le_bytes() {
            [1, 0, 0, 0] => Encoding::LittleEndian,
            [0, 0, 0, 1] => Encoding::BigEndian,
            b"$End" => {
                let help = "for a file of text, write 0 before the size of numbers, as in 4.1 0 8";
                return Err(scanner.fault("the file is marked as binary, but is text", help));
            }
            _ => return Err(scanner.fault("the number for the byte order is not 1", DAMAGED)),
        };
    } else if scanner.has_mark_of_byte_order() {
        let help = "for a binary file, write 1 before the size of numbers, as in 4.1 1 8";
        return Err(scanner.fault("the file is marked as text, but is binary", help));
    }
    scanner.close()?;
    Ok(version)
}

/// Reads the line of `$MeshFormat`: version, and true for a binary file.
fn kind(scanner: &mut Scanner) -> Result<(Version, bool), MeshError> {
    let rewrite = "write version 4.1: gmsh old.msh -save -format msh41 -o new.msh";
    let version = match scanner.word("the version of the format")?.as_str() {
        "4.1" => Version::Four,
        "2.2" => Version::Two,
        other => {
            let problem = format!("version {other} is not supported; expected 4.1 or 2.2");
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
        let problem = format!("numbers of {size} bytes are not supported; expected 8");
        return Err(scanner.fault(problem, rewrite));
    }
    Ok((version, binary))
}

/// Largest number of characters of a line in a message.
const LONGEST: usize = 60;

const NAME_LINE: &str = "write a line such as 2 1 \"stone\": a dimension from 0 to 3, a number \
     below 2^31, and a name";

/// Reads `$PhysicalNames`, which is text in binary files, too.
fn physical_names(scanner: &mut Scanner, collector: &mut Collector) -> Result<(), MeshError> {
    let count = scanner.text_size("the number of names")?;
    scanner.end_line();
    for _ in 0..count {
        let line = scanner.next_line();
        let Some((dimension, tag, name)) = physical_name(&line) else {
            let found = match line.as_str() {
                "" => "the end of the file".to_owned(),
                line => line.chars().take(LONGEST).collect(),
            };
            let help = if found.starts_with('$') {
                COUNTS
            } else {
                NAME_LINE
            };
            let problem = format!(
                "expected the dimension, number and name of a physical group, found {found}"
            );
            return Err(scanner.fault(problem, help));
        };
        collector.name_group(scanner, dimension, tag, name)?;
    }
    Ok(())
}

/// Parses dimension, number and name of a physical group. A name without quotes, as Neper writes it,
/// ends with the line.
fn physical_name(line: &str) -> Option<(usize, i32, &str)> {
    let (dimension, rest) = line.split_once(char::is_whitespace)?;
    let (tag, text) = rest.trim_start().split_once(char::is_whitespace)?;
    let text = text.trim();
    let name = match text.strip_prefix('"') {
        Some(quoted) => quoted.strip_suffix('"')?,
        None => text,
    };
    let dimension = dimension.parse().ok().filter(|&dimension| dimension <= 3)?;
    let tag = tag.parse().ok().filter(|&tag| tag >= 0)?;
    Some((dimension, tag, name))
}
