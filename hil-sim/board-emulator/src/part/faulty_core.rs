//! A core with bad memory. The emulator's own memories never go bad.
//!
//! The emulated core sends its accesses to chosen pages to its bus instead of to the memory. [`FaultyBus`] answers
//! there as the part does. A word that the flash's error correction cannot restore sets the flag of its bank and fails
//! on the bus. Stuck bits of the RAM read as ones. Instruction fetches are not affected.

use std::sync::Arc;

use rigless::emulator::{
    Access, AccessKind, CoreBus, DataModel, Error, Exit, HostCall, InterruptLine, Processor, ProcessorConstructor,
    Queued,
};
use rigless::soc::{Endian, Width};
use rigless::time::VirtualNanos;

use super::setup::MemoryFault;

/// Status registers of the flash's banks, and the registers that clear their flags.
const FLASH_STATUS: [u64; 2] = [0x5200_2010, 0x5200_2110];
const CLEAR: [u64; 2] = [0x5200_2014, 0x5200_2114];
/// Flag of an uncorrectable error, in both registers.
const UNCORRECTABLE: u64 = 1 << 26;
/// Start address of the second bank.
const SECOND_BANK: u64 = 0x0810_0000;

/// The constructor of a core with bad memory.
pub fn constructor(sound: ProcessorConstructor, fault: MemoryFault) -> ProcessorConstructor {
    Arc::new(move |endian| {
        Ok(Box::new(FaultyCore {
            core: sound(endian)?,
            routed: false,
            fault,
            raised: [false; 2],
        }))
    })
}

/// A core whose memory has gone bad.
#[derive(Debug)]
struct FaultyCore {
    core: Box<dyn Processor>,
    /// Whether the core sends its accesses to the bad words to the bus.
    routed: bool,
    fault: MemoryFault,
    /// Flags of the flash's banks.
    raised: [bool; 2],
}

/// The bus of such a core.
struct FaultyBus<'a> {
    bus: &'a mut dyn CoreBus,
    fault: MemoryFault,
    raised: &'a mut [bool; 2],
}

impl CoreBus for FaultyBus<'_> {
    fn access(&mut self, access: Access, from_code: bool) -> Option<u64> {
        let (at, end) = (access.address, access.address + u64::from(access.width.bytes()));
        if access.kind == AccessKind::Write {
            if let Some(bank) = CLEAR.iter().position(|register| *register == at)
                && access.value & UNCORRECTABLE != 0
            {
                self.raised[bank] = false;
            }
            return self.bus.access(access, from_code);
        }
        if let MemoryFault::Unreadable {
            first,
            bytes,
            since,
            until,
        } = self.fault
            && at < first + bytes
            && end > first
            && (since..until).contains(&access.virtual_time.0)
        {
            self.raised[usize::from(at >= SECOND_BANK)] = true;
            return None;
        }
        let mut value = self.bus.access(access, from_code)?;
        if let MemoryFault::Stuck { address, bits } = self.fault {
            for (n, stuck) in (address..).zip(bits.to_le_bytes()) {
                if (at..end).contains(&n) {
                    value |= u64::from(stuck) << (8 * (n - at));
                }
            }
        }
        for (register, raised) in FLASH_STATUS.into_iter().zip(&*self.raised) {
            if at == register && *raised {
                value |= UNCORRECTABLE;
            }
        }
        Some(value)
    }

    fn time(&self, instructions: u64) -> VirtualNanos {
        self.bus.time(instructions)
    }

    fn queued(&mut self) -> Vec<Queued> {
        self.bus.queued()
    }

    fn carry_on(&mut self, instructions: u64, event: Option<VirtualNanos>) -> Option<u32> {
        self.bus.carry_on(instructions, event)
    }

    fn acknowledge(&mut self, line: InterruptLine, instructions: u64) -> Option<u64> {
        self.bus.acknowledge(line, instructions)
    }

    fn send_trace(&mut self, bytes: &[u8]) {
        self.bus.send_trace(bytes);
    }
}

impl Processor for FaultyCore {
    fn run(&mut self, budget: u32, bus: &mut dyn CoreBus) -> (Exit, u64) {
        if !self.routed {
            self.routed = true;
            let (first, bytes) = self.fault.words();
            for page in (first..first + bytes).step_by(self.core.page_size() as usize) {
                self.core.ask(Queued::Route(page));
            }
            self.core.ask(Queued::Route(first + bytes - 1));
        }
        let mut bus = FaultyBus {
            bus,
            fault: self.fault,
            raised: &mut self.raised,
        };
        self.core.run(budget, &mut bus)
    }

    fn retired(&self) -> u64 {
        self.core.retired()
    }

    fn ask(&mut self, queued: Queued) {
        self.core.ask(queued);
    }

    fn maps(&self, start: u64, length: u64) -> bool {
        self.core.maps(start, length)
    }

    fn page_size(&self) -> u64 {
        self.core.page_size()
    }

    #[expect(unsafe_code, reason = "the trait has no other way to pass memory on")]
    unsafe fn map(&mut self, start: u64, length: u64, host: *mut u8, writable: bool) {
        // SAFETY: the caller guarantees for the memory what the inner core requires, and the inner core is dropped
        // together with this core.
        unsafe { self.core.map(start, length, host, writable) }
    }

    fn boot(&mut self, table: u64, read: &dyn Fn(u64, Width) -> Option<u64>) {
        self.core.boot(table, read);
    }

    fn reset(&mut self) {
        self.raised = [false; 2];
        self.core.reset();
    }

    fn take_reset_request(&mut self) -> bool {
        self.core.take_reset_request()
    }

    fn next_event(&self) -> Option<VirtualNanos> {
        self.core.next_event()
    }

    fn on_event(&mut self, now: VirtualNanos) {
        self.core.on_event(now);
    }

    fn waiting(&self) -> bool {
        self.core.waiting()
    }

    fn pc(&self) -> u64 {
        self.core.pc()
    }

    fn data_model(&self) -> DataModel {
        self.core.data_model()
    }

    fn byte_order(&self, address: u64) -> Endian {
        self.core.byte_order(address)
    }

    fn save(&self) -> Vec<u8> {
        self.core.save()
    }

    fn load(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.core.load(bytes)
    }

    fn host_call(&self, read: &mut dyn FnMut(u64, Width) -> Option<u64>) -> Option<HostCall> {
        self.core.host_call(read)
    }

    fn answer_host_call(&mut self, answer: Option<u64>) {
        self.core.answer_host_call(answer);
    }
}
