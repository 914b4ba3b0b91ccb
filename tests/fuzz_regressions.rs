//! The checks of the fuzz targets, for inputs that once failed and for random ones.

#[path = "fuzz/checks/mod.rs"]
mod checks;

use rand_pcg::{Pcg32, rand_core::Rng};

/// Inputs of every length, all of whose bytes are random.
fn inputs(count: u64) -> impl Iterator<Item = Vec<u8>> {
    (0..count).map(|seed| {
        let mut pcg = Pcg32::new(seed, 41);
        let mut input = vec![0; (pcg.next_u32() % 1500) as usize];
        pcg.fill_bytes(&mut input);
        input
    })
}

#[test]
fn random_scenes() {
    inputs(20_000).for_each(|input| checks::scene(&input));
}

#[test]
fn random_bytes() {
    inputs(20_000).for_each(|input| checks::bytes(&input));
}
