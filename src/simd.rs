//! Code compiled for several widths of vector registers, of which one is chosen when the program runs.
//!
//! A [`Kernel`] is plain code over arrays, which a compiler turns into vectors of the width that it may use. Products
//! and sums are never fused, so that all instruction sets give the same bits.
//!
//! AVX-512 needs a compiler that knows it: `build.rs` sets `fanlight_avx512` where it does.

/// Code that is compiled once for each instruction set, by a method each: a compiler places methods in the module of
/// their type, and works on several modules at the same time.
pub(crate) trait Kernel: Sized {
    /// Result of the code.
    type Output;

    /// Whether 512-bit vectors make it faster: measured (docs/SPEED.md, "Instruction sets"). Other code runs with 256
    /// bits, and is not compiled for more.
    #[cfg_attr(
        not(all(target_arch = "x86_64", feature = "std", fanlight_avx512)),
        expect(dead_code, reason = "nothing runs with 512 bits")
    )]
    const USES_512_BITS: bool = false;

    /// Runs the code. Must be `#[inline(always)]`, and so must everything in it that is to be compiled for wider
    /// vectors.
    fn run(self) -> Self::Output;

    /// Runs the code with what the whole program is compiled for. A function of its own beside those for wider
    /// vectors: inside of each caller, it would be compiled again and again, and never run.
    #[cfg_attr(all(target_arch = "x86_64", feature = "std"), inline(never))]
    #[cfg_attr(not(all(target_arch = "x86_64", feature = "std")), inline(always))]
    fn run_baseline(self) -> Self::Output {
        self.run()
    }

    /// Runs the code with 256-bit vectors.
    ///
    /// # Safety
    ///
    /// The machine must have AVX2.
    #[cfg(all(target_arch = "x86_64", feature = "std"))]
    #[target_feature(enable = "avx2")]
    #[expect(unsafe_code, reason = "the caller has asked the machine")]
    unsafe fn run_avx2(self) -> Self::Output {
        self.run()
    }

    /// Runs the code with 512-bit vectors.
    ///
    /// # Safety
    ///
    /// The machine must have these instructions.
    #[cfg(all(target_arch = "x86_64", feature = "std", fanlight_avx512))]
    #[target_feature(enable = "avx2,avx512f,avx512vl")]
    #[expect(unsafe_code, reason = "the caller has asked the machine")]
    unsafe fn run_avx512(self) -> Self::Output {
        self.run()
    }
}

/// Instructions that this machine has: only asking the machine makes one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InstructionSet(VectorExtension);

#[derive(Clone, Copy, Debug)]
enum VectorExtension {
    /// What the whole program is compiled for.
    Baseline,
    /// 256-bit vectors.
    #[cfg(all(target_arch = "x86_64", feature = "std"))]
    Avx2,
    /// 512-bit vectors.
    #[cfg(all(target_arch = "x86_64", feature = "std", fanlight_avx512))]
    Avx512,
}

impl InstructionSet {
    /// Returns the widest set that this machine has. Cheap, but not free: ask once a traversal.
    #[inline(always)]
    pub(crate) fn best() -> Self {
        #[cfg(all(target_arch = "x86_64", feature = "std", fanlight_avx512))]
        if VectorExtension::Avx512.is_available() {
            return Self(VectorExtension::Avx512);
        }
        #[cfg(all(target_arch = "x86_64", feature = "std"))]
        if VectorExtension::Avx2.is_available() {
            return Self(VectorExtension::Avx2);
        }
        Self(VectorExtension::Baseline)
    }

    /// Returns all sets that this machine has.
    #[cfg(test)]
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        [
            VectorExtension::Baseline,
            #[cfg(all(target_arch = "x86_64", feature = "std"))]
            VectorExtension::Avx2,
            #[cfg(all(target_arch = "x86_64", feature = "std", fanlight_avx512))]
            VectorExtension::Avx512,
        ]
        .into_iter()
        .filter(|extension| extension.is_available())
        .map(Self)
    }

    /// Runs a kernel with these instructions.
    #[inline(always)]
    #[cfg_attr(
        all(target_arch = "x86_64", feature = "std"),
        expect(unsafe_code, reason = "the machine was asked whether it has these instructions")
    )]
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self.0 {
            VectorExtension::Baseline => kernel.run_baseline(),
            // SAFETY: a set is made only where the machine has it.
            #[cfg(all(target_arch = "x86_64", feature = "std"))]
            VectorExtension::Avx2 => unsafe { kernel.run_avx2() },
            // SAFETY: as before.
            #[cfg(all(target_arch = "x86_64", feature = "std", fanlight_avx512))]
            VectorExtension::Avx512 if K::USES_512_BITS => unsafe { kernel.run_avx512() },
            // SAFETY: machines with AVX-512 have AVX2.
            #[cfg(all(target_arch = "x86_64", feature = "std", fanlight_avx512))]
            VectorExtension::Avx512 => unsafe { kernel.run_avx2() },
        }
    }
}

impl VectorExtension {
    #[inline(always)]
    #[cfg_attr(not(all(target_arch = "x86_64", feature = "std")), expect(dead_code, reason = "only tests ask"))]
    fn is_available(self) -> bool {
        match self {
            Self::Baseline => true,
            #[cfg(all(target_arch = "x86_64", feature = "std"))]
            Self::Avx2 => std::is_x86_feature_detected!("avx2"),
            #[cfg(all(target_arch = "x86_64", feature = "std", fanlight_avx512))]
            Self::Avx512 => std::is_x86_feature_detected!("avx512f") && std::is_x86_feature_detected!("avx512vl"),
        }
    }
}

/// Requests the cache lines of a value, so that a later read does not wait for all of them.
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

/// Returns the square root by the machine's instruction, for builds without `std`.
#[cfg(all(not(feature = "std"), target_arch = "x86_64", target_feature = "sse2"))]
#[inline(always)]
#[expect(unsafe_code, reason = "the program is compiled for machines that have this instruction")]
pub(crate) fn sqrt(x: f32) -> f32 {
    use core::arch::x86_64::{_mm_cvtss_f32, _mm_set_ss, _mm_sqrt_ss};
    // SAFETY: the condition above.
    unsafe { _mm_cvtss_f32(_mm_sqrt_ss(_mm_set_ss(x))) }
}
