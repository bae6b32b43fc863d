//! Piecewise cubic interpolation that rises and falls with its points (Fritsch and Butland 1984, "A Method for Constructing
//! Local Monotone Piecewise Cubic Interpolants").

/// The curve through some points.
#[derive(Debug, Clone)]
pub struct Pchip {
    x: Vec<f64>,
    y: Vec<f64>,
    /// dy/dx at the points.
    slopes: Vec<f64>,
}

impl Pchip {
    /// Through at least two points, with rising x.
    pub fn new(points: &[(f64, f64)]) -> Self {
        let (x, y): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
        let widths: Vec<f64> = x.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let secants: Vec<f64> = y.windows(2).zip(&widths).map(|(pair, width)| (pair[1] - pair[0]) / width).collect();
        let slopes = slopes(&widths, &secants);
        Self { x, y, slopes }
    }

    /// The first and the last x.
    pub fn range(&self) -> [f64; 2] {
        [self.x[0], self.x[self.x.len() - 1]]
    }

    /// y at an x within the range.
    pub fn at(&self, x: f64) -> f64 {
        self.value(x, x, x)
    }

    /// The mean of y from one x to a greater one, both within the range.
    pub fn mean(&self, from: f64, to: f64) -> f64 {
        let inner = self.x.iter().copied().filter(|x| (from..to).contains(x) && *x > from);
        let cuts: Vec<f64> = [from].into_iter().chain(inner).chain([to]).collect();
        cuts.windows(2).map(|pair| self.piece_integral(pair[0], pair[1])).sum::<f64>() / (to - from)
    }

    /// The integral of y over a part of one piece. Simpson's rule is exact for cubics.
    fn piece_integral(&self, a: f64, b: f64) -> f64 {
        (b - a) / 6.0 * (self.value(a, a, b) + 4.0 * self.value(0.5 * (a + b), a, b) + self.value(b, a, b))
    }

    /// y at an x of the piece that has all from `a` to `b`.
    fn value(&self, x: f64, a: f64, b: f64) -> f64 {
        let middle = 0.5 * (a + b);
        let piece = self.x[1..self.x.len() - 1].iter().filter(|start| **start < middle).count();
        let width = self.x[piece + 1] - self.x[piece];
        let t = (x - self.x[piece]) / width;
        let rise = (3.0 - 2.0 * t) * t * t;
        let start = t * (1.0 - t).powi(2);
        let end = t * t * (t - 1.0);
        (1.0 - rise) * self.y[piece]
            + rise * self.y[piece + 1]
            + width * (start * self.slopes[piece] + end * self.slopes[piece + 1])
    }
}

fn slopes(widths: &[f64], secants: &[f64]) -> Vec<f64> {
    let last = secants.len() - 1;
    if last == 0 {
        return vec![secants[0]; 2];
    }
    let inner = (1..=last).map(|place| inner_slope([place - 1, place].map(|piece| (widths[piece], secants[piece]))));
    let first = end_slope([0, 1].map(|piece| (widths[piece], secants[piece])));
    let end = end_slope([last, last - 1].map(|piece| (widths[piece], secants[piece])));
    [first].into_iter().chain(inner).chain([end]).collect()
}

/// The weighted harmonic mean of the secants on both sides; 0 at a turn.
fn inner_slope([(width_a, secant_a), (width_b, secant_b)]: [(f64, f64); 2]) -> f64 {
    if secant_a * secant_b <= 0.0 {
        return 0.0;
    }
    let a = width_a + 2.0 * width_b;
    let b = 2.0 * width_a + width_b;
    (a + b) / (a / secant_a + b / secant_b)
}

/// That of a parabola through three points, within what keeps the shape. The first piece is that of the end.
fn end_slope([(width, secant), (next_width, next_secant)]: [(f64, f64); 2]) -> f64 {
    let slope = ((2.0 * width + next_width) * secant - width * next_secant) / (width + next_width);
    if slope * secant <= 0.0 {
        0.0
    } else if secant * next_secant <= 0.0 && slope.abs() > 3.0 * secant.abs() {
        3.0 * secant
    } else {
        slope
    }
}
