// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/parameters.h"

namespace hapticd::tools {

/// Like the Kinect of Table I, but its raw values 0..2046 are spread evenly in 1/Z over `near_m`..`far_m`
/// alone: raw 0 is near_m, raw 2046 is far_m, raw 1023 is the depth at the mean of 1/near_m and 1/far_m.
/// A range of 0.2 m makes a raw unit about 0.1 mm. 0 < near_m < far_m.  Thread: any.
rt::DepthModelParameters fineDepthModel(double near_m, double far_m);

/// Like fineDepthModel(), around `middle_m`, which is exactly raw 1023; 1/Z extends equally to both sides of
/// it, so far that `middle_m` + `beyond_m` is in sight. 0 < beyond_m < middle_m.
rt::DepthModelParameters fineDepthModelAround(double middle_m, double beyond_m);

}  // namespace hapticd::tools
