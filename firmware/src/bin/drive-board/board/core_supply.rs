//! The supply of the core, before anything writes the RAM: the firmware and the boot loader begin with it alike.
//!
//! After a power-on the part is in Run*: until its software has configured the supply and the flag ACTVOSRDY tells that the
//! core's voltage is valid, "write accesses to the RAMs are not permitted" (RM0433 6.4.1, "System supply startup", step 5), and
//! neither is a change of the voltage's scale. ST's start-up code does the same before its first store (`ExitRun0Mode`). A start
//! that keeps the supply waits too: the reset takes the scale back, and the flag follows.
//!
//! A wait for a voltage that never is valid never ends. Nothing else may run then, the pins are as the reset has left them,
//! and a reset would do no more than wait again: no watchdog guards it.
//!
//! This is assembly for the reason of the RAM's start-up: no Rust may run before the RAM does. It needs no stack.

use core::arch::global_asm;

/// The power controller.
const PWR: u32 = 0x5802_4800;
/// Its register of the supply's configuration, PWR_CR3, which is written once after a power-on: later writes change nothing.
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
