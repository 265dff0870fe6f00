// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>

#include "tests/vm/emulators/uvc/camera_model.h"
#include "tests/vm/emulators/uvc/extension_unit.h"
#include "tests/vm/emulators/uvc/faults.h"

namespace hapticd::test::uvc {

/// The extension unit of a RealSense D4xx: the hardware monitor on selector 1, plain numbers on the others.
class RealsenseUnit final : public ExtensionUnit {
 public:
  /// Both outlive it.
  RealsenseUnit(const CameraModel& model, const Faults& faults);

  std::uint32_t selectors() const override;
  std::size_t length(std::uint8_t selector) const override;
  std::optional<Bytes> get(std::uint8_t selector, std::uint8_t request) override;
  bool set(std::uint8_t selector, std::span<const std::uint8_t> value) override;
  std::uint32_t depthUnit_um() const override { return depth_unit_um_; }

 private:
  /// A control with a number; the kernel asks for its range.
  struct Number {
    std::size_t bytes;
    std::uint32_t value, least, largest, step;
  };
  struct Request {
    std::uint32_t opcode, p1, p2, p3, p4;
    std::span<const std::uint8_t> data;
  };

  void monitor(std::span<const std::uint8_t> bytes);
  std::optional<Bytes> execute(const Request& request);
  std::optional<Bytes> depthTable(std::uint32_t which) const;
  bool setDepthTable(const Request& request);

  const CameraModel& model_;
  const Faults& faults_;
  std::uint32_t depth_unit_um_;
  std::uint32_t synchronisation_ = 0;
  std::map<std::uint8_t, Number> numbers_;
  Bytes reply_;  // of the hardware monitor
};

}  // namespace hapticd::test::uvc
