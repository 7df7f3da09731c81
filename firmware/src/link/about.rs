//! The identity of this firmware.

use model::vehicle::VehicleParameters;

use crate::built_in::BUILD_HASH;
use crate::parameters::schema;
use crate::protocol::message::About;

/// The identity of this firmware, built for a vehicle of the kind of `parameters`, in the boot
/// with the number `boot`.
pub fn about(parameters: &VehicleParameters<f32>, boot: u32) -> About {
    About {
        version: VERSION,
        build: BUILD_HASH,
        schema: schema(parameters),
        boot,
    }
}

/// Version of the firmware: major, minor, patch.
pub const VERSION: [u16; 3] = [
    number(env!("CARGO_PKG_VERSION_MAJOR")),
    number(env!("CARGO_PKG_VERSION_MINOR")),
    number(env!("CARGO_PKG_VERSION_PATCH")),
];

/// The decimal number in `text`.
const fn number(text: &str) -> u16 {
    let mut rest = text.as_bytes();
    let mut number = 0;
    while let [digit, after @ ..] = rest {
        number = 10 * number + (*digit - b'0') as u16;
        rest = after;
    }
    number
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_version_is_the_packages() {
        let [major, minor, patch] = VERSION;
        assert_eq!(std::format!("{major}.{minor}.{patch}"), env!("CARGO_PKG_VERSION"));
    }

    #[test]
    fn digits_are_numbers_of_ten() {
        assert_eq!(
            ["", "0", "7", "10", "123", "65535"].map(number),
            [0, 0, 7, 10, 123, 65535]
        );
    }

    #[test]
    fn the_board_tells_its_schema_and_its_boot() {
        let parameters = crate::built_in::PARAMETERS;
        let told = about(&parameters, 7);
        assert_eq!(
            (told.version, told.build, told.schema, told.boot),
            (VERSION, BUILD_HASH, schema(&parameters), 7)
        );
        let without = VehicleParameters {
            spar: None,
            ..parameters
        };
        assert_ne!(about(&without, 7).schema, told.schema, "another vehicle, other numbers");
    }
}
