//! Questions that the table does not answer.

pub(crate) mod harmonics;
pub(crate) mod lobes;
pub(crate) mod room;
pub(crate) mod splitting;
pub(crate) mod stratification;
pub(crate) mod terms;

mod inputs;
mod smooth;
