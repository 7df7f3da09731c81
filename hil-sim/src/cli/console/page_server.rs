//! Serves the page's files over HTTP, only to this machine: a fixed list, read again at each request.

use std::fs;
use std::io::{self, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use report::error::CommandError;

use crate::cli::serve::websocket::is_local_host;

const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";
/// The name of the module on the page.
const MODULE: &str = "console.wasm";

/// Every file of the page, and its type.
const FILES: [(&str, &str); 16] = [
    ("index.html", "text/html; charset=utf-8"),
    ("style.css", STYLE),
    ("main.js", SCRIPT),
    ("link.js", SCRIPT),
    ("module.js", SCRIPT),
    ("operator.js", SCRIPT),
    ("panels.js", SCRIPT),
    ("parameters.js", SCRIPT),
    ("plots.js", SCRIPT),
    ("records.js", SCRIPT),
    ("transports.js", SCRIPT),
    ("view.js", SCRIPT),
    ("worker.js", SCRIPT),
    ("world.js", SCRIPT),
    ("vendor/uPlot.iife.min.js", SCRIPT),
    ("vendor/uPlot.min.css", STYLE),
];

/// The page's permissions: its own scripts and module, and WebSockets to boards. Nothing from other
/// origins.
const POLICY: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data:; \
                      connect-src 'self' ws: wss:; worker-src 'self'; base-uri 'none'; form-action 'none'; \
                      frame-ancestors 'none'";
/// Largest size of a request, bytes.
const QUESTION_MAX: usize = 8192;
/// Time within which a browser must send its request, and take each part of the answer.
const CLIENT_PATIENCE: Duration = Duration::from_secs(5);

/// The files of the page.
#[derive(Debug)]
pub struct PageServer {
    page: PathBuf,
    module: PathBuf,
}

/// An answer: status, type and bytes.
type HttpAnswer = (&'static str, &'static str, Vec<u8>);

impl PageServer {
    /// Serves the files of `page` and the module.
    ///
    /// # Errors
    /// [`CommandError::Input`]: a file is missing.
    pub fn new(page: PathBuf, module: PathBuf) -> Result<Self, CommandError> {
        let server = Self { page, module };
        let names = FILES.iter().map(|(name, _)| *name).chain([MODULE]);
        for (name, path) in names.filter_map(|name| Some((name, server.file(name)?.0))) {
            fs::metadata(&path).map_err(|error| CommandError::Input(format!("{name}: {}: {error}", path.display())))?;
        }
        Ok(server)
    }

    /// Path and type of the file with this name; `None` if the list does not contain the name.
    fn file(&self, name: &str) -> Option<(PathBuf, &'static str)> {
        if name == MODULE {
            return Some((self.module.clone(), "application/wasm"));
        }
        let (name, kind) = FILES.iter().find(|(file, _)| *file == name)?;
        Some((self.page.join(name), kind))
    }

    /// Answers every browser that connects.
    pub fn serve(self, listener: &TcpListener) {
        let server = Arc::new(self);
        for stream in listener.incoming().flatten() {
            let server = server.clone();
            thread::spawn(move || {
                // A browser that disconnects during the answer is ignored.
                let _ = server.answer_one(stream);
            });
        }
    }

    fn answer_one(&self, mut stream: TcpStream) -> io::Result<()> {
        stream.set_read_timeout(Some(CLIENT_PATIENCE))?;
        stream.set_write_timeout(Some(CLIENT_PATIENCE))?;
        let mut question = Vec::new();
        let mut bytes = [0; 1024];
        while !question.windows(4).any(|end| end == b"\r\n\r\n") {
            let length = stream.read(&mut bytes)?;
            if length == 0 || question.len() + length > QUESTION_MAX {
                return Ok(());
            }
            question.extend(&bytes[..length]);
        }
        let question = String::from_utf8_lossy(&question);
        let (status, kind, body) = self.answer(&question);
        let length = body.len();
        write!(
            stream,
            "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\nContent-Security-Policy: {POLICY}\r\n\
             X-Content-Type-Options: nosniff\r\nCache-Control: no-store\r\nConnection: close\r\n\r\n"
        )?;
        if question.starts_with("GET ") {
            stream.write_all(&body)?;
        }
        stream.flush()
    }

    fn answer(&self, question: &str) -> HttpAnswer {
        const TEXT: &str = "text/plain; charset=utf-8";
        let refused = |status, why: &str| (status, TEXT, format!("{why}\n").into_bytes());
        let mut words = question.lines().next().unwrap_or_default().split(' ');
        let (Some(method), Some(target)) = (words.next(), words.next()) else {
            return refused("400 Bad Request", "no question");
        };
        // A page from another origin that calls this machine by another name does not belong to this
        // server.
        let mut fields = question.lines().skip(1).filter_map(|line| line.split_once(':'));
        let host = fields.find(|(name, _)| name.eq_ignore_ascii_case("host"));
        if !host.is_some_and(|(_, host)| is_local_host(host.trim())) {
            return refused("403 Forbidden", "this page is for this machine alone");
        }
        if method != "GET" && method != "HEAD" {
            return refused("405 Method Not Allowed", "only GET");
        }
        let path = target.split('?').next().unwrap_or_default();
        let name = if path == "/" {
            "index.html"
        } else {
            path.trim_start_matches('/')
        };
        let Some((file, kind)) = self.file(name) else {
            return refused("404 Not Found", "no such file of the page");
        };
        match fs::read(&file) {
            Ok(bytes) => ("200 OK", kind, bytes),
            Err(error) => refused("500 Internal Server Error", &error.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn server() -> PageServer {
        let page = hil_elf::root().join("hil-sim/console/page");
        let module = page.join("module.js");
        PageServer::new(page, module).expect("every file of the list is there")
    }

    fn status(question: &str) -> &'static str {
        server().answer(question).0
    }

    #[test]
    fn the_list_has_every_file_of_the_page() {
        let page = server().page;
        let mut found = Vec::new();
        for folder in ["", "vendor/"] {
            for entry in fs::read_dir(page.join(folder)).expect("a folder") {
                let name = entry.expect("readable").file_name().into_string().expect("text");
                if [".html", ".js", ".css"].iter().any(|end| name.ends_with(end)) {
                    found.push(format!("{folder}{name}"));
                }
            }
        }
        let mut listed: Vec<_> = FILES.iter().map(|(name, _)| (*name).to_owned()).collect();
        found.sort();
        listed.sort();
        assert_eq!(found, listed);
    }

    #[test]
    fn nothing_but_the_list_is_served() {
        let asked = |target: &str| status(&format!("GET {target} HTTP/1.1\r\nHost: localhost:5780\r\n\r\n"));
        for good in [
            "/",
            "/index.html",
            "/main.js?new",
            "/vendor/uPlot.min.css",
            "/console.wasm",
        ] {
            assert_eq!(asked(good), "200 OK", "{good}");
        }
        for bad in [
            "/vendor",
            "/vendor/",
            "/../Cargo.toml",
            "/vendor/../../Cargo.toml",
            "/%2e%2e/Cargo.toml",
            "/vendor/uPlot-LICENSE",
            "/etc/passwd",
            "//etc/passwd",
            "/index.html/",
        ] {
            assert_eq!(asked(bad), "404 Not Found", "{bad}");
        }
    }

    #[test]
    fn only_this_machine_is_answered() {
        for (host, expected) in [
            ("Host: 127.0.0.1:5780\r\n", "200 OK"),
            ("host: LOCALHOST\r\n", "200 OK"),
            ("Host: example.com\r\n", "403 Forbidden"),
            ("Host: 127.0.0.1.example.com:5780\r\n", "403 Forbidden"),
            ("", "403 Forbidden"),
        ] {
            assert_eq!(status(&format!("GET / HTTP/1.1\r\n{host}\r\n")), expected, "{host}");
        }
        assert_eq!(
            status("POST / HTTP/1.1\r\nHost: localhost\r\n\r\n"),
            "405 Method Not Allowed"
        );
        assert_eq!(status("GET\r\n\r\n"), "400 Bad Request");
    }
}
