//! A scripted person whose hands act on the simulated vehicle.
#![allow(dead_code)] // Each test binary uses its part.

use std::cell::RefCell;
use std::f64::consts::FRAC_PI_2;
use std::rc::Rc;

use firmware::hardware::ResetCause;
use hil_sim::cli::bring_up::person::Person;
use model::sample::Motor;
use plant::Plant;
use plant::analog::{AnalogFault, Following};
use plant::body::{BALLAST, Push, PushedBody, SPAR};
use plant::fault::SensorFault;
use report::error::CommandError;

/// What the person's hands do from now on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Hands {
    Nothing,
    /// Hold the rims and lean on the arm with so many newtons.
    Lean(f64),
    /// Brake the arm; its wheels, in the air, are free, so that friction holds it nowhere else than where it hangs.
    Steady,
    /// Roll the vehicle to this place, m, while one encoder is held still.
    RollTo(f64, Motor),
    /// Push the arm for a tenth of a second after so many looks.
    NudgeAfter(u32),
    /// Press the stop, once after so many looks.
    PressAfter(u32),
    /// Press the board's button once after so many looks.
    ButtonAfter(u32),
    /// The contacts, open or closed.
    Contacts(bool, bool),
    /// Switch the supply off after so many looks, for so many.
    SupplyOff(u32, u32),
    /// Reset the board by such a cause after so many looks.
    ResetAfter(u32, ResetCause),
    /// Hold the camera, so that the spar has this angle, rad; upright until the vehicle is armed.
    TiltSpar(f64),
    /// Hold the spar upright and turn the ballast to this angle against it, rad.
    TurnBallast(f64),
    /// The axle on the stand.
    Stand,
    /// Feed a current through a motor's sensor.
    Feed(Motor),
}

/// What the person and the world share.
pub struct Shared {
    pub hands: Hands,
    /// How often the hands have acted since the last question.
    pub looks: u32,
    pub battery_v: f64,
    pub rolled_m: f64,
    /// The stop's second contact never opens.
    pub welded: bool,
    /// The board feeds on the debugger's plug.
    pub plug_is_supply: bool,
    /// Gains and offsets of the motors' current sensors.
    pub current_gain: [f64; 3],
    pub current_offset_a: [f64; 3],
    /// The hands wait until the vehicle is armed.
    pub waits: bool,
    /// The questions, and whether the vehicle was armed before the next question.
    pub asked: Vec<(String, bool)>,
}

impl Default for Shared {
    /// A good board, before the first question.
    fn default() -> Self {
        Self {
            hands: Hands::Nothing,
            looks: 0,
            battery_v: 0.0,
            rolled_m: 0.0,
            welded: false,
            plug_is_supply: false,
            current_gain: [1.0; 3],
            current_offset_a: [0.0; 3],
            waits: false,
            asked: Vec::new(),
        }
    }
}

/// A question, by a part of it, and who answers it otherwise than a person with a good board.
pub type Otherwise = fn(&str) -> Option<&'static str>;

pub struct Script {
    pub shared: Rc<RefCell<Shared>>,
    pub looks: u32,
    pub otherwise: Otherwise,
}

