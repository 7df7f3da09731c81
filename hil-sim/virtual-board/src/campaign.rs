//! Campaigns: many numbered runs of scenarios, each with its own seed and overrides.
//!
//! A run depends only on its number. Any range of numbers can therefore run on any machine in any order; the results,
//! sorted by number, are the same.

use std::collections::BTreeMap;
use std::ops::{Range, RangeInclusive};
use std::path::{Path, PathBuf};

use firmware::drive_board::SCALES;
use model::vehicle::Vehicle;
use serde::{Serialize, Serializer};
use toml::Value;

use crate::scenario::trace::fnv1a;
use crate::scenario::{JudgedRun, MetricValue, RunVerdict, Scenario, VirtualBackend, run_judged};

mod error;
mod overrides;

pub use error::CampaignError;
pub use overrides::Axis;
use overrides::{OverrideSource, Target};

/// Largest number of runs of a campaign.
pub const RUNS_MAX: u64 = 100_000_000;
/// Largest number of combinations of overrides of a campaign. Each combination is checked before the first run.
pub const COMBINATIONS_MAX: u64 = 100_000;

/// Many numbered runs: scenarios vary slowest, then the overrides in their order, and seeds vary fastest.
#[derive(Debug, Clone)]
pub struct Campaign {
    scenarios: Vec<OverrideSource>,
    vehicle: Option<OverrideSource>,
    plant_vehicle: Option<OverrideSource>,
    axes: Vec<Axis>,
    seeds: RangeInclusive<u64>,
}

/// The properties in which two equal campaigns agree.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, serde::Deserialize)]
pub struct CampaignIdentity {
    /// Version of the program.
    pub version: String,
    /// The scenarios' files.
    pub scenarios: Vec<String>,
    /// The overrides.
    pub sets: Vec<String>,
    /// First and last seed.
    pub seeds: [u64; 2],
    /// FNV-1a hash of the text of every file.
    pub files: String,
    /// Number of runs.
    pub runs: u64,
}

/// The result of one run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunResult {
    /// The run's number in the campaign.
    pub run: u64,
    /// The file of the run's scenario.
    pub scenario: String,
    /// The run's seed.
    pub seed: u64,
    /// The run's overrides.
    #[serde(serialize_with = "overrides_by_key")]
    pub set: Vec<(String, Value)>,
    /// How the run ended.
    pub verdict: RunVerdict,
    /// The metrics out of bounds, or why the run stopped.
    pub reasons: Vec<String>,
    /// Simulated time, s.
    pub simulated_s: f64,
    /// Every metric; empty for a run that stopped.
    #[serde(serialize_with = "metrics_by_name")]
    pub metrics: Vec<MetricValue>,
}

fn overrides_by_key<S: Serializer>(set: &[(String, Value)], serializer: S) -> Result<S::Ok, S::Error> {
    let by_key: BTreeMap<&str, &Value> = set.iter().map(|(key, value)| (key.as_str(), value)).collect();
    by_key.serialize(serializer)
}

fn metrics_by_name<S: Serializer>(metrics: &[MetricValue], serializer: S) -> Result<S::Ok, S::Error> {
    let by_name: BTreeMap<&str, f64> = metrics.iter().map(|metric| (metric.name, metric.value)).collect();
    by_name.serialize(serializer)
}

/// The run numbers of part `index` (counted from 1) of `count` parts of `runs`. The parts have neither gaps nor
/// overlaps.
pub fn part(runs: u64, index: u64, count: u64) -> Range<u64> {
    let edge = |i: u64| (u128::from(runs) * u128::from(i) / u128::from(count.max(1))) as u64;
    edge(index.saturating_sub(1))..edge(index)
}

impl Campaign {
    /// Reads the files of a campaign and checks every combination of overrides.
    ///
    /// # Errors
    /// The campaign's first error.
    pub fn new(
        scenarios: &[PathBuf],
        vehicle: Option<&Path>,
        plant_vehicle: Option<&Path>,
        axes: Vec<Axis>,
        seeds: RangeInclusive<u64>,
    ) -> Result<Self, CampaignError> {
        let campaign = Self {
            scenarios: scenarios
                .iter()
                .map(|path| OverrideSource::read(path))
                .collect::<Result<_, _>>()?,
            vehicle: vehicle.map(OverrideSource::read).transpose()?,
            plant_vehicle: plant_vehicle.map(OverrideSource::read).transpose()?,
            axes,
            seeds,
        };
        let combinations = campaign
            .axes
            .iter()
            .map(|axis| axis.values.len() as u64)
            .try_fold(campaign.scenarios.len() as u64, u64::checked_mul)
            .filter(|count| *count <= COMBINATIONS_MAX)
            .ok_or(CampaignError::TooMany("combinations of overrides", COMBINATIONS_MAX))?;
        combinations
            .checked_mul(campaign.seed_count())
            .filter(|count| *count <= RUNS_MAX)
            .ok_or(CampaignError::TooMany("runs", RUNS_MAX))?;
        for combination in 0..combinations {
            let (scenario, _, simulated) = campaign.prepare(combination * campaign.seed_count())?;
            scenario.plant(&simulated)?;
        }
        Ok(campaign)
    }

