//! The comparison in numbers.

use std::io::{self, Write};

use crate::render::{Film, Reference};

/// One line of the table.
pub(crate) struct Row<'a> {
    pub(crate) name: &'a str,
    pub(crate) film: &'a Film,
    pub(crate) seconds: f64,
}

/// Prints the errors of some renderings, and what each gains over the first one.
pub(crate) fn print(rows: &[Row<'_>], reference: &Reference) -> io::Result<()> {
    let mut out = io::stdout().lock();
    writeln!(out, "{:36} {:>8} {:>8} {:>10} {:>12} {:>8}", "", "spp", "seconds", "relMSE", "relMSE x s", "gain")?;
    let mut baseline = None;
    for Row { name, film, seconds } in rows {
        let error = reference.rel_mse(&film.image());
        let cost = error * seconds;
        let gain = *baseline.get_or_insert(cost) / cost;
        writeln!(out, "{name:36} {:>8} {seconds:>8.2} {error:>10.3e} {cost:>12.3e} {gain:>8.1}", film.samples())?;
    }
    if reference.noise() > 0.0 {
        writeln!(out, "The reference's own noise, relMSE {:.1e}, is subtracted.", reference.noise())?;
    }
    Ok(())
}
