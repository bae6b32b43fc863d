//! Ways to find the occlusion of the floor's points in every view, and their errors.

use std::time::{Duration, Instant};

use depth_image::PinholeCamera;
use glam::Vec3;
use rayon::prelude::*;

use super::search::HorizonSearch;
use super::subject::{Blocks, FloorPoint, RADIUS_M, behind_block, set_cameras};
use crate::graph::{GraphCamera, pinhole};
use crate::study::Column;

/// The paper's two settings.
pub const REGULAR: HorizonSearch = HorizonSearch { directions: 6, steps: 6, radius_m: RADIUS_M };
pub const FINE: HorizonSearch = HorizonSearch { directions: 32, steps: 20, radius_m: RADIUS_M };

/// The images that horizons are searched in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The view's own image.
    Own,
    /// A graph image for each view.
    Graph,
    /// The graph image of the middle view.
    GraphKept,
    /// The images of a sample set.
    Shared,
}

#[derive(Debug, Clone, Copy)]
pub enum Method {
    Horizons { source: Source, search: HorizonSearch },
    Rays(u32),
}

/// A method in the table, with the paper's frames per second.
pub struct NamedMethod {
    pub name: &'static str,
    pub method: Method,
    paper_frames_per_s: Option<f64>,
}

const fn horizons(name: &'static str, source: Source, search: HorizonSearch, paper: Option<f64>) -> NamedMethod {
    NamedMethod { name, method: Method::Horizons { source, search }, paper_frames_per_s: paper }
}

const fn rays(name: &'static str, rays: u32) -> NamedMethod {
    NamedMethod { name, method: Method::Rays(rays), paper_frames_per_s: None }
}

pub const OWN: &str = "own 32x20";
pub const GRAPH: &str = "graph 32x20";
pub const KEPT: &str = "graph 32x20, kept";
pub const SHARED: &str = "shared 32x20";
/// The paper's frames are those of section 7.2: 1024 × 1024 pixels, 890,000 triangles.
pub const METHODS: [NamedMethod; 10] = [
    horizons("own 6x6", Source::Own, REGULAR, Some(85.0)),
    horizons(OWN, Source::Own, FINE, Some(26.0)),
    horizons("graph 6x6", Source::Graph, REGULAR, Some(35.0)),
    horizons(GRAPH, Source::Graph, FINE, Some(16.0)),
    horizons(KEPT, Source::GraphKept, FINE, Some(21.0)),
    horizons("shared 6x6", Source::Shared, REGULAR, None),
    horizons(SHARED, Source::Shared, FINE, None),
    rays("rays 4", 4),
    rays("rays 16", 16),
    rays("rays 64", 64),
];

/// The views, and which points each of them shows.
pub struct Walk<'s> {
    pub blocks: &'s Blocks,
    pub points: &'s [FloorPoint],
    pub views: Vec<PinholeCamera>,
    seen: Vec<Vec<usize>>,
}

/// The occlusion of points, by their numbers, in one view.
type InView = Vec<(usize, f64)>;

/// What a method finds in all views.
pub struct MethodFigures {
    pub name: &'static str,
    pub texels: usize,
    /// RMS difference from rays, over all points that views show.
    pub rmse: f64,
    /// Mean difference from rays; positive where too much is covered.
    pub bias: f64,
    /// Mean over all points of the standard deviation along the walk.
    pub deviation: f64,
    pub images_ms: f64,
    pub ns_per_point: f64,
    paper_frames_per_s: Option<f64>,
    /// Mean occlusion in each view.
    pub by_view: Vec<f64>,
    /// Mean occlusion in the middle view.
    pub head_on: f64,
}

pub const COLUMNS: [Column<MethodFigures>; 8] = [
    Column::new("occlusion by", |row| row.name.into()),
    Column::new("texels", |row| row.texels.into()),
    Column::new("RMSE", |row| row.rmse.into()),
    Column::new("mean error", |row| row.bias.into()),
    Column::new("deviation along the walk", |row| row.deviation.into()),
    Column::with_unit("images a view", "ms", |row| row.images_ms.into()),
    Column::with_unit("a point", "ns", |row| row.ns_per_point.into()),
    Column::with_unit("the paper's frames", "1/s", |row| row.paper_frames_per_s.into()),
];

/// Occlusion in all views, and what it took.
#[derive(Default)]
struct Found {
    texels: usize,
    taking_images: Duration,
    searching: Duration,
    views: Vec<InView>,
}

impl<'s> Walk<'s> {
    pub fn new(blocks: &'s Blocks, points: &'s [FloorPoint], views: Vec<PinholeCamera>) -> Self {
        let seen = views.iter().map(|view| {
            let numbers = 0..points.len();
            numbers.filter(|&number| blocks.is_seen(view.eye_in_world, points[number].at)).collect()
        });
        let seen = seen.collect();
        Self { blocks, points, views, seen }
    }

