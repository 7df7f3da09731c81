//! The drives of the comparison, scaled to the vehicle.

use model::vehicle::{Vehicle, VehicleParameters};
use virtual_board::scenario::Scenario;

/// Instants of arming, of the command, and of the drive's end, s.
const ARM_AT_S: f64 = 2.0;
pub const COMMAND_AT_S: f64 = 8.0;
const END_S: f64 = 20.0;

/// One drive.
#[derive(Debug, Clone)]
pub struct Course {
    /// Its name.
    pub name: String,
    /// The scenario.
    pub scenario: Scenario,
    /// The simulated vehicle, which may differ from the file.
    pub simulated: Vehicle<f64>,
    /// The speed before and after [`COMMAND_AT_S`], if the drive is a step that settles.
    pub step: Option<[f64; 2]>,
}

/// Description of a course.
struct Plan {
    name: String,
    slope_rad: f64,
    ground: String,
    steps: String,
    step: Option<[f64; 2]>,
    simulated: Vehicle<f64>,
}

/// Shares of the largest speed.
const SLOW: f64 = 0.3;
const MIDDLE: f64 = 0.6;
/// Slopes as shares of the steepest slope that arm and grip allow.
const SLOPES: [f64; 3] = [0.3, -0.3, 0.6];
/// Kerb heights as shares of the wheel's radius, up and down.
const KERBS: [f64; 2] = [0.08, -0.08];
/// The friction of ice, and its length in wheel radii.
const ICE_MU: f64 = 0.1;
const ICE_RADII: f64 = 4.0;
/// A push changes the speed of the pushed body by this share of the largest speed, within 0.1 s.
const PUSH_SHARE: f64 = 0.2;
const PUSH_S: f64 = 0.1;
/// Signs of the 20 % deviations of arm mass, arm length, motor constant and resistance from the file.
const CORNERS: [[f64; 4]; 4] = [
    [1.0, 1.0, 1.0, -1.0],
    [1.0, 1.0, -1.0, 1.0],
    [-1.0, -1.0, 1.0, -1.0],
    [-1.0, -1.0, -1.0, 1.0],
];
const CORNER: f64 = 0.2;

/// The steepest slope on which the arm's weight and the file's grip carry the vehicle, rad.
pub fn steepest_rad(vehicle: &Vehicle<f64>) -> f64 {
    let planar = vehicle.planar(0.0);
    let carried = (planar.alpha * planar.l / (1.0 + vehicle.spar_mass_ratio())).min(1.0);
    libm::asin(carried).min(libm::atan(vehicle.parameters().control.grip_mu))
}

/// The drives of a vehicle.
///
/// # Errors
/// Why a drive cannot be made.
pub fn courses(vehicle: &Vehicle<f64>) -> Result<Vec<Course>, String> {
    plans(vehicle)?.into_iter().map(Plan::course).collect()
}

