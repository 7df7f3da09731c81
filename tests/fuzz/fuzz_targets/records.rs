//! Any bytes as a block of records: reading ends, and what was read encodes to the same records again.
#![no_main]

use firmware::flight_record::FlightRecord;
use firmware::records::codec::{BlockEncoder, Records};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let records: Vec<FlightRecord> = Records::new(bytes).map_while(Result::ok).collect();
    let mut encoder = BlockEncoder::new();
    let mut again = Vec::new();
    let mut read = |bytes: &[u8]| again.extend(Records::new(bytes).map(|record| record.expect("as written")));
    for record in &records {
        encoder.push(record, |block| read(&block.bytes));
    }
    encoder.flush(|block| read(&block.bytes));
    assert_eq!(format!("{again:?}"), format!("{records:?}"));
});
