//! Events as a log has them, and back; values that no event has are named.

use cluster::limits::{MAX_FRAMES_PER_S, MAX_TEXT_BYTES, MAX_TILES, MAX_VIEWPOINTS, MAX_VIEWS_PER_SET};
use cluster::{
    Costs, JoinCluster, MeasuredCosts, NodeStatus, PolicyChoice, Quality, ROW_PARTS, TileCosts, UnknownPolicy,
};
use depth_image::PinholeCamera;
use serde::{Deserialize, Serialize};

use super::{Event, Opening};

/// A field that is wrong, before its line is known.
pub(super) struct Wrong {
    pub(super) field: &'static str,
    pub(super) reason: String,
}

impl From<UnknownPolicy> for Wrong {
    fn from(error: UnknownPolicy) -> Self {
        Self { field: "policy", reason: error.to_string() }
    }
}

/// An event as it is written.
#[derive(Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub(super) enum Written {
    Joined {
        incarnation: u64,
        node_name: String,
        address: String,
        device_name: String,
        is_software: bool,
        plan_epoch: u64,
    },
    Left {
        incarnation: u64,
        node_name: String,
    },
    Opened {
        session: u64,
        views_per_set: usize,
        #[serde(with = "super::exact")]
        frames_per_s: f64,
        policy: String,
        forced_samplers: Option<usize>,
        forced_tiles: Option<usize>,
        fallbacks: Vec<WrittenQuality>,
        costs: WrittenCosts,
        /// The message that nodes get, in hexadecimal.
        workload: String,
        #[serde(default)]
        viewpoints: Vec<PinholeCamera>,
    },
    Demanded {
        session: u64,
        views_per_set: usize,
        #[serde(with = "super::exact")]
        frames_per_s: f64,
    },
    Looked {
        session: u64,
        viewpoints: Vec<PinholeCamera>,
    },
    Measured {
        node_name: String,
        plan_epoch: u64,
        #[serde(with = "super::exact")]
        busy_s: f64,
        views: u64,
        dropped_views: u64,
        #[serde(flatten)]
        costs: WrittenTimings,
    },
    Ready {
        plan_epoch: u64,
        node_name: String,
    },
    Unready {
        plan_epoch: u64,
        node_name: String,
        reason: String,
    },
    Closed {
        session: u64,
    },
    Tick,
}

#[derive(Serialize, Deserialize)]
pub(super) struct WrittenCosts {
    #[serde(with = "super::exact")]
    sample_image_s: f64,
    #[serde(with = "super::exact")]
    direct_view_s: f64,
    #[serde(with = "super::exact")]
    reconstruct_view_s: f64,
    #[serde(with = "super::exact")]
    load_set_s: f64,
    #[serde(with = "super::exact")]
    encode_view_s: f64,
    in_order: bool,
    #[serde(with = "super::exact")]
    sample_overhead_s: f64,
    /// Not in old logs.
    #[serde(with = "super::exact::array", default)]
    sample_row_shares: [f64; ROW_PARTS],
}

#[derive(Serialize, Deserialize)]
pub(super) struct WrittenQuality {
    lighting: String,
    method: String,
    #[serde(with = "super::exact")]
    sample_side_ratio: f64,
    #[serde(with = "super::exact")]
    frame_rate_ratio: f64,
}

#[derive(Serialize, Deserialize)]
pub(super) struct WrittenTimings {
    #[serde(with = "super::exact::option", default)]
    sample_image_s: Option<f64>,
    #[serde(with = "super::exact::option", default)]
    direct_view_s: Option<f64>,
    #[serde(with = "super::exact::option", default)]
    reconstruct_view_s: Option<f64>,
    #[serde(with = "super::exact::option", default)]
    load_set_s: Option<f64>,
    #[serde(with = "super::exact::option", default)]
    encode_view_s: Option<f64>,
    #[serde(with = "super::exact::option", default)]
    transfer_bytes_per_s: Option<f64>,
    #[serde(with = "super::exact::option", default)]
    image_bytes: Option<f64>,
}

impl From<&Event> for Written {
    fn from(event: &Event) -> Self {
        match event.clone() {
            Event::Joined { incarnation, join } => Self::joined(incarnation, join),
            Event::Left { incarnation, node_name } => Self::Left { incarnation, node_name },
            Event::Opened(opening) => Self::opened(*opening),
            Event::Demanded { session, views_per_set, frames_per_s } => {
                Self::Demanded { session, views_per_set, frames_per_s }
            }
            Event::Looked { session, viewpoints } => Self::Looked { session, viewpoints },
            Event::Measured { node_name, plan_epoch, costs, busy_s, views, dropped_views } => {
                Self::Measured { node_name, plan_epoch, busy_s, views, dropped_views, costs: costs.into() }
            }
            Event::Ready { plan_epoch, node_name } => Self::Ready { plan_epoch, node_name },
            Event::Unready { plan_epoch, node_name, reason } => Self::Unready { plan_epoch, node_name, reason },
            Event::Closed { session } => Self::Closed { session },
            Event::Tick => Self::Tick,
        }
    }
}

