//! The part, tested over its bus.

use super::*;
use crate::noise::Noise;

const STILL: Motion = Motion {
    specific_force: [0.0, 0.0, GRAVITY_M_S2],
    rate: [0.0, -1.0, 0.5],
};
const H: f64 = 5e-4;
/// Counts per deg/s at the full scale that the firmware sets.
const GYRO_LSB_PER_DEG_S: f64 = 32768.0 / 1000.0;

fn chip() -> Icm42688pModel {
    Icm42688pModel::new(ImuErrors::NONE, Noise::new(1, 0))
}

fn read(chip: &mut Icm42688pModel, address: u8) -> u8 {
    let mut bytes = [address | reg::READ, 0x55];
    chip.transfer(&mut bytes);
    bytes[1]
}

fn write(chip: &mut Icm42688pModel, address: u8, value: u8) {
    chip.transfer(&mut [address, value]);
}

/// Level of INT1 as the drive board uses it (data ready, cleared by reading INT_STATUS).
fn data_ready(chip: &Icm42688pModel) -> bool {
    chip.banks.get(0, reg::INT_STATUS) & reg::INT_STATUS_DATA_READY != 0 && !chip.dead()
}

/// All data registers in one burst, as words.
fn burst(chip: &mut Icm42688pModel) -> [i16; 7] {
    let mut bytes = [0; 15];
    bytes[0] = reg::TEMP_DATA1 | reg::READ;
    chip.transfer(&mut bytes);
    core::array::from_fn(|i| i16::from_be_bytes([bytes[1 + 2 * i], bytes[2 + 2 * i]]))
}

fn run(chip: &mut Icm42688pModel, seconds: f64, motion: &Motion) {
    for _ in 0..(seconds / H).round() as usize {
        chip.advance(H, motion);
    }
}

/// A part that is configured as by the firmware and has started up.
fn running() -> Icm42688pModel {
    let mut c = chip();
    // +-1000 deg/s and +-8 g, both at 2 kHz, two registers in one burst; filters at an eighth of it.
    c.transfer(&mut [reg::GYRO_CONFIG0, 0x25, 0x25]);
    write(&mut c, reg::GYRO_ACCEL_CONFIG0, 0x33);
    write(&mut c, reg::PWR_MGMT0, 0x0f);
    run(&mut c, 0.05, &STILL);
    c
}

#[test]
fn it_says_who_it_is_and_comes_up_off() {
    let mut c = chip();
    assert_eq!(read(&mut c, reg::WHO_AM_I), 0x47);
    assert_eq!(read(&mut c, reg::GYRO_CONFIG0), 0x06);
    assert_eq!(read(&mut c, reg::INT_STATUS), reg::INT_STATUS_RESET_DONE);
    assert_eq!(read(&mut c, reg::INT_STATUS), 0, "reading does not clear the status");
    run(&mut c, 0.1, &STILL);
    assert!(!data_ready(&c));
    assert_eq!(burst(&mut c), [INVALID; 7]);
    write(&mut c, reg::WHO_AM_I, 0);
    assert_eq!(read(&mut c, reg::WHO_AM_I), 0x47, "read only");
}

#[test]
fn data_is_valid_only_after_the_start_up_times() {
    let mut c = chip();
    c.transfer(&mut [reg::GYRO_CONFIG0, 0x26, 0x26]);
    write(&mut c, reg::PWR_MGMT0, 0x0f);
    let (mut accel_ms, mut gyro_ms) = (None, None);
    for ms in 1..=60 {
        run(&mut c, 1e-3, &STILL);
        let words = burst(&mut c);
        if words[3] != INVALID {
            accel_ms.get_or_insert(ms);
        }
        if words[5] != INVALID {
            gyro_ms.get_or_insert(ms);
        }
    }
    assert_eq!((accel_ms, gyro_ms), (Some(10), Some(30)));
    write(&mut c, reg::PWR_MGMT0, 0x03);
    assert_eq!(burst(&mut c)[5], INVALID, "a gyro switched off has no data");
    assert_ne!(burst(&mut c)[3], INVALID);
}

#[test]
fn readings_have_the_units_of_the_ranges_that_the_firmware_sets() {
    // +-1000 deg/s and +-8 g over a word of 16 bits, as the data sheet says.
    const ACCEL_LSB_PER_G: f64 = 32768.0 / 8.0;
    let mut c = running();
    let [_, ax, ay, az, gx, gy, gz] = burst(&mut c);
    assert_eq!((ax, ay, gx), (0, 0, 0));
    assert_eq!(f64::from(az), ACCEL_LSB_PER_G);
    assert_eq!(f64::from(gy), (-1.0_f64.to_degrees() * GYRO_LSB_PER_DEG_S).round());
    assert_eq!(f64::from(gz), (0.5_f64.to_degrees() * GYRO_LSB_PER_DEG_S).round());
}

