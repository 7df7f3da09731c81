//! Equilibria and their poles: (3.14) to (3.21), open loop and under the speed law.

use model::control::speed_law::SpeedLaw;
use model::dynamics::planar::PlanarParameters;

use super::roots::cubic_roots;

/// phi of the stable equilibrium, `asin(sin(beta) / (alpha l))` (3.15), or `None` beyond the static
/// limit (3.16). The unstable equilibrium, the saddle, is at `pi - phi`.
pub fn static_phi(p: &PlanarParameters<f64>) -> Option<f64> {
    let ratio = p.beta.sin() / (p.alpha * p.l);
    (ratio.abs() <= 1.0).then(|| ratio.asin())
}

/// The steady wheel rate under the constant voltage `u` (3.17); infinite without damping, unless the
/// voltage is the hold.
pub fn steady_theta_rate(p: &PlanarParameters<f64>, u: f64) -> f64 {
    let surplus = u - p.beta.sin();
    if surplus == 0.0 { 0.0 } else { surplus / p.zeta }
}

/// The characteristic polynomial of the motion of (phi, theta', phi') about the equilibrium at `phi`,
/// lowest power first: (3.21) without the pole at zero of the cyclic theta, with the feedback of
/// `law` if there is one.
pub fn characteristic_polynomial(p: &PlanarParameters<f64>, phi: f64, law: Option<&SpeedLaw<f64>>) -> [f64; 4] {
    let al = p.alpha * p.l;
    let (m11, m22) = (1.0 + p.mu + p.nu, al * p.l + p.nu);
    let m12 = al * (p.beta - phi).cos() + p.nu;
    let stiffness = al * phi.cos();
    let (kp, kd, fed_back) = law.map_or((0.0, 0.0, 0.0), |law| (law.kp, law.kd, law.alpha_l * phi.cos()));
    let (speed_damping, arm_damping) = (p.zeta - kp, p.zeta + kd);
    [
        speed_damping * stiffness,
        m11 * (stiffness - fed_back) + m12 * fed_back,
        arm_damping * (m11 - m12) + speed_damping * (m22 - m12),
        m11 * m22 - m12 * m12,
    ]
}

/// The three poles `[re, im]` about the equilibrium at `phi`; see [`characteristic_polynomial`].
pub fn poles(p: &PlanarParameters<f64>, phi: f64, law: Option<&SpeedLaw<f64>>) -> [[f64; 2]; 3] {
    cubic_roots(characteristic_polynomial(p, phi, law))
}

/// The rate at which the state leaves the saddle at `pi - phi_0`: its one positive pole; `None` beyond
/// the static limit or where the loop makes more than one direction unstable.
pub fn saddle_growth(p: &PlanarParameters<f64>, law: Option<&SpeedLaw<f64>>) -> Option<f64> {
    let saddle = std::f64::consts::PI - static_phi(p)?;
    let poles = poles(p, saddle, law);
    let mut unstable = poles.iter().filter(|z| z[0] > 0.0);
    match (unstable.next(), unstable.next()) {
        (Some(z), None) => Some(z[0]),
        _ => None,
    }
}

/// The sustained acceleration of the axle, in g, above which no slow ramp keeps the arm from turning
/// over: `(1 + mu) A + sin(beta) = alpha l sqrt(1 + 2 A sin(beta) + A^2)` (erratum E18). `None` beyond the static limit.
pub fn sustained_acceleration_limit(p: &PlanarParameters<f64>) -> Option<f64> {
    static_phi(p)?;
    let (sin_beta, inertia, al2) = (p.beta.sin(), 1.0 + p.mu, (p.alpha * p.l).powi(2));
    // Squared, a quadratic a A^2 + 2 b A - c = 0 with c >= 0 within the static limit.
    let (a, b, c) = (
        inertia * inertia - al2,
        sin_beta * (inertia - al2),
        al2 - sin_beta * sin_beta,
    );
    if a <= 0.0 {
        return None;
    }
    let root = (b * b + a * c).sqrt();
    Some(if b > 0.0 { c / (b + root) } else { (root - b) / a })
}
