// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "config/base/program.h"
#include "tools/haptic-vendor-bridge/base/vendor_device.h"
#include "tools/haptic-vendor-bridge/device_rows.h"
#include "tools/lib/bridge/bridge_program.h"

namespace hapticd::tools {
namespace {

int run(int argc, char** argv) {
  std::vector<std::string> words;
  std::string kinds;
  for (const DeviceRow& row : deviceRows()) {
    words.emplace_back(row.word);
    kinds += fmt::format("  {:<16} {}\n", row.word, row.help);
  }
  CLI::App app{
      "haptic-vendor-bridge: connects a haptic device that is driven by the library or service of its\n"
      "vendor to a hapticd with `handle.driver: udp`, on this computer or another. Nothing of a vendor is "
      "part\n"
      "of it: it uses what is installed. Kinds of devices:\n" +
      kinds};
  app.footer(
      "Ctrl-C ends it, with the table. Without --duration it runs until then. A device that is missing or\n"
      "lost is opened again each second.\n"
      "Exit status: 0 done, 64 usage, 66 no key, 69 the local address cannot be used, 73 no log.");
  std::string kind;
  VendorOptions options;
  app.add_option("kind", kind, "kind of the device, one of those above")
      ->required()
      ->type_name("KIND")
      ->check(CLI::IsMember(words));
  app.add_option("--library", options.library, "the vendor's library (where the vendor installs it)")
      ->type_name("FILE")
      ->check(CLI::ExistingFile);
  app.add_option("--device", options.device, "name or serial number of the device (the first one)")
      ->type_name("NAME");
  app.add_option("--address", options.address, "of the vendor's service (the usual one)")
      ->type_name("ADDRESS:PORT");
  BridgeProgram program(app, "haptic-vendor-bridge");
  app.set_version_flag("-V,--version", std::string("haptic-vendor-bridge ") + HAPTICD_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  for (const DeviceRow& row : deviceRows()) {
    if (row.word != kind) continue;
    VendorDevice device(row.make(options), "haptic-vendor-bridge");
    return program.run(device, [&device] { return device.start(); });
  }
  return EX_SOFTWARE;
}

}  // namespace
}  // namespace hapticd::tools

int main(int argc, char** argv) {
  return hapticd::base::runProgram("haptic-vendor-bridge", [&] { return hapticd::tools::run(argc, argv); });
}
