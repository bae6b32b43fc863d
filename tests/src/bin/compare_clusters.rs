//! Compares running clusters that serve the same scene, for `scripts/same_as.sh`.
//!
//! `bytes URL` prints a line for each sampling, reconstruction, lighting and policy: the hashes of the samplers' depth
//! images and of the compositors' frames. Two versions of the program are equal where the lines are.
//! `times OLD NEW OLD` measures costs on the clusters in turn and prints the ratio of the second and third to the
//! first.
#![allow(clippy::print_stdout, reason = "the lines are the program's output")]

use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context as _;
use clap::Parser;
use client::{Client, Frame, Session, ViewRequest};
use cluster::{Costs, FetchImages, MeasureCosts, PolicyChoice, SessionRequest, Timeline};
use codec::ChunkBody;
use depth_image::{Camera, PinholeCamera, ViewCell, ViewPlanes};
use glam::UVec2;
use tokio_stream::StreamExt as _;
use wire::rpc::{NodeClient, SamplerClient, connect};

const VIEWS: usize = 2;
const VIEW_SIZE_PX: UVec2 = UVec2::new(120, 90);
const LIGHTINGS: [&str; 2] = ["unlit", "soft 4, occlusion 4"];
const SAMPLINGS: [&str; 5] =
    ["conventional", "non_redundant:pixel", "non_redundant:visibility", "non_redundant:coverage", "depth_peeling:3"];
const METHODS: [&str; 6] =
    ["joint_carve", "joint_carve:2", "light_field_search:50", "mesh", "hybrid_mesh", "hybrid_mesh:0.5"];

/// The requested comparison.
#[derive(Debug, Clone, Copy)]
struct Row {
    sampling: &'static str,
    method: &'static str,
    lighting: &'static str,
    codec: &'static str,
    policy: PolicyChoice,
    tile_count: u32,
}

/// The command line.
#[derive(Debug, Parser)]
enum Command {
    /// Print hashes of a cluster's images and frames
    Bytes {
        /// The coordinator
        url: String,
        /// A file with the requested rows, a line each [default: all rows]
        rows: Option<PathBuf>,
    },
    /// Measure the costs of several clusters in turn
    Times {
        /// Their coordinators; ratios are to the first
        #[arg(required = true, num_args = 2..)]
        urls: Vec<String>,
    },
}

#[tokio::main]
async fn main() -> anyhow::Result<()> {
    match Command::parse() {
        Command::Bytes { url, rows } => bytes(&url, rows.as_deref()).await,
        Command::Times { urls } => times(&urls).await,
    }
}

async fn bytes(url: &str, file: Option<&Path>) -> anyhow::Result<()> {
    let wanted = file.map(fs::read_to_string).transpose()?;
    let client = Client::connect(url).await?;
    let views = views_between_samples(&client, VIEW_SIZE_PX, VIEWS).await?;
    for row in rows()
        .into_iter()
        .filter(|row| wanted.as_ref().is_none_or(|text| text.lines().any(|line| line == row.to_string())))
    {
        println!(
            "{row} | {}",
            answer(&client, row, &views).await.unwrap_or_else(|error| format!("refused: {error:#}"))
        );
    }
    Ok(())
}

/// Views on the rectangle of the sample cameras that the coordinator offers.
async fn views_between_samples(client: &Client, size_px: UVec2, count: usize) -> anyhow::Result<Vec<PinholeCamera>> {
    let offer = client
        .wait_for_nodes(1, Duration::from_secs(60))
        .await?
        .offers
        .into_iter()
        .next()
        .context("no scene on offer")?;
    let samples: Vec<_> = offer.sample_cameras.iter().map(|camera| *camera.reference()).collect();
    Ok(ViewCell::between(&samples).context("no sample cameras")?.spread(count, size_px))
}

fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for lighting in LIGHTINGS {
        let row = Row {
            sampling: SAMPLINGS[0],
            method: METHODS[0],
            lighting,
            codec: "lz4",
            policy: PolicyChoice::Pipeline,
            tile_count: 1,
        };
        rows.push(Row { policy: PolicyChoice::Direct, ..row });
        rows.push(Row { policy: PolicyChoice::TimeShare, tile_count: 2, ..row });
        rows.push(Row { codec: "jpeg:85", tile_count: 3, ..row });
        let both = |sampling| METHODS.map(|method| Row { sampling, method, ..row });
        rows.extend(SAMPLINGS.into_iter().flat_map(both));
    }
    rows
}

