//! Recorded ticks as a table: what was sensed, commanded and done, in SI units, a row for each tick.

use std::io::{self, Write};

use firmware::drive_board::SCALES;
use firmware::flight_record::FlightRecord;
use model::analog::Analog;
use model::sample::ImuSample;
use model::vehicle::GRAVITY_M_S2;
use record_file::ReadBoot;

/// A column: its name, and what stands in it.
type Column = (String, Box<dyn Fn(&FlightRecord) -> f64>);

/// One of a record's IMUs.
type ImuOf = fn(&FlightRecord) -> &ImuSample;

/// Writes the ticks of every boot as CSV.
///
/// # Errors
/// Those of `out`.
pub(super) fn write_ticks(out: &mut impl Write, boots: &[ReadBoot]) -> io::Result<()> {
    let columns = columns();
    write!(out, "boot,tick,time_s,request")?;
    columns.iter().try_for_each(|(name, _)| write!(out, ",{name}"))?;
    writeln!(out)?;
    for (number, boot) in boots.iter().enumerate() {
        for record in &boot.records {
            let FlightRecord {
                tick, sample, command, ..
            } = record;
            let time_s = sample.time_us as f64 * 1e-6;
            write!(out, "{},{tick},{time_s},{}", number + 1, command.request.name())?;
            { columns.iter() }.try_for_each(|(_, value)| write!(out, ",{}", value(record)))?;
            writeln!(out)?;
        }
    }
    Ok(())
}

fn columns() -> Vec<Column> {
    fn column(name: impl Into<String>, value: impl Fn(&FlightRecord) -> f64 + 'static) -> Column {
        (name.into(), Box::new(value))
    }
    let flag = f64::from;
    let mut columns = vec![
        column("commanded_speed_m_s", |r| f64::from(r.command.drive.speed_m_s)),
        column("commanded_yaw_rate_rad_s", |r| {
            f64::from(r.command.drive.yaw_rate_rad_s)
        }),
        column("command_age_us", |r| f64::from(r.command.age_us)),
        column("parameters_pending", move |r| flag(r.command.parameters_pending)),
        column("enable", move |r| flag(r.actuation.enable)),
        column("emergency_stop", move |r| flag(r.sample.emergency_stop)),
        column("break_input", move |r| flag(r.sample.break_input)),
        column("bridge_break", move |r| flag(r.sample.bridge_break)),
        column("board_blockers", |r| f64::from(r.sample.board_blockers)),
        column("encoder_age_us", |r| f64::from(r.sample.encoder_age_us)),
        column("analog_age_us", |r| f64::from(r.sample.analog_age_us)),
    ];
    for (motor, name) in ["left", "right", "ballast"].into_iter().enumerate() {
        columns.push(column(format!("{name}_duty"), move |r| {
            f64::from(r.actuation.duty[motor]) / f64::from(i16::MAX)
        }));
        columns.push(column(format!("{name}_encoder_counts"), move |r| {
            r.sample.encoder_counts[motor] as f64
        }));
    }
    for (input, name) in Analog::<u16>::NAMES.into_iter().enumerate() {
        let unit = if name.ends_with("_voltage") { "v" } else { "a" };
        columns.push(column(format!("{name}_{unit}"), move |r| {
            f64::from(SCALES.analog.values()[input].value(r.sample.analog.values()[input]))
        }));
    }
    let imus: [(&str, ImuOf); 2] = [("arm", |r| &r.sample.arm_imu), ("spar", |r| &r.sample.spar_imu)];
    for (name, imu) in imus {
        for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
            columns.push(column(format!("{name}_force_{letter}_m_s2"), move |r| {
                f64::from(imu(r).raw.accel[axis]) / f64::from(SCALES.imu.accel_lsb_per_g) * GRAVITY_M_S2
            }));
            columns.push(column(format!("{name}_rate_{letter}_rad_s"), move |r| {
                (f64::from(imu(r).raw.gyro[axis]) / f64::from(SCALES.imu.gyro_lsb_per_deg_s)).to_radians()
            }));
        }
        columns.push(column(format!("{name}_temperature_counts"), move |r| {
            f64::from(imu(r).raw.temperature)
        }));
        columns.push(column(format!("{name}_imu_age_us"), move |r| f64::from(imu(r).age_us)));
    }
    columns
}
