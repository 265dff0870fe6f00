// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <string>
#include <vector>

#include "daemon/trace/ros/message_set.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools::ros {

using trace::ros::Impedance;
using trace::ros::ImpedanceSide;

/// The names of all fixtures that an impedance may become: "ros-x-positive" and so on.
std::vector<std::string> impedanceFixtureNames();

/// The fixtures of hapticd that do what an impedance asks for: a plane for each side of an axis that has a
/// spring, with its stiffness, damping and deadband. A list of objects for ChangeFixtures, empty if there is
/// no spring.
/// Errors: a sentence about what no passive fixture does: springs and dampers that push, a bias, torques, and
/// numbers that are not finite or beyond what fixtures may have.
/// Thread: any.
std::expected<Json, std::string> fixturesOf(const Impedance& impedance);

}  // namespace hapticd::tools::ros
