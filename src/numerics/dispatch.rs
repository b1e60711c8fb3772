//! Kernels compiled once for each instruction set and chosen at run time: those for rays, and those for fits.

/// A kernel whose bits are the same on every processor: no fused multiply-add.
macro_rules! ray_kernel {
    ($($function:tt)*) => {
        #[allow(unsafe_code, reason = "the dispatcher that `multiversion` generates")]
        #[multiversion::multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2", "aarch64+neon"))]
        $($function)*
    };
}

/// A kernel that may fuse multiplications and additions where the processor can.
macro_rules! fit_kernel {
    ($($function:tt)*) => {
        #[allow(unsafe_code, reason = "the dispatcher that `multiversion` generates")]
        #[multiversion::multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
        $($function)*
    };
}

pub(crate) use {fit_kernel, ray_kernel};
