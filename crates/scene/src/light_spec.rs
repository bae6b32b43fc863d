//! Lights and environments as text, for the command line.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use depth_image::{Environment, Light, LightError, linear_from_srgb8};
use glam::{DVec3, Vec3};

/// A light as text: a kind, then fields in any order, with spaces between.
///
/// ```text
/// sun towards=X,Y,Z [irradiance=V] [angle=DEG]
/// point at=X,Y,Z [intensity=V] [radius=M]
/// spot at=X,Y,Z towards=X,Y,Z [intensity=V] [inner=DEG] [outer=DEG] [radius=M]
/// rectangle at=X,Y,Z u=X,Y,Z v=X,Y,Z [radiance=V]
/// ```
///
/// A colour V is a grey, `R,G,B` in linear RGB, or `#rrggbb` in sRGB; its default is 1. By default a sun has the real
/// sun's angle, a spot glTF's cones (0° and 45°), and lamps have no radius. A sun's `towards` points to the sun, a
/// spot's along its light. `angle` and `radius` are half the apparent extent. The vectors `u` and `v` lead from a
/// rectangle's middle to the middles of two edges; it shines to the side of `u × v`. Positions are in metres, in the
/// coordinates of the scene's source, as in [`Scene::lit_by`](crate::Scene::lit_by).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightSpec(pub Light);

/// An environment as text: one colour as in [`LightSpec`], or two, `ZENITH/NADIR`, or the name of a `.hdr` file.
#[derive(Debug, Clone, PartialEq)]
pub enum EnvironmentSpec {
    /// A gradient.
    Colors(Environment),
    /// A file for [`load_environment`](crate::load_environment).
    File(PathBuf),
}

/// A text that is no light or environment. Display reads `field: reason`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{field}: {reason}")]
pub struct LightSpecError {
    /// The field's name in the text.
    pub field: String,
    /// The reason for which the field is refused.
    pub reason: String,
}

const MISSING: &str = "missing";
/// Angular radius of the real sun.
const SUN_RADIUS_DEG: f64 = 0.27;
/// Default cones of `KHR_lights_punctual`.
const SPOT_CONES_DEG: [f64; 2] = [0.0, 45.0];
/// Vectors whose squared length is this close to 1 stay unchanged, so that a normalised vector keeps its bits.
const UNIT_TOLERANCE: f64 = 1e-6;

impl FromStr for LightSpec {
    type Err = LightSpecError;

    fn from_str(text: &str) -> Result<Self, LightSpecError> {
        let mut words = text.split_ascii_whitespace();
        let kind = words.next().ok_or_else(|| wrong("light", MISSING))?;
        let light = match kind {
            "sun" => {
                let fields = Fields::read(words, &["towards", "irradiance", "angle"])?;
                Light::Directional {
                    towards_light_in_world: fields.direction("towards")?,
                    irradiance_linear: fields.color("irradiance")?,
                    angular_radius_rad: fields.angle_rad("angle", SUN_RADIUS_DEG)?,
                }
            }
            "point" => {
                let fields = Fields::read(words, &["at", "intensity", "radius"])?;
                Light::Point {
                    position_in_world: fields.vector("at")?.as_vec3(),
                    intensity_linear: fields.color("intensity")?,
                    radius_m: fields.number("radius", 0.0)? as f32,
                }
            }
            "spot" => {
                let fields = Fields::read(words, &["at", "towards", "intensity", "inner", "outer", "radius"])?;
                Light::Spot {
                    position_in_world: fields.vector("at")?.as_vec3(),
                    forward_in_world: fields.direction("towards")?,
                    intensity_linear: fields.color("intensity")?,
                    inner_cone_rad: fields.angle_rad("inner", SPOT_CONES_DEG[0])?,
                    outer_cone_rad: fields.angle_rad("outer", SPOT_CONES_DEG[1])?,
                    radius_m: fields.number("radius", 0.0)? as f32,
                }
            }
            "rectangle" => {
                let fields = Fields::read(words, &["at", "u", "v", "radiance"])?;
                Light::Rectangle {
                    center_in_world: fields.vector("at")?.as_vec3(),
                    half_edges_in_world: [fields.vector("u")?.as_vec3(), fields.vector("v")?.as_vec3()],
                    radiance_linear: fields.color("radiance")?,
                }
            }
            other => return Err(unknown(other, &["sun", "point", "spot", "rectangle"])),
        };
        light.validate().map_err(|e| invalid(&e))?;
        Ok(Self(light))
    }
}

impl FromStr for EnvironmentSpec {
    type Err = LightSpecError;