impl Script {
    /// What the person does when asked, how many looks that takes, and the answer.
    fn act(&mut self, question: &str) -> (Hands, u32, String) {
        let yes = String::new();
        let shared = self.shared.borrow();
        let has = |part: &str| question.contains(part);
        let seconds = |s: u32| s * 1_000_000 / LOOK_US as u32;
        if has("first contact alone") {
            (Hands::Contacts(true, false), 20, yes)
        } else if has("second contact alone") {
            (Hands::Contacts(false, true), 20, yes)
        } else if has("Press the emergency stop and hold") {
            (Hands::Contacts(true, true), 20, yes)
        } else if has("Close both") || has("Release the emergency stop") || has("and let the core run again") {
            (Hands::Contacts(false, false), 20, yes)
        } else if has("press the emergency stop, ") {
            (Hands::PressAfter(seconds(2)), 0, yes)
        } else if has("then give the arm a small push") {
            (Hands::NudgeAfter(seconds(2)), 0, yes)
        } else if has("blue button, within") {
            (Hands::ButtonAfter(seconds(2)), 0, yes)
        } else if has("which has cleared bit 18") {
            (Hands::ResetAfter(seconds(2), ResetCause::Watchdog), 0, yes)
        } else if has("Press the board's reset button") {
            (Hands::ResetAfter(1, ResetCause::Pin), 20, yes)
        } else if has("then pull the debugger's plug") && !shared.plug_is_supply {
            (Hands::ResetAfter(seconds(2), ResetCause::Software), 0, yes)
        } else if has("then halt the core") {
            // The virtual part has no debugger; the stop's break ends the armed state as a halt does.
            (Hands::PressAfter(seconds(2)), 0, yes)
        } else if has("then ramp") || has("then pull the debugger's plug") {
            (Hands::SupplyOff(seconds(2), seconds(1)), 0, yes)
        } else if has("Ramp 3.3 V up again") || (has("Put the plug back") && shared.plug_is_supply) {
            (Hands::SupplyOff(0, 20), 40, yes)
        } else if has("off for 1 s") {
            (Hands::SupplyOff(0, seconds(1)), seconds(2), yes)
        } else if has("cut its supply meanwhile") {
            (Hands::SupplyOff(seconds(1), seconds(1)), 0, yes)
        } else if has("steady the arm") {
            (Hands::Steady, seconds(8), yes)
        } else if has("Steady the spar") {
            (Hands::TiltSpar(0.0), seconds(4), yes)
        } else if has("hang still") {
            (Hands::Nothing, seconds(6), yes)
        } else if has("Tilt the arm forward") {
            (Hands::Lean(50.0), seconds(6), yes)
        } else if has("Tilt the spar's lower end forward") {
            (Hands::TiltSpar(0.45), seconds(6), yes)
        } else if has("Turn the ballast's lower end forward") {
            (Hands::TurnBallast(FRAC_PI_2), seconds(6), yes)
        } else if has("tilt its lower end forward by 10 degrees") {
            (Hands::TiltSpar(0.17), 0, yes)
        } else if has("Turn the left wheel") {
            (Hands::RollTo(shared.rolled_m + TURN_M, Motor::Right), seconds(12), yes)
        } else if has("Turn the right wheel") {
            (Hands::RollTo(shared.rolled_m + TURN_M, Motor::Left), seconds(12), yes)
        } else if has("Wheels off the ground") {
            (Hands::Stand, seconds(8), format!("{}", shared.battery_v))
        } else if has("left motor's current sensor") {
            (Hands::Feed(Motor::Left), 20, format!("{FED_A}"))
        } else if has("right motor's current sensor") {
            (Hands::Feed(Motor::Right), 20, format!("{FED_A}"))
        } else if has("ballast motor's current sensor") {
            (Hands::Feed(Motor::Ballast), 20, format!("{FED_A}"))
        } else {
            (Hands::Nothing, 10, yes)
        }
    }
}

/// Time between two looks of the hands, us.
pub const LOOK_US: u64 = 5_000;
/// How long the board's button is held, looks.
const HELD_LOOKS: u32 = 20;
/// A current from a bench supply, A.
pub const FED_A: f64 = 3.0;
/// How fast a hand tilts the spar: half a radian per second.
const TILT_RAD_PER_LOOK: f64 = 0.5e-6 * LOOK_US as f64;
/// One turn of the reference vehicle's wheels, m.
pub const TURN_M: f64 = 2.0 * std::f64::consts::PI * 0.25;

impl Person for Script {
    fn reply(&mut self, question: &str) -> Result<Option<String>, CommandError> {
        let is_new = |shared: &Shared| shared.asked.last().is_none_or(|(last, _)| last != question);
        if is_new(&self.shared.borrow()) || self.looks == 0 {
            self.shared.borrow_mut().asked.push((question.to_owned(), false));
            if let Some(answer) = (self.otherwise)(question) {
                return Ok(Some(answer.to_owned()));
            }
            let (hands, looks, answer) = self.act(question);
            self.shared.borrow_mut().hands = hands;
            self.shared.borrow_mut().looks = 0;
            self.shared.borrow_mut().waits = question.contains("Armed ");
            self.looks = looks;
            if looks > 0 {
                return Ok(None);
            }
            return Ok(Some(answer));
        }
        self.looks -= 1;
        if self.looks > 0 {
            return Ok(None);
        }
        let (_, _, answer) = self.act(question);
        Ok(Some(answer))
    }
}

/// A hand at the camera, which is above the axle: it pushes back what shall come forward below. Strong enough against the
/// ballast's weight, and damped.
fn hold_spar(plant: &mut Plant, to_rad: f64) {
    let truth = plant.truth();
    let forward_n = 40.0 * (truth.spar_rad - to_rad) + 5.0 * truth.spar_rate_rad_s;
    let push = Push {
        on: PushedBody::Spar,
        forward_n: forward_n.clamp(-20.0, 20.0),
        left_n: 0.0,
        up_n: 0.0,
    };
    plant.push(push, 1.0);
}

/// What the hands do to the board in one look.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Deeds {
    /// Open the stop's contacts, first and second, or close them.
    pub contacts: Option<(bool, bool)>,
    /// Press the board's button, or let it go.
    pub button: Option<bool>,
    /// Reset the board by such a cause.
    pub reset: Option<ResetCause>,
}

