//! Settings as a file to edit: every key with its unit, its range and what it does, as `configs/default.toml` has them.

use super::{PRESETS, Settings};

const HEAD: &str = "\
# Settings of gravelometer, for --config. Keys may be left out: the default holds then.
";
/// Comments begin here, or right behind a longer value.
const COMMENT_COLUMN: usize = 27;

impl Settings {
    /// A settings file with these values, which [`Settings::load`] reads back as they are.
    ///
    /// # Errors
    /// None that are known: all settings are numbers, texts and lists of them.
    pub fn printed(&self) -> Result<String, toml::ser::Error> {
        let [(_, lines), ..] = PRESETS;
        let values = toml::Table::try_from(self)?;
        let mut section = "";
        let mut text = HEAD.to_owned();
        for line in lines.lines().skip_while(|line| line.starts_with('#')) {
            let comment = line.split_once('#').map(|(_, comment)| format!("#{comment}"));
            if let Some(name) = line.strip_prefix('[').and_then(|rest| rest.split(']').next()) {
                section = name;
            }
            let key = line.split('=').next().unwrap_or_default().trim();
            // A key of the file that the program does not know would have failed its test.
            match values.get(section).and_then(|section| section.get(key)) {
                Some(value) => {
                    let pair = format!("{key} = {value}");
                    let comment = comment.unwrap_or_default();
                    let gap = COMMENT_COLUMN.saturating_sub(pair.len()).max(1);
                    let gap = if comment.is_empty() { 0 } else { gap };
                    text += &format!("{pair}{:gap$}{comment}\n", "");
                }
                None => text += &format!("{line}\n"),
            }
        }
        Ok(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_is_printed_with_all_keys_and_comments_and_reads_back() {
        for (name, _) in PRESETS {
            let settings =
                Settings::load(Some(name.as_ref()), &["input.crs='''a # \"b\"  \n\t\\ c'''".into()]).expect("a preset");
            let text = settings.printed().expect("TOML");
            let read: Settings = toml::from_str(&text).expect("TOML");
            assert_eq!(read, settings, "{name}:\n{text}");
            let keys = |text: &str| {
                text.parse::<toml::Table>()
                    .expect("TOML")
                    .values()
                    .map(|s| s.as_table().map_or(0, toml::Table::len))
                    .sum::<usize>()
            };
            assert_eq!(keys(&text), keys(&toml::to_string(&settings).expect("TOML")), "{name}");
            assert!(text.contains("# m; widest grain"), "{text}");
        }
    }
}
