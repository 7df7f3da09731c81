//! ADC1: the part's model, started by the bridges' timer, with currents at its pins that ripple with the PWM.
//!
//! The part's model starts a sequence only when software asks for one. This wrapper hides the trigger from
//! the model (EXTEN and EXTSEL of CFGR, and ADSTART while the converter waits). Each rising edge of TIM1's
//! second trigger output starts the model's sequence as software would. No other trigger is connected: a
//! firmware that chooses another trigger waits for ever.
//!
//! A current's ripple follows from the bridge's lines in closed form if the effect of the resistance within a
//! period is neglected. Under the supply the current rises, under the brake it falls, in straight lines that
//! cross the mean in the middle of each. The sensor's voltage is the sum of the mean, which the board gives,
//! and of the ripple at the end of the sample.

use rigless::device::{Device, DeviceContext, RegisterFile, RequestChange};
use rigless::soc::stm32h743::generated::adc3::{Register, cfgr, cr};
use rigless::soc::stm32h743::peripherals::adc::{Adc, Channel, Converter};
use rigless::time::{EventId, VirtualNanos};
use serde::{Deserialize, Serialize};

use super::waveform::PwmWaveform;

/// Channels of the converter.
const CONVERTER_CHANNELS: usize = 20;
/// Timers that switch bridges.
pub const FOLLOWED_TIMERS: usize = 2;
/// EXTSEL of TIM1's second trigger output, and EXTEN of its rising edge (RM0433 25.4.19).
const TIM1_TRGO2: u64 = 10;
const RISING: u64 = 1;
/// Half cycles from the trigger to the start of the sequence (DS12110: 1.5 to 2.5 cycles).
const LATENCY_HALF_CYCLES: u64 = 4;
/// Bits of a conversion, by the code of RES.
const BITS: [u64; 8] = [16, 14, 12, 10, 16, 14, 12, 8];

/// A current sensor: the lines between which the motor is connected, and the slope of the sensor's voltage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct RippleSource {
    /// The timer of the lines: TIM1 for 0, TIM8 for 1.
    pub timer: usize,
    /// Channels of the two inputs of the bridge, from 0. The first input drives forward.
    pub lines: [usize; 2],
    /// Slope of the sensor's voltage with the whole supply across the motor, in uV per us.
    pub slope_uv_per_us: u32,
}

impl RippleSource {
    /// Contribution of the ripple to the sensor's voltage at an instant in ns, in uV.
    fn at(self, waveforms: &[PwmWaveform; FOLLOWED_TIMERS], at: u64) -> i64 {
        let mut waveform = waveforms[self.timer];
        waveform.catch_up(at);
        let [in1, in2] = self.lines.map(|line| waveform.high_ns(line).map(i128::from));
        let (Some(in1), Some(in2), Some(period), Some(phase)) = (in1, in2, waveform.period_ns(), waveform.phase_ns(at))
        else {
            return 0;
        };
        if !waveform.shape().enabled {
            return 0;
        }
        let (period, phase) = (i128::from(period), i128::from(phase));
        let (driven, brake) = (in1 - in2, in1.min(in2));
        // The time since the middle of the brake. The lines are high around the zero of a counter that counts
        // up and down, and otherwise from the start of the period.
        let middle = if waveform.shape().up_and_down { 0 } else { brake / 2 };
        let since = (phase - middle + period / 2).rem_euclid(period) - period / 2;
        // uV per us times ns gives thousandths of uV. The mean's share of the supply acts during the brake,
        // the rest during the drive.
        let uv = |share: i128, ns: i128| share * ns * i128::from(self.slope_uv_per_us) / period / 1_000;
        let ripple = if 2 * since.abs() <= brake {
            uv(-driven, since)
        } else {
            let since_drive = since - since.signum() * period / 2;
            uv(driven.signum() * period - driven, since_drive)
        };
        ripple as i64
    }
}

/// ADC1 behind its trigger.
#[derive(Debug)]
pub struct TriggeredConverter {
    model: Adc,
    clock_hz: u64,
    /// The trigger's bits of CFGR.
    trigger: u64,
    /// Whether software has started the converter, which now waits for triggers.
    waits: bool,
    /// Whether the model is converting.
    converting: bool,
    /// Software's word to stop does nothing.
    jammed: bool,
    /// When the sequence begins that the next trigger starts.
    begins: Option<EventId>,
    /// Voltages of the pins without the ripple, in mV.
    millivolts: [u32; CONVERTER_CHANNELS],
    ripples: [Option<RippleSource>; CONVERTER_CHANNELS],
    /// Waveforms of the bridge timers at the last access.
    waveforms: [PwmWaveform; FOLLOWED_TIMERS],
}

rigless::store!(TriggeredConverter {
    values: [
        model, clock_hz, trigger, waits, converting, jammed, begins, millivolts, ripples, waveforms
    ],
    parts: [],
    built: []
});

impl TriggeredConverter {
    /// The converter in the reset state, with nothing on its pins.
    pub fn new() -> Self {
        Self {
            model: Adc::new(Converter::Adc1, 0),
            clock_hz: 0,
            trigger: 0,
            waits: false,
            converting: false,
            jammed: false,
            begins: None,
            millivolts: [0; CONVERTER_CHANNELS],
            ripples: [None; CONVERTER_CHANNELS],
            waveforms: [PwmWaveform::default(); FOLLOWED_TIMERS],
        }
    }

    /// Sets the reference voltage in mV.
    pub fn set_reference(&mut self, millivolts: u32) {
        self.model.set_reference(millivolts);
    }

    /// Sets the voltage of a channel's pin without the ripple, in mV, and the source of the ripple.
    pub fn set_input(&mut self, channel: u8, millivolts: u32, ripple: Option<RippleSource>) {
        self.millivolts[usize::from(channel)] = millivolts;
        self.ripples[usize::from(channel)] = ripple;
    }

