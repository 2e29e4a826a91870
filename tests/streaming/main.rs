//! Streaming of paper 1, section 3, without a GPU: states, caches, budgets, failures, threads.

mod behaviour;
mod expected;
mod failures;
mod invariants;
mod model;
mod replay;
mod source;
