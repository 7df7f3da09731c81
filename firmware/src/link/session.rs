//! Decides who may give orders: the session in force, the offered session, and the order of their frames.

use crc::{CRC_32_ISCSI, Crc, NoTable};

use crate::protocol::message::{CLOCK_TOLERANCE_US, ORDER_AGE_MAX_US, OrderId};

/// Mixes boot, nonce and time into a session's number. Without a table in flash: one handshake is one session.
const SESSION_HASH: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISCSI);

/// One host's right to give orders.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Session {
    id: u32,
    nonce: u32,
    /// The greatest sequence number taken.
    newest: u32,
}

/// The board's decision on a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Admission {
    /// The board accepts the frame.
    Taken,
    /// The board drops the frame, which is a repetition or was overtaken by a later frame.
    Repeated,
    /// The board drops the frame, because it knows no such session.
    Foreign,
}

/// The session in force and the session on offer.
///
/// An Identify only makes an offer, so a recorded or repeated Identify takes nothing from the host that drives. The
/// first order of the offered session puts that session in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sessions {
    boot: u32,
    in_force: Option<Session>,
    offered: Option<Session>,
}

impl Sessions {
    /// No session yet, on a board of this boot number.
    pub fn new(boot: u32) -> Self {
        Self {
            boot,
            in_force: None,
            offered: None,
        }
    }

    /// Offers a session to the host of `nonce`, which asked at `now_us`. Returns the session's number and the greatest
    /// sequence number that it has used. The number depends on the time of the question, so a replayed question gets
    /// another number.
    pub fn offer(&mut self, nonce: u32, now_us: u64) -> (u32, u32) {
        let known = self.known().find(|session| session.nonce == nonce).copied();
        let session = known.unwrap_or_else(|| {
            let mut digest = SESSION_HASH.digest();
            digest.update(&self.boot.to_le_bytes());
            digest.update(&nonce.to_le_bytes());
            digest.update(&now_us.to_le_bytes());
            let session = Session {
                id: digest.finalize().max(1),
                nonce,
                newest: 0,
            };
            self.offered = Some(session);
            session
        });
        (session.id, session.newest)
    }

    /// Admits one numbered frame of a session.
    pub fn admit(&mut self, order: OrderId) -> Admission {
        let OrderId { session: id, sequence } = order;
        if let Some(offered) = self.offered
            && offered.id == id
        {
            self.in_force = Some(offered);
            self.offered = None;
        }
        match &mut self.in_force {
            Some(session) if session.id == id => {
                if sequence > session.newest {
                    session.newest = sequence;
                    Admission::Taken
                } else {
                    Admission::Repeated
                }
            }
            _ => Admission::Foreign,
        }
    }

    /// Records the number of a Disarm, which the board accepts in any case, so that an order that the host gave before
    /// the Disarm does not take effect after it.
    pub fn note(&mut self, disarm: OrderId) {
        for session in [&mut self.in_force, &mut self.offered].into_iter().flatten() {
            if session.id == disarm.session {
                session.newest = session.newest.max(disarm.sequence);
            }
        }
    }

    fn known(&self) -> impl Iterator<Item = &Session> {
        self.in_force.iter().chain(self.offered.iter())
    }
}

/// Whether an order given at `given_at_us` is too old at `now_us`, or from the future.
pub fn is_late(given_at_us: u64, now_us: u64) -> bool {
    is_from_the_future(given_at_us, now_us) || now_us.saturating_sub(given_at_us) > ORDER_AGE_MAX_US
}

/// Whether an order was given later than now by more than the possible error of the host's clock.
pub fn is_from_the_future(given_at_us: u64, now_us: u64) -> bool {
    given_at_us.saturating_sub(now_us) > CLOCK_TOLERANCE_US
}

#[cfg(test)]
mod tests {
    use super::Admission::{Repeated, Taken};
    use super::*;

    fn order(session: u32, sequence: u32) -> OrderId {
        OrderId { session, sequence }
    }

    #[test]
    fn only_the_offered_session_and_the_one_in_force_give_orders() {
        let mut sessions = Sessions::new(1);
        assert_eq!(sessions.admit(order(0, 1)), Admission::Foreign, "no session yet");
        let (first, used) = sessions.offer(11, 1000);
        assert_eq!(used, 0);
        assert_eq!(sessions.admit(order(first, 1)), Admission::Taken);
        let (second, _) = sessions.offer(12, 2000);
        assert_eq!(
            sessions.admit(order(first, 2)),
            Admission::Taken,
            "an offer takes nothing"
        );
        assert_eq!(sessions.admit(order(second, 1)), Admission::Taken);
        assert_eq!(
            sessions.admit(order(first, 3)),
            Admission::Foreign,
            "another host has taken over"
        );
    }

    #[test]
    fn repeated_and_overtaken_frames_are_dropped() {
        let mut sessions = Sessions::new(1);
        let (id, _) = sessions.offer(11, 1000);
        let admitted = [5, 5, 4, 7, 6, 8].map(|sequence| sessions.admit(order(id, sequence)));
        assert_eq!(admitted, [Taken, Repeated, Repeated, Taken, Repeated, Taken]);
        assert_eq!(sessions.offer(11, 9000), (id, 8), "the same host goes on where it was");
    }

    #[test]
    fn an_order_from_before_a_disarm_is_dropped() {
        let mut sessions = Sessions::new(1);
        let (id, _) = sessions.offer(11, 1000);
        sessions.note(order(id, 3));
        assert_eq!(sessions.admit(order(id, 2)), Admission::Repeated);
        assert_eq!(sessions.admit(order(id, 4)), Admission::Taken);
        sessions.note(order(id, 9));
        assert_eq!(sessions.admit(order(id, 9)), Admission::Repeated);
    }

    /// A Disarm of one host does not outdate another host's orders, and counts for a session that is still only
    /// offered.
    #[test]
    fn a_disarm_is_noted_in_its_own_session() {
        let mut sessions = Sessions::new(1);
        let (first, _) = sessions.offer(11, 1000);
        sessions.admit(order(first, 1));
        let (second, _) = sessions.offer(12, 2000);
        sessions.note(order(second, 5));
        assert_eq!(sessions.admit(order(first, 2)), Taken, "the other host's number");
        assert_eq!(sessions.offer(12, 3000), (second, 5), "still on offer");
        assert_eq!(sessions.admit(order(second, 5)), Repeated);
        assert_eq!(sessions.admit(order(second, 6)), Taken);
        sessions.note(order(second, 2));
        assert_eq!(
            sessions.admit(order(second, 6)),
            Repeated,
            "an older number outdates nothing"
        );
    }

    #[test]
    fn a_replayed_question_gets_another_session() {
        let (recorded, _) = Sessions::new(1).offer(11, 1000);
        assert_ne!(Sessions::new(1).offer(11, 1001).0, recorded, "at another time");
        assert_ne!(Sessions::new(2).offer(11, 1000).0, recorded, "on another board or boot");
    }

    #[test]
    fn an_order_is_late_by_its_age_and_by_a_clock_ahead() {
        assert!(!is_late(1_000_000, 1_250_000));
        assert!(is_late(1_000_000, 1_250_001));
        assert!(!is_late(1_010_000, 1_000_000));
        assert!(is_late(1_010_001, 1_000_000));
    }
}
