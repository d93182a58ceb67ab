//! Sections of version 2.2. Source: Gmsh 4.15 reference manual, "MSH file
//! format version 2 (Legacy)".

use cdem::mesh::MeshError;

use super::cell_type::cell_kind;
use super::collect::Collector;
use super::scan::{COUNTS_LINE, DAMAGED, Encoding, SWAPPED, Scanner};

const NODE_LINE: &str = "a line consists of the number of a node and three coordinates, in 2-D \
     too";
const ELEMENT_LINE: &str = "a line consists of the number of an element, its type, the number of \
     its tags, the tags, and as many nodes as the type has";

/// Reads `$Nodes`.
pub(super) fn nodes(scanner: &mut Scanner, collector: &mut Collector) -> Result<(), MeshError> {
    let announced = count(scanner, "the number of nodes")?;
    let count = scanner.afford(announced, 4, 28, "nodes")?;
    let mut numbers = Vec::with_capacity(count);
    let mut points = Vec::with_capacity(count);
    for _ in 0..count {
        scanner.line(NODE_LINE, |scanner| {
            let number = node_number(scanner)?;
            numbers.push(number);
            points.push(scanner.place(number)?);
            Ok(())
        })?;
    }
    collector.set_nodes(scanner, numbers, points)
}

/// Reads `$Elements`. An element in several physical groups is listed once for each.
pub(super) fn elements(scanner: &mut Scanner, collector: &mut Collector) -> Result<(), MeshError> {
    let announced = count(scanner, "the number of elements")?;
    let total = scanner.afford(announced, 4, 8, "elements")?;
    let mut found = 0;
    while found < total {
        found += match scanner.encoding {
            Encoding::Text => {
                scanner.line(ELEMENT_LINE, |scanner| text_element(scanner, collector))?
            }
            Encoding::LittleEndian | Encoding::BigEndian => {
                binary_elements(scanner, collector, total - found)?
            }
        };
    }
    collector.merge_repeated_cells();
    Ok(())
}

/// Reads the count at the start of a section, which is text in binary files, too.
fn count(scanner: &mut Scanner, what: &str) -> Result<u64, MeshError> {
    let count = scanner.line(COUNTS_LINE, |scanner| scanner.text_size(what))?;
    scanner.end_line();
    Ok(count)
}

/// Reads one line: number, type, tags, nodes.
fn text_element(scanner: &mut Scanner, collector: &mut Collector) -> Result<usize, MeshError> {
    let tag = positive(scanner, "an element number")?;
    let number = scanner.int("an element type")?;
    let tag_count = positive(scanner, "the number of tags")?;
    element(scanner, collector, tag, number, tag_count)?;
    Ok(1)
}

/// Reads a header with type, count and number of tags, then that many elements.
fn binary_elements(
    scanner: &mut Scanner,
    collector: &mut Collector,
    most: usize,
) -> Result<usize, MeshError> {
    let number = scanner.int("an element type")?;
    let count = positive(scanner, "a number of elements")? as usize;
    let tag_count = positive(scanner, "the number of tags")?;
    if count == 0 || count > most {
        let problem =
            format!("expected 1 to {most} elements in a row, as many as are left, found {count}");
        let swapped = (count as u32).swap_bytes() as usize;
        let help = if (1..=most).contains(&swapped) {
            SWAPPED
        } else {
            DAMAGED
        };
        return Err(scanner.fault(problem, help));
    }
    for _ in 0..count {
        let tag = positive(scanner, "an element number")?;
        element(scanner, collector, tag, number, tag_count)?;
    }
    Ok(count)
}

/// Reads tags and nodes of an element; the first tag is its physical group.
fn element(
    scanner: &mut Scanner,
    collector: &mut Collector,
    tag: u64,
    number: i32,
    tag_count: u64,
) -> Result<(), MeshError> {
    let kind = cell_kind(number, scanner, || format!("element {tag}"))?;
    let mut group = 0;
    for index in 0..scanner.afford(tag_count, 1, 4, "tags")? {
        let value = scanner.int("a tag of an element")?;
        if index == 0 {
            group = value;
        }
    }
    let set = collector.single_set(kind.dimension(), group);
    collector.read_cell(kind, tag, set, scanner, node_number)
}

fn node_number(scanner: &mut Scanner) -> Result<u64, MeshError> {
    positive(scanner, "a node number")
}

/// Reads a 32-bit integer that must not be negative.
fn positive(scanner: &mut Scanner, what: &str) -> Result<u64, MeshError> {
    let value = scanner.int(what)?;
    let refuse = |_| scanner.fault(format!("expected {what}, found {value}"), DAMAGED);
    u64::try_from(value).map_err(refuse)
}
