//! What GDAL says: kept for our errors instead of going to the terminal.
//!
//! One handler serves the whole process. It notes every message for the thread on which it was said, since
//! GDAL survives some failures without giving them back: closing a file before GDAL 3.7, for one.

use gdal::errors::CplErrType;
use std::cell::RefCell;
use std::sync::Once;

thread_local! {
    static MESSAGES: RefCell<Vec<Message>> = const { RefCell::new(Vec::new()) };
}

struct Message {
    failure: bool,
    text: String,
}

/// Begins to note GDAL's messages on this thread, forgetting earlier ones.
pub fn listen_to_gdal() {
    static INSTALLED: Once = Once::new();
    INSTALLED.call_once(|| {
        gdal::config::set_error_handler(|class, _, text| {
            let failure = matches!(class, CplErrType::Failure | CplErrType::Fatal);
            MESSAGES.with_borrow_mut(|m| m.push(Message { failure, text: text.to_owned() }));
        });
    });
    MESSAGES.with_borrow_mut(Vec::clear);
}

/// The failures noted on this thread since it was last asked.
pub fn gdal_failures() -> Vec<String> {
    let noted = MESSAGES.with_borrow_mut(std::mem::take);
    noted.into_iter().filter(|m| m.failure).map(|m| m.text).collect()
}

/// The last thing said on this thread, failure or not; empty if nothing was.
pub(super) fn last_gdal_message() -> String {
    MESSAGES.with_borrow_mut(std::mem::take).pop().map(|m| m.text).unwrap_or_default()
}
