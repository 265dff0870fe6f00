// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/recorded/frame_list.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "config/base/file_content.h"
#include "config/base/value_text.h"
#include "rt/base/clock.h"

namespace hapticd::drivers {

std::optional<std::int64_t> decimalSecondsInNs(std::string_view text) {
  constexpr std::size_t kMaxDigits = 9;
  const std::size_t point = text.find('.');
  const auto seconds = wholeNumber<std::uint32_t>(text.substr(0, point));
  if (!seconds) return std::nullopt;
  std::int64_t fraction_ns = 0;
  if (point != std::string_view::npos) {
    const std::string_view digits = text.substr(point + 1);
    const auto fraction = wholeNumber<std::uint32_t>(digits.substr(0, kMaxDigits));
    if (!fraction || !std::ranges::all_of(digits, [](char c) { return c >= '0' && c <= '9'; })) {
      return std::nullopt;
    }
    fraction_ns = *fraction;
    for (std::size_t digit = digits.size(); digit < kMaxDigits; ++digit) fraction_ns *= 10;
  }
  return std::int64_t{*seconds} * rt::kNsPerSecond + fraction_ns;
}

namespace {

namespace fs = std::filesystem;

enum Column { file, time_ns, time_s, exposure_ns, device_ticks, x_m, y_m, z_m, qx, qy, qz, qw };
constexpr std::size_t kColumns = 12;
constexpr std::array<std::string_view, kColumns> kNames{
    "file", "time_ns", "time_s", "exposure_ns", "device_ticks", "x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"};
constexpr std::array<Column, 7> kPose{x_m, y_m, z_m, qx, qy, qz, qw};

/// Allowed deviation of a quaternion's norm from 1; data sets give four digits.
constexpr double kNormTolerance = 0.01;

/// The values of one line by column; empty where there is no such column.
using Values = std::array<std::string_view, kColumns>;

std::vector<std::string_view> cellsOf(std::string_view line) {
  std::vector<std::string_view> cells;
  for (;;) {
    const std::size_t comma = line.find(',');
    cells.push_back(line.substr(0, comma));
    if (comma == std::string_view::npos) return cells;
    line.remove_prefix(comma + 1);
  }
}

/// Reads the lines of one list.
class ListReader {
 public:
  explicit ListReader(const fs::path& folder) : folder_(folder), list_(folder / kFrameFile) {}

  base::Result<std::vector<RecordedFrame>> read(std::string_view text, std::string& cut_off) {
    for (std::string_view rest = text; !rest.empty();) {
      const std::size_t end = rest.find('\n');
      ++number_;
      if (auto taken = takeLine(rest.substr(0, end)); !taken) {
        // the recording ended while the line was written
        const bool is_cut = end == std::string_view::npos && !frames_.empty();
        if (!is_cut) return std::unexpected(taken.error());
        cut_off = taken.error().text();
        break;
      }
      rest = end == std::string_view::npos ? std::string_view{} : rest.substr(end + 1);
    }
    if (!frames_.empty()) return std::move(frames_);
    return std::unexpected(
        base::Error{list_.string(), "names no depth frame", "a recording has at least one frame"});
  }

 private:
  std::unexpected<base::Error> refuse(std::string what, std::string remedy) const {
    return std::unexpected(
        base::Error{fmt::format("{}:{}", list_.string(), number_), std::move(what), std::move(remedy)});
  }

  base::Result<void> takeLine(std::string_view line) {
    if (line.ends_with('\r')) {
      return refuse("the line ends in CRLF, not LF",
                    fmt::format("convert the file: sed -i 's/\\r$//' {}", list_.string()));
    }
    if (number_ == 1) return takeHeader(line);
    if (line.empty()) return {};
    const std::vector<std::string_view> cells = cellsOf(line);
    if (cells.size() != columns_.size()) {
      return refuse(fmt::format("has {} values, but there are {} columns", cells.size(), columns_.size()),
                    "complete the line or remove it");
    }
    Values values{};
    for (std::size_t i = 0; i < cells.size(); ++i) values[columns_[i]] = cells[i];
    auto frame = frameOf(values);
    if (!frame) return std::unexpected(std::move(frame.error()));
    frames_.push_back(std::move(*frame));
    return {};
  }

  base::Result<void> takeHeader(std::string_view line) {
    for (const std::string& cell : base::csvNames(line)) {
      const auto known = std::ranges::find(kNames, cell);
      if (known == kNames.end()) {
        return refuse(fmt::format("there is no column {}", base::inQuotes(cell)),
                      fmt::format("the first line names the columns: {}", fmt::join(kNames, ", ")));
      }
      const auto column = static_cast<Column>(known - kNames.begin());
      if (has(column)) return refuse(fmt::format("has the column {} twice", cell), "remove one of the two");
      columns_.push_back(column);
    }
    if (!has(file)) return refuse("has no column file", "add the names of the images");
    if (has(time_ns) == has(time_s)) {
      return refuse("has none or both of the columns time_ns and time_s", "give the times in one of them");
    }
    const auto pose_columns = std::ranges::count_if(kPose, [this](Column column) { return has(column); });
    if (pose_columns != 0 && pose_columns != std::ssize(kPose)) {
      return refuse("has only some of the columns of a pose",
                    "give all of x_m, y_m, z_m, qx, qy, qz and qw, or none");
    }
    return {};
  }

  bool has(Column column) const { return std::ranges::find(columns_, column) != columns_.end(); }

