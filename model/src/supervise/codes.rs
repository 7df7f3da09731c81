//! Numbered, stable codes and sets of them.

// First: the definitions below use its macros.
#[macro_use]
mod define;

/// The reaction to a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum FaultClass {
    /// The bridges open at once.
    Opens,
    /// The vehicle, which can still be controlled, makes a controlled stop.
    Stops,
    /// Only the ballast motor is switched off.
    Spar,
}

faults! {
    /// Why the vehicle stopped. A fault is latched when it occurs while armed, until it is cleared. Numbers are stable.
    Fault;
    /// A set of faults.
    FaultSet;
    /// The emergency stop was pressed.
    EmergencyStop = 0 => Opens(
        "first contact, sampled each tick",
        "1 tick; the second contact opens the bridges [in hardware](#emergency-stop-and-hardware-break) before it",
        "Find out why somebody pressed it, then release it."
    ),
    /// The bridges' hardware break tripped.
    BridgeBreak = 1 => Opens(
        "flag of the hardware break, sampled each tick",
        "the bridges are open before the firmware reads the flag",
        "Look for an overcurrent or a fault of a bridge, and for an open stop contact."
    ),
    /// The arm IMU gave no sample in time.
    ImuStale = 2 => Opens(
        "newest sample of the arm IMU older than `sensor_timeout_s` (5 ms)",
        "15 ms for an IMU that goes dead",
        "Check the arm IMU's supply and its SPI cable."
    ),
    /// The arm IMU repeats one reading, or its readings cannot be true.
    ImuImplausible = 3 => Opens(
        "one reading repeated for 20 ticks (`REPEATED_TICKS`); a value at the end of its range for 10 ticks (`SATURATED_TICKS`); a force beyond 6 g, or a rate jumping 200 deg/s in a tick, in most of 40 ticks (`IMPOSSIBLE_TICKS`, `Suspicion`); a force below 0.2 g for 300 ticks, which is a fall of 0.44 m (`FORCELESS_TICKS`); integrated gyro and accelerometer differ by a sine of 0.7 for 300 ticks (`CONTRADICTION`); the accelerometer feels less than -0.5 g along the estimated vertical for 40 ticks (`OVERTURNED_TICKS`); it feels more along the axle than across it for 400 ticks, while disarmed (`ON_ITS_SIDE_TICKS`); wheels that have been on the ground for 270 ticks (`STEADY_WEIGHT_TICKS`) and the accelerometer contradict each other as a mirrored IMU makes them, for 60 ms (`MIRRORED_INTERVALS` in [`facing.rs`](../model/src/estimate/facing.rs)); the arm stands still and the vehicle rolls, in the rhythm of its wheels for 60 ms, or by 0.15 rad ([`exchanged.rs`](../model/src/estimate/exchanged.rs))",
        "stuck 40 ms; noise 150 ms; intermittent 60 ms; without its accelerometer 320 ms; every sign wrong 50 ms; mounted facing backward 300 ms from the first motion of the arm, a quarter of a turn aside 300 ms, and neither found while the arm hangs still; on its side before it can be armed",
        "Check the arm IMU's mounting and its cable; the log shows when the fault began."
    ),
    /// The encoders gave no sample in time.
    EncoderStale = 4 => Opens(
        "counts older than `sensor_timeout_s` (5 ms); the control task reads the drive board's counters itself, so only another board's can be",
        "1 tick",
        "Check the encoders' supply."
    ),
    /// A wheel's encoder contradicts its motor's voltage and current, or jumped.
    EncoderImplausible = 5 => Opens(
        "a tick's advance beyond twice the no-load speed; or voltage less resistance drop less back-EMF beyond 0.35 V plus half the drop plus a quarter of the back-EMF (`RESIDUAL_V`, `RESIDUAL_SHARE`, `BACK_EMF_SHARE`) for 250 ticks (`RESIDUAL_TICKS`), or 0.1 rad that the motor has surely turned while the encoder stands (`SILENT_STEPS`), and the other wheel and the gyro show another rate by half of what is missing (`BORNE_OUT_SHARE`), or their encoder is doubted too; not after CurrentSensor. A supply that reads less than `minimum_v` may be as low as it reads or as high as `maximum_v`: then every voltage in between must contradict",
        "noise 100 ms; dead, stuck or reversed 600 ms from 0.15 m/s to 2.5 m/s (260 ms found); not found while the wheel stands",
        "Check the encoder's cable, its direction, and that its disc sits tight."
    ),
    /// A drive motor's current exceeded the largest allowed.
    Overcurrent = 6 => Opens(
        "the current of either drive motor beyond `overcurrent_a`",
        "3 ticks; a bridge that reports a fault of its own acts through the break",
        "Check the motor and its leads for a short, and free a blocked wheel."
    ) for 3 ticks,
    /// The battery is below its lowest voltage.
    BatteryLow = 7 => Stops(
        "filtered supply (5 ms) below `minimum_v`",
        "the stop begins within 300 ms",
        "Charge or change the battery; check its contacts."
    ) for 50 ticks,
    /// The battery is above its highest voltage.
    BatteryHigh = 8 => Opens(
        "filtered supply (5 ms) above `maximum_v`",
        "150 ms",
        "Use a battery within `battery.maximum_v`; brake less on long descents."
    ) for 50 ticks,
    /// The analogue inputs gave no reading in time.
    AnalogStale = 9 => Stops(
        "reading older than `sensor_timeout_s` (5 ms)",
        "the stop begins within 6 ms",
        "Check the board's analogue supply."
    ),
    /// The arm swung beyond its largest angle and did not come back: the vehicle whirls, or is about to.
    ArmAngle = 10 => Opens(
        "estimated arm angle beyond 135 deg (`OVERTURNS_RAD`), or beyond `phi_max_rad` (1.4 rad) for 1000 ticks (`RETURN_TICKS`); in a controlled stop, and under Eq. 3.25, which does not bring the arm back, beyond `phi_max_rad`",
        "1 tick beyond 135 deg and in a controlled stop, otherwise 1 s",
        "Accelerate less, or take a gentler slope; let the arm hang still before arming again."
    ),
    /// No drive command came in time.
    CommandTimeout = 11 => Stops(
        "newest command older than `command_timeout_s` (0.25 s), or not a number",
        "the stop begins within 252 ms of the giving of the last command",
        "Check the link and the operator's program; keep the page in front while driving."
    ),
    /// A controlled stop did not come to rest in time.
    StopTimeout = 12 => Opens(
        "`stop_timeout_s` (4 s) in Stopping",
        "4 s after the stop began",
        "Bring the vehicle to level ground; something kept it from coming to rest."
    ),
    /// A computed value was not a number.
    NotFinite = 13 => Opens(
        "an estimate, or a voltage about to be applied, is not a number",
        "the same tick: the value is not applied",
        "Check the parameters that were changed last; keep the records and report them."
    ),
    /// A tick came far too late.
    DeadlineMissed = 14 => Opens(
        "more than 5 ms from one tick to the next (`MISSED_US`); more than 1.5 ms counts in `late_ticks` (`LATE_US`)",
        "the late tick itself; if the core hangs altogether, the watchdog acts",
        "Keep the records and report them: the board was too busy."
    ),
    /// The spar tilted beyond its largest angle: the ballast motor is off.
    SparAngle = 15 => Spar(
        "estimated spar angle beyond `spar_max_rad` (1.3 rad)",
        "1 tick",
        "Lift the spar upright, or check how its IMU is mounted; drive more gently with a camera."
    ),
    /// The spar IMU gave no believable sample: the ballast motor is off.
    SparImu = 16 => Spar(
        "as ImuStale and ImuImplausible, but for the contradiction and the wheels; ballast and spar contradict each other as a mirrored IMU makes them, for 45 ms ([`spar_facing.rs`](../model/src/estimate/spar_facing.rs)), or as one that is mounted a quarter of a turn aside ([`exchanged.rs`](../model/src/estimate/exchanged.rs))",
        "as there; mounted facing backward or a quarter of a turn aside 120 ms after the ballast's first motion; on its side 1 tick after arming",
        "Check the spar IMU's mounting and its cable; the vehicle drives without levelling meanwhile."
    ),
    /// The ballast's encoder contradicts its motor's voltage and current, or jumped: the ballast motor is off.
    BallastEncoder = 17 => Spar(
        "as EncoderImplausible, without a second witness of the rate; not while less than a tenth of the current flows that the voltage should drive, as a lead may be open",
        "noise 200 ms; dead, stuck or reversed only while the ballast turns faster than half its residual allows",
        "Check the ballast encoder's cable; the vehicle drives without levelling meanwhile."
    ),
    /// The ballast motor's current exceeded the largest allowed: the ballast motor is off.
    BallastOvercurrent = 18 => Spar(
        "the ballast motor's current beyond `overcurrent_a`",
        "3 ticks",
        "Free the ballast; check its motor and leads for a short."
    ) for 3 ticks,
    /// No current follows the ballast motor's voltage: a lead is open, and the ballast motor is off.
    BallastMotorOpen = 19 => Spar(
        "as LeftMotorOpen",
        "as there, once levelling asks for 1.6 A",
        "Check the ballast motor's leads and plug."
    ),
    /// The ballast motor's current sensor does not follow the current, or showed one at an open bridge: the ballast motor is off.
    BallastCurrentSensor = 20 => Spar(
        "as CurrentSensor, and the offset that blocks arming for a drive motor",
        "only while levelling works the motor",
        "Check the ballast motor's current sensor and its leads."
    ),
    /// No current follows the left motor's voltage: a lead is open.
    LeftMotorOpen = 21 => Opens(
        "the voltage should drive 40 % of `current_limit_a` (`OPEN_SHARE`), less than a tenth of that flows, and the current does not follow the voltage, for 100 ticks (`OPEN_TICKS`); and the motor is without torque: its output has fallen behind by 0.1 rad/s (`OPEN_BEHIND_RAD_S`), or what drives the other motor differs by half (`OPEN_ALONE_SHARE`), while the other wheel and the gyro bear its encoder out; not after CurrentSensor",
        "400 ms while driving (180 ms found); a vehicle that stands still on the level shows CurrentSensor instead",
        "Check the left motor's leads and plug."
    ),
    /// No current follows the right motor's voltage: a lead is open.
    RightMotorOpen = 22 => Opens(
        "the same on the right",
        "as there",
        "Check the right motor's leads and plug."
    ),
    /// A drive motor's current sensor does not follow the current.
    CurrentSensor = 23 => Stops(
        "changes of the measured current follow less than a quarter of those that the voltage makes (`DEAD_SHARE`) for 150 ticks (`DEAD_TICKS`), for 400 while the motor works against the other as one with an open lead does (`DEAD_ALONE_TICKS`); or a contradiction as of EncoderImplausible while the other wheel and the gyro bear the encoder out",
        "the stop begins within 1 s from a stand to 2 m/s (630 ms found); not found while the voltage rests at a limit",
        "Check the drive motors' current sensors."
    ),
    // The ticks: longer than the contacts of one button take to follow each other, and than a pulse on the break's wire
    // lasts.
    /// The emergency stop's two contacts disagree.
    StopContacts = 24 => Opens(
        "first contact and break input differ",
        "100 ms; the contact that did open has opened the bridges before",
        "Check both contacts of the emergency stop and their wires."
    ) for 100 ticks,
    /// The vehicle was armed on a slope on which it cannot stand.
    SteepSlope = 25 => Stops(
        "not commanded to drive since it was armed, the slope is beyond what the arm's weight carries or `grip_mu` holds: excess of its sine over 0.06 time units (`EXCESS_TIME`); once it has stood on a gentle slope, beyond the limit for 40 time units (`PUSHED_TIME`)",
        "the stop begins within 1 s of its wheels being let go; until then a hanging arm shows no slope",
        "Arm the vehicle on a gentler slope; keep chocks at hand when it stops."
    ),
    /// A drive motor's winding is hotter than its continuous current makes it.
    DriveMotorHot = 26 => Stops(
        "the measured current has heated a drive motor's winding, by its `continuous_current_a` and `winding_time_constant_s`, to 1.2 times what the continuous current keeps up (`HEAT_FAULT`)",
        "from cold 6 s at 17 A, 2 s at 30 A; the limit MotorHeat holds a motor that obeys it below",
        "Let the drive motors cool for a minute; take a gentler slope or a lighter load."
    ),
    /// The ballast motor's winding is hotter than its continuous current makes it: the ballast motor is off.
    BallastMotorHot = 27 => Spar(
        "the same of the ballast motor",
        "from cold 14 s at 4 A",
        "Let the ballast motor cool for a minute; check that the ballast turns freely."
    ),
    /// The bridge of a drive motor is hotter than its continuous current makes it.
    DriveBridgeHot = 28 => Stops(
        "the measured current has heated the bridge of a drive motor, by its `bridge_continuous_a` and `bridge_time_constant_s`, to 1.2 times what the continuous current keeps up (`HEAT_FAULT`)",
        "from cold 2.3 s at 30 A; the limit MotorHeat holds a motor that obeys it below; a driver that shuts itself down acts through the break",
        "Let the bridges cool for ten seconds; look after their cooling, and compare `bridge_continuous_a` with the drivers."
    ),
    /// The bridge of the ballast motor is hotter than its continuous current makes it: the ballast motor is off.
    BallastBridgeHot = 29 => Spar(
        "the same of the ballast motor's bridge",
        "from cold 1.9 s at 4 A",
        "Let the ballast's bridge cool for ten seconds; check that the ballast turns freely, and the bridge's cooling."
    ),
}

