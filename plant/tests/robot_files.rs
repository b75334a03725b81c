//! Robot files: what is read of URDF and MJCF, the remarks on the rest, and the errors of refused files.

mod robot_common;

use backdrive_plant::robot::{JointKind, RobotFile, Tree};
use nalgebra::Vector3;

const ARM: &str = r#"<?xml version="1.0"?>
<robot name="arm">
  <link name="base"/>
  <link name="upper">
    <inertial><origin xyz="0.2 0 0" rpy="0 0 1.5707963267948966"/><mass value="2.0"/>
      <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.025"/></inertial>
    <visual><geometry><box size="1 1 1"/></geometry></visual>
    <visual><geometry><box size="1 1 1"/></geometry></visual>
    <collision><geometry><box size="1 1 1"/></geometry></collision>
  </link>
  <link name="slider"><inertial><mass value="0.5"/><inertia ixx="1e-3" ixy="0" ixz="0" iyy="1e-3" iyz="0" izz="1e-3"/></inertial></link>
  <link name="tip"/>
  <joint name="flange" type="fixed"><parent link="slider"/><child link="tip"/><origin xyz="0 0 0.1"/></joint>
  <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 0 2"/><dynamics damping="0.3" friction="0.4"/></joint>
  <joint name="extension" type="prismatic"><parent link="upper"/><child link="slider"/><limit lower="-0.1" upper="0.2" effort="30" velocity="1.5"/></joint>
  <transmission name="t"/>
</robot>
"#;

fn read(text: &str) -> RobotFile {
    RobotFile::from_xml(text, "arm.xml").unwrap_or_else(|e| panic!("{e}"))
}

#[track_caller]
fn refused(text: &str, with: &str) {
    let said = RobotFile::from_xml(text, "arm.xml").expect_err("it is refused").to_string();
    assert!(said.contains(with), "said: {said}\nexpected: {with}");
}

fn with(before: &str, after: &str) -> String {
    assert!(ARM.contains(before), "{before}");
    ARM.replacen(before, after, 1)
}

#[test]
fn a_urdf_is_read() {
    let RobotFile { robot, remarks } = read(ARM);
    assert_eq!((robot.name.as_str(), robot.links[0].name.as_str()), ("arm", "base"));
    assert_eq!(robot.gravity, Vector3::new(0.0, 0.0, -9.81));
    let shoulder = &robot.joints[robot.joint("shoulder").unwrap()];
    assert_eq!((shoulder.kind, shoulder.axis), (JointKind::Revolute, Vector3::z()));
    assert_eq!((shoulder.damping, shoulder.friction, shoulder.limits.range), (0.3, 0.4, None));
    let extension = &robot.joints[robot.joint("extension").unwrap()];
    assert_eq!((extension.kind, extension.axis, extension.limits.range), (JointKind::Prismatic, Vector3::x(), Some([-0.1, 0.2])));
    assert_eq!((extension.limits.effort, extension.limits.velocity), (Some(30.0), Some(1.5)));
    // A quarter turn about z changes the first two moments.
    let upper = robot.links[robot.link("upper").unwrap()].inertia.unwrap();
    assert!((upper.about_centre[(0, 0)] - 0.02).abs() < 1e-15 && (upper.about_centre[(1, 1)] - 0.01).abs() < 1e-15);
    let said: Vec<String> = remarks.iter().map(ToString::to_string).collect();
    assert!(said.contains(&"line 7 and 1 more: <visual>: pictures do not move".to_owned()), "{said:#?}");
    assert!(said.iter().any(|s| s.starts_with("line 9: <collision>: contacts of the links")), "{said:#?}");
    assert!(said.iter().any(|s| s.starts_with("line 15: <limit>: read, but nothing stops")), "{said:#?}");
    assert!(remarks.iter().any(|r| r.about == "<transmission>" && r.matters));
}

