// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "tests/vm/emulators/uvc/byte_writer.h"
#include "tests/vm/emulators/uvc/camera_model.h"

namespace hapticd::test::uvc {

/// What host and camera have agreed on.
struct StreamMode {
  std::size_t mode = 0;              ///< index in CameraModel::modes
  std::uint32_t interval_100ns = 0;  ///< between two frames
};

/// The negotiation of a stream: the host proposes by PROBE, the camera answers with what it would do, the
/// host makes it final by COMMIT.
class StreamingControl {
 public:
  /// `model` outlives it. header_bytes: of each payload.
  StreamingControl(const CameraModel& model, std::size_t header_bytes);

  /// Halves the frame size that the camera states.
  void lieAboutSize(bool lie) { lies_ = lie; }
  /// Forgets what was negotiated.
  void reset();

  /// Answers a GET request of control `selector`; nothing: the request is not understood.
  std::optional<std::span<const std::uint8_t>> get(std::uint8_t selector, std::uint8_t request);
  /// Takes a SET_CUR; returns false if it is not understood or has the wrong length.
  bool set(std::uint8_t selector, std::span<const std::uint8_t> data);

  /// Returns what was committed last; nothing before that.
  const std::optional<StreamMode>& committed() const { return committed_; }

 private:
  Bytes encode(const StreamMode& stream) const;
  StreamMode agree(std::span<const std::uint8_t> proposal) const;

  const CameraModel& model_;
  std::size_t header_bytes_;
  bool lies_ = false;
  StreamMode probed_;
  std::optional<StreamMode> committed_;
  Bytes answer_;
};

}  // namespace hapticd::test::uvc
