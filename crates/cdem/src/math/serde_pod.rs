//! Lists of plain numbers in a checkpoint: their bytes in memory, copied as a whole. For
//! `#[serde(with = "serde_pod")]`.

use std::fmt;
use std::marker::PhantomData;

use bytemuck::Pod;
use serde::de::{Deserializer, Error, Visitor};
use serde::ser::Serializer;

#[cfg(target_endian = "big")]
compile_error!("checkpoints hold numbers with their lowest byte first");

/// Writes numbers.
pub(crate) fn serialize<T: Pod, S: Serializer>(
    numbers: &[T],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.serialize_bytes(bytemuck::cast_slice(numbers))
}

/// Reads numbers.
pub(crate) fn deserialize<'de, N: PlainNumbers, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<N, D::Error> {
    deserializer.deserialize_bytes(Bytes(PhantomData))
}

/// A type that consists of plain numbers.
pub(crate) trait PlainNumbers: Sized {
    /// Reads the numbers from their bytes; `None` if there are too many or too few bytes.
    fn of(bytes: &[u8]) -> Option<Self>;
}

impl<T: Pod> PlainNumbers for Vec<T> {
    fn of(bytes: &[u8]) -> Option<Self> {
        let is_whole = bytes.len().is_multiple_of(size_of::<T>());
        is_whole.then(|| bytemuck::allocation::pod_collect_to_vec(bytes))
    }
}

impl<const D: usize> PlainNumbers for [f64; D] {
    fn of(bytes: &[u8]) -> Option<Self> {
        bytemuck::try_pod_read_unaligned(bytes).ok()
    }
}

struct Bytes<N>(PhantomData<N>);

impl<N: PlainNumbers> Visitor<'_> for Bytes<N> {
    type Value = N;

    fn expecting(&self, out: &mut fmt::Formatter) -> fmt::Result {
        out.write_str("the bytes of whole numbers")
    }

    fn visit_bytes<E: Error>(self, bytes: &[u8]) -> Result<N, E> {
        N::of(bytes).ok_or_else(|| E::invalid_length(bytes.len(), &self))
    }
}

#[cfg(test)]
mod tests {
    use serde::{Deserialize, Serialize};

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Some<const D: usize> {
        #[serde(with = "super")]
        one: [f64; D],
        #[serde(with = "super")]
        many: Vec<[f64; D]>,
        #[serde(with = "super")]
        whole: Vec<u32>,
    }

    fn some() -> Some<3> {
        Some {
            one: [1.5, -0.0, f64::INFINITY],
            many: vec![[0.1; 3], [f64::MIN_POSITIVE, 1e300, -7.0]],
            whole: vec![0, u32::MAX],
        }
    }

    #[test]
    fn numbers_come_back_as_they_were() {
        let bytes = postcard::to_stdvec(&some()).expect("into memory");
        assert_eq!(postcard::from_bytes(&bytes), Ok(some()));
    }

    #[test]
    fn bytes_of_half_a_number_are_refused() {
        let plane = Some {
            one: [0.0; 2],
            many: vec![[0.0; 2]; 3],
            whole: vec![],
        };
        let bytes = postcard::to_stdvec(&plane).expect("into memory");
        assert!(postcard::from_bytes::<Some<3>>(&bytes).is_err());
        assert!(postcard::from_bytes::<Some<2>>(&bytes[..20]).is_err());
    }
}
