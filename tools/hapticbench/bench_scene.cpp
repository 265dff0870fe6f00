#include "tools/hapticbench/bench_scene.h"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <optional>

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

/// Nothing when `folder` holds no recording.
config::Result<std::optional<BenchScene>> recordedScene(const fs::path& folder) {
  const auto isIndex = [](const fs::path& file) { return file.filename() == "INDEX.txt"; };
  const auto isArchive = [](const fs::path& file) { return file.string().ends_with(".tar.xz"); };
  TemporaryFolder unpacked;
  std::optional<fs::path> index = findFile(folder, isIndex);
  if (const auto archive = findFile(folder, isArchive); !index && archive) {
    if (unpacked.path().empty() || !unpack(*archive, unpacked.path())) {
      return std::unexpected(config::Error{archive->string(), "cannot be unpacked", "is xz-utils installed?"});
    }
    index = findFile(unpacked.path(), isIndex);
  }
  if (!index) return std::nullopt;
  auto scene = middleFrame(folder.filename().string(), index->parent_path());
  if (!scene) return std::unexpected(scene.error());
  return std::move(*scene);
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
  std::vector<BenchScene> scenes;
  std::error_code no_folder;
  if (!fs::is_directory(folder, no_folder)) return scenes;
  std::vector<fs::path> subfolders;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.is_directory()) subfolders.push_back(entry.path());
  }
  std::sort(subfolders.begin(), subfolders.end());
  for (const fs::path& subfolder : subfolders) {
    auto scene = recordedScene(subfolder);
    if (!scene) return std::unexpected(scene.error());
    if (*scene) scenes.push_back(std::move(**scene));
  }
  return scenes;
}

}  // namespace hapticd::tools
