//! Hash tables of small keys. The engine runs inside of compilers, often not optimised itself, where the hash of the standard library, made
//! against chosen keys, takes much of the time; here one product a word does. Nothing may depend on the order of such a table.

use std::collections::{HashMap, HashSet};
use std::hash::{BuildHasherDefault, Hasher};

/// A map without a useful order.
pub(crate) type Map<K, V> = HashMap<K, V, BuildHasherDefault<Mixer>>;

/// A set without a useful order.
pub(crate) type Set<K> = HashSet<K, BuildHasherDefault<Mixer>>;

/// Mixes words by products.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Mixer(u64);

impl Mixer {
    fn mix(&mut self, word: u64) {
        self.0 = (self.0.rotate_left(5) ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
}

impl Hasher for Mixer {
    fn finish(&self) -> u64 {
        // The upper bits of a product are mixed best, tables look at the lower ones first.
        self.0.rotate_left(26)
    }

    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let word = chunk
                .iter()
                .fold(0, |word, byte| (word << 8) | u64::from(*byte));
            self.mix(word);
        }
    }

    fn write_u8(&mut self, value: u8) {
        self.mix(u64::from(value));
    }

    fn write_u32(&mut self, value: u32) {
        self.mix(u64::from(value));
    }

    fn write_i32(&mut self, value: i32) {
        self.mix(u64::from(value.cast_unsigned()));
    }

    fn write_u64(&mut self, value: u64) {
        self.mix(value);
    }

    fn write_i64(&mut self, value: i64) {
        self.mix(value.cast_unsigned());
    }

    fn write_usize(&mut self, value: usize) {
        self.mix(value as u64);
    }

    fn write_isize(&mut self, value: isize) {
        self.mix(value as u64);
    }

    fn write_i128(&mut self, value: i128) {
        self.mix(value as u64);
        self.mix((value >> 64) as u64);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::hash::{BuildHasher, Hash};

    #[test]
    fn small_keys_have_different_hashes() {
        let hash = |key: &dyn Fn(&mut Mixer)| {
            let mut hasher = BuildHasherDefault::<Mixer>::default().build_hasher();
            key(&mut hasher);
            hasher.finish()
        };
        let mut found = Set::default();
        for a in 0..64_u32 {
            for b in 0..64_i128 {
                found.insert(hash(&|hasher| (a, b - 32).hash(hasher)));
            }
            found.insert(hash(&|hasher| format!("l{a}").hash(hasher)));
        }
        assert_eq!(found.len(), 64 * 65);
        // The lower bits choose the place in a table: 4160 keys on 1024 places, none of which should get many.
        let mut places = [0; 1024];
        for hash in found {
            places[(hash % 1024) as usize] += 1;
        }
        assert!(places.into_iter().max() < Some(20));
    }
}
