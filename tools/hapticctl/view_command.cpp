// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

#include "config/base/descriptor.h"
#include "tools/hapticctl/base/command_line.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/lib/options/option_checks.h"

namespace hapticd::tools {
namespace {

constexpr const char* kViewFooter =
    "The address contains a secret token: anyone who has it can see the scene. It stays the same until the "
    "next "
    "boot.\n"
    "Exit status: 0 done, 1 the token cannot be read, 2 wrong usage, 3 no picture is served on this "
    "machine.\n";

constexpr std::chrono::seconds kPatience{5};
constexpr std::size_t kTokenDigits = 32;

struct ViewOptions {
  int port = 8765;
  std::string token_file = "/run/hapticd-view/token";
};

ClientError notServed(int error) {
  ClientError result;
  result.what = fmt::format("no live picture is served on this machine ({})", std::strerror(error));
  result.remedy =
      "start it with 'systemctl enable --now hapticd-view.socket', or run hapticd-view by hand\n"
      "--port and --token-file name those of one that uses others";
  return result;
}

/// Connects to the port, which starts the service when the service manager listens there.
ClientResult<void> wake(int port) {
  const base::Descriptor connection(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(connection.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0)
    return {};
  if (errno != EINPROGRESS) return std::unexpected(notServed(errno));
  pollfd connected{connection.get(), POLLOUT, 0};
  const auto limit = std::chrono::milliseconds(kPatience).count();
  if (::poll(&connected, 1, static_cast<int>(limit)) <= 0) return std::unexpected(notServed(ETIMEDOUT));
  int error = 0;
  socklen_t size = sizeof(error);
  ::getsockopt(connection.get(), SOL_SOCKET, SO_ERROR, &error, &size);
  if (error != 0) return std::unexpected(notServed(error));
  return {};
}

bool isToken(const std::string& text) {
  return text.size() == kTokenDigits && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

/// Reads the token, which the service writes when it starts for the first time.
base::Result<std::string> readToken(const std::string& path) {
  const auto end = std::chrono::steady_clock::now() + kPatience;
  for (;;) {
    errno = 0;
    std::ifstream file(path);
    const int error = errno;
    std::string token;
    if (file && std::getline(file, token) && isToken(token)) return token;
    if (error == EACCES) {
      return std::unexpected(base::Error{
          path, "no permission to read the token of the live picture",
          "members of the group haptic-view may: 'sudo usermod -aG haptic-view $USER', then log in again"});
    }
    if (std::chrono::steady_clock::now() > end) {
      return std::unexpected(base::Error{
          path, file ? "holds no token" : std::strerror(error),
          "see 'systemctl status hapticd-view'; --token-file names the file of a hapticd-view run by hand"});
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

int runView(const CommandOptions& options, const ViewOptions& view) {
  if (const auto awake = wake(view.port); !awake) return report(awake.error(), options.json);
  const auto token = readToken(view.token_file);
  if (!token) return report(token.error(), options.json);
  const std::string place = fmt::format("127.0.0.1:{}/?token={}", view.port, *token);
  if (options.json) {
    fmt::print("{}\n", Json{{"page", "http://" + place}, {"foxglove", "ws://" + place}}.dump());
    return kOk;
  }
  fmt::print("In a browser:              http://{}\n", place);
  fmt::print("In Lichtblick or Foxglove: ws://{}\n", place);
  fmt::print("From another computer run 'ssh -L {0}:127.0.0.1:{0} USER@BOX' there first.\n", view.port);
  return kOk;
}

}  // namespace

void addViewCommand(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto view = std::make_shared<ViewOptions>();
  CLI::App& command = line.add("view", "Show the address of the live picture of scene, hand and force",
                               [&options, view] { return runView(options, *view); });
  command.footer(kViewFooter);
  command.add_option("--port", view->port, "Port that hapticd-view listens on")
      ->type_name("PORT")
      ->check(within(1, 65535))
      ->capture_default_str();
  command.add_option("--token-file", view->token_file, "File with the token (" + view->token_file + ")")
      ->type_name("FILE");
}

}  // namespace hapticd::tools
