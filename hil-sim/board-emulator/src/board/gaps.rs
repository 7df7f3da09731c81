//! Places where the emulated part could not replace the real part, and which of these gaps are known not
//! to matter on this board.

use rigless::session::Session;

use super::drive_board::DriveBoard;

/// A place where the emulated part could not replace the real part.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Gap {
    /// The kind of gap: `unmapped`, `refused`, `unimplemented`, `undefined`, `unrouted`, or `told`, the
    /// emulator's word for a gap that a part's model reports itself.
    pub kind: &'static str,
    /// The instance and register, or the address.
    pub place: String,
    /// What happened there.
    pub detail: String,
}

/// A gap that does not matter, with the reason.
#[derive(Debug, Clone, Copy)]
pub struct Allowed {
    /// The gap's kind.
    pub kind: &'static str,
    /// Where the gap is.
    pub place: &'static str,
    /// Why the gap does not matter.
    pub reason: &'static str,
}

/// Every gap this firmware may reach.
pub const ALLOWED: &[Allowed] = &[
    Allowed {
        kind: "undefined",
        place: "SYSCFG",
        reason: "SYSCFG_CFGR, which connects a locked-up core and damaged memory to the break, is missing from the \
                 vendor's register description that the emulated part is made from; its bits act on real faults only",
    },
    Allowed {
        kind: "told",
        place: "RCC.PLLCKSELR",
        reason: "the HAL clears the fields of the PLLs it leaves off by writing the whole register; those of the \
                 running PLL and its source are locked while it runs, on the part as here",
    },
];

/// The gaps of a run.
pub fn of(session: &Session<DriveBoard>) -> Vec<Gap> {
    let mut gaps = Vec::new();
    let mut note = |kind, place: String, detail: String| gaps.push(Gap { kind, place, detail });
    for gap in session.unmapped() {
        note(
            "unmapped",
            format!("{:#010x}", gap.address),
            format!("pc {:#010x}", gap.program_counter),
        );
    }
    for (address, fault) in session.refused() {
        note("refused", format!("{address:#010x}"), format!("{fault:?}"));
    }
    for gap in session.unimplemented().values() {
        let detail = format!("{} reads, {} writes, last {:x?}", gap.reads, gap.writes, gap.written);
        note("unimplemented", format!("{}.{}", gap.instance, gap.register), detail);
    }
    for (address, gap) in session.undefined() {
        let detail = format!("{} reads, {} writes at {address:#010x}", gap.reads, gap.writes);
        note("undefined", gap.instance.to_owned(), detail);
    }
    for (instance, line) in session.unrouted() {
        note("unrouted", format!("{instance}.{line}"), String::new());
    }
    for gap in session.told() {
        note(
            "told",
            format!("{}.{}", gap.instance, gap.register),
            gap.reason.to_owned(),
        );
    }
    gaps
}

/// The gaps that [`ALLOWED`] does not list.
pub fn unexpected(gaps: &[Gap]) -> Vec<Gap> {
    gaps.iter()
        .filter(|gap| {
            !ALLOWED
                .iter()
                .any(|allowed| allowed.kind == gap.kind && allowed.place == gap.place)
        })
        .cloned()
        .collect()
}
