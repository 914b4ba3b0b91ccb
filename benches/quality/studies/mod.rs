//! Questions that the table does not answer.

pub(crate) mod lobes;
pub(crate) mod room;
pub(crate) mod splitting;
pub(crate) mod stratification;

mod inputs;
mod smooth;
