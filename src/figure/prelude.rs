//! What the file of a figure uses: the figure's parts, its claims, the bench and its rows. `use
//! crate::figure::prelude::*;` imports all of it, with [`anyhow::Context`] for [`Figure::measure`](super::Figure).

pub use super::claim::{
    At, Better,
    Bound::{self, *},
    Claim, Pick, Places, Statistic, Test, best, each, every, one, others,
};
pub use super::{
    Bench, Cell, Contender, Effort, Errors, Figure, FigureView, Plot, Row, Setting, Show, Sweep, Timed, Value,
};
pub use anyhow::Context;
