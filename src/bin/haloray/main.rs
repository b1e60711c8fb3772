//! The `haloray` command.

fn main() {}
