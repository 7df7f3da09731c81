//! `--vehicle FILE.toml`: the vehicle that supplies the numbers of the flags not given.

use std::path::{Path, PathBuf};

use clap::Args;
use model::dynamics::camera::CameraParameters;
use model::dynamics::coupled::{Bearing, CoupledParameters};
use model::dynamics::planar::PlanarParameters;
use model::dynamics::spatial::SpatialParameters;
use model::vehicle::Vehicle;
use vehicle_file::VehicleFile;

use crate::analysis::coupled::{BALLAST_SHARE, with_thesis_spar};
use report::error::CommandError;

/// Half track over wheel radius where neither a flag nor the vehicle file gives it.
pub const HALF_TRACK: f64 = 1.0;
/// Spar length over wheel radius where neither a flag nor the vehicle file gives it.
pub const SPAR_LENGTH: f64 = 1.0;

/// The flag that names a vehicle file, shared by the analysis commands that take either kind.
#[derive(Debug, Clone, Default, Args)]
pub struct VehicleArgument {
    /// Vehicle file: a whole vehicle in SI units, or one table `[planar]` of nondimensional numbers. Gives the parameters of the
    /// model; each flag overrides one of them. The vehicle carries the mass of the file's camera spar on its axle
    #[arg(long, value_name = "FILE.toml")]
    pub vehicle: Option<PathBuf>,
}

/// The flag that names a vehicle file, for commands that need a whole vehicle.
#[derive(Debug, Clone, Default, Args)]
pub struct SparVehicleArgument {
    /// Vehicle file: a whole vehicle with a camera spar, in SI units. Gives the parameters of the spar; each flag
    /// overrides one of them
    #[arg(long, value_name = "FILE.toml")]
    vehicle: Option<PathBuf>,
}

impl SparVehicleArgument {
    /// As [`VehicleArgument::read`].
    ///
    /// # Errors
    /// As [`VehicleArgument::read`].
    pub fn read(&self) -> Result<Source, CommandError> {
        read(self.vehicle.as_deref())
    }
}

/// Source of the parameters that no flag gives.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// No file: the thesis's vehicle.
    Thesis,
    /// The file of this name.
    File(String, VehicleFile),
}

impl VehicleArgument {
    /// Reads and checks the file, if one is named.
    ///
    /// # Errors
    /// [`CommandError::Input`] naming the file, the field and the allowed range.
    pub fn read(&self) -> Result<Source, CommandError> {
        read(self.vehicle.as_deref())
    }
}

fn read(path: Option<&Path>) -> Result<Source, CommandError> {
    let Some(path) = path else {
        return Ok(Source::Thesis);
    };
    let file = vehicle_file::read(path).map_err(|error| CommandError::Input(error.to_string()))?;
    Ok(Source::File(path.display().to_string(), file))
}

impl Source {
    /// The whole vehicle of the file; `None` without a file, or if it has nondimensional numbers only.
    pub fn whole_vehicle(&self) -> Option<&Vehicle<f64>> {
        match self {
            Self::File(_, VehicleFile::Vehicle(vehicle)) => Some(vehicle),
            Self::Thesis | Self::File(_, VehicleFile::Planar(_)) => None,
        }
    }

    /// The whole mass, camera spar included, divided by the mass of wheels and arm.
    pub fn whole_mass(&self) -> f64 {
        self.whole_vehicle()
            .map_or(1.0, |vehicle| 1.0 + vehicle.spar_mass_ratio())
    }

    /// Whether the file gives the vehicle's slope.
    pub fn has_slope(&self) -> bool {
        matches!(self, Self::File(_, VehicleFile::Planar(_)))
    }

    /// The name in messages of the planar parameter `name`: its flag if the user gave the flag or no file
    /// gives the parameter, else its field in the file.
    pub fn name(&self, name: &str, flag_given: bool) -> String {
        match self {
            Self::File(file, VehicleFile::Planar(_)) if !flag_given => format!("{file}: planar.{name}"),
            _ => format!("--{name}"),
        }
    }

    /// The planar vehicle. A whole vehicle's file has no slope; the vehicle then stands on the thesis's slope.
    pub fn planar(&self) -> PlanarParameters<f64> {
        let thesis = PlanarParameters::thesis();
        match self {
            Self::Thesis => thesis,
            Self::File(_, VehicleFile::Planar(planar)) => *planar,
            Self::File(_, VehicleFile::Vehicle(vehicle)) => vehicle.planar(thesis.beta),
        }
    }

    /// The gains kp and kd of Eq. 3.25: a whole vehicle's own, else those of the thesis's figures.
    pub fn gains(&self) -> (f64, f64) {
        self.whole_vehicle().map_or((0.8, 10.0), |vehicle| {
            let control = vehicle.parameters().control;
            (control.kp, control.kd)
        })
    }

    /// The vehicle in space without its spar, on the level, or with the slope of a `[planar]` file along the first axis.
    pub fn spatial(&self) -> SpatialParameters<f64> {
        let level = PlanarParameters {
            beta: 0.0,
            ..PlanarParameters::thesis()
        };
        match self {
            Self::Thesis => SpatialParameters::from_planar(&level, HALF_TRACK, 0.0),
            Self::File(_, VehicleFile::Planar(planar)) => SpatialParameters::from_planar(planar, HALF_TRACK, 0.0),
            Self::File(_, VehicleFile::Vehicle(vehicle)) => vehicle.spatial(0.0, 0.0),
        }
    }

    /// The camera spar.
    ///
    /// # Errors
    /// [`CommandError::Input`] if the file describes no spar.
    pub fn camera(&self) -> Result<CameraParameters<f64>, CommandError> {
        match self {
            Self::Thesis => Ok(CameraParameters::thesis()),
            Self::File(file, VehicleFile::Planar(_)) => Err(no_camera(file)),
            Self::File(file, VehicleFile::Vehicle(vehicle)) => vehicle.camera().ok_or_else(|| no_camera(file)),
        }
    }

    /// The vehicle with its camera spar, and the spar alone. The vehicle of a `[planar]` file, which cannot
    /// describe a spar, carries the thesis's spar.
    ///
    /// # Errors
    /// [`CommandError::Input`] if a whole vehicle has no spar.
    pub fn coupled(&self, bearing: Bearing) -> Result<(CoupledParameters<f64>, CameraParameters<f64>), CommandError> {
        match self {
            Self::File(file, VehicleFile::Vehicle(vehicle)) => vehicle
                .coupled(self.planar().beta, bearing)
                .zip(vehicle.camera())
                .ok_or_else(|| no_camera(file)),
            _ => Ok((
                with_thesis_spar(self.planar(), SPAR_LENGTH, BALLAST_SHARE, bearing),
                CameraParameters::thesis(),
            )),
        }
    }
}

fn no_camera(file: &str) -> CommandError {
    CommandError::Input(format!(
        "{file}: tables [spar] and [ballast_motor] are missing: this command needs a vehicle with a camera spar"
    ))
}
