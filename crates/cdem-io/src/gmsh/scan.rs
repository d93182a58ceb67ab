//! Numbers and section marks of a mesh file, and where they stand.

use cdem::mesh::MeshError;

/// Help for files whose content does not fit its own counts.
pub(super) const DAMAGED: &str = "the file is cut off or damaged: write it again with Gmsh";

/// How the numbers of a file are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// A mesh file and the place that has been read up to.
pub(super) struct Scanner<'a> {
    /// What messages call the file.
    origin: &'a str,
    bytes: &'a [u8],
    at: usize,
    /// Name of the section being read, without `$`.
    section: &'a str,
    pub(super) encoding: Encoding,
}

impl<'a> Scanner<'a> {
    pub(super) fn new(origin: &'a str, bytes: &'a [u8]) -> Self {
        Self {
            origin,
            bytes,
            at: 0,
            section: "",
            encoding: Encoding::Text,
        }
    }

    /// An error at the place that has been read up to.
    pub(super) fn fault(&self, problem: impl Into<String>, help: impl Into<String>) -> MeshError {
        let before = &self.bytes[..self.at.min(self.bytes.len())];
        let place = match self.encoding {
            Encoding::Text => format!("line {}", 1 + memchr::memchr_iter(b'\n', before).count()),
            Encoding::LittleEndian | Encoding::BigEndian => format!("byte {}", before.len()),
        };
        MeshError::Format {
            mesh: self.origin.to_owned(),
            section: match self.section {
                "" if self.at == 0 => "start of the file".to_owned(),
                "" => "between sections".to_owned(),
                name => format!("section ${name}"),
            },
            place,
            problem: problem.into(),
            help: help.into(),
        }
    }

