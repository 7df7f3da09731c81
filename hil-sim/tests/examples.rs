//! The examples do what they say.

// Their `main` functions only print.
#[allow(dead_code)]
#[path = "../examples/fly_a_scenario.rs"]
mod fly_a_scenario;
#[allow(dead_code)]
#[path = "../examples/own_law.rs"]
mod own_law;
#[allow(dead_code)]
#[path = "../examples/replay_a_record.rs"]
mod replay_a_record;

#[test]
fn the_scenario_from_code_is_flown() {
    let metrics = fly_a_scenario::fly().unwrap();
    let value = |name: &str| metrics.iter().find(|metric| metric.name == name).unwrap().value;
    // 3.5 s at 0.5 m/s, less the start's swing and plus the way to a stand.
    assert!((1.4..2.0).contains(&value("final_x_m")), "{}", value("final_x_m"));
    assert!(value("hold_drift_m") < 0.02, "{}", value("hold_drift_m"));
    assert_eq!(value("faults"), 0.0);
}

#[test]
fn the_law_settles_and_no_law_does_not() {
    let speeds = own_law::fly(&mut own_law::law(), 0.5).unwrap();
    let settled = own_law::settling_s(&speeds, 0.5).unwrap();
    assert!((0.5..3.0).contains(&settled), "{settled}");
    let speeds = own_law::fly(&mut |_: f64, _: &plant::Truth| 0.0, 0.5).unwrap();
    assert_eq!(own_law::settling_s(&speeds, 0.5), None);
}

#[test]
fn the_record_replays_and_a_changed_record_does_not() {
    let vehicle = vehicle_file::reference().unwrap();
    let mut records = replay_a_record::record(&vehicle).unwrap();
    assert!(records.len() > 1000, "{}", records.len());
    assert!(replay_a_record::first_difference(&vehicle, &records).unwrap().is_none());
    let last = records.len() - 1;
    records[last].actuation.duty[0] += 1;
    let found = replay_a_record::first_difference(&vehicle, &records).unwrap();
    assert_eq!(found.map(|record| record.tick), Some(records[last].tick));
}
