//! The fluid's end of the link to the coupler: each side is told about the other, motion comes in, load goes out.

use protocol::control::StepTime;
use protocol::header::{Header, Kind};
use protocol::interface::{BodyMesh, Contract, PointWall, Response};
use protocol::link::{Expect, Knock, Link, LinkError, Transport, agree};

use crate::body::Structure;
use crate::fluid::Fluid;
use crate::nodes::Motion;
use crate::offer::Offer;

const PEER: &str = "coupler";

/// The link and what came over it.
pub(crate) struct Interface {
    link: Box<dyn Link<f64>>,
    motion: Vec<f64>,
    /// Values of one column of the motion, n D.
    column_len: usize,
    response: Response,
    /// Of points without a mesh: whether the motion ends with normals.
    has_normals: bool,
    /// At the doors of those who wait for the load, one after the other.
    knocks: Vec<Knock>,
}

impl Interface {
    /// Takes the dummy mesh.
    pub(crate) fn to_mesh<const D: usize>(
        contract: Contract,
        transport: &mut dyn Transport,
    ) -> Result<(Self, Structure<D>), LinkError> {
        // A load is one force per node and one pressure per marker; a node has at most one marker per axis.
        let mut link = transport.connect(PEER, 8 + 2 * contract.node_count * D)?;
        agree(&mut *link, &contract)?;
        let mut mesh = None;
        let expect = Expect { kind: Kind::BodyMesh, step: 0, count: None };
        link.receive(expect, &mut |_, values| mesh = Some(BodyMesh::decode(values, PEER)))?;
        let mesh = mesh.expect("a message that was received was read")?;
        let interface = Self {
            link,
            motion: vec![0.0; mesh.motion_len()],
            column_len: mesh.node_count() * D,
            response: mesh.response,
            has_normals: false,
            knocks: knocks(transport),
        };
        Ok((interface, Structure::Mesh(mesh)))
    }

    /// Offers points, and takes what is said of the wall behind them.
    pub(crate) fn to_points<const D: usize>(
        contract: Contract,
        offer: Offer<D>,
        transport: &mut dyn Transport,
    ) -> Result<(Self, Structure<D>), LinkError> {
        let offered = offer.points().encode();
        // A load, a force per point and a pressure per marker, is shorter than the offer.
        let mut link = transport.connect(PEER, offered.len().max(8))?;
        agree(&mut *link, &Contract { node_count: offer.len(), ..contract })?;
        let header = Header::new(Kind::Points, 0, 0.0, 0.0);
        link.send(header, offered.len(), &mut |out| out.copy_from_slice(&offered))?;
        let mut wall = None;
        let expect = Expect { kind: Kind::PointWall, step: 0, count: Some(2 + offer.len()) };
        link.receive(expect, &mut |_, values| wall = Some(PointWall::decode(values, PEER)))?;
        let wall = wall.expect("a message that was received was read")?;
        let interface = Self {
            link,
            motion: vec![0.0; wall.motion_len(D)],
            column_len: offer.len() * D,
            response: wall.response,
            has_normals: true,
            knocks: knocks(transport),
        };
        Ok((interface, Structure::Points(offer, wall)))
    }

    pub(crate) fn receive(&mut self, at: StepTime) -> Result<(), LinkError> {
        let expect = Expect { kind: Kind::Motion, step: at.step, count: Some(self.motion.len()) };
        let motion = &mut self.motion;
        self.link.receive(expect, &mut |_, values| motion.copy_from_slice(values))
    }

    /// The first value of the message to a Robin wall.
    pub(crate) fn gives_way(&self) -> bool {
        self.response == Response::Robin && self.motion[0] != 0.0
    }