remedied_codes! {
    /// Why the vehicle may not be armed. All are present at boot.
    Blocker;
    /// A set of blockers; full at boot.
    BlockerSet;
    /// The gyros are not calibrated yet: keep the vehicle at rest.
    NotCalibrated = 0 => "Keep the vehicle at rest for some seconds.",
    /// A latched fault has not been cleared.
    FaultLatched = 1 => "Remove the cause of each fault, then clear the faults.",
    /// The emergency stop is pressed.
    EmergencyStop = 2 => "Release the emergency stop.",
    /// The bridges' hardware break has tripped.
    BridgeBreak = 3 => "Remove the cause of the break, then clear the faults.",
    /// The arm IMU gives no believable samples.
    Imu = 4 => "Check the arm IMU's mounting, supply and cable.",
    /// The encoders give no samples.
    Encoder = 5 => "Check the encoders' supply and cables.",
    /// The analogue inputs give no readings.
    Analog = 6 => "Check the board's analogue supply.",
    /// The battery is outside its range.
    Battery = 7 => "Charge or change the battery.",
    /// The vehicle moves.
    NotAtRest = 8 => "Let the vehicle and its arm come to rest; put chocks to the wheels on a slope.",
    /// The arm hangs beyond half its largest angle.
    ArmAngle = 9 => "Let the arm hang down; if it does, check how its IMU is mounted.",
    /// No fresh drive command.
    NoCommand = 10 => "Let the operator's program send a drive command.",
    /// The drive command asks for motion.
    CommandNotNeutral = 11 => "Let go of keys, pad and gamepad.",
    /// Stored parameters are not in force: a change is being stored, or the stored set cannot be believed.
    Parameters = 12 => "Wait until the set is stored; if the stored set was lost, store one.",
    /// A drive motor's current sensor shows a current though every bridge is open.
    CurrentSensor = 13 => "Check the drive motors' current sensors.",
    /// The emergency stop's two contacts have disagreed since faults were last cleared.
    StopContacts = 14 => "Check both contacts of the emergency stop, then clear the faults.",
    /// The break that the self-test asked for did not switch the bridges off.
    BreakPath = 15 => "Check the wiring of the bridges' break; boot the board again.",
    /// The part's option bytes are not those that the board needs.
    BoardOptions = 16 => "Set the part's option bytes as the bring-up page says.",
    /// The part's silicon is of a revision that the board is not made for.
    PartRevision = 17 => "Use a board with a supported part.",
    /// The firmware in the flash cannot be read, or is not the one that was built.
    Image = 18 => "Flash the firmware again.",
    /// The firmware in the flash has no checksum: nothing of the project flashed it.
    Unsealed = 19 => "Flash the firmware by `cargo flash-board`, which writes its checksum.",
    /// A word of the RAM did not keep what was written to it when the supply came up.
    Ram = 20 => "Switch the board's supply off and on; if the RAM fails again, use another board.",
    /// A drive motor or its bridge is too hot.
    MotorHot = 21 => "Let the drive motors cool for a minute, their bridges for ten seconds.",
    /// A new firmware is being stored.
    Update = 22 => "Wait until the update is stored; one that its host has left is given up after 10 s.",
    /// The board's own supply of 3.3 V is low: the break has tripped, and nothing is stored.
    PartSupply = 23 => "Check the board's 3.3 V and what feeds it; then clear the faults.",
}

