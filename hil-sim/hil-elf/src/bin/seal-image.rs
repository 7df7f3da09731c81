//! `seal-image ELF`: writes the checksum of a firmware's image into its ELF.

use std::process::ExitCode;

use hil_elf::seal::seal;

fn main() -> ExitCode {
    let Some(path) = std::env::args_os().nth(1) else {
        eprintln!("usage: seal-image ELF");
        return ExitCode::from(2);
    };
    let sealed = std::fs::read(&path).and_then(|mut elf| {
        let before = elf.clone();
        let image = seal(&mut elf).map_err(std::io::Error::other)?;
        if elf != before {
            std::fs::write(&path, elf)?;
        }
        Ok(image)
    });
    match sealed {
        Ok(image) => {
            let [major, minor, patch] = image.version;
            eprintln!(
                "seal-image: firmware {major}.{minor}.{patch}, build {:08x}, {} bytes, checksum {:08x}",
                image.build, image.length, image.checksum
            );
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("seal-image: {}: {error}", path.to_string_lossy());
            ExitCode::FAILURE
        }
    }
}
