//! What the acceptance tests share. Everything here knows the crate by its public interface alone.

pub(crate) mod bytes;
pub(crate) mod density;
pub(crate) mod hostile;
pub(crate) mod lights;
pub(crate) mod oracle;
pub(crate) mod parallel;
pub(crate) mod pcg;
pub(crate) mod scene;
pub(crate) mod statistics;
pub(crate) mod tier;
