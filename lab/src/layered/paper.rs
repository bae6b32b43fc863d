//! The figures of Lischinski and Rappoport's Table 1.

/// Megabytes of the paper: its slab of 192 MB has 32 × 32 × 256² texels of three bytes.
pub const MB: f64 = (1 << 20) as f64;
/// Layers of the lines of images.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layers {
    pub mean: f64,
    pub most: usize,
}

/// A layered light field of Table 1, of 64² lines a direction.
#[derive(Debug, Clone)]
pub struct LightField {
    pub directions: u32,
    pub mb: f64,
    pub samples: Option<usize>,
    pub sent_mb: Option<f64>,
    pub construction_s: Option<f64>,
}

impl LightField {
    /// Lines along each side of a direction's square.
    pub const LINES: u32 = 64;

    const fn of_paper(directions: u32, mb: f64) -> Self {
        Self { directions, mb, samples: None, sent_mb: None, construction_s: None }
    }

    pub fn bytes_a_line(&self) -> f64 {
        self.mb * MB / f64::from(self.directions * Self::LINES * Self::LINES)
    }
}

/// A column of Table 1: of the paper, in seconds of a 200 MHz Pentium Pro, or of a scene here.
#[derive(Debug, Clone)]
pub struct Column {
    pub name: &'static str,
    pub primitives: usize,
    pub cube_mb: f64,
    pub sent_mb: Option<f64>,
    /// Of six images, each with the surfaces that face it.
    pub layers: Layers,
    pub light_field: LightField,
    /// Of the cube and of the light field.
    pub construction_s: f64,
    pub warp_s: f64,
    /// The paper says that there are fewer.
    pub holes_percent: f64,
    pub walk_s: Option<f64>,
    /// The view-dependent pass and the whole view, by gathering alone, after one reflection, and with seven reflections.
    pub pass_s: [Option<f64>; 3],
    pub view_s: [Option<f64>; 3],
    /// Ray tracing or direct drawing, with all reflections.
    pub direct_s: f64,
}

/// What the paper's columns share.
const OF_PAPER: Column = Column {
    name: "",
    primitives: 0,
    cube_mb: f64::NAN,
    sent_mb: None,
    layers: Layers { mean: f64::NAN, most: 0 },
    light_field: LightField::of_paper(0, f64::NAN),
    construction_s: f64::NAN,
    warp_s: f64::NAN,
    holes_percent: 2.0,
    walk_s: None,
    pass_s: [None; 3],
    view_s: [None; 3],
    direct_s: f64::NAN,
};

pub const TABLE_1: [Column; 3] = [
    Column {
        name: "paper: sphere & cylinder",
        primitives: 8,
        cube_mb: 42.5,
        layers: Layers { mean: 0.97, most: 3 },
        light_field: LightField::of_paper(258, 11.7),
        construction_s: 582.0,
        warp_s: 2.9,
        pass_s: [Some(2.7), Some(4.3), Some(4.5)],
        view_s: [Some(5.6), Some(7.2), Some(7.5)],
        direct_s: 8.2,
        ..OF_PAPER
    },
    Column {
        name: "paper: teapot",
        primitives: 9121,
        cube_mb: 28.8,
        layers: Layers { mean: 0.53, most: 4 },
        light_field: LightField::of_paper(1026, 19.3),
        construction_s: 726.0,
        warp_s: 1.3,
        pass_s: [Some(3.2), None, None],
        view_s: [Some(4.5), None, None],
        direct_s: 126.1,
        ..OF_PAPER
    },
    Column {
        name: "paper: teapot & spheres",
        primitives: 9179,
        cube_mb: 50.6,
        layers: Layers { mean: 1.23, most: 10 },
        light_field: LightField::of_paper(66, 3.1),
        construction_s: 2420.0,
        warp_s: 3.5,
        pass_s: [Some(2.7), Some(11.1), None],
        view_s: [Some(6.2), Some(14.6), None],
        direct_s: 22.2,
        ..OF_PAPER
    },
];

impl Column {
    /// With the most reflections.
    fn last_view_s(&self) -> Option<f64> {
        self.view_s.iter().copied().flatten().last()
    }

    pub fn over_direct(&self) -> Option<f64> {
        Some(self.last_view_s()? / self.direct_s)
    }

    /// Views after which the construction is repaid; `None` if never.
    pub fn repaid(&self) -> Option<f64> {
        let saved_s = self.direct_s - self.last_view_s()?;
        (saved_s > 0.0).then_some(self.construction_s / saved_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes a texel and a sample of the paper's layout: with these, six images of 512² have the sizes of Table 1.
    const TEXEL_BYTES: f64 = 8.2;
    const SAMPLE_BYTES: f64 = 20.8;

    #[test]
    fn six_images_of_the_assumed_layout_have_the_sizes_of_table_1() {
        for column in &TABLE_1 {
            let texels = 6 * 512 * 512;
            let bytes_a_texel = TEXEL_BYTES + column.layers.mean * SAMPLE_BYTES;
            let mb = f64::from(texels) * bytes_a_texel / MB;
            assert!((mb / column.cube_mb - 1.0).abs() < 0.01, "{}: {mb}", column.name);
        }
    }

    #[test]
    fn the_paper_s_light_fields_have_not_one_layout() {
        let bytes = TABLE_1.each_ref().map(|column| column.light_field.bytes_a_line());
        let computed = [11.6, 4.8, 12.0];
        assert!(bytes.iter().zip(computed).all(|(bytes, computed)| (bytes - computed).abs() < 0.05), "{bytes:?}");
    }

    #[test]
    fn the_paper_s_scenes_are_repaid_after_831_6_and_318_views() {
        let repaid = TABLE_1.each_ref().map(|column| column.repaid().map(f64::round));
        assert_eq!(repaid, [Some(831.0), Some(6.0), Some(318.0)]);
    }
}