#[test]
fn a_urdf_is_refused_in_a_sentence_with_its_line() {
    refused(
        &with("<mass value=\"2.0\"/>", "<mass value=\"-2.0\"/>"),
        "arm.xml:5: <link name=\"upper\"> <mass> value: must be at least 0, is -2",
    );
    refused(&with("<mass value=\"2.0\"/>", ""), "arm.xml:5: <link name=\"upper\"> <inertial>: has no <mass>: give the link's mass");
    refused(&with("ixx=\"0.01\" ", ""), "missing attribute \"ixx\"");
    refused(
        &with("ixx=\"0.01\"", "ixx=\"-0.01\""),
        "arm.xml:6: <link name=\"upper\"> <inertia> ixx: a moment of inertia must be at least 0",
    );
    refused(&with("izz=\"0.025\"", "izz=\"0.0x\""), "izz: expected a number, found \"0.0x\"");
    refused(&with("ixy=\"0\"", "ixy=\"0.5\""), "arm.xml:4: link \"upper\": the matrix of inertia has the principal moments");
    let start = ARM.find("<inertial><mass value=\"0.5\"").unwrap();
    let end = start + ARM[start..].find("</link>").unwrap();
    let bare = format!("{}{}", &ARM[..start], &ARM[end..]);
    refused(&bare, "arm.xml:15: joint \"extension\": nothing that it moves has inertia: give link \"slider\"");
    refused(
        &with("<dynamics", "<mimic joint=\"extension\"/><dynamics"),
        "ties this joint to joint \"extension\", which a tree cannot represent. Remove <mimic>",
    );
    refused(
        &with("type=\"continuous\"", "type=\"floating\""),
        "arm.xml:14: <joint name=\"shoulder\"> type: a floating joint moves in several directions",
    );
    refused(&with("type=\"continuous\"", "type=\"continous\""), "did you mean \"continuous\"?");
    refused(&with("<child link=\"upper\"/>", "<child link=\"uper\"/>"), "<child> link: unknown link \"uper\"; did you mean \"upper\"?");
    refused(&with("<child link=\"upper\"/>", ""), "has no <child>: name the link");
    refused(&with("0 0 2", "0 0 0"), "must have a direction");
    refused(&with("0 0 2", "0 2"), "xyz: expected 3 numbers, found 2");
    refused(&with("name=\"tip\"", "name=\"upper\""), "arm.xml:12: <link name=\"upper\">: another link has this name");
    refused(&with("name=\"flange\"", "name=\"shoulder\""), "another joint has this name");
    refused(&with("lower=\"-0.1\"", "lower=\"0.3\""), "must be at most \"upper\", which is 0.2");
    let closing = "<joint name=\"closing\" type=\"revolute\"><parent link=\"base\"/><child link=\"slider\"/></joint>\n  <transmission";
    refused(
        &with("<transmission", closing),
        "arm.xml:16: joint \"closing\": link \"slider\" is carried by joint \"extension\" already: the links form a loop",
    );
    refused(&with("<parent link=\"base\"/>", "<parent link=\"slider\"/>"), "never comes to the base \"base\": the links form a loop");
    refused(
        &with("<parent link=\"slider\"/><child link=\"tip\"/>", "<parent link=\"slider\"/><child link=\"base\"/>"),
        "the links form a loop",
    );
    refused(
        "<robot name='r'><link name='a'/><joint name='j' type='fixed'><parent link='a'/><child link='a'/></joint></robot>",
        "form a loop",
    );
    refused("<robot name='r'/>", "has no <link>");
    refused("<sdf/>", "expected <robot> (a URDF) or <mujoco> (an MJCF)");
    refused("<robot>\n<link></lnik></robot>", "arm.xml:2: is not valid XML at column");
    refused("", "is not valid XML");
}

#[test]
fn the_world_need_not_be_a_link() {
    let text = with(
        "<joint name=\"flange\"",
        "<joint name=\"weld\" type=\"fixed\"><parent link=\"world\"/><child link=\"base\"/></joint><joint name=\"flange\"",
    );
    assert_eq!(read(&text).robot.links[0].name, "world");
}

