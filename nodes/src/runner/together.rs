//! Between nodes of one thread: a sample goes from an output straight to the inputs beside it, and over the transport to everyone else.
//!
//! No transport of its own: inputs are made after all outputs, so nothing of the past is kept for one that joins late.

use crate::clock::now_ns;
use crate::transport::{Publisher, Subscriber, Transport, TransportError, capacity};
use backdrive_msgs::Message;
use backdrive_msgs::topic::Topic;
use std::cell::RefCell;
use std::collections::{HashMap, VecDeque};
use std::rc::Rc;
use std::time::Duration;

/// A message, and when it was sent: CLOCK_MONOTONIC, ns.
type Queue = Rc<RefCell<VecDeque<(Message, i64)>>>;

/// The inputs that hear a topic in this thread.
type Queues = Rc<RefCell<Vec<Queue>>>;

/// A transport around which the nodes of a thread speak to each other directly. Outputs are made before inputs.
pub(super) struct Together {
    inner: Box<dyn Transport>,
    spoken: HashMap<String, Queues>,
}

impl Together {
    pub fn around(inner: Box<dyn Transport>) -> Together {
        Together { inner, spoken: HashMap::new() }
    }
}

impl Transport for Together {
    fn publisher(&mut self, topic: &Topic, listeners: usize) -> Result<Box<dyn Publisher>, TransportError> {
        let publisher = self.inner.publisher(topic, listeners)?;
        let here = Rc::clone(self.spoken.entry(topic.name.clone()).or_default());
        Ok(Box::new(Sending { publisher, here, most: capacity(topic.kind).0 }))
    }

    fn subscriber(&mut self, topic: &Topic, depth: usize, wakes: bool) -> Result<Box<dyn Subscriber>, TransportError> {
        let Some(here) = self.spoken.get(&topic.name) else {
            return self.inner.subscriber(topic, depth, wakes);
        };
        let queue = Queue::default();
        here.borrow_mut().push(Rc::clone(&queue));
        Ok(Box::new(Receiving { queue, arrived_ns: 0 }))
    }

    fn wait(&mut self, timeout: Duration) -> Result<(), TransportError> {
        self.inner.wait(timeout)
    }

    fn sweep(&mut self) {
        self.inner.sweep();
    }
}

struct Sending {
    publisher: Box<dyn Publisher>,
    here: Queues,
    most: usize,
}

impl Publisher for Sending {
    fn send(&mut self, message: &Message) -> Result<(), TransportError> {
        // Beside it too if the transport fails: this thread has the sample.
        let sent = self.publisher.send(message);
        let queues = self.here.borrow();
        if !queues.is_empty() {
            let at_ns = now_ns();
            for queue in queues.iter() {
                let mut queue = queue.borrow_mut();
                if queue.len() == self.most {
                    queue.pop_front();
                }
                queue.push_back((*message, at_ns));
            }
        }
        sent
    }

    fn listeners(&self) -> usize {
        self.publisher.listeners() + self.here.borrow().len()
    }
}

struct Receiving {
    queue: Queue,
    arrived_ns: i64,
}

impl Subscriber for Receiving {
    fn receive(&mut self) -> Result<Option<Message>, TransportError> {
        let Some((message, at_ns)) = self.queue.borrow_mut().pop_front() else {
            return Ok(None);
        };
        self.arrived_ns = at_ns;
        Ok(Some(message))
    }

    fn arrived_ns(&self) -> i64 {
        self.arrived_ns
    }

    fn has_publisher(&self) -> bool {
        true
    }
}
