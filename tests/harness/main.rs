//! The list of comparers and of the tests in which each must reject: a test is only as good as its
//! comparison. Near misses that belong to no other test are here as well.

mod lists;
mod registry;
mod ruler;
