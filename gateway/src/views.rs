//! Single views over HTTP: pictures of their colour, depth or provenance, depth as numbers, and the surface at a pixel.

use std::sync::Arc;

use axum::extract::{Path, Query, State};
use axum::http::{HeaderName, HeaderValue, StatusCode};
use axum::response::Response;
use client::{ClientError, Frame, Session, ViewRequest};
use cluster::{DIRECT, SessionPlan};
use codec::{FrameCodec, encode_frame};
use depth_image::{Antialias, LightCacheQuality, PinholeCamera, PixelDepth, ProvenanceKind, View, ViewPlanes};
use glam::{UVec2, Vec2};
use pictures::Legend;
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::sync::OwnedSemaphorePermit;

use crate::camera::PageCamera;
use crate::gateway::{Gateway, VIEW_PLACES};
use crate::kept_session::KeptSession;
use crate::protocol;
use crate::responses::{Refusal, as_json, held};
use crate::scenes::SceneSessions;
use crate::still::PlannedLight;
use crate::visits::Visit;

/// The size of a view that names none.
const SIZE_PX: UVec2 = UVec2::new(640, 360);
/// The JPEG quality of views.
const QUALITY: u8 = 90;
/// Names of the colours of a picture, as JSON.
const LEGEND: HeaderName = HeaderName::from_static("myriorama-legend");

/// One view, and what is wanted of it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ViewQuery {
    scene: Option<String>,
    eye: Option<String>,
    target: Option<String>,
    fov: Option<f64>,
    size: Option<String>,
    #[serde(default)]
    show: Plane,
    at: Option<String>,
    #[serde(default)]
    moment: u32,
    #[serde(default, deserialize_with = "protocol::quality")]
    quality: Option<LightCacheQuality>,
}

/// The plane of a view that a picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Plane {
    #[default]
    Color,
    Depth,
    Provenance,
}

impl ViewQuery {
    fn camera(&self, scene: &SceneSessions, max_px: UVec2) -> Result<PinholeCamera, Refusal> {
        let page = PageCamera {
            eye: point_or("eye", self.eye.as_deref(), scene.home.eye)?,
            target: point_or("target", self.target.as_deref(), scene.home.target)?,
            fov_y_deg: self.fov.unwrap_or(scene.home.fov_y_deg),
        };
        let size_px = match &self.size {
            None => SIZE_PX.min(max_px),
            Some(text) => size(text).ok_or_else(|| Refusal::bad(format!("size: {text:?}, must be WIDTHxHEIGHT")))?,
        };
        if size_px.cmpgt(max_px).any() {
            return Err(Refusal::bad(format!("size: {size_px} is above {max_px}")));
        }
        scene.space.camera(&page, size_px).map_err(Refusal::bad)
    }

    /// The pixel that is asked for; the middle where none is named.
    fn pixel(&self, size_px: UVec2) -> Result<UVec2, Refusal> {
        let Some(text) = &self.at else { return Ok(size_px / 2) };
        let at = numbers(text).map(UVec2::from_array).filter(|at| at.cmplt(size_px).all());
        at.ok_or_else(|| Refusal::bad(format!("at: {text:?}, must be COLUMN,ROW within the view")))
    }
}

fn point_or(field: &str, text: Option<&str>, home: [f64; 3]) -> Result<[f64; 3], Refusal> {
    let Some(text) = text else { return Ok(home) };
    numbers(text).ok_or_else(|| Refusal::bad(format!("{field}: {text:?}, must be X,Y,Z")))
}

fn numbers<T: std::str::FromStr, const N: usize>(text: &str) -> Option<[T; N]> {
    let numbers: Option<Vec<T>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    numbers?.try_into().ok()
}

fn size(text: &str) -> Option<UVec2> {
    let (width, height) = text.split_once('x')?;
    Some(UVec2::new(width.parse().ok()?, height.parse().ok()?))
}

/// A scene that a request visits.
pub(crate) struct Visited {
    pub(crate) scene: Arc<SceneSessions>,
    pub(crate) camera: PinholeCamera,
    pub(crate) moment: u32,
    quality: LightCacheQuality,
    _visit: Visit,
}