codes! {
    /// A limit that bounds the vehicle's response in this tick. A limit is no fault.
    Limit;
    /// A set of limits.
    LimitSet;
    /// The supply voltage bounds the drive.
    Voltage = 0,
    /// The left motor's current limit.
    LeftCurrent = 1,
    /// The right motor's current limit.
    RightCurrent = 2,
    /// The ballast motor's current limit.
    BallastCurrent = 3,
    /// The governed speed or yaw rate is not the commanded one: still on its way, or held back, a turn by the ground's grip.
    Reference = 4,
    /// Something blocks the vehicle: it is commanded to drive, and its wheels do not turn.
    Stall = 5,
    /// The wheels slide.
    Slip = 6,
    /// The slope is beyond what the arm's weight can carry or the configured grip can hold: no driving further up.
    SlopeLimit = 7,
    /// The heat of a motor or its bridge, or more measured current than its limit, bounds its current.
    MotorHeat = 8,
    /// The supply is near its highest voltage: braking may return less power to it.
    Regeneration = 9,
    /// The wheels have come past what had held them up, and the law has forgotten the slope that it had taken it for.
    Freed = 10,
}

impl FaultSet {
    /// Faults that open the bridges at once.
    pub const OPENING: Self = Self::of(FaultClass::Opens);
    /// Faults that bring the vehicle, which can still be controlled, to a controlled stop.
    pub const STOPPING: Self = Self::of(FaultClass::Stops);
    /// Faults that only switch the ballast motor off.
    pub const SPAR: Self = Self::of(FaultClass::Spar);

