//! Initialises the DTCM, which contains the boot loader's stack and variables, before anything reads it. Power-up leaves
//! words and check bits at random, and a partial write of such a word would cause an error. The firmware keeps nothing
//! there over a reset. The RAM accepts no writes before the core's supply has settled ([`super::core_supply`]).

use core::arch::global_asm;

global_asm!(
    ".section .text.__pre_init, \"ax\", %progbits",
    ".global __pre_init",
    ".type __pre_init, %function",
    ".thumb_func",
    "__pre_init:",
    // Nothing is pushed, because this code overwrites the stack.
    "mov r12, lr",
    "bl __settle_core_supply",
    "movw r0, #:lower16:_dtcm_start",
    "movt r0, #:upper16:_dtcm_start",
    "movw r1, #:lower16:_dtcm_end",
    "movt r1, #:upper16:_dtcm_end",
    "movs r2, #0",
    "movs r3, #0",
    "2:",
    "strd r2, r3, [r0], #8",
    "cmp r0, r1",
    "blo 2b",
    "dsb",
    "bx r12",
);
