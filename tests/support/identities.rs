//! Identities of boards, for the tests of files that contain one.

use firmware::link::about;
use firmware::protocol::message::{Identity, PROTOCOL_VERSION};

/// The identity of a board with the reference vehicle, in this boot.
pub fn identity(boot: u32) -> Identity {
    let vehicle = vehicle_file::reference().expect("the reference vehicle");
    Identity {
        protocol: PROTOCOL_VERSION,
        nonce: 0,
        session: 1,
        sequence: 0,
        time_us: 0,
        about: about(&vehicle.parameters().cast::<f32>(), boot),
    }
}
