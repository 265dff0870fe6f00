// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-soak/daemon_process.h"

#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iterator>
#include <thread>

#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::seconds kPatience{30};

void write(const fs::path& file, const std::string& text) {
  std::ofstream(file) << text;
}

std::vector<std::string> commandOf(const fs::path& program, const fs::path& folder,
                                   const std::vector<std::string>& assignments) {
  std::vector<std::string> command{program.string(), "--config", (folder / "hapticd.yaml").string()};
  for (const std::string& assignment : assignments) command.push_back("--set=" + assignment);
  command.push_back("--set=state.folder=" + (folder / "state").string());
  command.push_back("--set=control.status_socket=" + (folder / "Status").string());
  command.push_back("--set=control.control_socket=" + (folder / "Control").string());
  return command;
}

}  // namespace

ScratchFolder::ScratchFolder() {
  std::string name = (fs::temp_directory_path() / "haptic-soak-XXXXXX").string();
  if (::mkdtemp(name.data()) != nullptr) path_ = name;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  if (!path_.empty()) fs::remove_all(path_, ignored);
}

config::Result<DaemonProcess> DaemonProcess::start(const ScratchFolder& folder, const fs::path& program,
                                                   const fs::path& config_file,
                                                   const std::vector<std::string>& assignments) {
  if (folder.path().empty()) {
    return std::unexpected(
        config::Error{fs::temp_directory_path().string(), "no folder can be made in it", "check TMPDIR"});
  }
  std::ifstream file(config_file);
  if (!file) {
    return std::unexpected(config::Error{config_file.string(), "cannot be read", "check --config"});
  }
  std::string configuration{std::istreambuf_iterator<char>(file), {}};
  write(folder.path() / "hapticd.yaml", configuration);
  const int log = ::open((folder.path() / "log").c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  auto child = ChildProcess::start(commandOf(program, folder.path(), assignments),
                                   {.output = log, .errors = log, .environment = {}},
                                   "build it first, or name it with --daemon");
  ::close(log);
  if (!child) return std::unexpected(child.error());
  DaemonProcess daemon(std::move(*child), folder.path(), std::move(configuration));
  if (auto answers = daemon.waitUntilItAnswers(); !answers) return std::unexpected(answers.error());
  return daemon;
}

config::Result<void> DaemonProcess::waitUntilItAnswers() {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (running() && std::chrono::steady_clock::now() < deadline) {
    auto client = VarlinkClient::connect(controlSocket());
    if (client && client->call("io.hapticd.Status.GetStatus")) return {};
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return std::unexpected(config::Error{"hapticd", "does not start", "its last output: " + lastWords()});
}

void DaemonProcess::reload(ReloadKind kind) {
  std::string text = configuration_;
  const std::size_t end = text.ends_with("...\n") ? text.size() - 4 : text.size();
  if (kind == ReloadKind::damaged) text.insert(end, "\nforce: [\n");
  if (kind == ReloadKind::wrong_name) text.insert(end, "\nno_such_group: {name: 1}\n");
  write(folder_ / "hapticd.yaml", text);
  child_.signal(SIGHUP);
}

std::optional<ChildEnding> DaemonProcess::stop() {
  child_.signal(SIGTERM);
  return child_.waitFor(kPatience);
}

std::string DaemonProcess::lastWords() const {
  constexpr std::size_t kMost = 2000;
  std::ifstream file(folder_ / "log");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  return text.substr(text.size() - std::min(text.size(), kMost));
}

}  // namespace hapticd::tools
