//! What a step of the procedure is, and how it is carried out.

use firmware::hardware::{Place, ResetCause};

/// A look at an armed board. The tool itself arms: it holds the serial port, so no other program could.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmedLook {
    /// Commanded speed, m/s.
    pub speed_m_s: f32,
    /// What the person does while the vehicle is armed.
    pub act: &'static str,
    /// What ends the armed state.
    pub ends: LookEnd,
    /// The question afterwards.
    pub question: &'static str,
}

/// What ends the armed state of an [`ArmedLook`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LookEnd {
    /// The tool, after some seconds.
    Time,
    /// The emergency stop.
    Stop,
    /// The person's act: the board falls silent or disarms by itself. It goes on in the same boot.
    Opened,
    /// The person's act: the board falls silent or disarms by itself. It starts again, by one of these causes.
    Restart(&'static [ResetCause]),
}

/// How a step is carried out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StepKind {
    /// The person looks, and answers this question.
    Look(&'static str),
    /// The person measures, and gives a number within these ends.
    Measure(&'static str, f64, f64),
    /// Who the board is, and what its self-test found.
    Identity,
    /// What the board's clocks run from, and how fast they run.
    Clock,
    /// Starts of the supply.
    ColdStarts,
    /// The reset button.
    ResetButton,
    /// The emergency stop's contacts.
    Contacts,
    /// The divider of the supply, with the bridges' supply off.
    SupplyOff,
    /// The current sensors' zeros.
    CurrentZeros,
    /// The current sensors' gains and signs.
    CurrentGain,
    /// An IMU, hanging at rest.
    AtRest(Place),
    /// An IMU's signs.
    TiltedForward(Place),
    /// The encoders, a wheel at a time.
    Wheels,
    /// The ballast's encoder.
    BallastByHand,
    /// A store and a read.
    Store,
    /// The supply cut while the board stores.
    PowerCuts,
    /// A start without the external clock.
    NoExternalClock,
    /// A firmware over the link, and the supply cut while the boot loader copies.
    Update,
    /// The divider of the supply, with the bridges' supply on.
    SupplyOn,
    /// Armed, at zero volts.
    Armed,
    /// Armed, the spar tilted by hand.
    Levelling,
    /// The tool arms; the person acts, looks, and answers a question.
    ArmedLook(ArmedLook),
    /// The emergency stop, armed.
    StopArmed,
    /// The board's button while armed.
    ButtonArmed,
    /// Both wheels forward.
    Forward,
    /// The wheels against each other.
    Turn,
    /// What a tick costs.
    TickCost,
}

/// One step of the procedure. Its number is its place, from 1.
#[derive(Debug, Clone, Copy)]
pub struct BringUpStep {
    /// A few words.
    pub title: &'static str,
    /// What is done.
    pub does: &'static str,
    /// What is seen if the step passes.
    pub passes: &'static str,
    /// What to look at if it fails.
    pub look_at: &'static str,
    /// Only a board on a bench can show it, no simulated one.
    pub bench_only: bool,
    /// The bridges' supply is on.
    pub powered: bool,
    /// Only a vehicle with a spar needs it.
    pub of_spar: bool,
    /// How.
    pub kind: StepKind,
}

/// A step without the bridges' supply: `texts` are what is done, what passes, and what to look at.
pub(super) const fn off(title: &'static str, kind: StepKind, texts: [&'static str; 3]) -> BringUpStep {
    let [does, passes, look_at] = texts;
    BringUpStep {
        title,
        does,
        passes,
        look_at,
        bench_only: false,
        powered: false,
        of_spar: false,
        kind,
    }
}

/// As [`off`], with the bridges' supply.
pub(super) const fn on(title: &'static str, kind: StepKind, texts: [&'static str; 3]) -> BringUpStep {
    let step = off(title, kind, texts);
    BringUpStep { powered: true, ..step }
}

/// The step, which only a bench shows.
pub(super) const fn bench(step: BringUpStep) -> BringUpStep {
    BringUpStep {
        bench_only: true,
        ..step
    }
}

/// The step, which only a vehicle with a spar needs.
pub(super) const fn of_spar(step: BringUpStep) -> BringUpStep {
    BringUpStep { of_spar: true, ..step }
}
