//! Sections of version 4.1. Source: Gmsh 4.15 reference manual, "MSH file format".

use std::collections::BTreeMap;

use cdem::mesh::MeshError;

use super::cell_type::cell_kind;
use super::collect::Collector;
use super::scan::{COUNTS, COUNTS_LINE, DAMAGED, Scanner};

/// A geometric entity.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Entity {
    dimension: i32,
    /// Its number among those of its dimension.
    tag: i32,
}

/// Group set of each geometric entity.
pub(super) type EntitySets = BTreeMap<Entity, u32>;

const PLACE_LINE: &str = "a line consists of the three coordinates of a node, in 2-D too; the \
     numbers of the nodes come before";
const ELEMENT_LINE: &str =
    "a line consists of the number of an element and as many nodes as its type has";
const UNKNOWN_ENTITY: &str = "$Entities gives the physical groups of each entity: add this one, or \
     write the file again with Gmsh";

/// Reads `$Entities`: the physical groups of each entity.
pub(super) fn entities(
    scanner: &mut Scanner,
    collector: &mut Collector,
    sets: &mut EntitySets,
) -> Result<(), MeshError> {
    let counts = entity_counts(scanner)?;
    for (dimension, count) in (0_i32..).zip(counts) {
        for _ in 0..count {
            let tag = scanner.int("the number of an entity")?;
            let entity = Entity { dimension, tag };
            let before = sets.get(&entity).copied();
            rest_of_entity(scanner, collector, sets, entity)?;
            if before.is_some_and(|before| before != sets[&entity]) {
                let problem = format!(
                    "entity {tag} of dimension {dimension} occurs twice, with different groups"
                );
                return Err(scanner.fault(problem, "leave one of them out"));
            }
        }
    }
    Ok(())
}

/// Reads `$PartitionedEntities`: the physical groups of the pieces of a partitioned mesh.
pub(super) fn partitioned_entities(
    scanner: &mut Scanner,
    collector: &mut Collector,
    sets: &mut EntitySets,
) -> Result<(), MeshError> {
    scanner.size("the number of partitions")?;
    let ghosts = scanner.size("the number of ghost entities")?;
    for _ in 0..scanner.afford(ghosts, 2, 8, "ghost entities")? {
        scanner.int("the number of a ghost entity")?;
        scanner.int("a partition")?;
    }
    let counts = entity_counts(scanner)?;
    for (dimension, count) in (0_i32..).zip(counts) {
        for _ in 0..count {
            let tag = scanner.int("the number of an entity")?;
            scanner.int("the dimension of the parent")?;
            scanner.int("the number of the parent")?;
            tags(scanner, "partitions")?;
            rest_of_entity(scanner, collector, sets, Entity { dimension, tag })?;
        }
    }
    Ok(())
}

fn entity_counts(scanner: &mut Scanner) -> Result<[usize; 4], MeshError> {
    let mut counts = [0; 4];
    for (count, things) in counts
        .iter_mut()
        .zip(["points", "curves", "surfaces", "volumes"])
    {
        let announced = scanner.size("a number of entities")?;
        // The smallest entity: a number, coordinates and no group.
        *count = scanner.afford(announced, 5, 36, things)?;
    }
    Ok(counts)
}

/// Reads coordinates, physical groups and boundary of an entity.
fn rest_of_entity(
    scanner: &mut Scanner,
    collector: &mut Collector,
    sets: &mut EntitySets,
    entity: Entity,
) -> Result<(), MeshError> {
    let Entity { dimension, .. } = entity;
    for _ in 0..if dimension == 0 { 3 } else { 6 } {
        scanner.real("a coordinate of an entity")?;
    }
    let groups = tags(scanner, "physical groups")?;
    if dimension > 0 {
        tags(scanner, "bounding entities")?;
    }
    let set = collector.group_set(dimension as usize, &groups);
    sets.insert(entity, set);
    Ok(())
}

fn tags(scanner: &mut Scanner, things: &str) -> Result<Vec<i32>, MeshError> {
    let announced = scanner.size(&format!("the number of {things}"))?;
    let count = scanner.afford(announced, 1, 4, things)?;
    (0..count).map(|_| scanner.int(things)).collect()
}

