//! The search for a drive in which a speed law lets the arm whirl: random drives, an optimiser that starts from the
//! worst of them, and steps of vehicles that differ from their file.
//!
//! The search works in groups of seeds. A group depends only on its number. Any group can therefore be searched on any
//! machine in any order; the results, sorted by number, are the same.

use model::vehicle::Vehicle;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::law_step::{LawStep, perturbed_step};
use super::random_drive::RandomDrive;
use super::sampled::WHIRL_RAD;

/// Seeds of a group.
pub const GROUP_SEEDS: u64 = 1000;
/// Generations of one climb: some 200 drives.
const GENERATIONS: usize = 20;
/// Arm angle, rad, that no drive of the landing law may exceed: the reference vehicle's `phi_max_rad`.
pub const FAR_RAD: f64 = 1.4;

/// A search.
#[derive(Debug, Clone)]
pub struct LawSearch {
    /// The vehicle file; its law is the law under test.
    pub vehicle: Vehicle<f64>,
    /// Seed of the first drive and the first plant.
    pub first_seed: u64,
    /// Random drives.
    pub drives: u64,
    /// Number of drives per group from which the optimiser climbs: the worst drives in which the arm swings beyond its
    /// standing angle.
    pub climbs: usize,
    /// Number of vehicles with parameters of +-20 % that make a step.
    pub plants: u64,
}

/// The arm's largest angle in the drive of a seed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SeedSwing {
    /// The drive's seed.
    pub seed: u64,
    /// The arm's largest angle, rad; beyond [`WHIRL_RAD`] the arm has turned over.
    pub phi_max_rad: f64,
}

/// Counts of some drives.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct SwingCounts {
    /// Number of them.
    pub drives: u64,
    /// Number of drives in which the arm turned over.
    pub whirls: u64,
    /// Number of drives in which the arm exceeded [`FAR_RAD`].
    pub far: u64,
    /// The drive with the largest swing; of equal drives the first.
    pub worst: Option<SeedSwing>,
}

/// The result of one group of seeds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SearchGroup {
    /// The group's number in the search.
    pub run: u64,
    /// The random drives.
    pub random: SwingCounts,
    /// Mean share of the time in which the drives slide.
    pub sliding: f64,
    /// The optimiser's results from the worst drives.
    pub climbed: SwingCounts,
    /// The vehicles with parameters of +-20 %, in order of their seeds.
    pub plants: Vec<LawStep>,
}

impl LawSearch {
    /// Number of groups.
    pub fn groups(&self) -> u64 {
        self.drives.max(self.plants).div_ceil(GROUP_SEEDS)
    }

    /// The seeds of group `run` out of `count` seeds.
    fn seeds(&self, run: u64, count: u64) -> std::ops::Range<u64> {
        let edge = |group: u64| {
            self.first_seed
                .saturating_add(count.min(group.saturating_mul(GROUP_SEEDS)))
        };
        edge(run)..edge(run.saturating_add(1))
    }

    /// Searches group `run`.
    pub fn group(&self, run: u64) -> SearchGroup {
        let mut drives: Vec<(u64, _)> = self
            .seeds(run, self.drives)
            .into_par_iter()
            .map(|seed| (seed, RandomDrive::new(&self.vehicle, seed).drive(&self.vehicle)))
            .collect();
        let swing = |seed, phi_max_rad| SeedSwing { seed, phi_max_rad };
        let mut random = SwingCounts::default();
        for (seed, found) in &drives {
            random.count(swing(*seed, found.phi_max_rad));
        }
        let sliding: f64 = drives.iter().map(|(_, found)| found.sliding).sum();
        let sliding = sliding / drives.len().max(1) as f64;
        drives.retain(|(_, found)| found.swings);
        // A stable sort, so that of equal drives the first climb.
        drives.sort_by(|a, b| b.1.phi_max_rad.total_cmp(&a.1.phi_max_rad));
        drives.truncate(self.climbs);
        let climbs: Vec<_> = drives
            .into_par_iter()
            .map(|(seed, _)| {
                let found = RandomDrive::new(&self.vehicle, seed).climb(&self.vehicle, GENERATIONS);
                swing(seed, found.phi_max_rad)
            })
            .collect();
        let mut climbed = SwingCounts::default();
        for found in climbs {
            climbed.count(found);
        }
        SearchGroup {
            run,
            random,
            sliding,
            climbed,
            plants: self
                .seeds(run, self.plants)
                .into_par_iter()
                .map(|seed| perturbed_step(&self.vehicle, seed))
                .collect(),
        }
    }
}

