// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "daemon/control/varlink_message.h"
#include "rt/parameters.h"

namespace hapticd::daemon {

/// The type `Pose` of both interfaces.
OrderedJson poseJson(const rt::PoseParameters& pose);
/// Nothing where `json` is not that: another field, one missing, no number.
std::optional<rt::PoseParameters> poseFrom(const Json& json);

}  // namespace hapticd::daemon