impl Written {
    fn joined(incarnation: u64, join: JoinCluster) -> Self {
        let NodeStatus { node_name, address, device_name, is_software } = join.node;
        Self::Joined { incarnation, node_name, address, device_name, is_software, plan_epoch: join.plan_epoch }
    }

    fn opened(opening: Opening) -> Self {
        Self::Opened {
            session: opening.session,
            views_per_set: opening.views_per_set,
            frames_per_s: opening.frames_per_s,
            policy: opening.policy.to_string(),
            forced_samplers: opening.forced_samplers,
            forced_tiles: opening.forced_tiles,
            fallbacks: opening.fallbacks.into_iter().map(Into::into).collect(),
            costs: opening.costs.into(),
            workload: hex(&wire::workload_to_bytes(&opening.workload)),
            viewpoints: opening.viewpoints,
        }
    }

    pub(super) fn read(self) -> Result<Event, Wrong> {
        Ok(match self {
            Self::Joined { incarnation, node_name, address, device_name, is_software, plan_epoch } => {
                let node = NodeStatus { node_name: name(node_name)?, address, device_name, is_software };
                Event::Joined { incarnation, join: JoinCluster { node, plan_epoch } }
            }
            Self::Left { incarnation, node_name } => Event::Left { incarnation, node_name: name(node_name)? },
            Self::Opened {
                session,
                views_per_set,
                frames_per_s,
                policy,
                forced_samplers,
                forced_tiles,
                fallbacks,
                costs,
                workload,
                viewpoints,
            } => Event::Opened(Box::new(Opening {
                session,
                workload: wire::workload_from_bytes(&bytes(&workload)?)
                    .map_err(|reason| Wrong { field: "workload", reason })?,
                views_per_set: views(views_per_set)?,
                frames_per_s: rate(frames_per_s)?,
                policy: policy.parse::<PolicyChoice>()?,
                forced_samplers,
                forced_tiles: tiles(forced_tiles)?,
                fallbacks: fallbacks.into_iter().map(WrittenQuality::read).collect::<Result<_, _>>()?,
                costs: costs.read()?,
                viewpoints: looks(viewpoints)?,
            })),
            Self::Demanded { session, views_per_set, frames_per_s } => {
                Event::Demanded { session, views_per_set: views(views_per_set)?, frames_per_s: rate(frames_per_s)? }
            }
            Self::Looked { session, viewpoints } => Event::Looked { session, viewpoints: looks(viewpoints)? },
            Self::Measured { node_name, plan_epoch, busy_s, views, dropped_views, costs } => Event::Measured {
                node_name: name(node_name)?,
                plan_epoch,
                busy_s: seconds(busy_s, "busy_s")?,
                views,
                dropped_views,
                costs: costs.into(),
            },
            Self::Ready { plan_epoch, node_name } => Event::Ready { plan_epoch, node_name: name(node_name)? },
            Self::Unready { plan_epoch, node_name, reason } => {
                Event::Unready { plan_epoch, node_name: name(node_name)?, reason }
            }
            Self::Closed { session } => Event::Closed { session },
            Self::Tick => Event::Tick,
        })
    }
}

fn name(node_name: String) -> Result<String, Wrong> {
    if (1..=MAX_TEXT_BYTES).contains(&node_name.len()) {
        return Ok(node_name);
    }
    Err(Wrong { field: "node_name", reason: format!("has {} bytes, must have 1 to {MAX_TEXT_BYTES}", node_name.len()) })
}

fn looks(viewpoints: Vec<PinholeCamera>) -> Result<Vec<PinholeCamera>, Wrong> {
    let wrong = |reason: String| Wrong { field: "viewpoints", reason };
    if viewpoints.len() > MAX_VIEWPOINTS {
        return Err(wrong(format!("{} are more than {MAX_VIEWPOINTS}", viewpoints.len())));
    }
    viewpoints.iter().try_for_each(|view| view.validate().map_err(|error| wrong(error.to_string())))?;
    Ok(viewpoints)
}

fn views(views_per_set: usize) -> Result<usize, Wrong> {
    if views_per_set <= MAX_VIEWS_PER_SET as usize {
        return Ok(views_per_set);
    }
    let reason = format!("is {views_per_set}, at most {MAX_VIEWS_PER_SET} are allowed");
    Err(Wrong { field: "views_per_set", reason })
}

fn rate(frames_per_s: f64) -> Result<f64, Wrong> {
    if (0.0..=MAX_FRAMES_PER_S).contains(&frames_per_s) {
        return Ok(frames_per_s);
    }
    Err(Wrong { field: "frames_per_s", reason: format!("is {frames_per_s}, must be from 0 to {MAX_FRAMES_PER_S}") })
}

