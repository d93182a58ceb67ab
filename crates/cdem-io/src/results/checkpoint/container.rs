//! File format of a checkpoint.
//!
//! A line with the kind of file and its format; a line of JSON, readable with `head -2`; bytes; and
//! the CRC-32 of all that, lowest byte first.

use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::results::error::ResultsError;
use crate::results::file::write_lasting;

/// The first line, up to the number of the format.
const MAGIC: &str = "cdem checkpoint ";

/// Format number; to be raised with every change of the content, also of the state that `cdem`
/// saves.
const FORMAT: u32 = 11;

/// Number of bytes of the checksum.
const SUM: usize = 4;

/// Writes a file completely or not at all, and syncs it to disk.
pub(super) fn write(
    path: &Path,
    head: &impl Serialize,
    body: &[&[u8]],
) -> Result<(), ResultsError> {
    write_lasting(path, |out| {
        let mut sum = crc32fast::Hasher::new();
        let head = serde_json::to_string(head)?;
        let head = format!("{MAGIC}{FORMAT}\n{head}\n");
        for part in std::iter::once(&head.as_bytes()).chain(body) {
            sum.update(part);
            out.write_all(part)?;
        }
        out.write_all(&sum.finalize().to_le_bytes())
    })
}

/// Reads head and body of such a file, or returns a description of its fault.
pub(super) fn read<H: DeserializeOwned>(path: &Path) -> Result<(H, Vec<u8>), String> {
    let bytes = std::fs::read(path).map_err(|error| format!("cannot be read: {error}"))?;
    let (head, body) = parse(&bytes)?;
    Ok((head, body.to_vec()))
}

fn parse<H: DeserializeOwned>(bytes: &[u8]) -> Result<(H, &[u8]), String> {
    let (first, rest) = line(bytes).ok_or("is no checkpoint")?;
    let format = first.strip_prefix(MAGIC).ok_or("is no checkpoint")?;
    if format != FORMAT.to_string() {
        return Err(format!(
            "has format {format}, and this version of cdem reads format {FORMAT}"
        ));
    }
    let (whole, sum) = bytes.split_last_chunk::<SUM>().ok_or("is incomplete")?;
    if crc32fast::hash(whole) != u32::from_le_bytes(*sum) {
        return Err("is damaged: its checksum is wrong".to_owned());
    }
    let (head, body) = line(rest).ok_or("has no header")?;
    let head =
        serde_json::from_str(head).map_err(|error| format!("has a wrong header: {error}"))?;
    let body = &body[..body.len().saturating_sub(SUM)];
    Ok((head, body))
}

/// Splits off the first line of text.
fn line(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let end = memchr::memchr(b'\n', bytes)?;
    let text = std::str::from_utf8(&bytes[..end]).ok()?;
    Some((text, &bytes[end + 1..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(name: &str) -> Vec<u8> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(name);
        write(&path, &[1.0 / 3.0, 5e-324], &[b"one, ", b"two\n"]).expect("a file");
        let (head, body) = read::<Vec<f64>>(&path).expect("the same");
        assert_eq!(head, [1.0 / 3.0, 5e-324]);
        assert_eq!(body, b"one, two\n");
        std::fs::read(&path).expect("a file")
    }

    #[test]
    fn every_flipped_bit_and_every_missing_byte_is_noticed() {
        let whole = written("state");
        for place in 0..8 * whole.len() {
            let mut bytes = whole.clone();
            bytes[place / 8] ^= 1 << (place % 8);
            assert!(parse::<Vec<f64>>(&bytes).is_err(), "bit {place}");
        }
        for length in 0..whole.len() {
            assert!(parse::<Vec<f64>>(&whole[..length]).is_err(), "{length}");
        }
    }

    #[test]
    fn another_format_is_told() {
        let told = parse::<Vec<f64>>(b"cdem checkpoint 6\n[]\n....").expect_err("another");
        assert!(told.starts_with("has format 6"), "{told}");
    }
}
