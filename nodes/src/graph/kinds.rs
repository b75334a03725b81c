//! Node kinds: their stages and ports. A new kind is one entry here, its settings, and its core in `build`.

/// Whether a port takes or gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Takes.
    Input,
    /// Gives.
    Output,
}

/// A port of a stage.
#[derive(Debug, Clone, Copy)]
pub struct PortKind {
    /// Name in a graph file.
    pub name: &'static str,
    /// One line.
    pub doc: &'static str,
    /// Inputs: whether the graph must connect it.
    pub required: bool,
    /// Outputs: last part of the usual topic, in CRTK's words; a command is published under the receiver's name.
    pub topic: &'static str,
    /// Outputs: whether it commands the receiver.
    pub commands: bool,
}

/// A stage of a node kind.
#[derive(Debug, Clone, Copy)]
pub struct StageKind {
    /// Name within the node.
    pub name: &'static str,
    /// In the order in which the core expects them.
    pub inputs: &'static [PortKind],
    /// In the order in which the core fills them.
    pub outputs: &'static [PortKind],
}

const fn input(name: &'static str, required: bool, doc: &'static str) -> PortKind {
    PortKind { name, doc, required, topic: "", commands: false }
}

const fn state(name: &'static str, topic: &'static str, doc: &'static str) -> PortKind {
    PortKind { name, doc, required: false, topic, commands: false }
}

const fn command(name: &'static str, topic: &'static str, doc: &'static str) -> PortKind {
    PortKind { name, doc, required: false, topic, commands: true }
}

const OPERATOR: &[StageKind] =
    &[StageKind { name: "hand", inputs: &[], outputs: &[state("intent", "setpoint_js", "position and velocity that the hand wants")] }];

const MASTER: &[StageKind] = &[StageKind {
    name: "plant",
    inputs: &[
        input("intent", false, "motion of the hand; without it the hand rests"),
        input("force", false, "force on the motor, along +x; without it there is none"),
    ],
    outputs: &[
        state("measured", "measured_js", "measured position; effort is the force applied from this step to the next"),
        state("user", "user_js", "position, velocity and force of the hand on the handle; known in simulation only"),
    ],
}];

const CANCELLER: &[StageKind] = &[StageKind {
    name: "predict",
    inputs: &[input("measured", true, "the master's measured position and applied force")],
    outputs: &[
        state("motion", "measured_js", "position without the predicted induced motion"),
        state("induced", "induced_js", "predicted induced motion"),
    ],
}];

const SCALING: &[StageKind] = &[
    StageKind {
        name: "forward",
        inputs: &[input("motion", true, "motion of the user")],
        outputs: &[command("command", "servo_jp", "mu times the motion: where the slave shall be")],
    },
    StageKind {
        name: "backward",
        inputs: &[
            input("contact", true, "force of the environment on the slave"),
            input("measured", false, "the master's measured position and applied force; the guard watches it"),
        ],
        outputs: &[
            command("force", "servo_jf", "lambda times the contact force, and the dither"),
            state("dither", "dither_jf", "the added excitation alone"),
        ],
    },
];

const COUPLING: &[StageKind] = &[
    StageKind {
        name: "near",
        inputs: &[
            input("motion", true, "the master's motion"),
            input("from_far", true, "what the far side sends: connect to_near here, delay = 1"),
            input("hand", false, "force of the hand on the master, for the law four_channel"),
        ],
        outputs: &[
            command("force", "servo_jf", "lambda times the law's force; connect it to the master with delay = 1"),
            state("to_far", "to_far_js", "what goes over the link to the slave's side"),
        ],
    },
    StageKind {
        name: "far",
        inputs: &[
            input("contact", true, "the slave's measured motion and the force of the environment on it, delay = 1"),
            input("from_near", true, "what the near side sends: connect to_far here"),
        ],
        outputs: &[
            command("command", "servo_jp", "where the slave shall be"),
            state("to_near", "to_near_js", "what goes over the link to the master's side"),
        ],
    },
];

const SLAVE: &[StageKind] = &[StageKind {
    name: "plant",
    inputs: &[
        input("command", false, "where the tip shall be, for a model that follows commands"),
        input("force", false, "force on the motor, for a model that is driven by a force"),
    ],
    outputs: &[state("measured", "measured_js", "position and velocity of the tip; effort is the environment's force on it")],
}];

const CONTROLLER: &[StageKind] = &[StageKind {
    name: "law",
    inputs: &[input("command", true, "where the tip shall be"), input("measured", true, "the slave's measured position, delay = 1")],
    outputs: &[command("force", "servo_jf", "force on the slave's motor")],
}];

const EXCITER: &[StageKind] =
    &[StageKind { name: "play", inputs: &[], outputs: &[command("force", "servo_jf", "the excitation: a force on the master's motor")] }];

const OBSERVER: &[StageKind] = &[StageKind {
    name: "estimate",
    inputs: &[
        input("measured", true, "motion where the known force acts; its effort is that force"),
        input("user", false, "motion where the unknown force acts, where it is measured too"),
        input("force", false, "the known force, in place of the effort of measured"),
    ],
    outputs: &[
        state("estimate", "estimated_js", "motion where the unknown force acts; effort is that force"),
        state("filtered", "filtered_js", "effort is the unknown force behind the filter"),
    ],
}];

const CYCLE: &[StageKind] = &[StageKind {
    name: "play",
    inputs: &[],
    outputs: &[
        command("pedal", "servo_jp", "accelerator pedal, position from 0 to 1"),
        command("speed", "servo_jv", "wanted speed of the engine, velocity"),
    ],
}];

