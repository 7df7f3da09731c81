//! Tasks that hang. The control executor interrupts the tasks of the thread executor and stops the vehicle without them.

use firmware::drive_board::WATCHDOG_US;
use model::supervise::arming::Mode;
use model::supervise::codes::Fault;
use virtual_board::board::VirtualBoard;

mod support;
use support::Bench;

/// Lets a task hang.
type Hang = fn(&mut VirtualBoard);

/// Period of the watchdog's task, ms.
const LOOK_MS: u64 = 5;

#[test]
fn a_hung_thread_executor_ends_in_a_controlled_stop_and_a_reset() {
    // The hang begins at several places in the command's period of 20 ms and the link's of 10 ms.
    for wait_ms in [0, 7, 13] {
        let mut bench = Bench::driving(21, 1.0);
        bench.run(wait_ms);
        bench.board.hang_thread_executor();
        let (mut ms, mut stopping, mut bitten) = (0, None, None);
        bench.run_watching(1500, |bench| {
            ms += 1;
            if bench.mode() == Mode::Stopping {
                stopping.get_or_insert(ms);
            }
            if bench.board.watchdog_bitten() {
                bitten.get_or_insert(ms);
                assert!(!bench.bridges_on());
            }
        });
        // The last command was up to 20 ms old, and is valid for 250 ms.
        assert!(
            stopping.is_some_and(|ms| (228..=252).contains(&ms)),
            "stops after {stopping:?} ms"
        );
        let faults = bench.board.status().expect("the board runs").faults;
        assert!(faults.contains(Fault::CommandTimeout), "{faults}");
        assert!(!faults.contains(Fault::AnalogStale), "{faults}");
        // The link's task checks in every 10 ms and may be silent for 1000 ms; after that nothing feeds the watchdog.
        let reset_ms = u64::from(WATCHDOG_US) / 1000;
        let expected = 1000 - 10 + reset_ms..=1000 + LOOK_MS + reset_ms + 1;
        assert!(
            bitten.is_some_and(|ms| expected.contains(&ms)),
            "reset after {bitten:?} ms, expected {expected:?}"
        );
    }
}

/// The control executor's tasks other than the control task: each may be silent for 100 ms; after that nothing feeds the
/// watchdog.
#[test]
fn a_hung_task_of_the_inputs_ends_in_open_bridges_and_a_reset() {
    let hangs: [(&str, Hang); 2] = [
        ("arm IMU", VirtualBoard::hang_arm_imu_task),
        ("analogue inputs", VirtualBoard::hang_analog_task),
    ];
    for (name, hang) in hangs {
        // The hang begins at several places in the watchdog task's period.
        for wait_ms in [0, 2, 4] {
            let mut bench = Bench::driving(22, 1.0);
            bench.run(wait_ms);
            hang(&mut bench.board);
            let (mut ms, mut bitten) = (0, None);
            bench.run_watching(200, |bench| {
                ms += 1;
                if bench.board.watchdog_bitten() {
                    bitten.get_or_insert(ms);
                    assert!(!bench.bridges_on());
                }
            });
            let reset_ms = u64::from(WATCHDOG_US) / 1000;
            // The last check-in is up to a tick old.
            let expected = 100 - 1 + reset_ms - LOOK_MS..=100 + LOOK_MS + reset_ms + 1;
            assert!(
                bitten.is_some_and(|ms| expected.contains(&ms)),
                "{name}: reset after {bitten:?} ms, expected {expected:?}"
            );
        }
    }
}