    /// Whether the converter ignores software's stop; it obeys the first stop after this is switched off.
    pub fn jam(&mut self, jammed: bool) {
        self.jammed = jammed;
    }

    /// What the bridges' timers do, before each access.
    pub fn follow(&mut self, waveforms: &[PwmWaveform; FOLLOWED_TIMERS]) {
        self.waveforms = *waveforms;
    }

    /// Whether a trigger, and not software, starts the sequence.
    fn is_triggered(&self) -> bool {
        cfgr::EXTEN.get(self.trigger) != 0
    }

    fn ns(&self, half_cycles: u64) -> u64 {
        half_cycles * 1_000_000_000 / (2 * self.clock_hz.max(1))
    }

    /// Waits for the next trigger, if the timer sends triggers.
    fn await_trigger(&mut self, context: &mut DeviceContext<'_>) {
        self.begins = None;
        let connected = cfgr::EXTSEL.get(self.trigger) == TIM1_TRGO2 && cfgr::EXTEN.get(self.trigger) == RISING;
        let latency = self.ns(LATENCY_HALF_CYCLES);
        let after = context.now().0.saturating_sub(latency);
        if self.waits
            && connected
            && let Some(at) = self.waveforms[0].trigger_after(after)
        {
            self.begins = Some(context.schedule(VirtualNanos(at + latency)));
        }
    }

    /// Puts on the pins the voltages that a conversion which ends now has sampled.
    fn present(&mut self, file: &RegisterFile, now: u64) {
        let bits = BITS[cfgr::RES.get(file.get(Register::Cfgr)) as usize];
        // A conversion takes this many half cycles after its sample (RM0433 Table 214).
        let sampled = now.saturating_sub(self.ns(bits + 1));
        for channel in 0..CONVERTER_CHANNELS {
            let ripple_uv = self.ripples[channel].map_or(0, |ripple| ripple.at(&self.waveforms, sampled));
            let microvolts = i64::from(self.millivolts[channel]) * 1_000 + ripple_uv;
            let millivolts = (microvolts + 500).div_euclid(1_000).max(0) as u32;
            let channel = Channel::new(channel as u8).expect("a converter has twenty channels");
            self.model.set_input(channel, millivolts);
        }
    }

    /// Notes whether the model converts, after a call.
    fn note(&mut self, file: &RegisterFile) {
        self.converting = cr::ADSTART.is_set(file.get(Register::Cr));
    }

    /// Writes CR. The model sees a start only when a trigger comes.
    fn write_control(&mut self, value: u64, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let mut passed = value;
        if cr::ADSTP.is_set(value) && self.jammed {
            passed = cr::ADSTP.set(cr::ADSTART.set(passed, u64::from(self.converting)), 0);
        } else if cr::ADSTP.is_set(value) {
            self.waits = false;
            self.begins = None;
            if !self.converting {
                passed = cr::ADSTP.set(cr::ADSTART.set(passed, 0), 0);
            }
        } else if cr::ADSTART.is_set(value) && self.is_triggered() {
            if !self.waits {
                self.waits = true;
                self.await_trigger(context);
            }
            if !self.converting {
                passed = cr::ADSTART.set(passed, 0);
            }
        }
        file.set(Register::Cr, passed);
        self.model.write(Register::Cr, passed, file, context);
    }
}

impl Device for TriggeredConverter {
    type Register = Register;

    fn read(&mut self, register: Register, file: &mut RegisterFile, context: &mut DeviceContext<'_>) -> Option<u64> {
        let value = self.model.read(register, file, context);
        match register {
            Register::Cfgr => Some(file.get(register) | self.trigger),
            Register::Cr if self.waits => Some(cr::ADSTART.set(file.get(register), 1)),
            _ => value,
        }
    }

    fn peek(&self, register: Register, file: &RegisterFile, now: VirtualNanos) -> Option<u64> {
        match register {
            Register::Cfgr => Some(file.get(register) | self.trigger),
            Register::Cr if self.waits => Some(cr::ADSTART.set(file.get(register), 1)),
            _ => self.model.peek(register, file, now),
        }
    }

    fn write(&mut self, register: Register, value: u64, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        match register {
            Register::Cr => self.write_control(value, file, context),
            Register::Cfgr => {
                self.trigger = value & (cfgr::EXTEN.mask() | cfgr::EXTSEL.mask());
                let passed = value & !self.trigger;
                file.set(register, passed);
                self.model.write(register, passed, file, context);
            }
            _ => self.model.write(register, value, file, context),
        }
        self.note(file);
    }

    fn on_event(&mut self, event: EventId, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if self.begins == Some(event) {
            // A trigger that comes while a sequence is under way is ignored.
            if !self.converting {
                let started = cr::ADSTART.set(file.get(Register::Cr), 1);
                file.set(Register::Cr, started);
                self.model.write(Register::Cr, started, file, context);
            }
            self.await_trigger(context);
        } else {
            self.present(file, context.now().0);
            self.model.on_event(event, file, context);
        }
        self.note(file);
    }

    fn on_request(&mut self, change: RequestChange, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.model.on_request(change, file, context);
    }

    fn on_clock(&mut self, hz: u64, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.clock_hz = hz;
        self.model.on_clock(hz, file, context);
    }

    fn reset(&mut self) {
        self.model.reset();
        self.trigger = 0;
        self.waits = false;
        self.converting = false;
        self.begins = None;
    }

    fn reset_line(&mut self, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.model.reset_line(file, context);
        self.trigger = 0;
        self.waits = false;
        self.converting = false;
        self.begins = None;
    }
}

#[cfg(test)]
mod tests;
