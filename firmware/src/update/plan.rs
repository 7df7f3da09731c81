//! The boot loader's next step: a pure decision from the marks and the contents of the three places.

use super::journal::InstallOrder;
use crate::image::Image;

/// The boot loader's findings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Found {
    /// The intact image in the running place, if any.
    pub running: Option<Image>,
    /// The intact arrived image, if any.
    pub arrived: Option<Image>,
    /// The intact kept image, if any.
    pub kept: Option<Image>,
    /// The order.
    pub order: Option<InstallOrder>,
}

/// The boot loader's next step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoaderStep {
    /// Boot the image in the running place.
    Boot,
    /// Copy the running image to the place of the kept image.
    Keep,
    /// Mark that the previous image is kept.
    MarkKept,
    /// Copy the arrived image to the running place.
    Install,
    /// Mark that the new image is booted, and boot it.
    Try,
    /// Mark that the order is finished, and boot the image in the running place.
    Close,
    /// Mark that the new image is given up.
    GiveUp,
    /// Copy the kept image to the running place.
    Restore,
    /// There is no bootable image.
    Stop,
}

/// Returns the next step. The boot loader never boots an image that is not intact.
pub fn next(found: &Found) -> LoaderStep {
    let Found {
        running,
        arrived,
        kept,
        order,
    } = *found;
    let Some(order) = order else {
        return boot_or(running, restore(kept));
    };
    let arrived = arrived.filter(|image| order.is_of(image));
    let installed = running.is_some_and(|image| order.is_of(&image));
    if order.confirmed {
        let install = arrived.map(|_| LoaderStep::Install);
        return boot_or(running, install.unwrap_or(restore(kept)));
    }
    if order.closed {
        // The image there was flashed by a probe, or is the previous image.
        return boot_or(running, restore(kept));
    }
    if running.is_some_and(|image| order.is_void(&image)) {
        return LoaderStep::Close;
    }
    if order.rolled_back {
        return match kept {
            _ if running.is_some() && (!installed || running == kept) => LoaderStep::Close,
            Some(_) => LoaderStep::Restore,
            None => boot_or(running, LoaderStep::Stop),
        };
    }
    if order.tried {
        // The image was booted and did not confirm itself before the next reset.
        return LoaderStep::GiveUp;
    }
    if arrived.is_none() {
        return LoaderStep::GiveUp;
    }
    if !order.kept {
        return if running.is_none() || running == kept {
            LoaderStep::MarkKept
        } else {
            LoaderStep::Keep
        };
    }
    if installed {
        LoaderStep::Try
    } else {
        LoaderStep::Install
    }
}

fn boot_or(running: Option<Image>, otherwise: LoaderStep) -> LoaderStep {
    if running.is_some() { LoaderStep::Boot } else { otherwise }
}

fn restore(kept: Option<Image>) -> LoaderStep {
    if kept.is_some() {
        LoaderStep::Restore
    } else {
        LoaderStep::Stop
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive_board::BOARD;

    fn image(checksum: u32) -> Image {
        Image {
            board: BOARD,
            length: 4096,
            checksum,
            build: checksum,
            version: [0, 1, 0],
        }
    }

    fn order(checksum: u32) -> InstallOrder {
        InstallOrder {
            length: 4096,
            checksum,
            before: 1,
            kept: false,
            tried: false,
            confirmed: false,
            rolled_back: false,
            closed: false,
        }
    }

    /// Every combination of marks and of the places' contents: nothing, the old image, the new
    /// image, an image that a probe flashed.
    fn all() -> impl Iterator<Item = Found> {
        let images = [None, Some(image(1)), Some(image(2)), Some(image(3))];
        (0..64 * 33).map(move |n| {
            let at = |place: usize| images[n / 4_usize.pow(place as u32) % 4];
            let marks = n / 64;
            Found {
                running: at(0),
                arrived: at(1),
                kept: at(2),
                order: (marks < 32).then(|| InstallOrder {
                    kept: marks & 1 != 0,
                    tried: marks & 2 != 0,
                    confirmed: marks & 4 != 0,
                    rolled_back: marks & 8 != 0,
                    closed: marks & 16 != 0,
                    ..order(2)
                }),
            }
        })
    }

    #[test]
    fn only_a_whole_image_is_booted() {
        for found in all() {
            if matches!(next(&found), LoaderStep::Boot | LoaderStep::Close | LoaderStep::Try) {
                assert!(found.running.is_some(), "{found:?}");
            }
        }
    }

    #[test]
    fn nothing_is_copied_that_is_not_whole() {
        for found in all() {
            match next(&found) {
                LoaderStep::Keep => assert!(found.running.is_some(), "{found:?}"),
                LoaderStep::Install => assert!(found.arrived.is_some(), "{found:?}"),
                LoaderStep::Restore => assert!(found.kept.is_some(), "{found:?}"),
                _ => {}
            }
        }
    }

    /// The only intact image is never overwritten, except by a copy of an intact image.
    #[test]
    fn the_board_stops_only_where_no_place_holds_an_image_that_may_run() {
        for found in all() {
            if next(&found) == LoaderStep::Stop {
                assert_eq!((found.running, found.kept), (None, None), "{found:?}");
                // An image that nobody ordered, or that was given up, is not installed.
                let may_run = found.order.is_some_and(|order| order.confirmed) && found.arrived == Some(image(2));
                assert!(!may_run, "{found:?}");
            }
        }
    }

    /// From every combination the sequence of steps ends.
    #[test]
    fn the_steps_come_to_an_end() {
        for start in all() {
            let mut found = start;
            let mut steps = 0;
            loop {
                let step = next(&found);
                let Found { order, .. } = &mut found;
                match (step, order) {
                    (LoaderStep::Boot | LoaderStep::Close | LoaderStep::Try | LoaderStep::Stop, _) => break,
                    (LoaderStep::Keep, _) => found.kept = found.running,
                    (LoaderStep::Install, _) => found.running = found.arrived,
                    (LoaderStep::Restore, _) => found.running = found.kept,
                    (LoaderStep::MarkKept, Some(order)) => order.kept = true,
                    (LoaderStep::GiveUp, Some(order)) => order.rolled_back = true,
                    (step, None) => panic!("{step:?} without an order"),
                }
                steps += 1;
                assert!(steps < 6, "{start:?}");
            }
        }
    }

    #[test]
    fn an_image_that_did_not_confirm_itself_is_given_up() {
        let tried = Found {
            running: Some(image(2)),
            arrived: Some(image(2)),
            kept: Some(image(1)),
            order: Some(InstallOrder {
                kept: true,
                tried: true,
                ..order(2)
            }),
        };
        assert_eq!(next(&tried), LoaderStep::GiveUp);
        let given_up = Found {
            order: tried.order.map(|order| InstallOrder {
                rolled_back: true,
                ..order
            }),
            ..tried
        };
        assert_eq!(next(&given_up), LoaderStep::Restore);
        let restored = Found {
            running: Some(image(1)),
            ..given_up
        };
        assert_eq!(next(&restored), LoaderStep::Close);
    }
}
