// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/bench_scene.h"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <optional>
#include <type_traits>

#include "drivers/camera/recorded/recording_reader.h"
#include "drivers/camera/synthetic/analytic_scene.h"

namespace hapticd::tools {
namespace {

namespace fs = std::filesystem;

/// A folder below the system's temporary one that is gone with the object.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "hapticbench-XXXXXX").string();
    if (mkdtemp(name.data()) != nullptr) path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

bool unpack(const fs::path& archive, const fs::path& folder) {
  std::string program = "tar", mode = "xJf", file = archive.string(), change = "-C", to = folder.string();
  char* arguments[] = {program.data(), mode.data(), file.data(), change.data(), to.data(), nullptr};
  pid_t child = 0;
  int status = 0;
  return posix_spawnp(&child, "tar", nullptr, nullptr, arguments, environ) == 0 &&
         waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

/// The first file below `folder` for which `matches` holds.
template <typename Matches>
std::optional<fs::path> findFile(const fs::path& folder, Matches matches) {
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file() && matches(entry.path())) return entry.path();
  }
  return std::nullopt;
}

config::Result<BenchScene> middleFrame(const std::string& name, const fs::path& recording) {
  const auto reader = drivers::RecordingReader::open(recording);
  if (!reader) return std::unexpected(reader.error());
  BenchScene scene{name, std::make_unique<rt::DepthFrame>()};
  if (auto read = reader->read(reader->frames().size() / 2, *scene.frame); !read) {
    return std::unexpected(read.error());
  }
  return scene;
}

config::Result<BenchSequence> firstFrames(const std::string& name, const fs::path& recording,
                                          std::size_t most_frames) {
  const auto reader = drivers::RecordingReader::open(recording);
  if (!reader) return std::unexpected(reader.error());
  BenchSequence sequence{name, {}};
  for (std::size_t i = 0; i < std::min(most_frames, reader->frames().size()); ++i) {
    sequence.frames.push_back(std::make_unique<rt::DepthFrame>());
    if (auto read = reader->read(i, *sequence.frames.back()); !read) return std::unexpected(read.error());
  }
  return sequence;
}

/// What `read(name, recording)` makes of the recording in `folder`; nothing when it holds none.
template <typename Read>
auto readRecording(const fs::path& folder, Read read)
    -> config::Result<std::optional<typename std::invoke_result_t<Read, std::string, fs::path>::value_type>> {
  const auto isIndex = [](const fs::path& file) { return file.filename() == "INDEX.txt"; };
  const auto isArchive = [](const fs::path& file) { return file.string().ends_with(".tar.xz"); };
  TemporaryFolder unpacked;
  std::optional<fs::path> index = findFile(folder, isIndex);
  if (const auto archive = findFile(folder, isArchive); !index && archive) {
    if (unpacked.path().empty() || !unpack(*archive, unpacked.path())) {
      return std::unexpected(
          config::Error{archive->string(), "cannot be unpacked", "is xz-utils installed?"});
    }
    index = findFile(unpacked.path(), isIndex);
  }
  if (!index) return std::nullopt;
  auto what = read(folder.filename().string(), index->parent_path());
  if (!what) return std::unexpected(what.error());
  return std::move(*what);
}

/// What `read(name, recording)` makes of each recording in the subfolders of `folder`, in the order of their
/// names.
template <typename Read>
auto readRecordings(const fs::path& folder, Read read)
    -> config::Result<std::vector<typename std::invoke_result_t<Read, std::string, fs::path>::value_type>> {
  std::vector<typename std::invoke_result_t<Read, std::string, fs::path>::value_type> all;
  std::error_code no_folder;
  if (!fs::is_directory(folder, no_folder)) return all;
  std::vector<fs::path> subfolders;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.is_directory()) subfolders.push_back(entry.path());
  }
  std::sort(subfolders.begin(), subfolders.end());
  for (const fs::path& subfolder : subfolders) {
    auto what = readRecording(subfolder, read);
    if (!what) return std::unexpected(what.error());
    if (*what) all.push_back(std::move(**what));
  }
  return all;
}

}  // namespace

BenchScene syntheticScene() {
  config::SyntheticSettings table;
  table.scene = config::SyntheticScene::plane;
  table.noise = config::SyntheticNoise::quantised;
  table.distance_m = 1.05;
  table.tilt_rad = -0.65;
  config::SyntheticSettings ball = table;
  ball.scene = config::SyntheticScene::sphere;
  ball.distance_m = 0.95;
  ball.sphere_radius_m = 0.12;
  BenchScene scene{"synthetic", std::make_unique<rt::DepthFrame>()};
  const auto in_front = std::make_unique<rt::DepthFrame>();
  drivers::AnalyticScene(table, {}).render(0, *scene.frame);
  drivers::AnalyticScene(ball, {}).render(0, *in_front);
  // the nearer surface has the smaller disparity; 2047 stands for none
  for (std::size_t i = 0; i < rt::kFramePixels; ++i) {
    scene.frame->raw[i] = std::min(scene.frame->raw[i], in_front->raw[i]);
  }
  scene.frame->sequence = 1;
  return scene;
}

config::Result<std::vector<BenchScene>> recordedScenes(const fs::path& folder) {
  return readRecordings(folder, middleFrame);
}

config::Result<std::vector<BenchSequence>> recordedSequences(const fs::path& folder,
                                                             std::size_t most_frames) {
  return readRecordings(folder, [most_frames](const std::string& name, const fs::path& recording) {
    return firstFrames(name, recording, most_frames);
  });
}

}  // namespace hapticd::tools
