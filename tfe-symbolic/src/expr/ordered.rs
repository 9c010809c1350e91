//! Maps and sets in the order of their keys, as sorted vectors: contiguous in memory, and with much less code for each
//! type than B-trees.
//!
//! Keys that arrive in ascending order are appended; any other insertion moves the keys after it.

use std::borrow::Borrow;
use std::ops::Index;
use std::{slice, vec};

use super::sorting::sort_by;

/// A map in the order of its keys.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SortedMap<K, V>(Vec<(K, V)>);

/// A set in the order of its elements.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SortedSet<K>(Vec<K>);

impl<K, V> SortedMap<K, V> {
    /// A map without keys.
    #[must_use]
    pub const fn new() -> Self {
        Self(Vec::new())
    }

    /// How many keys have a value.
    #[must_use]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether no key has a value.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Keys and values.
    pub fn iter(&self) -> slice::Iter<'_, (K, V)> {
        self.0.iter()
    }

    /// The keys.
    pub fn keys(&self) -> impl DoubleEndedIterator<Item = &K> + ExactSizeIterator + Clone {
        self.0.iter().map(|(key, _)| key)
    }

    /// The values, in the order of their keys.
    pub fn values(&self) -> impl DoubleEndedIterator<Item = &V> + ExactSizeIterator + Clone {
        self.0.iter().map(|(_, value)| value)
    }

    /// Keys and values, the values to be changed.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = (&K, &mut V)> {
        self.0.iter_mut().map(|(key, value)| (&*key, value))
    }

    /// The keys, without their values.
    pub fn into_keys(self) -> impl Iterator<Item = K> {
        self.0.into_iter().map(|(key, _)| key)
    }

    /// The values, without their keys.
    pub fn into_values(self) -> impl Iterator<Item = V> {
        self.0.into_iter().map(|(_, value)| value)
    }

    /// Takes all keys away.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Takes the keys away that are not to be kept.
    pub fn retain(&mut self, mut keep: impl FnMut(&K, &V) -> bool) {
        self.0.retain(|(key, value)| keep(key, value));
    }
}

impl<K: Ord, V> SortedMap<K, V> {
    /// Where a key is, or where it would be inserted.
    fn search<Q: Ord + ?Sized>(&self, key: &Q) -> Result<usize, usize>
    where
        K: Borrow<Q>,
    {
        self.0.binary_search_by(|(own, _)| own.borrow().cmp(key))
    }

    /// The value of a key.
    pub fn get<Q: Ord + ?Sized>(&self, key: &Q) -> Option<&V>
    where
        K: Borrow<Q>,
    {
        let at = self.search(key).ok()?;
        Some(&self.0[at].1)
    }

    /// The value of a key, to be changed.
    pub fn get_mut<Q: Ord + ?Sized>(&mut self, key: &Q) -> Option<&mut V>
    where
        K: Borrow<Q>,
    {
        let at = self.search(key).ok()?;
        Some(&mut self.0[at].1)
    }

    /// The value of a key, which is given this one if it has none.
    pub fn get_or_insert(&mut self, key: K, value: V) -> &mut V {
        let at = match self.search(&key) {
            Ok(at) => at,
            Err(at) => {
                self.0.insert(at, (key, value));
                at
            }
        };
        &mut self.0[at].1
    }

    /// The value of a key, which is given the default one if it has none.
    pub fn get_or_default(&mut self, key: K) -> &mut V
    where
        V: Default,
    {
        self.get_or_insert(key, V::default())
    }

    /// Whether a key has a value.
    pub fn contains_key<Q: Ord + ?Sized>(&self, key: &Q) -> bool
    where
        K: Borrow<Q>,
    {
        self.search(key).is_ok()
    }

    /// Gives a key a value, and returns the one it had.
    pub fn insert(&mut self, key: K, value: V) -> Option<V> {
        match self.search(&key) {
            Ok(at) => Some(std::mem::replace(&mut self.0[at].1, value)),
            Err(at) => {
                self.0.insert(at, (key, value));
                None
            }
        }
    }

    /// Takes the value of a key away.
    pub fn remove<Q: Ord + ?Sized>(&mut self, key: &Q) -> Option<V>
    where
        K: Borrow<Q>,
    {
        let at = self.search(key).ok()?;
        Some(self.0.remove(at).1)
    }

    /// A map of pairs in any order; of equal keys, the last has its value.
    fn of(mut pairs: Vec<(K, V)>) -> Self {
        sort_by(&mut pairs, |a, b| a.0.cmp(&b.0));
        pairs.dedup_by(|later, earlier| {
            let same = later.0 == earlier.0;
            if same {
                std::mem::swap(later, earlier);
            }
            same
        });
        Self(pairs)
    }
}

