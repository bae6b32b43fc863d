//! A sample image of any kind to header and payload, and back.

use depth_image::{SampleCamera, SampleImage, SampleImageError};

use crate::image_codec::{decode_depth_image, encode_depth_image};
use crate::layered_image_codec::{decode_layered_image, decode_light_field, encode_layered_image, encode_light_field};
use crate::{DecodeError, DecodeLimits, EncodedImage, ImageHeader};

/// Packs an image with all of its planes.
///
/// # Errors
/// Planes that do not form an image; planes of highlights without normals.
pub fn encode_sample_image(image: &SampleImage) -> Result<EncodedImage, SampleImageError> {
    Ok(match image {
        SampleImage::Depth(image) => encode_depth_image(image)?,
        SampleImage::Layered(image) => encode_layered_image(image)?,
        SampleImage::LightField(image) => encode_light_field(image)?,
    })
}

/// Unpacks the image of a camera, which must have passed its own validation.
///
/// # Errors
/// A header that is inconsistent, over the limits, or not of the camera. A payload that does not decode to exactly the
/// planes of the header.
pub fn decode_sample_image(
    header: &ImageHeader,
    camera: &SampleCamera,
    payload: &[u8],
    limits: &DecodeLimits,
) -> Result<SampleImage, DecodeError> {
    Ok(match camera {
        SampleCamera::Depth(camera) => SampleImage::Depth(decode_depth_image(header, *camera, payload, limits)?),
        SampleCamera::Layered(camera) => SampleImage::Layered(decode_layered_image(header, *camera, payload, limits)?),
        SampleCamera::LightField(camera) => {
            SampleImage::LightField(decode_light_field(header, *camera, payload, limits)?)
        }
    })
}
