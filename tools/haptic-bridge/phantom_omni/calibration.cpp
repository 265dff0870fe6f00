// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/phantom_omni/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>

#include "config/base/file_content.h"
#include "config/base/whole_file.h"

namespace hapticd::tools::phantom_omni {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kFormat = "haptic-vendor-bridge calibration phantom-omni 1";
constexpr const char* kAgain = "calibrate the device again: haptic-bridge calibrate phantom-omni";

std::string_view variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

std::unexpected<base::Error> unusable(const std::filesystem::path& file, const std::string& what) {
  return std::unexpected(base::Error{file.string(), what, kAgain});
}

/// What is wrong with a calibration; empty: it was taken over.
std::string take(const Json& json, OmniCalibration& calibration) {
  if (!json.is_object()) return "is not a JSON object";
  if (json.value("format", Json()) != kFormat) return fmt::format("its format is not \"{}\"", kFormat);
  const Json serial = json.value("serial", Json());
  if (!serial.is_string()) return "serial is not a text";
  const Json gains = json.value("nMPerCount", Json());
  if (!gains.is_array() || gains.size() != calibration.n_m_per_count.size())
    return "nMPerCount is not a list of three numbers";
  const Json releases = json.value("releasesWithoutPackets", Json());
  if (!releases.is_boolean()) return "releasesWithoutPackets is neither true nor false";
  for (std::size_t joint = 0; joint < gains.size(); ++joint) {
    if (!gains[joint].is_number()) return "nMPerCount is not a list of three numbers";
    calibration.n_m_per_count[joint] = gains[joint].get<double>();
  }
  if (!std::ranges::all_of(calibration.n_m_per_count, isPlausibleGain))
    return fmt::format("nMPerCount is not within {} and {} N m", kLeastGain_n_m, kMostGain_n_m);
  calibration.serial = serial.get<std::string>();
  calibration.releases_without_packets = releases.get<bool>();
  return {};
}

}  // namespace

bool isPlausibleGain(double n_m_per_count) {
  return std::abs(n_m_per_count) >= kLeastGain_n_m && std::abs(n_m_per_count) <= kMostGain_n_m;
}

base::Result<std::filesystem::path> calibrationFile(const std::string& file, const std::string& serial) {
  if (!file.empty()) return file;
  const std::string name = fmt::format("phantom-omni-{}.json", serial);
  const std::string_view services = variable("STATE_DIRECTORY");  // of systemd; a list with colons
  if (!services.empty()) return std::filesystem::path(services.substr(0, services.find(':'))) / name;
  constexpr const char* kFolder = "haptic-vendor-bridge";
  const std::string_view state = variable("XDG_STATE_HOME");
  if (!state.empty()) return std::filesystem::path(state) / kFolder / name;
  const std::string_view home = variable("HOME");
  if (!home.empty()) return std::filesystem::path(home) / ".local/state" / kFolder / name;
  return std::unexpected(base::Error{"calibration",
                                     "none of $STATE_DIRECTORY, $XDG_STATE_HOME and $HOME says where it is",
                                     "give its file with --calibration"});
}

base::Result<std::optional<OmniCalibration>> readCalibration(const std::filesystem::path& file,
                                                             const std::string& serial) {
  constexpr std::size_t kLongest = 1 << 16;
  const auto content = base::fileContent(file, {.longest = kLongest});
  if (!content && content.error().error_number == ENOENT) return std::nullopt;
  if (!content) return unusable(file, content.error().text());
  OmniCalibration calibration;
  const std::string wrong = take(Json::parse(*content, nullptr, false), calibration);
  if (!wrong.empty()) return unusable(file, wrong);
  if (calibration.serial != serial) {
    return unusable(file, fmt::format("belongs to the device with serial number {}, not to {}",
                                      calibration.serial, serial));
  }
  return calibration;
}

base::Result<void> storeCalibration(const std::filesystem::path& file, const OmniCalibration& calibration) {
  std::error_code failed;
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path(), failed);
  if (failed) {
    return std::unexpected(base::Error{file.parent_path().string(), "cannot be made: " + failed.message(),
                                       "give another file with --calibration"});
  }
  const Json json{{"format", kFormat},
                  {"serial", calibration.serial},
                  {"nMPerCount", calibration.n_m_per_count},
                  {"releasesWithoutPackets", calibration.releases_without_packets}};
  return base::writeWholeFile(file, json.dump(2) + "\n", base::IfExists::replace);
}

}  // namespace hapticd::tools::phantom_omni