  base::Result<RecordedFrame> frameOf(const Values& values) {
    RecordedFrame frame;
    if (auto named = takeFile(values[file], frame); !named) return std::unexpected(named.error());
    if (auto timed = takeTimes(values, frame); !timed) return std::unexpected(timed.error());
    if (auto placed = takePose(values, frame); !placed) return std::unexpected(placed.error());
    return frame;
  }

  base::Result<void> takeFile(std::string_view name, RecordedFrame& frame) const {
    frame.file = name;
    if (name.empty() || name == "." || name == ".." || name.find('/') != std::string_view::npos ||
        name.find('\0') != std::string_view::npos) {
      return refuse(fmt::format("{} is not the name of a file in the folder itself", base::inQuotes(name)),
                    "put the image into the folder of the recording, and give its name without a path");
    }
    std::error_code failure;
    const fs::file_status status = fs::symlink_status(folder_ / name, failure);
    if (!fs::exists(status)) {
      return refuse(fmt::format("there is no file {}", base::inQuotes(name)),
                    "copy the recording again, or remove the line");
    }
    if (fs::is_regular_file(status)) return {};
    return refuse(fmt::format("{} is a link or not a file", base::inQuotes(name)),
                  "put the image itself into the folder of the recording");
  }

  base::Result<void> takeTimes(const Values& values, RecordedFrame& frame) {
    const std::string_view text = has(time_ns) ? values[time_ns] : values[time_s];
    const auto time = has(time_ns) ? wholeNumber<std::int64_t>(text) : decimalSecondsInNs(text);
    if (!time || *time < 0) {
      return refuse(
          fmt::format("{} is not a time in {}", base::inQuotes(text), has(time_ns) ? "ns" : "seconds"),
          "times are decimal numbers from 0 on, without an exponent");
    }
    frame.realtime_ns = *time;
    if (!frames_.empty() && *time <= frames_.back().realtime_ns) {
      return refuse(fmt::format("the time {} is not after that of the frame before", text),
                    "list the frames in the order of their times, each time once");
    }
    if (!values[exposure_ns].empty()) {
      frame.exposure_ns = wholeNumber<std::int64_t>(values[exposure_ns]);
      if (!frame.exposure_ns || *frame.exposure_ns < 0 || *frame.exposure_ns > *time) {
        return refuse(fmt::format("the exposure {} is not a time in ns up to that of the frame",
                                  base::inQuotes(values[exposure_ns])),
                      "give the time at the middle of the exposure on the same clock, or nothing");
      }
    }
    if (values[device_ticks].empty()) return {};
    const auto ticks = wholeNumber<std::uint32_t>(values[device_ticks]);
    if (!ticks) {
      return refuse(fmt::format("{} is not a counter of 32 bits", base::inQuotes(values[device_ticks])),
                    "give an integer from 0 to 4294967295, or nothing");
    }
    frame.device_ticks = *ticks;
    return {};
  }

  base::Result<void> takePose(const Values& values, RecordedFrame& frame) const {
    const auto given =
        std::ranges::count_if(kPose, [&values](Column column) { return !values[column].empty(); });
    if (given == 0) return {};
    std::array<double, kPose.size()> numbers{};
    for (std::size_t i = 0; i < kPose.size(); ++i) {
      const std::string_view text = values[kPose[i]];
      const auto number = wholeNumber<double>(text);
      if (!number || !std::isfinite(*number)) {
        return refuse(fmt::format("{} {} is not a finite number", kNames[kPose[i]], base::inQuotes(text)),
                      "give all numbers of the pose, or none");
      }
      numbers[i] = *number;
    }
    const auto& [x, y, z, i, j, k, w] = numbers;
    if (std::abs(std::sqrt(i * i + j * j + k * k + w * w) - 1) > kNormTolerance) {
      return refuse("the quaternion of the pose does not have the norm 1",
                    "give qx, qy, qz and qw of a rotation");
    }
    frame.pose = RecordedPose{{x, y, z}, i, j, k, w};
    return {};
  }

  fs::path folder_;
  fs::path list_;
  std::size_t number_ = 0;
  std::vector<Column> columns_;
  std::vector<RecordedFrame> frames_;
};

}  // namespace

base::Result<std::vector<RecordedFrame>> readFrameList(const fs::path& folder, std::string& cut_off) {
  const fs::path list = folder / kFrameFile;
  const auto text = base::fileContent(list, {.longest = kMaxIndexBytes});
  if (text) return ListReader(folder).read(*text, cut_off);
  return std::unexpected(base::Error{list.string(), text.error().text(),
                                     text.error().reason == base::FileFault::Reason::too_long
                                         ? "split the recording"
                                         : "a recording with camera.yaml lists its frames in frames.csv"});
}

std::string frameListHeader(bool poses) {
  return poses ? "file,time_ns,exposure_ns,device_ticks,x_m,y_m,z_m,qx,qy,qz,qw\n"
               : "file,time_ns,exposure_ns,device_ticks\n";
}

std::string frameListLine(const RecordedFrame& frame, bool poses) {
  std::string line = fmt::format("{},{},", frame.file, frame.realtime_ns);
  if (frame.exposure_ns) line += fmt::format("{}", *frame.exposure_ns);
  line += ',';
  if (frame.device_ticks != 0) line += fmt::format("{}", frame.device_ticks);
  if (poses && frame.pose) {
    const RecordedPose& pose = *frame.pose;
    line += fmt::format(",{},{},{},{},{},{},{}", pose.position_m.x, pose.position_m.y, pose.position_m.z,
                        pose.qx, pose.qy, pose.qz, pose.qw);
  } else if (poses) {
    line.append(kPose.size(), ',');
  }
  return line + '\n';
}

}  // namespace hapticd::drivers