impl std::fmt::Display for Row {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { sampling, method, lighting, codec, policy, tile_count } = self;
        write!(f, "{sampling} | {method} | {lighting} | {codec} | {policy}, {tile_count} tiles")
    }
}

/// The hashes of one row.
async fn answer(client: &Client, row: Row, views: &[PinholeCamera]) -> anyhow::Result<String> {
    let session = client.open_session(request(row, views[0]), |_| ()).await?;
    let images = image_hash(&session).await?;
    let frames = frame_hash(&session, views).await?;
    Ok(format!("images {images:016x} frames {frames:016x}"))
}

fn request(row: Row, typical_view: PinholeCamera) -> SessionRequest {
    SessionRequest {
        scene: None,
        method: row.method.to_owned(),
        sampling: row.sampling.to_owned(),
        lighting: row.lighting.to_owned(),
        follows_mirrors: false,
        takes_light: false,
        codec: row.codec.to_owned(),
        sample_cameras: sample_cameras(row.sampling, typical_view),
        sample_size_px: None,
        volume: None,
        typical_view,
        views_per_set: VIEWS as u32,
        planes: ViewPlanes::ALL,
        auto_exposure: false,
        timeline: Timeline { start_s: 0.25, step_s: 0.5, set_count: 2 },
        policy: row.policy,
        forced_sampler_count: None,
        refinement_steps: 1,
        frames_per_s: None,
        fallbacks: Vec::new(),
        forced_tile_count: Some(row.tile_count),
        viewpoints: Vec::new(),
        budget: cluster::BudgetRequest::default(),
    }
}

/// The offered cameras, or one camera for all layers where a method takes layers from one place.
fn sample_cameras(sampling: &str, view: PinholeCamera) -> Vec<Camera> {
    if sampling.starts_with("depth_peeling") { vec![Camera::Pinhole(view); 3] } else { Vec::new() }
}

/// The hash of all chunks of both sets, as samplers send them, without the number of the plan.
async fn image_hash(session: &Session) -> anyhow::Result<u64> {
    let plan = session.plan().assignment;
    let mut chunks = Vec::new();
    for set_index in 0..plan.workload.timeline.set_count {
        for share in plan.samplers_of(set_index) {
            let sampler = SamplerClient::new(connect(&share.address).await?);
            let request = FetchImages {
                plan_epoch: plan.plan_epoch,
                workload_number: plan.workload_number,
                set_index,
                cell: 0,
                image_indices: share.image_indices.clone(),
            };
            let mut incoming = sampler.fetch_sample_images(request).await?;
            while let Some(chunk) = incoming.next().await {
                let chunk = chunk?;
                let body = match &chunk.body {
                    ChunkBody::Header(header) => format!("{header:?}").into_bytes(),
                    ChunkBody::Data(data) => data.to_vec(),
                };
                chunks.push((set_index, chunk.image_index, chunk.sequence, chunk.chunk_count, chunk.crc32, body));
            }
        }
    }
    chunks.sort();
    Ok(hash(&chunks))
}

/// The hash of all views of both sets, encoded (by their checksum and lengths) and decoded.
async fn frame_hash(session: &Session, views: &[PinholeCamera]) -> anyhow::Result<u64> {
    let sets = session.plan().assignment.workload.timeline.set_count;
    let all = (0..sets).flat_map(|set_index| views.iter().map(move |camera| (set_index, *camera)));
    let request = |(frame, (set_index, camera))| ViewRequest { frame, set_index, camera };
    let requests: Vec<ViewRequest> = (0..).zip(all).map(request).collect();
    let mut incoming = session.render_views(requests)?;
    let mut frames = Vec::new();
    while let Some(frame) = incoming.next().await {
        let Frame { request, view, header } = frame?;
        let encoded = (header.crc32, header.color_bytes, header.inverse_depth_bytes, header.provenance_bytes);
        let depth: Vec<u32> = view.inverse_depth_per_m.iter().flatten().map(|depth| depth.to_bits()).collect();
        let provenance: Vec<u32> = view.provenance.iter().flatten().map(|provenance| provenance.0).collect();
        frames.push((request.frame, encoded, view.srgb8, depth, provenance));
    }
    anyhow::ensure!(frames.len() == views.len() * sets as usize, "{} frames", frames.len());
    frames.sort();
    Ok(hash(&frames))
}