fn tiles(forced: Option<usize>) -> Result<Option<usize>, Wrong> {
    if forced.is_none_or(|forced| (1..=MAX_TILES as usize).contains(&forced)) {
        return Ok(forced);
    }
    Err(Wrong { field: "forced_tiles", reason: format!("is {forced:?}, must be from 1 to {MAX_TILES}") })
}

impl From<Quality> for WrittenQuality {
    fn from(q: Quality) -> Self {
        let Quality { lighting, method, sample_side_ratio, frame_rate_ratio } = q;
        Self { lighting, method, sample_side_ratio, frame_rate_ratio }
    }
}

impl WrittenQuality {
    fn read(self) -> Result<Quality, Wrong> {
        let Self { lighting, method, sample_side_ratio, frame_rate_ratio } = self;
        let ratio = |value: f64, field| {
            let wrong = Wrong { field, reason: format!("is {value}, must be above 0 and at most 1") };
            if value > 0.0 && value <= 1.0 { Ok(value) } else { Err(wrong) }
        };
        Ok(Quality {
            lighting,
            method,
            sample_side_ratio: ratio(sample_side_ratio, "sample_side_ratio")?,
            frame_rate_ratio: ratio(frame_rate_ratio, "frame_rate_ratio")?,
        })
    }
}

fn seconds(value: f64, field: &'static str) -> Result<f64, Wrong> {
    if value.is_finite() && value >= 0.0 {
        return Ok(value);
    }
    Err(Wrong { field, reason: format!("is {value}, must be finite and not negative") })
}

fn row_shares(shares: [f64; ROW_PARTS]) -> Result<[f64; ROW_PARTS], Wrong> {
    match shares.iter().find(|share| !(0.0..=1.0).contains(*share)) {
        Some(share) => Err(Wrong { field: "sample_row_shares", reason: format!("has {share}, must be from 0 to 1") }),
        None => Ok(shares),
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn bytes(hex: &str) -> Result<Vec<u8>, Wrong> {
    let digit = |digit: &u8| char::from(*digit).to_digit(16).map(|digit| digit as u8);
    let pair = |pair: &[u8]| match pair {
        [high, low] => Some(digit(high)? << 4 | digit(low)?),
        _ => None,
    };
    let read: Option<Vec<u8>> = hex.as_bytes().chunks(2).map(pair).collect();
    read.ok_or_else(|| Wrong { field: "workload", reason: "is not hexadecimal".to_owned() })
}

impl From<Costs> for WrittenCosts {
    fn from(c: Costs) -> Self {
        Self {
            sample_image_s: c.sample_image_s,
            direct_view_s: c.direct_view_s,
            reconstruct_view_s: c.reconstruct_view_s,
            load_set_s: c.load_set_s,
            encode_view_s: c.encode_view_s,
            in_order: c.in_order,
            sample_overhead_s: c.tile_overhead_s(),
            sample_row_shares: c.tiles.and_then(|tiles| tiles.row_shares).unwrap_or_default(),
        }
    }
}

impl WrittenCosts {
    fn read(self) -> Result<Costs, Wrong> {
        let shares = row_shares(self.sample_row_shares)?;
        let overhead_s = seconds(self.sample_overhead_s, "sample_overhead_s")?;
        Ok(Costs {
            sample_image_s: seconds(self.sample_image_s, "sample_image_s")?,
            direct_view_s: seconds(self.direct_view_s, "direct_view_s")?,
            reconstruct_view_s: seconds(self.reconstruct_view_s, "reconstruct_view_s")?,
            load_set_s: seconds(self.load_set_s, "load_set_s")?,
            encode_view_s: seconds(self.encode_view_s, "encode_view_s")?,
            in_order: self.in_order,
            tiles: TileCosts::of_image(
                self.sample_image_s,
                overhead_s,
                shares.iter().any(|&share| share > 0.0).then_some(shares),
            ),
        })
    }
}

impl From<MeasuredCosts> for WrittenTimings {
    fn from(c: MeasuredCosts) -> Self {
        Self {
            sample_image_s: c.sample_image_s,
            direct_view_s: c.direct_view_s,
            reconstruct_view_s: c.reconstruct_view_s,
            load_set_s: c.load_set_s,
            encode_view_s: c.encode_view_s,
            transfer_bytes_per_s: c.transfer_bytes_per_s,
            image_bytes: c.image_bytes,
        }
    }
}

/// A timing that cannot be says nothing, here as where it was recorded.
impl From<WrittenTimings> for MeasuredCosts {
    fn from(c: WrittenTimings) -> Self {
        Self {
            sample_image_s: c.sample_image_s,
            direct_view_s: c.direct_view_s,
            reconstruct_view_s: c.reconstruct_view_s,
            load_set_s: c.load_set_s,
            encode_view_s: c.encode_view_s,
            transfer_bytes_per_s: c.transfer_bytes_per_s,
            image_bytes: c.image_bytes,
        }
    }
}
