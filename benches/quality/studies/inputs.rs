//! Random numbers of different quality.

use crate::scenes::pcg::Pcg32;

/// Where the numbers of an estimate of several samples come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Input {
    Independent,
    /// A square grid of the second and third number, with one point at random in each cell; the first number in strata
    /// of random order.
    Jittered,
    /// Sobol' points under Owen's scrambling, the first two dimensions for the second and third number.
    Sobol,
}

impl Input {
    pub(super) const ALL: [Self; 3] = [Self::Independent, Self::Jittered, Self::Sobol];

    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Independent => "independent",
            Self::Jittered => "jittered",
            Self::Sobol => "Sobol', Owen-scrambled",
        }
    }

    /// `n` points, a square number for [`Self::Jittered`].
    pub(super) fn points(self, n: u32, seed: u64) -> Vec<[f32; 3]> {
        let mut pcg = Pcg32::new(seed, 11);
        match self {
            Self::Independent => (0..n).map(|_| pcg.uniform3()).collect(),
            Self::Jittered => jittered(n, &mut pcg),
            Self::Sobol => {
                let seeds: [u32; 3] = core::array::from_fn(|_| pcg.bits());
                let number = |i: u32, d: usize| to_unit(owen(sobol(i, d), seeds[d]));
                (0..n).map(|i| [number(i, 2), number(i, 0), number(i, 1)]).collect()
            }
        }
    }
}

fn jittered(n: u32, pcg: &mut Pcg32) -> Vec<[f32; 3]> {
    let k = n.isqrt();
    let mut strata: Vec<u32> = (0..n).collect();
    for i in (1..n).rev() {
        strata.swap(i as usize, (pcg.bits() % (i + 1)) as usize);
    }
    let mut place = |cell: u32, cells: u32| {
        let place = (f64::from(cell) + pcg.f()) / f64::from(cells);
        (place as f32).min(1.0 - f32::EPSILON)
    };
    (0..n).map(|i| [place(strata[i as usize], n), place(i % k, k), place(i / k, k)]).collect()
}

/// A coordinate of a Sobol' point (Joe and Kuo's direction numbers).
fn sobol(index: u32, dimension: usize) -> u32 {
    // Primitive polynomials 1 (van der Corput), x + 1 and x² + x + 1.
    let mut directions = [0_u32; 32];
    for k in 0..32 {
        let m = |i: usize| directions[i];
        directions[k] = match dimension {
            0 => 1 << (31 - k),
            1 if k == 0 => 1 << 31,
            1 => m(k - 1) ^ (m(k - 1) >> 1),
            _ if k == 0 => 1 << 31,
            _ if k == 1 => 3 << 30,
            _ => m(k - 1) ^ m(k - 2) ^ (m(k - 2) >> 2),
        };
    }
    (0..32).filter(|bit| index >> bit & 1 == 1).fold(0, |x, bit| x ^ directions[bit])
}

/// Nested uniform scrambling by a hash of Laine and Karras with Vegdahl's constants (Burley 2020, "Practical Hash-based
/// Owen Scrambling").
fn owen(x: u32, seed: u32) -> u32 {
    let mut x = x.reverse_bits();
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

fn to_unit(x: u32) -> f32 {
    (x >> 8) as f32 * (1.0 / 16_777_216.0)
}
