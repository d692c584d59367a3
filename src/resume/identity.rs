//! What a run is a run of: everything that its result depends on, name by name.

use crate::open::Reach;
use crate::settings::{Method, Settings};
use crate::triangulate::METHOD;
use serde_json::{Map, Value};
use twox_hash::XxHash3_64;

/// Names and values of what matters to some part of the work.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Identity(Map<String, Value>);

/// A name whose value changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Change {
    /// What changed, such as `segment.concave_below`.
    pub name: String,
    /// What it was, or nothing.
    pub was: String,
    /// What it is, or nothing.
    pub is: String,
}

impl Identity {
    /// Of the surface: the index depends on nothing else.
    pub(super) fn of_survey(reach: &Reach, settings: &Settings) -> Identity {
        let mut names = Map::new();
        names.insert("program version".into(), env!("CARGO_PKG_VERSION").into());
        names.insert("number of inputs".into(), reach.files().len().into());
        for (i, file) in reach.files().iter().enumerate() {
            names.insert(format!("input {}", i + 1), serde_json::json!(file.fingerprint()));
        }
        if reach.files().len() > 1 && !reach.is_cloud() {
            names.insert("input.weld_m".into(), settings.input.weld_m.into());
        }
        let frame = reach.frame();
        names.insert("unit of the input, metres".into(), frame.metres_per_input_unit.to_string().into());
        names.insert("origin, input units".into(), format!("{:?}", frame.origin_input).into());
        let mut identity = Identity(names);
        if reach.is_cloud() {
            identity.0.insert("method of the surface".into(), METHOD.into());
            identity.add("surface", serde_json::json!(settings.surface));
        }
        identity
    }

    /// With what the curvature depends on as well.
    pub(super) fn and_curvature(mut self, settings: &Settings) -> Identity {
        self.add("curvature", serde_json::json!(settings.curvature));
        self
    }

    /// With what the grains of a tile depend on as well.
    pub(super) fn and_grains(mut self, settings: &Settings, outline_step_m: f64) -> Identity {
        self.add("segment", serde_json::json!(settings.segment));
        self = match settings.segment.method {
            Method::Rheinwalt2025 => self.and_curvature(settings),
            Method::Valleys => {
                self.add("valleys", serde_json::json!(settings.valleys));
                self
            }
        };
        let prior = settings.measure.shape_prior();
        for (name, value) in [
            ("prior_c_over_b", prior.c_over_b),
            ("prior_c_over_b_spread", prior.c_over_b_spread),
            ("prior_b_over_a", prior.b_over_a),
            ("prior_b_over_a_spread", prior.b_over_a_spread),
        ] {
            self.0.insert(format!("measure.{name}"), value.into());
        }
        self.0.insert("output.labelled_mesh".into(), settings.output.labelled_mesh.into());
        self.0.insert("output.labelled_cloud".into(), settings.output.labelled_cloud.into());
        self.0.insert("step of outlines, metres".into(), outline_step_m.to_string().into());
        self
    }

    /// With everything that any result depends on as well: of side files what they say, not how they are called.
    pub(super) fn and_all(mut self, reach: &Reach, settings: &Settings) -> Identity {
        if let Value::Object(sections) = serde_json::json!(settings) {
            // How the work is cut never changes a result.
            let others = sections.into_iter().filter(|(name, _)| name != "work" && name != "input");
            others.for_each(|(name, values)| self.add(&name, values));
        }
        let frame = reach.frame();
        self.0.insert("input.unit".into(), frame.metres_per_input_unit.to_string().into());
        self.0.insert("input.offset".into(), format!("{:?}", frame.offset_map).into());
        let crs = frame.crs.as_ref().map(|crs| {
            // All of the WKT counts, but a page of it would hide what else has changed.
            let wkt = XxHash3_64::oneshot(crs.wkt.as_bytes());
            format!("{} ({}), WKT {wkt:016x}", crs.name, crs.authority.as_deref().unwrap_or("no code"))
        });
        self.0.insert("input.crs".into(), crs.into());
        self
    }

    fn add(&mut self, section: &str, values: Value) {
        if let Value::Object(values) = values {
            self.0.extend(values.into_iter().map(|(name, value)| (format!("{section}.{name}"), value)));
        }
    }

    /// As one line of text, the same for the same values.
    pub(super) fn text(&self) -> String {
        Value::Object(self.0.clone()).to_string()
    }

    /// What the text of an earlier run says otherwise; everything, if it is no such text.
    pub(super) fn changes_since(&self, earlier: &str) -> Vec<Change> {
        let earlier: Map<String, Value> = serde_json::from_str(earlier).unwrap_or_default();
        let names: std::collections::BTreeSet<&String> = earlier.keys().chain(self.0.keys()).collect();
        let shown = |value: Option<&Value>| value.map_or_else(|| "nothing".to_owned(), Value::to_string);
        names
            .into_iter()
            .filter(|&name| earlier.get(name) != self.0.get(name))
            .map(|name| Change { name: name.clone(), was: shown(earlier.get(name)), is: shown(self.0.get(name)) })
            .collect()
    }
}

impl std::fmt::Display for Change {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} was {} and is {}", self.name, self.was, self.is)
    }
}
