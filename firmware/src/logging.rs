//! One set of log macros: defmt on the board, `log` on the host (defmt does not link there).

#[cfg(target_os = "none")]
macro_rules! info { ($($a:tt)*) => { defmt::info!($($a)*) } }
#[cfg(not(target_os = "none"))]
macro_rules! info { ($($a:tt)*) => { log::info!($($a)*) } }

#[cfg(target_os = "none")]
macro_rules! warning { ($($a:tt)*) => { defmt::warn!($($a)*) } }
#[cfg(not(target_os = "none"))]
macro_rules! warning { ($($a:tt)*) => { log::warn!($($a)*) } }