fn hash(value: &impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    value.hash(&mut hasher);
    hasher.finish()
}

/// Rounds that do not count, and rounds that do.
const WARM_UP_ROUNDS: usize = 3;
const ROUNDS: usize = 21;
/// The interval of the median of 21 values between their 6th and 16th covers 97 %.
const INTERVAL: std::ops::RangeInclusive<usize> = 5..=15;
const TIMED_VIEWS: usize = 8;
const TIMED_VIEW_SIZE_PX: UVec2 = UVec2::new(200, 150);

/// The measured costs of a cluster's first node.
struct Subject {
    node: NodeClient,
    work: MeasureCosts,
}

impl Subject {
    async fn of(url: &str) -> anyhow::Result<Self> {
        let client = Client::connect(url).await?;
        let typical_views = views_between_samples(&client, TIMED_VIEW_SIZE_PX, TIMED_VIEWS).await?;
        let row = Row {
            sampling: SAMPLINGS[0],
            method: METHODS[0],
            lighting: "shadows",
            codec: "lz4",
            policy: PolicyChoice::Pipeline,
            tile_count: 1,
        };
        let plan = client.open_session(request(row, typical_views[0]), |_| ()).await?.plan().assignment;
        let node = NodeClient::new(connect(&plan.compositors[0].address).await?);
        let batch_count = TIMED_VIEWS as u32;
        let work = MeasureCosts {
            workload: plan.workload,
            method: row.method.to_owned(),
            codec: row.codec.to_owned(),
            typical_views,
            batch_count,
            planes: ViewPlanes::default(),
            in_background: false,
            budget: None,
        };
        Ok(Self { node, work })
    }

    /// A node repeats what it has measured for an equal request: each round has a near plane of its own.
    async fn costs_s(&self, round: usize) -> anyhow::Result<[f64; 4]> {
        let mut work = self.work.clone();
        work.typical_views.iter_mut().for_each(|view| view.near_m *= 1.0 + 1e-4 * round as f32);
        let Costs { sample_image_s, direct_view_s, reconstruct_view_s, load_set_s, .. } =
            self.node.measure_costs(work).await?.costs;
        Ok([sample_image_s, direct_view_s, reconstruct_view_s, load_set_s])
    }
}

async fn times(urls: &[String]) -> anyhow::Result<()> {
    let mut subjects = Vec::new();
    for url in urls {
        subjects.push(Subject::of(url).await?);
    }
    let mut rounds: Vec<Vec<[f64; 4]>> = Vec::new();
    for round in 0..WARM_UP_ROUNDS + ROUNDS {
        let mut costs = Vec::new();
        for subject in &subjects {
            costs.push(subject.costs_s(round).await?);
        }
        if round >= WARM_UP_ROUNDS {
            rounds.push(costs);
        }
    }
    println!("| cost | cluster | median (ms) | ratio to the first, median | 95 % interval |\n|---|---|---|---|---|");
    for (cost, name) in ["g_s", "g_v", "c", "d"].into_iter().enumerate() {
        for (subject, url) in urls.iter().enumerate() {
            let seconds = sorted(rounds.iter().map(|round| round[subject][cost]));
            let ratios = sorted(rounds.iter().map(|round| round[subject][cost] / round[0][cost]));
            let median_ms = seconds[ROUNDS / 2] * 1e3;
            let ratio = ratios[ROUNDS / 2];
            let [low, high] = [ratios[*INTERVAL.start()], ratios[*INTERVAL.end()]];
            println!("| {name} | {url} | {median_ms:.2} | {ratio:.3} | {low:.3} to {high:.3} |");
        }
    }
    Ok(())
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}
