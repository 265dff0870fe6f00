// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>

#include "tests/vm/emulators/uvc/camera_model.h"
#include "tests/vm/emulators/uvc/extension_unit.h"
#include "tests/vm/emulators/uvc/faults.h"

namespace hapticd::test::uvc {

/// The extension unit of an Orbbec Gemini 330: requests and responses of 64 (selector 2), 512 (1) and 1024
/// bytes (3); a response may be fetched through another selector than its request came by.
class OrbbecUnit final : public ExtensionUnit {
 public:
  /// Both outlive it.
  OrbbecUnit(const CameraModel& model, const Faults& faults);

  std::uint32_t selectors() const override { return 0b111; }
  std::size_t length(std::uint8_t selector) const override;
  std::optional<Bytes> get(std::uint8_t selector, std::uint8_t request) override;
  bool set(std::uint8_t selector, std::span<const std::uint8_t> value) override;
  std::uint32_t depthUnit_um() const override { return depth_unit_um_; }

 private:
  struct Answer {
    std::uint16_t error = 0;
    Bytes data = {};
  };

  Answer execute(std::uint16_t opcode, std::span<const std::uint8_t> data);
  Answer property(std::uint32_t id) const;
  Answer setProperty(std::uint32_t id, std::uint32_t value);
  Answer structure(std::uint32_t id) const;
  Bytes versions() const;
  Answer beginList(std::uint32_t id);
  Answer readList(std::uint32_t at, std::uint32_t bytes) const;
  Bytes cameraParameters() const;
  Bytes depthCalibration() const;

  const CameraModel& model_;
  const Faults& faults_;
  std::uint32_t depth_unit_um_;
  Bytes list_;      // that is being read
  Bytes response_;  // to the last request, without padding
};

}  // namespace hapticd::test::uvc
