//! Settings that a file, a preset or somebody changed, and that the chosen method does not ask for.

use super::{Method, Settings};

/// Keys of `[segment]` that both methods ask for.
const OF_BOTH: [&str; 5] = ["method", "max_grain_m", "min_grain_area_m2", "min_grain_triangles", "area_rule"];

impl Settings {
    /// A warning that names the keys that are not those of the default and have no effect; none if there are none.
    pub fn without_effect(&self) -> Option<String> {
        let method = self.segment.method;
        let of_other = |section: &str, key: &str| match method {
            Method::Valleys => {
                let of_curvature = section == "curvature" || (section, key) == ("work", "instructions");
                of_curvature || (section == "segment" && !OF_BOTH.contains(&key))
            }
            Method::Rheinwalt2025 => section == "valleys" || (section, key) == ("measure", "min_confidence"),
        };
        let [these, default] = [self, &Settings::default()].map(|s| toml::Table::try_from(s).unwrap_or_default());
        let mut keys = Vec::new();
        for (section, value) in &these {
            for (key, value) in value.as_table().into_iter().flatten() {
                if of_other(section, key) && default.get(section).and_then(|s| s.get(key)) != Some(value) {
                    keys.push(format!("{section}.{key}"));
                }
            }
        }
        let name = match method {
            Method::Valleys => "valleys",
            Method::Rheinwalt2025 => "rheinwalt2025",
        };
        let keys = keys.join(", ");
        (!keys.is_empty())
            .then(|| format!("{keys}: no effect with the method {name}; `gravelometer run --help` has --method"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_of_the_other_method_are_named_and_only_those() {
        let with = |keys: &[&str]| {
            let keys: Vec<String> = keys.iter().map(|&key| key.to_owned()).collect();
            Settings::load(None, &keys).expect("settings").without_effect()
        };
        let changed = ["valleys.valley_depth=.05", "segment.min_sphericity=0.4", "measure.min_confidence=0.5"];
        assert_eq!(with(&[]), None);
        let named = with(&changed).expect("a warning");
        assert!(named.starts_with("segment.min_sphericity: no effect with the method valleys"), "{named}");
        let named = with(&[&changed[..], &["segment.method=rheinwalt2025"]].concat()).expect("a warning");
        assert!(named.starts_with("measure.min_confidence, valleys.valley_depth: no effect"), "{named}");
        assert!(with(&["work.instructions=scalar"]).is_some_and(|named| named.starts_with("work.instructions: ")));
    }

    #[test]
    fn presets_set_nothing_that_has_no_effect() {
        for (name, _) in super::super::PRESETS {
            let preset = Settings::load(Some(name.as_ref()), &[]).expect("preset");
            assert_eq!(preset.without_effect(), None, "{name}");
        }
    }
}
