// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "rt/base/parameters.h"

namespace hapticd::drivers {

/// Pose of the camera's optical frame (x to the right, y down, z forwards) in the world of a data set.
struct RecordedPose {
  rt::Vec3 position_m;
  double qx = 0;  ///< unit quaternion of the rotation
  double qy = 0;
  double qz = 0;
  double qw = 1;
};

/// One depth frame of a recording.
struct RecordedFrame {
  std::string file;          ///< file name in the recording's folder
  std::int64_t host_ns = 0;  ///< host time since the first depth frame of the recording; never decreases

  /// Host time as given in the recording: CLOCK_REALTIME of the recording host.
  std::int64_t realtime_ns = 0;
  std::uint32_t device_ticks = 0;           ///< the camera's own counter; 0 if it has none
  std::optional<std::int64_t> exposure_ns;  ///< host time at mid-exposure, on the clock of realtime_ns
  std::optional<RecordedPose> pose;
};

/// Converts all of `text` to a number; nothing if it is not a number or does not fit.
template <typename Number>
std::optional<Number> wholeNumber(std::string_view text) {
  Number number{};
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (text.empty() || failure != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return number;
}

/// Converts e.g. "1513096835.219278" to nanoseconds, without the rounding of floating-point numbers. Nothing
/// if the text is not a decimal number of seconds from 0 to 2^32.
std::optional<std::int64_t> decimalSecondsInNs(std::string_view text);

/// Name of the file that lists the frames in the folder of a recording with camera.yaml.
inline constexpr const char* kFrameFile = "frames.csv";

/// Largest size of an index; 1.6 million lines of 40 bytes.
inline constexpr std::size_t kMaxIndexBytes = 64 << 20;

/// Reads the frames that `folder`/frames.csv lists, of the form that README.md describes, and checks that
/// each file is in the folder itself. At least one frame, without host_ns. `cut_off`: why the last line was
/// left out, if it has no end and cannot be read. Errors: name the line and the remedy. Thread: any.  RT: not
/// safe.
base::Result<std::vector<RecordedFrame>> readFrameList(const std::filesystem::path& folder,
                                                       std::string& cut_off);

/// Returns the first line of such a file, with its end. `poses`: frames may have poses.
std::string frameListHeader(bool poses);
/// Returns the line of a frame for the same `poses`, with its end. Its host_ns does not count.
std::string frameListLine(const RecordedFrame& frame, bool poses);

}  // namespace hapticd::drivers
