//! A test is only as good as its comparison. This crate lists every function that decides whether a result is right,
//! and the tests in which it must reject a near miss. Near misses that belong to no other test are here as well.

mod lists;
mod registry;
mod ruler;
