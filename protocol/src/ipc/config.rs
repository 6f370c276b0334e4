//! Settings of iceoryx2: every value that is used is set here, so that no stray configuration file changes a run.

use std::time::Duration;

use iceoryx2::config::Config;
use iceoryx2::node::{Node, NodeBuilder};
use iceoryx2::port::BackpressureAction;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{Alignment, AllocationStrategy, EventId, FileName, Path, SemanticString, ipc};
use iceoryx2::prelude::{LogLevel, SignalHandlingMode, set_log_level};
use iceoryx2::service::port_factory::{event, publish_subscribe};

use super::SharedItem;
use crate::header::Header;
use crate::link::LinkError;
use crate::names::RunNames;
use crate::shm::POOL;

/// Something was sent to this inbox.
pub(super) const DATA: EventId = EventId::new(1);
/// The run is called off.
pub(super) const ABORT: EventId = EventId::new(2);
/// A process has attached to a channel.
pub(super) const ATTACHED: EventId = EventId::new(3);
/// Something will be sent to the process in a moment.
pub(super) const KNOCK: EventId = EventId::new(4);
const MAX_EVENT: usize = 7;

/// Payloads begin on a cache line.
const PAYLOAD_ALIGNMENT: usize = 64;
/// Processes of a run: launcher, coupler, fluid, solid, and room for as many again.
const MAX_PROCESSES: usize = 8;
/// A service that another process is just making is waited for this long.
const CREATION_TIMEOUT: Duration = Duration::from_secs(1);
/// Attempts are repeated for this long: another process may be making the same service at the same moment.
const RETRY_LIMIT: Duration = Duration::from_secs(3);
const RETRY_PAUSE: Duration = Duration::from_millis(2);

pub(super) type Channel<T> = publish_subscribe::PortFactory<ipc::Service, [T], Header>;
pub(super) type Events = event::PortFactory<ipc::Service>;
pub(super) type Sender<T> = Publisher<ipc::Service, [T], Header>;
pub(super) type Receiver<T> = Subscriber<ipc::Service, [T], Header>;

/// The error of a transport that fails with its own words.
pub(super) fn broken(peer: &str, what: impl std::fmt::Debug) -> LinkError {
    LinkError::Transport { peer: peer.to_owned(), what: format!("{what:?}") }
}

/// This process as a node of the run's private name space.
pub(super) fn node(names: &RunNames, process: &str) -> Result<Node<ipc::Service>, LinkError> {
    // Its failures come back as errors and are reported once, by the run.
    set_log_level(LogLevel::Fatal);
    let mut config = Config::default();
    config.global.prefix = FileName::new(names.prefix().as_bytes()).map_err(|e| broken(process, e))?;
    let root = names.root().to_string_lossy();
    config.global.set_root_path(&Path::new(root.as_bytes()).map_err(|e| broken(process, e))?);
    config.global.creation_timeout = CREATION_TIMEOUT;
    // A dead process ends the run, and the name space is removed as a whole; no neighbour shall tidy up before.
    config.global.service.cleanup_dead_nodes_on_open = false;
    config.global.node.cleanup_dead_nodes_on_creation = false;
    config.global.node.cleanup_dead_nodes_on_destruction = false;
    let builder = NodeBuilder::new().config(&config).signal_handling_mode(SignalHandlingMode::Disabled);
    builder.create::<ipc::Service>().map_err(|error| broken(process, error))
}

/// The channel `name`, made by whoever comes first.
pub(super) fn channel<T: SharedItem>(
    node: &Node<ipc::Service>,
    name: &str,
    peer: &str,
) -> Result<Channel<T>, LinkError> {
    let name = name.try_into().map_err(|error| broken(peer, error))?;
    let alignment = Alignment::new(PAYLOAD_ALIGNMENT).expect("64 is a power of two");
    retry(peer, || {
        node.service_builder(&name)
            .publish_subscribe::<[T]>()
            .user_header::<Header>()
            .payload_alignment(alignment)
            .enable_safe_overflow(false)
            .history_size(0)
            .subscriber_max_buffer_size(POOL)
            .subscriber_max_borrowed_samples(1)
            .max_publishers(1)
            .max_subscribers(1)
            .max_nodes(2)
            .open_or_create()
    })
}

/// The event service `name`, made by whoever comes first.
pub(super) fn events(node: &Node<ipc::Service>, name: &str, peer: &str) -> Result<Events, LinkError> {
    let name = name.try_into().map_err(|error| broken(peer, error))?;
    retry(peer, || {
        node.service_builder(&name)
            .event()
            .max_nodes(MAX_PROCESSES)
            .max_notifiers(MAX_PROCESSES)
            .max_listeners(1)
            .event_id_max_value(MAX_EVENT)
            .disable_deadline()
            .disable_notifier_created_event()
            .disable_notifier_dropped_event()
            .disable_notifier_dead_event()
            .open_or_create()
    })
}

/// The event service `name`, if it is there.
pub(super) fn open_events(node: &Node<ipc::Service>, name: &str) -> Option<Events> {
    node.service_builder(&name.try_into().ok()?).event().open().ok()
}

/// The sending end of a channel for messages up to `capacity` items.
pub(super) fn sender<T: SharedItem>(
    channel: &Channel<T>,
    capacity: usize,
    peer: &str,
) -> Result<Sender<T>, LinkError> {
    let builder = channel.publisher_builder();
    let builder = builder
        .initial_max_slice_len(capacity.max(1))
        .allocation_strategy(AllocationStrategy::Static)
        .max_loaned_samples(POOL)
        .override_sample_preallocation(|_| POOL)
        // Cannot happen, as the pool is no larger than the receiver's buffer; the default would retry for ever.
        .set_backpressure_handler(|_| BackpressureAction::DiscardDataAndFail);
    builder.create().map_err(|error| broken(peer, error))
}

/// The receiving end of a channel.
pub(super) fn receiver<T: SharedItem>(channel: &Channel<T>, peer: &str) -> Result<Receiver<T>, LinkError> {
    let builder = channel.subscriber_builder().buffer_size(POOL);
    builder.create().map_err(|error| broken(peer, error))
}

/// Repeats what may fail only because another process is doing the same at this moment.
fn retry<S, E: std::fmt::Debug>(
    peer: &str,
    mut attempt: impl FnMut() -> Result<S, E>,
) -> Result<S, LinkError> {
    let start = std::time::Instant::now();
    loop {
        match attempt() {
            Ok(service) => return Ok(service),
            Err(error) if start.elapsed() > RETRY_LIMIT || is_lasting(&error) => {
                return Err(broken(peer, error));
            }
            Err(_) => std::thread::sleep(RETRY_PAUSE),
        }
    }
}

/// Mismatches do not pass with time. iceoryx2 nests its errors in an enum per pattern with equal variant names.
fn is_lasting(error: &impl std::fmt::Debug) -> bool {
    let text = format!("{error:?}");
    ["Incompatible", "InsufficientPermissions", "VersionMismatch", "DoesNotSupport"]
        .iter()
        .any(|w| text.contains(w))
}
