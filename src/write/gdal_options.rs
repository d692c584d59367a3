//! GDAL's options for the files of a run.

use gdal::config::{clear_thread_local_config_option, set_thread_local_config_option};
use gdal::errors::Result;

/// One option and its value.
type Setting = (&'static str, &'static str);

/// Options that hold on this thread while this lives.
pub(crate) struct GdalOptions(&'static [Setting]);

impl GdalOptions {
    /// The format of a GeoPackage wants a time of last change: a fixed one, so that equal runs give equal files.
    pub(crate) const FIXED_DATE: Setting = ("OGR_CURRENT_DATE", "1970-01-01T00:00:00.000Z");
    /// GDAL reads all tile matrix sets of the world before it compares our creation options with its list, and
    /// then only warns.
    pub(crate) const NO_VALIDATION: Setting = ("GDAL_VALIDATE_CREATION_OPTIONS", "NO");
    /// No file for undoing a transaction: an unfinished GeoPackage is never mended, it is removed.
    pub(crate) const JOURNAL_IN_MEMORY: Setting = ("OGR_SQLITE_JOURNAL", "MEMORY");
    /// No flush after each transaction: the whole file is flushed before it gets its name.
    pub(crate) const FLUSHED_LATER: Setting = ("OGR_SQLITE_SYNCHRONOUS", "OFF");

    /// Sets them.
    pub(crate) fn set(settings: &'static [Setting]) -> Result<GdalOptions> {
        // Made first, so that those set before a failure are cleared.
        let options = GdalOptions(settings);
        settings.iter().try_for_each(|(name, value)| set_thread_local_config_option(name, value))?;
        Ok(options)
    }
}

impl Drop for GdalOptions {
    fn drop(&mut self) {
        for (name, _) in self.0 {
            // Fails for a name with a NUL byte only, and none has one.
            let _ = clear_thread_local_config_option(name);
        }
    }
}
