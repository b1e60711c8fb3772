//! Kernels compiled once for each instruction set and chosen at run time.

/// A kernel whose bits are the same on every processor: nothing here fuses a multiplication with an addition.
macro_rules! kernel {
    ($($function:tt)*) => {
        #[allow(unsafe_code, reason = "the dispatcher that `multiversion` generates")]
        #[multiversion::multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2", "aarch64+neon"))]
        $($function)*
    };
}

pub(crate) use kernel;
