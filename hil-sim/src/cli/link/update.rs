//! `link update`: sends a firmware to the board and follows it until it has confirmed itself or was rolled back.

use std::io::Write;
use std::path::Path;

use firmware::drive_board::{BOARD, IMAGE_START};
use firmware::image::Image;
use firmware::protocol::message::{Answer, Identity, Order, UpdateAnswer, UpdateRefusal, UpdateRequest, UpdateState};
use hil_elf::seal::sealed_image;
use report::error::CommandError;
use report::output::progress_bar;
use virtual_board::words::update_refusal_words;

use super::console::Console;
use super::session::{Link, refused};
use super::wire::Wire;

/// Number of repetitions of a piece before the link counts as lost.
const PIECE_ATTEMPTS: u32 = 5;
/// Time within which a board that restarts into an update sends again, us. The boot loader backs up one image and
/// installs another: two sectors each (at most 4 s per erasure) and 8192 words each (at most 600 us), 26 s in all. The
/// loader's watchdog ends a new image that hangs after at most 33 s. The loader then restores the backup in another 13
/// s.
const INSTALLED_WITHIN_US: u64 = 100_000_000;
/// Time within which a new firmware confirms itself or is rolled back, us.
const SETTLED_WITHIN_US: u64 = 60_000_000;
/// Time between two questions about the result, us.
const ASK_EVERY_US: u64 = 500_000;

/// Largest ELF that is read, bytes. The board's has 7 MB, most of it what only a debugger reads.
const ELF_MAX_BYTES: u64 = 1 << 28;

/// A firmware to send.
#[derive(Debug, Clone)]
pub struct Update {
    image: Image,
    bytes: Vec<u8>,
}

impl Update {
    /// Reads a sealed ELF.
    ///
    /// # Errors
    /// [`CommandError::Input`]: the file cannot be read, or contains no sealed firmware.
    pub fn read(file: &Path) -> Result<Self, CommandError> {
        let wrong = |why: &dyn std::fmt::Display| CommandError::Input(format!("{}: {why}", file.display()));
        let elf = vehicle_file::read_bytes(file, ELF_MAX_BYTES).map_err(|error| wrong(&error))?;
        Self::of(&elf).map_err(|why| wrong(&why))
    }

    /// The firmware of a sealed ELF.
    ///
    /// # Errors
    /// The bytes are not an ELF of the board, are not sealed, have changed since they were sealed, or are linked for
    /// another address.
    pub fn of(elf: &[u8]) -> Result<Self, &'static str> {
        let (sealed, bytes) = sealed_image(elf)?;
        // The board itself refuses an image for another board.
        if sealed.board == BOARD && sealed.start != IMAGE_START {
            return Err(
                "the image is linked for another address than the board's, behind its boot loader: rebuild it with `.ci/build-board`",
            );
        }
        let image = Image {
            board: sealed.board,
            length: sealed.length,
            checksum: sealed.checksum,
            build: sealed.build,
            version: sealed.version,
        };
        Ok(Self { image, bytes })
    }

    /// Description of the image from the firmware's seal.
    pub fn image(&self) -> Image {
        self.image
    }

    /// The bytes for the flash.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

impl<W: Wire> Link<W> {
    /// Sends a firmware, orders its installation, and waits until the firmware has started.
    ///
    /// # Errors
    /// The board refuses, the link is lost, or the firmware was rolled back. A repeated transfer continues where the
    /// last one stopped, or starts again if the board has restarted.
    pub fn update<O: Write>(&mut self, update: &Update, console: &mut Console<O>) -> Result<(), CommandError> {
        let Image {
            build,
            version: [major, minor, patch],
            length,
            ..
        } = update.image;
        console.line(&format!(
            "sends firmware {major}.{minor}.{patch}, build {build:08x}, {length} bytes"
        ))?;
        self.send_image(update)?;
        let before = self.client.identity().map_or(0, |identity| identity.about.boot);
        match self.ask_update(UpdateRequest::Install)? {
            UpdateAnswer::Restarting => {}
            UpdateAnswer::OnlyStored => {
                return Err(CommandError::Checks(
                    "the board has stored and checked the image and not installed it: it has no boot loader; flash the \
                     firmware with a probe"
                        .into(),
                ));
            }
            other => return Err(strange(&other)),
        }
        console.line("stored and checked; the board restarts and installs it")?;
        let identity = self.after_restart(before)?;
        self.settle(update, &identity, console)
    }

