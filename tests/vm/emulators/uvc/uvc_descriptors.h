// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/vm/emulators/usbip/usb_device.h"
#include "tests/vm/emulators/uvc/camera_model.h"
#include "tests/vm/emulators/uvc/faults.h"

namespace hapticd::test::uvc {

inline constexpr std::uint8_t kControlInterface = 0;
inline constexpr std::uint8_t kStreamingInterface = 1;
inline constexpr std::uint8_t kStreamEndpoint = 0x82;
inline constexpr std::uint8_t kExtensionUnit = 3;
inline constexpr std::uint32_t kClockHz = 1'000'000;  ///< of presentation times

/// What the kernel learns of the camera when it is plugged in: one video function with a camera terminal, a
/// processing unit, the extension unit of RealSense, and a streaming interface with a bulk endpoint.
/// extension_selectors: bit n - 1 is set where the unit has a control n.
usbip::Descriptors describeCamera(const CameraModel& model, std::uint32_t extension_selectors,
                                  const Faults& faults);

/// Frame interval of a rate, in units of 100 ns.
std::uint32_t intervalOf(std::uint16_t rate_hz);

/// Bytes of a frame of a mode.
std::uint32_t frameBytes(const DepthMode& mode);

}  // namespace hapticd::test::uvc
