//! JSON objects of numbers, read strictly.

use std::collections::BTreeMap;

use serde::de::{Deserialize, Deserializer, Error, MapAccess, Visitor};

/// Numbers by name, no name twice: JSON allows that, and serde's maps keep the last.
#[derive(Debug, Clone, PartialEq)]
pub struct NumbersByName(pub BTreeMap<String, f64>);

impl<'de> Deserialize<'de> for NumbersByName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader;

        impl<'de> Visitor<'de> for Reader {
            type Value = NumbersByName;

            fn expecting(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
                formatter.write_str("numbers by name")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<NumbersByName, A::Error> {
                let mut values = BTreeMap::new();
                while let Some((name, value)) = map.next_entry::<String, f64>()? {
                    if values.insert(name.clone(), value).is_some() {
                        return Err(A::Error::custom(format!("{name} stands there twice")));
                    }
                }
                Ok(NumbersByName(values))
            }
        }

        deserializer.deserialize_map(Reader)
    }
}
