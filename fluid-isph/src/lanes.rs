//! Eight values at once, chosen when the program runs: a loop is compiled for the widest vectors the processor may
//! have and once for any processor. Both give the same bits.

/// Values a vector holds.
pub const LANES: usize = 8;

/// The two operations on vectors that the compiler does not find by itself.
pub trait Lanes: Copy {
    /// Bit k is set where value k is below the limit.
    fn below(self, values: [f32; LANES], limit: f32) -> usize;

    /// Value k of the result is value order\[k\].
    fn shuffle(self, values: [f32; LANES], order: [u32; LANES]) -> [f32; LANES];
}

/// Any processor.
#[derive(Debug, Clone, Copy)]
pub struct Portable;

impl Lanes for Portable {
    #[inline(always)]
    fn below(self, values: [f32; LANES], limit: f32) -> usize {
        (0..LANES).map(|k| usize::from(values[k] < limit) << k).sum()
    }

    #[inline(always)]
    fn shuffle(self, values: [f32; LANES], order: [u32; LANES]) -> [f32; LANES] {
        order.map(|k| values[k as usize % LANES])
    }
}

#[cfg(target_arch = "x86_64")]
impl Lanes for pulp::x86::V3 {
    #[inline(always)]
    fn below(self, values: [f32; LANES], limit: f32) -> usize {
        let limits = self.avx._mm256_set1_ps(limit);
        let below = self.avx._mm256_cmp_ps::<{ std::arch::x86_64::_CMP_LT_OQ }>(pulp::cast(values), limits);
        self.avx._mm256_movemask_ps(below) as usize
    }

    #[inline(always)]
    fn shuffle(self, values: [f32; LANES], order: [u32; LANES]) -> [f32; LANES] {
        pulp::cast(self.avx2._mm256_permutevar8x32_ps(pulp::cast(values), pulp::cast(order)))
    }
}

/// For each set of hits, bit by bit, the lanes that hit, in rising order; the rest is 0.
pub static PACKED: [[u32; LANES]; 1 << LANES] = {
    let mut table = [[0; LANES]; 1 << LANES];
    let mut hits = 0;
    while hits < table.len() {
        let (mut lane, mut count) = (0, 0);
        while lane < LANES {
            if hits >> lane & 1 == 1 {
                table[hits][count] = lane as u32;
                count += 1;
            }
            lane += 1;
        }
        hits += 1;
    }
    table
};

/// Work that is compiled once for each width; its `run` and everything below it is `inline(always)`.
pub trait Task {
    /// Does the work.
    fn run<L: Lanes>(self, lanes: L);
}

/// Runs a task with the widest vectors there are.
pub fn dispatch<T: Task>(task: T) {
    #[cfg(target_arch = "x86_64")]
    if let Some(lanes) = pulp::x86::V3::try_new() {
        struct Widest<T>(T, pulp::x86::V3);
        impl<T: Task> pulp::NullaryFnOnce for Widest<T> {
            type Output = ();

            #[inline(always)]
            fn call(self) {
                self.0.run(self.1);
            }
        }
        return lanes.vectorize(Widest(task, lanes));
    }
    task.run(Portable);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that both ways agree on one set of values.
    struct Agree([f32; LANES]);

    impl Task for Agree {
        fn run<L: Lanes>(self, lanes: L) {
            let hits = lanes.below(self.0, 0.5);
            assert_eq!(hits, Portable.below(self.0, 0.5));
            let order = PACKED[hits];
            let packed = lanes.shuffle(self.0, order);
            assert_eq!(packed, Portable.shuffle(self.0, order));
            let wanted: Vec<f32> = self.0.into_iter().filter(|&value| value < 0.5).collect();
            assert_eq!(packed[..hits.count_ones() as usize], wanted);
        }
    }

    #[test]
    fn hits_are_packed_in_their_order() {
        for pattern in 0..1usize << LANES {
            let value = |k: usize| if pattern >> k & 1 == 1 { 0.01 * k as f32 } else { 0.5 + k as f32 };
            dispatch(Agree(std::array::from_fn(value)));
        }
        dispatch(Agree([f32::INFINITY; LANES]));
    }
}
