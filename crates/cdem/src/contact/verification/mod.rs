//! Oracles for tests: exact arithmetic and brute force.

#[cfg(test)]
pub(crate) mod exact;
#[cfg(test)]
mod oracle;