#[test]
fn full_scale_is_honoured_and_saturates() {
    let mut c = running();
    // +-125 deg/s, +-2 g.
    c.transfer(&mut [reg::GYRO_CONFIG0, 0x86, 0x66]);
    run(&mut c, 0.01, &STILL);
    let words = burst(&mut c);
    assert_eq!(words[3], 16384);
    assert_eq!(words[5], (-1.0_f64.to_degrees() * 32768.0 / 125.0).round() as i16);
    let hard = Motion {
        specific_force: [-50.0, 0.0, 50.0],
        rate: [10.0, -10.0, 0.0],
    };
    run(&mut c, 0.05, &hard);
    let words = burst(&mut c);
    assert_eq!((words[1], words[3], words[4], words[5]), (-32767, 32767, 32767, -32767));
}

#[test]
fn data_comes_at_the_rate_that_was_asked_for() {
    for (code, hertz) in [(0x05, 2000), (0x06, 1000), (0x0f, 500), (0x07, 200), (0x08, 100)] {
        let mut c = chip();
        c.transfer(&mut [reg::GYRO_CONFIG0, 0x20 | code, 0x20 | code]);
        write(&mut c, reg::PWR_MGMT0, 0x0f);
        let mut samples = 0;
        for _ in 0..2000 {
            c.advance(H, &STILL);
            if data_ready(&c) {
                samples += 1;
                read(&mut c, reg::INT_STATUS);
                assert!(!data_ready(&c));
            }
        }
        assert_eq!(samples, hertz, "in one second");
    }
}

#[test]
fn the_filter_follows_its_register() {
    let corner_hz = |c: &Icm42688pModel| c.sensor().filter().corner_hz();
    assert_eq!(corner_hz(&chip()), 250.0, "a quarter of 1 kHz, as reset");
    let mut c = running();
    assert_eq!(corner_hz(&c), 250.0, "an eighth of 2 kHz");
    write(&mut c, reg::GYRO_ACCEL_CONFIG0, 0x06);
    assert_eq!(corner_hz(&c), 100.0);
    write(&mut c, reg::GYRO_ACCEL_CONFIG0, 0x00);
    assert_eq!(corner_hz(&c), 1000.0);
}

#[test]
fn a_reset_takes_a_millisecond_and_forgets_everything() {
    let mut c = running();
    write(&mut c, reg::DEVICE_CONFIG, 1);
    assert_eq!(read(&mut c, reg::WHO_AM_I), 0, "busy");
    write(&mut c, reg::PWR_MGMT0, 0x0f);
    run(&mut c, 1e-3, &STILL);
    assert_eq!(read(&mut c, reg::WHO_AM_I), 0x47);
    assert_eq!(read(&mut c, reg::PWR_MGMT0), 0, "a busy part takes a write");
    assert_eq!(read(&mut c, reg::GYRO_CONFIG0), 0x06);
    assert_eq!(
        read(&mut c, reg::INT_STATUS) & reg::INT_STATUS_RESET_DONE,
        reg::INT_STATUS_RESET_DONE
    );
    run(&mut c, 0.05, &STILL);
    assert!(!data_ready(&c));
}

#[test]
fn other_banks_are_other_registers() {
    let mut c = running();
    write(&mut c, reg::REG_BANK_SEL, 1);
    assert_eq!(read(&mut c, reg::REG_BANK_SEL), 1);
    assert_eq!(read(&mut c, reg::WHO_AM_I), 0);
    write(&mut c, reg::PWR_MGMT0, 0xaa);
    assert_eq!(read(&mut c, reg::PWR_MGMT0), 0xaa);
    write(&mut c, reg::REG_BANK_SEL, 0);
    assert_eq!(read(&mut c, reg::PWR_MGMT0), 0x0f, "bank 0 kept its own");
    assert_eq!(read(&mut c, reg::WHO_AM_I), 0x47);
}

#[test]
fn a_burst_reads_one_sample_even_if_another_comes_meanwhile() {
    let mut c = running();
    let before = burst(&mut c);
    c.select();
    c.exchange(reg::TEMP_DATA1 | reg::READ);
    let mut bytes = Vec::new();
    let other = Motion {
        specific_force: [4.0, 4.0, 4.0],
        rate: [2.0; 3],
    };
    for _ in 0..14 {
        bytes.push(c.exchange(0));
        run(&mut c, 2e-3, &other);
    }
    c.deselect();
    let words: Vec<i16> = bytes.chunks(2).map(|b| i16::from_be_bytes([b[0], b[1]])).collect();
    assert_eq!(words, before);
    assert_ne!(burst(&mut c), before, "the next burst has the old sample");
    assert_eq!(c.exchange(0x80), 0xff, "a chip that is not selected answers");
}