/// Reads `$Nodes`.
pub(super) fn nodes(scanner: &mut Scanner, collector: &mut Collector) -> Result<(), MeshError> {
    let (blocks, total) = scanner.line(COUNTS_LINE, |scanner| {
        let blocks = scanner.size("the number of blocks of nodes")?;
        let blocks = scanner.afford(blocks, 4, 20, "blocks of nodes")?;
        let total = scanner.size("the number of nodes")?;
        let total = scanner.afford(total, 4, 32, "nodes")?;
        scanner.size("the smallest node number")?;
        scanner.size("the largest node number")?;
        Ok((blocks, total))
    })?;
    let mut numbers = Vec::with_capacity(total);
    let mut points = Vec::with_capacity(total);
    for _ in 0..blocks {
        let dimension = entity_dimension(scanner)?;
        scanner.int("the number of an entity")?;
        let parametric = scanner.int("0 or 1 for parametric nodes")? != 0;
        let announced = scanner.size("the number of nodes of an entity")?;
        let count = scanner.afford(announced, 4, 32, "nodes")?;
        let first = numbers.len();
        refuse_more(scanner, count, total - first, "nodes")?;
        for _ in 0..count {
            numbers.push(scanner.size("a node number")?);
        }
        let parameters = if parametric { dimension } else { 0 };
        for &number in &numbers[first..] {
            let place = scanner.line(PLACE_LINE, |scanner| {
                let place = scanner.place(number)?;
                for _ in 0..parameters {
                    scanner.real("a parameter of a node")?;
                }
                Ok(place)
            })?;
            points.push(place);
        }
    }
    check_total(scanner, numbers.len(), total, "nodes")?;
    collector.set_nodes(scanner, numbers, points)
}

/// Reads `$Elements`.
pub(super) fn elements(
    scanner: &mut Scanner,
    collector: &mut Collector,
    sets: &EntitySets,
) -> Result<(), MeshError> {
    let (blocks, total) = scanner.line(COUNTS_LINE, |scanner| {
        let blocks = scanner.size("the number of blocks of elements")?;
        let blocks = scanner.afford(blocks, 4, 20, "blocks of elements")?;
        let total = scanner.size("the number of elements")?;
        let total = scanner.afford(total, 2, 16, "elements")?;
        scanner.size("the smallest element number")?;
        scanner.size("the largest element number")?;
        Ok((blocks, total))
    })?;
    let mut found = 0;
    for _ in 0..blocks {
        let dimension = entity_dimension(scanner)?;
        let tag = scanner.int("the number of an entity")?;
        let set = match sets.get(&Entity { dimension, tag }) {
            Some(&set) => set,
            // Files without $Entities have no groups.
            None if sets.is_empty() => 0,
            None => {
                let problem = format!(
                    "entity {tag} of dimension {dimension} has elements, but is missing in \
                     $Entities"
                );
                return Err(scanner.fault(problem, UNKNOWN_ENTITY));
            }
        };
        let number = scanner.int("an element type")?;
        let whose = || format!("the elements of entity {tag} of dimension {dimension}");
        let kind = cell_kind(number, scanner, || format!("each of {}", whose()))?;
        if kind.dimension() as i32 != dimension {
            let problem = format!("{} are of type {number}, of another dimension", whose());
            return Err(scanner.fault(problem, DAMAGED));
        }
        let announced = scanner.size("the number of elements of an entity")?;
        let numbers = 1 + kind.node_count();
        let count = scanner.afford(announced, numbers, 8 * numbers, "elements")?;
        refuse_more(scanner, count, total - found, "elements")?;
        collector.reserve(kind, count);
        for _ in 0..count {
            scanner.line(ELEMENT_LINE, |scanner| {
                let tag = scanner.size("an element number")?;
                collector.read_cell(kind, tag, set, scanner, |s| s.size("a node number"))
            })?;
        }
        found += count;
    }
    check_total(scanner, found, total, "elements")
}

fn entity_dimension(scanner: &mut Scanner) -> Result<i32, MeshError> {
    let dimension = scanner.int("the dimension of an entity")?;
    if (0..=3).contains(&dimension) {
        return Ok(dimension);
    }
    let problem = format!("expected a dimension of 0 to 3, found {dimension}");
    Err(scanner.fault(problem, DAMAGED))
}

/// Refuses a block with more items than the section's total leaves.
fn refuse_more(
    scanner: &Scanner,
    count: usize,
    left: usize,
    things: &str,
) -> Result<(), MeshError> {
    if count <= left {
        return Ok(());
    }
    let problem = format!("an entity has {count} {things}, but the section has only {left} left");
    Err(scanner.fault(problem, COUNTS))
}

fn check_total(
    scanner: &Scanner,
    found: usize,
    announced: usize,
    things: &str,
) -> Result<(), MeshError> {
    if found == announced {
        return Ok(());
    }
    let problem =
        format!("the section gives {announced} as its number of {things}, but has {found}");
    Err(scanner.section_fault(problem, COUNTS))
}
