//! The `tensormass` command.

fn main() {}