impl<K> SortedSet<K> {
    /// A set without elements.
    #[must_use]
    pub const fn new() -> Self {
        Self(Vec::new())
    }

    /// How many elements are in it.
    #[must_use]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether no element is in it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The elements.
    pub fn iter(&self) -> slice::Iter<'_, K> {
        self.0.iter()
    }

    /// Takes the greatest element out.
    pub fn pop_last(&mut self) -> Option<K> {
        self.0.pop()
    }

    /// Takes all elements out.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Takes the elements out that are not to be kept.
    pub fn retain(&mut self, keep: impl FnMut(&K) -> bool) {
        self.0.retain(keep);
    }
}

impl<K: Ord> SortedSet<K> {
    /// Whether an element is in it.
    pub fn contains<Q: Ord + ?Sized>(&self, element: &Q) -> bool
    where
        K: Borrow<Q>,
    {
        self.search(element).is_ok()
    }

    /// Adds an element; whether it is a new one.
    pub fn insert(&mut self, element: K) -> bool {
        let place = self.search(&element);
        if let Err(at) = place {
            self.0.insert(at, element);
        }
        place.is_err()
    }

    /// Takes an element out; whether it was there.
    pub fn remove<Q: Ord + ?Sized>(&mut self, element: &Q) -> bool
    where
        K: Borrow<Q>,
    {
        let place = self.search(element);
        if let Ok(at) = place {
            self.0.remove(at);
        }
        place.is_ok()
    }

    /// Where an element is, or where it would be inserted.
    fn search<Q: Ord + ?Sized>(&self, element: &Q) -> Result<usize, usize>
    where
        K: Borrow<Q>,
    {
        self.0.binary_search_by(|own| own.borrow().cmp(element))
    }

    /// A set of elements in any order.
    fn of(mut elements: Vec<K>) -> Self {
        sort_by(&mut elements, K::cmp);
        elements.dedup();
        Self(elements)
    }
}

impl<K, V> Default for SortedMap<K, V> {
    fn default() -> Self {
        Self::new()
    }
}

impl<K> Default for SortedSet<K> {
    fn default() -> Self {
        Self::new()
    }
}

impl<Q: Ord + ?Sized, K: Ord + Borrow<Q>, V> Index<&Q> for SortedMap<K, V> {
    type Output = V;

    fn index(&self, key: &Q) -> &V {
        self.get(key).expect("the key has a value")
    }
}

impl<K: Ord, V> FromIterator<(K, V)> for SortedMap<K, V> {
    fn from_iter<T: IntoIterator<Item = (K, V)>>(pairs: T) -> Self {
        let mut all = Vec::new();
        for pair in pairs {
            all.push(pair);
        }
        Self::of(all)
    }
}

impl<K: Ord> FromIterator<K> for SortedSet<K> {
    fn from_iter<T: IntoIterator<Item = K>>(elements: T) -> Self {
        let mut all = Vec::new();
        for element in elements {
            all.push(element);
        }
        Self::of(all)
    }
}

impl<K: Ord, V, const N: usize> From<[(K, V); N]> for SortedMap<K, V> {
    fn from(pairs: [(K, V); N]) -> Self {
        Self::of(Vec::from(pairs))
    }
}

impl<K: Ord, const N: usize> From<[K; N]> for SortedSet<K> {
    fn from(elements: [K; N]) -> Self {
        Self::of(Vec::from(elements))
    }
}

impl<K: Ord, V> Extend<(K, V)> for SortedMap<K, V> {
    fn extend<T: IntoIterator<Item = (K, V)>>(&mut self, pairs: T) {
        for (key, value) in pairs {
            self.insert(key, value);
        }
    }
}

impl<K: Ord> Extend<K> for SortedSet<K> {
    fn extend<T: IntoIterator<Item = K>>(&mut self, elements: T) {
        for element in elements {
            self.insert(element);
        }
    }
}

impl<K, V> IntoIterator for SortedMap<K, V> {
    type Item = (K, V);
    type IntoIter = vec::IntoIter<(K, V)>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

impl<'a, K, V> IntoIterator for &'a SortedMap<K, V> {
    type Item = &'a (K, V);
    type IntoIter = slice::Iter<'a, (K, V)>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.iter()
    }
}

impl<K> IntoIterator for SortedSet<K> {
    type Item = K;
    type IntoIter = vec::IntoIter<K>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

impl<'a, K> IntoIterator for &'a SortedSet<K> {
    type Item = &'a K;
    type IntoIter = slice::Iter<'a, K>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::{BTreeMap, BTreeSet};

    /// What is done with a map: the key, the value, and which of the methods.
    fn operations() -> impl Strategy<Value = Vec<(u8, u32, u8)>> {
        prop::collection::vec((0..40_u8, any::<u32>(), 0..8_u8), 0..120)
    }