const MUJOCO: &str = r#"<mujoco model="arm">
  <compiler angle="degree"/>
  <option gravity="0 0 -9.8"/>
  <default>
    <joint damping="0.1" armature="0.02"/>
    <motor gear="5"/>
    <default class="wrist"><joint damping="0.01" frictionloss="0.2"/></default>
  </default>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="upper" pos="0 0 1">
      <joint name="shoulder" axis="0 1 0" range="-90 90" ref="30" springref="45" stiffness="2"/>
      <geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.05"/>
      <body name="fore" pos="0.4 0 0" childclass="wrist">
        <inertial pos="0.1 0 0" mass="0.5" diaginertia="1e-3 2e-3 2e-3"/>
        <joint name="elbow" axis="0 1 0" pos="0 0 0.01"/>
        <joint name="reach" type="slide" axis="1 0 0" class="main"/>
        <site name="tip" pos="0.2 0 0"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="m1" joint="shoulder" forcerange="-3 3"/>
    <general name="m2" joint="elbow" gear="2" gainprm="4" ctrlrange="-1 1"/>
    <position name="p" joint="reach" kp="3"/>
  </actuator>
  <keyframe/>
</mujoco>
"#;

fn mujoco_with(before: &str, after: &str) -> String {
    assert!(MUJOCO.contains(before), "{before}");
    MUJOCO.replacen(before, after, 1)
}

#[test]
fn an_mjcf_is_read() {
    let RobotFile { robot, remarks } = read(MUJOCO);
    assert_eq!(robot.gravity.z, -9.8);
    let joint = |name: &str| robot.joints[robot.joint(name).unwrap()].clone();
    let shoulder = joint("shoulder");
    assert!((shoulder.reference - 30f64.to_radians()).abs() < 1e-15 && (shoulder.rest - 45f64.to_radians()).abs() < 1e-15);
    assert_eq!((shoulder.damping, shoulder.armature, shoulder.friction, shoulder.stiffness), (0.1, 0.02, 0.0, 2.0));
    assert_eq!(shoulder.limits.range.unwrap()[1], 90f64.to_radians());
    let elbow = joint("elbow");
    assert_eq!((elbow.damping, elbow.armature, elbow.friction), (0.01, 0.02, 0.2));
    let reach = joint("reach");
    assert_eq!((reach.kind, reach.damping, reach.friction), (JointKind::Prismatic, 0.1, 0.0));
    // Two joints in one body: a link without mass between them, named for both.
    assert_eq!(robot.links[elbow.child].name, "fore:elbow");
    assert_eq!((robot.links[elbow.child].inertia, robot.links[reach.child].name.as_str()), (None, "fore"));
    assert_eq!(robot.actuators.len(), 2);
    assert_eq!((robot.actuators[0].gear, robot.actuators[0].limit), (5.0, 15.0));
    assert_eq!((robot.actuators[1].gear, robot.actuators[1].limit), (8.0, 8.0));
    let said: Vec<String> = remarks.iter().map(ToString::to_string).collect();
    for expected in [
        "line 25: actuator <position>: not read: it is a controller",
        "line 12: <joint range>: read, but",
        "line 13: <geom>: contacts",
        "<site>",
        "<keyframe>",
    ] {
        assert!(said.iter().any(|s| s.contains(expected)), "{expected}\n{said:#?}");
    }
}

