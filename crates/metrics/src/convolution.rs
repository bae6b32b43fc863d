//! Separable convolution of one plane.

use rayon::prelude::*;

/// The extension of an image beyond its edge.
#[derive(Clone, Copy)]
pub(crate) enum Edge {
    /// The edge pixel is repeated.
    Repeat,
    /// The image is mirrored about the edge pixel's centre.
    Mirror,
}

impl Edge {
    fn index(self, at: isize, len: usize) -> usize {
        let last = len as isize - 1;
        let inside = match self {
            Self::Repeat => at,
            Self::Mirror if at < 0 => -at,
            Self::Mirror if at > last => 2 * last - at,
            Self::Mirror => at,
        };
        inside.clamp(0, last) as usize
    }
}

/// Values of one channel, rows top-down.
#[derive(Clone, Debug)]
pub(crate) struct Plane {
    pub(crate) width: usize,
    pub(crate) values: Vec<f32>,
}

impl Plane {
    /// Weighs the neighbours along the row by `row_kernel`, then those along the column by
    /// `column_kernel`. Kernels have odd lengths; their middle entry is the pixel's own weight.
    pub(crate) fn convolved(&self, row_kernel: &[f32], column_kernel: &[f32], edge: Edge) -> Self {
        self.along_rows(row_kernel, edge).along_columns(column_kernel, edge)
    }

    fn along_rows(&self, kernel: &[f32], edge: Edge) -> Self {
        let radius = kernel.len() / 2;
        let mut values = vec![0.0; self.values.len()];
        let rows = values.par_chunks_exact_mut(self.width).zip(self.values.par_chunks_exact(self.width));
        rows.for_each(|(out, row)| {
            let padded = padded(row, radius, edge);
            for (x, value) in out.iter_mut().enumerate() {
                *value = kernel.iter().zip(&padded[x..]).map(|(weight, neighbour)| weight * neighbour).sum();
            }
        });
        Self { width: self.width, values }
    }

    fn along_columns(&self, kernel: &[f32], edge: Edge) -> Self {
        let radius = kernel.len() as isize / 2;
        let height = self.values.len() / self.width;
        let mut values = vec![0.0; self.values.len()];
        values.par_chunks_exact_mut(self.width).enumerate().for_each(|(y, out)| {
            for (weight, offset) in kernel.iter().zip(-radius..) {
                let from = edge.index(y as isize + offset, height) * self.width;
                let row = &self.values[from..from + self.width];
                out.iter_mut().zip(row).for_each(|(value, neighbour)| *value += weight * neighbour);
            }
        });
        Self { width: self.width, values }
    }
}

/// The row with `radius` more values at each end.
fn padded(row: &[f32], radius: usize, edge: Edge) -> Vec<f32> {
    let positions = -(radius as isize)..(row.len() + radius) as isize;
    positions.map(|at| row[edge.index(at, row.len())]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_impulse_becomes_the_kernel() {
        let mut plane = Plane { width: 5, values: vec![0.0; 25] };
        plane.values[12] = 1.0;
        let out = plane.convolved(&[0.25, 0.5, 0.25], &[0.0, 0.0, 1.0], Edge::Repeat);
        assert_eq!(out.values[6..9], [0.25, 0.5, 0.25]);
        assert_eq!(out.values.iter().sum::<f32>(), 1.0);
    }

    #[test]
    fn edges_follow_their_rule() {
        let row = [1.0, 2.0, 3.0];
        assert_eq!(padded(&row, 2, Edge::Repeat), [1.0, 1.0, 1.0, 2.0, 3.0, 3.0, 3.0]);
        assert_eq!(padded(&row, 2, Edge::Mirror), [3.0, 2.0, 1.0, 2.0, 3.0, 2.0, 1.0]);
        assert_eq!(padded(&[4.0], 2, Edge::Mirror), [4.0; 5]);
    }
}