    fn is_the_same(own: &SortedMap<u8, u32>, other: &BTreeMap<u8, u32>) -> bool {
        own.len() == other.len()
            && own.is_empty() == other.is_empty()
            && own.iter().map(|(k, v)| (k, v)).eq(other)
            && own.keys().eq(other.keys())
            && own.values().rev().eq(other.values().rev())
            && own.clone().into_keys().eq(other.clone().into_keys())
            && own.clone().into_values().eq(other.clone().into_values())
            && own.clone().into_iter().eq(other.clone())
    }

    proptest! {
        #[test]
        fn maps_are_those_of_the_standard_library(operations in operations()) {
            let (mut own, mut other) = (SortedMap::new(), BTreeMap::new());
            for (key, value, method) in operations {
                match method {
                    0..3 => prop_assert_eq!(own.insert(key, value), other.insert(key, value)),
                    3 => prop_assert_eq!(own.remove(&key), other.remove(&key)),
                    4 => prop_assert_eq!(own.get_or_insert(key, value), other.entry(key).or_insert(value)),
                    5 => prop_assert_eq!(own.get_or_default(key), other.entry(key).or_default()),
                    6 => {
                        own.iter_mut().for_each(|(k, v)| *v ^= value + u32::from(*k));
                        other.iter_mut().for_each(|(k, v)| *v ^= value + u32::from(*k));
                    }
                    _ => {
                        own.retain(|k, v| *k != key && v % 7 != 0);
                        other.retain(|k, v| *k != key && *v % 7 != 0);
                    }
                }
                prop_assert!(is_the_same(&own, &other));
                prop_assert_eq!(own.get(&key), other.get(&key));
                prop_assert_eq!(own.get_mut(&key), other.get_mut(&key));
                prop_assert_eq!(own.contains_key(&key), other.contains_key(&key));
            }
        }

        #[test]
        fn the_last_of_equal_keys_has_its_value(pairs in prop::collection::vec((0..40_u8, any::<u32>()), 0..120)) {
            let other: BTreeMap<u8, u32> = pairs.iter().copied().collect();
            let collected: SortedMap<u8, u32> = pairs.iter().copied().collect();
            prop_assert!(is_the_same(&collected, &other));
            let mut extended = SortedMap::default();
            extended.extend(pairs);
            prop_assert_eq!(extended, collected);
        }

        #[test]
        fn sets_are_those_of_the_standard_library(elements in prop::collection::vec((0..40_u8, 0..4_u8), 0..120)) {
            let (mut own, mut other) = (SortedSet::new(), BTreeSet::new());
            for (element, method) in &elements {
                match method {
                    0..2 => prop_assert_eq!(own.insert(*element), other.insert(*element)),
                    2 => prop_assert_eq!(own.remove(element), other.remove(element)),
                    _ => prop_assert_eq!(own.pop_last(), other.pop_last()),
                }
                prop_assert!(own.iter().eq(&other));
                prop_assert_eq!(own.contains(element), other.contains(element));
            }
            let all = elements.iter().map(|(element, _)| *element);
            let (mut own, mut other): (SortedSet<u8>, BTreeSet<u8>) = (all.clone().collect(), all.clone().collect());
            prop_assert!(own.iter().eq(&other));
            own.extend(all.clone().map(|element| element / 2));
            other.extend(all.map(|element| element / 2));
            own.retain(|element| element % 3 != 0);
            other.retain(|element| element % 3 != 0);
            prop_assert!(own.into_iter().eq(other));
        }

        #[test]
        fn orders_are_those_of_the_standard_library(a in prop::collection::vec((0..4_u8, 0..3_u8), 0..4), b in prop::collection::vec((0..4_u8, 0..3_u8), 0..4)) {
            let own = |pairs: &[(u8, u8)]| pairs.iter().copied().collect::<SortedMap<_, _>>();
            let other = |pairs: &[(u8, u8)]| pairs.iter().copied().collect::<BTreeMap<_, _>>();
            prop_assert_eq!(own(&a).cmp(&own(&b)), other(&a).cmp(&other(&b)));
            prop_assert_eq!(own(&a) == own(&b), other(&a) == other(&b));
        }
    }

    #[test]
    fn arrays_are_sorted() {
        let map = SortedMap::from([("b", 1), ("a", 2), ("b", 3)]);
        assert_eq!(
            map.iter().copied().collect::<Vec<_>>(),
            [("a", 2), ("b", 3)]
        );
        assert_eq!((map["a"], map["b"]), (2, 3));
        let set = SortedSet::from(["b", "a", "b"]);
        assert_eq!(set.into_iter().collect::<Vec<_>>(), ["a", "b"]);
    }
}