fn plans(vehicle: &Vehicle<f64>) -> Result<Vec<Plan>, String> {
    let p = vehicle.parameters();
    let (most, radius_m) = (p.control.speed_max_m_s, p.body.wheel_radius_m);
    let (slow, middle) = (SLOW * most, MIDDLE * most);
    let plain = |name: String, slope_rad: f64, from: f64, to: f64| Plan {
        name,
        slope_rad,
        ground: String::new(),
        steps: command(COMMAND_AT_S, to),
        step: Some([from, to]),
        simulated: *vehicle,
    };
    let mut plans = vec![
        plain(format!("step to {slow:.2} m/s"), 0.0, 0.0, slow),
        plain(format!("step to {most:.2} m/s"), 0.0, 0.0, most),
        Plan {
            steps: command(3.0, middle) + &command(COMMAND_AT_S, -middle),
            ..plain(format!("reversal from {middle:.2} m/s"), 0.0, middle, -middle)
        },
    ];
    for share in SLOPES {
        let slope_rad = share * steepest_rad(vehicle);
        let name = format!("let go, step to {slow:.2} m/s on {:.1} deg", slope_rad.to_degrees());
        plans.push(plain(name, slope_rad, 0.0, slow));
    }
    for share in KERBS {
        let height_m = share * radius_m;
        let kind = if share > 0.0 { "kerb" } else { "ledge" };
        plans.push(Plan {
            ground: format!(
                "[[terrain.profile]]\nkind = 'step'\nat_m = {:?}\nheight_m = {height_m:?}\n",
                3.0 * radius_m
            ),
            step: None,
            ..plain(
                format!("{kind} of {:.0} mm at {slow:.2} m/s", 1000.0 * height_m.abs()),
                0.0,
                0.0,
                slow,
            )
        });
    }
    plans.push(Plan {
        ground: format!(
            "[[terrain.patch]]\nfrom_m = {:?}\nto_m = {:?}\nleft = {ICE_MU:?}\nright = {ICE_MU:?}\n",
            2.0 * radius_m,
            (2.0 + ICE_RADII) * radius_m
        ),
        step: None,
        ..plain(format!("ice of mu {ICE_MU} at {middle:.2} m/s"), 0.0, 0.0, middle)
    });
    let arm_kg = p.body.arm_mass_kg;
    for (on, mass_kg) in [("axle", p.body.total_mass_kg - arm_kg), ("arm", arm_kg)] {
        let force_n = mass_kg * PUSH_SHARE * most / PUSH_S;
        plans.push(Plan {
            steps: format!("{{ at_s = {COMMAND_AT_S:?}, action = 'push', on = '{on}', forward_n = {force_n:?}, for_s = {PUSH_S:?} }}"),
            step: None,
            ..plain(format!("push of {:.1} N s on the {on} at rest", force_n * PUSH_S), 0.0, 0.0, 0.0)
        });
    }
    for signs in CORNERS {
        let mut parameters = *p;
        corner(&mut parameters, signs);
        let simulated = Vehicle::new(parameters).map_err(|error| format!("a vehicle 20 % off: {error}"))?;
        let signs = signs.map(|sign| if sign > 0.0 { '+' } else { '-' });
        plans.push(Plan {
            simulated,
            ..plain(
                format!(
                    "step to {slow:.2} m/s, arm's mass {}20 %, length {}20 %, motor constant {}20 %, resistance {}20 %",
                    signs[0], signs[1], signs[2], signs[3]
                ),
                0.0,
                0.0,
                slow,
            )
        });
    }
    Ok(plans)
}

fn corner(p: &mut VehicleParameters<f64>, signs: [f64; 4]) {
    let [mass, length, constant, resistance] = signs.map(|sign| 1.0 + CORNER * sign);
    p.body.total_mass_kg += (mass - 1.0) * p.body.arm_mass_kg;
    p.body.arm_mass_kg *= mass;
    p.body.arm_length_m *= length;
    p.drive_motor.torque_constant_n_m_per_a *= constant;
    p.drive_motor.resistance_ohm *= resistance;
    // Gains must fit their vehicle, and the simulated vehicle has no law.
    p.control.kp = 0.0;
}

fn command(at_s: f64, speed_m_s: f64) -> String {
    format!("{{ at_s = {at_s:?}, action = 'drive', speed_m_s = {speed_m_s:?} }}, ")
}

impl Plan {
    fn course(self) -> Result<Course, String> {
        let text = format!(
            "title = 'comparison'\nduration_s = {END_S:?}\nchocked_until_armed = true\n\
             step = [{{ at_s = {ARM_AT_S:?}, action = 'arm' }}, {}]\n[terrain.plane]\nslope_x_rad = {:?}\n{}",
            self.steps, self.slope_rad, self.ground
        );
        let scenario = Scenario::parse(&self.name, &text).map_err(|error| error.to_string())?;
        Ok(Course {
            name: self.name,
            scenario,
            simulated: self.simulated,
            step: self.step,
        })
    }
}