    /// The faults of one class.
    const fn of(class: FaultClass) -> Self {
        let mut bits = 0;
        let mut n = 0;
        while n < Fault::ALL.len() {
            if Fault::DETECTION[n].0 as u8 == class as u8 {
                bits |= Fault::ALL[n].bit();
            }
            n += 1;
        }
        Self(bits)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::string::ToString;

    use super::*;

    #[test]
    fn a_set_shows_the_names_of_its_codes() {
        let mut faults = FaultSet::EMPTY;
        assert_eq!(faults.to_string(), "none");
        faults.insert(Fault::SparImu);
        assert_eq!(faults.to_string(), "SparImu");
        faults.insert(Fault::ImuStale);
        assert_eq!(faults.to_string(), "ImuStale, SparImu");
    }

    /// Each code's remedy is a sentence of its own.
    #[test]
    fn each_code_has_a_remedy_of_its_own() {
        let faults: std::vec::Vec<_> = Fault::ALL.iter().map(|code| (code.name(), code.remedy())).collect();
        let blockers = Blocker::ALL.iter().map(|code| (code.name(), code.remedy())).collect();
        for codes in [faults, blockers] {
            for (name, remedy) in &codes {
                assert!(remedy.contains(' ') && remedy.ends_with('.'), "{name}");
                let same = codes.iter().filter(|(_, other)| other == remedy);
                assert_eq!(same.count(), 1, "{name}");
            }
        }
    }
}
