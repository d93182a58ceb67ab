//! Scanner for numbers and section marks of a mesh file, with their positions.

use cdem::mesh::MeshError;

/// Byte order mark that editors write before UTF-8 text.
pub(super) const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// Help for files whose content does not fit their own counts.
pub(super) const DAMAGED: &str = "the file is cut off or damaged: write it again with Gmsh";

/// Help for numbers that make sense only with their bytes in reverse order.
pub(super) const SWAPPED: &str = "it would fit in the other byte order: the number for the byte \
     order in $MeshFormat is wrong; write the file again with Gmsh";

/// Help for counts that contradict each other or the content.
pub(super) const COUNTS: &str =
    "correct the counts of the section, or write the file again with Gmsh";

/// Help for counts that are not laid out as the version requires.
pub(super) const COUNTS_LINE: &str = "version 2.2 has one count here, version 4.1 has four \
     numbers: check the version in $MeshFormat";

/// Encoding of the numbers in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// A mesh file and the current position in it.
pub(super) struct Scanner<'a> {
    /// Name of the file in messages.
    origin: &'a str,
    bytes: &'a [u8],
    at: usize,
    /// Start of the last item read, to which messages refer.
    last: usize,
    /// Name of the section being read, without `$`.
    section: &'a str,
    /// Start of the section opened last.
    head: Option<usize>,
    /// Help for the line on which everything read now must be; `None` if there is no such line.
    line: Option<&'static str>,
    pub(super) encoding: Encoding,
}

impl<'a> Scanner<'a> {
    pub(super) fn new(origin: &'a str, bytes: &'a [u8]) -> Self {
        let start = if bytes.starts_with(BYTE_ORDER_MARK) {
            BYTE_ORDER_MARK.len()
        } else {
            0
        };
        Self {
            origin,
            bytes,
            at: start,
            last: start,
            section: "",
            head: None,
            line: None,
            encoding: Encoding::Text,
        }
    }