#[test]
fn every_fault_shows_on_the_bus_as_it_must() {
    use SensorFault as F;
    let other = Motion {
        specific_force: [0.0, 0.0, 5.0],
        rate: [0.2; 3],
    };
    let good = {
        let mut c = running();
        run(&mut c, 0.03, &other);
        burst(&mut c)
    };
    let with = |fault: F, seconds: f64| {
        let mut c = running();
        c.set_fault(fault);
        run(&mut c, seconds, &other);
        let answer = (read(&mut c, reg::WHO_AM_I), data_ready(&c));
        (answer, burst(&mut c))
    };
    let old = burst(&mut running());
    assert_eq!(with(F::None, 0.03), ((0x47, true), good));
    assert_eq!(with(F::Off, 0.03), ((0xff, false), [-1; 7]));
    assert_eq!(with(F::Stuck, 0.03), ((0x47, true), old));
    assert_eq!(with(F::WrongSign, 0.03).1[3], -good[3]);
    assert_eq!(
        with(F::WrongSign, 0.03).1[0],
        good[0],
        "the fault changes the temperature's sign"
    );
    let (_, garbage) = with(F::Garbage, 0.03);
    let (_, later) = with(F::Garbage, 0.031);
    assert!(garbage != good && garbage != later);
    // With a delay of 50 ms the data are old after 40 ms and new after 60 ms.
    assert_eq!(with(F::Delayed, 0.040).1, old);
    assert_ne!(with(F::Delayed, 0.060).1, old);
    // The fault starts at 50 ms with phases of 20 ms: the part works until 60 ms, is dead until 80
    // ms and works again.
    assert_eq!(with(F::Intermittent, 0.005).0.0, 0x47);
    assert_eq!(with(F::Intermittent, 0.020).0.0, 0xff);
    assert_eq!(with(F::Intermittent, 0.035).0.0, 0x47);
    let mut slow = running();
    slow.set_fault(F::Slow);
    let mut samples = 0;
    read(&mut slow, reg::INT_STATUS);
    for _ in 0..160 {
        run(&mut slow, 1e-3, &other);
        if read(&mut slow, reg::INT_STATUS) & reg::INT_STATUS_DATA_READY != 0 {
            samples += 1;
        }
    }
    assert_eq!(samples, 10);
}

/// A part whose clock is fast or slow measures at its own instants, whatever the length of the steps: its reading is the ramp's value
/// at the end of the step, less the changes during the filter's delay and the sample's age.
#[test]
fn a_part_with_its_own_clock_measures_at_its_own_instants() {
    const RAMP_RAD_S2: f64 = 20.0;
    for (clock_error, h) in [(0.01, 1e-3), (-0.01, 1e-3), (0.01, 2.5e-4), (-0.05, 5e-4)] {
        let mut c = chip();
        c.mount(&ImuSettings {
            clock_error,
            ..ImuSettings::default()
        });
        c.transfer(&mut [reg::GYRO_CONFIG0, 0x25, 0x25]);
        write(&mut c, reg::GYRO_ACCEL_CONFIG0, 0x33);
        write(&mut c, reg::PWR_MGMT0, 0x0f);
        let period_s = 5e-4 / (1.0 + clock_error);
        let (mut oldest_s, mut steps) = (0.0_f64, 0);
        let mut at_s = 0.0;
        while at_s < 0.7 {
            let rate = RAMP_RAD_S2 * (at_s + 0.5 * h);
            c.advance(
                h,
                &Motion {
                    rate: [rate, 0.0, 0.0],
                    ..STILL
                },
            );
            at_s += h;
            if at_s < 0.1 {
                continue;
            }
            let age_s = c.sample_age_s();
            oldest_s = oldest_s.max(age_s);
            // Sqrt(2) over the corner's angular frequency.
            let w = core::f64::consts::TAU * c.sensor().filter().corner_hz();
            let delay_s = core::f64::consts::SQRT_2 / w;
            let expected = RAMP_RAD_S2 * (at_s - age_s - delay_s);
            let found = f64::from(burst(&mut c)[4]) / GYRO_LSB_PER_DEG_S;
            // Half a count, and the largest effect of using the step's mean in place of the ramp, whose difference the filter
            // (y'' = w^2 times the difference) integrates to w^2 h^3 / 12.
            let bound = 3e-4 + RAMP_RAD_S2 * (w * w * h * h * h / 12.0 + 1e-5);
            let error = found.to_radians() - expected;
            assert!(error.abs() < bound, "{clock_error}, {h}: {error} at {at_s}");
            steps += 1;
        }
        assert!(steps > 500);
        assert!(
            oldest_s > 0.9 * period_s && oldest_s < period_s + 1e-9,
            "{clock_error}, {h}: {oldest_s} s"
        );
    }
}
