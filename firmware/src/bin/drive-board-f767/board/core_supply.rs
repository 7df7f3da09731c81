//! The supply of the core. The STM32F7 has no mode in which its RAM accepts no writes, so there is nothing to
//! wait for.

use core::arch::global_asm;

global_asm!(
    ".section .text.__settle_core_supply, \"ax\", %progbits",
    ".global __settle_core_supply",
    ".type __settle_core_supply, %function",
    ".thumb_func",
    "__settle_core_supply:",
    "bx lr",
);
