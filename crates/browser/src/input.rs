//! Real input: events that the browser makes from those of a device, as from a person's hand. Places are in CSS pixels of the
//! page's view, from its upper left corner.

use std::time::Duration;

use serde_json::{Value, json};
use tokio::time::{MissedTickBehavior, interval};

use crate::browser::Browser;
use crate::error::BrowserError;
use crate::key::{Key, SHIFT};

/// A place in the view: columns and rows.
pub type Place = [f64; 2];

/// A button of the mouse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MouseButton {
    /// The main button.
    #[default]
    Left,
    /// The button of the context menu.
    Right,
}

impl MouseButton {
    /// The name of the button, and its bit among the buttons that are down.
    fn name_and_bit(self) -> (&'static str, u32) {
        match self {
            Self::Left => ("left", 1),
            Self::Right => ("right", 2),
        }
    }
}

/// A drag of the mouse: a press at the first place, a move to each further one, and a release at the last.
#[derive(Debug, Clone, PartialEq)]
pub struct Drag {
    /// The button that is down.
    pub button: MouseButton,
    /// Whether Shift is down.
    pub is_shifted: bool,
    /// At least one place.
    pub path: Vec<Place>,
    /// The least time between two events.
    pub interval: Duration,
}

impl Drag {
    /// A drag along a path, at the rate of a fast display.
    #[must_use]
    pub fn along(path: Vec<Place>) -> Self {
        Self { button: MouseButton::Left, is_shifted: false, path, interval: Duration::from_millis(8) }
    }
}

/// What fingers do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TouchPhase {
    /// One more finger is on the screen.
    Start,
    /// Fingers have moved.
    Move,
    /// A finger is gone.
    End,
}

impl Browser {
    /// Drags the mouse.
    ///
    /// # Errors
    /// The browser refuses an event.
    pub async fn drag(&self, drag: &Drag) -> Result<(), BrowserError> {
        let (Some(first), Some(last)) = (drag.path.first(), drag.path.last()) else { return Ok(()) };
        let mut ticks = interval(drag.interval.max(Duration::from_micros(1)));
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        self.mouse("mousePressed", *first, drag).await?;
        for place in &drag.path[1..] {
            ticks.tick().await;
            self.mouse("mouseMoved", *place, drag).await?;
        }
        self.mouse("mouseReleased", *last, drag).await
    }

    async fn mouse(&self, event: &str, [x, y]: Place, drag: &Drag) -> Result<(), BrowserError> {
        let is_down = event != "mouseReleased";
        let (name, bit) = drag.button.name_and_bit();
        let parameters = json!({
            "type": event, "x": x, "y": y, "button": name, "clickCount": 1, "buttons": if is_down { bit } else { 0 },
            "modifiers": if drag.is_shifted { SHIFT } else { 0 },
        });
        self.devtools("Input.dispatchMouseEvent", parameters).await.map(drop)
    }

    /// Clicks at a place, once or twice.
    ///
    /// # Errors
    /// The browser refuses an event.
    pub async fn click_at(&self, [x, y]: Place, times: u32) -> Result<(), BrowserError> {
        for count in 1..=times {
            for event in ["mousePressed", "mouseReleased"] {
                let parameters = json!({ "type": event, "x": x, "y": y, "button": "left", "clickCount": count });
                self.devtools("Input.dispatchMouseEvent", parameters).await?;
            }
        }
        Ok(())
    }

    /// Clicks in the middle of the element that a CSS selector finds.
    ///
    /// # Errors
    /// There is none, or the browser refuses an event.
    pub async fn click(&self, selector: &str) -> Result<(), BrowserError> {
        let middle = "const r = document.querySelector(arguments[0]).getBoundingClientRect();
            return [r.x + r.width / 2, r.y + r.height / 2]";
        let place = self.run(middle, vec![selector.into()]).await?;
        self.click_at(place, 1).await
    }

    /// Turns the wheel at a place, by pixels; downwards is positive.
    ///
    /// # Errors
    /// The browser refuses the event.
    pub async fn wheel(&self, [x, y]: Place, delta_y: f64) -> Result<(), BrowserError> {
        let parameters = json!({ "type": "mouseWheel", "x": x, "y": y, "deltaX": 0, "deltaY": delta_y });
        self.devtools("Input.dispatchMouseEvent", parameters).await.map(drop)
    }

    /// Fingers touch the screen at these places, each finger at its place in the list.
    ///
    /// # Errors
    /// The browser refuses the event.
    pub async fn touch(&self, phase: TouchPhase, fingers: &[Place]) -> Result<(), BrowserError> {
        let event = match phase {
            TouchPhase::Start => "touchStart",
            TouchPhase::Move => "touchMove",
            TouchPhase::End => "touchEnd",
        };
        let points = fingers.iter().enumerate().map(|(id, [x, y])| json!({ "x": x, "y": y, "id": id }));
        let parameters = json!({ "type": event, "touchPoints": points.collect::<Vec<Value>>() });
        self.devtools("Input.dispatchTouchEvent", parameters).await.map(drop)
    }

    /// Presses and releases a key.
    ///
    /// # Errors
    /// The browser refuses an event.
    pub async fn press(&self, key: impl Into<Key>) -> Result<(), BrowserError> {
        let key = key.into();
        self.key_down(key).await?;
        self.key_up(key).await
    }

    /// Presses a key, which stays down.
    ///
    /// # Errors
    /// The browser refuses the event.
    pub async fn key_down(&self, key: impl Into<Key>) -> Result<(), BrowserError> {
        self.devtools("Input.dispatchKeyEvent", key.into().event(true)).await.map(drop)
    }

    /// Releases a key.
    ///
    /// # Errors
    /// The browser refuses the event.
    pub async fn key_up(&self, key: impl Into<Key>) -> Result<(), BrowserError> {
        self.devtools("Input.dispatchKeyEvent", key.into().event(false)).await.map(drop)
    }
}