    /// Opens the next section and returns its name; `None` at the end.
    pub(super) fn open(&mut self) -> Result<Option<&'a str>, MeshError> {
        self.skip_blanks();
        if self.at == self.bytes.len() {
            return Ok(None);
        }
        let line = self.peek_line();
        let name = std::str::from_utf8(line)
            .ok()
            .and_then(|line| line.trim_end().strip_prefix('$'));
        let Some(name) = name.filter(|name| !name.is_empty()) else {
            let problem = format!("expected a section such as $Nodes, found {}", excerpt(line));
            return Err(self.fault(problem, DAMAGED));
        };
        self.section = name;
        self.end_line();
        Ok(Some(name))
    }

    /// Closes the section that is open.
    pub(super) fn close(&mut self) -> Result<(), MeshError> {
        self.skip_blanks();
        let line = self.peek_line();
        if line.trim_ascii_end().strip_prefix(b"$End") != Some(self.section.as_bytes()) {
            let section = self.section;
            let problem = format!(
                "expected $End{section}, found {}: the counts of the section do not fit its content",
                excerpt(line)
            );
            return Err(self.fault(problem, DAMAGED));
        }
        self.end_line();
        self.section = "";
        Ok(())
    }

    /// Skips the section that is open.
    pub(super) fn skip(&mut self) -> Result<(), MeshError> {
        let end = format!("$End{}", self.section);
        match memchr::memmem::find(&self.bytes[self.at..], end.as_bytes()) {
            Some(offset) => self.at += offset,
            None => return Err(self.fault(format!("{end} is missing"), DAMAGED)),
        }
        self.close()
    }

    /// Refuses a count of things that cannot fit into the rest of the file,
    /// before memory is asked for. Each takes `numbers` numbers and, in binary
    /// files, `bytes` bytes.
    pub(super) fn afford(
        &self,
        count: u64,
        numbers: usize,
        bytes: usize,
        things: &str,
    ) -> Result<usize, MeshError> {
        let each = match self.encoding {
            // A digit and a blank.
            Encoding::Text => 2 * numbers,
            Encoding::LittleEndian | Encoding::BigEndian => bytes,
        };
        let left = self.bytes.len() - self.at;
        match usize::try_from(count)
            .ok()
            .filter(|count| *count <= (left + 1) / each.max(1))
        {
            Some(count) => Ok(count),
            None => {
                let problem = format!("{count} {things} are announced, but {left} bytes are left");
                Err(self.fault(problem, DAMAGED))
            }
        }
    }

    /// A 32-bit integer; `what` says what it stands for.
    pub(super) fn int(&mut self, what: &str) -> Result<i32, MeshError> {
        match self.encoding {
            Encoding::Text => self.text(what, parse_integer),
            Encoding::LittleEndian => Ok(i32::from_le_bytes(self.take(what)?)),
            Encoding::BigEndian => Ok(i32::from_be_bytes(self.take(what)?)),
        }
    }

    /// An unsigned 64-bit integer.
    pub(super) fn size(&mut self, what: &str) -> Result<u64, MeshError> {
        match self.encoding {
            Encoding::Text => self.text(what, parse_integer),
            Encoding::LittleEndian => Ok(u64::from_le_bytes(self.take(what)?)),
            Encoding::BigEndian => Ok(u64::from_be_bytes(self.take(what)?)),
        }
    }

    /// A real number, which may be infinite or none.
    pub(super) fn real(&mut self, what: &str) -> Result<f64, MeshError> {
        match self.encoding {
            Encoding::Text => {
                self.text(what, |token| std::str::from_utf8(token).ok()?.parse().ok())
            }
            Encoding::LittleEndian => Ok(f64::from_le_bytes(self.take(what)?)),
            Encoding::BigEndian => Ok(f64::from_be_bytes(self.take(what)?)),
        }
    }

    /// Three finite coordinates of a node.
    pub(super) fn place(&mut self, node: u64) -> Result<[f64; 3], MeshError> {
        let place = [
            self.real("x of a node")?,
            self.real("y of a node")?,
            self.real("z of a node")?,
        ];
        if place.iter().all(|x| x.is_finite()) {
            return Ok(place);
        }
        let problem = format!("node {node} is at {place:?}, which is no place");
        Err(self.fault(problem, "check the geometry and mesh it again"))
    }

    /// An unsigned integer that is text even in binary files.
    pub(super) fn text_size(&mut self, what: &str) -> Result<u64, MeshError> {
        self.text(what, parse_integer)
    }

    /// A word of text, as the format's version.
    pub(super) fn word(&mut self, what: &str) -> Result<String, MeshError> {
        self.text(what, |token| {
            std::str::from_utf8(token).ok().map(str::to_owned)
        })
    }

    /// The rest of the line, without blanks around it.
    pub(super) fn rest_of_line(&mut self) -> String {
        let line = String::from_utf8_lossy(self.peek_line()).trim().to_owned();
        self.end_line();
        line
    }

    /// Goes to the next line.
    pub(super) fn end_line(&mut self) {
        self.at = (self.at + self.peek_line().len() + 1).min(self.bytes.len());
    }

    fn peek_line(&self) -> &'a [u8] {
        let rest = &self.bytes[self.at..];
        &rest[..memchr::memchr(b'\n', rest).unwrap_or(rest.len())]
    }

    fn skip_blanks(&mut self) {
        let rest = &self.bytes[self.at..];
        self.at += rest
            .iter()
            .take_while(|byte| byte.is_ascii_whitespace())
            .count();
    }

    fn text<T>(&mut self, what: &str, parse: impl Fn(&[u8]) -> Option<T>) -> Result<T, MeshError> {
        self.skip_blanks();
        let rest = &self.bytes[self.at..];
        let length = rest
            .iter()
            .take_while(|byte| !byte.is_ascii_whitespace())
            .count();
        let token = &rest[..length];
        match parse(token) {
            Some(value) => {
                self.at += length;
                Ok(value)
            }
            None => Err(self.fault(
                format!("expected {what}, found {}", excerpt(token)),
                DAMAGED,
            )),
        }
    }

    fn take<const N: usize>(&mut self, what: &str) -> Result<[u8; N], MeshError> {
        match self.bytes[self.at..].first_chunk() {
            Some(chunk) => {
                self.at += N;
                Ok(*chunk)
            }
            None => {
                let problem = format!("expected {what}, found the end of the file");
                Err(self.fault(problem, DAMAGED))
            }
        }
    }
}

/// A decimal integer that fits into `T`.
fn parse_integer<T: TryFrom<i128>>(token: &[u8]) -> Option<T> {
    let (negative, digits) = match token.split_first()? {
        (b'-', digits) => (true, digits),
        _ => (false, token),
    };
    // Twenty digits hold every 64-bit number and overflow no i128.
    if digits.is_empty() || digits.len() > 20 || !digits.iter().all(u8::is_ascii_digit) {
        return None;
    }
    let value = digits
        .iter()
        .fold(0_i128, |value, digit| 10 * value + i128::from(digit - b'0'));
    T::try_from(if negative { -value } else { value }).ok()
}

/// The beginning of what was found, for messages.
fn excerpt(found: &[u8]) -> String {
    const SHOWN: usize = 24;
    if found.trim_ascii().is_empty() {
        return "nothing".to_owned();
    }
    let more = if found.len() > SHOWN { "…" } else { "" };
    let shown = String::from_utf8_lossy(&found[..found.len().min(SHOWN)]);
    format!("\"{}{more}\"", shown.trim_end().escape_debug())
}
