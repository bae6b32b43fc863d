//! The image of a texture, which may be there in several formats.

use gltf::json::Index;
use gltf::json::image::Image;
use gltf::json::texture::Texture as JsonTexture;

use super::document::Document;

/// A format of pictures that is not read.
struct UnreadFormat {
    name: &'static str,
    extension: &'static str,
    mime_type: &'static str,
    file_ending: &'static str,
    /// The command line that converts a file, as the end of a sentence.
    advice: &'static str,
}

const UNREAD: [UnreadFormat; 2] = [
    UnreadFormat {
        name: "AVIF",
        extension: "EXT_texture_avif",
        mime_type: "image/avif",
        file_ending: ".avif",
        advice: "; `npx @gltf-transform/cli png IN OUT` converts the file",
    },
    UnreadFormat {
        name: "DDS",
        extension: "MSFT_texture_dds",
        mime_type: "image/vnd-ms.dds",
        file_ending: ".dds",
        advice: "",
    },
];

/// The image of a texture: in WebP, where the file has it in another format, too; in KTX2 where it has no other. The error is
/// the reason for which there is none, with advice.
pub(super) fn image_of(document: &Document, texture: &JsonTexture) -> Result<Index<Image>, String> {
    let extensions = texture.extensions.as_ref().map(|extensions| &extensions.others);
    let of_extension = |name: &str| {
        let source = extensions?.get(name)?.get("source")?.as_u64()?;
        u32::try_from(source).ok().map(Index::new)
    };
    let sources = [of_extension("EXT_texture_webp"), Some(texture.source), of_extension("KHR_texture_basisu")];
    let mut by_content = None;
    for index in sources.into_iter().flatten() {
        let image = document.root.get(index);
        if image.is_some_and(|image| image.uri.is_some() || image.buffer_view.is_some()) {
            match unread_format(document, index) {
                None => return Ok(index),
                format => by_content = by_content.or(format),
            }
        }
    }
    let format = by_content.or_else(|| UNREAD.iter().find(|format| of_extension(format.extension).is_some()));
    let Some(UnreadFormat { name, extension, advice, .. }) = format else {
        return Err("textures without a picture: materials show their factors".into());
    };
    Err(format!("pictures in {name} ({extension}), which are not read: materials show their factors{advice}"))
}

/// The format of an image, by what the file says of it and by its first bytes.
fn unread_format(document: &Document, image: Index<Image>) -> Option<&'static UnreadFormat> {
    let json = document.root.get(image)?;
    let mime_type = json.mime_type.as_ref().map(|mime_type| mime_type.0.as_str());
    let uri = json.uri.as_ref().map(|uri| uri.to_ascii_lowercase());
    let start = json.buffer_view.and_then(|view| document.view(view, "image").ok()).map(|(_, bytes)| bytes);
    let is_avif = start.and_then(|bytes| bytes.get(4..12)) == Some(b"ftypavif");
    UNREAD.iter().find(|format| {
        let is_named = uri.as_ref().is_some_and(|uri| {
            let path = uri.split('?').next().unwrap_or(uri);
            path.ends_with(format.file_ending) || uri.starts_with(&format!("data:{}", format.mime_type))
        });
        mime_type == Some(format.mime_type) || is_named || (is_avif && format.name == "AVIF")
    })
}
