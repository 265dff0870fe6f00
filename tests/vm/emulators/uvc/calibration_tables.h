// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/vm/emulators/uvc/byte_writer.h"
#include "tests/vm/emulators/uvc/camera_model.h"
#include "tests/vm/emulators/uvc/faults.h"

namespace hapticd::test::uvc {

/// The tables of a RealSense D4xx, made from the model's numbers; formats: librealsense's
/// src/ds/d400/d400-private.h.

/// Details of the camera (GVD): firmware at byte 12, serial number of the module at 48.
Bytes cameraDetails(const CameraModel& model);

/// Coefficients table, id 25: header with checksum, baseline, rectified intrinsics by resolution.
Bytes coefficientsTable(const CameraModel& model, const Faults& faults);

/// Rectified intrinsics of each depth mode, 20 bytes each (RECPARAMSGET).
Bytes modeTable(const CameraModel& model, const Faults& faults);

}  // namespace hapticd::test::uvc