    /// # Errors
    /// A camera cannot be used.
    pub fn measure(&self, named: &NamedMethod) -> anyhow::Result<MethodFigures> {
        let found = match named.method {
            Method::Horizons { source, search } => self.by_horizons(source, search)?,
            Method::Rays(rays) => self.by_rays(rays),
        };
        let by_view: Vec<f64> = found.views.iter().map(|view| mean(view.iter().map(|(_, value)| *value))).collect();
        let all = found.views.iter().flatten();
        let errors = all.clone().map(|(number, value)| value - self.points[*number].truth);
        Ok(MethodFigures {
            name: named.name,
            texels: found.texels,
            rmse: mean(errors.clone().map(|error| error.powi(2))).sqrt(),
            bias: mean(errors),
            deviation: self.deviation(&found.views),
            images_ms: found.taking_images.as_secs_f64() * 1e3 / self.views.len() as f64,
            ns_per_point: found.searching.as_secs_f64() * 1e9 / all.count().max(1) as f64,
            paper_frames_per_s: named.paper_frames_per_s,
            head_on: by_view[by_view.len() / 2],
            by_view,
        })
    }

    /// Mean of rays in each view, over the points that it shows.
    pub fn truth_by_view(&self) -> Vec<f64> {
        let views = self.seen.iter().map(|seen| mean(seen.iter().map(|&number| self.points[number].truth)));
        views.collect()
    }

    fn by_horizons(&self, source: Source, search: HorizonSearch) -> anyhow::Result<Found> {
        let mut found = Found::default();
        let size_px = self.views[0].size_px;
        match source {
            Source::Own | Source::Graph => {
                for (number, view) in self.views.iter().enumerate() {
                    let camera = if source == Source::Own { pinhole(view)? } else { behind_block(view)? };
                    self.add_views(&mut found, &[camera], &[number], search);
                }
            }
            Source::GraphKept => {
                let camera = behind_block(&self.views[self.views.len() / 2])?;
                self.add_views(&mut found, &[camera], &self.all_views(), search);
            }
            Source::Shared => {
                let cameras = set_cameras(size_px).iter().map(pinhole).collect::<anyhow::Result<Vec<GraphCamera>>>()?;
                self.add_views(&mut found, &cameras, &self.all_views(), search);
            }
        }
        Ok(found)
    }

    fn all_views(&self) -> Vec<usize> {
        (0..self.views.len()).collect()
    }

    /// Takes the cameras' images and searches them for the points of some views.
    fn add_views(&self, found: &mut Found, cameras: &[GraphCamera], views: &[usize], search: HorizonSearch) {
        let start = Instant::now();
        let images: Vec<_> = cameras.iter().map(|camera| self.blocks.image(camera)).collect();
        found.taking_images += start.elapsed();
        found.texels = cameras.iter().map(GraphCamera::texels).sum();
        let start = Instant::now();
        for &view in views {
            found.views.push(self.in_view(view, |point| {
                let at = point.surface();
                match images.as_slice() {
                    [image] => search.in_image(image, at).unwrap_or(0.0),
                    images => search.in_any_image(images, at),
                }
            }));
        }
        found.searching += start.elapsed();
    }

    fn by_rays(&self, rays: u32) -> Found {
        let start = Instant::now();
        let views = self.all_views().into_iter().map(|view| {
            // Other rays in each view, as a renderer has.
            let turned_rad = view as f32 * 2.4;
            self.in_view(view, |point| self.blocks.by_rays(point.at, Vec3::Y, rays, turned_rad))
        });
        let views = views.collect();
        Found { searching: start.elapsed(), views, ..Found::default() }
    }

    fn in_view(&self, view: usize, occlusion: impl Fn(&FloorPoint) -> f64 + Sync) -> InView {
        self.seen[view].par_iter().map(|&number| (number, occlusion(&self.points[number]))).collect()
    }

    fn deviation(&self, views: &[InView]) -> f64 {
        let mut of_points = vec![Vec::new(); self.points.len()];
        for (number, value) in views.iter().flatten() {
            of_points[*number].push(*value);
        }
        let deviations = of_points.iter().filter(|values| values.len() > 1).map(|values| {
            let middle = mean(values.iter().copied());
            mean(values.iter().map(|value| (value - middle).powi(2))).sqrt()
        });
        mean(deviations)
    }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let mut sum = 0.0;
    let mut count = 0_usize;
    for value in values {
        sum += value;
        count += 1;
    }
    sum / count.max(1) as f64
}
