//! The command `cdem`.

fn main() {}
