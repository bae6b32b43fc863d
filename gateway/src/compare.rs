//! A view beside the same view drawn directly, with the errors between them.

use std::sync::Arc;

use axum::extract::{Query, State};
use axum::http::StatusCode;
use axum::response::Response;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use client::Frame;
use cluster::DIRECT;
use codec::{FrameCodec, encode_frame};
use depth_image::{Antialias, View, ViewPlanes};
use metrics::{PictureErrors, flip_map};
use serde_json::{Value, json};

use crate::gateway::Gateway;
use crate::responses::{Refusal, held};
use crate::views::{SingleView, ViewQuery, Visited};

/// `compare.json`: one at a time.
pub(crate) async fn compare(
    State(gateway): State<Arc<Gateway>>,
    Query(query): Query<ViewQuery>,
) -> Result<Response, Refusal> {
    let visited = Visited::of(&gateway, &query).await?;
    // Those that wait for a session hold up no other comparison.
    let session = visited.shown().opened().await?;
    let _place = gateway.comparison.try_acquire().map_err(|_| {
        Refusal(StatusCode::TOO_MANY_REQUESTS, "another view is being compared: try again later".to_owned())
    })?;
    // As finished stills are.
    let planes = ViewPlanes { antialias: Antialias::MOST, ..ViewPlanes::COLOR };
    let with_depth = ViewPlanes { inverse_depth: true, ..planes };
    let method = visited.method(&gateway, &session);
    let SingleView { frame: view, place, .. } = visited.draw_by(&gateway, session.clone(), planes, method).await?;
    let direct = Some(DIRECT.to_owned());
    let SingleView { frame: direct, .. } = visited.draw_by(&gateway, session, with_depth, direct).await?;
    let compared = tokio::task::spawn_blocking(move || compared(&view, &direct));
    let compared = compared.await.map_err(Refusal::internal)?;
    let compared = compared.ok_or_else(|| Refusal::internal("the views cannot be compared"))?;
    Ok(held("application/json", format!("{compared:#}\n").into(), place))
}

fn compared(frame: &Frame, direct: &Frame) -> Option<Value> {
    let [foreground, whole] = PictureErrors::of(&direct.view, &frame.view).ok()?;
    let flip = flip_map(&direct.view, &frame.view).ok()?;
    let flip_image = View { srgb8: pictures::error_map(&flip).into_raw(), ..frame.view.clone() };
    let [view_s, direct_s] = [frame, direct].map(|frame| frame.header.stage_times.batch_s);
    Some(json!({
        "size_px": frame.view.size_px.to_array(),
        "foreground_psnr_db": foreground.psnr_db, "foreground_ssim": foreground.ssim,
        "foreground_flip": foreground.flip,
        "psnr_db": whole.psnr_db, "ssim": whole.ssim, "flip": whole.flip,
        "view_ms": view_s * 1000.0, "direct_ms": direct_s * 1000.0,
        "view": data_url(&frame.view)?, "direct": data_url(&direct.view)?, "flip_map": data_url(&flip_image)?,
    }))
}

fn data_url(view: &View) -> Option<String> {
    let png = encode_frame(FrameCodec::Png, view.size_px, &view.srgb8).ok()?;
    Some(format!("data:image/png;base64,{}", STANDARD.encode(png)))
}
