//! The landing law's poles, against simulated vehicles.

use model::control::landing::LandingLaw;
use model::sample::TICK_S;
use model::vehicle::Vehicle;

use super::design_check::{are_stable, check};
use super::landing_poles::landing_poles;
use super::sampled::{Factors, SampledDrive, SampledPlant, SampledSensing, cast};

fn reference() -> Vehicle<f64> {
    vehicle_file::reference().expect("the reference vehicle")
}

fn small() -> Vehicle<f64> {
    let text = include_str!("../../../../vehicles/small.toml");
    match vehicle_file::parse("vehicles/small.toml", text) {
        Ok(vehicle_file::VehicleFile::Vehicle(vehicle)) => *vehicle,
        other => panic!("{other:?}"),
    }
}

/// Time after which the motors push the arm, in time units: by then the law's phase of fast learning is over.
const STRUCK: f64 = 20.0;

/// theta' in every tick after a light push of the motors, over `time` time units. The commanded speed is practically zero, but not
/// zero, so that the vehicle does not stand.
fn struck(vehicle: &Vehicle<f64>, plant: SampledPlant, time: f64) -> Vec<f64> {
    let drive = SampledDrive {
        vehicle,
        plant,
        sensing: SampledSensing {
            delay: 1,
            noise: [0.0; 3],
        },
        targets: &[(0.0, 1e-15)],
        duration: STRUCK + time,
    };
    let mut law = LandingLaw::new(&cast(vehicle), TICK_S);
    law.reset(0.0);
    let begins = (STRUCK * vehicle.scales().time_s / f64::from(TICK_S)) as u32;
    let mut tick = 0;
    let mut speeds = Vec::new();
    drive.run_under(
        |input| {
            tick += 1;
            let push_v = if (begins..begins + 10).contains(&tick) {
                1e-3
            } else {
                0.0
            };
            let output = law.step(input);
            (output.voltage_v + push_v, law.slope_lesson().unwrap_or_default())
        },
        || 0.0,
        |row| {
            if row.time > STRUCK {
                speeds.push(row.theta_rate);
            }
            true
        },
    );
    speeds
}

/// After the faster modes have decayed, the speed of a pushed vehicle follows the two slowest poles:
/// `y(t + 2 d) = (e^(p d) + e^(q d)) y(t + d) - e^((p + q) d) y(t)`.
#[test]
fn a_vehicle_that_is_struck_comes_to_rest_by_the_slowest_poles() {
    for vehicle in [reference(), small()] {
        let plant = SampledPlant::new(&vehicle, &Factors::NONE, 0.0);
        let poles = landing_poles(&vehicle, &plant).expect("numbers");
        let speeds = struck(&vehicle, plant, 12.0);
        let time_s = vehicle.scales().time_s;
        let at = |time: f64| speeds[(time * time_s / f64::from(TICK_S)) as usize];
        let d_s = f64::from((time_s / f64::from(TICK_S)) as f32 as i32 as f32 * TICK_S);
        let (p, q) = (poles[0], poles[1]);
        let sum = [p, q]
            .iter()
            .map(|[re, im]| (re * d_s).exp() * (im * d_s).cos())
            .sum::<f64>();
        let product = ((p[0] + q[0]) * d_s).exp();
        let whole = d_s / time_s;
        for from in [4.0, 5.0] {
            let (now, next, then) = (at(from), at(from + whole), at(from + 2.0 * whole));
            let foretold = sum * next - product * now;
            let size = sum.abs() * next.abs() + product * now.abs();
            assert!((then - foretold).abs() < 0.01 * size, "{from}: {then:e} {foretold:e}");
            // With poles that are a third larger the same prediction is far off.
            let off = sum.powf(1.33) * next - product.powf(1.33) * now;
            assert!((then - off).abs() > 0.02 * size, "{from}: {then:e} {off:e}");
        }
    }
}

/// The poles of a plant that differs from its file tell whether the vehicle keeps ringing or comes to rest.
#[test]
fn poles_tell_the_plants_that_come_to_rest_from_those_that_ring_on() {
    type Change = fn(&mut Factors) -> &mut f64;
    let changes: [(Change, [bool; 4]); 3] = [
        (|f| &mut f.arm_length, [true, true, false, false]),
        (|f| &mut f.arm_mass, [true, true, true, false]),
        (|f| &mut f.motor_constant, [true; 4]),
    ];
    let vehicle = reference();
    for (change, expected) in changes {
        for (factor, comes_to_rest) in [0.3, 1.0, 1.5, 3.0].into_iter().zip(expected) {
            let mut factors = Factors::NONE;
            *change(&mut factors) = factor;
            let plant = SampledPlant::new(&vehicle, &factors, 0.0);
            let poles = landing_poles(&vehicle, &plant).expect("numbers");
            assert_eq!(are_stable(&poles), comes_to_rest, "{factors:?}: {poles:?}");
            let speeds = struck(&vehicle, plant, 40.0);
            let most = |of: &[f64]| of.iter().fold(0.0_f64, |most, speed| most.max(speed.abs()));
            let quarter = speeds.len() / 4;
            let (first, last) = (most(&speeds[..quarter]), most(&speeds[3 * quarter..]));
            assert_eq!(last < 0.1 * first, comes_to_rest, "{factors:?}: {first:e} {last:e}");
        }
    }
}

/// The five slowest poles are near those for which the law was designed, apart from the effect of filter, tick and delay.
#[test]
fn the_slowest_poles_are_near_those_of_the_design() {
    for vehicle in [reference(), small()] {
        let checked = check(&vehicle);
        let found = checked.poles_landing_per_s.clone().expect("numbers");
        let designed = &checked.poles_landing_designed_per_s;
        // Speed, servo and slope make five poles; filter, tick and delay change their geometric mean by less than a half.
        let product = |sizes: &mut dyn Iterator<Item = f64>| sizes.take(5).map(f64::ln).sum::<f64>() / 5.0;
        let [found, designed] = [
            product(&mut found.iter().map(|[re, im]| re.hypot(*im))),
            product(&mut designed.iter().map(|re| re.abs())),
        ]
        .map(f64::exp);
        assert!((found / designed - 1.0).abs() < 0.5, "{found} {designed}");
    }
}
