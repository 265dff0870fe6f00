// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <memory>
#include <string>

#include "config/base/file_content.h"
#include "tools/hapticctl/base/command_line.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/hapticctl/text/status_text.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/ros/ros_name.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

/// hapticd-ros writes its file once a second, or after its longest wait for hapticd, 3 s.
constexpr double kOldest_s = 10;
constexpr std::size_t kMostBytes = std::size_t{4} << 20;

constexpr const char* kFooter =
    "It reads what hapticd-ros writes to its status file once a second. Lines with '!'\n"
    "say what does not arrive, and why: settings of DDS (QoS) that do not match,\n"
    "other types, messages that were refused.\n"
    "\n"
    "Exit status: 0 done, 1 hapticd-ros is not running, 2 wrong usage.\n";

base::Result<Json> readStatus(const std::string& file) {
  const auto content = base::fileContent(file, {.longest = kMostBytes});
  if (!content)
    return std::unexpected(
        base::Error{file, content.error().text(),
                    "is hapticd-ros running? 'systemctl enable --now hapticd-ros'; one that "
                    "was started by hand needs --status-file, and its file here --file"});
  Json status = Json::parse(*content, nullptr, /*allow_exceptions=*/false);
  if (!status.is_object() || !fieldAt(status, "published"))
    return std::unexpected(base::Error{file, "is no status of hapticd-ros", "--file names another one"});
  const double age_s = (static_cast<double>(realtimeNow_ns()) - numberAt(status, "writtenUtcNs")) * 1e-9;
  if (!(age_s < kOldest_s))
    return std::unexpected(
        base::Error{file, fmt::format("is {} old: hapticd-ros has been killed, or hangs", ageText(age_s)),
                    "'systemctl status hapticd-ros' tells more"});
  return status;
}

int runRos(const CommandOptions& options, const std::string& file) {
  const auto status = readStatus(file);
  if (!status) return report(status.error(), options.json);
  if (options.json) {
    printJson(*status);
  } else {
    fmt::print("{}", rosStatusText(*status, terminalSize().columns));
  }
  return kOk;
}

}  // namespace

void addRosCommand(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto file = std::make_shared<std::string>(ros::kRosStatusFile);
  CLI::App& command =
      line.add("ros", "Show what hapticd-ros publishes, who subscribes, and what does not match",
               [&options, file] { return runRos(options, *file); });
  command.footer(kFooter);
  command
      .add_option("--file", *file,
                  fmt::format("The status file of hapticd-ros (default {})", ros::kRosStatusFile))
      ->type_name("FILE");
}

}  // namespace hapticd::tools
