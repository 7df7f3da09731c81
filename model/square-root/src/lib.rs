//! The square root, by the processor's own instruction on the drive boards.
//!
//! The nearest number to a root is one number (IEEE 754 requires it of every square root), so the boards and the hosts
//! agree to the bit. `libm` computes it in integers on a Cortex-M, in some fifty instructions; `vsqrt.f32` is one.
//! `core` has no square root yet, hence this crate: `model` forbids the assembly that it takes.
#![no_std]

/// The square root of `x`; NaN below 0, and -0 for -0.
///
/// ```
/// use square_root::sqrtf;
/// assert_eq!(sqrtf(2.25), 1.5);
/// assert!(sqrtf(-1.0).is_nan());
/// ```
#[inline]
#[must_use]
pub fn sqrtf(x: f32) -> f32 {
    #[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
    {
        let root: f32;
        // SAFETY: this ABI passes numbers in the registers of a floating-point unit, so there is one. The instruction
        // reads one of its registers and writes another.
        unsafe {
            core::arch::asm!(
                "vsqrt.f32 {root}, {x}",
                root = lateout(sreg) root,
                x = in(sreg) x,
                options(pure, nomem, nostack, preserves_flags)
            );
        }
        root
    }
    #[cfg(not(all(target_arch = "arm", target_abi = "eabihf")))]
    libm::sqrtf(x)
}

#[cfg(test)]
mod tests {
    use super::sqrtf;

    /// The neighbours of a nearest root are further away: the squares of the points halfway to them lie on either side of
    /// `x`. A halfway point has 25 bits, so its square is exact in double precision.
    #[test]
    fn the_root_is_the_nearest_number() {
        // Every exponent, with significands all over their range.
        for x in (1..f32::INFINITY.to_bits()).step_by(65_521).map(f32::from_bits) {
            let root = sqrtf(x);
            let halfway = |neighbour: u32| 0.5 * (f64::from(root) + f64::from(f32::from_bits(neighbour)));
            let (below, above) = (halfway(root.to_bits() - 1), halfway(root.to_bits() + 1));
            assert!(
                below * below <= f64::from(x) && f64::from(x) <= above * above,
                "{x}: {root}"
            );
        }
    }

    #[test]
    fn what_has_no_positive_root_is_as_ieee_754_says() {
        assert_eq!(sqrtf(0.0).to_bits(), 0.0_f32.to_bits());
        assert_eq!(sqrtf(-0.0).to_bits(), (-0.0_f32).to_bits());
        assert_eq!(sqrtf(f32::INFINITY), f32::INFINITY);
        assert!(sqrtf(-f32::MIN_POSITIVE).is_nan() && sqrtf(f32::NEG_INFINITY).is_nan() && sqrtf(f32::NAN).is_nan());
    }
}
