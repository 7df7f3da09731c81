//! ADC1: the part's model, started by the bridges' timer, with currents at its pins that ripple with the PWM.
//!
//! The part's model starts a sequence at software's word alone. Here the trigger is kept from it (EXTEN and EXTSEL of CFGR,
//! and ADSTART while the converter waits), and each rising edge of TIM1's second trigger output starts the model's sequence
//! as software would. No other trigger is connected: a firmware that chooses one waits for ever.
//!
//! A current's ripple follows from the bridge's lines in closed form, if the resistance's part of a period is left out: under
//! the supply the current rises, under the brake it falls, in straight lines that cross the mean in the middle of each. The
//! sensor's voltage is that of the mean, which the board gives, and of the ripple at the end of the sample.

use rigless::device::{Device, DeviceContext, RegisterFile, RequestChange};
use rigless::soc::stm32h743::generated::adc3::{Register, cfgr, cr};
use rigless::soc::stm32h743::peripherals::adc::{Adc, Channel, Converter};
use rigless::time::{EventId, VirtualNanos};
use serde::{Deserialize, Serialize};

use super::waveform::PwmWaveform;

/// Channels of the converter.
const CHANNELS: usize = 20;
/// Timers that switch bridges.
pub const TIMERS: usize = 2;
/// EXTSEL of TIM1's second trigger output, and EXTEN of its rising edge (RM0433 25.4.19).
const TIM1_TRGO2: u64 = 10;
const RISING: u64 = 1;
/// Half cycles from the trigger to the begin of the sequence (DS12110: 1.5 to 2.5 cycles).
const LATENCY_HALF_CYCLES: u64 = 4;
/// Bits of a conversion, by the code of RES.
const BITS: [u64; 8] = [16, 14, 12, 10, 16, 14, 12, 8];

/// A current's sensor: between which lines the motor lies, and how steeply its voltage rises.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct RippleSource {
    /// The timer of the lines: TIM1 for 0, TIM8 for 1.
    pub timer: usize,
    /// Channels of the two inputs of the bridge, from 0: the first one drives forward.
    pub lines: [usize; 2],
    /// Slope of the sensor's voltage while the whole supply stands across the motor, in uV per us.
    pub slope_uv_per_us: u32,
}

impl RippleSource {
    /// What the ripple adds to the sensor's voltage at an instant in ns, in uV.
    fn at(self, waveforms: &[PwmWaveform; TIMERS], at: u64) -> i64 {
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
        // The time since the middle of the brake: the lines are high around the zero of a counter that counts up and down, and
        // from the begin of the period on otherwise.
        let middle = if waveform.shape().up_and_down { 0 } else { brake / 2 };
        let since = (phase - middle + period / 2).rem_euclid(period) - period / 2;
        // In uV per us, times ns: as many thousandths of uV. Of the supply the brake leaves the mean's share, the drive the rest.
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
    /// Software has started the converter, which waits for triggers.
    waits: bool,
    /// The model converts.
    converting: bool,
    /// Software's word to stop does nothing.
    jammed: bool,
    /// When the sequence begins that the next trigger starts.
    begins: Option<EventId>,
    /// Voltages of the pins, but for the ripple, in mV.
    millivolts: [u32; CHANNELS],
    ripples: [Option<RippleSource>; CHANNELS],
    /// What the bridges' timers do, as of the last access.
    waveforms: [PwmWaveform; TIMERS],
}

rigless::store!(TriggeredConverter {
    values: [
        model, clock_hz, trigger, waits, converting, jammed, begins, millivolts, ripples, waveforms
    ],
    parts: [],
    built: []
});

impl TriggeredConverter {
    /// The converter out of reset, with nothing on its pins.
    pub fn new() -> Self {
        Self {
            model: Adc::new(Converter::Adc1, 0),
            clock_hz: 0,
            trigger: 0,
            waits: false,
            converting: false,
            jammed: false,
            begins: None,
            millivolts: [0; CHANNELS],
            ripples: [None; CHANNELS],
            waveforms: [PwmWaveform::default(); TIMERS],
        }
    }

    /// The reference voltage in mV.
    pub fn set_reference(&mut self, millivolts: u32) {
        self.model.set_reference(millivolts);
    }

    /// The voltage of a channel's pin but for the ripple, in mV, and what makes the ripple.
    pub fn set_input(&mut self, channel: u8, millivolts: u32, ripple: Option<RippleSource>) {
        self.millivolts[usize::from(channel)] = millivolts;
        self.ripples[usize::from(channel)] = ripple;
    }

    /// Whether the converter goes on whatever software says, until it is told to stop once more after that.
    pub fn jam(&mut self, jammed: bool) {
        self.jammed = jammed;
    }

    /// What the bridges' timers do, before each access.
    pub fn follow(&mut self, waveforms: &[PwmWaveform; TIMERS]) {
        self.waveforms = *waveforms;
    }

    /// Whether a trigger starts the sequence, instead of software.
    fn is_triggered(&self) -> bool {
        cfgr::EXTEN.get(self.trigger) != 0
    }

    fn ns(&self, half_cycles: u64) -> u64 {
        half_cycles * 1_000_000_000 / (2 * self.clock_hz.max(1))
    }

    /// Waits for the next trigger, if the timer sends any.
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

    /// Puts on the pins what a conversion that ends now has sampled.
    fn present(&mut self, file: &RegisterFile, now: u64) {
        let bits = BITS[cfgr::RES.get(file.get(Register::Cfgr)) as usize];
        // Half cycles of a conversion after its sample (RM0433 Table 214).
        let sampled = now.saturating_sub(self.ns(bits + 1));
        for channel in 0..CHANNELS {
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

    /// CR as written: the model hears of a start when a trigger comes.
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
