// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "config/base/program.h"
#include "config/settings/settings.h"
#include "tools/hapticd-view/bridge.h"
#include "tools/hapticd-view/server/access.h"
#include "tools/lib/options/option_checks.h"

namespace hapticd::tools::view {
namespace {

constexpr const char* kTokenFile = "/run/hapticd-view/token";

int fail(const base::Error& error, int status) {
  fmt::print(stderr, "hapticd-view: {}\n", error.text());
  return status;
}

/// The folder of the page: of an installation beside the program, else that of the source tree.
std::string pageFolder() {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  for (const char* installed : {"../share/hapticd/view", "../../share/hapticd/view"}) {
    const auto folder = (program.parent_path() / installed).lexically_normal();
    if (!error && std::filesystem::exists(folder / "index.html", error)) return folder.string();
  }
  return HAPTICD_VIEW_PAGE;
}

int run(int argc, char** argv) {
  CLI::App app{
      "hapticd-view: shows what the box sees and exerts, live, to browsers and to viewers that speak the\n"
      "Foxglove WebSocket protocol. It only reads: nothing that it is sent changes the box."};
  app.footer(
      "SIGTERM or Ctrl-C ends it. 'hapticctl view' prints the address with the token.\n"
      "From another computer: ssh -L 8765:127.0.0.1:8765 BOX, and then the same address there.\n"
      "Exit status: 0 done, 64 usage, 66 no page, 69 the address cannot be used, 73 no token.");
  BridgeOptions options;
  options.version = HAPTICD_VERSION;
  std::string token_file = kTokenFile;
  bool no_token = false;
  bool make_token = false;
  app.add_option("--socket", options.socket, "of a running hapticd (" + options.socket + ")")
      ->type_name("FILE");
  app.add_option_function<std::string>(
         "--trace",
         [](const std::string& trace) {
           throw CLI::ValidationError(
               "--trace", "only a running box is shown: open " + trace + " itself in Foxglove or Lichtblick");
         })
      ->group("");  // hidden: for those who had it from a build of the sources
  app.add_option("--listen", options.listen,
                 "where to answer (" + options.listen + "); port 0: any free one, which is printed")
      ->type_name("ADDRESS:PORT");
  app.add_option("--allow-host", options.hosts,
                 "further name of this computer that clients may use, for each; others are refused")
      ->type_name("NAME");
  app.add_option("--allow-origin", options.origins,
                 "further site whose pages may look, for each: https://example.org, file://")
      ->type_name("ORIGIN");
  app.add_option("--page", options.page, "folder with the page (that of the installation)")->type_name("DIR");
  auto* file =
      app.add_option("--token-file", token_file,
                     fmt::format("with what clients must show, made when it is absent ({})", kTokenFile))
          ->type_name("FILE");
  app.add_flag("--no-token", no_token, "everybody who reaches the address may look")->excludes(file);
  app.add_flag("--make-token", make_token, "only make the token file if it is absent, and end");
  app.add_option("--idle-exit", options.idle_exit_s,
                 "end when nobody has looked for so long (60 where the service manager listens, else never)")
      ->type_name("SECONDS")
      ->check(within(1.0, 1e6));
  app.set_version_flag("-V,--version", std::string("hapticd-view ") + HAPTICD_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  if (!no_token) {
    const auto token = tokenOf(token_file);
    if (!token) return fail(token.error(), EX_CANTCREAT);
    options.token = *token;
  }
  if (make_token) return EX_OK;
  if (options.page.empty()) options.page = pageFolder();
  if (auto failure = runBridge(options)) return fail(failure->error, failure->status);
  return EX_OK;
}

}  // namespace
}  // namespace hapticd::tools::view

int main(int argc, char** argv) {
  return hapticd::base::runProgram("hapticd-view", [&] { return hapticd::tools::view::run(argc, argv); });
}