impl Visited {
    /// The scene and the camera of a query, whose view is no larger than a still.
    pub(crate) async fn of(gateway: &Gateway, query: &ViewQuery) -> Result<Self, Refusal> {
        let scene = gateway.scenes.visit(query.scene.as_deref()).await?;
        let moment = query.moment;
        let moments = scene.timeline().set_count;
        if moment >= moments {
            return Err(Refusal::bad(format!("moment: {moment}, must be below {moments}")));
        }
        let visit = scene.session_of(moment).visits.begin();
        let camera = query.camera(&scene, gateway.config.max_still_px)?;
        let quality = query.quality.unwrap_or(scene.quality);
        Ok(Self { scene, camera, moment, quality, _visit: visit })
    }

    /// The session that shows the scene.
    pub(crate) fn shown(&self) -> &KeptSession {
        self.scene.session_of(self.moment)
    }

    /// The method of the view in a session that shares light; `None`: the session's own.
    pub(crate) fn method(&self, gateway: &Gateway, session: &Session) -> Option<String> {
        let is_shared = PlannedLight::from(&session.plan()).is_shared;
        is_shared.then(|| (gateway.config.methods.of_quality)(self.quality))
    }

    /// The view, drawn directly where no view cell is near: cells follow visitors, not single requests.
    async fn draw(&self, gateway: &Gateway, planes: ViewPlanes) -> Result<SingleView, Refusal> {
        let session = self.shown().opened().await?;
        let is_near = session.plan().assignment.workload.has_cell_near(&self.camera);
        let method = if is_near { self.method(gateway, &session) } else { Some(DIRECT.to_owned()) };
        self.draw_by(gateway, session, planes, method).await
    }

    /// The view of a moment of a scene that moves, else in its finished light. By a method of the session's samples where one is
    /// named. Some views of each session are made at a time, and others wait.
    pub(crate) async fn draw_by(
        &self,
        gateway: &Gateway,
        session: Arc<Session>,
        planes: ViewPlanes,
        method: Option<String>,
    ) -> Result<SingleView, Refusal> {
        let place = gateway.single_views.clone().try_acquire_owned().map_err(|_| {
            let reason = format!("{VIEW_PLACES} views are under way already: try again later");
            Refusal(StatusCode::TOO_MANY_REQUESTS, reason)
        })?;
        let shown = self.shown();
        let _made = shown.single_views.acquire().await.map_err(Refusal::internal)?;
        match self.frame(&session, planes, method).await {
            Ok((frame, plan)) => Ok(SingleView { frame, plan, place }),
            Err(error) => {
                let refusal = match error {
                    ClientError::Invalid { .. } => Refusal::bad(&error),
                    _ => Refusal::unserved(&error),
                };
                // Pages judge a session that they watch: one request ends it for nobody.
                if !shown.visits.has_pages() {
                    shown.has_failed(session, &error);
                }
                Err(refusal)
            }
        }
    }

    async fn frame(
        &self,
        session: &Session,
        planes: ViewPlanes,
        method: Option<String>,
    ) -> Result<(Frame, Option<SessionPlan>), ClientError> {
        let plan = session.plan();
        let timeline = plan.assignment.workload.timeline;
        let set_index = if timeline.moves() { self.moment } else { timeline.set_count - 1 };
        let request = ViewRequest { frame: 1, set_index, camera: self.camera };
        let planes = ViewPlanes { tone: session.tone(), ..planes };
        let frames = session.render_views_with(planes, method, [request])?.all().await?;
        let frame = frames.into_iter().next();
        let frame = frame.ok_or_else(|| ClientError::Ended { reason: "no frame was received".to_owned() })?;
        let plan_epoch = frame.header.sample_set_id.plan_epoch;
        let plan = [plan, session.plan()].into_iter().find(|plan| plan.assignment.plan_epoch == plan_epoch);
        Ok((frame, plan))
    }
}

/// A view, and the plan that it was made under.
pub(crate) struct SingleView {
    pub(crate) frame: Frame,
    /// `None` where the plan has changed twice meanwhile.
    plan: Option<SessionPlan>,
    /// Kept until the answer has been read.
    pub(crate) place: OwnedSemaphorePermit,
}

