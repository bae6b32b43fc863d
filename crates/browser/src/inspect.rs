//! What a person, or an aid for one, finds in a page: pictures, names, memory.

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde_json::{Value, json};

use crate::browser::Browser;
use crate::error::BrowserError;

/// A part of a page, as screen readers see it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AccessibleNode {
    /// Such as `button` or `image`.
    pub role: String,
    /// What a screen reader says.
    pub name: String,
    /// Whether the keyboard reaches it.
    pub is_focusable: bool,
}

impl AccessibleNode {
    /// A node of the DevTools protocol, unless screen readers skip it.
    fn read(node: &Value) -> Option<Self> {
        let [role, name] = ["role", "name"].map(|field| node[field]["value"].as_str().unwrap_or_default().to_owned());
        let properties = node["properties"].as_array();
        let is_focusable = properties.into_iter().flatten().any(|property| property["name"] == "focusable");
        let is_seen = node["ignored"] != true;
        is_seen.then_some(Self { role, name, is_focusable })
    }
}

/// Pixels of a canvas.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pixels {
    /// Columns and rows.
    pub size_px: [u32; 2],
    /// Red, green and blue of each pixel, row by row from the top.
    pub srgb8: Vec<u8>,
    /// The opacity of each pixel.
    pub alpha: Vec<u8>,
}

/// A canvas as bytes of four channels. A text of all bytes is made in pieces, as a call takes no million arguments.
const READ_CANVAS: &str = "const canvas = document.querySelector(arguments[0]);
    const { width, height } = canvas;
    const { data } = canvas.getContext('2d').getImageData(0, 0, width, height);
    let text = '';
    for (let at = 0; at < data.length; at += 8192) text += String.fromCharCode(...data.subarray(at, at + 8192));
    return [width, height, btoa(text)]";

impl Browser {
    /// The page's accessibility tree, as a list.
    ///
    /// # Errors
    /// The browser refuses it.
    pub async fn accessible_nodes(&self) -> Result<Vec<AccessibleNode>, BrowserError> {
        const METHOD: &str = "Accessibility.getFullAXTree";
        let tree = self.devtools(METHOD, json!({})).await?;
        let nodes = tree["nodes"].as_array().ok_or_else(|| BrowserError::answer(METHOD, &tree, "no nodes"))?;
        Ok(nodes.iter().filter_map(AccessibleNode::read).collect())
    }

    /// The pixels of the canvas that a CSS selector finds.
    ///
    /// # Errors
    /// There is none, or it is empty.
    pub async fn canvas(&self, selector: &str) -> Result<Pixels, BrowserError> {
        let (width, height, text): (u32, u32, String) = self.run(READ_CANVAS, vec![selector.into()]).await?;
        let rgba = BASE64_STANDARD.decode(&text);
        let rgba = rgba.map_err(|error| BrowserError::answer(READ_CANVAS, text, error))?;
        let srgb8 = rgba.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
        let alpha = rgba.chunks_exact(4).map(|pixel| pixel[3]).collect();
        Ok(Pixels { size_px: [width, height], srgb8, alpha })
    }

    /// The view as a PNG.
    ///
    /// # Errors
    /// The browser refuses it.
    pub async fn screenshot_png(&self) -> Result<Vec<u8>, BrowserError> {
        const METHOD: &str = "Page.captureScreenshot";
        let answer = self.devtools(METHOD, json!({ "format": "png" })).await?;
        let png = BASE64_STANDARD.decode(answer["data"].as_str().unwrap_or_default());
        png.map_err(|error| BrowserError::answer(METHOD, answer, error))
    }

    /// The memory of the page's live objects and of their buffers, after a collection of garbage.
    ///
    /// # Errors
    /// The browser refuses it.
    pub async fn heap_bytes(&self) -> Result<f64, BrowserError> {
        const METHOD: &str = "Runtime.getHeapUsage";
        self.devtools("HeapProfiler.collectGarbage", json!({})).await?;
        let usage = self.devtools(METHOD, json!({})).await?;
        let objects = usage["usedSize"].as_f64();
        let objects = objects.ok_or_else(|| BrowserError::answer(METHOD, &usage, "no usedSize"))?;
        Ok(objects + usage["backingStorageSize"].as_f64().unwrap_or_default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_has_its_role_and_name_unless_it_is_ignored() {
        let node = |ignored: bool| {
            json!({
                "ignored": ignored, "role": { "value": "button" }, "name": { "value": "Reset" },
                "properties": [{ "name": "focusable", "value": { "type": "boolean", "value": true } }],
            })
        };
        let button = AccessibleNode { role: "button".to_owned(), name: "Reset".to_owned(), is_focusable: true };
        assert_eq!(AccessibleNode::read(&node(false)), Some(button));
        assert_eq!(AccessibleNode::read(&node(true)), None);
    }
}
