//! The RAM after power-up, before anything reads it.
//!
//! Every word of the AXI SRAM (64 bits) and of the DTCM (32 bits) has check bits for error correction. Power-up leaves
//! words and check bits at random, so a read of a word that nothing wrote, and a write of a part of such a word, find
//! an uncorrectable error. The board ties these errors to the bridges' break and locks the tie
//! ([`super::guard_outputs`]): one speculative read of such a word would trip the break. Therefore every word is
//! written in full before the first one is read, by the first instructions after the reset. A reset that keeps the
//! supply keeps the RAM, and with it what the last run left ([`super::crash`], [`super::boot_number`]).
//!
//! This is assembly because no Rust may run before the RAM is initialised.

use core::arch::global_asm;

global_asm!(
    ".section .text.__pre_init, \"ax\", %progbits",
    ".global __pre_init",
    ".type __pre_init, %function",
    ".thumb_func",
    "__pre_init:",
    // RCC_RSR: PORRSTF (bit 23) and BORRSTF (bit 21) tell that the supply came up. Start-up clears them later.
    "movw r0, #0x44D0",
    "movt r0, #0x5802",
    "ldr r0, [r0]",
    "tst r0, #0x00A00000",
    "beq 4f",
    "movs r2, #0",
    "movs r3, #0",
    "movw r0, #:lower16:_ram_start",
    "movt r0, #:upper16:_ram_start",
    "movw r1, #:lower16:_ram_end",
    "movt r1, #:upper16:_ram_end",
    "b 3f",
    "2:",
    "strd r2, r3, [r0], #8",
    "strd r2, r3, [r0], #8",
    "strd r2, r3, [r0], #8",
    "strd r2, r3, [r0], #8",
    "3:",
    "cmp r0, r1",
    "blo 2b",
    "movw r0, #:lower16:_dtcm_start",
    "movt r0, #:upper16:_dtcm_start",
    "movw r1, #:lower16:_dtcm_end",
    "movt r1, #:upper16:_dtcm_end",
    "b 6f",
    "5:",
    "strd r2, r3, [r0], #8",
    "strd r2, r3, [r0], #8",
    "strd r2, r3, [r0], #8",
    "strd r2, r3, [r0], #8",
    "6:",
    "cmp r0, r1",
    "blo 5b",
    "dsb",
    "4:",
    "bx lr",
);