    /// Number of seeds.
    pub fn seed_count(&self) -> u64 {
        self.seeds.end().saturating_sub(*self.seeds.start()).saturating_add(1)
    }

    /// Number of runs.
    pub fn runs(&self) -> u64 {
        let combinations: u64 = self.axes.iter().map(|axis| axis.values.len() as u64).product();
        self.scenarios.len() as u64 * combinations * self.seed_count()
    }

    /// The properties in which an equal campaign agrees.
    pub fn identity(&self) -> CampaignIdentity {
        let sources = self.scenarios.iter().chain(&self.vehicle).chain(&self.plant_vehicle);
        let texts = sources.flat_map(|source| source.text.bytes().chain([0]));
        let vehicles = self.scenarios.iter().flat_map(|source| {
            let named = Scenario::parse(&source.name, &source.text)
                .ok()
                .and_then(|scenario| scenario.vehicle);
            let text = named.and_then(|file| vehicle_file::read_text(&source.folder.join(file)).ok());
            text.unwrap_or_default().into_bytes()
        });
        CampaignIdentity {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            scenarios: self.scenarios.iter().map(|source| source.name.clone()).collect(),
            sets: self
                .axes
                .iter()
                .map(|axis| {
                    let values: Vec<String> = axis.values.iter().map(Value::to_string).collect();
                    format!("{}={}", axis.key, values.join(","))
                })
                .collect(),
            seeds: [*self.seeds.start(), *self.seeds.end()],
            files: format!("{:016x}", fnv1a(texts.chain(vehicles))),
            runs: self.runs(),
        }
    }

    /// The scenario's source, the overrides and the seed of run `run`.
    fn parts(&self, run: u64) -> (&OverrideSource, Vec<(&Axis, &Value)>, u64) {
        let seed = self.seeds.start() + run % self.seed_count();
        let mut rest = run / self.seed_count();
        let mut set: Vec<(&Axis, &Value)> = Vec::new();
        for axis in self.axes.iter().rev() {
            let count = axis.values.len() as u64;
            set.push((axis, &axis.values[(rest % count) as usize]));
            rest /= count;
        }
        set.reverse();
        (&self.scenarios[rest as usize], set, seed)
    }

    /// The scenario, the vehicle that the firmware is given, and the simulated vehicle of run `run`.
    fn prepare(&self, run: u64) -> Result<(Scenario, Vehicle<f64>, Vehicle<f64>), CampaignError> {
        let (source, set, seed) = self.parts(run);
        let of = |target: Target| -> Vec<(&Axis, &Value)> {
            set.iter().copied().filter(|(axis, _)| axis.target == target).collect()
        };
        let mut scenario = Scenario::parse(&source.name, &source.with(&of(Target::Scenario))?)?;
        scenario.seed = seed;
        let vehicle = match &self.vehicle {
            Some(vehicle) => vehicle.clone(),
            None => OverrideSource::read_own(&source.folder, scenario.vehicle.as_deref())?,
        };
        let told = OverrideSource {
            text: vehicle.with(&of(Target::Vehicle))?,
            ..vehicle.clone()
        };
        let simulated = self.plant_vehicle.as_ref().unwrap_or(&told);
        let simulated = OverrideSource {
            text: simulated.with(&of(Target::PlantVehicle))?,
            ..simulated.clone()
        };
        let ranges = SCALES.sensor_ranges();
        let read = |source: &OverrideSource| vehicle_file::parse_vehicle_for(&source.name, &source.text, &ranges);
        if self.vehicle.is_some() {
            // The bounds are to judge the vehicle with its overrides.
            let own = OverrideSource::read_own(&source.folder, scenario.vehicle.as_deref());
            let own = own.ok().and_then(|own| read(&own).ok());
            let flown = read(&vehicle).or_else(|_| read(&told))?;
            scenario.flown_by(&flown, own.as_ref());
        }
        Ok((scenario, read(&told)?, read(&simulated)?))
    }

    /// Runs run `run`.
    ///
    /// # Errors
    /// [`CampaignError::Board`] if the board does not boot, for example on a thread that runs another board.
    pub fn run(&self, run: u64) -> Result<RunResult, CampaignError> {
        let (scenario, told, simulated) = self.prepare(run)?;
        let plant = scenario.plant(&simulated)?;
        let mut backend = VirtualBackend::boot(&told, plant)?;
        let JudgedRun {
            verdict,
            reasons,
            metrics,
        } = run_judged(&scenario, &mut backend);
        let simulated_s = backend.board.now_us() as f64 * 1e-6;
        let (source, set, seed) = self.parts(run);
        Ok(RunResult {
            run,
            scenario: source.name.clone(),
            seed,
            set: set
                .into_iter()
                .map(|(axis, value)| (axis.key.clone(), value.clone()))
                .collect(),
            verdict,
            reasons,
            simulated_s,
            metrics,
        })
    }
}

#[cfg(test)]
mod tests;
