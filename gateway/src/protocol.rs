//! Messages between a page and the gateway: JSON text, and pictures as binary messages. `docs/viewer-protocol.md` has
//! them for clients in other languages.

use bytes::{BufMut as _, Bytes, BytesMut};
use depth_image::LightCacheQuality;
use serde::de::{Deserializer, Error as _};
use serde::{Deserialize, Serialize};

use crate::camera::PageCamera;

/// The WebSocket's subprotocol: its name changes with its messages.
pub(crate) const SUBPROTOCOL: &str = "myriorama.v1";
/// Bytes of a page's longest message.
pub(crate) const MAX_MESSAGE_BYTES: usize = 16 << 10;

/// A page's messages.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum FromPage {
    /// The first message: a scene by name, or the first on offer.
    Open { scene: Option<String> },
    /// The camera from now on.
    Pose(Pose),
    /// A picture is on the screen, which gives back its credit.
    Shown {
        /// The number of its pose.
        number: u64,
        /// From the input event to the screen.
        age_ms: f64,
    },
    /// A part of a picture has arrived, and others follow.
    Received {},
}

/// A pose of the visitor's camera.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Pose {
    /// It rises from pose to pose.
    pub(crate) number: u64,
    /// The camera.
    pub(crate) camera: PageCamera,
    /// Columns and rows of the canvas, in device pixels.
    pub(crate) canvas_px: [u32; 2],
    /// The moment of a scene that moves; the first where none is named.
    #[serde(default)]
    pub(crate) moment: u32,
    /// Whether the camera rests: the picture is then lossless and of the canvas's size.
    pub(crate) still: bool,
    /// The quality of shared light in stills, and at most in motion; the welcome's where none is named.
    #[serde(default, deserialize_with = "quality")]
    pub(crate) quality: Option<LightCacheQuality>,
}

/// A quality by its name.
pub(crate) fn quality<'de, D: Deserializer<'de>>(text: D) -> Result<Option<LightCacheQuality>, D::Error> {
    let Some(text) = Option::<String>::deserialize(text)? else { return Ok(None) };
    LightCacheQuality::named(&text).map(Some).ok_or_else(|| {
        let names = LightCacheQuality::ALL.map(LightCacheQuality::name).join(", ");
        D::Error::custom(format!("quality: {text:?}, must be one of {names}"))
    })
}

/// The gateway's messages.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub(crate) enum ToPage {
    /// The first message.
    Welcome {
        /// The program's version.
        version: &'static str,
        /// Names of the scenes on offer.
        scenes: Vec<String>,
        /// The scene that is shown.
        scene: String,
        /// A camera in front of it.
        home: PageCamera,
        /// The least and the greatest corner of its bounds, in the file's coordinates.
        bounds: [[f64; 3]; 2],
        /// Steps in which the light of a still is refined.
        light_steps: u32,
        /// Samples a pixel of a finished still.
        still_samples: u32,
        /// The quality of shared light in stills for which no other is asked.
        quality: &'static str,
        /// Moments of a scene that moves; 1 for one that never moves.
        moments: u32,
        /// The time between two moments.
        moment_step_s: f64,
        /// Columns and rows of the largest still.
        max_still_px: [u32; 2],
    },
    /// The connection is alive, from time to time.
    Alive,
    /// Why there are no pictures at the moment.
    Waiting(Waiting),
    /// The plan in force: pictures come.
    Plan {
        /// Its number.
        epoch: u64,
        /// The policy.
        policy: String,
        /// Why it is in force.
        reason: String,
        /// Whether views share light, so that they have a quality.
        shares_light: bool,
        /// The promise to the sessions of the scene; `None` without a budget.
        promise: Option<String>,
    },
    /// The connection ends for a fault of the page's.
    Refused {
        /// A sentence that names the field.
        reason: String,
    },
}

/// Why there are no pictures, or no session.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Waiting {
    /// `full`, `connecting`, `measuring`, `planning`, `preparing` or `reconnecting`.
    pub(crate) stage: &'static str,
    /// A sentence.
    pub(crate) detail: String,
}

/// The header of a picture.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct PictureHeader {
    /// The number of its pose.
    pub(crate) number: u64,
    /// Whether it is lossless and of the canvas's size.
    pub(crate) still: bool,
    /// `image/jpeg` or `image/png`.
    pub(crate) media_type: &'static str,
    /// That of a JPEG, from 1 to 100.
    pub(crate) jpeg_quality: Option<u8>,
    /// Columns and rows.
    pub(crate) size_px: [u32; 2],
    /// The length of its file.
    pub(crate) bytes: usize,
    /// The least round trip to the page so far, once it is known.
    pub(crate) rtt_ms: Option<f64>,
    /// The camera that it shows.
    pub(crate) camera: PageCamera,
    /// The sample set, as `plan_epoch.set_index`.
    pub(crate) set: String,
    /// The view cell.
    pub(crate) cell: u32,
    /// The step of its light, from 1 to the welcome's `light_steps`.
    pub(crate) light_step: u32,
    /// Samples a pixel, from 1 to the welcome's `still_samples`.
    pub(crate) samples: u32,
    /// Whether the cell is a neighbour of the view's own, which is not loaded yet.
    pub(crate) neighbour: bool,
    /// The quality of its shared light; `None` where the light is not shared.
    pub(crate) quality: Option<&'static str>,
    /// Whether it was drawn from the scene, without samples.
    pub(crate) direct: bool,
    /// Whether a better picture of the pose follows.
    pub(crate) more: bool,
    /// The compositor that made it.
    pub(crate) compositor: String,
    /// Poses that were replaced by newer ones since the picture before.
    pub(crate) replaced: u64,
    /// Where its time went.
    pub(crate) times_ms: PictureTimes,
}