    /// Returns the whole file.
    pub(super) fn file(&self) -> &'a [u8] {
        self.bytes
    }

    /// Creates an error at the last item read.
    pub(super) fn fault(&self, problem: impl Into<String>, help: impl Into<String>) -> MeshError {
        self.fault_at(self.last, problem.into(), help.into())
    }

    /// Creates an error of the whole section, at its start.
    pub(super) fn section_fault(&self, problem: String, help: &str) -> MeshError {
        self.fault_at(self.head.unwrap_or(self.last), problem, help.to_owned())
    }

    fn fault_at(&self, at: usize, problem: String, help: String) -> MeshError {
        let before = &self.bytes[..at];
        let place = match self.encoding {
            Encoding::Text => format!("line {}", 1 + memchr::memchr_iter(b'\n', before).count()),
            Encoding::LittleEndian | Encoding::BigEndian => format!("byte {}", before.len()),
        };
        MeshError::Format {
            mesh: self.origin.to_owned(),
            section: match self.section {
                "" if self.head.is_none() => "start of the file".to_owned(),
                "" => "between sections".to_owned(),
                name => format!("section ${name}"),
            },
            place,
            problem,
            help,
        }
    }

    /// Opens the next section and returns its name; `None` at the end.
    pub(super) fn open(&mut self) -> Result<Option<&'a str>, MeshError> {
        self.skip_blanks();
        self.last = self.at;
        if self.at == self.bytes.len() {
            return Ok(None);
        }
        let line = self.peek_line();
        let name = std::str::from_utf8(line)
            .ok()
            .and_then(|line| line.trim_end().strip_prefix('$'));
        let is_name = |name: &&str| !name.is_empty() && !name.contains(char::is_control);
        let Some(name) = name.filter(is_name) else {
            let problem = format!("expected a section such as $Nodes, found {}", excerpt(line));
            return Err(self.fault(problem, DAMAGED));
        };
        self.section = name;
        self.head = Some(self.at);
        self.end_line();
        Ok(Some(name))
    }

    /// Closes the open section.
    pub(super) fn close(&mut self) -> Result<(), MeshError> {
        self.skip_blanks();
        self.last = self.at;
        let line = self.peek_line();
        if line.trim_ascii_end().strip_prefix(b"$End") != Some(self.section.as_bytes()) {
            let mut problem = format!("expected $End{}, found {}", self.section, excerpt(line));
            let help = if line.is_empty() || line.starts_with(b"$") {
                DAMAGED
            } else {
                problem += ": the counts of the section do not fit its content";
                COUNTS
            };
            return Err(self.fault(problem, help));
        }
        self.end_line();
        self.section = "";
        Ok(())
    }

    /// Skips the open section.
    pub(super) fn skip(&mut self) -> Result<(), MeshError> {
        let end = format!("$End{}", self.section);
        match memchr::memmem::find(&self.bytes[self.at..], end.as_bytes()) {
            Some(offset) => self.at += offset,
            None => return Err(self.section_fault(format!("{end} is missing"), DAMAGED)),
        }
        self.close()
    }

    /// True if the bytes of the number one come next, as in the header of binary files.
    pub(super) fn has_mark_of_byte_order(&self) -> bool {
        let rest = &self.bytes[self.at..];
        let rest = rest.trim_ascii_start();
        rest.starts_with(&[1, 0, 0, 0]) || rest.starts_with(&[0, 0, 0, 1])
    }

    /// Refuses a count of items that cannot fit into the rest of the file, before memory is
    /// reserved. Each item takes `numbers` numbers and, in binary files, `bytes` bytes.
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
                let problem = format!(
                    "the file gives {count} as a number of {things}, but has only {left} bytes left"
                );
                let swapped = count.swap_bytes() <= (left / each.max(1)) as u64;
                let is_binary = self.encoding != Encoding::Text;
                let help = if is_binary && swapped {
                    SWAPPED
                } else {
                    DAMAGED
                };
                Err(self.fault(problem, help))
            }
        }
    }

    /// Reads a 32-bit integer; `what` is its name in messages.
    pub(super) fn int(&mut self, what: &str) -> Result<i32, MeshError> {
        match self.encoding {
            Encoding::Text => self.text(what, parse_integer),
            Encoding::LittleEndian => Ok(i32::from_le_bytes(self.take(what)?)),
            Encoding::BigEndian => Ok(i32::from_be_bytes(self.take(what)?)),
        }
    }

    /// Reads an unsigned 64-bit integer.
    pub(super) fn size(&mut self, what: &str) -> Result<u64, MeshError> {
        match self.encoding {
            Encoding::Text => self.text(what, parse_integer),
            Encoding::LittleEndian => Ok(u64::from_le_bytes(self.take(what)?)),
            Encoding::BigEndian => Ok(u64::from_be_bytes(self.take(what)?)),
        }
    }

    /// Reads a real number, which may be infinite or NaN.
    pub(super) fn real(&mut self, what: &str) -> Result<f64, MeshError> {
        match self.encoding {
            Encoding::Text => {
                self.text(what, |token| std::str::from_utf8(token).ok()?.parse().ok())
            }
            Encoding::LittleEndian => Ok(f64::from_le_bytes(self.take(what)?)),
            Encoding::BigEndian => Ok(f64::from_be_bytes(self.take(what)?)),
        }
    }

    /// Reads three finite coordinates of a node.
    pub(super) fn place(&mut self, node: u64) -> Result<[f64; 3], MeshError> {
        let place = [
            self.real("x of a node")?,
            self.real("y of a node")?,
            self.real("z of a node")?,
        ];
        if place.iter().all(|x| x.is_finite()) {
            return Ok(place);
        }
        let problem = format!("node {node} is at {place:?}; its coordinates must be finite");
        Err(self.fault(problem, "check the geometry and mesh it again"))
    }

    /// Reads an unsigned integer that is text even in binary files.
    pub(super) fn text_size(&mut self, what: &str) -> Result<u64, MeshError> {
        self.text(what, parse_integer)
    }

    /// Reads a word of text, such as the format's version.
    pub(super) fn word(&mut self, what: &str) -> Result<String, MeshError> {
        self.text(what, |token| {
            let word = std::str::from_utf8(token).ok()?;
            (!word.is_empty()).then(|| word.to_owned())
        })
    }

    /// Returns the next line that is not empty, without blanks around it.
    pub(super) fn next_line(&mut self) -> String {
        self.skip_blanks();
        self.last = self.at;
        let line = String::from_utf8_lossy(self.peek_line()).trim().to_owned();
        self.end_line();
        line
    }

    /// Moves to the next line.
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

    /// Reads exactly one line of a text file; `help` is for lines that are too short or too long. A
    /// binary file has no lines, so this only reads.
    pub(super) fn line<T>(
        &mut self,
        help: &'static str,
        read: impl FnOnce(&mut Self) -> Result<T, MeshError>,
    ) -> Result<T, MeshError> {
        if self.encoding != Encoding::Text {
            return read(self);
        }
        self.skip_blanks();
        self.line = Some(help);
        let value = read(self)?;
        self.line = None;
        let rest = self.peek_line();
        if rest.trim_ascii().is_empty() {
            return Ok(value);
        }
        let problem = format!("expected the end of the line, found {}", excerpt(rest));
        Err(self.fault(problem, help))
    }

    fn text<T>(&mut self, what: &str, parse: impl Fn(&[u8]) -> Option<T>) -> Result<T, MeshError> {
        if self.line.is_some() {
            let rest = &self.bytes[self.at..];
            let is_blank = |byte: &&u8| byte.is_ascii_whitespace() && **byte != b'\n';
            self.at += rest.iter().take_while(is_blank).count();
        } else {
            self.skip_blanks();
        }
        self.last = self.at;
        let rest = &self.bytes[self.at..];
        let length = rest
            .iter()
            .take_while(|byte| !byte.is_ascii_whitespace())
            .count();
        let token = &rest[..length];
        let ended = self.line.filter(|_| token.is_empty() && !rest.is_empty());
        match (parse(token), ended) {
            (Some(value), _) => {
                self.at += length;
                Ok(value)
            }
            (None, Some(help)) => {
                let problem = format!("expected {what}, found the end of the line");
                Err(self.fault(problem, help))
            }
            (None, None) => {
                let problem = format!("expected {what}, found {}", excerpt(token));
                Err(self.fault(problem, advice(token)))
            }
        }
    }

    fn take<const N: usize>(&mut self, what: &str) -> Result<[u8; N], MeshError> {
        self.last = self.at;
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

/// Parses a decimal integer that fits into `T`.
fn parse_integer<T: TryFrom<i128>>(token: &[u8]) -> Option<T> {
    let (negative, digits) = match token.split_first()? {
        (b'-', digits) => (true, digits),
        _ => (false, token),
    };
    // Twenty digits hold every 64-bit number and do not overflow an i128.
    if digits.is_empty() || digits.len() > 20 || !digits.iter().all(u8::is_ascii_digit) {
        return None;
    }
    let value = digits
        .iter()
        .fold(0_i128, |value, digit| 10 * value + i128::from(digit - b'0'));
    T::try_from(if negative { -value } else { value }).ok()
}

/// Returns advice for a `token` found in place of a number.
fn advice(token: &[u8]) -> &'static str {
    let word = String::from_utf8_lossy(token).to_lowercase();
    let is_number_with = |mark: char, instead: &str| {
        word.contains(mark) && word.replace(mark, instead).parse::<f64>().is_ok()
    };
    if word.starts_with('$') {
        COUNTS
    } else if is_number_with(',', ".") {
        "numbers have a decimal point, not a comma"
    } else if is_number_with('d', "e") {
        "an exponent is written with e, as in 1.5e-3"
    } else if word.starts_with("**") {
        "a number was too long for its columns: write it with more columns"
    } else {
        DAMAGED
    }
}

/// Returns the beginning of the bytes found, for messages.
pub(super) fn excerpt(found: &[u8]) -> String {
    const SHOWN: usize = 24;
    let found = found.trim_ascii();
    if found.is_empty() {
        return "the end of the file".to_owned();
    }
    let more = if found.len() > SHOWN { "…" } else { "" };
    let shown = String::from_utf8_lossy(&found[..found.len().min(SHOWN)]);
    format!("\"{}{more}\"", shown.trim_end().escape_debug())
}