/// Lets the hands act on the vehicle of a board that is armed or not; what they do to the board.
pub fn act(plant: &mut Plant, shared: &mut Shared, armed: bool) -> Deeds {
    shared.waits &= !armed;
    shared.looks += u32::from(!shared.waits);
    let looks = shared.looks;
    if let Some((_, was_armed)) = shared.asked.last_mut() {
        *was_armed |= armed;
    }
    let truth = plant.truth();
    shared.battery_v = truth.battery_v;
    shared.rolled_m = truth.x_m;
    feel_currents(plant, shared);
    let mut deeds = Deeds::default();
    let push = |on, forward_n| Push {
        on,
        forward_n,
        left_n: 0.0,
        up_n: 0.0,
    };
    plant.set_chocked(matches!(shared.hands, Hands::Lean(_)));
    match shared.hands {
        Hands::ButtonAfter(after) if looks == after => deeds.button = Some(true),
        Hands::ButtonAfter(after) if looks == after + HELD_LOOKS => deeds.button = Some(false),
        Hands::ResetAfter(after, cause) if looks == after => deeds.reset = Some(cause),
        Hands::PressAfter(after) if looks == after => deeds.contacts = Some((true, true)),
        Hands::Contacts(first, second) => deeds.contacts = Some((first, second)),
        Hands::Lean(newtons) => plant.push(push(PushedBody::Arm, newtons), 1.0),
        Hands::NudgeAfter(after) if looks == after => plant.push(push(PushedBody::Arm, 10.0), 0.1),
        Hands::Stand if looks == 1 => plant.set_on_stand(true),
        Hands::Steady | Hands::Stand => {
            let newtons = (-50.0 * truth.phi_rate_rad_s).clamp(-50.0, 50.0);
            plant.push(push(PushedBody::Arm, newtons), 1.0);
        }
        Hands::TiltSpar(to_rad) => {
            let to_rad = if shared.waits {
                0.0
            } else {
                to_rad.min(TILT_RAD_PER_LOOK * f64::from(looks))
            };
            hold_spar(plant, to_rad);
        }
        Hands::TurnBallast(to_rad) => {
            hold_spar(plant, 0.0);
            let (position, speed) = plant.body_mut().state_mut();
            let left_rad = to_rad - (position[BALLAST] - position[SPAR]);
            speed[BALLAST] = speed[SPAR] + (10.0 * left_rad).clamp(-1.0, 1.0);
        }
        Hands::RollTo(to_m, _) => {
            let newtons = (60.0 * (to_m - truth.x_m)).clamp(-30.0, 30.0);
            plant.push(push(PushedBody::Axle, newtons), 1.0);
        }
        Hands::SupplyOff(after, off) => {
            let connected = !(after..after + off).contains(&looks);
            plant.set_battery_connected(connected);
        }
        // A push that has begun ends by itself.
        Hands::NudgeAfter(_) => {}
        Hands::Nothing | Hands::PressAfter(_) | Hands::ButtonAfter(_) | Hands::ResetAfter(..) | Hands::Feed(_) => {
            plant.push(push(PushedBody::Axle, 0.0), 0.001);
        }
    }
    deeds
}

/// The current sensors with their errors, and with the current that a hand feeds; the encoder that a hand holds.
fn feel_currents(plant: &mut Plant, shared: &Shared) {
    let current_a = ["left_current", "right_current", "ballast_current"];
    for (motor, name) in [Motor::Left, Motor::Right, Motor::Ballast].into_iter().zip(current_a) {
        // A current through the sensor acts like an offset.
        let fed_a = if shared.hands == Hands::Feed(motor) { FED_A } else { 0.0 };
        let gain = shared.current_gain[motor as usize];
        let fault = AnalogFault {
            following: Following::Works,
            gain,
            offset: shared.current_offset_a[motor as usize] + gain * fed_a,
        };
        plant.set_analog_fault(name, fault);
        let held = matches!(shared.hands, Hands::RollTo(_, held) if held == motor);
        let encoder = plant.encoder_mut(motor);
        if held {
            encoder.set_fault(SensorFault::Stuck);
        } else if encoder.fault() == SensorFault::Stuck {
            encoder.set_fault(SensorFault::None);
        }
    }
}

/// What a bench answers otherwise than a person without tools, of a virtual board.
pub fn at_a_bench(question: &str) -> Option<&'static str> {
    match question {
        question if question.contains("3.3 V at") => Some("3.31"),
        // No hand reaches these of the virtual board.
        question
            if ["supply, V, which is off", "clock away"]
                .iter()
                .any(|q| question.contains(q)) =>
        {
            Some("s")
        }
        _ => None,
    }
}
