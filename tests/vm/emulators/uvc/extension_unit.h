// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "tests/vm/emulators/uvc/byte_writer.h"
#include "tests/vm/emulators/uvc/camera_model.h"
#include "tests/vm/emulators/uvc/faults.h"

namespace hapticd::test::uvc {

/// The vendor's controls of a camera: numbered selectors, each with a fixed number of bytes.  Thread: one.
class ExtensionUnit {
 public:
  ExtensionUnit() = default;
  ExtensionUnit(const ExtensionUnit&) = delete;
  ExtensionUnit& operator=(const ExtensionUnit&) = delete;
  virtual ~ExtensionUnit() = default;

  /// Bit n - 1 is set where there is a selector n.
  virtual std::uint32_t selectors() const = 0;
  /// Bytes of a selector; 0: there is none.
  virtual std::size_t length(std::uint8_t selector) const = 0;
  /// The value for UVC_GET_CUR, MIN, MAX, RES or DEF, of length(selector) bytes; nothing: it stalls.
  virtual std::optional<Bytes> get(std::uint8_t selector, std::uint8_t request) = 0;
  /// Takes a value of length(selector) bytes; returns false where it stalls.
  virtual bool set(std::uint8_t selector, std::span<const std::uint8_t> value) = 0;
  /// Micrometres per step of the depth values.
  virtual std::uint32_t depthUnit_um() const = 0;
};

/// The extension unit of a RealSense D4xx: the hardware monitor on selector 1, plain numbers on the others.
/// Both outlive it.
std::unique_ptr<ExtensionUnit> realsenseUnit(const CameraModel& model, const Faults& faults);

/// The extension unit of an Orbbec Gemini 330: requests and responses of 64 (selector 2), 512 (1) and 1024
/// bytes (3); a response may be fetched through another selector than its request came by. Both outlive it.
std::unique_ptr<ExtensionUnit> orbbecUnit(const CameraModel& model, const Faults& faults);

}  // namespace hapticd::test::uvc
