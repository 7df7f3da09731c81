//! A scripted person whose hands act on the simulated vehicle.

use std::cell::RefCell;
use std::rc::Rc;

use hil_sim::cli::bring_up::person::Person;
use model::sample::Motor;
use model::supervise::arming::Mode;
use plant::analog::{AnalogFault, Following};
use plant::body::{Push, PushedBody};
use plant::fault::SensorFault;
use report::error::CommandError;
use virtual_board::board::hardware::{SecondContact, World};

use crate::support::Bench;
use crate::wires::READ_US;

/// What the person's hands do from now on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Hands {
    Nothing,
    /// Hold the rims and lean on the arm with so many newtons.
    Lean(f64),
    /// Hold the rims and brake the arm.
    Steady,
    /// Roll the vehicle to this place, m, while one encoder is held still.
    RollTo(f64, Motor),
    /// Press the stop, once after so many looks.
    PressAfter(u32),
    /// Press the board's button once after so many looks.
    ButtonAfter(u32),
    /// The contacts, open or closed.
    Contacts(bool, bool),
    /// Switch the supply off after so many looks, for so many.
    SupplyOff(u32, u32),
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
    /// Gains and offsets of the drive motors' current sensors.
    pub current_gain: [f64; 2],
    pub current_offset_a: [f64; 2],
    /// The hands wait until the vehicle is armed.
    pub waits: bool,
    /// The questions, and whether the vehicle was armed before the next question.
    pub asked: Vec<(String, bool)>,
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
        let seconds = |s: u32| s * 1_000_000 / READ_US as u32;
        if has("first contact alone") {
            (Hands::Contacts(true, false), 20, yes)
        } else if has("second contact alone") {
            (Hands::Contacts(false, true), 20, yes)
        } else if has("Press the emergency stop and hold") {
            (Hands::Contacts(true, true), 20, yes)
        } else if has("Close both") || has("Release the emergency stop") || has("let the core run again") {
            (Hands::Contacts(false, false), 20, yes)
        } else if has("press the emergency stop, ") {
            (Hands::PressAfter(seconds(2)), 0, yes)
        } else if has("blue button, within") {
            (Hands::ButtonAfter(seconds(2)), 0, yes)
        } else if has("then halt the core") {
            // The virtual part has no debugger; the stop's break ends the armed state as a halt does.
            (Hands::PressAfter(seconds(2)), 0, yes)
        } else if has("then ramp") || has("then pull the debugger's plug") {
            (Hands::SupplyOff(seconds(2), seconds(1)), 0, yes)
        } else if has("Ramp 3.3 V up again") || has("Put the plug back") {
            (Hands::SupplyOff(0, 20), 40, yes)
        } else if has("off for 1 s") {
            (Hands::SupplyOff(0, seconds(1)), seconds(2), yes)
        } else if has("cut its supply meanwhile") {
            (Hands::SupplyOff(seconds(1), seconds(1)), 0, yes)
        } else if has("steady the arm") {
            (Hands::Steady, seconds(8), yes)
        } else if has("hang still") {
            (Hands::Nothing, seconds(6), yes)
        } else if has("Tilt the arm forward") {
            (Hands::Lean(50.0), seconds(6), yes)
        } else if has("Turn the left wheel") {
            (Hands::RollTo(shared.rolled_m + TURN_M, Motor::Right), seconds(12), yes)
        } else if has("Turn the right wheel") {
            (Hands::RollTo(shared.rolled_m + TURN_M, Motor::Left), seconds(12), yes)
        } else if has("Wheels off the ground") {
            (Hands::Stand, seconds(1), format!("{}", shared.battery_v))
        } else if has("left motor's current sensor") {
            (Hands::Feed(Motor::Left), 20, format!("{FED_A}"))
        } else if has("right motor's current sensor") {
            (Hands::Feed(Motor::Right), 20, format!("{FED_A}"))
        } else {
            (Hands::Nothing, 10, yes)
        }
    }
}

