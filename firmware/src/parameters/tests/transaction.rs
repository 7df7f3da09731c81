//! Staged changes: all or nothing.

use super::super::stage::Stage;
use super::built_in;
use crate::built_in::PARAMETERS;
use crate::protocol::message::ParameterAnswer;

fn number(table: &str, field: &str) -> u16 {
    PARAMETERS.number_of(table, field).expect("known")
}

fn told(answer: ParameterAnswer) -> f32 {
    match answer {
        ParameterAnswer::Value { value, .. } => value,
        other => panic!("{other:?}"),
    }
}

#[test]
fn changes_are_staged_together_and_taken_together() {
    let (ki, kd) = (number("control", "ki"), number("control", "kd"));
    let mut stage = Stage::new(&built_in());
    assert!(!stage.has_changes());
    assert_eq!(told(stage.write(ki, 0.05)), 0.05);
    assert_eq!(told(stage.write(kd, 3.0)), 3.0);
    assert!(stage.has_changes());
    assert_eq!(
        told(stage.read(ki)),
        PARAMETERS.control.ki,
        "the staged value is in force already"
    );
    assert_eq!(told(stage.read_staged(ki)), 0.05);
    let taken = stage.take().expect("consistent");
    assert_eq!(
        (taken.parameters().control.ki, taken.parameters().control.kd),
        (0.05, 3.0)
    );
    assert!(!stage.has_changes(), "the transaction goes on");
    stage.put_in_force(&taken);
    assert_eq!(told(stage.read(ki)), 0.05);
}

#[test]
fn whatever_is_refused_takes_every_staged_change_with_it() {
    let (ki, arm) = (number("control", "ki"), number("body", "arm_mass_kg"));
    let speed = number("control", "speed_max_m_s");
    let refusals: [fn(&mut Stage, u16) -> bool; 3] = [
        |stage, arm| {
            stage.write(arm, 100.0);
            stage.take() == Err(arm)
        },
        |stage, arm| matches!(stage.write(arm, f32::NAN), ParameterAnswer::OutOfRange { .. }),
        |stage, _| stage.write(PARAMETERS.count(), 1.0) == ParameterAnswer::NoSuchNumber,
    ];
    for refused in refusals {
        let mut stage = Stage::new(&built_in());
        stage.write(speed, 9.0);
        assert!(refused(&mut stage, arm));
        assert_eq!(told(stage.read_staged(speed)), PARAMETERS.control.speed_max_m_s);
        stage.write(ki, 0.05);
        let taken = stage.take().expect("consistent");
        let mut expected = PARAMETERS;
        expected.control.ki = 0.05;
        assert_eq!(*taken.parameters(), expected, "a refused change is in the set");
    }
}
