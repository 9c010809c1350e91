//! Hash tables of small keys, without iteration: nothing can depend on their order, so that programs are always the
//! same.
//!
//! The engine runs inside compilers, often without optimisation. There the hash of the standard library, which resists
//! chosen keys, takes much of the time; here one multiplication for each word suffices.

use std::borrow::Borrow;
use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};
use std::hash::{BuildHasherDefault, Hash, Hasher};
use std::ops::Index;

/// A map without an order.
#[derive(Clone, Debug)]
pub(crate) struct Map<K, V>(HashMap<K, V, BuildHasherDefault<Mixer>>);

/// A set without an order.
#[derive(Clone, Debug)]
pub(crate) struct Set<K>(HashSet<K, BuildHasherDefault<Mixer>>);

impl<K: Eq + Hash, V> Map<K, V> {
    /// The value of a key.
    pub(crate) fn get<Q: Eq + Hash + ?Sized>(&self, key: &Q) -> Option<&V>
    where
        K: Borrow<Q>,
    {
        self.0.get(key)
    }

    /// The value of a key, to be changed.
    pub(crate) fn get_mut<Q: Eq + Hash + ?Sized>(&mut self, key: &Q) -> Option<&mut V>
    where
        K: Borrow<Q>,
    {
        self.0.get_mut(key)
    }

    /// Whether a key has a value.
    pub(crate) fn contains_key<Q: Eq + Hash + ?Sized>(&self, key: &Q) -> bool
    where
        K: Borrow<Q>,
    {
        self.0.contains_key(key)
    }

    /// Gives a key a value, and returns the one it had.
    pub(crate) fn insert(&mut self, key: K, value: V) -> Option<V> {
        self.0.insert(key, value)
    }

    /// Takes the value of a key away.
    pub(crate) fn remove<Q: Eq + Hash + ?Sized>(&mut self, key: &Q) -> Option<V>
    where
        K: Borrow<Q>,
    {
        self.0.remove(key)
    }

    /// The place of a key, whether it has a value or not.
    pub(crate) fn entry(&mut self, key: K) -> Entry<'_, K, V> {
        self.0.entry(key)
    }

    /// Takes the values of keys away that are not to be kept.
    pub(crate) fn retain(&mut self, keep: impl Fn(&K) -> bool) {
        self.0.retain(|key, _| keep(key));
    }

    /// How many keys have a value.
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }
}

impl<K: Eq + Hash> Set<K> {
    /// Whether an element is in it.
    pub(crate) fn contains<Q: Eq + Hash + ?Sized>(&self, element: &Q) -> bool
    where
        K: Borrow<Q>,
    {
        self.0.contains(element)
    }

    /// Adds an element; whether it is a new one.
    pub(crate) fn insert(&mut self, element: K) -> bool {
        self.0.insert(element)
    }
}

impl<K, V> Default for Map<K, V> {
    fn default() -> Self {
        Self(HashMap::default())
    }
}

impl<K> Default for Set<K> {
    fn default() -> Self {
        Self(HashSet::default())
    }
}

impl<K: Eq + Hash, V> Index<&K> for Map<K, V> {
    type Output = V;

    fn index(&self, key: &K) -> &V {
        &self.0[key]
    }
}

impl<K: Eq + Hash, V> FromIterator<(K, V)> for Map<K, V> {
    fn from_iter<T: IntoIterator<Item = (K, V)>>(pairs: T) -> Self {
        Self(pairs.into_iter().collect())
    }
}

impl<K: Eq + Hash> Extend<K> for Set<K> {
    fn extend<T: IntoIterator<Item = K>>(&mut self, elements: T) {
        self.0.extend(elements);
    }
}

impl<K: Eq + Hash> FromIterator<K> for Set<K> {
    fn from_iter<T: IntoIterator<Item = K>>(elements: T) -> Self {
        Self(elements.into_iter().collect())
    }
}

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
        let mut found = std::collections::BTreeSet::new();
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
