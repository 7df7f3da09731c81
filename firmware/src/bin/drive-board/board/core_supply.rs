//! Waits for the core's supply before anything writes the RAM. Both the firmware and the boot loader begin with
//! this code.
//!
//! After a power-on the part is in Run*: until the software has configured the supply and the flag ACTVOSRDY
//! shows that the core's voltage is valid, "write accesses to the RAMs are not permitted" (RM0433 6.4.1, "System
//! supply startup", step 5), and neither is a change of the voltage's scale. ST's start-up code does the same
//! before its first store (`ExitRun0Mode`). A start without a loss of supply waits, too: the reset restores the
//! voltage's scale, and the flag follows.
//!
//! If the voltage never becomes valid, the wait never ends. No other code may run then, the pins are in their
//! reset state, and a reset would only repeat the wait, so no watchdog guards this code.
//!
//! The code is assembly for the same reason as the RAM's start-up code: no Rust code may run before the RAM
//! works. It needs no stack.

use core::arch::global_asm;

/// The power controller.
const PWR: u32 = 0x5802_4800;
/// Its supply configuration register, PWR_CR3. Only the first write after a power-on has an effect.
const SUPPLY: u32 = 0x0C;
/// Regulator bypassed.
const BYPASS: u32 = 1 << 0;
/// SCUEN and LDOEN: the core is supplied by the regulator, as the NUCLEO-H743ZI is wired.
const REGULATOR: u32 = 1 << 2 | 1 << 1;
/// Its status, PWR_CSR1.
const STATUS: u32 = 0x04;
/// ACTVOSRDY.
const VOLTAGE_VALID: u32 = 1 << 13;

global_asm!(
    ".section .text.__settle_core_supply, \"ax\", %progbits",
    ".global __settle_core_supply",
    ".type __settle_core_supply, %function",
    ".thumb_func",
    "__settle_core_supply:",
    "ldr r0, ={pwr}",
    "ldr r1, [r0, #{supply}]",
    "bic r1, r1, #{bypass}",
    "orr r1, r1, #{regulator}",
    "str r1, [r0, #{supply}]",
    "2:",
    "ldr r1, [r0, #{status}]",
    "tst r1, #{voltage_valid}",
    "beq 2b",
    "bx lr",
    ".ltorg",
    pwr = const PWR,
    supply = const SUPPLY,
    bypass = const BYPASS,
    regulator = const REGULATOR,
    status = const STATUS,
    voltage_valid = const VOLTAGE_VALID,
);
