// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/recorded/recording_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <string_view>

#include "config/base/file_content.h"
#include "config/base/value_text.h"
#include "drivers/camera/recorded/camera_description.h"
#include "drivers/camera/recorded/depth_image.h"
#include "drivers/camera/recorded/frame_list.h"
#include "rt/base/clock.h"
#include "rt/depth/depth_model.h"

namespace hapticd::drivers {
namespace {

constexpr const char* kIndexName = "INDEX.txt";

std::unexpected<base::Error> refuse(std::string where, std::string what, std::string remedy) {
  return std::unexpected(base::Error{std::move(where), std::move(what), std::move(remedy)});
}

/// Converts seconds that libfreenect's player reads: plain decimals without rounding, others as numbers of C.
std::optional<std::int64_t> hostTimeOf_ns(std::string_view text) {
  constexpr double kMax_s = 4294967296.0;  // as many as decimalSecondsInNs() takes
  if (const auto exact_ns = decimalSecondsInNs(text)) return exact_ns;
  const auto seconds = wholeNumber<double>(text);
  if (!seconds || !(*seconds >= 0) || !(*seconds < kMax_s)) return std::nullopt;
  return std::llround(*seconds * static_cast<double>(rt::kNsPerSecond));
}

/// Parses "d-<host seconds>-<device ticks>", after which libfreenect's player takes anything.
std::optional<RecordedFrame> parseDepthName(std::string_view name) {
  constexpr std::string_view kDigits = "0123456789";
  if (!name.starts_with("d-") || name.find('/') != std::string_view::npos) return std::nullopt;
  const std::string_view numbers = name.substr(2);
  // the exponent of a number may have a sign too
  std::size_t dash = numbers.find('-');
  if (dash != std::string_view::npos && dash > 0 && (numbers[dash - 1] == 'e' || numbers[dash - 1] == 'E'))
    dash = numbers.find('-', dash + 1);
  if (dash == std::string_view::npos) return std::nullopt;
  const auto realtime_ns = hostTimeOf_ns(numbers.substr(0, dash));
  const std::string_view behind = numbers.substr(dash + 1);
  const auto ticks = wholeNumber<std::uint32_t>(behind.substr(0, behind.find_first_not_of(kDigits)));
  if (!realtime_ns || !ticks) return std::nullopt;
  return RecordedFrame{.file = std::string(name),
                       .host_ns = 0,
                       .realtime_ns = *realtime_ns,
                       .device_ticks = *ticks,
                       .exposure_ns = {},
                       .pose = {}};
}

base::Result<std::string> readIndex(const std::filesystem::path& folder) {
  std::error_code failure;
  if (!std::filesystem::is_directory(folder, failure)) {
    return refuse(
        folder.string(), failure ? failure.message() : "not a folder",
        "give the folder of a recording that holds INDEX.txt or camera.yaml; unpack archives first");
  }
  const std::filesystem::path file = folder / kIndexName;
  auto text = base::fileContent(file, {.longest = kMaxIndexBytes});
  if (text) return std::move(*text);
  return refuse(
      file.string(), text.error().text(),
      text.error().reason == base::FileFault::Reason::too_long
          ? "split the recording"
          : "a recording is a folder with INDEX.txt as libfreenect's fakenect-record writes it, or with "
            "camera.yaml for other cameras");
}

/// Returns the frame named by a line, or nothing for a line without depth.
base::Result<std::optional<RecordedFrame>> parseLine(const std::filesystem::path& folder,
                                                     std::string_view line, std::size_t number) {
  const std::string where = fmt::format("{}:{}", (folder / kIndexName).string(), number);
  if (line.ends_with('\r')) {
    return refuse(where, "the line ends in CRLF, not LF",
                  fmt::format("convert the file: sed -i 's/\\r$//' {}", (folder / kIndexName).string()));
  }
  if (line.empty() || line.starts_with("r-") || line.starts_with("a-")) return std::nullopt;
  auto frame = parseDepthName(line);
  if (!frame) {
    return refuse(where, fmt::format("{} is not the name of a recorded file", base::inQuotes(line)),
                  "expected d-<host seconds>-<device ticks> and any ending, or the same with r- or a-");
  }
  std::error_code failure;
  if (!std::filesystem::is_regular_file(folder / frame->file, failure)) {
    return refuse(where, fmt::format("there is no file {}", base::inQuotes(frame->file)),
                  "copy the recording again, or remove the line from INDEX.txt");
  }
  return frame;
}

/// A longer time between two frames is that of a clock that was set meanwhile.
constexpr std::int64_t kMaxGap_ns = 86'400 * rt::kNsPerSecond;
/// What such a gap counts for: the frame period of a Kinect v1.
constexpr std::int64_t kUsualPeriod_ns = 33'369'000;

/// Sets host_ns from the absolute times. Where the clock was set back a little, the time stands still until
/// it catches up.
void setHostTimes(std::vector<RecordedFrame>& frames) {
  std::int64_t before_ns = frames.front().realtime_ns, latest_ns = before_ns, host_ns = 0;
  for (RecordedFrame& frame : frames) {
    const bool clock_was_set = std::abs(frame.realtime_ns - before_ns) > kMaxGap_ns;
    host_ns += clock_was_set ? kUsualPeriod_ns : std::max<std::int64_t>(frame.realtime_ns - latest_ns, 0);
    before_ns = frame.realtime_ns;
    latest_ns = clock_was_set ? before_ns : std::max(latest_ns, before_ns);
    frame.host_ns = host_ns;
  }
}

}  // namespace

base::Result<RecordingReader> RecordingReader::openKinect(const std::filesystem::path& folder) {
  const auto text = readIndex(folder);
  if (!text) return std::unexpected(text.error());
  std::vector<RecordedFrame> frames;
  std::string cut_off;
  std::size_t number = 0;
  for (std::string_view rest = *text; !rest.empty();) {
    const std::size_t end = rest.find('\n');
    auto frame = parseLine(folder, rest.substr(0, end), ++number);
    if (!frame && end == std::string_view::npos && !frames.empty()) {
      cut_off = frame.error().text();  // the recording ended while the line was written
      break;
    }
    if (!frame) return std::unexpected(std::move(frame.error()));
    if (*frame) frames.push_back(std::move(**frame));
    rest = end == std::string_view::npos ? std::string_view{} : rest.substr(end + 1);
  }
  if (frames.empty()) {
    return refuse((folder / kIndexName).string(), "names no depth frame",
                  "give a recording that was made with depth");
  }
  setHostTimes(frames);
  RecordingReader reader(folder, std::move(frames));
  reader.cut_off_ = std::move(cut_off);
  return reader;
}

base::Result<RecordingReader> RecordingReader::openCamera(const std::filesystem::path& folder,
                                                          const DepthLimits& limits) {
  const std::filesystem::path file = folder / kCameraFile;
  const auto description = readCameraDescription(file);
  if (!description) return std::unexpected(description.error());
  rt::DepthModelParameters camera = description->camera;
  camera.near_m = std::max(limits.near_m, description->near_m.value_or(limits.near_m));
  camera.far_m = std::min(limits.far_m, description->far_m.value_or(limits.far_m));
  if (rt::faultOf(camera) != rt::CameraFault::none) {
    return refuse(file.string(),
                  fmt::format("the camera measures no depth within {} to {} m", limits.near_m, limits.far_m),
                  "set camera.near_m and camera.far_m to what it reaches");
  }
  std::string cut_off;
  auto frames = readFrameList(folder, cut_off);
  if (!frames) return std::unexpected(frames.error());
  setHostTimes(*frames);
  RecordingReader reader(folder, std::move(*frames));
  reader.cut_off_ = std::move(cut_off);
  reader.camera_ = camera;
  reader.serial_ = description->serial;
  return reader;
}

base::Result<RecordingReader> RecordingReader::open(const std::filesystem::path& folder,
                                                    const DepthLimits& limits) {
  std::error_code ignored;
  const bool has_camera = std::filesystem::exists(folder / kCameraFile, ignored);
  if (has_camera && std::filesystem::exists(folder / kIndexName, ignored)) {
    return refuse(folder.string(), fmt::format("holds both {} and {}", kCameraFile, kIndexName),
                  "a recording has one index; remove the other");
  }
  return has_camera ? openCamera(folder, limits) : openKinect(folder);
}

base::Result<void> RecordingReader::read(std::size_t index, rt::DepthFrame& frame) const {
  const RecordedFrame& recorded = frames_.at(index);
  frame.sequence = index + 1;
  frame.arrival_ns = recorded.host_ns;
  frame.device_ticks = recorded.device_ticks;
  frame.exposure_ns =
      recorded.exposure_ns ? recorded.host_ns - (recorded.realtime_ns - *recorded.exposure_ns) : 0;
  if (!camera_) return readKinectImage(folder_ / recorded.file, frame);
  frame.camera = *camera_;
  return readDepthImage(folder_ / recorded.file, frame);
}

}  // namespace hapticd::drivers
