// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

#include "config/base/descriptor.h"
#include "config/base/whole_file.h"
#include "rt/base/parameters.h"
#include "tools/hapticctl/base/command_line.h"
#include "tools/hapticctl/commands.h"
#include "tools/hapticctl/snapshot/snapshot.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/options/option_checks.h"
#include "tools/lib/text/terminal_text.h"

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

struct SnapshotOptions {
  std::string ply;
  std::string png;
  base::IfExists if_exists = base::IfExists::refuse;
};

/// The radius of the HIP's neighbourhood; the default if the daemon does not report it.
double neighbourhood_m(const CommandOptions& options) {
  const auto reply = callOnce(options, {"io.hapticd.Status.GetParameters", {{"names", {"force.radius_m"}}}});
  const Json rows = reply ? listAt(*reply, "parameters") : Json::array();
  const double radius_m = rows.empty() ? std::nan("") : numberAt(rows.front(), "value");
  return std::isnan(radius_m) ? rt::SpringParameters().radius_m : radius_m;
}

base::Result<void> writeFiles(const Snapshot& snapshot, const SnapshotOptions& requested, double radius_m) {
  if (!requested.ply.empty()) {
    const auto written = base::writeWholeFile(requested.ply, plyOf(snapshot, radius_m), requested.if_exists);
    if (!written) return written;
  }
  if (requested.png.empty()) return {};
  const auto png = pngOf(snapshot);
  if (!png) return std::unexpected(png.error());
  return base::writeWholeFile(requested.png, *png, requested.if_exists);
}

void showSnapshot(const Snapshot& snapshot, const SnapshotOptions& requested, bool json) {
  const auto measured = std::ranges::count_if(snapshot.raw, [&](auto raw) {
    return raw != snapshot.depth_model.raw_no_measurement && raw < snapshot.depth_model.raw_values;
  });
  Json files = Json::array();
  for (const std::string& file : {requested.ply, requested.png}) {
    if (!file.empty()) files.push_back(file);
  }
  if (json) return printJson({{"frame", snapshot.frame}, {"measuredPixels", measured}, {"files", files}});
  fmt::print("frame {}: {} of {} pixels measured\n", snapshot.frame, measured, snapshot.raw.size());
  for (const Json& file : files) fmt::print("{}\n", printable(file.get<std::string>()));
}

int runSnapshot(const CommandOptions& options, const SnapshotOptions& requested) {
  for (const std::string& file : {requested.ply, requested.png}) {
    const auto good = file.empty() ? base::Result<void>() : base::mayWrite(file, requested.if_exists);
    if (!good) return report(good.error(), options.json);
  }
  const auto snapshot = fetchSnapshot(options);
  if (!snapshot) return snapshot.error();
  const double radius_m = requested.ply.empty() ? 0 : neighbourhood_m(options);
  const auto written = writeFiles(*snapshot, requested, radius_m);
  if (!written) return report(written.error(), options.json);
  showSnapshot(*snapshot, requested, options.json);
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

void addSnapshotCommand(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto requested = std::make_shared<SnapshotOptions>();
  CLI::App& command = line.add("snapshot", "Save the depth image of this moment, with the HIP marked",
                               [&options, requested] { return runSnapshot(options, *requested); });
  command.add_option("--ply", requested->ply, "The points in the world, in metres, for MeshLab and others")
      ->type_name("FILE")
      ->check(endsIn(".ply"));
  command
      .add_option("--png", requested->png, "The depth image, light where it is near, with a scale in metres")
      ->type_name("FILE")
      ->check(endsIn(".png"));
  addForce(command, requested->if_exists);
}

}  // namespace hapticd::tools