#[test]
fn an_mjcf_is_refused_in_a_sentence_with_its_line() {
    refused(
        &mujoco_with("type=\"slide\"", "type=\"ball\""),
        "arm.xml:17: <joint name=\"reach\"> type: a ball joint moves in several directions",
    );
    refused(&mujoco_with("type=\"slide\"", "type=\"slied\""), "did you mean \"slide\"?");
    refused(&mujoco_with("<site name", "<freejoint/><site name"), "a body that floats is not computed");
    refused(
        &mujoco_with("type=\"capsule\"", "type=\"mesh\""),
        "<geom> type: the inertia of a mesh is not computed: give the body an <inertial>",
    );
    refused(&mujoco_with("type=\"capsule\"", "type=\"capsul\""), "did you mean \"capsule\"?");
    refused(&mujoco_with("size=\"0.05\"", ""), "size: a capsule needs 1 sizes, found 0");
    refused(
        &mujoco_with("<keyframe/>", "<equality><weld body1=\"upper\"/></equality>"),
        "ties bodies or joints to each other, which a tree cannot",
    );
    refused(&mujoco_with("<keyframe/>", "<include file=\"x.xml\"/>"), "other files are not read in: let MuJoCo write the whole model");
    refused(&mujoco_with("<site name=\"tip\" pos=\"0.2 0 0\"/>", "<replicate/>"), "<replicate> is not opened here");
    refused(
        &mujoco_with("angle=\"degree\"", "angle=\"grad\""),
        "arm.xml:2: <compiler> angle: expected \"degree\" or \"radian\", found \"grad\"",
    );
    refused(&mujoco_with("angle=\"degree\"", "settotalmass=\"3\""), "settotalmass: changes masses");
    refused(&mujoco_with("class=\"main\"", "class=\"mian\""), "unknown class \"mian\"; did you mean \"main\"?");
    refused(
        &mujoco_with("mass=\"0.5\" ", "mass=\"-0.5\" "),
        "arm.xml:15: <body name=\"fore\"> <inertial> mass: must be at least 0, is -0.5",
    );
    refused(&mujoco_with("diaginertia=\"1e-3 2e-3 2e-3\"", ""), "has no inertia: give diaginertia or fullinertia");
    refused(&mujoco_with("damping=\"0.01\"", "damping=\"-0.01\""), "damping: must be at least 0");
    refused(&mujoco_with("name=\"m2\" joint=\"elbow\"", "name=\"m2\" joint=\"elbw\""), "unknown joint \"elbw\"; did you mean \"elbow\"?");
    refused(&mujoco_with("range=\"-90 90\"", "range=\"90 -90\""), "expected the lower limit first");
    refused(&mujoco_with("name=\"fore\" pos", "name=\"fore\" euler=\"0 0 1\" quat=\"1 0 0 0\" pos"), "has both quat and euler");
    refused("<mujoco><worldbody><body/></worldbody></mujoco>", "has no joint that moves");
    refused("<mujoco><worldbody><joint/></worldbody></mujoco>", "is in <worldbody>, which does not move");
    refused(
        "<mujoco><worldbody>\n<body name='a'><joint/></body></worldbody></mujoco>",
        "arm.xml:2: joint \"a_joint\": nothing that it moves has inertia",
    );
    let deep = format!("<mujoco><worldbody>{}{}</worldbody></mujoco>", "<body>".repeat(300), "</body>".repeat(300));
    refused(&deep, "more than 200 bodies within each other");
}

#[test]
fn whatever_a_file_holds_it_is_read_or_refused() {
    // Values of good files changed at random: an error may come of it, or a robot that can be computed.
    let (mut draw, mut read) = (robot_common::Draw::new(9), 0);
    let words = ["nan", "inf", "-1", "0", "1e308", "", "<", "\"", "joint", "fixed", "ball", "box", "1 2", "world", "true", "]]>", "&#0;"];
    for round in 0..6000 {
        let mut text = [ARM, MUJOCO][round % 2].to_owned();
        for _ in 0..1 + draw.below(3) {
            let quotes: Vec<usize> = text.match_indices('"').map(|(at, _)| at).collect();
            let spans: Vec<(usize, usize)> = quotes.windows(2).map(|w| (w[0] + 1, w[1])).collect();
            if spans.is_empty() {
                break;
            }
            let (from, to) = spans[draw.below(spans.len())];
            match draw.below(3) {
                0 => text.replace_range(from..to, words[draw.below(words.len())]),
                1 => text.replace_range(from..to, ""),
                _ => {
                    let (other_from, other_to) = spans[draw.below(spans.len())];
                    let other = text[other_from..other_to].to_owned();
                    text.replace_range(from..to, &other);
                }
            }
        }
        if let Ok(file) = RobotFile::from_xml(&text, "arm.xml") {
            read += 1;
            let tree = Tree::new(&file.robot).unwrap();
            let (q, mut tau) = (tree.references(), vec![0.0; tree.len()]);
            tree.bias(&q, &q, &mut tree.workspace(), &mut tau);
        }
    }
    assert!(read > 300, "{read}");
}
