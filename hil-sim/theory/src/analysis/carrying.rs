//! A planar vehicle that carries a mass on its axle.

use model::dynamics::planar::PlanarParameters;

/// The vehicle `p` with so much on its axle that it has `mass` times its own mass: the same equations, divided by the whole mass.
/// Torques and voltages are then in units that are `mass` times as large.
pub fn carrying(p: &PlanarParameters<f64>, mass: f64) -> PlanarParameters<f64> {
    PlanarParameters {
        alpha: p.alpha / mass,
        mu: p.mu / mass,
        nu: p.nu / mass,
        zeta: p.zeta / mass,
        ..*p
    }
}