/// Durations: clocks of machines differ. The parts add up to `gateway`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Default)]
pub(crate) struct PictureTimes {
    /// The whole time at the gateway and behind it, from the pose's arrival to the picture's departure.
    pub(crate) gateway: f64,
    /// Until the pose left for the compositor.
    pub(crate) to_send: f64,
    /// On the way to the compositor and back.
    pub(crate) cluster_network: f64,
    /// For the sample set.
    pub(crate) set: f64,
    /// For pictures before it.
    pub(crate) credit: f64,
    /// For the device.
    pub(crate) queue: f64,
    /// The batch on the device.
    pub(crate) reconstruct: f64,
    /// Encoding.
    pub(crate) encode: f64,
    /// For an encoder, and to go out.
    pub(crate) send: f64,
    /// In the gateway, after its arrival.
    pub(crate) forward: f64,
}

/// A message as text.
pub(crate) fn text(message: &ToPage) -> String {
    serde_json::to_string(message).unwrap_or_else(|error| format!(r#"{{"type":"refused","reason":"{error}"}}"#))
}

/// A picture as one message: the header's length as a little-endian u32, the header as JSON, the picture.
pub(crate) fn picture(header: &PictureHeader, data: &[u8]) -> Bytes {
    let header = serde_json::to_vec(header).unwrap_or_default();
    let mut message = BytesMut::with_capacity(4 + header.len() + data.len());
    message.put_u32_le(header.len() as u32);
    message.extend_from_slice(&header);
    message.extend_from_slice(data);
    message.freeze()
}

/// A further part of a picture: no header, and its bytes.
pub(crate) fn continued(part: &[u8]) -> Bytes {
    [&0_u32.to_le_bytes(), part].concat().into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::tests::CAMERA;

    const POSE: &str = r#"{"type":"pose","number":7,"canvas_px":[640,360],"still":true,
        "camera":{"eye":[100,2,3],"target":[100,0,0],"fov_y_deg":40}}"#;

    #[test]
    fn a_pose_is_read() {
        let pose = Pose { number: 7, camera: CAMERA, canvas_px: [640, 360], moment: 0, still: true, quality: None };
        assert_eq!(serde_json::from_str::<FromPage>(POSE).unwrap(), FromPage::Pose(pose));
        assert_eq!(serde_json::from_str::<FromPage>(r#"{"type":"open"}"#).unwrap(), FromPage::Open { scene: None });
    }

    #[test]
    fn what_is_not_in_the_protocol_is_refused() {
        let replaced =
            [("\"still\":true", "\"still\":true,\"method\":\"mesh\""), ("7", "-7"), ("7", "1e99"), ("640,", "")];
        for (from, to) in replaced {
            let text = POSE.replacen(from, to, 1);
            assert!(serde_json::from_str::<FromPage>(&text).is_err(), "{text}");
        }
        for text in ["", "[]", "null", r#"{"type":"render"}"#, r#"{"type":"open","scene":null,"codec":"png"}"#] {
            assert!(serde_json::from_str::<FromPage>(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_picture_follows_its_header() {
        let header = PictureHeader {
            number: 3,
            still: false,
            media_type: "image/jpeg",
            jpeg_quality: Some(70),
            size_px: [32, 18],
            bytes: 4,
            rtt_ms: None,
            camera: CAMERA,
            set: "4.0".to_owned(),
            cell: 1,
            light_step: 1,
            samples: 1,
            neighbour: false,
            quality: None,
            direct: false,
            more: false,
            compositor: "n0".to_owned(),
            replaced: 2,
            times_ms: PictureTimes { gateway: 12.5, ..PictureTimes::default() },
        };
        let message = picture(&header, b"data");
        let (length, rest) = message.split_at(4);
        let (json, data) = rest.split_at(u32::from_le_bytes(length.try_into().unwrap()) as usize);
        let json: serde_json::Value = serde_json::from_slice(json).unwrap();
        assert_eq!(
            (json["number"].as_u64(), json["times_ms"]["gateway"].as_f64(), data),
            (Some(3), Some(12.5), &b"data"[..])
        );
    }
}