impl SwingCounts {
    /// Counts a drive.
    fn count(&mut self, found: SeedSwing) {
        self.add(&Self {
            drives: 1,
            whirls: u64::from(found.phi_max_rad > WHIRL_RAD),
            far: u64::from(found.phi_max_rad > FAR_RAD),
            worst: Some(found),
        });
    }

    /// Adds later drives.
    pub fn add(&mut self, later: &Self) {
        self.drives += later.drives;
        self.whirls += later.whirls;
        self.far += later.far;
        let angle = |counts: &Self| counts.worst.map_or(f64::NEG_INFINITY, |worst| worst.phi_max_rad);
        if angle(later) > angle(self) {
            self.worst = later.worst;
        }
    }
}

/// The result of a whole search or of a part of it.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct SearchTotals {
    /// The random drives.
    pub random: SwingCounts,
    /// Mean share of the time in which the drives slide.
    pub sliding: f64,
    /// The optimiser's results from the worst drives of every group.
    pub climbed: SwingCounts,
    /// The vehicles with parameters of +-20 %; `None` without such vehicles.
    pub plants: Option<StepSpread>,
    #[serde(skip)]
    steps: Vec<LawStep>,
}

/// The steps of many vehicles: each number's median, its 95 % quantile, and its maximum.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct StepSpread {
    /// Number of them.
    pub plants: u64,
    /// Number of vehicles whose arm turned over.
    pub whirls: u64,
    /// Time to settle into 2 %, in time units; `None` if a vehicle does not settle.
    pub settling: [Option<f64>; 3],
    /// Share of the step.
    pub overshoot: [f64; 3],
    /// Share of the step.
    pub undershoot: [f64; 3],
    /// Largest arm angle, deg.
    pub phi_max_deg: [f64; 3],
    /// Distance from the target speed at the end, in speed units.
    pub ripple: [f64; 3],
    /// Seeds that take more than 18 time units.
    pub slow: Vec<u64>,
}

/// Time within which every vehicle should settle, in time units.
pub const SETTLING_MAX: f64 = 18.0;

impl SearchTotals {
    /// Adds the next group.
    pub fn add(&mut self, group: &SearchGroup) {
        let (before, more) = (self.random.drives as f64, group.random.drives as f64);
        if before + more > 0.0 {
            self.sliding = (self.sliding * before + group.sliding * more) / (before + more);
        }
        self.random.add(&group.random);
        self.climbed.add(&group.climbed);
        self.steps.extend(&group.plants);
    }

    /// The summary with the spread of the steps.
    #[must_use]
    pub fn finish(mut self) -> Self {
        self.plants = (!self.steps.is_empty()).then(|| StepSpread::new(&self.steps));
        self
    }

    /// Number of drives and steps in which the arm turned over.
    pub fn whirls(&self) -> u64 {
        self.random.whirls + self.climbed.whirls + self.plants.as_ref().map_or(0, |plants| plants.whirls)
    }
}

impl StepSpread {
    /// The spread of at least one step.
    fn new(steps: &[LawStep]) -> Self {
        let spread = |value: &dyn Fn(&LawStep) -> f64| {
            let mut values: Vec<f64> = steps.iter().map(value).collect();
            values.sort_by(f64::total_cmp);
            [0.5, 0.95, 1.0].map(|share| values[((values.len() - 1) as f64 * share) as usize])
        };
        let settling = |step: &LawStep| step.settling.unwrap_or(f64::INFINITY);
        Self {
            plants: steps.len() as u64,
            whirls: steps.iter().filter(|step| step.whirled).count() as u64,
            settling: spread(&settling).map(|time| time.is_finite().then_some(time)),
            overshoot: spread(&|step| step.overshoot),
            undershoot: spread(&|step| step.undershoot),
            phi_max_deg: spread(&|step| step.phi_max_deg),
            ripple: spread(&|step| step.ripple),
            slow: steps
                .iter()
                .filter(|step| settling(step) > SETTLING_MAX)
                .map(|step| step.seed)
                .collect(),
        }
    }
}