const SPEED_CONTROL: &[StageKind] = &[StageKind {
    name: "control",
    inputs: &[
        input("setpoint", true, "wanted speed"),
        input("measured", true, "measured speed of the engine"),
        input("added", false, "torque that is added to the controller's, for identification"),
    ],
    outputs: &[command("command", "servo_jf", "the torque that the dynamometer shall give")],
}];

const DYNAMOMETER: &[StageKind] = &[StageKind {
    name: "machine",
    inputs: &[input("command", true, "the torque that it shall give"), input("measured", false, "its speed, for the limit of power")],
    outputs: &[
        state("torque", "torque_js", "effort on the shaft from this step to the next; known in simulation only"),
        state("measured", "measured_js", "effort as the converter estimates it"),
    ],
}];

const ENGINE: &[StageKind] = &[StageKind {
    name: "combustion",
    inputs: &[input("pedal", true, "accelerator pedal, position from 0 to 1"), input("measured", true, "speed of the crankshaft")],
    outputs: &[
        state("torque", "torque_js", "effort on the shaft from this step to the next; known in simulation only"),
        state("static", "static_js", "effort that the static map has here"),
    ],
}];

const SHAFT: &[StageKind] = &[StageKind {
    name: "plant",
    inputs: &[
        input("engine", true, "torque of the engine, one step late"),
        input("dynamometer", true, "torque of the dynamometer, one step late"),
    ],
    outputs: &[
        state("engine", "engine_js", "measured speed at the engine"),
        state("dynamometer", "dynamometer_js", "measured speed at the dynamometer"),
        state("coupling", "coupling_js", "measured torque in the shaft, positive where the engine is ahead"),
    ],
}];

const RECORDER: &[StageKind] = &[];

const RIG: &[StageKind] = &[StageKind {
    name: "ram",
    inputs: &[],
    outputs: &[
        state("demand", "setpoint_jp", "the demanded displacement"),
        state(
            "measured",
            "measured_js",
            "displacement and velocity of the ram; effort is its force on the specimen, as the load cell reads it",
        ),
    ],
}];

macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident $name:literal $stages:ident,)*) => {
        /// What a node is.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum NodeKind { $($(#[$doc])* $kind,)* }

        impl NodeKind {
            /// Names in graph files.
            pub const ALL: &'static [(&'static str, NodeKind)] = &[$(($name, NodeKind::$kind)),*];

            /// Name in graph files.
            pub fn name(self) -> &'static str {
                match self { $(NodeKind::$kind => $name),* }
            }

            /// The stages that step separately.
            pub fn stages(self) -> &'static [StageKind] {
                match self { $(NodeKind::$kind => $stages),* }
            }
        }
    };
}

// What it is, its name in graph files, its stages.
kinds!(
    /// The user's hand: what it wants.
    Operator "operator" OPERATOR,
    /// The device in the user's hand.
    Master "master" MASTER,
    /// Predicts the induced motion and subtracts it.
    Canceller "canceller" CANCELLER,
    /// Position and force scaling.
    Scaling "scaling" SCALING,
    /// A law between master and slave over a link, instead of scaling.
    Coupling "coupling" COUPLING,
    /// The remote device with its environment.
    Slave "slave" SLAVE,
    /// Drives a slave whose feedback is a force.
    Controller "controller" CONTROLLER,
    /// Plays an excitation on a force channel.
    Exciter "exciter" EXCITER,
    /// Estimates a force that is not measured.
    Observer "observer" OBSERVER,
    /// The operator of a test bench: pedal and speed over time.
    Cycle "cycle" CYCLE,
    /// Keeps a test bench at its speed.
    SpeedControl "speed_control" SPEED_CONTROL,
    /// The machine that loads an engine.
    Dynamometer "dynamometer" DYNAMOMETER,
    /// A combustion engine.
    Engine "engine" ENGINE,
    /// The shaft between engine and dynamometer.
    Shaft "shaft" SHAFT,
    /// Records every topic.
    Recorder "recorder" RECORDER,
    /// A test rig: a ram under displacement control with a specimen on it.
    Rig "rig" RIG,
);

impl NodeKind {
    /// Whether it closes the loop: it commands the slave, forces the master and has the gains.
    pub fn closes_loop(self) -> bool {
        matches!(self, NodeKind::Scaling | NodeKind::Coupling)
    }

    /// A port by its name and direction, with the index of its stage.
    pub fn port(self, name: &str, direction: Direction) -> Option<(usize, &'static PortKind)> {
        self.stages().iter().enumerate().find_map(|(index, stage)| {
            let ports = if direction == Direction::Input { stage.inputs } else { stage.outputs };
            ports.iter().find(|p| p.name == name).map(|port| (index, port))
        })
    }

    /// Names of all ports of a direction.
    pub fn ports(self, direction: Direction) -> Vec<&'static str> {
        let of = |stage: &'static StageKind| if direction == Direction::Input { stage.inputs } else { stage.outputs };
        self.stages().iter().flat_map(|stage| of(stage).iter().map(|p| p.name)).collect()
    }

    /// The usual topic of an output port. A command goes by the name of the node that obeys it.
    pub fn usual_topic(self, port: &str, node: &str, receiver: Option<&str>) -> String {
        match self.port(port, Direction::Output) {
            Some((_, p)) if p.commands => format!("/{}/{}", receiver.unwrap_or(node), p.topic),
            Some((_, p)) => format!("/{node}/{}", p.topic),
            None => format!("/{node}/{port}"),
        }
    }
}
