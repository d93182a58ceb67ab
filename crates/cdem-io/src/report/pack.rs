//! Arrays as text: little-endian bytes, compressed, in base64.

use std::io::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use bytemuck::NoUninit;
use flate2::Compression;
use flate2::write::ZlibEncoder;

/// Packs numbers for the page to decode.
pub(super) fn pack<T: NoUninit>(numbers: &[T]) -> String {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    let packed = encoder
        .write_all(bytemuck::cast_slice(numbers))
        .and_then(|()| encoder.finish());
    STANDARD.encode(packed.expect("compression into memory cannot fail"))
}
