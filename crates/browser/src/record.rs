//! What a page has reported: its documents and its console.

use serde_json::Value;

use crate::console::ConsoleEntry;

/// Everything that the events of a page have reported so far.
#[derive(Debug, Default)]
pub(crate) struct PageRecord {
    pub(crate) console: Vec<ConsoleEntry>,
    /// Documents of the page itself, without those of its frames, from the first to the last.
    documents: Vec<Document>,
}

#[derive(Debug)]
struct Document {
    /// Identifies the navigation that brought the document.
    loader: String,
    is_loaded: bool,
}

impl PageRecord {
    /// Reads an event of the DevTools protocol.
    pub(crate) fn read(&mut self, event: &Value) {
        self.console.extend(ConsoleEntry::read(event));
        let parameters = &event["params"];
        match event["method"].as_str() {
            Some("Page.frameNavigated") if parameters["frame"]["parentId"].is_null() => {
                let loader = parameters["frame"]["loaderId"].as_str().unwrap_or_default().to_owned();
                self.documents.push(Document { loader, is_loaded: false });
            }
            Some("Page.lifecycleEvent") if parameters["name"] == "load" => {
                let loaded = self.documents.iter_mut().filter(|document| parameters["loaderId"] == document.loader);
                loaded.for_each(|document| document.is_loaded = true);
            }
            _ => {}
        }
    }

    /// Whether the document of a navigation is loaded, or one that has taken its place meanwhile.
    pub(crate) fn is_loaded(&self, loader: &str) -> bool {
        let mut since = self.documents.iter().skip_while(|document| document.loader != loader);
        since.any(|document| document.is_loaded)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_page_is_loaded_when_its_document_or_a_later_one_is() {
        let mut record = PageRecord::default();
        let mut read = |method: &str, parameters: Value| {
            record.read(&json!({ "method": method, "params": parameters }));
            ["first", "second"].map(|loader| record.is_loaded(loader))
        };
        let load = |loader: &str| json!({ "frameId": "1", "loaderId": loader, "name": "load" });
        assert_eq!(read("Page.lifecycleEvent", load("blank")), [false, false]);
        assert_eq!(read("Page.frameNavigated", json!({ "frame": { "id": "1", "loaderId": "first" } })), [false, false]);
        let inner = json!({ "frame": { "id": "2", "parentId": "1", "loaderId": "inner" } });
        assert_eq!(read("Page.frameNavigated", inner), [false, false]);
        assert_eq!(read("Page.lifecycleEvent", load("inner")), [false, false]);
        assert_eq!(
            read("Page.frameNavigated", json!({ "frame": { "id": "1", "loaderId": "second" } })),
            [false, false]
        );
        assert_eq!(read("Page.lifecycleEvent", load("second")), [true, true]);
    }
}
