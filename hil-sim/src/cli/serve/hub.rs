//! Decides which client of a board drives, and what each client may send to the board.

use std::collections::BTreeMap;

use firmware::protocol::frame::{Decoder, Received, encode};
use firmware::protocol::message::{Answer, BoardMessage, HostMessage, Refusal};

/// Number of a client, in the order of connection.
pub type ClientId = u64;

/// Result of a client's bytes.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// Bytes for the board.
    pub to_board: Vec<u8>,
    /// Bytes for the client itself.
    pub to_client: Vec<u8>,
    /// The client has become the operator.
    pub became_operator: bool,
}

/// The clients of one board. The first client that gives an order is the operator until it leaves. Every other client
/// may ask for the board's identity, receive the board's messages, and disarm.
#[derive(Debug, Default)]
pub struct Hub {
    clients: BTreeMap<ClientId, Decoder>,
    operator: Option<ClientId>,
}

impl Hub {
    /// The client that drives.
    #[cfg(test)]
    fn operator(&self) -> Option<ClientId> {
        self.operator
    }

    /// Removes a client; returns whether it was the operator. For the board, the operator has fallen silent.
    pub fn leave(&mut self, client: ClientId) -> bool {
        self.clients.remove(&client);
        let was = self.operator == Some(client);
        if was {
            self.operator = None;
        }
        was
    }

    /// Takes what a client sent.
    pub fn take(&mut self, client: ClientId, bytes: &[u8]) -> Outcome {
        let mut outcome = Outcome::default();
        let decoder = self.clients.entry(client).or_default();
        for byte in bytes {
            // Bytes that are not a message are dropped: on the shared wire they would damage another client's frame.
            let Received::Message(message) = decoder.push::<HostMessage>(*byte) else {
                continue;
            };
            if let HostMessage::Order { envelope, .. } = &message {
                if self.operator.is_none() {
                    self.operator = Some(client);
                    outcome.became_operator = true;
                }
                if self.operator != Some(client) {
                    let answer = BoardMessage::Answer {
                        id: envelope.id,
                        answer: Answer::Refused(Refusal::UnknownSession),
                    };
                    if let Ok(frame) = encode(&answer) {
                        outcome.to_client.extend(&frame);
                    }
                    continue;
                }
            }
            if let Ok(frame) = encode(&message) {
                outcome.to_board.extend(&frame);
            }
        }
        outcome
    }
}

#[cfg(test)]
mod tests {
    use firmware::protocol::message::{Envelope, Order, OrderId};
    use model::command::Request;

    use super::*;

    fn order(sequence: u32) -> Vec<u8> {
        let id = OrderId { session: 7, sequence };
        let message = HostMessage::Order {
            envelope: Envelope { id, given_at_us: 0 },
            order: Order::Request(Request::Arm),
        };
        encode(&message).expect("fits").to_vec()
    }

    fn frame(message: &HostMessage) -> Vec<u8> {
        encode(message).expect("fits").to_vec()
    }

    #[test]
    fn the_first_who_orders_drives_until_it_leaves() {
        let mut hub = Hub::default();
        let identify = frame(&HostMessage::Identify { nonce: 3 });
        assert_eq!(hub.take(1, &identify).to_board, identify);
        assert_eq!(hub.operator(), None);
        assert!(hub.take(2, &order(1)).became_operator);
        assert_eq!(hub.operator(), Some(2));
        // The other client receives a refusal with the reason, and the board receives nothing.
        let outcome = hub.take(1, &order(5));
        assert!(outcome.to_board.is_empty() && !outcome.became_operator);
        let mut decoder = Decoder::new();
        let told = outcome.to_client.iter().map(|byte| decoder.push(*byte)).last();
        let id = OrderId {
            session: 7,
            sequence: 5,
        };
        let answer = Answer::Refused(Refusal::UnknownSession);
        assert_eq!(told, Some(Received::Message(BoardMessage::Answer { id, answer })));
        assert!(!hub.leave(1) && hub.leave(2));
        assert_eq!(hub.take(3, &order(1)).to_board, order(1));
        assert_eq!(hub.operator(), Some(3));
    }

    #[test]
    fn anybody_may_disarm_and_noise_reaches_nobody() {
        let mut hub = Hub::default();
        hub.take(1, &order(1));
        let disarm = frame(&HostMessage::Disarm(OrderId {
            session: 0,
            sequence: 1,
        }));
        assert_eq!(hub.take(2, &disarm).to_board, disarm);
        assert_eq!(hub.take(3, &[0, 1, 2, 3, 0, 255, 0]), Outcome::default());
        // Half a frame of one client does not mix with another client's bytes.
        let whole = frame(&HostMessage::Identify { nonce: 9 });
        let (head, rest) = whole.split_at(3);
        assert!(hub.take(2, head).to_board.is_empty());
        assert_eq!(hub.take(3, &disarm).to_board, disarm);
        assert_eq!(hub.take(2, rest).to_board, whole);
    }
}
