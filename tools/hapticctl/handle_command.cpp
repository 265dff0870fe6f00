// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <memory>
#include <string>

#include "tools/hapticctl/base/command_line.h"
#include "tools/hapticctl/commands.h"
#include "tools/hapticctl/doctor/handle_list.h"
#include "tools/hapticctl/running_daemon.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

constexpr const char* kListFooter =
    "Each line has 'used' or 'usable' (with another configuration), the place of a\n"
    "handle, its name, and what to do so that hapticd uses it. Handles behind a\n"
    "network are not shown. The last lines name the driver that hapticd uses, and\n"
    "the configuration: that of the running hapticd, else that of the file.\n";

int runList(const CommandOptions& options, const std::string& root) {
  const bool this_machine = root == "/";
  Examination box{Machine(root), thisCaller(), std::nullopt, {}, {}};
  box.daemon = daemonView(options, this_machine ? askServiceManager() : std::nullopt, this_machine);
  box.configuration = this_machine ? configurationInUse(box.daemon, root) : readConfiguration(root);
  if (!box.configuration.problem.empty()) {
    return report(base::Error{"", box.configuration.problem, kCheckConfiguration}, options.json);
  }
  HandleList list = listHandles(box);
  if (this_machine && box.daemon.settings) list.state = box.daemon.handle.state;
  fmt::print("{}", options.json ? jsonOf(list) : fitted(textOf(list), terminalSize().columns));
  return kOk;
}

}  // namespace

void addHandleCommands(CommandLine& line) {
  const CommandOptions& options = line.options();
  CLI::App& group = line.addGroup("handle", "Connected haptic handles");
  const auto root = std::make_shared<std::string>("/");
  CLI::App& command =
      line.add(group, "list", "List the connected handles, and what hapticd needs to use them",
               [&options, root] { return runList(options, *root); });
  command.footer(kListFooter);
  command.add_option("--root", *root, "List the handles below this folder instead of this machine's")
      ->type_name("FOLDER")
      ->check(CLI::Validator(CLI::ExistingDirectory).description(""));
}

}  // namespace hapticd::tools
