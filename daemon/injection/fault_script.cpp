// SPDX-License-Identifier: Apache-2.0
#include "daemon/injection/fault_script.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <sstream>
#include <string>

#include "config/base/file_content.h"
#include "config/base/value_text.h"

namespace hapticd::daemon {
namespace {

constexpr double kMax_s = 86'400;
constexpr std::size_t kMaxScriptBytes = std::size_t{1} << 20;

bool isTime(double seconds) {
  return std::isfinite(seconds) && seconds >= 0 && seconds <= kMax_s;
}

base::Result<ScriptedFault> faultOn(const std::string& line) {
  std::istringstream words(line);
  double begin_s = -1;
  double duration_s = -1;
  std::string name;
  std::string rest;
  words >> begin_s >> duration_s >> name;
  if (words.fail() || words >> rest || !isTime(begin_s) || !isTime(duration_s)) {
    return std::unexpected(base::Error{
        "", fmt::format("{} is not BEGIN_S DURATION_S FAULT, both 0..{} s", base::inQuotes(line), kMax_s),
        "write for example: 2.5 0.5 frozen_camera"});
  }
  const std::optional<Fault> fault = rt::withWord<Fault>(name);
  if (!fault) {
    return std::unexpected(base::Error{"", fmt::format("there is no fault {}", base::inQuotes(name)),
                                       fmt::format("choose one of: {}", fmt::join(rt::kWords<Fault>, ", "))});
  }
  using Seconds = std::chrono::duration<double>;
  return ScriptedFault{*fault, Seconds(begin_s), Seconds(duration_s)};
}

}  // namespace

base::Result<std::vector<ScriptedFault>> readFaultScript(const std::filesystem::path& file) {
  const auto content = base::fileContent(file, {.longest = kMaxScriptBytes, .kind = base::FileKind::any});
  if (!content) {
    return std::unexpected(
        base::Error{file.string(), content.error().text(), "give a script that exists and may be read"});
  }
  std::istringstream stream(*content);
  std::vector<ScriptedFault> script;
  int number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    line.resize(std::min(line.find('#'), line.size()));
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    auto fault = faultOn(line);
    if (!fault) {
      fault.error().where = fmt::format("{}:{}", file.string(), number);
      return std::unexpected(fault.error());
    }
    script.push_back(*fault);
  }
  return script;
}

}  // namespace hapticd::daemon
