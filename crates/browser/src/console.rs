//! Messages of a page's console.

use serde_json::Value;

/// One message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConsoleEntry {
    /// Whether it is an error: of a script, a policy, or a file that is missing.
    pub is_error: bool,
    /// Where it is from: `console-api`, `javascript`, `network`, `security`.
    pub source: String,
    /// The place in the sources, and the text.
    pub message: String,
}

impl ConsoleEntry {
    /// The message in an event of the DevTools protocol, where the event has one.
    pub(crate) fn read(event: &Value) -> Option<Self> {
        let parameters = &event["params"];
        let (is_error, source, place, text) = match event["method"].as_str()? {
            "Runtime.consoleAPICalled" => {
                let arguments: Vec<String> = parameters["args"].as_array()?.iter().map(text_of_object).collect();
                let place = &parameters["stackTrace"]["callFrames"][0];
                (is_level_of_errors(&parameters["type"]), "console-api", place, arguments.join(" "))
            }
            "Runtime.exceptionThrown" => {
                let details = &parameters["exceptionDetails"];
                (true, "javascript", details, text_of_exception(details))
            }
            "Log.entryAdded" => {
                let entry = &parameters["entry"];
                let text = entry["text"].as_str()?.to_owned();
                (is_level_of_errors(&entry["level"]), entry["source"].as_str()?, entry, text)
            }
            _ => return None,
        };
        let url = place["url"].as_str().unwrap_or("-");
        let message = format!("{url} {}:{} {text}", place["lineNumber"], place["columnNumber"]);
        Some(Self { is_error, source: source.to_owned(), message })
    }

    /// Whether it is about a connection, which a test may have cut.
    #[must_use]
    pub fn is_of_network(&self) -> bool {
        self.source == "network" || self.message.contains("WebSocket connection to")
    }
}

/// A level of `Log.entryAdded`, or a type of `Runtime.consoleAPICalled`.
fn is_level_of_errors(name: &Value) -> bool {
    matches!(name.as_str(), Some("error" | "assert"))
}

/// The text of a `Runtime.RemoteObject`.
fn text_of_object(object: &Value) -> String {
    let text = object["value"].as_str().or(object["description"].as_str());
    text.map_or_else(|| object["value"].to_string(), str::to_owned)
}

/// The text of `Runtime.ExceptionDetails`.
pub(crate) fn text_of_exception(details: &Value) -> String {
    format!("{} {}", details["text"].as_str().unwrap_or_default(), text_of_object(&details["exception"]))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn entry(method: &str, parameters: Value) -> ConsoleEntry {
        ConsoleEntry::read(&json!({ "method": method, "params": parameters })).unwrap()
    }

    fn log(source: &str, text: &str) -> ConsoleEntry {
        entry("Log.entryAdded", json!({ "entry": { "level": "error", "source": source, "text": text } }))
    }

    #[test]
    fn a_lost_connection_is_told_from_a_fault_of_a_script() {
        let lost = log("javascript", "WebSocket connection to 'ws://…' failed: ");
        let missing = log("network", "Failed to load resource");
        let exception = json!({ "type": "object", "description": "TypeError: null is no object" });
        let details =
            json!({ "text": "Uncaught", "url": "main.js", "lineNumber": 9, "columnNumber": 1, "exception": exception });
        let fault = entry("Runtime.exceptionThrown", json!({ "exceptionDetails": details }));
        assert!([&lost, &missing, &fault].iter().all(|entry| entry.is_error));
        assert!(lost.is_of_network() && missing.is_of_network() && !fault.is_of_network());
        assert_eq!(fault.message, "main.js 9:1 Uncaught TypeError: null is no object");
        assert_eq!(ConsoleEntry::read(&json!({ "method": "Page.loadEventFired", "params": {} })), None);
    }

    #[test]
    fn a_message_of_a_script_has_its_level_and_all_of_its_texts() {
        let texts =
            json!([{ "type": "string", "value": "hello" }, { "type": "number", "value": 2, "description": "2" }]);
        let greeting = entry("Runtime.consoleAPICalled", json!({ "type": "log", "args": texts }));
        assert_eq!((greeting.is_error, greeting.source.as_str()), (false, "console-api"));
        assert!(greeting.message.ends_with("hello 2"));
        assert!(entry("Runtime.consoleAPICalled", json!({ "type": "assert", "args": texts })).is_error);
    }
}