    fn send_image(&mut self, update: &Update) -> Result<(), CommandError> {
        let bar = progress_bar(update.bytes.len(), "bytes");
        let mut next = next_of(&self.ask_update(UpdateRequest::Begin(update.image))?)?;
        let mut failures = 0;
        while let Some(piece) = UpdateRequest::piece(&update.bytes, next) {
            bar.set_position(u64::from(next));
            match self.ask_update(piece) {
                Ok(answer) => {
                    next = next_of(&answer)?;
                    failures = 0;
                }
                // The piece or its answer was lost: the board answers with its position.
                Err(error) if failures < PIECE_ATTEMPTS && self.listen().is_ok() => {
                    failures += 1;
                    let again = self.ask_update(UpdateRequest::Begin(update.image));
                    next = next_of(&again.map_err(|_| error)?)?;
                }
                Err(error) => return Err(error),
            }
        }
        bar.finish_and_clear();
        Ok(())
    }

    /// Waits until the board sends again in another boot.
    fn after_restart(&mut self, before: u32) -> Result<Identity, CommandError> {
        let since_us = self.wire.now_us();
        while self.wire.now_us() - since_us < INSTALLED_WITHIN_US {
            if let Some(identity) = self.other_boot(before)? {
                return Ok(identity);
            }
        }
        Err(CommandError::Checks(
            "the board has not come back: its red lamp blinks if it has no firmware to boot; see docs/updating.md"
                .into(),
        ))
    }

    /// Waits until the new firmware has confirmed itself or was rolled back.
    fn settle<O: Write>(
        &mut self,
        update: &Update,
        identity: &Identity,
        console: &mut Console<O>,
    ) -> Result<(), CommandError> {
        let since_us = self.wire.now_us();
        let mut boot = identity.about.boot;
        while self.wire.now_us() - since_us < SETTLED_WITHIN_US {
            let asked = self.ask_update(UpdateRequest::State);
            match asked {
                Ok(UpdateAnswer::State { state, checksum }) if checksum == update.image.checksum => match state {
                    UpdateState::Confirmed => {
                        return console.line("the new firmware has come up and is confirmed");
                    }
                    UpdateState::RolledBack => {
                        return Err(CommandError::Checks(
                            "the new firmware was started and did not confirm itself before the next reset: the board \
                             has gone back to the one before"
                                .into(),
                        ));
                    }
                    UpdateState::NotInstalled => {
                        return Err(CommandError::Checks(
                            "the new firmware could not be installed (the flash failed, or what was stored has changed): \
                             the board runs the one before"
                                .into(),
                        ));
                    }
                    UpdateState::None | UpdateState::Ordered | UpdateState::OnTrial => {}
                },
                Ok(other) => return Err(strange(&other)),
                // The board may have restarted once more.
                Err(_) => {
                    if let Some(identity) = self.other_boot(boot)? {
                        boot = identity.about.boot;
                    }
                }
            }
            let asked_us = self.wire.now_us();
            while self.wire.now_us() - asked_us < ASK_EVERY_US && self.listen().is_ok() {}
        }
        Err(CommandError::Checks(
            "the new firmware has neither confirmed itself nor been rolled back; it does neither while armed".into(),
        ))
    }

    /// Sends one update request.
    fn ask_update(&mut self, request: UpdateRequest) -> Result<UpdateAnswer, CommandError> {
        match self.ask_while(Order::Update(request), |_| Ok(()))? {
            Answer::Update(UpdateAnswer::Refused(UpdateRefusal::OutOfOrder { next })) => {
                Ok(UpdateAnswer::Ready { next })
            }
            Answer::Update(UpdateAnswer::Refused(refusal)) => Err(CommandError::Checks(update_refusal_words(refusal))),
            Answer::Update(answer) => Ok(answer),
            Answer::Refused(refusal) => Err(refused(refusal)),
            Answer::Done | Answer::Parameters(_) => {
                Err(CommandError::Checks("a strange answer about the update".into()))
            }
        }
    }
}

fn next_of(answer: &UpdateAnswer) -> Result<u32, CommandError> {
    match answer {
        UpdateAnswer::Ready { next } => Ok(*next),
        other => Err(strange(other)),
    }
}

fn strange(answer: &UpdateAnswer) -> CommandError {
    CommandError::Checks(format!("a strange answer about the update: {answer:?}"))
}
