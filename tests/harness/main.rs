//! Who compares, and what each comparer must reject: a test that passes is worth as much as the comparison in
//! it. Here is the list; neighbours that belong to no other test stand beside it.

mod lists;
mod registry;
mod ruler;
