//! A folder for each test, and the command run in it.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output};

use tempfile::TempDir;

/// A block falls on the ground: small enough to run in every test.
pub(crate) const FALL: &str = r#"
version = 1
title = "A fall"
dimension = 2
gravity = [0.0, -9.81]

[time]
end = "20 ms"

[[material]]
name = "rock"
young_modulus = "1 GPa"
poisson_ratio = 0.2
density = 2700.0

[[block]]
name = "ground"
shape = { box = { min = [-1.0, -1.0], max = [2.0, 0.0], divisions = [3, 1] } }
element = "quad4"
material = "rock"
fixed = true

[[block]]
name = "stone"
shape = { box = { min = [0.0, 0.001], max = [1.0, 0.501], divisions = [4, 2] } }
element = "quad4"
material = "rock"
velocity = [0.0, -1.0]

[contact]
model = "unified-node"

[output]
frames = 4
history = 10
blocks = 10

[[probe]]
name = "corner"
block = "stone"
point = [0.0, 0.0]
"#;

pub(crate) struct Place(TempDir);

impl Place {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    /// Creates a folder with `scene.toml`.
    pub(crate) fn with_scene(text: &str) -> Self {
        let place = Self::new();
        place.write("scene.toml", text);
        place
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).expect("a writable folder");
    }

    pub(crate) fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).expect(name)
    }

    /// Returns the names in a folder, sorted.
    pub(crate) fn names(&self, folder: &str) -> Vec<String> {
        names(&self.path(folder))
    }

    /// Returns the command, to be run in this folder.
    pub(crate) fn command<S: AsRef<OsStr>>(
        &self,
        arguments: impl IntoIterator<Item = S>,
    ) -> Command {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("cdem"));
        command.args(arguments).current_dir(self.0.path());
        command
    }

    /// Runs the command line with a file size limit of `blocks` blocks of 512 bytes. The signal for
    /// exceeding it is ignored.
    #[cfg(unix)]
    pub(crate) fn cdem_within(&self, blocks: u32, line: &str) -> Ended {
        let limited = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" {line}");
        let mut shell = Command::new("sh");
        shell.args(["-c", &limited]);
        shell.arg(assert_cmd::cargo::cargo_bin!("cdem"));
        let output = shell.current_dir(self.0.path()).output();
        Ended(output.expect("sh runs"))
    }

    /// Runs the command line, for example `run scene.toml`.
    pub(crate) fn cdem(&self, line: &str) -> Ended {
        let output = self.command(line.split_whitespace()).output();
        Ended(output.expect("the command runs"))
    }
}

/// Sends a signal, for example `TERM`.
pub(crate) fn signal(name: &str, to: &Child) {
    let sent = Command::new("kill")
        .args(["-s", name, &to.id().to_string()])
        .status();
    assert!(sent.expect("kill runs").success());
}

pub(crate) fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> = entries
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    names.sort();
    names
}

/// A command that has ended.
pub(crate) struct Ended(Output);

impl Ended {
    pub(crate) fn status(&self) -> i32 {
        self.0.status.code().expect("it was not killed")
    }

    pub(crate) fn stdout(&self) -> String {
        String::from_utf8_lossy(&self.0.stdout).into_owned()
    }

    pub(crate) fn stderr(&self) -> String {
        String::from_utf8_lossy(&self.0.stderr).into_owned()
    }

    /// Returns exit status and both streams, for snapshots.
    pub(crate) fn told(&self) -> String {
        let parts = [("", self.stdout()), ("--- stderr\n", self.stderr())];
        let streams = parts
            .into_iter()
            .filter(|(_, text)| !text.is_empty())
            .map(|(title, text)| format!("{title}{text}"));
        format!(
            "exit status {}\n{}",
            self.status(),
            streams.collect::<String>()
        )
    }

    /// Asserts success.
    pub(crate) fn done(self) -> Self {
        assert_eq!(self.status(), 0, "{}", self.told());
        self
    }
}