    fn from_str(text: &str) -> Result<Self, LightSpecError> {
        let text = text.trim();
        let path = Path::new(text);
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        if extension.eq_ignore_ascii_case("hdr") {
            return Ok(Self::File(path.to_owned()));
        }
        // The fraction of a number begins with a digit.
        if extension.starts_with(|first: char| first.is_ascii_alphabetic()) {
            return Err(malformed("environment", text, "a colour or a file in Radiance's format: only .hdr is read"));
        }
        let environment = match text.split_once('/') {
            Some((zenith, nadir)) => Environment::gradient(color_from("zenith", zenith)?, color_from("nadir", nadir)?),
            None => Environment::uniform(color_from("environment", text)?),
        };
        Ok(Self::Colors(environment))
    }
}

/// `name=value` pairs; each name is known and occurs once.
struct Fields<'a>(Vec<(&'a str, &'a str)>);

impl<'a> Fields<'a> {
    fn read(words: impl Iterator<Item = &'a str>, known: &[&str]) -> Result<Self, LightSpecError> {
        let mut fields: Vec<(&str, &str)> = Vec::new();
        for word in words {
            let (name, value) = word.split_once('=').unwrap_or((word, ""));
            if !known.contains(&name) {
                return Err(unknown(name, known));
            }
            if fields.iter().any(|(other, _)| *other == name) {
                return Err(wrong(name, "given twice"));
            }
            fields.push((name, value));
        }
        Ok(Self(fields))
    }

    fn get(&self, name: &str) -> Option<&'a str> {
        self.0.iter().find(|(other, _)| *other == name).map(|(_, value)| *value)
    }

    fn vector(&self, name: &str) -> Result<DVec3, LightSpecError> {
        let text = self.get(name).ok_or_else(|| wrong(name, MISSING))?;
        numbers(text).map(DVec3::from).ok_or_else(|| malformed(name, text, "three finite numbers X,Y,Z"))
    }

    fn direction(&self, name: &str) -> Result<Vec3, LightSpecError> {
        let vector = self.vector(name)?;
        if (vector.length_squared() - 1.0).abs() < UNIT_TOLERANCE {
            return Ok(vector.as_vec3());
        }
        let unit = vector.try_normalize().map(|unit| unit.as_vec3());
        unit.ok_or_else(|| wrong(name, "it has no length"))
    }

    fn color(&self, name: &str) -> Result<Vec3, LightSpecError> {
        self.get(name).map_or(Ok(Vec3::ONE), |text| color_from(name, text))
    }

    fn angle_rad(&self, name: &str, default_deg: f64) -> Result<f32, LightSpecError> {
        Ok(self.number(name, default_deg)?.to_radians() as f32)
    }

    fn number(&self, name: &str, default: f64) -> Result<f64, LightSpecError> {
        let Some(text) = self.get(name) else { return Ok(default) };
        let [number] = numbers(text).ok_or_else(|| malformed(name, text, "a finite number"))?;
        Ok(number)
    }
}

/// `N` numbers between commas, finite in `f32` too.
fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|word| word.parse().ok()).collect();
    let numbers: [f64; N] = numbers?.try_into().ok()?;
    numbers.iter().all(|&n| (n as f32).is_finite()).then_some(numbers)
}

fn color_from(field: &str, text: &str) -> Result<Vec3, LightSpecError> {
    let linear = numbers(text).map(|[v]| DVec3::splat(v)).or_else(|| numbers(text).map(DVec3::from));
    let color = srgb_color(text).or(linear.map(|color| color.as_vec3()));
    let color = color.ok_or_else(|| malformed(field, text, "a number, three numbers R,G,B or #rrggbb"))?;
    let is_light = color.min_element() >= 0.0;
    if is_light { Ok(color) } else { Err(wrong(field, "negative")) }
}

fn srgb_color(text: &str) -> Option<Vec3> {
    let digits = text.strip_prefix('#').filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()))?;
    let [_, r, g, b] = u32::from_str_radix(digits, 16).ok()?.to_be_bytes();
    Some(Vec3::from([r, g, b].map(linear_from_srgb8)))
}

fn wrong(field: &str, reason: impl Into<String>) -> LightSpecError {
    LightSpecError { field: field.to_owned(), reason: reason.into() }
}

fn unknown(field: &str, known: &[&str]) -> LightSpecError {
    wrong(field, format!("unknown; known are {}", known.join(", ")))
}

fn malformed(field: &str, text: &str, expected: &str) -> LightSpecError {
    wrong(field, format!("{text:?} is not {expected}"))
}

/// Renames a field of the model to its name in the text.
fn invalid(error: &LightError) -> LightSpecError {
    let field = match error.field {
        "towards_light" | "forward" => "towards",
        "position" | "center" => "at",
        "angular_radius" => "angle",
        "inner_cone" => "inner",
        "outer_cone" => "outer",
        "half_edges" => "u, v",
        same => same,
    };
    wrong(field, error.reason)
}
