//! A wire that the bring-up procedure opens, and cannot open a second time.

use std::sync::Arc;
use std::sync::atomic::AtomicU32;

use hil_sim::cli::link::session::Link;
use hil_sim::cli::link::wire::Wire;
use report::error::CommandError;

/// Opens the link on `wire` under the host's number `nonce`; the second call finds no wire.
pub fn opened_once<W: Wire>(
    wire: W,
    nonce: u32,
    interrupts: Arc<AtomicU32>,
) -> impl FnMut() -> Result<Link<W>, CommandError> {
    let mut wire = Some(wire);
    move || {
        let wire = wire
            .take()
            .ok_or_else(|| CommandError::Other("the wire is gone".into()))?;
        Ok(Link::new(wire, nonce, interrupts.clone()))
    }
}