impl SingleView {
    /// The number of the first sample camera of its view cell.
    fn first_camera(&self) -> Result<usize, Refusal> {
        let plan = self
            .plan
            .as_ref()
            .ok_or_else(|| Refusal(StatusCode::SERVICE_UNAVAILABLE, "the plan has changed: try again".to_owned()))?;
        let cameras = plan.assignment.workload.cameras_of_cell(self.frame.header.cell as usize);
        Ok(cameras.map_or(0, |cameras| cameras.start))
    }
}

/// `view.png` and `view.jpg`.
pub(crate) async fn picture(
    State(gateway): State<Arc<Gateway>>,
    Path(name): Path<String>,
    Query(query): Query<ViewQuery>,
) -> Result<Response, Refusal> {
    let (codec, media_type) = match name.as_str() {
        "view.png" => (FrameCodec::Png, "image/png"),
        "view.jpg" => (FrameCodec::Jpeg { quality: QUALITY }, "image/jpeg"),
        _ => return Err(Refusal(StatusCode::NOT_FOUND, "the pictures are view.png and view.jpg".to_owned())),
    };
    let visited = Visited::of(&gateway, &query).await?;
    let planes = match query.show {
        // As finished stills are.
        Plane::Color => ViewPlanes { antialias: Antialias::MOST, ..ViewPlanes::default() },
        Plane::Depth => ViewPlanes::WITH_DEPTH,
        Plane::Provenance => ViewPlanes::WITH_PROVENANCE,
    };
    let drawn = visited.draw(&gateway, planes).await?;
    let first_camera = if query.show == Plane::Provenance { drawn.first_camera()? } else { 0 };
    let SingleView { frame: Frame { view, .. }, place, .. } = drawn;
    let encoded = tokio::task::spawn_blocking(move || {
        let size_px = view.size_px;
        let (rgb, legend) = colored(view, query.show, first_camera)?;
        encode_frame(codec, size_px, &rgb).ok().map(|encoded| (encoded, legend))
    });
    let encoded = encoded.await.map_err(Refusal::internal)?;
    let (encoded, legend) = encoded.ok_or_else(|| Refusal::internal("the view lacks a plane"))?;
    let mut response = held(media_type, encoded, place);
    if let Some(legend) = header_of(&legend) {
        response.headers_mut().insert(LEGEND, legend);
    }
    Ok(response)
}

/// Three bytes a pixel, and the names of colours.
fn colored(view: View, plane: Plane, first_camera: usize) -> Option<(Vec<u8>, Legend)> {
    let (image, legend) = match plane {
        Plane::Color => return Some((view.srgb8, Legend::new())),
        Plane::Depth => pictures::depth(&view)?,
        Plane::Provenance => pictures::provenance(&view, first_camera)?,
    };
    Some((image.into_raw(), legend))
}

fn header_of(legend: &Legend) -> Option<HeaderValue> {
    let names = legend.iter().map(|(name, [r, g, b])| json!([name, format!("#{r:02x}{g:02x}{b:02x}")]));
    let names: Value = names.collect();
    names.to_string().parse().ok().filter(|_| !legend.is_empty())
}

/// `depth.npy`: planar depth in the unit of the scene's file, in 32-bit floats, infinite where there is no surface.
pub(crate) async fn depth(
    State(gateway): State<Arc<Gateway>>,
    Query(query): Query<ViewQuery>,
) -> Result<Response, Refusal> {
    let visited = Visited::of(&gateway, &query).await?;
    let drawn = visited.draw(&gateway, ViewPlanes::WITH_DEPTH).await?;
    let SingleView { frame: Frame { view, .. }, place, .. } = drawn;
    let inverse = view.inverse_depth_per_m.ok_or_else(|| Refusal::internal("the view lacks depth"))?;
    let metres_per_unit = visited.scene.space.source_space.metres_per_unit as f32;
    // One over zero is infinite, as it should be.
    let file = npy(view.size_px, inverse.into_iter().map(|inverse| 1.0 / (inverse * metres_per_unit)));
    Ok(held("application/octet-stream", file.into(), place))
}

