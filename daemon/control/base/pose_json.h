// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "daemon/control/server/varlink_message.h"
#include "rt/base/parameters.h"

namespace hapticd::daemon {

/// A pose as the type `Pose` of both interfaces.
OrderedJson poseJson(const rt::PoseParameters& pose);
/// The pose in `json`; nothing if a field is missing, unknown or not a number.
std::optional<rt::PoseParameters> poseFrom(const Json& json);

}  // namespace hapticd::daemon
