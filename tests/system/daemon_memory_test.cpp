// SPDX-License-Identifier: Apache-2.0
// The memory that `hapticctl doctor` expects of a configuration, against the running daemon.
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "config/yaml_loader.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"
#include "tools/hapticctl/doctor/checks.h"

namespace hapticd::test {
namespace {

constexpr double kMib = 1 << 20;

/// What mlockall() would bring into memory: all mappings of a process that may be accessed, in bytes.
std::uint64_t mappedBytes(pid_t process) {
  std::ifstream maps("/proc/" + std::to_string(process) + "/maps");
  std::uint64_t bytes = 0;
  for (std::string line; std::getline(maps, line);) {
    std::istringstream words(line);
    std::uint64_t begin = 0, end = 0;
    char dash = 0;
    std::string rights;
    words >> std::hex >> begin >> dash >> end >> rights;
    if (!rights.starts_with("---") && line.find("[v") == std::string::npos) bytes += end - begin;
  }
  return bytes;
}

class DaemonMemory : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "a sanitizer maps memory of its own";
#endif
  }
};

TEST_P(DaemonMemory, IsWhatTheDoctorExpectsAndNotMuchLess) {
  const TemporaryFolder folder;
  const std::string status = folder.path() / "Status";
  const std::string control = folder.path() / "Control";
  folder.write("hapticd.yaml",
               GetParam() +
                   "\nhandle: {driver: simulated}\nstate: {folder: " + (folder.path() / "state").string() +
                   "}\ncontrol: {status_socket: " + status + ", control_socket: " + control + "}\n");
  const auto settings = config::loadSettings(folder.path() / "hapticd.yaml");
  ASSERT_TRUE(settings) << settings.error().front().text();
  Program daemon({HAPTICD_PROGRAM, "--config", folder.path() / "hapticd.yaml"});
  ASSERT_TRUE(becomesTrue([&] {
    const Finished asked = runToEnd({HAPTICCTL_PROGRAM, "--socket", status, "--json", "status"});
    return asked.output.find("\"streaming\"") != std::string::npos;
  }));
  const double mapped_mib = static_cast<double>(mappedBytes(daemon.pid())) / kMib;
  const tools::MemoryNeed need = tools::memoryNeed(*settings);
  const double expected_mib = static_cast<double>(need.total()) / kMib;
  // the frames that wait for a slow disk are not there with a fast one
  const double least_mib = static_cast<double>(need.total() - need.depth) / kMib;
  RecordProperty("mapped_mib", std::to_string(mapped_mib));
  EXPECT_LE(mapped_mib, expected_mib);
  EXPECT_LE(least_mib, 1.35 * mapped_mib) << "it would keep a board from what it can do";
}

INSTANTIATE_TEST_SUITE_P(
    Configurations, DaemonMemory,
    testing::Values(
        "camera: {driver: synthetic}", "camera: {driver: synthetic}\ntrace: {flight_recorder_s: 60}",
        "camera: {driver: synthetic}\ngrid: {point_capacity: 1024000}",
        "camera: {driver: synthetic}\ntrace: {at_start: true, depth: true, min_free_mb: 0}",
        "camera: {driver: synthetic, width_px: 320, height_px: 240}\nsynthetic: {camera: stereo}",
        "camera: {driver: synthetic, width_px: 1280, height_px: 800}\nsynthetic: {camera: stereo}"));

}  // namespace
}  // namespace hapticd::test