    pub(crate) fn motion(&self) -> Motion<'_> {
        let mut rest = &self.motion[usize::from(self.response == Response::Robin)..];
        let mut column = || rest.split_off(..self.column_len).expect("the length was agreed on");
        Motion {
            position: column(),
            velocity: column(),
            acceleration: (self.response == Response::Prescribed).then(&mut column),
            normal: self.has_normals.then(&mut column),
        }
    }

    /// Lets those who wait for the load know that it is about to come.
    pub(crate) fn knock(&self) {
        self.knocks.iter().for_each(|knock| knock());
    }

    pub(crate) fn send<const D: usize>(&mut self, at: StepTime, fluid: &Fluid<D>) -> Result<(), LinkError> {
        let (pressure, force) = (fluid.marker_pressure(), fluid.pair_force());
        let header = Header::new(Kind::Load, at.step, at.time, at.dt);
        self.link.send(header, pressure.len() + force.len(), &mut |out| {
            out[..pressure.len()].copy_from_slice(pressure);
            out[pressure.len()..].copy_from_slice(force);
        })
    }
}

fn knocks(transport: &mut dyn Transport) -> Vec<Knock> {
    [PEER, "solid"].into_iter().filter_map(|role| transport.knock(role)).collect()
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use protocol::inprocess::Hub;

    use super::*;

    const DT: f64 = 1e-3;

    fn offer() -> Offer<2> {
        Offer { position: vec![[0.1, 0.2], [0.3, 0.4]], volume: vec![0.5], area: vec![0.6], layers: 1 }
    }

    fn contract() -> Contract {
        Contract { dimension: 2, node_count: 2, end_time: 1.0, scene: 7 }
    }

    /// The fluid's side after one motion message.
    fn told(response: Response, message: &[f64]) -> Interface {
        let hub = Hub::new(Duration::from_secs(20));
        let mut transport = hub.transport("fluid");
        let coupler = std::thread::spawn({
            let (hub, message) = (hub.clone(), message.to_vec());
            move || {
                let mut link = hub.transport("coupler").connect("fluid", 100).unwrap();
                agree(&mut *link, &contract()).unwrap();
                let expect = Expect { kind: Kind::Points, step: 0, count: None };
                link.receive(expect, &mut |_, values| assert_eq!(values, offer().points().encode())).unwrap();
                let wall = PointWall { response, response_mass: vec![1.0, 2.0] }.encode();
                let messages = [
                    (Header::new(Kind::PointWall, 0, 0.0, 0.0), wall),
                    (Header::new(Kind::Motion, 1, DT, DT), message),
                ];
                for (header, values) in messages {
                    link.send(header, values.len(), &mut |out| out.copy_from_slice(&values)).unwrap();
                }
            }
        });
        let (mut interface, structure) = Interface::to_points(contract(), offer(), &mut transport).unwrap();
        assert!(matches!(structure, Structure::Points(_, wall) if wall.response_mass == [1.0, 2.0]));
        interface.receive(StepTime { step: 1, time: DT, dt: DT }).unwrap();
        coupler.join().unwrap();
        interface
    }

    const COLUMNS: [[f64; 4]; 4] =
        [[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0], [9.0, 10.0, 11.0, 12.0], [0.0, 1.0, -1.0, 0.0]];

    #[test]
    fn the_motion_of_points_is_read_as_each_response_lays_it_out() {
        let [x, v, a, n] = COLUMNS;
        for (response, message, gives_way) in [
            (Response::Robin, [&[1.0][..], &x, &v, &n].concat(), true),
            (Response::Robin, [&[0.0][..], &x, &v, &n].concat(), false),
            (Response::Given, [x, v, n].concat(), false),
            (Response::Prescribed, [x, v, a, n].concat(), false),
        ] {
            let interface = told(response, &message);
            let motion = interface.motion();
            assert_eq!((motion.position, motion.velocity), (&x[..], &v[..]));
            assert_eq!(motion.acceleration, (response == Response::Prescribed).then_some(&a[..]));
            assert_eq!((motion.normal, interface.gives_way()), (Some(&n[..]), gives_way));
        }
    }
}
