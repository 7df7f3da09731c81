//! Campaigns: the numbering of runs, shards, overrides.

use super::*;

const KERB: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/scenarios/kerb.toml");
const DEAD_MAN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/scenarios/dead-man.toml");

fn axes(texts: &[&str]) -> Vec<Axis> {
    texts.iter().map(|text| Axis::parse(text).expect("good")).collect()
}

fn campaign(sets: &[&str], seeds: RangeInclusive<u64>) -> Result<Campaign, CampaignError> {
    Campaign::new(&[KERB.into(), DEAD_MAN.into()], None, None, axes(sets), seeds)
}

#[test]
fn every_combination_has_one_number_and_seeds_are_innermost() {
    let campaign = campaign(
        &[
            "scenario.plant.arm_imu.misalignment_x_deg=0,1",
            "vehicle.body.arm_mass_kg=11,12,13",
        ],
        5..=8,
    )
    .expect("good");
    assert_eq!(campaign.runs(), 2 * 2 * 3 * 4);
    let mut seen = Vec::new();
    for run in 0..campaign.runs() {
        let (source, set, seed) = campaign.parts(run);
        let values: Vec<String> = set.iter().map(|(_, value)| value.to_string()).collect();
        seen.push((source.name.clone(), values, seed));
    }
    assert_eq!(seen[0].2, 5);
    assert_eq!(seen[3].2, 8);
    assert_eq!(seen[4].1, ["0", "12"]);
    let mut unique = seen.clone();
    unique.sort();
    unique.dedup();
    assert_eq!(unique.len(), seen.len());
}

#[test]
fn shards_follow_each_other_without_gap_and_overlap() {
    let campaign = campaign(&[], 1..=50).expect("good");
    for count in [1, 2, 3, 7, 99, 100, 101, 1000] {
        let mut next = 0;
        for index in 1..=count {
            let range = part(campaign.runs(), index, count);
            assert_eq!(range.start, next);
            next = range.end;
        }
        assert_eq!(next, campaign.runs());
    }
}

#[test]
fn an_override_reaches_the_vehicle_the_plant_and_lists() {
    let campaign = campaign(
        &[
            "scenario.terrain.profile.0.height_m=0.005",
            "vehicle.body.arm_mass_kg=11",
            "plant-vehicle.body.arm_mass_kg=13",
        ],
        1..=1,
    );
    // Only the kerb scenario has a profile.
    let error = campaign
        .expect_err("the dead man's scenario has no profile")
        .to_string();
    assert!(error.contains("no list `profile`"), "{error}");
    let campaign = Campaign::new(
        &[KERB.into()],
        None,
        None,
        axes(&["vehicle.body.arm_mass_kg=11", "plant-vehicle.body.arm_mass_kg=13"]),
        1..=1,
    )
    .expect("good");
    let (_, told, simulated) = campaign.prepare(0).expect("good");
    assert_eq!(told.parameters().body.arm_mass_kg, 11.0);
    assert_eq!(simulated.parameters().body.arm_mass_kg, 13.0);
}

#[test]
fn what_makes_no_sense_is_refused_before_the_first_run() {
    for text in ["", "x", "x=1", "vehicle=1", "vehicle.=1", "scenario..a=1"] {
        assert!(Axis::parse(text).is_err(), "{text}");
    }
    for set in [
        "vehicle.body.arm_mass_kg=12,1e9",
        "vehicle.body.arm_mass=1",
        "scenario.duration_s=nan",
        "scenario.seed.x=1",
        "scenario.step.99.at_s=1",
        "scenario.title=1",
    ] {
        assert!(campaign(&[set], 1..=2).is_err(), "{set}");
    }
    assert!(matches!(
        campaign(&[], 0..=u64::MAX),
        Err(CampaignError::TooMany("runs", RUNS_MAX))
    ));
}

#[test]
fn a_run_is_the_drive_of_its_number_wherever_it_runs() {
    let campaign = campaign(&["scenario.duration_s=22.5"], 1..=3).expect("good");
    // The kerb's last step is at 16 s.
    let alone = campaign.run(1).expect("runs");
    assert_eq!((alone.run, alone.seed), (1, 2));
    assert!(alone.metrics.len() > 20 && alone.simulated_s >= 22.5);
    let after_another = {
        campaign.run(0).expect("runs");
        campaign.run(1).expect("runs")
    };
    let text = |result: &RunResult| format!("{result:?}");
    assert_eq!(text(&alone), text(&after_another));
    let elsewhere = std::thread::scope(|scope| scope.spawn(|| text(&campaign.run(1).expect("runs"))).join());
    assert_eq!(elsewhere.expect("ends"), text(&alone));
}
