// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/recorded/camera_description.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "tests/support/temporary_folder.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd::drivers {
namespace {

constexpr std::string_view kGood =
    "recording:\n"
    "  version: 1\n"
    "camera:\n"
    "  width_px: 848\n"
    "  height_px: 480\n"
    "  fx_px: 421.5\n"
    "  fy_px: 422.5\n"
    "  cx_px: 423\n"
    "  cy_px: 240\n"
    "  law: linear\n"
    "  unit_m: 0.0001\n"
    "  raw_no_measurement: 0\n";

class CameraDescriptionFile : public testing::Test {
 protected:
  base::Result<CameraDescription> read(std::string_view text) const {
    return readCameraDescription(folder.write("camera.yaml", text));
  }
  std::string errorOf(std::string_view text) const {
    const auto description = read(text);
    return description ? "" : description.error().text();
  }
  /// The good file with a line replaced.
  static std::string with(std::string_view line, std::string_view other) {
    std::string text(kGood);
    const std::size_t at = text.find(line);
    EXPECT_NE(at, std::string::npos) << line;
    return text.replace(at, line.size(), other);
  }
  void expectError(const std::string& text, std::string_view part) const {
    const std::string error = errorOf(text);
    EXPECT_NE(error.find(part), std::string::npos) << part << " is not in: " << error << '\n' << text;
  }

  const test::TemporaryFolder folder;
};

TEST_F(CameraDescriptionFile, ReadsBackEveryNumberToTheBit) {
  rt::DepthModelParameters reciprocal = tools::kinectWithNoise();
  reciprocal.cx_px = 1.0 / 3;
  for (const rt::DepthModelParameters& camera : {tools::stereoCamera(848, 480, 69, 0.018, 0.0001, 0.4, 4),
                                                 tools::timeOfFlightCamera(640, 576), reciprocal}) {
    CameraDescription written{.camera = camera, .near_m = 0.07, .far_m = {}, .serial = "a'b: 00\\1"};
    written.camera.near_m = rt::DepthModelParameters{}.near_m;
    written.camera.far_m = rt::DepthModelParameters{}.far_m;
    const auto read = this->read(textOf(written));
    ASSERT_TRUE(read) << read.error().text() << textOf(written);
    EXPECT_EQ(*read, written);
  }
}

TEST_F(CameraDescriptionFile, HasDefaultsForWhatMayBeLeftOut) {
  const auto read = this->read(kGood);
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(read->camera.raw_values, 65536U);
  EXPECT_EQ(read->camera.principle, rt::DepthPrinciple::active_stereo);
  EXPECT_FALSE(read->camera.noise.isKnown());
  EXPECT_FALSE(read->near_m);
  EXPECT_EQ(read->serial, "");
}

TEST_F(CameraDescriptionFile, NamesWhatIsMissing) {
  for (const std::string_view line :
       {"  version: 1\n", "  width_px: 848\n", "  height_px: 480\n", "  fx_px: 421.5\n", "  fy_px: 422.5\n",
        "  cx_px: 423\n", "  cy_px: 240\n", "  law: linear\n", "  unit_m: 0.0001\n",
        "  raw_no_measurement: 0\n"}) {
    const std::string name(line.substr(2, line.find(':') - 2));
    expectError(with(line, ""), "." + name);
  }
  expectError(with("law: linear", "law: reciprocal"), "does not state camera.a_per_m");
  expectError("", "does not state recording.version");
}

TEST_F(CameraDescriptionFile, RefusesWrongValuesWithTheirLine) {
  const std::pair<std::string_view, std::pair<std::string_view, std::string_view>> cases[] = {
      {"version: 1", {"version: 2", "camera.yaml:2: recording.version"}},
      {"width_px: 848", {"width_px: 1281", "is not an integer from 1 to 1280"}},
      {"width_px: 848", {"width_px: 84.5", "is not an integer from 1 to 1280"}},
      {"width_px: 848", {"width_px: 8", "wrong frame size"}},
      {"height_px: 480", {"height_px: 801", "is not an integer from 1 to 800"}},
      {"fx_px: 421.5", {"fx_px: .nan", "camera.yaml:6: camera.fx_px: \".nan\" is not a finite number"}},
      {"fx_px: 421.5", {"fx_px: 0", "wrong intrinsics"}},
      {"cy_px: 240", {"cy_px: .inf", "is not a finite number"}},
      {"cy_px: 240", {"cy_px: much", "is not a number"}},
      {"law: linear", {"law: cubic", "\"cubic\" is none of: reciprocal, linear"}},
      {"unit_m: 0.0001", {"unit_m: 0", "wrong depth law"}},
      {"unit_m: 0.0001", {"unit_m: -1", "wrong depth law"}},
      {"raw_no_measurement: 0", {"raw_no_measurement: 65536", "is not an integer from 0 to 65535"}},
      {"raw_no_measurement: 0",
       {"raw_no_measurement: 4096\n  raw_values: 4096", "is none of the 4096 raw values"}},
      {"raw_no_measurement: 0",
       {"raw_no_measurement: 0\n  near_m: 2\n  far_m: 1", "wrong near and far limit"}},
      {"raw_no_measurement: 0",
       {"raw_no_measurement: 0\n  principle: magic", "is none of: structured_light"}},
      {"raw_no_measurement: 0", {"raw_no_measurement: 0\nnoise:\n  c1: -1", "wrong noise"}},
      {"raw_no_measurement: 0", {"raw_no_measurement: 0\n  focal: 3", "\"3\" is not known"}},
      {"raw_no_measurement: 0", {"raw_no_measurement: 0\nother:\n  a: 3", "other.a"}},
      {"cx_px: 423", {"cx_px: 423\n  cx_px: 424", "cx_px"}},
      {"recording:", {"recording: [", "camera.yaml"}}};
  for (const auto& [line, changed] : cases) expectError(with(line, changed.first), changed.second);
}

TEST_F(CameraDescriptionFile, RefusesALawWithoutADepthInItsLimits) {
  expectError(with("raw_no_measurement: 0", "raw_no_measurement: 0\n  near_m: 7"), "wrong depth law");
}

}  // namespace
}  // namespace hapticd::drivers
