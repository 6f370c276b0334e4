//! What the ledger is told: sums over both sides, those of the loads while the structure moves, those along its motion
//! once that is known.

use protocol::case::Scheme;
use protocol::control::StepTime;
use protocol::failure::Failure;

use crate::case::LoadForm;
use crate::coupled::Coupled;
use crate::ledger::{Entry, LoadSums, WorkSums};
use crate::resultant::{Resultant, Work, dot};

impl Coupled {
    /// The load that has acted on the solid during the step where that is not the present one, `[n, D]` N.
    fn other_acted(&self) -> Option<&[f64]> {
        matches!(self.scheme, Scheme::Parallel | Scheme::ToFluid).then_some(&self.acted)
    }

    /// Force and moment of both sides, once the loads of the step are known.
    pub(crate) fn sum_loads(&mut self) {
        let (dimension, acting) = (self.surface.dimension, self.load.acting());
        // Points that turn with the wall carry a load's moment to the place the wall has, all others to any place.
        let (reference, tied) = (&self.surface.reference_position, self.turned.as_ref());
        let (points, nodes) = match tied {
            Some(turned) => (&turned.points[..], &turned.solid[..]),
            None => (self.side.reference_position(), &reference[..]),
        };
        let position = &self.motion.position;
        let fluid = Resultant::new(dimension, acting, |i| position[i], |i| points[i]);
        let before = &self.displacement_before;
        let on_solid = |load| Resultant::new(dimension, load, |i| reference[i] + before[i], |i| nodes[i]);
        let solid = on_solid(&self.load.on_solid);
        let acted = self.other_acted().map_or(solid, on_solid);
        let other = self.load.other_total();
        let (pair, markers) = match self.settings.load {
            LoadForm::Pair => (fluid.force, other),
            LoadForm::Markers => (other, fluid.force),
        };
        let power = dot(acting, |i| self.motion.velocity[i]);
        self.load_sums = Some(LoadSums { fluid, solid, acted, pair, markers, power });
    }

    /// Work along the solid's motion over the step.
    fn sum_works(&self) -> WorkSums {
        let (now, before) = (&self.solid.displacement, &self.displacement_before);
        let motion = |i: usize| now[i] - before[i];
        let Work { work: mapped, greatest: greatest_motion } = Work::new(&self.load.on_solid, motion);
        let acted = self.other_acted().map_or(mapped, |load| dot(load, motion));
        let carried = self.mapping.work(self.load.acting(), motion);
        WorkSums { carried, mapped, acted, greatest_motion }
    }

    pub(crate) fn book_ledger(&mut self, at: StepTime) -> Result<(), Failure> {
        if self.load_sums.is_none() {
            self.sum_loads();
        }
        let loads = self.load_sums.take().expect("they have just been found");
        let works = self.sum_works();
        self.jump.book(at.time, loads.fluid.force);
        let passes = self.passes.as_mut().filter(|_| self.scheme == Scheme::Strong);
        let passes = passes.map_or(1, |passes| passes.settle());
        let entry = Entry { time: at.time, dt: at.dt, loads, works, passes };
        self.ledger.book(&entry, self.jump.running())
    }
}
