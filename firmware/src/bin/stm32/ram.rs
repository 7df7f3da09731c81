//! Initialises and tests the RAM after power-up, before anything reads it.
//!
//! On the STM32H7 every word of the AXI SRAM (64 bits) and of the DTCM (32 bits) has check bits for error correction.
//! Power-up leaves words and check bits at random, so a read or a partial write of an unwritten word causes an
//! uncorrectable error. The board connects these errors to the bridges' break and locks the connection
//! (`guard_outputs`), so one speculative read of such a word would trip the break. The first instructions after the
//! reset therefore write every word in full before the first read. A reset without a loss of supply keeps the RAM and
//! the data of the last run ([`super::crash`], [`super::boot_number`]).
//!
//! The same instructions test every word, which is possible only now, while the RAM is unused. A march in three passes
//! writes a pattern that differs from word to word, checks it and writes its complement, and checks the complement from
//! the end to the start. The test detects stuck bits, and address lines that select the wrong word. It takes two
//! million instructions, some 0.1 s at the 64 MHz after a reset of the STM32H7, less than a second at the 16 MHz of the
//! STM32F7. [`RAM_TEST`] keeps the result until the supply fails.
//!
//! The RAM accepts no writes before the core's supply has settled, so [`crate::board::core_supply`] runs first.
//!
//! The code is assembly because no Rust code may run before the RAM is initialised. It pushes nothing, because the
//! stack is part of the tested RAM.

use core::arch::global_asm;
use core::mem::MaybeUninit;

use crate::board::reset_cause;

/// Value of [`RAM_TEST`] after a successful test. Any other value is a failure, even if only this word itself fails.
const PASSED: [u32; 2] = [0x5A17_3C6E, 0x92D4_B80F];

/// The result of the test: a word of the RAM in full.
#[repr(C, align(8))]
struct TestResult(MaybeUninit<[u32; 2]>);

/// Kept over resets that keep the supply.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".uninit.ram_test")]
static mut RAM_TEST: TestResult = TestResult(MaybeUninit::uninit());

/// Whether each word of the RAM passed the test when the supply came up.
pub fn keeps_what_is_written() -> bool {
    // SAFETY: only the first instructions after a reset write it. It consists of plain integers, for which any bits are
    // a value, and power-up wrote it.
    let result = unsafe { core::ptr::read_volatile((&raw const RAM_TEST).cast::<[u32; 2]>()) };
    result == PASSED
}

global_asm!(
    ".section .text.__pre_init, \"ax\", %progbits",
    ".global __pre_init",
    ".type __pre_init, %function",
    ".thumb_func",
    "__pre_init:",
    "mov r12, lr",
    "bl __settle_core_supply",
    // The register of the reset's causes. Start-up clears its bits later.
    "movw r0, #({register} & 0xFFFF)",
    "movt r0, #({register} >> 16)",
    "ldr r0, [r0]",
    "tst r0, #{supply_came_up}",
    "beq 9f",
    // The pattern of a word is its address combined with this constant; r9 collects the differences.
    "movw r7, #0xA5C3",
    "movt r7, #0x5A3C",
    "movs r9, #0",
    "movs r10, #0",
    "movs r11, #0",
    "movw r0, #:lower16:_ram_start",
    "movt r0, #:upper16:_ram_start",
    "movw r1, #:lower16:_ram_end",
    "movt r1, #:upper16:_ram_end",
    "bl 4f",
    "movw r0, #:lower16:_dtcm_start",
    "movt r0, #:upper16:_dtcm_start",
    "movw r1, #:lower16:_dtcm_end",
    "movt r1, #:upper16:_dtcm_end",
    "bl 4f",
    "cmp r9, #0",
    "bne 8f",
    "movw r0, #:lower16:RAM_TEST",
    "movt r0, #:upper16:RAM_TEST",
    "ldr r2, ={passed_0}",
    "ldr r3, ={passed_1}",
    "strd r2, r3, [r0]",
    "8:",
    "dsb",
    "9:",
    "bx r12",
    ".ltorg",
    // The march over [r0, r1), which leaves zeros.
    "4:",
    "mov r4, r0",
    "5:",
    "eor r2, r4, r7",
    "mvn r3, r2",
    "strd r2, r3, [r4], #8",
    "cmp r4, r1",
    "blo 5b",
    "mov r4, r0",
    "6:",
    "eor r2, r4, r7",
    "mvn r3, r2",
    "ldrd r5, r6, [r4]",
    "eor r5, r5, r2",
    "eor r6, r6, r3",
    "orr r9, r9, r5",
    "orr r9, r9, r6",
    "strd r3, r2, [r4], #8",
    "cmp r4, r1",
    "blo 6b",
    "7:",
    "sub r4, r4, #8",
    "eor r2, r4, r7",
    "mvn r3, r2",
    "ldrd r5, r6, [r4]",
    "eor r5, r5, r3",
    "eor r6, r6, r2",
    "orr r9, r9, r5",
    "orr r9, r9, r6",
    "strd r10, r11, [r4]",
    "cmp r4, r0",
    "bhi 7b",
    "bx lr",
    register = const reset_cause::REGISTER,
    supply_came_up = const reset_cause::SUPPLY_CAME_UP,
    passed_0 = const PASSED[0],
    passed_1 = const PASSED[1],
);
