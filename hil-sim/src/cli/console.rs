//! `hil-sim console`: serves the console's page to a browser of this machine.

use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use clap::Args;
use hil_elf::{root, without_package_variables};
use report::error::CommandError;
use report::output::print;

mod page_server;

use page_server::PageServer;

/// Flags of `console`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Port on this machine; 0 lets the system choose
    #[arg(long, default_value_t = 5780)]
    port: u16,
    /// Open the page in the browser; `cargo console` does
    #[arg(long, overrides_with = "open")]
    open: bool,
    /// The page's WebAssembly, already built; built now if left out
    #[arg(long, value_name = "FILE")]
    module: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Examples:
  cargo console
  hil-sim console --open
  hil-sim serve --websocket 127.0.0.1:5761";

/// The target of the page's module.
const WASM_TARGET: &str = "wasm32-unknown-unknown";
/// The module's build profile: release without debug information.
const PROFILE: &str = "page";

/// Serves the page until Ctrl-C.
///
/// # Errors
/// [`CommandError::Input`]: the port is taken, or the toolchain has no target for the module; [`CommandError::Other`]: the
/// module cannot be built.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let address = SocketAddr::from((Ipv4Addr::LOCALHOST, arguments.port));
    let wrong = |error: std::io::Error| CommandError::Input(format!("--port {}: {error}", arguments.port));
    let listener = TcpListener::bind(address).map_err(wrong)?;
    let bound = listener.local_addr().map_err(wrong)?;
    let module = match &arguments.module {
        Some(file) => file.clone(),
        None => build()?,
    };
    let server = PageServer::new(root().join("hil-sim/console/page"), module)?;
    let url = format!("http://{bound}/");
    print(&format!("console at {url}\n"))?;
    if arguments.open {
        // In a separate thread, because the browser requests the page before the opener ends.
        std::thread::spawn(move || {
            if !open(&url) {
                // The server keeps running if the output is closed.
                let _ = print("no browser could be started: open the address yourself\n");
            }
        });
    }
    server.serve(&listener);
    Ok(())
}

/// Builds the module with the installed toolchain; returns the file.
fn build() -> Result<PathBuf, CommandError> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    if !has_target() {
        return Err(CommandError::Input(format!(
            "the toolchain has no {WASM_TARGET}: `rustup target add {WASM_TARGET}` adds it"
        )));
    }
    let mut command = Command::new(cargo);
    without_package_variables(&mut command);
    command.args([
        "build",
        "--profile",
        PROFILE,
        "-p",
        "vehicle-console",
        "--target",
        WASM_TARGET,
    ]);
    command.current_dir(root()).stdout(Stdio::null());
    let status = command
        .status()
        .map_err(|error| CommandError::Other(format!("cargo does not start: {error}")))?;
    if !status.success() {
        return Err(CommandError::Other("the page's module could not be built".into()));
    }
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from);
    Ok(target.join(WASM_TARGET).join(PROFILE).join("vehicle_console.wasm"))
}

/// Whether the toolchain has the target's library. If that cannot be determined, the build
/// decides.
fn has_target() -> bool {
    let asked = Command::new("rustc")
        .args(["--print", "sysroot"])
        .current_dir(root())
        .output();
    asked.map_or(true, |output| {
        let sysroot = String::from_utf8_lossy(&output.stdout).into_owned();
        Path::new(sysroot.trim()).join("lib/rustlib").join(WASM_TARGET).exists()
    })
}

/// Opens an address in the browser; returns whether a browser started.
fn open(url: &str) -> bool {
    let opener: &[&str] = if cfg!(target_os = "macos") {
        &["open"]
    } else if cfg!(windows) {
        &["cmd", "/c", "start"]
    } else {
        &["xdg-open"]
    };
    let mut command = Command::new(opener[0]);
    command.args(&opener[1..]).arg(url);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}
