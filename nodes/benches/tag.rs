//! The cost of a tag: a sample encoded without and with its tag, read directly and after its tag was checked.
//!
//!   cargo bench -p backdrive-nodes --bench tag

use backdrive_msgs::ros::live;
use backdrive_msgs::topic::{Kind, Topic};
use backdrive_msgs::{Message, Sample};
use backdrive_nodes::transport::ros2::{Identity, Key, Known, Member};
use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;

fn tags(c: &mut Criterion) {
    let own = Member { run: "6925b1f2001a2b3c4d5e".to_string(), key: Key::fresh().unwrap() };
    let identity = Identity::new(&Known { own, several: false, others: Vec::new() }).unwrap();
    for axes in [1, 8] {
        let topic = Topic { name: "/master/servo_jf".to_string(), kind: Kind::Sample };
        let message = Message::Sample(Sample { step: 123_456, sequence: 123_456, ..Sample::new(axes) });
        let mut cdr = Vec::with_capacity(1024);
        c.bench_function(&format!("encode, {axes} axes"), |b| b.iter(|| live::encode(black_box(&message), "", &[], None, &mut cdr)));
        let plain = cdr.clone();
        c.bench_function(&format!("encode and tag, {axes} axes"), |b| {
            b.iter(|| identity.encode(&topic, black_box(&message), "", &[], 7, &mut cdr))
        });
        c.bench_function(&format!("read, {axes} axes"), |b| b.iter(|| live::decode(Kind::Sample, true, black_box(&plain))));
        assert!(identity.is_ours(&topic, true, &cdr) && !identity.is_ours(&topic, true, &plain));
        c.bench_function(&format!("check and read, {axes} axes"), |b| {
            b.iter(|| identity.is_ours(&topic, true, black_box(&cdr)).then(|| live::decode(Kind::Sample, true, &cdr)))
        });
    }
}

criterion_group!(benches, tags);
criterion_main!(benches);
