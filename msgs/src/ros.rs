//! The ROS 2 form of every message: schema text, CDR both ways.
