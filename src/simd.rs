//! The same code compiled for wider vector registers, chosen when the program runs.
//!
//! A [`Kernel`] is plain code over arrays, which a compiler turns into vectors of the width that
//! it may use; products and sums are never fused, so the results are the same bits at every level.

/// Code that is worth compiling for each level.
pub(crate) trait Kernel {
    /// What comes out.
    type Output;

    /// Does the work. Must be `#[inline(always)]`, and so must all that is to profit.
    fn run(self) -> Self::Output;
}

/// Instructions that this machine has: only asking the machine makes one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InstructionSet(Extension);

#[derive(Clone, Copy, Debug)]
enum Extension {
    /// What the whole program is compiled for.
    Baseline,
    /// 256-bit vectors.
    #[cfg(all(target_arch = "x86_64", feature = "std"))]
    Avx2,
    /// 512-bit vectors.
    #[cfg(all(target_arch = "x86_64", feature = "std"))]
    Avx512,
}

impl InstructionSet {
    /// The widest that this machine has. Cheap, but not free: ask once a traversal.
    #[inline(always)]
    pub(crate) fn best() -> Self {
        #[cfg(all(target_arch = "x86_64", feature = "std"))]
        {
            if Extension::Avx512.is_available() {
                return Self(Extension::Avx512);
            }
            if Extension::Avx2.is_available() {
                return Self(Extension::Avx2);
            }
        }
        Self(Extension::Baseline)
    }

    /// All that this machine has.
    #[cfg(test)]
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        [
            Extension::Baseline,
            #[cfg(all(target_arch = "x86_64", feature = "std"))]
            Extension::Avx2,
            #[cfg(all(target_arch = "x86_64", feature = "std"))]
            Extension::Avx512,
        ]
        .into_iter()
        .filter(|set| set.is_available())
        .map(Self)
    }

    /// Does the work with this level's instructions.
    #[inline(always)]
    #[cfg_attr(
        all(target_arch = "x86_64", feature = "std"),
        expect(unsafe_code, reason = "the machine was asked whether it has these instructions")
    )]
    pub(crate) fn run<W: Kernel>(self, work: W) -> W::Output {
        match self.0 {
            Extension::Baseline => work.run(),
            // SAFETY: a level is made only where the machine has it.
            #[cfg(all(target_arch = "x86_64", feature = "std"))]
            Extension::Avx2 => unsafe { with_avx2(work) },
            // SAFETY: as before.
            #[cfg(all(target_arch = "x86_64", feature = "std"))]
            Extension::Avx512 => unsafe { with_avx512(work) },
        }
    }
}

impl Extension {
    #[inline(always)]
    #[cfg_attr(not(all(target_arch = "x86_64", feature = "std")), expect(dead_code, reason = "only tests ask"))]
    fn is_available(self) -> bool {
        match self {
            Self::Baseline => true,
            #[cfg(all(target_arch = "x86_64", feature = "std"))]
            Self::Avx2 => std::is_x86_feature_detected!("avx2"),
            #[cfg(all(target_arch = "x86_64", feature = "std"))]
            Self::Avx512 => std::is_x86_feature_detected!("avx512f") && std::is_x86_feature_detected!("avx512vl"),
        }
    }
}

#[cfg(all(target_arch = "x86_64", feature = "std"))]
#[target_feature(enable = "avx2")]
fn with_avx2<W: Kernel>(work: W) -> W::Output {
    work.run()
}

#[cfg(all(target_arch = "x86_64", feature = "std"))]
#[target_feature(enable = "avx2,avx512f,avx512vl")]
fn with_avx512<W: Kernel>(work: W) -> W::Output {
    work.run()
}

/// Asks for a value's cache lines, so that a later look at it does not wait for all of them.
#[inline(always)]
#[cfg_attr(target_arch = "x86_64", expect(unsafe_code, reason = "a hint that reads nothing"))]
pub(crate) fn prefetch<T>(value: &T) {
    #[cfg(target_arch = "x86_64")]
    for offset in (0..size_of::<T>()).step_by(64).chain([size_of::<T>() - 1]) {
        use core::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: the address is inside of the value, and all machines of this kind have the instruction.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(core::ptr::from_ref(value).cast::<i8>().add(offset)) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}

/// The machine's square root, for builds without `std`.
#[cfg(all(not(feature = "std"), target_arch = "x86_64", target_feature = "sse2"))]
#[inline(always)]
#[expect(unsafe_code, reason = "the program is compiled for machines that have this instruction")]
pub(crate) fn sqrt(x: f32) -> f32 {
    use core::arch::x86_64::{_mm_cvtss_f32, _mm_set_ss, _mm_sqrt_ss};
    // SAFETY: the condition above.
    unsafe { _mm_cvtss_f32(_mm_sqrt_ss(_mm_set_ss(x))) }
}
