//! The surfaces that sample cameras at some of several places see.

/// Pixels of views that show a surface, by the places from which a sample camera sees it.
#[derive(Debug, Clone)]
pub struct Coverage {
    places: usize,
    /// At each set of places, one bit a place, the pixels that are seen from these and no others.
    pixels: Vec<u64>,
}

impl Coverage {
    /// Without pixels yet.
    pub fn new(places: usize) -> Self {
        Self { places, pixels: vec![0; 1 << places] }
    }

    /// Adds pixels, each by its set of places.
    pub fn add(&mut self, sets: impl IntoIterator<Item = u32>) {
        sets.into_iter().for_each(|set| self.pixels[set as usize] += 1);
    }

    /// The share of pixels that no camera at a set of places sees.
    pub fn disocclusion(&self, chosen: u32) -> f64 {
        let unseen = self.pixels.iter().enumerate().filter(|(set, _)| *set as u32 & chosen == 0);
        let unseen: u64 = unseen.map(|(_, pixels)| pixels).sum();
        unseen as f64 / self.pixels.iter().sum::<u64>().max(1) as f64
    }

    /// Places one after another, each the one with the least disocclusion together with those before it.
    pub fn greedy(&self, count: usize) -> u32 {
        (0..count.min(self.places)).fold(0, |chosen, _| {
            let others = (0..self.places).map(|place| 1 << place).filter(|place| chosen & place == 0);
            chosen | self.least(others.map(|place| chosen | place)) & !chosen
        })
    }

    /// The set of `count` places with the least disocclusion of all.
    pub fn best(&self, count: usize) -> u32 {
        self.least((0..1 << self.places).filter(|set: &u32| set.count_ones() as usize == count.min(self.places)))
    }

    fn least(&self, sets: impl Iterator<Item = u32>) -> u32 {
        sets.min_by(|&a, &b| self.disocclusion(a).total_cmp(&self.disocclusion(b))).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Place 0 sees six pixels of ten; 1 and 2 see five each, and together all.
    fn coverage() -> Coverage {
        let mut coverage = Coverage::new(3);
        coverage.add([0b011, 0b011, 0b011, 0b101, 0b101, 0b101, 0b010, 0b010, 0b100, 0b100]);
        coverage
    }

    #[test]
    fn disocclusion_is_the_share_that_no_place_sees() {
        let of = [0b000, 0b001, 0b010, 0b110, 0b111].map(|set| coverage().disocclusion(set));
        assert_eq!(of, [1.0, 0.4, 0.5, 0.0, 0.0]);
        assert_eq!(Coverage::new(3).disocclusion(0b111), 0.0, "of no pixels");
    }

    #[test]
    fn the_best_two_places_need_not_contain_the_best_one() {
        assert_eq!([1, 2, 3].map(|count| coverage().greedy(count)), [0b001, 0b011, 0b111]);
        assert_eq!([1, 2, 3].map(|count| coverage().best(count)), [0b001, 0b110, 0b111]);
        assert_eq!((coverage().greedy(9), coverage().best(9), coverage().best(0)), (0b111, 0b111, 0));
    }
}
