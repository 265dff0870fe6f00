// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "tests/vm/emulators/usbip/usb_device.h"
#include "tests/vm/emulators/uvc/byte_writer.h"
#include "tests/vm/emulators/uvc/camera_model.h"
#include "tests/vm/emulators/uvc/depth_scene.h"
#include "tests/vm/emulators/uvc/faults.h"

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

/// What the header of a frame's payload tells.
struct FrameTimes {
  std::uint32_t number = 0;
  std::uint32_t exposure_start_us = 0;  ///< of the camera's clock, as are the others
  std::uint32_t exposure_us = 0;
  std::uint32_t sent_us = 0;
  std::uint32_t interval_us = 0;
};

/// Bytes of a payload header: 12, and of RealSense the blocks of metadata that the kernel's document
/// metafmt-d4xx describes.
std::size_t payloadHeaderBytes(const CameraModel& model);

/// The header of a payload that holds a whole frame, with presentation and source time.
Bytes payloadHeader(const CameraModel& model, const DepthMode& mode, const FrameTimes& times, bool frame_id);

/// The frames on the bulk endpoint: one payload each, begun by the clock, cut into the host's URBs. A frame
/// whose turn comes while the one before is still waiting for URBs is skipped, as a camera without memory
/// does it.  Thread: one.
class DepthStream {
 public:
  /// Both outlive it.
  DepthStream(const CameraModel& model, const Faults& faults) : model_(model), faults_(faults) {}

  void start(const StreamMode& stream, std::uint32_t unit_um);
  void stop() { stream_.reset(); }
  bool isStreaming() const { return stream_.has_value(); }

  /// Repeats this frame of the scene; nothing: plays on.
  void freeze(std::optional<std::uint32_t> frame) { frozen_ = frame; }
  /// The faults of the stream apply to the next frame only.
  void spoilOnce(Fault fault) { once_ = fault; }

  /// Completes what is due at now_ns, CLOCK_MONOTONIC.
  void work(std::int64_t now_ns, usbip::PendingUrbs& urbs);
  /// When the next frame is due; nothing while none is awaited.
  std::optional<std::int64_t> due_ns() const;

  std::uint64_t framesSent() const { return sent_; }
  std::uint64_t framesSkipped() const { return skipped_; }
  std::uint64_t framesSpoilt() const { return spoilt_; }

 private:
  void beginFrame(std::int64_t now_ns);
  void makePayload(std::int64_t now_ns);
  void spoilHeader(std::size_t header_bytes);
  void spoilSize(std::size_t header_bytes);
  void send(usbip::PendingUrbs& urbs);
  bool hasFault(Fault fault) const { return faults_.has(fault) || spoiling_ == fault; }
  const DepthMode& mode() const { return model_.modes[stream_->mode]; }

  const CameraModel& model_;
  const Faults& faults_;
  std::optional<DepthScene> scene_;
  std::optional<StreamMode> stream_;
  std::optional<std::int64_t> begun_ns_;  // of frame 0; nothing before the first URB
  std::optional<std::uint32_t> frozen_;
  std::optional<Fault> once_;
  std::optional<Fault> spoiling_;  // in the frame in progress
  std::vector<std::uint8_t> payload_;
  std::size_t payload_sent_ = 0;
  bool in_progress_ = false;
  bool frame_id_ = false;
  std::uint32_t next_number_ = 0;
  std::uint32_t number_ = 0;
  std::uint64_t sent_ = 0;
  std::uint64_t skipped_ = 0;
  std::uint64_t spoilt_ = 0;
};

}  // namespace hapticd::test::uvc
