//! Any text is settings or is refused by name, and settings that were taken can be written and taken again.

use gravelometer::settings::Settings;
use std::io::Write;

/// Loads what stands before the first NUL as a settings file, and each line behind it as an assignment.
pub(crate) fn check(bytes: &[u8]) {
    let split = bytes.iter().position(|&b| b == 0).unwrap_or(bytes.len());
    let assignments: Vec<String> =
        bytes[split..].split(|&b| b == b'\n' || b == 0).skip(1).map(|l| String::from_utf8_lossy(l).into()).collect();
    match load(&bytes[..split], &assignments) {
        Err(message) => assert!(message.contains("\nhelp: "), "names a remedy: {message}"),
        Ok(settings) => {
            settings.check().expect("loaded settings are within their ranges");
            let text = toml::to_string(&settings).expect("settings can be written");
            assert_eq!(load(text.as_bytes(), &[]).expect("settings that were written can be read"), settings);
        }
    }
}

fn load(text: &[u8], assignments: &[String]) -> Result<Settings, String> {
    let mut file = tempfile::Builder::new().suffix(".toml").tempfile().expect("a file");
    file.write_all(text).expect("room");
    Settings::load(Some(file.path()), assignments).map_err(|e| e.to_string())
}