/// A current from a bench supply, A.
pub const FED_A: f64 = 3.0;
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

/// Puts the stop's contacts so; a welded second one stays closed.
fn put_contacts(world: &mut World, welded: bool, first: bool, second: bool) {
    world.emergency_stop = first;
    world.second_contact = match (first, second) {
        _ if welded => SecondContact::Welded,
        (true, true) | (false, false) => SecondContact::Follows,
        (true, false) => SecondContact::Welded,
        (false, true) => SecondContact::Open,
    };
}

/// Lets the hands act on the bench.
pub fn act(bench: &mut Bench, shared: &mut Shared) {
    let armed = bench.board.status().is_some_and(|status| status.mode == Mode::Armed);
    shared.waits &= !armed;
    shared.looks += u32::from(!shared.waits);
    let looks = shared.looks;
    if let Some((_, was_armed)) = shared.asked.last_mut() {
        *was_armed |= armed;
    }
    if shared.hands == Hands::ButtonAfter(looks) {
        bench.board.press_button();
    }
    bench.board.world(|world| {
        let truth = world.plant.truth();
        shared.battery_v = truth.battery_v;
        shared.rolled_m = truth.x_m;
        let push = |on, forward_n| Push {
            on,
            forward_n,
            left_n: 0.0,
            up_n: 0.0,
        };
        world
            .plant
            .set_chocked(matches!(shared.hands, Hands::Lean(_) | Hands::Steady));
        for motor in [Motor::Left, Motor::Right] {
            // A current through the sensor acts like an offset.
            let fed_a = if shared.hands == Hands::Feed(motor) { FED_A } else { 0.0 };
            let gain = shared.current_gain[motor as usize];
            let name = ["left_current", "right_current"][motor as usize];
            let fault = AnalogFault {
                following: Following::Works,
                gain,
                offset: shared.current_offset_a[motor as usize] + gain * fed_a,
            };
            world.plant.set_analog_fault(name, fault);
            let held = matches!(shared.hands, Hands::RollTo(_, held) if held == motor);
            let encoder = world.plant.encoder_mut(motor);
            if held {
                encoder.set_fault(SensorFault::Stuck);
            } else if encoder.fault() == SensorFault::Stuck {
                encoder.set_fault(SensorFault::None);
            }
        }
        match shared.hands {
            Hands::Lean(newtons) => world.plant.push(push(PushedBody::Arm, newtons), 1.0),
            Hands::Steady => {
                let newtons = (-50.0 * truth.phi_rate_rad_s).clamp(-50.0, 50.0);
                world.plant.push(push(PushedBody::Arm, newtons), 1.0);
            }
            Hands::RollTo(to_m, _) => {
                let newtons = (60.0 * (to_m - truth.x_m)).clamp(-30.0, 30.0);
                world.plant.push(push(PushedBody::Axle, newtons), 1.0);
            }
            Hands::Contacts(first, second) => {
                put_contacts(world, shared.welded, first, second);
            }
            Hands::PressAfter(after) if looks == after => {
                put_contacts(world, shared.welded, true, true);
            }
            Hands::SupplyOff(after, off) => {
                let connected = !(after..after + off).contains(&looks);
                world.plant.set_battery_connected(connected);
            }
            Hands::Stand if looks == 1 => world.plant.set_on_stand(true),
            Hands::Nothing | Hands::Stand | Hands::PressAfter(_) | Hands::ButtonAfter(_) | Hands::Feed(_) => {
                world.plant.push(push(PushedBody::Axle, 0.0), 0.001);
            }
        }
    });
}

/// What a bench answers otherwise than a person without tools, of a virtual board.
pub fn at_a_bench(question: &str) -> Option<&'static str> {
    match question {
        question if question.contains("3.3 V at") => Some("3.31"),
        // No hand reaches these of the virtual board.
        question
            if ["reset button", "supply, V, which is off", "clock away"]
                .iter()
                .any(|q| question.contains(q)) =>
        {
            Some("s")
        }
        _ => None,
    }
}