/// A file of NumPy's format, version 1.0: the header is padded to 64 bytes.
fn npy(size_px: UVec2, numbers: impl Iterator<Item = f32>) -> Vec<u8> {
    let fields = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}), }}", size_px.y, size_px.x);
    let prefix = b"\x93NUMPY\x01\x00";
    let length = (prefix.len() + 2 + fields.len() + 1).next_multiple_of(64) - prefix.len() - 2;
    let mut file = prefix.to_vec();
    file.extend_from_slice(&(length as u16).to_le_bytes());
    file.extend_from_slice(format!("{fields:<width$}\n", width = length - 1).as_bytes());
    file.extend(numbers.flat_map(f32::to_le_bytes));
    file
}

/// `point.json`: the surface at a pixel.
pub(crate) async fn point(
    State(gateway): State<Arc<Gateway>>,
    Query(query): Query<ViewQuery>,
) -> Result<Response, Refusal> {
    let visited = Visited::of(&gateway, &query).await?;
    let at = query.pixel(visited.camera.size_px)?;
    let drawn = visited.draw(&gateway, ViewPlanes::ALL).await?;
    let found = surface(&visited, &drawn.frame.view, at, drawn.first_camera()?);
    Ok(as_json(&found.ok_or_else(|| Refusal::internal("the view lacks a plane"))?))
}

fn surface(visited: &Visited, view: &View, at: UVec2, first_camera: usize) -> Option<Value> {
    let index = (at.y * view.size_px.x + at.x) as usize;
    let inverse = *view.inverse_depth_per_m.as_ref()?.get(index)?;
    let provenance = *view.provenance.as_ref()?.get(index)?;
    let has_surface = inverse > 0.0 && provenance.kind() != ProvenanceKind::Empty;
    let pixel = at.as_vec2() + Vec2::splat(0.5);
    let in_world = visited.camera.unproject(PixelDepth { pixel, planar_depth_m: 1.0 / inverse });
    let metres_per_unit = visited.scene.space.source_space.metres_per_unit as f32;
    let mask = provenance.camera_mask();
    let cameras: Vec<usize> = (0..24).filter(|bit| mask >> bit & 1 == 1).map(|bit| first_camera + bit).collect();
    let source = match provenance.kind() {
        ProvenanceKind::Empty => "nothing",
        ProvenanceKind::Hit if cameras.is_empty() => "direct",
        ProvenanceKind::Hit => "cameras",
        ProvenanceKind::Filled => "filled",
        ProvenanceKind::Guessed => "guessed",
        ProvenanceKind::Base => "base",
        ProvenanceKind::LitHere => "lit_here",
    };
    Some(json!({
        "at": at.to_array(), "source": source, "cameras": cameras,
        "point": has_surface.then(|| visited.scene.space.in_source(in_world)),
        "planar_depth": has_surface.then_some(1.0 / (inverse * metres_per_unit)),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_depth_file_has_an_aligned_header_and_one_float_a_pixel() {
        let file = npy(UVec2::new(3, 2), [0.0, 0.5, 1.0, 2.0, 4.0, 8.0].map(f32::recip).into_iter());
        let header_bytes = 10 + usize::from(u16::from_le_bytes([file[8], file[9]]));
        assert_eq!((header_bytes % 64, file.len() - header_bytes, file[header_bytes - 1]), (0, 24, b'\n'));
        assert!(String::from_utf8_lossy(&file[..header_bytes]).contains("'shape': (2, 3)"));
        assert_eq!(file[header_bytes..header_bytes + 4], f32::INFINITY.to_le_bytes());
    }

    #[test]
    fn lists_of_numbers_have_their_length() {
        assert_eq!(numbers::<f64, 3>("1, -2,3e1"), Some([1.0, -2.0, 30.0]));
        assert_eq!((numbers::<f64, 3>("1,2"), numbers::<u32, 2>("1,-2")), (None, None));
        assert_eq!((size("640x360"), size("640"), size("-1x2")), (Some(UVec2::new(640, 360)), None, None));
    }
}
