// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "drivers/camera/synthetic/analytic_scene.h"
#include "tests/support/recordings/recording.h"
#include "tests/support/recordings/scratch_recording.h"

namespace hapticd::test {
namespace {

constexpr double kFrameRate_hz = 30;
constexpr std::uint32_t kTicksPerFrame = 2'000'000;  // of the camera's 60 MHz clock

/// A ball that moves by `amplitude_m` on either side of its mean distance.
struct Ball {
  double distance_m;
  double amplitude_m;
};

struct Parts {
  Ball ball;
  drivers::SyntheticSettings behind;
};

/// The nearer surface of the ball and the background is seen.
Parts partsOf(MadeUpScene scene) {
  drivers::SyntheticSettings behind;
  behind.frame_rate_hz = kFrameRate_hz;
  behind.seed = 2;
  behind.scene = drivers::SyntheticScene::plane;
  behind.distance_m = 1.2;
  behind.tilt_rad = 0.3;
  switch (scene) {
    case MadeUpScene::room:
      return {{1.0, 0}, behind};
    case MadeUpScene::gesture:
      return {{0.9, 0.05}, behind};
    case MadeUpScene::desk:
      behind.scene = drivers::SyntheticScene::edge;
      behind.distance_m = 0.52;
      behind.tilt_rad = 0;
      return {{0.57, 0.05}, behind};
  }
  throw std::invalid_argument("there is no such scene");
}

std::unique_ptr<drivers::AnalyticScene> sceneOf(const drivers::SyntheticSettings& settings) {
  return std::make_unique<drivers::AnalyticScene>(settings, rt::DepthModelParameters{});
}

/// Nearest in the second half of each period.
drivers::SyntheticSettings ballAt(double time_s, const Ball& ball) {
  constexpr double kPeriod_s = 1.5;
  drivers::SyntheticSettings settings;
  settings.frame_rate_hz = kFrameRate_hz;
  settings.scene = drivers::SyntheticScene::sphere;
  settings.distance_m =
      ball.distance_m + ball.amplitude_m * std::sin(2 * std::numbers::pi * time_s / kPeriod_s);
  return settings;
}

}  // namespace

std::optional<MadeUpScene> madeUpSceneFrom(std::string_view name) {
  if (name == "room") return MadeUpScene::room;
  if (name == "gesture") return MadeUpScene::gesture;
  if (name == "desk") return MadeUpScene::desk;
  return std::nullopt;
}

void makeRecording(MadeUpScene scene, std::uint32_t frames, const std::filesystem::path& folder) {
  const Parts parts = partsOf(scene);
  const auto behind = sceneOf(parts.behind);
  const auto seen = std::make_unique<rt::DepthFrame>();
  const auto ball_seen = std::make_unique<rt::DepthFrame>();
  std::string index;
  for (std::uint32_t frame = 0; frame < frames; ++frame) {
    const double time_s = (frame + 0.5) / kFrameRate_hz;
    behind->render(time_s, *seen);
    sceneOf(ballAt(time_s, parts.ball))->render(time_s, *ball_seen);
    std::ranges::transform(seen->image(), ball_seen->image(), seen->image().begin(),
                           [](std::uint16_t a, std::uint16_t b) { return std::min(a, b); });
    const std::string name =
        fmt::format("d-{:.6f}-{}.pgm", 1'500'000'000 + frame / kFrameRate_hz, (frame + 1) * kTicksPerFrame);
    writeFile(folder / name, pgmBytes(seen->image()));
    index += name + '\n';
  }
  writeFile(folder / "INDEX.txt", index);
}
namespace {

constexpr std::uint32_t kMadeUpFrames = 30;

std::filesystem::path fileOf(const std::string& archive) {
  const char* const folder = std::getenv("HAPTICD_RECORDINGS");
  return std::filesystem::path(folder != nullptr ? folder : HAPTICD_DEFAULT_RECORDINGS) / archive;
}

/// Returns the synthetic scene most similar to a real recording, identified by the number at the beginning of
/// its name.
MadeUpScene likeThatOf(const std::string& archive) {
  if (archive.starts_with("01_")) return MadeUpScene::gesture;
  return archive.starts_with("02_") ? MadeUpScene::desk : MadeUpScene::room;
}

std::filesystem::path unpacked(const std::filesystem::path& file, const std::filesystem::path& folder) {
  const std::string command = "tar xJf '" + file.string() + "' -C '" + folder.string() + "'";
  if (std::system(command.c_str()) != 0) throw std::runtime_error("cannot unpack " + file.string());
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().filename() == "INDEX.txt") return entry.path().parent_path();
  }
  throw std::runtime_error("there is no INDEX.txt in " + file.string());
}

}  // namespace

Recording::Recording(const std::string& archive) {
  const std::filesystem::path file = fileOf(archive);
  is_real_ = std::filesystem::exists(file);
  if (is_real_) {
    path_ = unpacked(file, folder_.path());
  } else {
    path_ = folder_.path();
    makeRecording(likeThatOf(archive), kMadeUpFrames, path_);
  }
}

}  // namespace hapticd::test
